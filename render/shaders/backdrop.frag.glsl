// The studio behind the cloth: floor, cove and wall in one sweep, found by cutting each ray.
// SHADED: with the cloth's shadow and occlusion; without it: the still picture.
in vec2 place;
out vec4 result;

const vec3 ALBEDO = vec3(0.34, 0.322, 0.304);
const float SEARCH = 34.0; // [texel at 2048] for blockers

void main() {
    vec2 ndc = place * 2.0 - 1.0;
    vec4 hit = backdrop_point(ndc);
    vec3 p = hit.xyz, n = backdrop_normal(p, hit.w);
    float key = 1.0, visible = 1.0;
#ifdef SHADED
    float z = dot(p, forward.xyz) - forward.w;
    float turn = noise_screen(gl_FragCoord.xy);
    key = shadow_key(p, n, SEARCH * shadow.z / 2048.0, turn);
    visible = occlusion_at(place, z);
#endif
    vec3 away = (p - vec3(centre.xy, wall.w)) / centre.w;
    float r2 = dot(away, away);
    float pool = 1.0 / (1.0 + 0.05 * r2 + 0.002 * r2 * r2);
    vec3 light = key_color.rgb * key * max(dot(n, key_light.xyz), 0.0);
    light += fill_color.rgb * max(dot(n, fill_light.xyz), 0.0) * visible;
    light = light / PI + ambient_light(n) * occlusion_colored(visible, ALBEDO);
    result = vec4(seen(ALBEDO * light * pool), 1.0);
}
