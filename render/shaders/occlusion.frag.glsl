// Ambient occlusion from depth alone: a spiral of taps whose reach grows along it.
layout(binding = 0) uniform sampler2D linear_map; // depth along the view [m]
in vec2 place;
out vec2 result; // visible part, depth

const int TAPS = 14;
const float NEAREST = 0.05, FARTHEST = 0.34; // of the scale: reach of the first and last tap
const float STRENGTH = 2.5, HORIZON = 0.1;   // surfaces below the horizon do not darken
const float TURNS = 2.39996323;

vec3 at(vec2 p) { return view_position(p * 2.0 - 1.0, textureLod(linear_map, p, 0.0).r); }

void main() {
    vec2 texel = 1.0 / vec2(textureSize(linear_map, 0));
    vec3 p = at(place);
    vec3 left = p - at(place - vec2(texel.x, 0.0)), right = at(place + vec2(texel.x, 0.0)) - p;
    vec3 down = p - at(place - vec2(0.0, texel.y)), up = at(place + vec2(0.0, texel.y)) - p;
    vec3 du = abs(left.z) < abs(right.z) ? left : right;
    vec3 dv = abs(down.z) < abs(up.z) ? down : up;
    vec3 n = normalize(cross(dv, du));
    vec2 half_view = ray.xy * mix(1.0, p.z, ray.z);
    float turn = noise_screen(gl_FragCoord.xy) * TAU;
    float sum = 0.0;
    for (int i = 0; i < TAPS; i++) {
        float part = (float(i) + 0.5) / float(TAPS);
        float reach = mix(NEAREST, FARTHEST, part) * centre.w;
        float angle = float(i) * TURNS + turn;
        vec2 tap = place + vec2(cos(angle), sin(angle)) * reach * sqrt(part) * 0.5 / half_view;
        vec3 v = at(tap) - p;
        float squared = dot(v, v) + 1e-12;
        float falloff = max(1.0 - squared / (1.6 * reach * reach), 0.0);
        sum += max(dot(n, v) * inversesqrt(squared) - HORIZON, 0.0) * falloff;
    }
    float visible = saturate(1.0 - STRENGTH * sum / float(TAPS));
    result = vec2(visible * visible, p.z);
}
