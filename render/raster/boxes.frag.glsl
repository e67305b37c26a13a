#version 460
// Each face of a body has one radiance.
layout(location = 0) flat in vec3 radiance;
layout(location = 0) out vec4 colour;
void main() { colour = vec4(radiance, 1); }
