// shadow.glsl: soft shadow of the key light (PCSS, Fernando 2005) and ambient occlusion look-up.

#ifndef BLOCKER_TAPS
#define BLOCKER_TAPS 4
#endif
#ifndef FILTER_TAPS
#define FILTER_TAPS 6
#endif

layout(binding = 3) uniform sampler2D shadow_map;  // window depth from the light, nearest
layout(binding = 4) uniform sampler2D occlusion_map; // half resolution: x visible part, y depth [m]

const float LIGHT_WIDTH = 0.12;    // width of the penumbra per distance to the blocker
const float NARROWEST = 1.2;       // [texel] penumbra: hides the texels
const float SHADOW_EPSILON = 2e-4; // of the depth range: against acne from the coarser caster
const float GOLDEN_ANGLE = 2.39996323;

vec2 disc_tap(int i, int count) {
    float radius = sqrt((float(i) + 0.5) / float(count));
    float angle = float(i) * GOLDEN_ANGLE;
    return radius * vec2(cos(angle), sin(angle));
}

#ifdef VEILED
layout(binding = 5) uniform sampler2D veil_map; // the same of sheer cloth
#endif

// The part of the key light that passes the casters of a map. q: place in it; search: [texel]
// radius of the search for blockers, also the widest penumbra; turned: the taps' frame.
float shadow_part(sampler2D map, vec3 q, float search, mat2 turned) {
    float reference = q.z - SHADOW_EPSILON;
    float limit = min(reference, 0.9999); // beyond the map's far side nothing blocks but casters
    float sum = 0.0, blockers = 0.0;
    for (int i = 0; i < BLOCKER_TAPS; i++) {
        float z = textureLod(map, q.xy + turned * (disc_tap(i, BLOCKER_TAPS) * search), 0.0).r;
        float blocks = z < limit ? 1.0 : 0.0;
        sum += blocks * z;
        blockers += blocks;
    }
    float gap = (reference - sum / max(blockers, 1.0)) * shadow.y; // [m]
    float radius = clamp(gap * LIGHT_WIDTH / shadow.x, NARROWEST, search);
    float lit = 0.0;
    for (int i = 0; i < FILTER_TAPS; i++) {
        float z = textureLod(map, q.xy + turned * (disc_tap(i, FILTER_TAPS) * radius), 0.0).r;
        lit += z < limit ? 0.0 : 1.0;
    }
    return blockers > 0.0 ? lit / float(FILTER_TAPS) : 1.0;
}

// The part of the key light that reaches p. `towards`: unit normal on the side of the light;
// search: as above; turn: 0..1.
float shadow_key(vec3 p, vec3 towards, float search, float turn) {
    vec3 q = (world_light * vec4(p + towards * shadow.w, 1.0)).xyz;
    float texel = 1.0 / shadow.z;
    float c = cos(turn * TAU), s = sin(turn * TAU);
    mat2 turned = mat2(c, s, -s, c) * texel;
    float lit = shadow_part(shadow_map, q, search, turned);
#ifdef VEILED
    lit *= 1.0 - size.w * (1.0 - shadow_part(veil_map, q, search, turned));
#endif
    return lit;
}

// Occlusion at `place` (0..1 over the image), taking only neighbours of about depth z [m].
const float OCCLUSION_DEPTH = 0.02; // of the scale: depth step that counts as another surface

float occlusion_at(vec2 place, float z) {
    vec2 grid = place * vec2(textureSize(occlusion_map, 0)) - 0.5;
    vec2 f = fract(grid);
    vec2 corner = (floor(grid) + 1.0) / vec2(textureSize(occlusion_map, 0));
    vec4 visible = textureGather(occlusion_map, corner, 0);
    vec4 depths = textureGather(occlusion_map, corner, 1);
    vec4 weight = vec4((1.0 - f.x) * f.y, f.x * f.y, f.x * (1.0 - f.y), (1.0 - f.x) * (1.0 - f.y));
    vec4 step_size = (depths - z) / (OCCLUSION_DEPTH * centre.w);
    weight = weight / (1.0 + step_size * step_size * 16.0) + 1e-6;
    return dot(visible, weight) / dot(weight, vec4(1.0));
}
