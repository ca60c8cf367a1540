// common.glsl: the stage that every pass sees, packing, noise, tone mapping.
// Linear colours, metres, z up.

// Mirrors StageBlock in render/stage.h (std140).
layout(std140, binding = 0) uniform Stage {
    mat4 world_clip;   // camera
    mat4 clip_world;
    mat4 world_light;  // world -> shadow map: x, y, depth in 0..1
    vec4 eye;          // xyz: eye, w 1; orthographic: unit vector towards the eye, w 0
    vec4 forward;      // xyz: unit view direction; w: dot(eye, forward)
    vec4 ray;          // xy: half extent of the view at depth 1 (perspective) or anywhere; z: 1 perspective
    vec4 depth;        // window depth d -> depth along the view: (x + y d) / (z + w d) [m]
    vec4 key_light;    // xyz: unit vector to the light
    vec4 key_color;
    vec4 rim_light;
    vec4 rim_color;
    vec4 fill_light;
    vec4 fill_color;
    vec4 ambient_low;  // from below
    vec4 ambient_high; // from above
    vec4 wall;         // xyz: horizontal unit vector from the camera to the wall; w: floor height [m]
    vec4 cove;         // x: where along `wall` the floor begins to rise [m]; y: radius [m]; z: 1 = floor drawn
    vec4 centre;       // xyz: what the camera looks at; w: half height of the view there [m], "the scale"
    vec4 shadow;       // x: width of a texel [m]; y: depth range [m]; z: texels; w: receiver offset [m]
    vec4 size;         // xy: output [px]; z: samples along a pixel side; w: light that sheer cloth takes
};

const float PI = 3.14159265;
const float TAU = 6.28318531;

float saturate(float x) { return clamp(x, 0.0, 1.0); }
vec3 saturate3(vec3 x) { return clamp(x, 0.0, 1.0); }

// ---- geometry ----

// Depth along the view [m] of a window depth.
float depth_linear(float d) { return (depth.x + depth.y * d) / (depth.z + depth.w * d); }

// World position of normalised device coordinates and window depth.
vec3 world_position(vec2 ndc, float d) {
    vec4 p = clip_world * vec4(ndc, d * 2.0 - 1.0, 1.0);
    return p.xyz / p.w;
}

// Position in the camera's frame (right, up, along the view) at linear depth z.
vec3 view_position(vec2 ndc, float z) { return vec3(ndc * ray.xy * mix(1.0, z, ray.z), z); }

// Unit vector from p to the eye.
vec3 view_vector(vec3 p) { return normalize(eye.xyz - eye.w * p); }

// Unit vectors to the right and up across a view vector, in the camera's sense.
void view_frame(vec3 view, out vec3 across, out vec3 up) {
    vec3 above = vec3(world_clip[0][1], world_clip[1][1], world_clip[2][1]); // along the camera's up
    across = normalize(cross(above, view));
    up = cross(view, across);
}

// Unit vectors across n, without a branch and continuous but at n.z = 0 (Duff et al. 2017).
void frame_around(vec3 n, out vec3 s, out vec3 t) {
    float side = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (side + n.z);
    float b = n.x * n.y * a;
    s = vec3(1.0 + side * n.x * n.x * a, side * b, -side * n.x);
    t = vec3(b, side + n.y * n.y * a, -n.y);
}

// ---- the four words of the G-buffer (mesh and splats write the same) ----
//   x: normal towards the viewer, octahedral, 16 + 16 bits
//   y: window depth, bits of a float
//   z: u / panel width, 21 bits | low 11 bits of the tangent's angle
//   w: v / panel height, 21 bits | log2 of the footprint, 8 bits | high 2 bits of the angle | back side

const float UV_STEPS = 2097151.0;   // 21 bits
const float ANGLE_STEPS = 8192.0;   // 13 bits
const float FOOTPRINT_FINEST = -20.0; // log2 [m]: about a micrometre
const float FOOTPRINT_STEPS = 255.0 / 24.0;

vec2 octahedral_encode(vec3 n) {
    n /= abs(n.x) + abs(n.y) + abs(n.z);
    vec2 folded = (1.0 - abs(n.yx)) * vec2(n.x >= 0.0 ? 1.0 : -1.0, n.y >= 0.0 ? 1.0 : -1.0);
    return n.z >= 0.0 ? n.xy : folded;
}

