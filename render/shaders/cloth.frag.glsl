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
    vec4 yarn;    // x: strength of streaks; y: back side brightness; zw: repeats of a print a metre
    vec4 back_warp, back_weft; // rgb: albedos on the back of a double cloth
    vec4 second;  // rgb: albedo of bands; w: repeat of the warp's bands [m], 0: none
    vec4 third;   // rgb: albedo of bands; w: repeat of the weft's bands [m]
    vec4 warp_bands, weft_bands; // begin, end of the second and third colour, parts of the repeat
    vec4 border;  // x: width of the hem; y: width of the selvedge [m], 0: none; z: cover of sheer cloth
    vec4 seam;    // rgb: albedo of stitches
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

#ifdef PRINTED
layout(binding = 6) uniform sampler2D print_picture; // rows go up
const float STRIKE_THROUGH = 0.25;                   // of the ink that is seen on the back

// What ink leaves of the light: on white cloth the picture, seen through a footprint [m].
vec3 printed(vec2 metres, float footprint, bool back) {
    vec2 texels = vec2(textureSize(print_picture, 0)) * yarn.zw;
    vec4 ink = textureLod(print_picture, metres * yarn.zw, log2(max(footprint * max(texels.x, texels.y), 1e-6)));
    return mix(vec3(1.0), ink.rgb, ink.a * (back ? STRIKE_THROUGH : 1.0));
}
#endif

struct Threads {
    vec3 albedo;
    vec3 normal;
    float over; // warp on top
    float lod;
    float layers; // of cloth: 2 in a hem
};

#ifdef BANDED
// Colours of the bands over `color`; at: [m] across the threads, centre: of this thread.
vec3 banded(vec3 color, float at, float centre, float footprint, float lod, float repeat, vec4 bands) {
    if (repeat <= 0.0) {
        return color;
    }
    float second_part = mix(weave_bands(centre, 0.0, repeat, bands.xy),
                            weave_bands(at, footprint, repeat, bands.xy), lod);
    float third_part = mix(weave_bands(centre, 0.0, repeat, bands.zw),
                           weave_bands(at, footprint, repeat, bands.zw), lod);
    return mix(mix(color, second.rgb, second_part), third.rgb, third_part);
}
#endif

#ifdef BORDERED
const float STITCH = 0.0032, STITCH_WIDTH = 0.0007; // [m] from stitch to stitch, of the thread
const float STITCH_PART = 0.68;                     // of the way: seen from above
const float SEAM_INSIDE = 0.0022;                   // [m] from the edge of the hem to the stitches
const float FOLD_SLOPE = 0.55, FOLD_WIDTH = 0.0011; // where the folded part ends

// A line of this width at distance d from its middle, seen through a footprint.
float line_part(float d, float width, float footprint) {
    float wide = max(width, footprint);
    return clamp((0.5 * (width + wide) - abs(d)) / wide, 0.0, 1.0) * width / wide;
}

// Hem and selvedge. from: [m] to the nearest border across u, across v; metres: place.
void add_border(inout Threads t, inout vec2 tilt, vec2 from, vec2 metres, vec3 weft_color, float footprint) {
    bool selvedge = border.y > 0.0;
    bool across_u = selvedge || from.x < from.y; // the nearest hemmed border
    float d = across_u ? from.x : from.y, along = across_u ? metres.y : metres.x;
    float middle = across_u ? 0.5 * panel.x - metres.x : 0.5 * panel.y - metres.y;
    float hem = border.x;
    float inside = 1.0 - smoothstep(hem - 0.5 * footprint, hem + 0.5 * footprint, d);
    t.layers = hem > 0.0 ? mix(1.0, 2.0, inside) : 1.0;
    float fold = hem > 0.0 ? line_part(d - hem, FOLD_WIDTH, footprint) : 0.0;
    tilt += fold * FOLD_SLOPE * sign(middle) * (across_u ? vec2(1.0, 0.0) : vec2(0.0, 1.0));
    float dash = weave_bands(along, footprint, STITCH, vec2(0.0, STITCH_PART));
    float stitched = hem > 0.0 ? line_part(d - hem + SEAM_INSIDE, STITCH_WIDTH, footprint) * dash : 0.0;
    t.albedo = mix(t.albedo * (1.0 - 0.35 * fold), seam.rgb, stitched);
    float listed = selvedge ? 1.0 - smoothstep(border.y - 0.5 * footprint, border.y + 0.5 * footprint, from.y) : 0.0;
    float listing = selvedge ? line_part(from.y - 0.55 * border.y, 0.0011, footprint) : 0.0;
    t.albedo = mix(mix(t.albedo, weft_color, 0.7 * listed), seam.rgb, listing);
}
#endif

