#include "world/formats/surfaces/paint.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include <fmt/format.h>

#include "world/formats/surfaces/colours.h"
#include "world/numbers/robust.h"
#include "world/units/rgb8.h"
#include "world/world.h"

namespace world {
namespace {

constexpr double kSamplesPerVoxel = 2;  // along an edge of a triangle
constexpr double kDepth = 0.01;         // of a voxel, below the surface
constexpr double kMostSamples = 4e8;    // of one mesh; then they lie further apart

struct Sum {
  float r = 0, g = 0, b = 0, weight = 0;
  void add(const Ratio3& c) { r += c.r, g += c.g, b += c.b, ++weight; }
  void add(const Sum& s) { r += s.r, g += s.g, b += s.b, weight += s.weight; }
  uint32_t mean() const { return rgb8_from_linear({r / weight, g / weight, b / weight}); }
};
using Sums = std::unordered_map<VoxelPos, Sum, PosHash>;

/// Calls visit(u, v) with barycentric coordinates of the middles of steps^2 parts of a triangle: none lies on its
/// border, so none falls into a voxel that the triangle only bounds.
template <class Visit>
void for_each_sample(int steps, Visit visit) {
  for (int i = 0; i < steps; ++i)
    for (int j = 0; i + j < steps; ++j) {
      visit((i + 1.0 / 3) / steps, (j + 1.0 / 3) / steps);
      if (i + j + 1 < steps) visit((i + 2.0 / 3) / steps, (j + 2.0 / 3) / steps);
    }
}

/// The nearest sample of a picture that repeats; v goes upwards.
Ratio3 texel(const ColourPicture& picture, const glm::vec2& uv) {
  const auto at = [](float t, uint32_t size) {
    if (!std::isfinite(t)) return uint32_t{0};
    const double part = static_cast<double>(t) - std::floor(static_cast<double>(t));
    return std::min(static_cast<uint32_t>(part * size), size - 1);
  };
  const uint32_t x = at(uv.x, picture.width), y = picture.height - 1 - at(uv.y, picture.height);
  return linear_from_rgb8(picture.pixels[size_t{y} * picture.width + x]);
}

VoxelPos voxel_at(const Vec3d& p, double size) {
  const Vec3d f = glm::floor(p / size);
  return {static_cast<int32_t>(f.x), static_cast<int32_t>(f.y), static_cast<int32_t>(f.z)};
}

/// Voxels of `block` with a side to the air, sorted.
std::vector<VoxelPos> exposed(const Store& store, BlockId block) {
  std::vector<VoxelPos> all;
  StoreReader reader(store), beside(store);
  for (const RegionPos& r : store.regions())
    for (int i = 0; i < kLeavesPerRegion; ++i) {
      const LeafPos l = leaf_from_region(r) + leaf_offset_in_region(i);
      const LeafBlocks leaf = reader.leaf(l);
      if (!leaf.values && leaf.uniform != block) continue;
      for (int n = 0; n < kLeafVoxels; ++n) {
        if (leaf[n] != block) continue;
        const VoxelPos v = voxel_from_leaf(l) + offset_in_leaf(n);
        for (int face = 0; face < 6; ++face) {
          VoxelPos next = v;
          next[face >> 1] += face & 1 ? 1 : -1;
          if (beside.get(next) != kAir) continue;
          all.push_back(v);
          break;
        }
      }
    }
  std::sort(all.begin(), all.end());
  return all;
}

template <class Visit>
void for_each_neighbour(VoxelPos v, Visit visit) {
  for (int n = 0; n < 27; ++n)
    if (n != 13) visit(v + VoxelPos{n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1});
}

/// Carries colours from where they fell through filled voxels, a ring at a time, until all that are wanted have one.
void spread(const Store& store, BlockId block, const Sums& sums, const std::vector<VoxelPos>& wanted,
            std::unordered_map<VoxelPos, uint32_t, PosHash>& colour_of) {
  std::unordered_set<VoxelPos, PosHash> missing(wanted.begin(), wanted.end());
  std::vector<std::pair<VoxelPos, uint32_t>> ring, next;
  for (const auto& [v, sum] : sums) ring.emplace_back(v, sum.mean());
  std::sort(ring.begin(), ring.end());
  std::unordered_set<VoxelPos, PosHash> seen;
  for (const auto& [v, colour] : ring) seen.insert(v);
  StoreReader reader(store);
  while (!missing.empty() && !ring.empty()) {
    next.clear();
    for (const auto& [v, colour] : ring)
      for_each_neighbour(v, [&, c = colour](VoxelPos n) {
        if (reader.get(n) != block || !seen.insert(n).second) return;
        next.emplace_back(n, c);
        if (missing.erase(n)) colour_of[n] = c;
      });
    ring.swap(next);
  }
}

/// Gives exposed voxels the colours that fell into them, or near them.
Status paint(World& world, BlockId block, const Sums& sums, ImportReport& report) {
  Sum all;
  for (const auto& [at, sum] : sums) all.add(Sum{sum.r / sum.weight, sum.g / sum.weight, sum.b / sum.weight, 1});
  const uint32_t mean = all.mean();
  const std::vector<VoxelPos> surface = exposed(world.store, block);
  std::unordered_map<VoxelPos, uint32_t, PosHash> colour_of;
  std::vector<VoxelPos> without;
  for (const VoxelPos& v : surface) {
    if (const auto own = sums.find(v); own != sums.end()) {
      colour_of[v] = own->second.mean();
      continue;
    }
    Sum around;
    for_each_neighbour(v, [&](VoxelPos n) {
      if (const auto found = sums.find(n); found != sums.end()) around.add(found->second);
    });
    if (around.weight > 0)
      colour_of[v] = around.mean();
    else
      without.push_back(v);
  }
  spread(world.store, block, sums, without, colour_of);
  for (const VoxelPos& v : without) colour_of.try_emplace(v, mean);

  std::unordered_set<uint32_t> used;
  for (const auto& [v, colour] : colour_of) used.insert(colour);
  used.insert(mean);
  TRY(const ColourBlocks blocks,
      ColourBlocks::make({used.begin(), used.end()}, (*world.palette)[block].name, kMostColours, *world.palette));
  // What no face shows: leaf by leaf, so that uniform leaves stay so.
  EditBatch edits;
  const BlockId inside = blocks[mean];
  for (const RegionPos& r : world.store.regions()) {
    StoreReader reader(world.store);
    for (int i = 0; i < kLeavesPerRegion; ++i) {
      const LeafPos l = leaf_from_region(r) + leaf_offset_in_region(i);
      const LeafBlocks leaf = reader.leaf(l);
      const VoxelPos low = voxel_from_leaf(l);
      if (!leaf.values) {
        if (leaf.uniform == block) edits.fill({low, low + VoxelPos{7, 7, 7}}, inside);
        continue;
      }
      for (int n = 0; n < kLeafVoxels; ++n)
        if (leaf[n] == block) edits.set(low + offset_in_leaf(n), inside);
    }
  }
  for (const VoxelPos& v : surface) edits.set(v, blocks[colour_of.at(v)]);
  TRY([[maybe_unused]] const EditReport done, world.store.apply(edits));
  report.fact("colours", std::to_string(used.size()));
  if (!blocks.approximated().empty()) report.warnings.push_back(blocks.approximated());
  return {};
}

}  // namespace

Status paint_mesh(World& world, BlockId block, const TriangleMesh& mesh, const MeshColours& colours,
                  std::span<const ColourPicture> textures, const glm::dmat3& turn, double size, ImportReport& report) {
  double samples = 0;
  const auto corner = [&](const glm::uvec3& t, int k) { return Vec3d(mesh.positions[t[k]]); };
  const auto steps_of = [&](const glm::uvec3& t, double spacing) {
    const Vec3d a = corner(t, 0), b = corner(t, 1), c = corner(t, 2);
    return std::max(1.0, std::ceil(std::max({glm::length(b - a), glm::length(c - a), glm::length(c - b)}) / spacing));
  };
  double spacing = size / kSamplesPerVoxel;
  for (const glm::uvec3& t : mesh.triangles) samples += 0.5 * steps_of(t, spacing) * steps_of(t, spacing);
  if (samples > kMostSamples) {
    spacing *= std::sqrt(samples / kMostSamples);
    report.warnings.push_back("the surface is so large that its colours were sampled less finely than its voxels");
  }
  Sums sums;
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    const glm::uvec3& t = mesh.triangles[i];
    // A little below the surface, so that faces between voxels colour the voxel that they belong to.
    const Vec3d ab = corner(t, 1) - corner(t, 0), ac = corner(t, 2) - corner(t, 0), normal = glm::cross(ab, ac);
    const Vec3d a = corner(t, 0) - kDepth * size * safe_normalize(normal, Vec3d(0));
    std::array<Ratio3, 3> at_corner;
    at_corner.fill({1, 1, 1});
    for (int k = 0; k < 3 && !colours.of_vertices.empty(); ++k)
      at_corner[static_cast<size_t>(k)] = linear_from_rgb8(colours.of_vertices[t[k]]);
    const MeshColours::Material* material =
        colours.of_triangles.empty() ? nullptr : &colours.materials[colours.of_triangles[i]];
    const ColourPicture* texture = nullptr;
    if (material && !mesh.texture_coordinates.empty() && colours.of_triangles[i] < textures.size())
      texture = &textures[colours.of_triangles[i]];
    if (texture && texture->pixels.empty()) texture = nullptr;
    // Vertices' own colours win: a file that has both holds them for programs that read no materials.
    const bool by_material = material && colours.of_vertices.empty();
    // Files of pictures often leave their factor black.
    const bool black = by_material && material->diffuse.max() == 0;
    for_each_sample(static_cast<int>(steps_of(t, spacing)), [&](double u, double v) {
      const auto mix = [&](const auto& p, const auto& q, const auto& r) {
        return p * static_cast<float>(1 - u - v) + q * static_cast<float>(u) + r * static_cast<float>(v);
      };
      Ratio3 colour = mix(at_corner[0], at_corner[1], at_corner[2]);
      if (by_material) {
        colour = material->diffuse;
        if (texture) {
          const auto& uv = mesh.texture_coordinates;
          const Ratio3 picture = texel(*texture, mix(uv[t[0]], uv[t[1]], uv[t[2]]));
          colour = black ? picture : colour * picture;
        }
      }
      sums[voxel_at(turn * (a + u * ab + v * ac), size)].add(colour);
    });
  }
  if (sums.empty()) return {};
  return paint(world, block, sums, report);
}

Status paint_points(World& world, BlockId block, std::span<const Vec3d> positions, std::span<const uint32_t> colours,
                    const glm::dmat3& turn, double size, ImportReport& report) {
  Sums sums;
  for (size_t i = 0; i < positions.size(); ++i)
    sums[voxel_at(turn * positions[i], size)].add(linear_from_rgb8(colours[i]));
  return paint(world, block, sums, report);
}

}  // namespace world