vec3 octahedral_decode(vec2 e) {
    vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    float fold = max(-n.z, 0.0);
    n.x += n.x >= 0.0 ? -fold : fold;
    n.y += n.y >= 0.0 ? -fold : fold;
    return normalize(n);
}

// An angle in 0..1 that needs no arc tangent, of a vector in the plane, and back.
float diamond_angle(vec2 d) {
    float a = d.y / (abs(d.x) + abs(d.y) + 1e-20);
    return fract(0.25 * (d.x >= 0.0 ? a : 2.0 - a));
}

vec2 diamond_direction(float angle) {
    float a = angle * 4.0;
    float x = a < 2.0 ? 1.0 - a : a - 3.0;
    float y = a < 1.0 ? a : (a < 3.0 ? 2.0 - a : a - 4.0);
    return vec2(x, y);
}

uvec4 gbuffer_pack(vec3 n, vec3 tangent, float window_depth, vec2 uv, float footprint, bool back) {
    uint normal = packSnorm2x16(octahedral_encode(n));
    vec3 s, t; // the frame of the normal that the reader will see
    frame_around(octahedral_decode(unpackSnorm2x16(normal)), s, t);
    uint angle = uint(diamond_angle(vec2(dot(tangent, s), dot(tangent, t))) * ANGLE_STEPS) & 8191u;
    uvec2 place = uvec2(saturate3(vec3(uv, 0.0)).xy * UV_STEPS + 0.5);
    uint print = uint(clamp((log2(footprint) - FOOTPRINT_FINEST) * FOOTPRINT_STEPS, 0.0, 255.0));
    return uvec4(normal, floatBitsToUint(window_depth), place.x << 11 | (angle & 2047u),
                 place.y << 11 | print << 3 | (angle >> 11) << 1 | (back ? 1u : 0u));
}

struct Sample {
    vec3 normal;  // unit, towards the viewer
    vec3 tangent; // unit, along u
    float depth;  // window depth
    vec2 uv;      // 0..1 over the panel
    float footprint; // [m] of cloth covered by a sample
    bool back;
};

Sample gbuffer_unpack(uvec4 words) {
    Sample g;
    g.normal = octahedral_decode(unpackSnorm2x16(words.x));
    g.depth = uintBitsToFloat(words.y);
    g.uv = vec2(words.z >> 11, words.w >> 11) / UV_STEPS;
    uint angle = (words.z & 2047u) | (words.w >> 1 & 3u) << 11;
    vec3 s, t;
    frame_around(g.normal, s, t);
    vec2 d = diamond_direction((float(angle) + 0.5) / ANGLE_STEPS);
    g.tangent = normalize(s * d.x + t * d.y);
    g.footprint = exp2(float(words.w >> 3 & 255u) / FOOTPRINT_STEPS + FOOTPRINT_FINEST);
    g.back = (words.w & 1u) != 0u;
    return g;
}

// ---- noise ----

// Interleaved gradient noise (Jimenez 2014), 0..1.
float noise_screen(vec2 pixel) { return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715)))); }

// Noise for the samples of a pixel: one random turn a pixel, a quarter turn between its samples.
float noise_sample(vec2 position) {
    vec2 pixel = floor(position / size.z), part = floor(position - pixel * size.z);
    return fract(noise_screen(pixel + 0.5) + dot(part, vec2(0.25, 0.5)));
}

uint noise_bits(uint x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ (x >> 16);
}

// -1..1 for a pair of integers.
float noise_cell(ivec2 cell) {
    uint bits = noise_bits(uint(cell.x) * 0x9e3779b9u ^ noise_bits(uint(cell.y)));
    return float(bits >> 8) * (2.0 / 16777215.0) - 1.0;
}

// Smooth noise, -1..1, one bump a unit.
float noise_smooth(vec2 p) {
    vec2 c = floor(p), f = p - c;
    ivec2 i = ivec2(c);
    f = f * f * (3.0 - 2.0 * f);
    float a = mix(noise_cell(i), noise_cell(i + ivec2(1, 0)), f.x);
    float b = mix(noise_cell(i + ivec2(0, 1)), noise_cell(i + ivec2(1, 1)), f.x);
    return mix(a, b, f.y);
}

// ---- colour ----

// AgX (T. Sobotka), polynomial fit by B. Wrensch (MIT), with a look: more contrast and colour.
// The result is display code, taken as sRGB: written as it is into an sRGB texture, it is linear
// when read, without a power function on the way.
const float AGX_POWER = 1.28;
const float AGX_SATURATION = 1.28;

