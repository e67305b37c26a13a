#include "world/gen/landscape/terrain.h"

#include <algorithm>

#include "world/base/random.h"

namespace world::landscape {

namespace {

enum Stream : uint64_t { kTunnelA = 40, kTunnelB, kChambers, kRough, kOverhangs, kLayers = 50, kOreZone, kOreLeaf };
uint64_t stream(uint64_t seed, uint64_t which) { return mix64(seed * 0x9e3779b97f4a7c15ull + which); }

constexpr int32_t kNoCave = 1 << 22;  // of cave values: 64 times it still fits 32 bits
constexpr int kPoolTop = 9;           // caves are filled with a liquid up to here

/// The voxels of a leaf, from its 27 lattice points (`first` is the lowest): linear along x, then y, then z. Values
/// come out 64 times as large. `layers` is 8, or 9 to see the voxels just above.
template <int layers>
void interpolate(const int32_t* first, int side, int32_t* out) {
  for (int x = 0; x < 8; ++x) {
    const int32_t* near = first + (x >> 2) * side * side;
    const int32_t* far = near + side * side;
    const int fx = x & 3;
    int32_t plane[3][3];
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) plane[j][k] = near[j * side + k] * (4 - fx) + (fx ? far[j * side + k] * fx : 0);
    for (int y = 0; y < layers; ++y) {
      const int32_t* low = plane[y >> 2];
      const int32_t* high = plane[(y >> 2) + ((y & 3) ? 1 : 0)];
      const int fy = y & 3;
      int32_t r[3];
      for (int k = 0; k < 3; ++k) r[k] = low[k] * (4 - fy) + high[k] * fy;
      for (int z = 0; z < 4; ++z) {
        out[z] = r[0] * (4 - z) + r[1] * z;
        out[z + 4] = r[1] * (4 - z) + r[2] * z;
      }
      out += 8;
    }
  }
}

/// The same at one place, from the 8 lattice points around it.
int32_t interpolate(const int32_t (&corners)[2][2][2], int x, int32_t y, int z) {
  const auto mix = [](int32_t a, int32_t b, int f) { return a * (4 - f) + b * f; };
  const auto along_x = [&](int j, int k) { return mix(corners[0][j][k], corners[1][j][k], x & 3); };
  return mix(mix(along_x(0, 0), along_x(1, 0), y & 3), mix(along_x(0, 1), along_x(1, 1), y & 3), z & 3);
}

/// By which an overhang's noise, 64 times as large, moves the ground.
int32_t overhang_shift(int32_t overhang, int32_t noise) {
  return static_cast<int32_t>(int64_t{overhang} * noise >> 18);
}

/// The least of a leaf's 27 lattice points.
int32_t least(const int32_t* first, int side) {
  int32_t low = INT32_MAX;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) low = std::min(low, first[(i * side + j) * side + k]);
  return low;
}

struct Ore {
  BlockId block;
  int lowest, highest;  // y
};

}  // namespace

struct Terrain::Scratch {
  Lattice caves, overhangs;
};

Terrain::Terrain(const Relief& relief, const Materials& materials, bool caves, bool lava)
    : materials_(materials), seed_(relief.seed()), caves_(caves), pool_(lava ? materials.lava : materials.water) {
  // Layers of rock 5 to 24 m thick; marble and sandstone are rare and thin.
  for (int y = 0, n = 0; y < 256; ++n) {
    const uint64_t dice = random_bits(seed_, n, 0, 0, 0, kLayers);
    const size_t kind = dice % 16 < 9 ? dice % 16 % 9 : dice % 16 < 13 ? 0 : 1;
    const int thick = kind >= 7 ? 3 + static_cast<int>(dice >> 32 & 3) : 6 + static_cast<int>(dice >> 32 & 15);
    for (int end = std::min(256, y + thick); y < end; ++y) layers_[static_cast<size_t>(y)] = materials.rocks[kind];
  }
  for (const BlockId rock : materials.rocks) {
    if (is_rock_.size() <= rock) is_rock_.resize(rock + 1u);
    is_rock_[rock] = 1;
  }
}

