// Measuring looks: the colour of a number, darkened a little by a soft light so that the shape is
// seen. No shadow of the key light, no highlights, no tone mapping: the hue is that of the legend.
layout(binding = 0) uniform usampler2D gbuffer;
in vec2 place;
out vec4 result;

const int STEPS = 64; // COLORMAP_STEPS

// Mirrors MeasuredBlock in render/look.h (std140).
layout(std140, binding = 1) uniform Measured {
    vec4 range; // x: lowest; y: 1 / (highest - lowest)
    vec4 colors[STEPS + 1]; // sRGB
};

const float DARKEST_LIGHT = 0.55, DARKEST_CORNER = 0.60; // of linear light

void main() {
    uvec4 words = texelFetch(gbuffer, ivec2(gl_FragCoord.xy), 0);
    vec3 n = octahedral_decode(unpackSnorm2x16(words.x));
    float depth = uintBitsToFloat(words.y), value = uintBitsToFloat(words.z);
    float at = saturate((value - range.x) * range.y) * float(STEPS);
    int low = min(int(at), STEPS - 1);
    vec3 color = srgb_decode(mix(colors[low].rgb, colors[low + 1].rgb, at - float(low)));
    vec3 v = view_vector(world_position(place * 2.0 - 1.0, depth));
    float lit = 0.5 * saturate(dot(n, v)) + 0.5 * saturate(0.5 + 0.5 * dot(n, key_light.xyz));
    float visible = occlusion_at(place, depth_linear(depth));
    color *= mix(DARKEST_LIGHT, 1.0, lit) * mix(DARKEST_CORNER, 1.0, visible);
#ifdef LINEAR
    result = vec4(color, 1.0);
#else
    result = vec4(srgb_encode(color), 1.0);
#endif
}
