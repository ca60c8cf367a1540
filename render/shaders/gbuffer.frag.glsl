// MEASURED: the words carry a number instead of a place on the panel.
in vec3 normal;
in vec3 tangent;
in vec2 uv;
#ifdef MEASURED
in float value;
#else
uniform vec2 panel_scale; // [1/m] 1 / panel size
#endif
out uvec4 words;

void main() {
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
