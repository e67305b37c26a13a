#include "world/gen/landscape/columns.h"

#include <algorithm>
#include <cstdlib>

#include "world/base/random.h"
#include "world/gen/generator.h"

namespace world::landscape {

namespace {

// Streams of noise: each use of the seed has its own number.
enum Stream : uint64_t {
  kWander = 1,
  kMeander,
  kWidth,
  kMassif,
  kRidge,
  kFloor = 12,
  kLake,
  kShore,
  kCliffs,
  kPatches,
  kWoods,
  kStrata,
  kHills
};

uint64_t stream(uint64_t seed, uint64_t which) { return mix64(seed * 0x9e3779b97f4a7c15ull + which); }

constexpr int kValleyLog2 = 10;  // metres from valley to valley, and from lake to lake
constexpr int32_t kFold = 1 << (kValleyLog2 - 1);
constexpr int32_t kSlopeWidth = 230 * kMetre;  // from the edge of the floor to full mountain
/// A far row of the noise plane for each valley, so that valleys don't wander alike.
int64_t valley_row(int32_t valley, int cell_log2) {
  return (int64_t{valley} * 37 << cell_log2) + (1 << (cell_log2 - 1));
}

int32_t smooth(int32_t t) {  // 3t^2 - 2t^3 on [0, 1] in 1/4096
  t = std::clamp(t, 0, kNoiseOne);
  return ((t * t >> 12) * (3 * kNoiseOne - 2 * t)) >> 12;
}

/// |n| with a round bottom, so that ridges are crests and not needles.
int32_t rounded_abs(int32_t n) {
  constexpr int32_t kRound = kNoiseOne / 16;
  return std::abs(n) >= kRound ? std::abs(n) : (n * n / kRound + kRound) / 2;
}

struct Line {
  std::array<int32_t, Columns::kSide> v;
  void fill(uint64_t seed, int cell_log2, int64_t x, int64_t z, int count) {
    noise2_row(seed, cell_log2, x, z, 1, count, v.data());
  }
  int32_t operator[](int i) const { return v[static_cast<size_t>(i)]; }
};

}  // namespace

Result<Materials> Materials::from(const BlockPalette& palette) {
  Materials m;
  const std::pair<BlockId*, const char*> needed[] = {
#define LOAM_NEEDED(name) {&m.name, #name},
      LOAM_NEEDED(water) LOAM_NEEDED(lava) LOAM_NEEDED(sand) LOAM_NEEDED(gravel) LOAM_NEEDED(mud) LOAM_NEEDED(clay)
          LOAM_NEEDED(dirt) LOAM_NEEDED(grass) LOAM_NEEDED(dry_grass) LOAM_NEEDED(forest_floor) LOAM_NEEDED(podzol)
              LOAM_NEEDED(scree) LOAM_NEEDED(snow) LOAM_NEEDED(coal_ore) LOAM_NEEDED(iron_ore) LOAM_NEEDED(copper_ore)
                  LOAM_NEEDED(tin_ore) LOAM_NEEDED(silver_ore) LOAM_NEEDED(gold_ore) LOAM_NEEDED(diamond_ore)
                      LOAM_NEEDED(emerald_ore) LOAM_NEEDED(ruby_ore) LOAM_NEEDED(salt_rock) LOAM_NEEDED(sulfur_ore)
                          LOAM_NEEDED(glowstone) LOAM_NEEDED(oak_log) LOAM_NEEDED(oak_leaves) LOAM_NEEDED(birch_log)
                              LOAM_NEEDED(birch_leaves) LOAM_NEEDED(pine_log) LOAM_NEEDED(pine_needles)
                                  LOAM_NEEDED(spruce_log) LOAM_NEEDED(spruce_needles) LOAM_NEEDED(maple_leaves)
                                      LOAM_NEEDED(bush) LOAM_NEEDED(reed) LOAM_NEEDED(tall_grass) LOAM_NEEDED(fern)
                                          LOAM_NEEDED(flower_red) LOAM_NEEDED(flower_yellow) LOAM_NEEDED(flower_blue)
                                              LOAM_NEEDED(flower_white) LOAM_NEEDED(fence_oak) LOAM_NEEDED(oak_planks)
                                                  LOAM_NEEDED(pine_planks) LOAM_NEEDED(glass) LOAM_NEEDED(roof_tile)
                                                      LOAM_NEEDED(brick_red) LOAM_NEEDED(brick_stone)
                                                          LOAM_NEEDED(cobblestone) LOAM_NEEDED(lamp_warm)
                                                              LOAM_NEEDED(lantern) LOAM_NEEDED(path)
                                                                  LOAM_NEEDED(farmland) LOAM_NEEDED(wheat)
                                                                      LOAM_NEEDED(pumpkin) LOAM_NEEDED(hay)
#undef LOAM_NEEDED
  };
  for (const auto& [id, name] : needed) {
    TRY(*id, needed_block(palette, name));
  }
  const char* rocks[] = {"stone", "granite", "limestone", "slate", "sandstone", "gneiss", "basalt", "shale", "marble"};
  for (size_t i = 0; i < m.rocks.size(); ++i) {
    TRY(m.rocks[i], needed_block(palette, rocks[i]));
  }
  return m;
}

int32_t Relief::valley_centre(int32_t valley, int32_t z) const {
  const int32_t wide = noise2(stream(seed_, kWander), 9, valley_row(valley, 9), z);
  const int32_t narrow = noise2(stream(seed_, kWander), 7, valley_row(valley, 7), z);
  return (wide * 146 + narrow * 26) >> 4;
}

/// Lowers the ground to a bowl around the lake's centre, and leaves an island in it.
void Relief::carve_lake(int32_t x, int32_t z, int count, int32_t valley, int32_t lake, int32_t* height) const {
  const uint64_t dice = random_bits(seed_, valley, 0, lake, 0, kLake);
  const int32_t centre_z = static_cast<int32_t>(dice % 200) - 100;  // from the middle of its 1024 m
  const int32_t middle_z = static_cast<int32_t>(int64_t{lake} << kValleyLog2);
  const int32_t centre_x = valley_centre(valley, middle_z + centre_z) / kMetre;
  const int32_t radius_x = 78 + static_cast<int32_t>((dice >> 16) % 34),
                radius_z = 110 + static_cast<int32_t>((dice >> 24) % 60);
  const int32_t island_x = centre_x + radius_x / 3, island_z = centre_z + radius_z / 4;
  const int32_t island_radius = 15 + static_cast<int32_t>((dice >> 32) % 6);
  // Positions relative to the middle of the valley and of the lake's 1024 m: small at any distance from the origin.
  const int32_t dx = x - static_cast<int32_t>(int64_t{valley} << kValleyLog2);
  Line shore, ripple;
  shore.fill(stream(seed_, kShore), 6, x, z, count);
  ripple.fill(stream(seed_, kShore) + 1, 4, x, z, count);
  for (int i = 0; i < count; ++i) {
    const int32_t dz = z + i - middle_z;
    const auto squared_share = [](int32_t a, int32_t b, int32_t ra, int32_t rb) {
      const int32_t ea = std::clamp(a * kNoiseOne / ra, -65536, 65536),
                    eb = std::clamp(b * kNoiseOne / rb, -65536, 65536);
      return static_cast<int32_t>((int64_t{ea} * ea + int64_t{eb} * eb) >> 12);
    };
    const int32_t rough = (shore[i] * 5 >> 3) + (ripple[i] >> 4);
    const int32_t e =
        squared_share(dx - centre_x, dz - centre_z, radius_x, radius_z) + rough - kNoiseOne;  // < 0 in the lake
    const int32_t bowl = kWaterLevel + static_cast<int32_t>((int64_t{e} * (e < 0 ? 13 : 18) * kMetre) >> 12);
    height[i] = std::min(height[i], bowl);
    const int32_t m = squared_share(dx - island_x, dz - island_z, island_radius, island_radius) + (ripple[i] >> 2);
    if (m < 2 * kNoiseOne) height[i] = std::max(height[i], kWaterLevel + (((kNoiseOne - m) * 5 * kMetre) >> 12));
  }
}

void Relief::row(int32_t x, int32_t z, int count, Row& out) const {
  const int32_t valley = static_cast<int32_t>((int64_t{x} + kFold) >> kValleyLog2);
  const int32_t from_middle = static_cast<int32_t>(x - (int64_t{valley} << kValleyLog2)) * kMetre;
  Line wander_wide, wander_narrow, meander_wide, meander_narrow, width, massif, cliffs, cliffs_fine, hills, bumps;
  wander_wide.fill(stream(seed_, kWander), 9, valley_row(valley, 9), z, count);
  wander_narrow.fill(stream(seed_, kWander), 7, valley_row(valley, 7), z, count);
  meander_wide.fill(stream(seed_, kMeander), 7, valley_row(valley, 7), z, count);
  meander_narrow.fill(stream(seed_, kMeander), 5, valley_row(valley, 5), z, count);
  width.fill(stream(seed_, kWidth), 8, x, z, count);
  massif.fill(stream(seed_, kMassif), 9, x, z, count);
  cliffs.fill(stream(seed_, kCliffs), 6, x, z, count);
  cliffs_fine.fill(stream(seed_, kCliffs) + 1, 4, x, z, count);
  hills.fill(stream(seed_, kFloor), 6, x, z, count);
  bumps.fill(stream(seed_, kFloor) + 1, 4, x, z, count);
  constexpr int kOctaves = 5;
  Line ridges[kOctaves];
  for (int o = 0; o < kOctaves; ++o)
    ridges[o].fill(stream(seed_, kRidge) + static_cast<uint64_t>(o), 8 - o, x, z, count);

  for (int i = 0; i < count; ++i) {
    const size_t n = static_cast<size_t>(i);
    // How far up the valley's side: 0 on its floor, 1 in the mountains.
    const int32_t centre = (wander_wide[i] * 146 + wander_narrow[i] * 26) >> 4;
    const int32_t edge = 66 * kMetre + (width[i] * 40 >> 4);
    const int32_t beside = std::abs(from_middle - centre) - edge;
    const int32_t rise = smooth(static_cast<int32_t>(int64_t{beside} * kNoiseOne / kSlopeWidth));

    // Ridges: sharp where noise crosses zero, and rough only where the coarser ridge is high.
    int32_t ridge = 0, weight = kNoiseOne, share = kNoiseOne / 2;
    for (int o = 0; o < kOctaves; ++o) {
      const int32_t sharp = std::max(0, kNoiseOne - rounded_abs(ridges[o][i]) * 7 / 4);
      const int32_t squared = sharp * sharp >> 12;
      ridge += (squared * weight >> 12) * share >> 12;
      weight = std::min(kNoiseOne, squared * 3 / 2 + kNoiseOne / 8);
      share /= 2;
    }
    const int32_t mass = kNoiseOne * 3 / 4 + massif[i] / 4;  // 0.5 to 1
    const int32_t mountain =
        34 * kMetre + static_cast<int32_t>((int64_t{ridge} * mass >> 12) * mountains_m_ * kMetre >> 12);
    const int32_t floor = 67 * kMetre + kMetre / 2 + (hills[i] * 5 >> 4) + (bumps[i] >> 4);
    int32_t height = floor + static_cast<int32_t>((int64_t{mountain} * rise) >> 12);

    // The river: a parabola, narrow at the bottom, under the water level.
    const int32_t river = centre + ((meander_wide[i] * 62 + meander_narrow[i] * 10) >> 4);
    const int32_t bank = std::max(0, std::abs(from_middle - river) - 5 * kMetre);
    if (bank < 100 * kMetre) {
      const int32_t bed =
          kWaterLevel - 3 * kMetre - kMetre / 2 + bank / 4 + static_cast<int32_t>(int64_t{bank} * bank / (60 * kMetre));
      height = std::min(height, bed + (bumps[i] >> 5));
    }
    out.height[n] = height;
    out.rise[n] = rise;

    // Overhangs, on the valley's sides where cliffs are.
    const int32_t where = cliffs[i] + cliffs_fine[i] / 4 - kNoiseOne / 8;
    const int32_t side = std::clamp((rise - kNoiseOne / 4) * 4, 0, kNoiseOne);
    const int32_t metres = std::clamp(where * 40, 0, kMaxOverhang * kNoiseOne);
    out.overhang[n] = static_cast<int32_t>(int64_t{metres} * side >> 16);
  }
  const int32_t first_lake = static_cast<int32_t>((int64_t{z} + kFold) >> kValleyLog2);
  const int32_t last_lake = static_cast<int32_t>((int64_t{z} + count - 1 + kFold) >> kValleyLog2);
  for (int32_t lake = first_lake; lake <= last_lake; ++lake) {
    const int32_t begin = static_cast<int32_t>(std::max<int64_t>(0, (int64_t{lake} << kValleyLog2) - kFold - z));
    const int32_t end = static_cast<int32_t>(std::min<int64_t>(count, (int64_t{lake} << kValleyLog2) + kFold - z));
    carve_lake(x, z + begin, end - begin, valley, lake, out.height.data() + begin);
  }
  for (int i = 0; i < count; ++i)
    out.height[static_cast<size_t>(i)] =
        std::min(out.height[static_cast<size_t>(i)], (kHighestGround - kMaxOverhang - 1) * kMetre);
}

int32_t Relief::height(int32_t x, int32_t z) const {
  Row one;
  row(x, z, 1, one);
  return one.height[0];
}

void Relief::columns(RegionPos region, const Materials& materials, Columns& out) const {
  const VoxelPos first = voxel_from_region(region);
  out.x0 = first.x, out.z0 = first.z;
  thread_local std::array<int32_t, Columns::kSide * Columns::kSide> rise;
  Row line;
  for (int x = -Columns::kMargin; x < Columns::kSide - Columns::kMargin; ++x) {
    row(first.x + x, first.z - Columns::kMargin, Columns::kSide, line);
    const size_t begin = static_cast<size_t>(Columns::index(x, -Columns::kMargin));
    std::copy(line.height.begin(), line.height.end(), out.height.begin() + static_cast<std::ptrdiff_t>(begin));
    std::copy(line.overhang.begin(), line.overhang.end(), out.overhang.begin() + static_cast<std::ptrdiff_t>(begin));
    for (size_t i = 0; i < Columns::kSide; ++i) {
      rise[begin + i] = line.rise[i];
      // Neither lakes nor meadows may leak into caves: those open on the mountains' sides only.
      const bool protect = line.rise[i] < kNoiseOne / 5 || line.height[i] < kWaterLevel + 10 * kMetre;
      out.cave_top[begin + i] = static_cast<int16_t>(protect ? (line.height[i] >> 8) - 10 : INT16_MAX);
    }
  }
  cover(materials, rise, out);

  Line coarse, fine;
  for (int x = 0; x < kRegionSize; ++x) {
    coarse.fill(stream(seed_, kStrata), 8, first.x + x, first.z, kRegionSize);
    fine.fill(stream(seed_, kStrata) + 1, 5, first.x + x, first.z, kRegionSize);
    for (int z = 0; z < kRegionSize; ++z)
      out.strata[static_cast<size_t>(x * kRegionSize + z)] = static_cast<int16_t>((coarse[z] * 36 + fine[z] * 3) >> 12);
  }
}

void Relief::cover(const Materials& m, const std::array<int32_t, Columns::kSide * Columns::kSide>& rise,
                   Columns& out) const {
  Line patches, speckles, woods, groves;
  constexpr int kBegin = -Columns::kMargin, kEnd = Columns::kSide - Columns::kMargin;
  for (int x = kBegin; x < kEnd; ++x) {
    patches.fill(stream(seed_, kPatches), 5, out.x0 + x, out.z0 + kBegin, Columns::kSide);
    speckles.fill(stream(seed_, kPatches) + 1, 3, out.x0 + x, out.z0 + kBegin, Columns::kSide);
    woods.fill(stream(seed_, kWoods), 7, out.x0 + x, out.z0 + kBegin, Columns::kSide);
    groves.fill(stream(seed_, kWoods) + 1, 5, out.x0 + x, out.z0 + kBegin, Columns::kSide);
    for (int z = kBegin; z < kEnd; ++z) {
      const int n = z - kBegin;
      const size_t at = static_cast<size_t>(Columns::index(x, z));
      const int32_t height = out.height[at], patch = patches[n] + speckles[n] / 3;
      const int32_t wood = std::clamp(woods[n] + groves[n] * 3 / 4 + kNoiseOne / 8, 0, kNoiseOne);
      out.wood[at] = static_cast<int16_t>(wood);
      if (x == kBegin || z == kBegin || x == kEnd - 1 || z == kEnd - 1) continue;  // no neighbours, never asked for
      const int32_t along_x = std::abs(out.height[at + Columns::kSide] - out.height[at - Columns::kSide]);
      const int32_t along_z = std::abs(out.height[at + 1] - out.height[at - 1]);
      const int32_t steep = std::max(along_x, along_z) / 2;  // kMetre per metre
      Ground ground;
      if (height < kWaterLevel) {
        const bool deep = height < kWaterLevel - 5 * kMetre;
        ground.top = deep                     ? (patch > 0 ? m.mud : m.clay)
                     : patch > kNoiseOne / 3  ? m.gravel
                     : patch < -kNoiseOne / 3 ? m.mud
                                              : m.sand;
        ground.below = deep ? m.clay : m.sand;
        ground.soil = 3;
      } else if (height < kWaterLevel + kMetre + (patch >> 4)) {
        ground = {patch > kNoiseOne / 2 ? m.gravel : m.sand, m.sand, 3};
      } else if (height > 158 * kMetre + (patch >> 8) * kMetre && steep < kMetre * 7 / 4) {
        ground = {m.snow, m.snow, static_cast<uint8_t>(height > 180 * kMetre ? 3 : 2)};
      } else if (steep > kMetre * 5 / 4 || out.overhang[at] > 2 * kMetre) {
        // Bare rock; turf on the ledges of overhangs.
        if (out.overhang[at] > 2 * kMetre && steep < kMetre && patch > 0) ground = {m.grass, m.dirt, 2};
      } else if (height > 138 * kMetre + (patch >> 8) * kMetre) {
        ground = patch > 0 ? Ground{m.scree, m.scree, 1} : Ground{m.dry_grass, m.dirt, 2};
      } else if (steep > kMetre * 7 / 8) {
        ground = patch > 0 ? Ground{m.scree, m.scree, 1} : Ground{m.grass, m.dirt, 2};
      } else {
        const bool under_trees = wood > kNoiseOne / 3 && patch > -kNoiseOne / 8;
        const bool dry = rise[at] > kNoiseOne / 3 && patch > kNoiseOne * 2 / 5;
        ground = {under_trees ? (patch > kNoiseOne / 3 ? m.podzol : m.forest_floor)
                  : dry       ? m.dry_grass
                              : m.grass,
                  m.dirt, static_cast<uint8_t>(rise[at] > kNoiseOne / 2 ? 3 : 4)};
      }
      out.ground[at] = ground;
    }
  }
}

}  // namespace world::landscape
