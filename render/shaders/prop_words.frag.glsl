in vec3 normal;
out uvec4 words;

void main() {
    words = uvec4(packSnorm2x16(octahedral_encode(normalize(normal))), floatBitsToUint(gl_FragCoord.z), 0u, 0u);
}
