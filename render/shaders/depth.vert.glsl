// Depth only: the shadow map and the half-resolution depth.
layout(location = 0) in vec3 position;
uniform mat4 model_clip;

void main() { gl_Position = model_clip * vec4(position, 1.0); }
