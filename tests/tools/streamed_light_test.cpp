// Hard case CL3 with a streamer: light of worlds that are never in memory as a whole.
#include <gtest/gtest.h>

#include "tools/away_regions.h"
#include "tools/light.h"
#include "world/base/random.h"
#include "world/world.h"

namespace tools {
namespace {

using world::BlockId;
using world::LeafPos;
using world::LightField;
using world::LightModel;
using world::RegionPos;
using world::VoxelPos;

constexpr int kHighest = 1;  // y of the regions at the top

/// Made of whole leaves, so that a region costs little: hills with halls in them and roofs over them, and lanterns in
/// both, most of all where regions meet.
class LeafLand : public world::Generator {
 public:
  explicit LeafLand(const world::BlockPalette& palette)
      : stone_(*palette.find("stone")), glass_(*palette.find("glass_red")), lantern_(*palette.find("lantern")) {}

  void generate(world::RegionBuilder& region) const override {
    for (int i = 0; i < world::kLeavesPerRegion; ++i) {
      const LeafPos l = world::leaf_from_region(region.pos()) + world::leaf_offset_in_region(i);
      const BlockId block = block_of(l);
      if (block != lantern_) {
        region.set_uniform(i, block);
        continue;
      }
      std::array<BlockId, world::kLeafVoxels> voxels{};
      voxels[bits(l, 5) % world::kLeafVoxels] = lantern_;
      region.set_leaf(i, voxels);
    }
  }

