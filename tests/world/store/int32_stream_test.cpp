#include "world/store/int32_stream.h"

#include <random>

#include <gtest/gtest.h>

#include "world/store/grid_stream.h"
#include "world/store/region_stream.h"

namespace world {
namespace {

/// What OpenVDB itself writes of the same region.
std::string by_openvdb(RegionPos pos, const RegionLeaves& leaves) {
  auto tree = std::make_shared<openvdb::Int32Tree>(kAir);
  add_region_ids(*tree, pos, leaves);
  auto grid = openvdb::Int32Grid::create(tree);
  grid->setName(kBlockGridName);
  return stream_bytes_without_statistics(grid);
}

struct Case {
  const char* name;
  double mixed, tiles;  // shares of leaves
  int blocks;
};

TEST(Int32Stream, TreesAreByteForByteWhatOpenVdbWrites) {
  initialize_openvdb();
  const PackedRegion air([](int) { return LeafBlocks{}; });
  const size_t header = int32_stream({0, 0, 0}, RegionLeaves(air)).size() - 8;  // but for tiles and children: none
  std::mt19937 random(5);
  const auto uniform = [&] { return std::uniform_real_distribution<>()(random); };
  for (const Case& c : {Case{"air", 0, 0, 1}, Case{"stone", 0, 1, 1}, Case{"tiles", 0, 0.5, 300},
                        Case{"few leaves", 0.01, 0.1, 3}, Case{"many leaves", 0.9, 0.05, 65535}}) {
    for (const RegionPos pos : {RegionPos{0, 0, 0}, RegionPos{-1, 31, -33}, RegionPos{4000, -5, 1 << 20}}) {
      std::vector<BlockId> values(kLeafVoxels);
      const PackedRegion packed([&](int) -> LeafBlocks {
        const double draw = uniform();
        const auto block = [&] { return static_cast<BlockId>(1 + random() % static_cast<unsigned>(c.blocks)); };
        if (draw < c.tiles) return {nullptr, block()};
        if (draw > c.tiles + c.mixed) return {};
        // Whole words of air, whole words of blocks, and both mixed.
        for (int v = 0; v < kLeafVoxels; ++v) {
          const int word = (v >> 6) % 3;
          values[static_cast<size_t>(v)] = word == 0 || (word == 1 && random() % 2) ? block() : kAir;
        }
        return {values.data(), kAir};
      });
      const std::string ours = int32_stream(pos, RegionLeaves(packed));
      const std::string theirs = by_openvdb(pos, RegionLeaves(packed));
      EXPECT_TRUE(theirs.ends_with(std::string_view(ours).substr(header))) << c.name << ", " << ours.size() << " bytes";
      EXPECT_EQ(theirs.substr(0, 100), ours.substr(0, 100)) << c.name;
      // And OpenVDB reads it.
      const auto back = decode_region(ours, pos, 65536);
      ASSERT_TRUE(back) << back.error().message;
      for (int i = 0; i < kLeavesPerRegion; ++i)
        for (int v = 0; v < kLeafVoxels; ++v) ASSERT_EQ(back->leaf(i)[v], packed.get(i, v)) << c.name;
    }
  }
}

}  // namespace
}  // namespace world
