// Shading of obstacles: a rough dielectric or metal with a procedural surface. One pass an
// obstacle over the G-buffer's samples of that obstacle.
layout(binding = 0) uniform usampler2D gbuffer;
uniform mat4 world_model; // into the solid's frame
in vec2 place;
out vec4 result;

// Mirrors PropBlock in render/look.h (std140).
layout(std140, binding = 2) uniform PropMaterial {
    vec4 base;    // rgb: albedo; w: roughness
    vec4 second;  // rgb: albedo of the grain; w: strength of the grain
    vec4 surface; // x: 1 = metal; y: kind of grain (0 speckle, 1 wood); z: size of the grain [m]
};

const float SEARCH = 26.0;

// GGX with Smith's joint visibility (approximate) and Schlick's Fresnel.
vec3 specular_ggx(float nh, float nl, float nv, float lh, float roughness, vec3 f0) {
    float a = roughness * roughness, a2 = a * a;
    float d = nh * nh * (a2 - 1.0) + 1.0;
    float visible = 0.5 / mix(2.0 * nl * nv, nl + nv, a);
    return a2 / (PI * d * d) * visible * (f0 + (1.0 - f0) * pow(1.0 - lh, 5.0));
}

float grain_at(vec3 p, float size) {
    vec3 q = p / size;
    float speckle = 0.5 * noise_smooth(q.xy * 1.3 + q.z) + 0.5 * noise_smooth(q.zx * 2.9 + q.y);
    // boards: the axis of the rings runs along x, well outside the solid
    float bend = noise_smooth(vec2(q.x * 0.12, q.y * 0.3));
    float rings = length(q.yz * vec2(1.0, 0.8) + vec2(17.0, 23.0)) + 0.5 * bend;
    float fibre = noise_smooth(vec2(q.x * 0.4, q.y * 7.0 + q.z * 5.0));
    float wood = sin(rings * 3.5 + 1.5 * noise_smooth(q.yz * 0.4)) * 0.45 + 0.4 * fibre;
    return mix(speckle, wood, surface.y);
}

void main() {
    uvec4 words = texelFetch(gbuffer, ivec2(gl_FragCoord.xy), 0);
    float window_depth = uintBitsToFloat(words.y);
    vec3 world = world_position(place * 2.0 - 1.0, window_depth);
    vec3 n = octahedral_decode(unpackSnorm2x16(words.x)), v = view_vector(world);
    vec3 local = (world_model * vec4(world, 1.0)).xyz;
    float grain = 0.5 + 0.5 * grain_at(local, surface.z);
    vec3 albedo = mix(base.rgb, second.rgb, grain * second.w);
    float metal = surface.x;
    vec3 f0 = mix(vec3(0.04), albedo, metal);
    float turn = noise_sample(gl_FragCoord.xy);
    float facing = dot(n, key_light.xyz);
    float key = shadow_key(world, facing >= 0.0 ? n : -n, SEARCH * shadow.z / 2048.0, turn);
    float visible = occlusion_at(place, depth_linear(window_depth));
    vec3 towards[3] = vec3[3](key_light.xyz, rim_light.xyz, fill_light.xyz);
    vec3 lights[3] = vec3[3](key_color.rgb * key, rim_color.rgb * visible * visible, fill_color.rgb * visible);
    float nv = clamp(dot(n, v), 1e-3, 1.0);
    vec3 color = vec3(0.0);
    for (int i = 0; i < 3; i++) {
        vec3 h = normalize(towards[i] + v);
        float nl = saturate(dot(n, towards[i]));
        vec3 spec = specular_ggx(saturate(dot(n, h)), nl + 1e-4, nv, saturate(dot(towards[i], h)), base.w, f0);
        color += lights[i] * nl * (albedo / PI * (1.0 - metal) + spec);
    }
    vec3 mirrored = reflect(-v, n);
    vec3 fresnel = f0 + (1.0 - f0) * pow(1.0 - nv, 5.0) * (1.0 - base.w);
    color += ambient_light(n) * albedo * (1.0 - metal) * occlusion_colored(visible, albedo);
    color += ambient_light(mirrored) * fresnel * visible * mix(0.6, 1.6, metal);
    result = vec4(written(color), 1.0);
}