 private:
  static uint64_t bits(LeafPos l, int64_t what) { return world::random_bits(what, l.x, l.y, l.z); }
  /// Whether the leaf lies within `distance` leaves of a border between regions along x or z.
  static bool near_border(LeafPos l, int distance) {
    const auto near = [&](int a) { return ((a + distance) & 15) < 2 * distance; };
    return near(l.x) || near(l.z);
  }
  BlockId block_of(LeafPos l) const {
    const bool lamp = bits(l, 1) % (near_border(l, 2) ? 12 : 60) == 0;
    const int ground = 6 + static_cast<int>(bits({l.x, 0, l.z}, 2) % 4);
    if (l.y < 0 || l.y > 31) return world::kAir;
    if (l.y <= ground) {
      // Halls of 4^3 leaves, which straddle borders at multiples of 16.
      const LeafPos hall{(l.x + 2) >> 2, (l.y + 2) >> 2, (l.z + 2) >> 2};
      if (bits(hall, 3) % 3 != 0) return stone_;
      return lamp ? lantern_ : world::kAir;
    }
    // Roofs, some of glass, at the border of the regions above each other.
    if (l.y == 17) {
      const uint64_t roof = bits({(l.x + 3) >> 3, 0, (l.z + 3) >> 3}, 4) % 5;
      return roof < 2 ? stone_ : roof == 2 ? glass_ : world::kAir;
    }
    return lamp && l.y < 17 ? lantern_ : world::kAir;
  }
  BlockId stone_, glass_, lantern_;
};

/// Of the regions around: those within the world's heights that have not come.
bool all_there(const world::Streamer& streamer, RegionPos r) {
  for (int x = -1; x <= 1; ++x)
    for (int z = -1; z <= 1; ++z)
      for (int y = std::max(0, r.y - 1); y <= kHighest; ++y)  // and the sky above
        if (!streamer.is_resident({r.x + x, y, r.z + z})) return false;
  return true;
}

world::LightLeaf levels_of(const LightField& field, LeafPos l) {
  const world::LightLeafView leaf = field.leaf(l);
  return leaf.leaf ? *leaf.leaf : world::LightLeaf::of(leaf.tile);
}

bool same_region(const world::LightVolume& a, const world::LightVolume& b, RegionPos r) {
  for (size_t f = 0; f < a.fields().size(); ++f)
    for (int i = 0; i < world::kLeavesPerRegion; ++i) {
      const LeafPos l = world::leaf_from_region(r) + world::leaf_offset_in_region(i);
      if (!(levels_of(a.fields()[f], l) == levels_of(b.fields()[f], l))) return false;
    }
  return true;
}

constexpr int kMost = 4;  // regions on each side of the origin that a viewer comes near to

VoxelPos random_place(uint64_t seed, int64_t i) {
  const auto at = [&](int64_t axis) {
    return static_cast<int32_t>(world::random_bits(seed, i, axis, 1) % (2 * 128 * (kMost - 2))) - 128 * (kMost - 2);
  };
  return {at(0), 90, at(1)};
}

/// The regions around a viewer, in an order of this seed.
std::vector<RegionPos> shuffled_around(VoxelPos viewer, uint64_t seed, int64_t step) {
  std::vector<std::pair<uint64_t, RegionPos>> by_draw;
  const RegionPos at = world::region_from_voxel(viewer);
  for (int x = at.x - 1; x <= at.x + 1; ++x)
    for (int z = at.z - 1; z <= at.z + 1; ++z)
      for (int y = 0; y <= kHighest; ++y)
        by_draw.emplace_back(world::random_bits(seed, x, y, z, static_cast<uint64_t>(step)), RegionPos{x, y, z});
  std::sort(by_draw.begin(), by_draw.end());
  std::vector<RegionPos> regions;
  for (const auto& [draw, r] : by_draw) regions.push_back(r);
  return regions;
}

TEST(StreamedLight, IsTheWholeWorldsLightWhereAllAroundIsThereInAnyOrder) {
  world::World whole(world::standard_blocks());
  const LeafLand land(*whole.palette);
  constexpr int kBorder = 128 * (kMost + 1);
  ASSERT_TRUE(generate(whole.store, land, {{-kBorder, 0, -kBorder}, {kBorder - 1, 255, kBorder - 1}}).ok());
  sim::FloodLight expected(whole.store, LightModel::flood4);
  expected.compute();

  uint64_t compared = 0, moved = 0;
  for (uint64_t order = 0; order < 6; ++order) {
    world::World streamed(world::standard_blocks());
    world::StreamingKnobs knobs;
    knobs.lowest_y = 0, knobs.highest_y = 128 * (kHighest + 1) - 1;
    knobs.load_radius_m = 170, knobs.keep_radius_m = 180 + static_cast<double>(order % 3) * 60;
    knobs.update_ms = 1e9;  // no update stops halfway: what is there depends on no clock
    knobs.threads = 1 + static_cast<int>(order % 3);
    world::Streamer streamer(streamed, nullptr, &land, knobs);
    AwayRegions away(streamer);
    sim::FloodLight light(streamed.store, LightModel::flood4);
    const auto compare = [&] {
      away.follow(light);
      light.update();
      for (const RegionPos& r : streamed.store.regions()) {
        if (!all_there(streamer, r)) continue;
        ++compared;
        ASSERT_TRUE(same_region(light.volume(), expected.volume(), r))
            << "order " << order << ", region " << r.x << ' ' << r.y << ' ' << r.z;
      }
    };
    for (int64_t step = 0; step < 3; ++step) {
      // Near enough to the last place that some stays, or far; at the end back at the first.
      const VoxelPos viewer = random_place(order, step == 2 ? 0 : step);
      // All around come one by one, in an order drawn; the light follows now and then.
      int64_t came = 0;
      for (const RegionPos& r : shuffled_around(viewer, order, step)) {
        const VoxelPos corner = world::voxel_from_region(r);
        ASSERT_TRUE(streamer.require({corner, corner + VoxelPos{127, 127, 127}}).ok());
        const uint64_t draw = world::random_bits(order, step, came++, 2) % 6;
        if (draw == 0) compare();
        if (draw == 1) away.follow(light), light.update();
        if (HasFatalFailure()) return;
      }
      // The rest comes from the streamer's threads, and what is far goes.
      streamer.settle({&viewer, 1}, static_cast<double>(step));
      compare();
      if (HasFatalFailure()) return;
    }
    moved += streamer.report().generated + streamer.report().evicted;
    // At the border of what is there too: the same as if the light were made anew, knowing what is away.
    sim::FloodLight anew(streamed.store, LightModel::flood4);
    away.tell_all(anew);
    anew.compute();
    ASSERT_EQ(light.volume().content_hash(), anew.volume().content_hash()) << "order " << order;
  }
  RecordProperty("compared", std::to_string(compared));
  RecordProperty("moved", std::to_string(moved));
  EXPECT_GT(compared, 100u);
  EXPECT_GT(moved, 300u);
}

/// That the above can fail: with a light that hears nothing, darkness and glow stay at the borders.
TEST(StreamedLight, WithoutBeingToldWhatIsAwayItIsWrong) {
  world::World streamed(world::standard_blocks());
  const LeafLand land(*streamed.palette);
  world::StreamingKnobs knobs;
  knobs.lowest_y = 0, knobs.highest_y = 255, knobs.load_radius_m = 190, knobs.keep_radius_m = 210;
  world::Streamer streamer(streamed, nullptr, &land, knobs);
  AwayRegions away(streamer);
  sim::FloodLight told(streamed.store, LightModel::flood4), untold(streamed.store, LightModel::flood4);
  const VoxelPos viewer{64, 90, 64};
  streamer.settle({&viewer, 1}, 0);
  away.follow(told);
  told.update();
  untold.update();
  EXPECT_NE(told.volume().content_hash(), untold.volume().content_hash());
}

TEST(StreamedLight, ThePicturesLightFollowsTheStreamer) {
  world::World streamed(world::standard_blocks());
  const LeafLand land(*streamed.palette);
  world::StreamingKnobs knobs;
  knobs.lowest_y = 0, knobs.highest_y = 255, knobs.load_radius_m = 190, knobs.keep_radius_m = 210;
  world::Streamer streamer(streamed, nullptr, &land, knobs);
  AwayRegions away(streamer);
  LightOfWorld light;
  light.stream(&streamer);
  render::RenderKnobs of_picture;
  for (const LightModel model : {LightModel::flood4, LightModel::flood_rgb})
    for (const VoxelPos& viewer : {VoxelPos{64, 90, 64}, VoxelPos{300, 90, 64}}) {
      streamer.settle({&viewer, 1}, 0);
      of_picture.light_model = model;
      const auto followed = light.follow(streamed, {}, of_picture);
      ASSERT_TRUE(followed.ok());
      sim::FloodLight anew(streamed.store, model);
      away.tell_all(anew);
      away.follow(anew);
      anew.compute();
      EXPECT_EQ(followed->levels->content_hash(), anew.volume().content_hash());
    }
}

}  // namespace
}  // namespace tools
