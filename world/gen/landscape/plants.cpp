#include "world/gen/landscape/plants.h"

#include <algorithm>
#include <cstdlib>

#include "world/base/random.h"

namespace world::landscape {

namespace {

enum Stream : uint64_t { kTrees = 80, kUndergrowth, kMeadow, kFlowers, kReeds };
uint64_t stream(uint64_t seed, uint64_t which) { return mix64(seed * 0x9e3779b97f4a7c15ull + which); }

constexpr int kTreeCellLog2 = 3;  // one place for a tree every 8 m
constexpr int kTreeReach = 6;     // no crown is wider
constexpr int kTallest = 26;
static_assert(kTreeReach + 1 < Columns::kMargin, "trees ask for the ground's neighbours");

/// Draws one tree; positions are world positions.
struct TreePainter {
  const Materials& m;
  Canvas& canvas;
  uint64_t dice;

  bool is_leaf(BlockId b) const {
    return b == m.oak_leaves || b == m.birch_leaves || b == m.pine_needles || b == m.spruce_needles ||
           b == m.maple_leaves || b == m.bush;
  }
  void leaf(VoxelPos p, BlockId block) const {
    if (canvas.contains(p) && canvas.get(p) == kAir) canvas.put(p, block);
  }
  void log(VoxelPos p, BlockId block) const {
    if (!canvas.contains(p)) return;
    const BlockId there = canvas.get(p);
    if (there == kAir || is_leaf(there)) canvas.put(p, block);
  }
  void trunk(VoxelPos base, int height, BlockId block) const {
    for (int y = 0; y < height; ++y) log({base.x, base.y + y, base.z}, block);
  }
  /// An ellipsoid, a little frayed: radius across, half_height up and down.
  void crown(VoxelPos centre, int radius, int half_height, BlockId block) const {
    for (int dx = -radius; dx <= radius; ++dx)
      for (int dy = -half_height; dy <= half_height; ++dy)
        for (int dz = -radius; dz <= radius; ++dz) {
          const int q = (dx * dx + dz * dz) * 256 / (radius * radius) + dy * dy * 256 / (half_height * half_height);
          const int fray = static_cast<int>(random_bits(dice, dx, dy, dz) & 63);
          if (q <= 262 - fray) leaf({centre.x + dx, centre.y + dy, centre.z + dz}, block);
        }
  }
  void disc(VoxelPos centre, int radius, BlockId block) const {
    for (int dx = -radius; dx <= radius; ++dx)
      for (int dz = -radius; dz <= radius; ++dz)
        if (dx * dx + dz * dz <= radius * radius + (radius > 1 ? 1 : 0))
          leaf({centre.x + dx, centre.y, centre.z + dz}, block);
  }

