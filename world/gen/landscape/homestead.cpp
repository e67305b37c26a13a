#include "world/gen/landscape/homestead.h"

#include <algorithm>
#include <cstdlib>

#include "world/base/random.h"

namespace world::landscape {

namespace {

constexpr uint64_t kHomesteadStream = 70;
constexpr int kCellLog2 = 8;
constexpr int kReach = 26;  // metres from the door to the farthest voxel drawn or kept clear
constexpr int kCabinSide = 5, kCabinBack = -7, kCabinFront = 1, kCabinHeight = 11;
constexpr int kYardSide = 11, kYardBack = -9, kYardFront = 12;

/// The ground's top voxel under a plan position, or nothing outside the region.
std::optional<int32_t> ground_top(const Columns& columns, VoxelPos p) {
  const int64_t x = int64_t{p.x} - columns.x0, z = int64_t{p.z} - columns.z0;
  if (x < 0 || x >= kRegionSize || z < 0 || z >= kRegionSize) return std::nullopt;
  return columns.top(static_cast<int>(x), static_cast<int>(z));
}

struct Builder {
  const Homestead& home;
  const Columns& columns;
  const Materials& m;
  Canvas& canvas;

  void put(int u, int y, int v, BlockId block) const { canvas.put(home.at(u, y, v), block); }
  /// Blocks upward from the first voxel above the ground; nothing on water.
  void raise(int u, int v, std::initializer_list<BlockId> blocks) const {
    const auto top = ground_top(columns, home.at(u, 0, v));
    if (!top || *top < kWaterTop) return;
    int32_t y = *top;
    for (const BlockId block : blocks) put(u, ++y, v, block);
  }
  void pave(int u, int v, BlockId block) const {
    const auto top = ground_top(columns, home.at(u, 0, v));
    if (top && *top >= kWaterTop) put(u, *top, v, block);
  }

  void cabin() const {
    const int32_t floor = home.door.y;
    for (int u = -kCabinSide; u <= kCabinSide; ++u)
      for (int v = kCabinBack; v <= kCabinFront; ++v) {
        for (int y = floor + 1; y <= floor + kCabinHeight; ++y) put(u, y, v, kAir);
        const bool inside = std::abs(u) <= 4 && v >= -6 && v <= 0;
        if (!inside) continue;
        put(u, floor, v, m.pine_planks);
        const auto top = ground_top(columns, home.at(u, 0, v));
        for (int y = floor - 1; top && y > *top - 1; --y) put(u, y, v, m.brick_stone);
        const bool side = std::abs(u) == 4, front = v == 0 || v == -6;
        if (!side && !front) continue;
        const bool window = (front && std::abs(u) == 2) || (side && (v == -2 || v == -4));
        const bool door = v == 0 && u == 0;
        for (int h = 1; h <= 4; ++h) {
          const bool opening = h == 2 || h == 3;
          BlockId wall = side && front ? m.oak_log : h == 1 ? m.cobblestone : m.oak_planks;
          if (window && opening) wall = m.glass;
          if (door && h <= 2) wall = kAir;
          put(u, floor + h, v, wall);
        }
        // Gables, up to the roof.
        for (int h = 5; side && h <= 8 - std::abs(v + 3); ++h) put(u, floor + h, v, m.oak_planks);
      }
    for (int u = -kCabinSide; u <= kCabinSide; ++u)
      for (int v = kCabinBack; v <= kCabinFront; ++v) put(u, floor + 9 - std::abs(v + 3), v, m.roof_tile);
    for (int h = 1; h <= 11; ++h) put(3, floor + h, -5, m.brick_red);
    put(0, floor + 4, -3, m.lamp_warm);
    put(-3, floor + 1, -5, m.lamp_warm);
    put(1, floor + 3, 1, m.lantern);
    put(-1, floor + 3, 1, m.lantern);
  }