/// Negative in caves. Two noises vanish together along curves: tunnels; a third makes them wide or closes them.
void Terrain::cave_row(int64_t x, int32_t y, int64_t z, int count, int32_t* out) const {
  constexpr int32_t kWidest = 600, kFar = 700;  // in the units of noise: a tunnel's radius, and where it has no say
  int32_t a[Lattice::kSide], b[Lattice::kSide], chambers[Lattice::kSide], rough[Lattice::kSide];
  noise3_row(stream(seed_, kTunnelA), 7, 6, x, y, z, Lattice::kStep, count, a);
  noise3_row(stream(seed_, kTunnelB), 7, 6, x, y, z, Lattice::kStep, count, b);
  bool any = false;
  for (int i = 0; i < count; ++i) {
    const int32_t squared = a[i] * a[i] + b[i] * b[i];
    out[i] = (squared - kFar * kFar / 4) >> 4;
    any |= squared < kFar * kFar;
  }
  if (!any) return;
  noise3_row(stream(seed_, kChambers), 6, 5, x, y, z, Lattice::kStep, count, chambers);
  noise3_row(stream(seed_, kRough), 4, 4, x, y, z, Lattice::kStep, count, rough);
  const int32_t floor = std::max(0, 12 - y) * 24;
  for (int i = 0; i < count; ++i) {
    if (a[i] * a[i] + b[i] * b[i] >= kFar * kFar) continue;  // by each point alone: rows of any length agree
    const int32_t na = a[i] + (rough[i] >> 6), nb = b[i];
    const int32_t radius = std::min(130 + chambers[i] / 6, kWidest) - floor;
    out[i] = ((na * na + nb * nb) >> 4) + (radius > 0 ? -(radius * radius >> 4) : kNoiseOne);
  }
}

namespace {

/// The least and greatest height, in metres, of the columns whose voxels read a lattice plane; of those with overhangs
/// alone, where asked for. low > high where there are none.
struct Heights {
  int32_t low = INT32_MAX, high = INT32_MIN;
};
Heights heights_around(const Columns& columns, int x, bool overhanging) {
  Heights heights;
  for (int near = x - 3; near <= x + 3; ++near)
    for (int z = -3; z < kRegionSize + 3; ++z) {
      const size_t at = static_cast<size_t>(Columns::index(near, z));
      if (overhanging && columns.overhang[at] == 0) continue;
      heights.low = std::min(heights.low, columns.height[at] >> 8);
      heights.high = std::max(heights.high, columns.height[at] >> 8);
    }
  return heights;
}

}  // namespace

/// False where the region has none.
bool Terrain::make_caves(const Columns& columns, int32_t y0, Lattice& out) const {
  bool any = false;
  for (int x = 0; x < Lattice::kSide; ++x) {
    const int32_t high = heights_around(columns, x * Lattice::kStep, false).high;
    const int levels = std::clamp((high + kMaxOverhang - y0) / Lattice::kStep + 3, 0, Lattice::kSide);
    std::fill(out.row(x, levels, 0), out.row(x, Lattice::kSide, 0), kNoCave);
    for (int y = 0; y < levels; ++y) {
      int32_t* row = out.row(x, y, 0);
      const int32_t world_y = y0 + y * Lattice::kStep;
      cave_row(int64_t{columns.x0} + x * Lattice::kStep, world_y, columns.z0, Lattice::kSide, row);
      for (int z = 0; z < Lattice::kSide; ++z) {
        const int at = Columns::index(x * Lattice::kStep, z * Lattice::kStep);
        if (world_y >= columns.cave_top[static_cast<size_t>(at)]) row[z] = kNoCave;
        any |= row[z] < 0;
      }
    }
  }
  return any;
}

