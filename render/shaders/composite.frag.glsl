// Cloth over backdrop, vignette, display encoding, dither. Writes the rows from the top down.
layout(binding = 0) uniform sampler2D backdrop; // linear, half resolution
layout(binding = 1) uniform sampler2D layer;    // premultiplied, linear when read
in vec2 place;
out vec4 result;

const float VIGNETTE = 0.55;

void main() {
    vec2 from = vec2(place.x, 1.0 - place.y);
    vec4 front = textureLod(layer, from, 0.0); // between 2 x 2 samples: their mean
    vec3 color = textureLod(backdrop, from, 0.0).rgb * (1.0 - front.a) + front.rgb;
    vec2 d = (from - 0.5) * vec2(1.0, 0.8);
    color *= 1.0 - VIGNETTE * dot(d, d);
    vec3 encoded = mix(color * 12.92, 1.055 * pow(max(color, vec3(1e-6)), vec3(1.0 / 2.4)) - 0.055,
                       step(vec3(0.0031308), color));
    encoded += (noise_screen(gl_FragCoord.xy) - 0.5) / 255.0;
    result = vec4(encoded, 1.0);
}
