#version 460
// Nothing but the stencil.
void main() {}
