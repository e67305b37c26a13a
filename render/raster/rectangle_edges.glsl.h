// Whether a pixel's ray meets a face, told by the edges of the face's rectangle. An edge is a line of the grid, where
// the face's plane `a` and another, `b`, cross: offsets p_a and p_b from the camera. The ray meets `a` before `b` or
// after it by the sign of p_a ray_b - p_b ray_a, which is linear over the screen: three numbers an edge, worked out
// once a face, and two multiplications and additions a pixel. Of two faces that share an edge these numbers are the
// same but for the sign, bit by bit, since products are rounded alike either way round; so the pixel is within one of
// them and not within the other: no crack and no overlap, at merged faces too. What lies on the line is met as the ray
// caster meets it, which crosses planes in the order of (t, axis).
//
// error   rounding moves an edge by some 2^-24 / (angle of a pixel) px: 1e-4 px in a picture of 1280 by 60 degrees
// source  Juan Pineda. A Parallel Algorithm for Polygon Rasterization. 1988 (edge functions)
#ifndef LOAM_RENDER_RASTER_RECTANGLE_EDGES_GLSL_H
#define LOAM_RENDER_RASTER_RECTANGLE_EDGES_GLSL_H

/// What fragments are told of an edge whose line is within, a bit each from this one on, beside a chunk's detail.
const uint kOnEdgeShift = 24u;

/// Of each edge the number that it must be more than: a line that is within is where it is 0, and no other number below
/// 0 is so small.
vec4 least_within(uint on_edge) {
  return mix(vec4(0), vec4(-1e-30), notEqual(on_edge & (uvec4(1, 2, 4, 8) << kOnEdgeShift), uvec4(0)));
}

// EDGES_TO_FRAGMENTS: a vertex shader writes them; EDGES_OF_FACES: a dispatch works them out.
#if defined(EDGES_TO_FRAGMENTS) || defined(EDGES_OF_FACES)
/// Above what rounding may do to an edge, by the product of an offset and a ray's component: five roundings of numbers
/// below 4.
const float kEdgeRounding = 2e-6;

/// low u, high u, low v, high v: positive within, and 0 where the edge's bit is set. Of a part of the pixels' rays
/// along the face's own axis, u and v. `rectangle`: low u, low v, high u, high v, from the camera.
vec4 edges_of(float offset, vec4 rectangle, float along, float u, float v) {
  precise const vec2 here = offset * vec2(u, v);
  precise const vec4 there = rectangle * along;
  precise const vec4 edges = vec4(here.x - there.x, there.z - here.x, here.y - there.y, there.w - here.y);
  return offset < 0.0 ? -edges : edges;
}

/// A plane through the eye is met at once or not at all, by a ray's smallest slope, and its faces are drawn in front of
/// everything: to be met, rays must run towards it by more than rounding, and what stands on it is met by as much more.
/// Of each edge whether it is so moved, and by how much.
bvec4 edges_moved(float offset, vec4 rectangle, out vec4 margin) {
  const vec4 other = abs(rectangle.xzyw);
  const bool through_eye = abs(offset) < kNearestFace;
  margin = through_eye ? kEdgeRounding * other : vec4(-2.0 * kEdgeRounding * abs(offset));
  const bvec4 moved = notEqual(uvec4(through_eye), uvec4(lessThan(other, vec4(kNearestFace))));
  margin = mix(vec4(0), margin, moved);
  return moved;
}

struct RectangleEdges {
  vec4 constant, step_x, step_y;
  uint on_edge;  // from bit kOnEdgeShift on: those whose line is within
};

/// u, v: the axes of the face's plane beside `axis`, which lies at `offset` from the camera. Needs `picture`.
RectangleEdges rectangle_edges(int axis, int u, int v, float offset, vec4 rectangle) {
  RectangleEdges edges;
  vec4 margin;
  const bvec4 moved = edges_moved(offset, rectangle, margin);
  edges.constant = edges_of(offset, rectangle, picture.corner[axis], picture.corner[u], picture.corner[v]) - margin;
  edges.step_x = edges_of(offset, rectangle, picture.step_x[axis], picture.step_x[u], picture.step_x[v]);
  edges.step_y = edges_of(offset, rectangle, picture.step_y[axis], picture.step_y[u], picture.step_y[v]);
  // On its line a ray runs away from the camera's side of it, into the rectangle or out of it; into it also means met
  // where the other plane comes first.
  const bvec4 into = bvec4(rectangle.x >= 0.0, rectangle.z < 0.0, rectangle.y >= 0.0, rectangle.w < 0.0);
  const bvec4 first = bvec4(u < axis, u < axis, v < axis, v < axis);
  const uvec4 bits = (uvec4(equal(into, first)) & ~uvec4(moved)) << (uvec4(0, 1, 2, 3) + kOnEdgeShift);
  edges.on_edge = bits.x | bits.y | bits.z | bits.w;
  return edges;
}
#endif

#ifdef EDGES_TO_FRAGMENTS
layout(location = 4) flat out vec4 edge_constant;
layout(location = 5) flat out vec4 edge_step_x;
layout(location = 6) flat out vec4 edge_step_y;

void write_edges(const RectangleEdges edges) {
  edge_constant = edges.constant;
  edge_step_x = edges.step_x;
  edge_step_y = edges.step_y;
}
#elif !defined(EDGES_OF_FACES)
layout(location = 4) flat in vec4 edge_constant;
layout(location = 5) flat in vec4 edge_step_x;
layout(location = 6) flat in vec4 edge_step_y;

bool within_edges(uint on_edge) {
  precise const vec4 edges = edge_constant + gl_FragCoord.x * edge_step_x + gl_FragCoord.y * edge_step_y;
  return all(greaterThan(edges, least_within(on_edge)));
}
#endif

#endif
