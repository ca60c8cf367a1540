// Obstacles: rigid solids in their own frame.
layout(location = 0) in vec3 position_in;
layout(location = 1) in vec3 normal_in;
uniform mat4 model_world;

out vec3 local;        // [m] in the solid's frame
out vec3 local_normal;
out vec3 world;
out vec3 world_normal;

void main() {
    local = position_in;
    local_normal = normal_in;
    world = (model_world * vec4(position_in, 1.0)).xyz;
    world_normal = mat3(model_world) * normal_in;
    gl_Position = world_clip * vec4(world, 1.0);
}
