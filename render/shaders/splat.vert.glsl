// Surfels: one triangle around each. VISIBLE: only their depth. Else they come a little nearer, so that
// what lies in the surface seen is summed and what lies behind it is not. WHOLE: only discs that the border does
// not cut, which are nearly all, without its lines; else only those that it cuts.
layout(std430, binding = 0) readonly buffer Vertices { float vertices[]; }; // SurfaceVertex
layout(std430, binding = 1) readonly buffer Surfels { float surfels[]; };   // Surfel
#ifdef MEASURED
layout(std430, binding = 2) readonly buffer Values { float values[]; };
layout(std430, binding = 4) readonly buffer Slopes { float slopes[]; }; // of the values
#endif

#ifndef VISIBLE
layout(std430, binding = 3) readonly buffer Bends { float bends[]; }; // n_u, n_v
#endif

const int VERTEX_FLOATS = 9, SURFEL_FLOATS = 10;
const float NEARER = 0.30; // of the radius, across the surface: more blends layers, less cuts discs

out vec2 disc;           // place in the disc; its rim is at 1
#if !defined(WHOLE) || !defined(VISIBLE)
out vec2 uv;             // [m] from the panel's corner
#endif
#ifndef WHOLE
flat out vec4 line_a;    // clip lines; w: 2 = either is enough
flat out vec3 line_b;
#endif
#ifndef VISIBLE
out vec2 across_view;    // of the normal, linear in the disc
out vec2 direction;      // of the tangent around the normal
noperspective out float window_depth; // where it really is
#ifdef MEASURED
out float value;
#endif

layout(binding = 0) uniform sampler2D tiles; // farthest depth seen in each
const float TILE = 32.0;                      // [sample]

// Whether every sample of a disc lies behind what is seen there. The disc lies within `reach` of p [m],
// and comes `nearer` [m] to be summed. Only discs over no more than two tiles each way are asked.
bool is_hidden(vec3 p, float reach, float nearer) {
    vec4 clip = world_clip * vec4(p, 1.0);
    vec2 ndc = clip.xy / clip.w;
    float along = dot(p, forward.xyz) - forward.w, front = along - reach;
    vec2 slope = abs(ndc) * ray.xy;
    vec2 extent = reach * mix(vec2(1.0), (1.0 + slope) / max(front, 1e-6 * reach), ray.z) / ray.xy;
    vec2 to_tiles = 0.5 * size.xy * size.z / TILE, high = (ndc + extent + 1.0) * to_tiles;
    vec4 behind = textureGather(tiles, floor(high) / vec2(textureSize(tiles, 0)));
    float z = front - nearer, farthest = max(max(behind.x, behind.y), max(behind.z, behind.w));
    float window = (depth.x - z * depth.z) / (z * depth.w - depth.y); // of depth_linear
    vec2 span = 2.0 * extent * to_tiles;
    return z > 0.0 && max(span.x, span.y) < 1.0 && window > farthest;
}
#endif

vec3 vertex_part(int at) { return vec3(vertices[at], vertices[at + 1], vertices[at + 2]); }

void main() {
    int number = gl_VertexID / 3, corner = gl_VertexID - 3 * number;
    int v = number * VERTEX_FLOATS, s = number * SURFEL_FLOATS;
    vec3 p = vertex_part(v), du = vertex_part(v + 3), dv = vertex_part(v + 6);
    float radius = max(surfels[s + 2], 0.0);
    // corners of the equilateral triangle around the unit circle
    disc = corner == 0 ? vec2(2.0, 0.0) : vec2(-1.0, corner == 1 ? 1.7320508 : -1.7320508);
#if !defined(WHOLE) || !defined(VISIBLE)
    uv = vec2(surfels[s], surfels[s + 1]) + radius * disc;
#endif
#ifdef WHOLE
    radius = surfels[s + 3] == 0.0 ? radius : 0.0; // the others are drawn apart
#else
    line_a = vec4(surfels[s + 4], surfels[s + 5], surfels[s + 6], surfels[s + 3]);
    line_b = vec3(surfels[s + 7], surfels[s + 8], surfels[s + 9]);
#endif
    vec3 view = view_vector(p), face = normalize(cross(du, dv) + vec3(0.0, 0.0, 1e-30));
    bool back = dot(face, view) < 0.0;
    vec3 n = back ? -face : face;
#ifndef VISIBLE
    float nearer = NEARER * radius * max(length(du), length(dv)) / max(dot(n, view), 0.1);
    radius = is_hidden(p, radius * sqrt(dot(du, du) + dot(dv, dv)), nearer) ? 0.0 : radius;
#endif
    vec3 at = p + radius * (disc.x * du + disc.y * dv);
    gl_Position = world_clip * vec4(at, 1.0);
#ifndef VISIBLE
    window_depth = gl_Position.z / gl_Position.w * 0.5 + 0.5;
    vec4 moved = world_clip * vec4(at + view_vector(at) * nearer, 1.0);
    gl_Position.z = moved.z / moved.w * gl_Position.w; // the same pixels as VISIBLE, to the bit
    int bend = number * 6;
    vec3 nu = vec3(bends[bend], bends[bend + 1], bends[bend + 2]);
    vec3 nv = vec3(bends[bend + 3], bends[bend + 4], bends[bend + 5]);
    vec3 turned = n + radius * (disc.x * nu + disc.y * nv) * (back ? -1.0 : 1.0);
    vec3 across, up, first, second, sight = view_vector(at);
    view_frame(sight, across, up);
    across_view = vec2(dot(turned, across), dot(turned, up));
    turned = normalize(turned);
    vec3 tangent = normalize(du - dot(du, turned) * turned + vec3(1e-30, 0.0, 0.0));
    frame_around(vec3(dot(turned, across), dot(turned, up), max(dot(turned, sight), 0.0)), first, second);
    tangent = vec3(dot(tangent, across), dot(tangent, up), dot(tangent, sight));
    direction = vec2(dot(tangent, first), dot(tangent, second));
#ifdef MEASURED
    value = values[number] + radius * (disc.x * slopes[2 * number] + disc.y * slopes[2 * number + 1]);
#endif
#endif
}
