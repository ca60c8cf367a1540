// Cloth over backdrop, vignette, display encoding, dither. Writes the rows from the top down.
// LINEAR: light, premultiplied, without vignette. CLEAR: no backdrop; alpha is what is covered.
layout(binding = 0) uniform sampler2D backdrop; // linear, half resolution
layout(binding = 1) uniform sampler2D layer;    // premultiplied, linear when read
#ifdef PLATE // a picture in place of the backdrop, darkened where the floor is
layout(binding = 7) uniform sampler2D plate;
layout(binding = 8) uniform sampler2D still; // the backdrop without shadows
#endif
in vec2 place;
out vec4 result;

const float VIGNETTE = 0.55;

void main() {
    vec2 from = vec2(place.x, 1.0 - place.y);
    vec4 front = textureLod(layer, from, 0.0); // between 2 x 2 samples: their mean
#ifdef CLEAR
    vec3 color = front.rgb;
    float alpha = front.a;
#else
    vec3 behind = textureLod(backdrop, from, 0.0).rgb;
#ifdef PLATE
    ivec2 near = ivec2(from * vec2(textureSize(still, 0)));
    vec3 unshaded = max(texelFetch(still, near, 0).rgb, vec3(1e-4));
    behind = textureLod(plate, from, 0.0).rgb * min(behind / unshaded, vec3(1.0));
#endif
    vec3 color = behind * (1.0 - front.a) + front.rgb;
    float alpha = 1.0;
#endif
#ifdef LINEAR
    result = vec4(color, alpha);
#else
#ifdef CLEAR
    color /= max(alpha, 1e-4); // display code is not premultiplied
#else
#ifndef PLATE
    vec2 d = (from - 0.5) * vec2(1.0, 0.8);
    color *= 1.0 - VIGNETTE * dot(d, d);
#endif
#endif
    vec3 encoded = srgb_encode(color);
    encoded += (noise_screen(gl_FragCoord.xy) - 0.5) / 255.0;
    result = vec4(encoded, alpha);
#endif
}
