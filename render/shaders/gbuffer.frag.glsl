in vec3 normal;
in vec3 tangent;
in vec2 uv;
uniform vec2 panel_scale; // [1/m] 1 / panel size
out uvec4 words;

void main() {
    bool back = !gl_FrontFacing;
    vec3 n = normalize(normal);
    vec2 across = dFdx(uv), down = dFdy(uv);
    float footprint = sqrt(max(dot(across, across), dot(down, down)));
    words = gbuffer_pack(back ? -n : n, tangent, gl_FragCoord.z, uv * panel_scale, footprint, back);
}