bool Terrain::is_cave(const Columns& columns, int x, int32_t y, int z) const {
  if (!caves_ || y < 0) return false;
  const int x0 = x & ~3, z0 = z & ~3;
  const int32_t y0 = y & ~3;
  int32_t corners[2][2][2];
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j) {
      cave_row(int64_t{columns.x0} + x0 + 4 * i, y0 + 4 * j, int64_t{columns.z0} + z0, 2, corners[i][j]);
      for (int k = 0; k < 2; ++k)
        if (y0 + 4 * j >= columns.cave_top[static_cast<size_t>(Columns::index(x0 + 4 * i, z0 + 4 * k))])
          corners[i][j][k] = kNoCave;
    }
  return interpolate(corners, x, y, z) < 0;
}

bool Terrain::is_ground(const Columns& columns, int x, int32_t y, int z) const {
  if (y < 0) return true;
  const size_t at = static_cast<size_t>(Columns::index(x, z));
  const int32_t height = columns.height[at], overhang = columns.overhang[at];
  const int32_t above = height - y * kMetre - kMetre / 2;  // ground, without its overhang
  bool ground = above > 0;
  if (std::abs(above) <= overhang) {
    int32_t corners[2][2][2];
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < 2; ++j)
        overhang_row(int64_t{columns.x0} + (x & ~3) + 4 * i, (y & ~3) + 4 * j, int64_t{columns.z0} + (z & ~3), 2,
                     corners[i][j]);
    ground = above + overhang_shift(overhang, interpolate(corners, x, y, z)) > 0;
  }
  return ground && !is_cave(columns, x, y, z);
}

void Terrain::overhang_row(int64_t x, int32_t y, int64_t z, int count, int32_t* out) const {
  int32_t fine[Lattice::kSide];
  noise3_row(stream(seed_, kOverhangs), 5, 4, x, y, z, Lattice::kStep, count, out);
  noise3_row(stream(seed_, kOverhangs) + 1, 4, 3, x, y, z, Lattice::kStep, count, fine);
  for (int i = 0; i < count; ++i) out[i] = std::clamp((out[i] * 3 + fine[i]) >> 2, -kNoiseOne, kNoiseOne);
}

/// Around the heights of the columns that have overhangs. Elsewhere old values stay, which decide nothing: noise is at
/// most 1, so it moves no ground by more than the overhang.
void Terrain::make_overhangs(const Columns& columns, int32_t y0, Lattice& out) const {
  for (int x = 0; x < Lattice::kSide; ++x) {
    const Heights heights = heights_around(columns, x * Lattice::kStep, true);
    if (heights.low > heights.high) continue;
    const int first = std::clamp((heights.low - kMaxOverhang - 16 - y0) / Lattice::kStep, 0, Lattice::kSide);
    const int end = std::clamp((heights.high + kMaxOverhang + 16 - y0) / Lattice::kStep, 0, Lattice::kSide);
    for (int y = first; y < end; ++y)
      overhang_row(int64_t{columns.x0} + x * Lattice::kStep, y0 + y * Lattice::kStep, columns.z0, Lattice::kSide,
                   out.row(x, y, 0));
  }
}

