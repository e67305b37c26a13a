#include "world/meshes/placement.h"

#include <cmath>

#include <fmt/format.h>

namespace world {
namespace {

constexpr double kBorder = kWorldBorder - 1;

glm::dmat3 rotation(int axis, double degrees) {
  const double angle = degrees * 3.14159265358979323846 / 180;
  // Quarter turns are exact, so that what stood on the grid still does.
  double c = std::cos(angle), s = std::sin(angle);
  if (std::fmod(degrees, 90) == 0) c = std::round(c), s = std::round(s);
  glm::dmat3 m(1.0);
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  m[u][u] = c, m[u][v] = s, m[v][u] = -s, m[v][v] = c;
  return m;
}

/// Whether it squeezes no direction to nothing, beside the others.
bool invertible(const glm::dmat3& m) {
  const double size = length(m[0]) * length(m[1]) * length(m[2]);
  return std::abs(dot(m[0], cross(m[1], m[2]))) > 1e-9 * size;
}

}  // namespace

void read_placement(TomlTable& table, VoxelPos offset, std::string_view what, WorldPoint& world_position,
                    glm::dmat3& transform) {
  double position[3] = {0, 0, 0}, rows[12], scale[3] = {1, 1, 1}, rotate[3] = {0, 0, 0};
  const NumberRange inside{-kBorder, kBorder}, factor{-1e6, 1e6};
  table.read("position", std::span<double>(position), inside);
  Vec3d moved(position[0], position[1], position[2]);
  if (table.has_array("scale"))
    table.read("scale", std::span<double>(scale), factor);
  else if (table.read("scale", scale[0], factor))
    scale[1] = scale[2] = scale[0];
  if (scale[0] == 0 || scale[1] == 0 || scale[2] == 0) table.fail("scale", "'scale' must not be 0");
  table.read("rotate_deg", std::span<double>(rotate), {-3600, 3600});
  for (int a = 0; a < 3; ++a) transform[a][a] = scale[a];
  for (int a = 0; a < 3; ++a) transform = rotation(a, rotate[a]) * transform;
  if (table.read("matrix", std::span<double>(rows), inside)) {
    if (table.has("scale") || table.has("rotate_deg"))
      table.fail("matrix", "'matrix' excludes 'scale' and 'rotate_deg'");
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) transform[column][row] = rows[row * 4 + column];
      moved[row] += rows[row * 4 + 3];
    }
    if (!invertible(transform))
      table.fail("matrix", fmt::format("'matrix' has no inverse: it makes the {} flat", what));
  }
  for (int a = 0; a < 3; ++a)
    if (!(std::abs(moved[a]) <= kBorder))
      return table.fail("position", fmt::format("the {} lies outside the world", what));
  world_position = WorldPoint::from(moved.x, moved.y, moved.z);
  world_position.voxel = world_position.voxel + offset;
}

}  // namespace world
