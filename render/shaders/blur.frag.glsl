// One direction of a 7-tap blur that stops at depth steps.
layout(binding = 0) uniform sampler2D occlusion_in;
uniform vec2 direction; // one texel
in vec2 place;
out vec2 result;

const int REACH = 3;

void main() {
    vec2 middle = textureLod(occlusion_in, place, 0.0).rg;
    float sum = 0.0, weights = 0.0;
    for (int i = -REACH; i <= REACH; i++) {
        vec2 tap = textureLod(occlusion_in, place + direction * float(i), 0.0).rg;
        float gap = (tap.y - middle.y) / (0.03 * centre.w);
        float weight = max(1.0 - gap * gap, 0.0) * (1.0 - float(i * i) / 16.0);
        sum += weight * tap.x;
        weights += weight;
    }
    result = vec2(sum / weights, middle.y);
}
