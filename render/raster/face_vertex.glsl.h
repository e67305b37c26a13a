// Where a corner of a face is drawn: what the vertex shaders of faces and of layers share.
#ifndef LOAM_RENDER_RASTER_FACE_VERTEX_GLSL_H
#define LOAM_RENDER_RASTER_FACE_VERTEX_GLSL_H

/// From a plane of the grid down to a liquid's top below it, `level` sixteenths high in its voxel; 0: it is on the
/// plane.
float level_drop(uint level) { return level == 0u ? 0.0 : 1.0 - float(level) / 16.0; }

/// Of a face along u and v, relative to the camera. upper: of a part, the four bits of its record.
void face_extent(uint word0, uint word1, uint upper, int u, int v, vec2 fraction, out vec2 low, out vec2 high) {
  low = vec2(u, v) - fraction;
  high = vec2(u + int(face_width(word0)), v + int(face_height(word0))) - fraction;
  const uint direction = face_direction(word1);
  if (!face_is_part(word0) || (direction >> 1) == 1u) return;
  // A side's extent along y, which is u for faces of z and v for those of x.
  const int along = direction > 3u ? 0 : 1;
  const vec2 ends = vec2(part_bottom(word0, word1), part_top(upper)) / 16.0;
  const float y = float(along == 0 ? u : v);
  low[along] = y + ends.x - fraction[along];
  high[along] = y + ends.y - fraction[along];
}

/// In clip space. u, v: the axes of the face's plane beside `axis`, which lies at `offset` from the camera; low, high:
/// the face's extent along them, relative to the camera. Needs `picture` and kExactEdges.
vec4 placed_corner(int axis, int u, int v, float offset, vec2 low, vec2 high, bool high_u, bool high_v) {
  // Clipping in float can't place a face whose plane is close for its size. With exact edges such a face, where it is
  // near the camera's foot on its plane, asks all pixels, in front of everything: it is nearer wherever it is seen at
  // more than a tenth of a pixel. Else it is scaled about the camera, which looks the same.
  if (kExactEdges && abs(offset) < kNearestFace && all(lessThan(low, vec2(1))) && all(greaterThan(high, vec2(-1))))
    return vec4(high_u ? 1 : -1, high_v ? 1 : -1, 1, 1);
  vec3 point;
  point[axis] = offset;
  point[u] = high_u ? high.x : low.x;
  point[v] = high_v ? high.y : low.y;
  const float distance = max(abs(offset), kNearestFace);
  point *= distance / abs(offset);
  if (kExactEdges) {
    // Vertices are rounded to 1/256 pixel. Move each edge outwards by a little more on the screen, so that every pixel
    // that the exact face covers is asked; the fragment shader answers exactly. An edge along v that moves by e along u
    // moves by e * (f^2 h / z^3) / |dP/dv| pixels, with |dP/dv| = f / z^2 |v z - p v_forward| and h the distance of the
    // plane.
    const float depth = dot(picture.clip_w.xyz, point);
    if (depth > 0.0) {
      vec3 along_u = -point * picture.clip_w[u], along_v = -point * picture.clip_w[v];
      along_u[u] += depth;
      along_v[v] += depth;
      const float scale = picture.screen.z * depth / distance;
      const vec2 move = min(scale * vec2(length(along_v), length(along_u)), vec2(0.5 * depth));
      point[u] += high_u ? move.x : -move.x;
      point[v] += high_v ? move.y : -move.y;
    }
  }
  // Reversed depth, infinite far plane: depth = near / distance.
  return vec4(dot(picture.clip_x.xyz, point), dot(picture.clip_y.xyz, point), picture.fraction.w,
              dot(picture.clip_w.xyz, point));
}

#endif
