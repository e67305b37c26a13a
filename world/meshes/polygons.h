/// Meshes of polygons as their files hold them, before anything becomes triangles.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string_view>
#include <vector>

#include "world/base/errors.h"
#include "world/space/world_point.h"

namespace world {

struct PolygonMesh {
  struct Crease {
    uint32_t a = 0, b = 0;  // vertices of an edge
    float sharpness = 0;    // levels of subdivision for which it stays sharp; 10 and more: always
  };
  std::vector<Vec3f> positions;        // m
  std::vector<uint32_t> face_sizes;    // corners of each face, at least 3
  std::vector<uint32_t> face_corners;  // vertices, face by face, counter-clockwise seen from outside
  std::vector<Crease> creases;
};

/// Counts of a mesh file, unused and repeated entries too.
struct MeshFileFacts {
  uint64_t vertices = 0, textures = 0, normals = 0, faces = 0, groups = 0;  // groups: lines "g" and "o"
  uint64_t negative_indices = 0;                                            // of .obj: counted back from the last
  uint64_t max_index = 0;                   // of .obj: the largest vertex that a face names, from 1
  std::map<uint32_t, uint64_t> face_sizes;  // corners -> faces
};

/// Of an .obj file, with its creases: lines "t crease 2/1/0 a b sharpness", as OpenSubdiv's own files have them.
Result<PolygonMesh> read_obj_polygons(std::span<const uint8_t> bytes, std::string_view file);

}  // namespace world
