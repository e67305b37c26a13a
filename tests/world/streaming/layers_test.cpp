/// Layers come in around viewers and go out behind them with the regions that their values lie in.
#include "tests/world/saves/saves_support.h"
#include "world/streaming/streamer.h"

namespace world {
namespace {

constexpr int kRegions = 20;  // along x

int32_t heat_of(VoxelPos v) { return v.x * 1000 - v.y; }
float density_of(VoxelPos v) { return 0.001f * static_cast<float>(v.x & 1023) + 0.25f; }

/// A save with stone, and with density in leaves of every region, along 2.5 km.
void write_foggy_world(const std::filesystem::path& path) {
  World world(standard_blocks());
  EditBatch batch;
  batch.fill({{0, 0, 0}, {kRegions * kRegionSize - 1, 3, 3}}, *world.palette->find("stone"));
  ASSERT_TRUE(world.store.apply(batch).ok());
  FloatLayer& density = world.store.make_layer(Layer::density);
  IntLayer& heat = world.store.make_int_layer(Layer::heat);
  for (int x = 0; x < kRegions * kRegionSize; ++x)
    for (int y = 0; y < 16; ++y) density.set({x, y, 5}, density_of({x, y, 5})), heat.set({x, y, 5}, heat_of({x, y, 5}));
  density.set({5 * kRegionSize + 1, 200, 1}, 0.5f);  // a region with no blocks
  ASSERT_TRUE(write_world(world, path).ok());
}

StreamingKnobs near_knobs() {
  StreamingKnobs knobs;
  knobs.load_radius_m = 200, knobs.keep_radius_m = 260;
  knobs.lowest_y = 0, knobs.highest_y = 255;
  return knobs;
}

struct Opened {
  std::unique_ptr<SaveSession> session;
  explicit Opened(const std::filesystem::path& path)
      : session(SaveSession::open(path, {.autosave_s = 0, .load = false}).value()) {}
  World& world() { return session->world(); }
  float density(VoxelPos v) {
    const FloatLayer* layer = world().store.find_layer(Layer::density);
    return layer ? layer->get(v) : 0;
  }
  int32_t heat(VoxelPos v) {
    const IntLayer* layer = world().store.find_int_layer(Layer::heat);
    return layer ? layer->get(v) : 0;
  }
};

void go(Streamer& streamer, VoxelPos viewer, double now_s) {
  streamer.settle({&viewer, 1}, now_s);
  for (int i = 0; i < 100; ++i) streamer.update({&viewer, 1}, now_s);
}

TEST(StreamedLayers, ComeInAroundViewersAndGoOutBehindThem) {
  const TemporaryFolder folder;
  write_foggy_world(folder / "a.loam");
  Opened open(folder / "a.loam");
  EXPECT_EQ(open.density({10, 3, 5}), 0) << "nothing is loaded at first";
  Streamer streamer(open.world(), open.session.get(), nullptr, near_knobs());
  go(streamer, {64, 8, 5}, 0);
  for (const int x : {0, 10, 127, 128, 200}) {
    EXPECT_EQ(open.density({x, 3, 5}), density_of({x, 3, 5})) << x;
    EXPECT_EQ(open.heat({x, 3, 5}), heat_of({x, 3, 5})) << x;
  }
  EXPECT_EQ(open.density({19 * kRegionSize, 3, 5}), 0) << "far away";
  go(streamer, {5 * kRegionSize + 64, 150, 5}, 1);
  EXPECT_EQ(open.density({5 * kRegionSize + 1, 200, 1}), 0.5f) << "also where no blocks are";
  go(streamer, {19 * kRegionSize, 8, 5}, 2);
  EXPECT_EQ(open.density({10, 3, 5}), 0) << "left behind";
  EXPECT_EQ(open.heat({10, 3, 5}), 0);
  EXPECT_EQ(open.heat({19 * kRegionSize, 3, 5}), heat_of({19 * kRegionSize, 3, 5}));
  EXPECT_LE(open.world().store.find_int_layer(Layer::heat)->regions().size(), 5u);
  EXPECT_EQ(open.density({19 * kRegionSize, 3, 5}), density_of({19 * kRegionSize, 3, 5}));
  EXPECT_LE(open.world().store.find_layer(Layer::density)->regions().size(), 5u);
  go(streamer, {64, 8, 5}, 3);
  EXPECT_EQ(open.density({10, 3, 5}), density_of({10, 3, 5})) << "and back";
  EXPECT_FALSE(open.session->has_changes()) << "coming and going is no change";
  EXPECT_TRUE(streamer.report().errors.empty()) << streamer.report().errors.front();
}

TEST(StreamedLayers, CountIntoTheBudgetWhichHolds) {
  const TemporaryFolder folder;
  write_foggy_world(folder / "a.loam");
  StreamingKnobs knobs = near_knobs();
  knobs.load_radius_m = 2000, knobs.keep_radius_m = 2200;
  size_t all = 0;
  {
    Opened open(folder / "a.loam");
    Streamer streamer(open.world(), open.session.get(), nullptr, knobs);
    go(streamer, {1280, 8, 5}, 0);
    all = streamer.report().bytes;
    EXPECT_GE(all, (open.world().store.find_layer(Layer::density)->bytes() +
                    open.world().store.find_int_layer(Layer::heat)->bytes()) /
                       2)
        << "the layers are counted";
  }
  Opened again(folder / "a.loam");
  knobs.memory_budget_bytes = all / 3;
  Streamer streamer(again.world(), again.session.get(), nullptr, knobs);
  for (int i = 0; i < 40; ++i) {
    go(streamer, {64 * i, 8, 5}, i);
    ASSERT_LE(streamer.report().bytes, knobs.memory_budget_bytes) << i;
  }
  EXPECT_TRUE(streamer.report().budget_full);
}

TEST(StreamedLayers, WritesStayUntilASaveHasThemAndOthersAreLeftAlone) {
  const TemporaryFolder folder;
  write_foggy_world(folder / "a.loam");
  {
    Opened open(folder / "a.loam");
    Streamer streamer(open.world(), open.session.get(), nullptr, near_knobs());
    go(streamer, {64, 8, 5}, 0);
    ASSERT_TRUE(streamer.require({{10, 3, 5}, {10, 3, 5}}).ok());
    open.world().store.make_layer(Layer::density).set({10, 3, 5}, 7.5f);
    open.world().store.make_int_layer(Layer::heat).set({200, 3, 5}, -3);
    EXPECT_TRUE(open.session->has_changes());
    go(streamer, {19 * kRegionSize, 8, 5}, 1);
    EXPECT_EQ(open.density({10, 3, 5}), 7.5f) << "what no save has stays";
    EXPECT_EQ(open.heat({200, 3, 5}), -3);
    ASSERT_TRUE(open.session->save().ok());
    EXPECT_EQ(open.session->last_report().regions, 0u) << "no blocks changed";
    go(streamer, {18 * kRegionSize, 8, 5}, 2);
    EXPECT_EQ(open.density({10, 3, 5}), 0);
    EXPECT_EQ(open.heat({200, 3, 5}), 0);
    go(streamer, {64, 8, 5}, 3);
    EXPECT_EQ(open.density({10, 3, 5}), 7.5f);
    EXPECT_EQ(open.heat({200, 3, 5}), -3);
    ASSERT_TRUE(open.session->close().ok());
  }
  // The whole layer, of which the session never held more than some regions.
  const auto whole = load(folder / "a.loam");
  ASSERT_TRUE(whole.ok()) << whole.error().message;
  const FloatLayer* density = whole->store.find_layer(Layer::density);
  ASSERT_TRUE(density);
  EXPECT_EQ(density->get({10, 3, 5}), 7.5f);
  uint64_t wrong = 0;
  for (int x = 0; x < kRegions * kRegionSize; ++x)
    for (int y = 0; y < 16; ++y) wrong += density->get({x, y, 5}) != (x == 10 && y == 3 ? 7.5f : density_of({x, y, 5}));
  EXPECT_EQ(wrong, 0u);
  EXPECT_EQ(whole->store.find_int_layer(Layer::heat)->get({200, 3, 5}), -3);
  EXPECT_EQ(whole->store.find_int_layer(Layer::heat)->get({2000, 3, 5}), heat_of({2000, 3, 5}));
  EXPECT_EQ(density->active_voxels(), uint64_t{kRegions} * kRegionSize * 16 + 1);
}

TEST(StreamedLayers, AFailedSaveKeepsTheWritesForTheNext) {
  const TemporaryFolder folder;
  write_foggy_world(folder / "a.loam");
  Opened open(folder / "a.loam");
  FloatLayer& density = open.world().store.make_layer(Layer::density);
  density.set({1, 1, 1}, 3);
  const RegionPos here = region_from_voxel({1, 1, 1});
  EXPECT_TRUE(density.is_unsaved(here));
  density.mark_saved();
  EXPECT_FALSE(density.is_unsaved(here));
  const std::vector<RegionPos> again{here};
  density.mark_unsaved(again);
  EXPECT_EQ(density.unsaved(), again);
}

}  // namespace
}  // namespace world
