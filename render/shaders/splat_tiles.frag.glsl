// The farthest depth seen in each tile of the layer: surfels that lie behind it need no sum.
layout(binding = 0) uniform sampler2D depth_map;
out float farthest;

const int TILE = 32; // [sample], an even number; splat.vert.glsl says the same

void main() {
    vec2 one = 1.0 / vec2(textureSize(depth_map, 0)), corner = floor(gl_FragCoord.xy) * float(TILE) + 1.0;
    vec4 deepest = vec4(0.0);
    for (int j = 0; j < TILE; j += 2) {
        for (int i = 0; i < TILE; i += 2) { // four samples around a point between them
            deepest = max(deepest, textureGather(depth_map, (corner + vec2(i, j)) * one));
        }
    }
    farthest = max(max(deepest.x, deepest.y), max(deepest.z, deepest.w));
}
