/// Triangle meshes that stand in a world beside its voxels: a [[mesh]] of a scene, from a file or spelt out there.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>

#include "world/base/errors.h"
#include "world/base/toml_reader.h"
#include "world/blocks/block.h"
#include "world/space/world_point.h"

namespace world {

struct TriangleMesh {
  std::vector<Vec3f> positions;                // m
  std::vector<glm::uvec3> triangles;           // counter-clockwise seen from outside
  std::vector<Vec3f> normals;                  // by position, unit; empty: faceted
  std::vector<glm::vec2> texture_coordinates;  // by position; empty where the file has none
};

struct MeshReport {
  uint64_t degenerate = 0;  // triangles that were dropped because they have no area
};
/// .obj or .ply. Memory is bounded by the file's size. Faces of more than three corners become triangles. Normals and
/// texture coordinates count only where every corner of every face has them.
Result<TriangleMesh> read_mesh_file(const std::filesystem::path& path, MeshReport& report);

/// A mesh put into the world: world = position + transform * mesh.
struct MeshInstance {
  std::string name;
  std::string file;  // as the scene says it; empty where it spells the shape out
  std::shared_ptr<const TriangleMesh> mesh;
  WorldPoint position;
  glm::dmat3 transform{1.0};    // columns: images of the mesh's axes
  std::string block;            // whose material it has
  BlockId block_id = kAir;      // set when the world is built
  bool null_surface = false;    // rays pass through; it only bounds a medium
  std::string interior_medium;  // name of a [[medium]] that fills it; none where empty
  Radiance3 radiance;           // W/(m^2 sr) that its front side emits
  bool smooth = false;          // shade with interpolated normals
  std::string checker_block;    // the second material of a checkerboard over texture coordinates
  BlockId checker_id = kAir;
  glm::vec2 checkers{0, 0};  // squares along u and v; 0: no checkerboard
  uint64_t degenerate = 0;   // triangles of the file that have no area and were dropped
  std::string where;         // file:line:column of its table, for messages
};

/// `folder` is where relative files lie. Reads the file too; what is wrong is noted in the table's document.
///
///   file = "sphere.obj"        .obj or .ply; one of file, quads and revolve is required
///   quads = [x, y, z, ...]     m; four corners each, counter-clockwise seen from outside
///   revolve = [r, y, ...]      m; a profile of radii and heights, turned round the y axis: outside is to the right of
///                              its way, so a closed body's goes from the lowest point of the axis to the highest
///   steps = 96                 3 to 4096: around the axis, of revolve
///   name = "sphere"            the file's name without folder and extension where missing
///   position = [x, y, z]       m; within the world's border
///   scale = 2 or [x, y, z]     each not 0; below 0 mirrors
///   rotate_deg = [x, y, z]     after scaling: about the x axis, then y, then z
///   matrix = [12 numbers]      instead of scale and rotate_deg: three rows of four, the fourth is added to position
///   block = "white_paint"      whose material it has; required but for a null surface or one that emits
///   null_surface = true        rays pass through it; it bounds interior_medium
///   interior_medium = "fog"    name of a [[medium]]
///   radiance = [r, g, b]       W/(m^2 sr), >= 0, of the front side
///   smooth = true              interpolated normals, which the file must have; revolve has them
///   checker_block, checkers    a second material, and squares along u and v, each > 0; need texture coordinates
MeshInstance read_mesh(TomlTable& table, VoxelPos offset, const std::filesystem::path& folder);

}  // namespace world