Threads threads_at(Sample g, vec3 bitangent) {
    vec2 metres = g.uv * panel.xy;
    vec2 density = vec2(weft.w, warp.w);
    float per_sample = g.footprint * max(density.x, density.y);
    Weave w = weave_at(metres * density, per_sample, panel.w, g.back);
    vec2 edge = min(metres, panel.xy - metres);
    // a stripe along an edge is made by the threads that run along that edge
    vec2 thread_centre = (floor(metres * density) + 0.5) / density;
    vec2 thread_edge = min(thread_centre, panel.xy - thread_centre);
    float warp_stripe = mix(stripe_at(thread_edge.y), stripe_at(edge.y), w.lod);
    float weft_stripe = mix(stripe_at(thread_edge.x), stripe_at(edge.x), w.lod) * stripe.w;
    vec3 warp_color = warp.rgb, weft_color = weft.rgb;
#ifdef DOUBLE_CLOTH
    warp_color = g.back ? back_warp.rgb : warp_color;
    weft_color = g.back ? back_weft.rgb : weft_color;
#endif
#ifdef BANDED
    warp_color = banded(warp_color, metres.y, thread_centre.y, g.footprint, w.lod, second.w, warp_bands);
    weft_color = banded(weft_color, metres.x, thread_centre.x, g.footprint, w.lod, third.w, weft_bands);
#endif
    warp_color = mix(warp_color, stripe.rgb, warp_stripe);
    weft_color = mix(weft_color, stripe.rgb, weft_stripe);
#if WEAVE == WEAVE_SATIN
    const float face_part = 0.8;
#elif WEAVE == WEAVE_DENIM
    const float face_part = 0.75;
#elif WEAVE == WEAVE_KNIT
    const float face_part = 1.0; // one yarn: that of the course
#else
    const float face_part = 0.5;
#endif
#if WEAVE == WEAVE_KNIT
    warp_color = weft_color;
#endif
    float warp_part = g.back ? 1.0 - face_part : face_part;
    vec3 mean = mix(weft_color, warp_color, warp_part);
    float crown = mix(1.0, w.crown, thread.w);
    vec3 drawn = mix(weft_color, warp_color, w.over) * crown * w.tint;
    float mean_crown = mix(1.0, 0.83, thread.w);
    Threads t;
    t.lod = w.lod;
    t.over = mix(w.over, warp_part, w.lod);
    t.layers = 1.0;
    t.albedo = mix(drawn, mean * mean_crown, w.lod) * (1.0 + yarn.x * weave_streaks(metres, g.footprint));
    t.albedo *= g.back ? yarn.y : 1.0;
#ifdef PRINTED
    t.albedo *= printed(metres, g.footprint, g.back);
#endif
    vec2 tilt = w.tilt * thread.w * (1.0 - w.lod);
#ifdef BORDERED
    vec2 from = stripe.w > 0.0 ? edge : vec2(1e3, edge.y);
    add_border(t, tilt, from, metres, weft_color, g.footprint);
#endif
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
    color += thread.z / (t.layers * t.layers) * t.albedo / PI * through;
#ifdef VEIL
    // seen at a slant, threads cover more: 1 - (1 - cover)^(1 / cos)
    float slant = max(saturate(dot(g.normal, v)), 0.12);
    float alpha = 1.0 - pow(1.0 - border.z, t.layers / slant);
    result = vec4(seen(color) * alpha, alpha);
#else
    result = vec4(written(color), 1.0);
#endif
}