void Terrain::surface_leaf(const Columns& columns, const Lattice* overhangs, VoxelPos offset, int32_t y0,
                           Canvas::Leaf& out) const {
  int32_t noise[8 * 9 * 8];
  if (overhangs) interpolate<9>(overhangs->row(offset.x / 4, offset.y / 4, offset.z / 4), Lattice::kSide, noise);
  const Materials& m = materials_;
  for (int x = 0; x < 8; ++x)
    for (int z = 0; z < 8; ++z) {
      const size_t at = static_cast<size_t>(Columns::index(offset.x + x, offset.z + z));
      const Ground ground = columns.ground[at];
      const int strata = columns.strata[static_cast<size_t>((offset.x + x) * kRegionSize + offset.z + z)];
      const int32_t height = columns.height[at], overhang = columns.overhang[at];
      BlockId* column = &out[static_cast<size_t>(x * 64 + z)];
      if (!overhangs || overhang == 0) {
        const int32_t top = (height - kMetre / 2 - 1) >> 8;
        for (int y = 0; y < 8; ++y) {
          const int32_t depth = top - (y0 + y);
          column[y * 8] = depth >= ground.soil  ? rock(y0 + y, strata)
                          : depth > 0           ? ground.below
                          : depth == 0          ? ground.top
                          : y0 + y <= kWaterTop ? m.water
                                                : kAir;
        }
        continue;
      }
      // Density: metres of ground above the voxel's centre, moved by the overhang's noise. Soil lies on top only.
      const int32_t* n = noise + x * 72 + z;
      for (int y = 0; y < 8; ++y) {
        const auto density = [&](int j) {
          return height + overhang_shift(overhang, n[j * 8]) - (y0 + j) * kMetre - kMetre / 2;
        };
        const int32_t here = density(y);
        if (here <= 0)
          column[y * 8] = y0 + y <= kWaterTop ? m.water : kAir;
        else if (ground.soil > 0 && density(y + 1) <= 0)
          column[y * 8] = ground.top;
        else
          column[y * 8] = here <= ground.soil * kMetre && overhang < kMetre ? ground.below : rock(y0 + y, strata);
      }
    }
}

/// At most one vein a leaf, wholly inside it, so that a vein costs one mixed leaf. Zones of 64 m share a kind of ore.
void Terrain::add_ore(VoxelPos leaf, bool beside_cave, Canvas::Leaf& out) const {
  const Materials& m = materials_;
  const Ore ores[] = {{m.coal_ore, 30, 255},     {m.iron_ore, 8, 150},  {m.copper_ore, 20, 130}, {m.coal_ore, 40, 255},
                      {m.tin_ore, 20, 110},      {m.silver_ore, 0, 60}, {m.gold_ore, 0, 48},     {m.diamond_ore, 0, 24},
                      {m.emerald_ore, 110, 255}, {m.ruby_ore, 0, 40},   {m.salt_rock, 10, 90},   {m.sulfur_ore, 0, 30},
                      {m.iron_ore, 0, 200},      {m.iron_ore, 60, 255}, {m.copper_ore, 70, 200}, {m.coal_ore, 0, 120}};
  const uint64_t zone = random_bits(seed_, leaf.x >> 6, leaf.y >> 6, leaf.z >> 6, 0, kOreZone);
  const uint64_t dice = random_bits(seed_, leaf.x, leaf.y, leaf.z, 0, kOreLeaf);
  const Ore& ore = ores[zone % 16];
  BlockId block = leaf.y + 4 >= ore.lowest && leaf.y + 4 <= ore.highest ? ore.block : m.coal_ore;
  if (beside_cave && leaf.y < 72 && dice % 8 == 0) block = m.glowstone;
  const int cx = 2 + static_cast<int>(dice >> 8 & 3), cy = 2 + static_cast<int>(dice >> 10 & 3),
            cz = 2 + static_cast<int>(dice >> 12 & 3);
  const int reach = 2 + static_cast<int>(dice >> 14 & 7);  // squared radius
  for (int v = 0; v < kLeafVoxels; ++v) {
    const VoxelPos p = offset_in_leaf(v);
    const int d = (p.x - cx) * (p.x - cx) + (p.y - cy) * (p.y - cy) + (p.z - cz) * (p.z - cz);
    if (d > reach) continue;
    BlockId& voxel = out[static_cast<size_t>(v)];
    const bool frayed = d > reach / 2 && (mix64(dice + static_cast<uint64_t>(v)) & 3) == 0;
    if (!frayed && voxel < is_rock_.size() && is_rock_[voxel]) voxel = block;
  }
}