  void yard() const {
    for (int u = -kYardSide; u <= kYardSide; ++u)
      for (int v = kYardBack; v <= kYardFront; ++v) {
        const bool edge = std::abs(u) == kYardSide || v == kYardBack || v == kYardFront;
        const bool gate = v == kYardFront && std::abs(u) <= 1;
        if (!edge || gate) continue;
        const bool corner = std::abs(u) == kYardSide && (v == kYardBack || v == kYardFront);
        if (corner || (v == kYardFront && std::abs(u) == 2))
          raise(u, v, {m.fence_oak, m.fence_oak, m.lantern});
        else
          raise(u, v, {m.fence_oak});
      }
    for (int v = 1; v <= 22; ++v) {
      pave(0, v, m.path);
      if (v > 1) pave(v % 3 == 0 ? -1 : 1, v, m.path);
    }
    for (int u = 5; u <= 9; ++u)
      for (int v = 3; v <= 9; ++v) {
        pave(u, v, m.farmland);
        if (u != 7) raise(u, v, {(u * 5 + v * 3) % 7 == 0 ? m.pumpkin : m.wheat});
      }
    raise(-7, -5, {m.hay, m.hay});
    raise(-7, -4, {m.hay});
    raise(-8, -5, {m.hay});
    raise(-7, 4, {m.oak_log});
    raise(-6, 4, {m.oak_log});
    raise(-9, 9, {m.bush});
    raise(-8, 9, {m.flower_red});
    raise(-7, 9, {m.flower_yellow});
    raise(-6, 9, {m.flower_blue});
    for (int u = -4; u <= 4; u += 2)
      if (u != 0) raise(u, 1, {u > 0 ? m.flower_white : m.flower_red});
  }
};

}  // namespace

Homestead::PlanPosition Homestead::plan(int32_t x, int32_t z) const {
  const int64_t dx = int64_t{x} - door.x, dz = int64_t{z} - door.z;
  return {quarter_turns == 0   ? dx
          : quarter_turns == 1 ? -dz
          : quarter_turns == 2 ? -dx
                               : dz,
          quarter_turns == 0   ? dz
          : quarter_turns == 1 ? dx
          : quarter_turns == 2 ? -dz
                               : -dx};
}

bool Homestead::keeps_clear(int32_t x, int32_t z) const {
  const auto [u, v] = plan(x, z);
  return std::abs(u) <= kYardSide + 3 && v >= kYardBack - 3 && v <= kReach;
}

bool Homestead::clears(VoxelPos p) const {
  const auto [u, v] = plan(p.x, p.z);
  return p.y > door.y && p.y <= door.y + kCabinHeight && std::abs(u) <= kCabinSide && v >= kCabinBack &&
         v <= kCabinFront;
}

std::optional<Homestead> homestead_of_cell(const Relief& relief, int32_t cell_x, int32_t cell_z) {
  constexpr int kTries = 16;
  const int32_t x0 = static_cast<int32_t>(int64_t{cell_x} << kCellLog2),
                z0 = static_cast<int32_t>(int64_t{cell_z} << kCellLog2);
  for (int n = 0; n < kTries; ++n) {
    const uint64_t dice = random_bits(relief.seed(), cell_x, n, cell_z, 0, kHomesteadStream);
    const int32_t x = x0 + 28 + static_cast<int32_t>(dice % 200),
                  z = z0 + 28 + static_cast<int32_t>((dice >> 16) % 200);
    const int32_t here = relief.height(x, z);
    if (here < kWaterLevel + 2 * kMetre || here > kWaterLevel + 9 * kMetre) continue;
    int32_t low = here, high = here;
    for (const auto& [dx, dz] : {std::pair{-8, -8}, {8, -8}, {-8, 8}, {8, 8}, {12, 0}, {-12, 0}, {0, 12}, {0, -12}}) {
      const int32_t h = relief.height(x + dx, z + dz);
      low = std::min(low, h), high = std::max(high, h);
    }
    if (low < kWaterLevel + kMetre || high - low > 4 * kMetre) continue;
    // The door looks downhill, to the water.
    Homestead home{{x, (here - kMetre / 2 - 1) >> 8, z}, 0};
    int32_t lowest = INT32_MAX;
    for (int turn = 0; turn < 4; ++turn) {
      const VoxelPos ahead = Homestead{home.door, turn}.at(0, 0, 40);
      const int32_t h = relief.height(ahead.x, ahead.z);
      if (h < lowest) lowest = h, home.quarter_turns = turn;
    }
    return home;
  }
  return std::nullopt;
}

std::vector<Homestead> homesteads_near(const Relief& relief, RegionPos region) {
  constexpr int kFar = kReach + Columns::kMargin;
  const VoxelPos first = voxel_from_region(region);
  std::vector<Homestead> found;
  for (int32_t cx = (first.x - kFar) >> kCellLog2; cx <= (first.x + kRegionSize + kFar) >> kCellLog2; ++cx)
    for (int32_t cz = (first.z - kFar) >> kCellLog2; cz <= (first.z + kRegionSize + kFar) >> kCellLog2; ++cz)
      if (const auto home = homestead_of_cell(relief, cx, cz)) found.push_back(*home);
  return found;
}

void draw_homestead(const Homestead& home, const Columns& columns, const Materials& materials, Canvas& canvas) {
  const auto apart = [](int32_t p, int32_t first) { return p + kReach < first || p - kReach >= first + kRegionSize; };
  if (apart(home.door.x, canvas.origin.x) || apart(home.door.y, canvas.origin.y) || apart(home.door.z, canvas.origin.z))
    return;
  const Builder builder{home, columns, materials, canvas};
  builder.yard();
  builder.cabin();
}

}  // namespace world::landscape
