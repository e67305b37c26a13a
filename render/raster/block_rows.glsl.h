// A set-up face as rows of pixels ask it, four pixels at once: what the walks over a block's faces and over its layers
// share. Needs `picture`, and edges of faces.
#ifndef LOAM_RENDER_RASTER_BLOCK_ROWS_GLSL_H
#define LOAM_RENDER_RASTER_BLOCK_ROWS_GLSL_H

/// Edges and depth, linear over the screen.
struct RowFace {
  vec4 constant, step_x, step_y, least;
  vec3 depth;
};

/// setup, rectangle: the two texels of a set-up face.
RowFace row_face(int axis, uvec4 setup, vec4 rectangle) {
  const int u = axis == 2 ? 1 : 2, v = axis == 0 ? 1 : 0;
  const float offset = uintBitsToFloat(setup.w);
  RowFace face;
  vec4 margin;
  edges_moved(offset, rectangle, margin);
  face.constant = edges_of(offset, rectangle, picture.corner[axis], picture.corner[u], picture.corner[v]) - margin;
  face.step_x = edges_of(offset, rectangle, picture.step_x[axis], picture.step_x[u], picture.step_x[v]);
  face.step_y = edges_of(offset, rectangle, picture.step_y[axis], picture.step_y[u], picture.step_y[v]);
  face.least = least_within(setup.z);
  face.depth = picture.fraction.w / offset * vec3(picture.corner[axis], picture.step_x[axis], picture.step_y[axis]);
  return face;
}

bvec4 both(bvec4 a, bvec4 b) { return bvec4(a.x && b.x, a.y && b.y, a.z && b.z, a.w && b.w); }
bvec4 either(bvec4 a, bvec4 b) { return bvec4(a.x || b.x, a.y || b.y, a.z || b.z, a.w || b.w); }

bvec4 within_edge(const RowFace face, vec4 x, float y, int edge) {
  precise const vec4 number = face.constant[edge] + x * face.step_x[edge] + y * face.step_y[edge];
  return greaterThan(number, vec4(face.least[edge]));
}
/// x, y: of the pixels' middles.
bvec4 within_edges(const RowFace face, vec4 x, float y) {
  return both(both(within_edge(face, x, y, 0), within_edge(face, x, y, 1)),
              both(within_edge(face, x, y, 2), within_edge(face, x, y, 3)));
}
/// Reversed.
vec4 depths_on(const RowFace face, vec4 x, float y) { return face.depth.x + x * face.depth.y + y * face.depth.z; }

#endif