vec3 tone_map(vec3 color) {
    const mat3 inset = mat3(0.842479062253094, 0.0423282422610123, 0.0423756549057051, 0.0784335999999992,
                            0.878468636469772, 0.0784336, 0.0792237451477643, 0.0791661274605434,
                            0.879142973793104);
    const mat3 outset = mat3(1.19687900512017, -0.0528968517574562, -0.0529716355144438, -0.0980208811401368,
                             1.15190312990417, -0.0980434501171241, -0.0990297440797205, -0.0989611768448433,
                             1.15107367264116);
    const float ev_low = -12.47393, ev_high = 4.026069;
    vec3 x = clamp(log2(max(inset * color, vec3(1e-10))), ev_low, ev_high);
    x = (x - ev_low) / (ev_high - ev_low);
    vec3 x2 = x * x, x4 = x2 * x2;
    x = 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232;
    x = pow(max(x, vec3(0.0)), vec3(AGX_POWER));
    float luma = dot(x, vec3(0.2126, 0.7152, 0.0722));
    x = luma + AGX_SATURATION * (x - luma);
    return saturate3(outset * x);
}

vec3 srgb_decode(vec3 code) {
    return mix(code / 12.92, pow((code + 0.055) / 1.055, vec3(2.4)), step(vec3(0.04045), code));
}

vec3 srgb_encode(vec3 light) {
    return mix(light * 12.92, 1.055 * pow(max(light, vec3(1e-6)), vec3(1.0 / 2.4)) - 0.055,
               step(vec3(0.0031308), light));
}

// What a sample of this light is written as: display code, or with LINEAR the light itself; and the
// light that a reader of it sees.
#ifdef LINEAR
vec3 written(vec3 light) { return light; }
vec3 seen(vec3 light) { return light; }
#else
vec3 written(vec3 light) { return tone_map(light); }
vec3 seen(vec3 light) { return srgb_decode(tone_map(light)); }
#endif

// Light between near surfaces of one colour (Jimenez et al. 2016).
vec3 occlusion_colored(float visible, vec3 albedo) {
    vec3 a = 2.0404 * albedo - 0.3324;
    vec3 b = -4.7951 * albedo + 0.6417;
    vec3 c = 2.7552 * albedo + 0.6903;
    return max(vec3(visible), ((visible * a + b) * visible + c) * visible);
}

vec3 ambient_light(vec3 n) { return mix(ambient_low.rgb, ambient_high.rgb, n.z * 0.5 + 0.5); }

// ---- the studio: floor, cove, wall ----

const float FARTHEST_RAY = 1e3; // of the scale

// Where the view ray of `ndc` meets the studio; w: 0 floor, 1 cove, 2 wall.
vec4 backdrop_point(vec2 ndc) {
    vec3 a = world_position(ndc, 0.0);
    vec3 d = normalize(world_position(ndc, 1.0) - a);
    float along = dot(a - centre.xyz, wall.xyz), climb = dot(d, wall.xyz), height = a.z - wall.w;
    float far = FARTHEST_RAY * centre.w, radius = cove.y;
    float t_floor = d.z < -1e-6 ? -height / d.z : far;
    vec2 o = vec2(along - cove.x, height - radius), e = vec2(climb, d.z);
    float ee = max(dot(e, e), 1e-12), oe = dot(o, e), oo = dot(o, o) - radius * radius;
    float t_cove = (sqrt(max(oe * oe - ee * oo, 0.0)) - oe) / ee;
    float t_wall = climb > 1e-6 ? (cove.x + radius - along) / climb : far;
    bool on_floor = t_floor < far && along + t_floor * climb <= cove.x;
    bool on_cove = !on_floor && height + t_cove * d.z < radius && along + t_cove * climb > cove.x;
    float t = clamp(on_floor ? t_floor : (on_cove ? t_cove : t_wall), 0.0, far);
    t = cove.z > 0.0 ? t : far;
    return vec4(a + t * d, on_floor ? 0.0 : (on_cove ? 1.0 : 2.0));
}

vec3 backdrop_normal(vec3 p, float kind) {
    float along = dot(p - centre.xyz, wall.xyz);
    vec3 on_cove = wall.xyz * (cove.x - along) + vec3(0.0, 0.0, wall.w + cove.y - p.z);
    return kind < 0.5 ? vec3(0.0, 0.0, 1.0) : (kind < 1.5 ? normalize(on_cove) : -wall.xyz);
}
