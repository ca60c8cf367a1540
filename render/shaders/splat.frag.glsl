// Adds up what the surfels of one surface say, weighted by the distance from their middles.
in vec2 disc;
#if !defined(WHOLE) || !defined(VISIBLE)
in vec2 uv;
#endif
#ifndef WHOLE
flat in vec4 line_a;
flat in vec3 line_b;
#endif
#ifndef VISIBLE
in vec2 across_view;
in vec2 direction;
noperspective in float window_depth;
#ifdef MEASURED
in float value;
#else
uniform vec2 panel_scale; // [1/m] 1 / panel size
#endif
layout(location = 0) out vec4 sum_frame;
layout(location = 1) out vec4 sum_place; // xy: place; z: window depth; w: weight, below zero on the back
#endif

const float RIM = 0.985; // of the squared radius: weights stay above rounding

void main() {
    float r2 = dot(disc, disc);
#ifdef WHOLE
    bool outside = r2 > RIM;
#else
    float a = dot(line_a.xyz, vec3(uv, 1.0)), b = dot(line_b, vec3(uv, 1.0));
    bool outside = r2 > RIM || (line_a.w > 1.5 ? max(a, b) : min(a, b)) < 0.0;
#endif
    if (outside) {
        discard;
    }
#ifndef VISIBLE
    float weight = (1.0 - r2) * (gl_FrontFacing ? 1.0 - r2 : r2 - 1.0);
#ifdef MEASURED
    vec2 place = vec2(value, 0.0);
#else
    vec2 place = uv * panel_scale;
#endif
    sum_frame = weight * vec4(across_view, direction);
    sum_place = weight * vec4(place, window_depth, 1.0);
#endif
}
