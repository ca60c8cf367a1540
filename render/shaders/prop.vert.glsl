// Obstacles: rigid solids, drawn into the same G-buffer as the cloth.
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal_in;
uniform mat4 model_world;

out vec3 normal;

void main() {
    normal = mat3(model_world) * normal_in;
    gl_Position = world_clip * (model_world * vec4(position, 1.0));
}
