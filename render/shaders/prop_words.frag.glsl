in vec3 normal;
in vec2 depth_clip;
out uvec4 words;

void main() {
    float window_depth = 0.5 + 0.5 * depth_clip.x / depth_clip.y;
    words = uvec4(packSnorm2x16(octahedral_encode(normalize(normal))), floatBitsToUint(window_depth), 0u, 0u);
}
