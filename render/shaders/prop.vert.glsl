// Obstacles: rigid solids, drawn into the same G-buffer as the cloth.
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal_in;
uniform mat4 model_world;

out vec3 normal;
out vec2 depth_clip; // z, w of the surface itself

// Depth is tested a little behind: cloth lies within a millimetre of what it touches, and its
// smooth surface bulges by about as much between nodes.
const float BEHIND = 0.005; // of the scale

void main() {
    vec4 p = model_world * vec4(position, 1.0);
    vec4 behind = world_clip * vec4(p.xyz - BEHIND * centre.w * view_vector(p.xyz), 1.0);
    normal = mat3(model_world) * normal_in;
    gl_Position = world_clip * p;
    depth_clip = gl_Position.zw;
    gl_Position.z = behind.z / behind.w * gl_Position.w;
}
