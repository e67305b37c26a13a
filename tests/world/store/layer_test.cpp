/// Layers of floats and of integers: leaves are read and written as voxels are, and only what changed is unsaved.
#include "world/store/layer.h"

#include <array>
#include <map>
#include <random>

#include <gtest/gtest.h>

#include "world/store/tree.h"

namespace world {
namespace {

template <class T>
class GridLayers : public testing::Test {};
using ValueTypes = testing::Types<float, int32_t>;
TYPED_TEST_SUITE(GridLayers, ValueTypes);

template <class T>
using LeafValues = std::array<T, kLeafVoxels>;

/// Any bits for integers, any finite number for floats.
template <class T>
T some_value(std::mt19937& rng) {
  if constexpr (std::is_same_v<T, float>) return (static_cast<float>(rng()) - 2e9f) / 7;
  return static_cast<T>(rng());
}

LeafMask some_mask(std::mt19937& rng) {
  LeafMask mask;
  const unsigned kind = rng() % 4;
  for (uint64_t& word : mask.word)
    word = kind == 0 ? 0 : kind == 1 ? ~uint64_t{0} : (uint64_t{rng()} << 32 | rng()) & (kind == 2 ? ~uint64_t{0} : 1);
  return mask;
}

constexpr LeafPos kPlaces[] = {{0, 0, 0}, {0, 0, 1}, {15, 15, 15}, {16, 0, 0}, {-1, -1, -1}, {600, -3, 511}};

/// Cubes at any corner and of any size, over leaves, tiles and gaps.
TYPED_TEST(GridLayers, ACubeIsReadAsItsVoxelsAre) {
  using T = TypeParam;
  std::mt19937 rng(11);
  GridLayer<T> layer;
  for (const LeafPos& place : kPlaces) {
    LeafValues<T> values;
    for (T& v : values) v = some_value<T>(rng);
    layer.write_leaf(place, values, some_mask(rng));
  }
  layer.grid().grid->tree().addTile(1, openvdb::Coord(-16, 0, 0), T{7}, true);
  constexpr T kInactive{-5};
  for (int i = 0; i < 300; ++i) {
    const int size = 1 + static_cast<int>(rng() % 20);
    VoxelPos low = voxel_from_leaf(kPlaces[rng() % std::size(kPlaces)]);
    for (int axis = 0; axis < 3; ++axis) low[axis] += static_cast<int>(rng() % 24) - 16;
    std::vector<T> cube(static_cast<size_t>(size * size * size));
    layer.read_cube(low, size, kInactive, cube);
    size_t at = 0;
    for (int x = 0; x < size; ++x)
      for (int y = 0; y < size; ++y)
        for (int z = 0; z < size; ++z) {
          const VoxelPos v = low + VoxelPos{x, y, z};
          ASSERT_EQ(cube[at++], layer.active(v) ? layer.get(v) : kInactive);
        }
  }
}

/// What is written a leaf at a time is what is read, by leaf and by voxel.
TYPED_TEST(GridLayers, LeavesHoldWhatWasWrittenLast) {
  using T = TypeParam;
  GridLayer<T> layer;
  std::map<LeafPos, std::pair<LeafValues<T>, LeafMask>> expected;
  std::mt19937 rng(1);
  for (int i = 0; i < 400; ++i) {
    const LeafPos l = kPlaces[rng() % std::size(kPlaces)];
    LeafValues<T> values;
    for (T& v : values) v = some_value<T>(rng);
    const LeafMask active = some_mask(rng);
    layer.write_leaf(l, values, active);
    for (int n = 0; n < kLeafVoxels; ++n)
      if (!active.test(n)) values[static_cast<size_t>(n)] = 0;
    expected[l] = {values, active};

    uint64_t count = 0;
    std::vector<LeafPos> there;
    for (const auto& [pos, leaf] : expected) {
      LeafValues<T> read;
      read.fill(T{77});
      LeafMask mask = LeafMask::all();
      ASSERT_EQ(layer.read_leaf(pos, read, mask), !leaf.second.is_none());
      ASSERT_EQ(read, leaf.first);
      ASSERT_EQ(mask, leaf.second);
      count += static_cast<uint64_t>(mask.count());
      if (!mask.is_none()) there.push_back(pos);
    }
    ASSERT_EQ(layer.active_voxels(), count);
    ASSERT_EQ(layer.leaves(), there);
  }
  for (const auto& [pos, leaf] : expected)
    for (int n = 0; n < kLeafVoxels; ++n) {
      ASSERT_EQ(layer.get(voxel_from_leaf(pos) + offset_in_leaf(n)), leaf.first[static_cast<size_t>(n)]);
      ASSERT_EQ(layer.active(voxel_from_leaf(pos) + offset_in_leaf(n)), leaf.second.test(n));
    }
}

TYPED_TEST(GridLayers, NothingIsLeftOfARegionWhoseLeavesAreAllInactive) {
  using T = TypeParam;
  GridLayer<T> layer;
  const LeafValues<T> values{1};
  const size_t before = layer.bytes();
  for (int i = 0; i < 16; ++i) layer.write_leaf({i, i, 0}, values, kAllMask);
  layer.write_leaf({16, 0, 0}, values, kAllMask);
  EXPECT_EQ(layer.regions(), (std::vector<RegionPos>{{0, 0, 0}, {1, 0, 0}}));
  const size_t full = layer.bytes();
  EXPECT_GE(full - before, 17 * sizeof values);
  for (int i = 0; i < 16; ++i) layer.write_leaf({i, i, 0}, values, kNoneMask);
  EXPECT_EQ(layer.regions(), (std::vector<RegionPos>{{1, 0, 0}}));
  EXPECT_FALSE(layer.holds({0, 0, 0}));
  EXPECT_EQ(layer.region_bytes({0, 0, 0}), 0u);
  EXPECT_LE(layer.bytes(), full - 16 * sizeof values);
}

TYPED_TEST(GridLayers, ALeafOfATileIsReadAndTakenOutOfIt) {
  using T = TypeParam;
  for (const int level : {1, 2}) {  // of a leaf's size, of a region's
    GridLayer<T> layer;
    layer.grid().grid->tree().addTile(static_cast<openvdb::Index>(level), openvdb::Coord(0), T{5}, true);
    LeafValues<T> values;
    LeafMask active;
    ASSERT_TRUE(layer.read_leaf({0, 0, 0}, values, active));
    EXPECT_TRUE(active.is_all());
    EXPECT_EQ(values, [] {
      LeafValues<T> five;
      five.fill(T{5});
      return five;
    }());
    layer.write_leaf({0, 0, 0}, values, kNoneMask);
    EXPECT_FALSE(layer.read_leaf({0, 0, 0}, values, active));
    EXPECT_EQ(values, LeafValues<T>{});
    EXPECT_EQ(layer.active_voxels(), level == 1 ? 0u : uint64_t{1} * kRegionSize * kRegionSize * kRegionSize - 512);
  }
}

TYPED_TEST(GridLayers, ARegionIsUnsavedOnceALeafOfItChanged) {
  using T = TypeParam;
  GridLayer<T> layer;
  const LeafValues<T> values{3};
  layer.write_leaf({0, 0, 0}, values, kNoneMask);
  EXPECT_TRUE(layer.unsaved().empty()) << "nothing was there and nothing is";
  layer.write_leaf({0, 0, 0}, values, kAllMask);
  layer.write_leaf({40, 0, 0}, values, kAllMask);
  EXPECT_EQ(layer.unsaved(), (std::vector<RegionPos>{{0, 0, 0}, {2, 0, 0}}));
  layer.mark_saved();
  EXPECT_TRUE(layer.unsaved().empty());
  layer.write_leaf({1, 0, 0}, values, kNoneMask);
  EXPECT_TRUE(layer.unsaved().empty()) << "that leaf was not there";
  layer.write_leaf({0, 0, 0}, values, kNoneMask);
  EXPECT_EQ(layer.unsaved(), (std::vector<RegionPos>{{0, 0, 0}})) << "a save has a row of it still";
}

TYPED_TEST(GridLayers, ARegionAsAStreamIsReadBackWhateverWasWrittenBefore) {
  using T = TypeParam;
  for (const StreamCompression compression : {StreamCompression::none, StreamCompression::blosc}) {
    GridLayer<T> layer, again, short_cut;
    std::mt19937 rng(3);
    for (int i = 0; i < 100; ++i) {
      LeafValues<T> values;
      for (T& v : values) v = some_value<T>(rng);
      layer.write_leaf({-16 + static_cast<int>(rng() % 16), static_cast<int>(rng() % 16), 3}, values, some_mask(rng));
    }
    const RegionPos region{-1, 0, 0};
    const auto bytes = layer.encode_region(region, compression);
    ASSERT_TRUE(bytes.ok()) << bytes.error().message;
    const Status read = again.decode_region(*bytes, region);
    ASSERT_TRUE(read.ok()) << read.error().message;
    ASSERT_EQ(again.leaves(), layer.leaves());
    for (const LeafPos& l : layer.leaves()) {
      LeafValues<T> a, b;
      LeafMask active_a, active_b;
      ASSERT_TRUE(layer.read_leaf(l, a, active_a) && again.read_leaf(l, b, active_b));
      ASSERT_EQ(a, b);
      ASSERT_EQ(active_a, active_b);
      short_cut.write_leaf(l, a, active_a);
    }
    EXPECT_EQ(*short_cut.encode_region(region, compression), *bytes) << "no trace of earlier values";
    GridLayer<std::conditional_t<std::is_same_v<T, float>, int32_t, float>> other;
    EXPECT_FALSE(other.decode_region(*bytes, region).ok()) << "of the other type";
  }
}

TEST(IntLayer, KeepsTheValuesThatFloatsWouldRound) {
  IntLayer layer;
  LeafValues<int32_t> values{}, read;
  values[0] = INT32_MIN, values[1] = INT32_MAX, values[2] = (1 << 24) + 1, values[3] = -1;
  layer.write_leaf({0, 0, 0}, values, kAllMask);
  LeafMask active;
  ASSERT_TRUE(layer.read_leaf({0, 0, 0}, read, active));
  EXPECT_EQ(read, values);
  IntLayer again;
  ASSERT_TRUE(again.decode_region(*layer.encode_region({0, 0, 0}, StreamCompression::none), {0, 0, 0}).ok());
  EXPECT_EQ(again.get({0, 0, 0}), INT32_MIN);
  EXPECT_EQ(again.get({0, 0, 2}), (1 << 24) + 1);
}

TEST(Layers, AreOfTheTypeThatTheirRowSays) {
  for (size_t i = 0; i < layer_rows().size(); ++i) {
    const LayerRow& row = layer_rows()[i];
    EXPECT_EQ(layer_from_name(row.name), static_cast<Layer>(i));
    if (static_cast<Layer>(i) == Layer::block) continue;
    const AnyLayer layer = empty_layer(static_cast<Layer>(i));
    EXPECT_EQ(std::holds_alternative<IntLayer>(layer), row.type == "int32_t") << row.name;
    EXPECT_EQ(std::holds_alternative<FloatLayer>(layer), row.type == "float") << row.name;
  }
}

TEST(LayerChanges, AreTheLeavesWrittenSinceTheMark) {
  IntLayer layer;
  LayerMark mark, other;
  EXPECT_FALSE(layer.changes(mark).has_value()) << "a fresh mark has seen nothing";
  EXPECT_EQ(layer.changes(mark)->size(), 0u);
  layer.set({0, 0, 0}, 5);
  layer.set({1, 0, 0}, 5);
  layer.set({-1, 0, 0}, 5);
  layer.set({2, 0, 0}, 5);
  EXPECT_EQ(*layer.changes(mark), (std::vector<LeafPos>{{-1, 0, 0}, {0, 0, 0}}));
  EXPECT_EQ(layer.changes(mark)->size(), 0u);
  layer.set({2, 0, 0}, 6);
  EXPECT_EQ(*layer.changes(mark), (std::vector<LeafPos>{{0, 0, 0}})) << "the leaf that was written last, again";
  EXPECT_FALSE(layer.changes(other).has_value());
  layer.write_leaf({3, 0, 0}, std::array<int32_t, kLeafVoxels>{}, LeafMask::none());
  EXPECT_EQ(layer.changes(mark)->size(), 0u) << "nothing was there";
  layer.write_leaf({0, 0, 0}, std::array<int32_t, kLeafVoxels>{}, LeafMask::none());
  EXPECT_EQ(*layer.changes(mark), (std::vector<LeafPos>{{0, 0, 0}}));
}

TEST(LayerChanges, OfRegionsThatComeAndGoAreTheirLeaves) {
  IntLayer layer, part;
  LayerMark mark;
  layer.set({0, 0, 0}, 1);
  (void)layer.changes(mark);
  part.set({130, 0, 0}, 7);
  layer.install({1, 0, 0}, std::move(part));
  EXPECT_EQ(*layer.changes(mark), (std::vector<LeafPos>{{16, 0, 0}}));
  layer.evict({0, 0, 0});
  EXPECT_EQ(*layer.changes(mark), (std::vector<LeafPos>{{0, 0, 0}}));
}

TEST(LayerChanges, OfAnotherLayerOrOfTooManyWritesAreAll) {
  IntLayer layer, second;
  LayerMark mark;
  (void)layer.changes(mark);
  EXPECT_FALSE(second.changes(mark).has_value());
  (void)layer.changes(mark);
  for (int i = 0; i < 200'000; ++i) layer.set({(i & 1) * 8, 0, 0}, i);
  EXPECT_FALSE(layer.changes(mark).has_value());
  EXPECT_EQ(layer.changes(mark)->size(), 0u);
}

}  // namespace
}  // namespace world
