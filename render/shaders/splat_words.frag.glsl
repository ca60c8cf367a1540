// From the sums of surfels to the words that the mesh writes too.
layout(binding = 0) uniform sampler2D sum_frame;
layout(binding = 1) uniform sampler2D sum_place;
in vec2 place;
out uvec4 words;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 frame = texelFetch(sum_frame, at, 0), sums = texelFetch(sum_place, at, 0);
    float whole = 1.0 / (abs(sums.w) > 1e-12 ? sums.w : 1e-12); // below zero: the back
    bool back = whole < 0.0;
    frame *= whole;
    sums *= whole;
    vec3 seen = vec3(frame.xy, 0.0);
    seen.z = sqrt(max(1.0 - dot(seen.xy, seen.xy), 1e-6));
    seen = normalize(seen);
    vec3 p = world_position(place * 2.0 - 1.0, sums.z), view = view_vector(p), across, up, first, second;
    view_frame(view, across, up);
    frame_around(seen, first, second);
    vec2 direction = normalize(frame.zw + vec2(1e-20, 0.0));
    vec3 tangent = first * direction.x + second * direction.y;
    mat3 world = mat3(across, up, view);
    vec3 n = normalize(world * seen);
#ifdef MEASURED
    words = uvec4(packSnorm2x16(octahedral_encode(n)), floatBitsToUint(sums.z), floatBitsToUint(sums.x), 0u);
#else
    // cloth under a sample: its width there, longer where the surface is seen at a slant
    float width = 2.0 * ray.x * mix(1.0, depth_linear(sums.z), ray.z) / (size.x * size.z);
    float slant = max(seen.z, 0.02);
    words = gbuffer_pack(n, world * tangent, sums.z, sums.xy, width / slant, back);
#endif
}