void Terrain::carve(const Lattice& caves, VoxelPos offset, int32_t y0, Canvas::Leaf& out) const {
  int32_t value[kLeafVoxels];
  interpolate<8>(caves.row(offset.x / 4, offset.y / 4, offset.z / 4), Lattice::kSide, value);
  for (int v = 0; v < kLeafVoxels; ++v) {
    BlockId& voxel = out[static_cast<size_t>(v)];
    if (value[v] < 0 && voxel != materials_.water && voxel != kAir)
      voxel = y0 + (v >> 3 & 7) <= kPoolTop ? pool_ : kAir;
  }
}

void Terrain::fill(const Columns& columns, Canvas& canvas) const {
  const int32_t y0 = canvas.origin.y;
  if (y0 > kHighestGround) return;
  if (y0 < 0) {  // the deep: granite without caves
    for (int leaf = 0; leaf < kLeavesPerRegion; ++leaf) canvas.set_uniform(leaf, materials_.rocks[1]);
    return;
  }
  thread_local Scratch scratch;
  const bool caves = caves_ && make_caves(columns, y0, scratch.caves);
  const bool overhangs = std::any_of(columns.overhang.begin(), columns.overhang.end(), [](int32_t o) { return o > 0; });
  if (overhangs) make_overhangs(columns, y0, scratch.overhangs);

  for (int lx = 0; lx < kRegionLeaves; ++lx)
    for (int lz = 0; lz < kRegionLeaves; ++lz) {
      int32_t low = INT32_MAX, high = INT32_MIN, overhang = 0;
      for (int x = lx * 8; x < lx * 8 + 8; ++x)
        for (int z = lz * 8; z < lz * 8 + 8; ++z) {
          const size_t at = static_cast<size_t>(Columns::index(x, z));
          low = std::min(low, columns.height[at]), high = std::max(high, columns.height[at]);
          overhang = std::max(overhang, columns.overhang[at]);
        }
      const int32_t deepest_soil = ((low - overhang) >> 8) - 5, highest = ((high + overhang) >> 8) + 1;
      const int centre = columns.strata[static_cast<size_t>((lx * 8 + 4) * kRegionSize + lz * 8 + 4)];
      for (int ly = 0; ly < kRegionLeaves; ++ly) {
        const VoxelPos offset{lx * 8, ly * 8, lz * 8};
        const VoxelPos leaf = canvas.origin + offset;
        const int index = index_in_region({lx, ly, lz});
        if (leaf.y > highest) {
          if (leaf.y <= kWaterTop) canvas.set_uniform(index, materials_.water);
          continue;
        }
        const bool cave =
            caves && least(scratch.caves.row(offset.x / 4, offset.y / 4, offset.z / 4), Lattice::kSide) < 0;
        const uint64_t zone = random_bits(seed_, leaf.x >> 6, leaf.y >> 6, leaf.z >> 6, 0, kOreZone);
        const uint64_t chance = zone >> 32 & 3 ? 1 : 9;  // in 128: one zone in four is rich
        const bool ore =
            (random_bits(seed_, leaf.x, leaf.y, leaf.z, 0, kOreLeaf) >> 32 & 127) < (cave ? chance * 3 : chance);
        if (leaf.y + 7 >= deepest_soil) {
          surface_leaf(columns, overhang > 0 ? &scratch.overhangs : nullptr, offset, leaf.y,
                       canvas.open_unfilled(index));
        } else if (cave || ore) {
          Canvas::Leaf& out = canvas.open_unfilled(index);
          for (int v = 0; v < kLeafVoxels; ++v) {
            const VoxelPos p = offset_in_leaf(v);
            const int strata = columns.strata[static_cast<size_t>((offset.x + p.x) * kRegionSize + offset.z + p.z)];
            out[static_cast<size_t>(v)] = rock(leaf.y + p.y, strata);
          }
        } else {
          canvas.set_uniform(index, rock(leaf.y + 4, centre));
          continue;
        }
        Canvas::Leaf& out = canvas.open(index);
        if (ore) add_ore(leaf, cave, out);
        if (cave) carve(scratch.caves, offset, leaf.y, out);
      }
    }
}

}  // namespace world::landscape
