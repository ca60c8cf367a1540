// Sheer cloth, all its layers, over the picture: blended as premultiplied linear light.
layout(binding = 0) uniform sampler2D veil;
out vec4 result;

void main() { result = texelFetch(veil, ivec2(gl_FragCoord.xy), 0); }