  void broadleaf(VoxelPos base, BlockId wood, BlockId leaves) const {
    const int height = 5 + static_cast<int>(dice >> 8 & 3), radius = 3 + static_cast<int>(dice >> 10 & 1);
    trunk(base, height, wood);
    crown({base.x, base.y + height, base.z}, radius, 3, leaves);
  }
  void birch(VoxelPos base) const {
    const int height = 7 + static_cast<int>(dice >> 8 & 3);
    trunk(base, height, m.birch_log);
    crown({base.x, base.y + height - 1, base.z}, 2 + static_cast<int>(dice >> 10 & 1), 4, m.birch_leaves);
  }
  void great_oak(VoxelPos base) const {
    const int height = 9 + static_cast<int>(dice >> 8 & 3);
    for (const VoxelPos side : {VoxelPos{0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {1, 0, 1}}) {
      trunk(base + side + VoxelPos{0, -2, 0}, height + 2, m.oak_log);
    }
    for (int n = 1; n <= 3; ++n)  // four branches
      for (const VoxelPos way : {VoxelPos{1, 0, 0}, {-1, 0, 0}, {0, 0, 1}, {0, 0, -1}})
        log({base.x + way.x * n, base.y + height - 4 + n, base.z + way.z * n}, m.oak_log);
    crown({base.x, base.y + height, base.z}, 6, 4, m.oak_leaves);
  }
  void conifer(VoxelPos base, BlockId wood, BlockId needles, int slender) const {
    const int height = 9 + static_cast<int>(dice >> 8 & 7);
    trunk(base, height, wood);
    for (int y = 2; y < height; ++y) {
      const int radius = (height - y) / slender + ((height - y) & 1);
      disc({base.x, base.y + y, base.z}, std::min(radius, 4), needles);
    }
    leaf({base.x, base.y + height, base.z}, needles);
    leaf({base.x, base.y + height + 1, base.z}, needles);
  }
  void shrub(VoxelPos base) const { crown(base, 1 + static_cast<int>(dice >> 8 & 1), 1, m.bush); }
};

}  // namespace

void draw_trees(uint64_t seed, double density, const Columns& columns, const Terrain& terrain,
                std::span<const Homestead> homesteads, const Materials& m, Canvas& canvas) {
  const int32_t chance = static_cast<int32_t>(density * kNoiseOne);
  const auto cell = [](int32_t p) { return p >> kTreeCellLog2; };
  for (int32_t cx = cell(columns.x0 - kTreeReach); cx <= cell(columns.x0 + kRegionSize + kTreeReach - 1); ++cx)
    for (int32_t cz = cell(columns.z0 - kTreeReach); cz <= cell(columns.z0 + kRegionSize + kTreeReach - 1); ++cz) {
      const uint64_t dice = random_bits(seed, cx, 0, cz, 0, kTrees);
      const int x = (cx << kTreeCellLog2) + 1 + static_cast<int>((dice >> 16) % 6) - columns.x0;
      const int z = (cz << kTreeCellLog2) + 1 + static_cast<int>((dice >> 24) % 6) - columns.z0;
      const auto reaches = [](int p) { return p >= -kTreeReach && p < kRegionSize + kTreeReach; };
      if (!reaches(x) || !reaches(z)) continue;
      const size_t at = static_cast<size_t>(Columns::index(x, z));
      const Ground ground = columns.ground[at];
      const bool fertile = ground.soil > 1 && ground.top != m.snow && ground.below == m.dirt;
      if (!fertile || columns.overhang[at] > 0 || columns.height[at] > 150 * kMetre) continue;
      const int32_t wood = std::max<int32_t>(columns.wood[at] * 9 / 8, kNoiseOne / 40);
      if (static_cast<int32_t>(dice >> 40 & 4095) >= wood * chance >> 12) continue;
      const VoxelPos base{columns.x0 + x, columns.top(x, z) + 1, columns.z0 + z};
      if (base.y >= canvas.origin.y + kRegionSize || base.y + kTallest < canvas.origin.y) continue;
      const auto keeps_clear = [&](const Homestead& home) { return home.keeps_clear(base.x, base.z); };
      if (std::any_of(homesteads.begin(), homesteads.end(), keeps_clear)) continue;
      if (terrain.is_cave(columns, x, base.y - 1, z) || terrain.is_cave(columns, x, base.y - 2, z)) continue;

      const TreePainter painter{m, canvas, mix64(dice)};
      const int kind = static_cast<int>(dice >> 52 & 15), metres = columns.height[at] / kMetre;
      if (metres > 112 + kind)
        painter.conifer(base, m.spruce_log, m.spruce_needles, 4);
      else if (metres > 88 + kind)
        painter.conifer(base, m.pine_log, m.pine_needles, 3);
      else if (kind == 0)
        painter.great_oak(base);
      else if (kind < 6)
        painter.broadleaf(base, m.oak_log, m.oak_leaves);
      else if (kind < 10)
        painter.birch(base);
      else if (kind == 10)
        painter.broadleaf(base, m.oak_log, m.maple_leaves);
      else if (kind < 14)
        painter.conifer(base, m.pine_log, m.pine_needles, 3);
      else
        painter.shrub(base);
    }
}

void draw_undergrowth(uint64_t seed, const Columns& columns, const Materials& m, Canvas& canvas) {
  int32_t meadow[kRegionSize], flowers[kRegionSize], reeds[kRegionSize];
  for (int x = 0; x < kRegionSize; ++x) {
    noise2_row(stream(seed, kMeadow), 4, columns.x0 + x, columns.z0, 1, kRegionSize, meadow);
    noise2_row(stream(seed, kFlowers), 5, columns.x0 + x, columns.z0, 1, kRegionSize, flowers);
    noise2_row(stream(seed, kReeds), 4, columns.x0 + x, columns.z0, 1, kRegionSize, reeds);
    for (int z = 0; z < kRegionSize; ++z) {
      const size_t at = static_cast<size_t>(Columns::index(x, z));
      if (columns.overhang[at] > 0) continue;
      const int top = columns.top(x, z);
      const Ground ground = columns.ground[at];
      const bool shore = top >= kWaterTop - 1 && top <= kWaterTop && reeds[z] > kNoiseOne / 6;
      const bool green = ground.top == m.grass || ground.top == m.forest_floor;
      if (!shore && !green) continue;
      const uint64_t dice = random_bits(seed, columns.x0 + x, 0, columns.z0 + z, 0, kUndergrowth);
      const int32_t percent = static_cast<int32_t>((dice >> 32) % 100);
      const VoxelPos above{columns.x0 + x, top + 1, columns.z0 + z};
      // Plants leave out ground in the region below: whether it is still open there is not known here.
      const auto open = [&](BlockId ground_block) { return canvas.get(above + VoxelPos{0, -1, 0}) == ground_block; };
      if (shore) {
        const BlockId there = canvas.get(above);
        if (percent >= 45 || !open(ground.top) || (canvas.contains(above) && there != kAir && there != m.water))
          continue;
        const int height = kWaterTop + 3 - top + static_cast<int>(dice & 1);
        for (int y = 0; y < height - 1; ++y) canvas.put(above + VoxelPos{0, y, 0}, m.reed);
        continue;
      }
      if (!canvas.contains(above) || canvas.get(above) != kAir || !open(ground.top)) continue;
      if (ground.top == m.forest_floor) {
        if (percent < 4) canvas.put(above, m.fern);
      } else if (flowers[z] > kNoiseOne / 3 && percent < 4) {
        const BlockId kinds[] = {m.flower_red, m.flower_yellow, m.flower_blue, m.flower_white};
        canvas.put(above, kinds[(dice + static_cast<uint64_t>(columns.height[at] >> 10)) & 3]);
      } else if (meadow[z] > kNoiseOne / 4 && percent >= 90) {
        canvas.put(above, m.tall_grass);
      }
    }
  }
}

}  // namespace world::landscape
