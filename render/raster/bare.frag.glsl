#version 460
// A constant: what a picture's triangles and pixels cost at least.
layout(location = 0) out uvec2 seen_out;

void main() { seen_out = uvec2(1u); }
