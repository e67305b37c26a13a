/// Regions coded by context: read back as they were, small, and never more than an error where the bytes are damaged.
#include "world/saves/block_code.h"

#include <random>

#include <gtest/gtest.h>

#include "world/saves/row.h"
#include "world/scenes/scene.h"
#include "world/store/snapshot.h"

namespace world {
namespace {

using Leaf = std::array<BlockId, kLeafVoxels>;

/// leaf(i) gives the 512 ids of a leaf.
template <class LeafOf>
PackedRegion region_of(LeafOf leaf_of) {
  Leaf leaf;
  return PackedRegion([&](int i) -> LeafBlocks {
    leaf = leaf_of(i);
    if (std::all_of(leaf.begin(), leaf.end(), [&](BlockId b) { return b == leaf[0]; })) return {nullptr, leaf[0]};
    return {leaf.data(), kAir};
  });
}

Leaf filled(BlockId block) {
  Leaf leaf;
  leaf.fill(block);
  return leaf;
}

bool holds(const RegionBuilder& builder, const PackedRegion& region) {
  for (int i = 0; i < kLeavesPerRegion; ++i) {
    const LeafBlocks leaf = builder.leaf(i);
    for (int v = 0; v < kLeafVoxels; ++v)
      if (leaf[v] != region.get(i, v)) return false;
  }
  return true;
}

void expect_read_back(const PackedRegion& region, size_t palette_size) {
  const std::string bytes = encode_block_code(region);
  EXPECT_EQ(bytes, encode_block_code(region)) << "the same region must give the same bytes";
  const auto builder = decode_block_code(bytes, {3, -1, 2}, palette_size);
  ASSERT_TRUE(builder.ok()) << builder.error().message;
  EXPECT_EQ(builder->pos(), (RegionPos{3, -1, 2}));
  EXPECT_TRUE(holds(*builder, region));
  EXPECT_FALSE(decode_block_code(bytes + '\0', {}, palette_size).ok()) << "a byte that nothing needs";
  EXPECT_FALSE(decode_block_code(std::string_view(bytes).substr(0, bytes.size() - 1), {}, palette_size).ok());
}

TEST(BlockCode, AnyRegionIsReadBackAsItWas) {
  std::mt19937 rng(8);
  expect_read_back(region_of([](int) { return filled(kAir); }), 1);
  expect_read_back(region_of([](int) { return filled(700); }), 701);
  expect_read_back(region_of([](int i) { return filled(static_cast<BlockId>(i)); }), 4096);
  for (const unsigned blocks : {2u, 3u, 17u, 65536u})
    expect_read_back(region_of([&](int i) {
                       Leaf leaf;
                       for (BlockId& id : leaf) id = static_cast<BlockId>(i % 9 ? i / 700 % blocks : rng() % blocks);
                       return leaf;
                     }),
                     blocks);
}

TEST(BlockCode, ARegionOfOneBlockTakesAFewBytes) {
  EXPECT_LE(encode_block_code(region_of([](int) { return filled(kAir); })).size(), 16u);
}

TEST(BlockCode, TerrainTakesLessThanHalfOfWhatZstandardMakesOfIt) {
  ImportReport report;
  const auto valley = build_world(*load_scene("valley"), report);
  ASSERT_TRUE(valley.ok()) << valley.error().message;
  const std::vector<RegionPos> regions = {{0, 0, 0}, {0, 1, 0}};
  const StoreSnapshot snapshot = valley->store.snapshot(regions);
  for (size_t i = 0; i < regions.size(); ++i) {
    const auto packed = snapshot.packed(i);
    ASSERT_TRUE(packed);
    expect_read_back(*packed, valley->palette->size());
    const size_t context = encode_payload(*packed, regions[i], kSmallPayload)->size(),
                 zstd = encode_payload(*packed, regions[i], {})->size();
    EXPECT_LT(2 * context, zstd) << "region " << i;
  }
}

TEST(BlockCode, BlocksOutsideThePaletteAndListsThatDoNotAscendAreErrors) {
  const std::string bytes = encode_block_code(region_of([](int i) { return filled(i % 2 ? 4 : 7); }));
  EXPECT_TRUE(decode_block_code(bytes, {}, 8).ok());
  EXPECT_FALSE(decode_block_code(bytes, {}, 7).ok());
  std::string swapped = bytes;
  std::swap(swapped[2], swapped[4]);
  EXPECT_FALSE(decode_block_code(swapped, {}, 8).ok());
  EXPECT_FALSE(decode_block_code("", {}, 8).ok());
  EXPECT_FALSE(decode_block_code("a", {}, 8).ok());
}

TEST(BlockCode, DamageIsAnErrorOrOtherBlocksOfThePalette) {
  std::mt19937 rng(9);
  const PackedRegion region = region_of([&](int i) {
    Leaf leaf = filled(static_cast<BlockId>(i % 3));
    if (i % 64 == 0)
      for (BlockId& id : leaf) id = static_cast<BlockId>(rng() % 6);
    return leaf;
  });
  const std::string bytes = encode_block_code(region);
  int errors = 0;
  for (int n = 0; n < 300; ++n) {
    std::string damaged = bytes;
    for (size_t flips = 1 + rng() % 3; flips > 0; --flips)
      damaged[rng() % damaged.size()] ^= static_cast<char>(1 << rng() % 8);
    const auto builder = decode_block_code(damaged, {}, 6);
    errors += !builder.ok();
    for (int i = 0; builder.ok() && i < kLeavesPerRegion; ++i)
      for (int v = 0; v < kLeafVoxels; v += 51) ASSERT_LT(builder->leaf(i)[v], 6);
  }
  EXPECT_GT(errors, 100);  // the control: where the end isn't met, it is said
}

}  // namespace
}  // namespace world
