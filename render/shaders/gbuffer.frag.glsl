// MEASURED: the words carry a number instead of a place on the panel.
// PEEL: only what lies behind the layer before and in front of what is not sheer.
in vec3 normal;
in vec3 tangent;
in vec2 uv;
#ifdef MEASURED
in float value;
#else
uniform vec2 panel_scale; // [1/m] 1 / panel size
#endif
#ifdef PEEL
layout(binding = 0) uniform usampler2D opaque; // words of what is not sheer
layout(binding = 2) uniform usampler2D before; // words of the layer in front
const float PEEL_GAP = 1e-7; // of window depth: rounding of a float
#endif
out uvec4 words;

void main() {
#ifdef PEEL
    ivec2 at = ivec2(gl_FragCoord.xy);
    float nearest = uintBitsToFloat(texelFetch(before, at, 0).y);
    if (gl_FragCoord.z <= nearest + PEEL_GAP || gl_FragCoord.z >= uintBitsToFloat(texelFetch(opaque, at, 0).y)) {
        discard;
    }
#endif
    bool back = !gl_FrontFacing;
    vec3 n = normalize(normal);
#ifdef MEASURED
    words = uvec4(packSnorm2x16(octahedral_encode(back ? -n : n)), floatBitsToUint(gl_FragCoord.z),
                  floatBitsToUint(value), 0u);
#else
    vec2 across = dFdx(uv), down = dFdy(uv);
    float footprint = sqrt(max(dot(across, across), dot(down, down)));
    words = gbuffer_pack(back ? -n : n, tangent, gl_FragCoord.z, uv * panel_scale, footprint, back);
#endif
}
