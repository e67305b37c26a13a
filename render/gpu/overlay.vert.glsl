// A vertex of what lies over the picture: place in pixels of the window, place in its texture, colour.
#version 460

layout(push_constant) uniform Push {
  vec2 clip_from_pixel;  // scale; the window's corner is (-1, -1)
};

layout(location = 0) in vec2 pixel;
layout(location = 1) in vec2 uv;
layout(location = 2) in vec4 colour;
layout(location = 0) out vec2 out_uv;
layout(location = 1) out vec4 out_colour;

void main() {
  out_uv = uv;
  out_colour = colour;
  gl_Position = vec4(pixel * clip_from_pixel - 1.0, 0.0, 1.0);
}
