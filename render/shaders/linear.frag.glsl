// Depth along the view of the nearest surface: cloth, props, floor or wall.
layout(binding = 0) uniform sampler2D depth_map;
in vec2 place;
out float result;

void main() {
    float d = textureLod(depth_map, place, 0.0).r;
    float behind = dot(backdrop_point(place * 2.0 - 1.0).xyz, forward.xyz) - forward.w;
    result = min(depth_linear(d), behind);
}
