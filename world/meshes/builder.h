/// What the readers of mesh files share: faces of any number of corners in, a TriangleMesh out.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "world/meshes/colours.h"
#include "world/meshes/mesh.h"
#include "world/meshes/polygons.h"

namespace world {

/// A corner of a face: indices from 0 into the file's lists; kNone where the file names none.
struct MeshCorner {
  static constexpr uint32_t kNone = 0xffffffffu;
  uint32_t position = kNone, texture = kNone, normal = kNone;
  friend bool operator==(const MeshCorner&, const MeshCorner&) = default;
};

/// Collects positions and faces, in the file's order. Indices are the caller's to check.
/// A face of n corners becomes n - 2 triangles: by clipping ears in the plane that its corners lie nearest to, where it
/// isn't convex; by a fan from its first corner where it is, or where it crosses itself.
class MeshBuilder {
 public:
  std::vector<Vec3f> positions, normals;
  std::vector<glm::vec2> textures;
  /// Corners of a face that isn't convex; its time grows with their square.
  static constexpr size_t kMostCorners = 1024;

  /// False where the face has fewer than three corners, or more than kMostCorners and is not convex.
  [[nodiscard]] bool add_face(std::span<const MeshCorner> corners);
  /// What the file holds, as it holds it; the readers count.
  MeshFileFacts facts;
  /// Colours of positions: as many as those, or none; and what the next faces are of, an entry in colours.materials.
  std::vector<uint32_t> position_colours;
  MeshColours colours;
  static constexpr uint32_t kNoMaterial = 0xffffffffu;
  uint32_t material = kNoMaterial;
  /// The faces before they become triangles.
  std::vector<uint32_t> face_sizes, face_corners;

  /// Drops triangles without area, and vertices that no triangle has. Fails where no triangle is left. Faces without a
  /// material, in files that have some, get one of their own, white.
  Result<TriangleMesh> finish(std::string_view file, MeshReport& report, MeshColours* colours_out = nullptr) &&;

 private:
  void add_triangle(const MeshCorner& a, const MeshCorner& b, const MeshCorner& c);
  bool clip_ears(std::span<const MeshCorner> corners);

  std::vector<MeshCorner> triangles_;  // three a triangle
  std::vector<uint32_t> materials_;    // by triangle
  bool all_have_textures_ = true, all_have_normals_ = true;
};

/// Of 12 numbers a quad: corners counter-clockwise seen from outside. Fails where none has an area.
Result<TriangleMesh> quads_mesh(std::span<const double> quads, std::string_view where, MeshReport& report);
/// The profile's points (radius, height), two numbers each, turned round the y axis in so many steps. What lies to the
/// right of the profile's way (radius to the right, height up) is outside. Normals are those of the round surface;
/// where the profile turns by more than 35 degrees it has an edge.
Result<TriangleMesh> revolved_mesh(std::span<const double> profile, int steps, std::string_view where,
                                   MeshReport& report);

/// Materials of an .obj are named in `colours`, and found in its libraries by read_mtl().
Result<TriangleMesh> read_obj(std::span<const uint8_t> bytes, std::string_view file, MeshReport& report,
                              MeshFileFacts* facts = nullptr, MeshColours* colours = nullptr);
Result<TriangleMesh> read_ply(std::span<const uint8_t> bytes, std::string_view file, MeshReport& report,
                              MeshFileFacts* facts = nullptr, MeshColours* colours = nullptr);

/// What a library of materials (.mtl) says of those that the mesh names: Kd, taken as the linear albedo that its
/// definition says, and map_Kd. Materials that were found already stay.
struct MtlReport {
  size_t clear = 0, shining = 0;  // materials with d below 1 or Tr above 0; with Ke above 0
};
Status read_mtl(std::span<const uint8_t> bytes, std::string_view file, MeshColours& colours, MtlReport& report);

}  // namespace world
