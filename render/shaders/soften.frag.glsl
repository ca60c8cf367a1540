// Mean of 3 x 3 pixels: the noise that turns the shadow's taps has the same mean in every such
// block, so its grain vanishes.
layout(binding = 0) uniform sampler2D grainy;
out vec4 result;

void main() {
    ivec2 middle = ivec2(gl_FragCoord.xy), last = textureSize(grainy, 0) - 1;
    vec4 sum = vec4(0.0);
    for (int j = -1; j <= 1; j++) {
        for (int i = -1; i <= 1; i++) {
            sum += texelFetch(grainy, clamp(middle + ivec2(i, j), ivec2(0), last), 0);
        }
    }
    result = sum / 9.0;
}
