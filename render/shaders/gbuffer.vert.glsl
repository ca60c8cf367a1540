// The resampled cloth, drawn once at full rate.
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal_in;
layout(location = 2) in vec3 tangent_in;
layout(location = 3) in vec2 uv_in; // [m] from the panel's corner
#ifdef MEASURED
layout(location = 4) in float value_in;
out float value;
#endif

out vec3 normal;
out vec3 tangent;
out vec2 uv;

void main() {
#ifdef DERIVATIVES // along u and v, in place of normal and tangent
    normal = normalize(cross(normal_in, tangent_in) + vec3(0.0, 0.0, 1e-30));
    tangent = normalize(normal_in + vec3(1e-30, 0.0, 0.0));
#else
    normal = normal_in;
    tangent = tangent_in;
#endif
    uv = uv_in;
#ifdef MEASURED
    value = value_in;
#endif
    gl_Position = world_clip * vec4(position, 1.0);
}
