// Shading of cloth: diffuse with wrap, sheen of fibres, highlights of threads, transmission,
// soft shadow, coloured occlusion. One pass a cloth over the G-buffer's samples of that cloth.
layout(binding = 0) uniform usampler2D gbuffer;
in vec2 place;
out vec4 result;

// Mirrors ClothBlock in render/look.h (std140).
layout(std140, binding = 1) uniform ClothMaterial {
    vec4 warp;    // rgb: albedo of the threads along u; w: threads a metre of v
    vec4 weft;    // rgb: albedo of the threads along v; w: threads a metre of u
    vec4 stripe;  // rgb: albedo of the woven stripes; w: 1 = stripes along u edges too
    vec4 stripes; // begin, end of the broad and of the narrow stripe [m] from the edge
    vec4 sheen;   // rgb: colour; w: alpha, roughness
    vec4 thread;  // x: specular; y: shininess; z: transmission; w: bump
    vec4 panel;   // xy: size [m]; z: weave; w: reach [threads]
    vec4 yarn;    // x: strength of streaks; y: back side brightness
};

const float SEARCH = 26.0; // [texel at 2048] for blockers of the key light
const float WRAP = 0.25, WRAP_PART = 0.35;

float stripe_at(float from_edge) {
    vec2 broad = step(stripes.xz, vec2(from_edge)) * step(vec2(from_edge), stripes.yw);
    return max(broad.x, broad.y);
}

// Ashikhmin-Neubelt-Charlie sheen (Estevez and Kulla 2017; Neubelt's visibility).
float sheen_lobe(float alpha, float nh, float nl, float nv) {
    float power = 1.0 / alpha;
    float d = (2.0 + power) * pow(max(1.0 - nh * nh, 1e-6), 0.5 * power) / TAU;
    return d / (4.0 * (nl + nv - nl * nv) + 1e-4);
}

// Part of the light that sheen returns, fitted to the integral for alpha 0.2 .. 0.9.
float sheen_energy(float alpha, float nv) {
    float a2 = alpha * alpha;
    return saturate((1.056 - 0.826 * alpha + 0.252 * a2) * exp(-(2.715 - 1.225 * alpha) * nv) - 0.066 +
                    0.138 * alpha);
}

float fresnel_power(float x) {
    float x2 = x * x;
    return x2 * x2 * x;
}

struct Threads {
    vec3 albedo;
    vec3 normal;
    float over; // warp on top
    float lod;
};

Threads threads_at(Sample g, vec3 bitangent) {
    vec2 metres = g.uv * panel.xy;
    vec2 density = vec2(weft.w, warp.w);
    float per_sample = g.footprint * max(density.x, density.y);
    Weave w = weave_at(int(panel.z), metres * density, per_sample, panel.w, g.back);
    vec2 edge = min(metres, panel.xy - metres);
    // a stripe along an edge is made by the threads that run along that edge
    vec2 thread_centre = (floor(metres * density) + 0.5) / density;
    vec2 thread_edge = min(thread_centre, panel.xy - thread_centre);
    float warp_stripe = mix(stripe_at(thread_edge.y), stripe_at(edge.y), w.lod);
    float weft_stripe = mix(stripe_at(thread_edge.x), stripe_at(edge.x), w.lod) * stripe.w;
    vec3 warp_color = mix(warp.rgb, stripe.rgb, warp_stripe);
    vec3 weft_color = mix(weft.rgb, stripe.rgb, weft_stripe);
    float face_part = panel.z == float(WEAVE_SATIN) ? 0.8 : (panel.z == float(WEAVE_DENIM) ? 0.75 : 0.5);
    float warp_part = g.back ? 1.0 - face_part : face_part;
    vec3 mean = mix(weft_color, warp_color, warp_part);
    float crown = mix(1.0, w.crown, thread.w);
    vec3 drawn = mix(weft_color, warp_color, w.over) * crown * w.tint;
    float mean_crown = mix(1.0, 0.83, thread.w);
    Threads t;
    t.lod = w.lod;
    t.over = mix(w.over, warp_part, w.lod);
    t.albedo = mix(drawn, mean * mean_crown, w.lod) * (1.0 + yarn.x * weave_streaks(metres, g.footprint));
    t.albedo *= g.back ? yarn.y : 1.0;
    vec2 tilt = w.tilt * thread.w * (1.0 - w.lod);
    t.normal = normalize(g.normal + g.tangent * tilt.x + bitangent * tilt.y);
    return t;
}

// Kajiya-Kay highlights of both thread directions.
vec3 thread_highlight(Threads t, vec3 along_u, vec3 along_v, vec3 h, float lh, float nl, vec3 light) {
    float th_warp = dot(along_u, h), th_weft = dot(along_v, h);
    float s_warp = pow(max(1.0 - th_warp * th_warp, 1e-6), thread.y);
    float s_weft = pow(max(1.0 - th_weft * th_weft, 1e-6), 0.5 * thread.y);
    float lobe = mix(mix(s_weft, s_warp, t.over), 0.6 * s_warp + 0.4 * s_weft, t.lod);
    float f = 0.04 + 0.96 * fresnel_power(1.0 - lh);
    float strength = thread.x * lobe * (thread.y + 2.0) * 0.05 * nl * (4.0 * f + 0.25);
    return strength * light * mix(vec3(1.0), t.albedo, 0.45);
}

struct Light {
    vec3 towards, color;
};

// Diffuse light that wraps around fibres and shines through their edges.
vec3 diffuse_lobe(vec3 albedo, float raw) {
    float wrapped = saturate((raw + WRAP) / ((1.0 + WRAP) * (1.0 + WRAP)));
    float nl = saturate(raw);
    return albedo / PI * mix(vec3(nl), wrapped * saturate3(1.6 * albedo + nl), WRAP_PART);
}

vec3 lit_by(Light light, Threads t, float nv, vec3 v, vec3 along_u, vec3 along_v, float kept) {
    vec3 h = normalize(light.towards + v);
    float raw = dot(t.normal, light.towards);
    float nl = saturate(raw), nh = saturate(dot(t.normal, h)), lh = saturate(dot(light.towards, h));
    vec3 sheen_part = sheen.rgb * sheen_lobe(sheen.w, nh, nl, nv) * nl;
    return light.color * (diffuse_lobe(t.albedo, raw) * kept + sheen_part) +
           thread_highlight(t, along_u, along_v, h, lh, nl, light.color);
}

void main() {
    Sample g = gbuffer_unpack(texelFetch(gbuffer, ivec2(gl_FragCoord.xy), 0));
    vec3 p = world_position(place * 2.0 - 1.0, g.depth);
    vec3 v = view_vector(p);
    // v of the panel runs along cross(face normal, tangent)
    vec3 bitangent = cross(g.back ? -g.normal : g.normal, g.tangent);
    Threads t = threads_at(g, bitangent);
    float nv = saturate(dot(t.normal, v));
    float energy = sheen_energy(sheen.w, nv);
    float kept = 1.0 - max(sheen.r, max(sheen.g, sheen.b)) * energy;

    float facing = dot(g.normal, key_light.xyz);
    float turn = noise_sample(gl_FragCoord.xy);
    float key = shadow_key(p, facing >= 0.0 ? g.normal : -g.normal, SEARCH * shadow.z / 2048.0, turn);
    float visible = occlusion_at(place, depth_linear(g.depth));
    vec3 colored = occlusion_colored(visible, t.albedo);

    Light key_part = Light(key_light.xyz, key_color.rgb * key);
    Light rim_part = Light(rim_light.xyz, rim_color.rgb * visible * visible);
    vec3 color = lit_by(key_part, t, nv + 1e-3, v, g.tangent, bitangent, kept) +
                 lit_by(rim_part, t, nv + 1e-3, v, g.tangent, bitangent, kept);
    // the fill light is soft: no highlights
    color += fill_color.rgb * visible * kept * diffuse_lobe(t.albedo, dot(t.normal, fill_light.xyz));
    vec3 ambient = ambient_light(t.normal);
    color += ambient * (t.albedo * kept * colored + sheen.rgb * energy * visible * 0.7);
    vec3 through = key_color.rgb * key * max(-facing, 0.0) +
                   0.5 * rim_color.rgb * max(-dot(g.normal, rim_light.xyz), 0.0);
    color += thread.z * t.albedo / PI * through;
    result = vec4(tone_map(color), 1.0);
}
