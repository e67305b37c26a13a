// Streams of regions: what OpenVDB writes is read as OpenVDB reads it, and nothing of a damaged one is believed.
#include "world/store/region_grid.h"

#include <gtest/gtest.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>

#include <cstring>
#include <random>
#include <sstream>

#include "world/store/region_stream.h"

namespace world {
namespace {

constexpr RegionPos kRegion{-3, 0, 5};

openvdb::Coord coord(VoxelPos v) { return {v.x, v.y, v.z}; }

template <class Grid>
std::string stream_of(const Grid& grid, uint32_t compression) {
  openvdb::initialize();
  std::ostringstream out(std::ios::binary);
  openvdb::io::Stream stream(out);
  stream.setCompression(compression);
  stream.write(openvdb::GridCPtrVec{grid.copyGrid()});
  return std::move(out).str();
}

/// What was read, as a tree of OpenVDB.
template <class Tree>
Status read(const std::string& bytes, Tree& tree) {
  using T = typename Tree::ValueType;
  const auto tile = [&](VoxelPos origin, int size, T value, bool active) -> Status {
    if (active || value != 0) tree.addTile(size == kLeafSize ? 1 : 2, coord(origin), value, active);
    return {};
  };
  const auto leaf = [&](LeafPos l, std::span<const T, kLeafVoxels> values,
                        std::span<const uint64_t, 8> active) -> Status {
    auto* made = new typename Tree::LeafNodeType(coord(voxel_from_leaf(l)), 0, false);
    for (openvdb::Index v = 0; v < kLeafVoxels; ++v) {
      made->setValueOnly(v, values[v]);
      made->setActiveState(v, active[v / 64] >> v % 64 & 1);
    }
    tree.addLeaf(made);
    return {};
  };
  return read_region_grid<T>(bytes, kRegion, {tile, leaf});
}

/// Leaf i holds i % 8 kinds of values that are not active; between them are tiles.
template <class Grid>
typename Grid::Ptr grid_with_everything() {
  auto grid = Grid::create(0);
  std::mt19937 random(7);
  const VoxelPos first = voxel_from_region(kRegion);
  for (int i = 0; i < 40; ++i) {
    const openvdb::Coord origin = coord(first + VoxelPos{i % 16 * 8, i * 7 % 16 * 8, i * 3 % 16 * 8});
    if (i % 5 == 4) {
      grid->tree().addTile(1, origin, static_cast<typename Grid::ValueType>(i), i % 2 == 0);
      continue;
    }
    auto* leaf = new typename Grid::TreeType::LeafNodeType(origin, 0, false);
    for (openvdb::Index v = 0; v < kLeafVoxels; ++v) {
      const bool active = i % 3 != 0 && random() % 3 != 0;
      leaf->setValueOnly(v,
                         static_cast<typename Grid::ValueType>(active ? random() % 1000 : random() % (1 + i % 8) * 5));
      leaf->setActiveState(v, active);
    }
    grid->tree().addLeaf(leaf);
  }
  return grid;
}

template <class Grid>
void check_everything() {
  using namespace openvdb::io;
  for (const uint32_t compression : {uint32_t{COMPRESS_NONE}, uint32_t{COMPRESS_ACTIVE_MASK}, uint32_t{COMPRESS_BLOSC},
                                     uint32_t{COMPRESS_BLOSC | COMPRESS_ACTIVE_MASK}}) {
    SCOPED_TRACE(compression);
    for (const auto& grid : {grid_with_everything<Grid>(), Grid::create(0)}) {
      typename Grid::TreeType tree(0);
      const Status status = read(stream_of(*grid, compression), tree);
      ASSERT_TRUE(status.ok()) << status.error().message;
      EXPECT_TRUE(tree.hasSameTopology(grid->tree()));
      for (auto value = grid->tree().cbeginValueAll(); value; ++value) {
        ASSERT_EQ(tree.getValue(value.getCoord()), *value) << value.getCoord();
        ASSERT_EQ(tree.isValueOn(value.getCoord()), value.isValueOn()) << value.getCoord();
      }
    }
  }
}

TEST(RegionGrid, WhatOpenVdbWritesIsReadWithItsTilesAndWhatIsNotActive) {
  check_everything<openvdb::Int32Grid>();
  check_everything<openvdb::FloatGrid>();
}

TEST(RegionGrid, ARegionThatIsOneTileIsRead) {
  auto grid = openvdb::FloatGrid::create(0);
  grid->tree().addTile(2, coord(voxel_from_region(kRegion)), 0.25f, true);
  openvdb::FloatTree tree(0.0f);
  ASSERT_TRUE(read(stream_of(*grid, openvdb::io::COMPRESS_ACTIVE_MASK), tree).ok());
  EXPECT_EQ(tree.activeVoxelCount(), uint64_t{kRegionSize} * kRegionSize * kRegionSize);
}

TEST(RegionGrid, NothingOutsideOfTheRegionIsRead) {
  const VoxelPos first = voxel_from_region(kRegion);
  for (const VoxelPos off : {VoxelPos{-1, 0, 0}, {0, 0, 128}, {0, 10'000, 0}, {0, -1, 0}})
    for (const bool tile : {false, true}) {
      const auto grid = openvdb::FloatGrid::create(0);
      if (tile)
        grid->tree().addTile(2, coord(first + off), 1, true);
      else
        grid->tree().setValueOn(coord(first + off), 1);
      openvdb::FloatTree tree(0.0f);
      const Status status = read(stream_of(*grid, openvdb::io::COMPRESS_NONE), tree);
      ASSERT_FALSE(status.ok()) << coord(off);
      EXPECT_NE(status.error().message.find("outside of the region"), std::string::npos) << status.error().message;
    }
}

TEST(RegionGrid, GridsOfOtherKindsAreRefused) {
  openvdb::FloatTree floats(0.0f);
  openvdb::Int32Tree integers(0);
  const auto refuses = [](const Status& status, const char* why) {
    ASSERT_FALSE(status.ok());
    EXPECT_NE(status.error().message.find(why), std::string::npos) << status.error().message;
  };
  refuses(read(stream_of(*openvdb::Int32Grid::create(0), 0), floats), "one grid of floats");
  refuses(read(stream_of(*openvdb::FloatGrid::create(0), 0), integers), "one grid of 32-bit integers");
  refuses(read(stream_of(*openvdb::FloatGrid::create(1.5f), 0), floats), "background");
  refuses(read(stream_of(*openvdb::FloatGrid::create(0), openvdb::io::COMPRESS_ZIP), floats), "compression");
  const auto moved = openvdb::FloatGrid::create(0);
  moved->setTransform(openvdb::math::Transform::createFrustumTransform({{0, 0, 0}, {1, 1, 1}}, 0.5, 10));
  refuses(read(stream_of(*moved, 0), floats), "moved or turned");
}

TEST(HardCaseIO10, AStreamThatIsCutOffAnywhereIsRefused) {
  for (const uint32_t compression : {openvdb::io::COMPRESS_ACTIVE_MASK, openvdb::io::COMPRESS_BLOSC}) {
    const std::string bytes = stream_of(*grid_with_everything<openvdb::Int32Grid>(), compression);
    for (size_t length = 0; length < bytes.size(); length += length < 1000 ? 1 : 997) {
      openvdb::Int32Tree tree(0);
      EXPECT_FALSE(read(bytes.substr(0, length), tree).ok()) << length;
    }
  }
}

TEST(HardCaseIO10, CountsAndSizesOfAStreamAreNotBelieved) {
  // Each four bytes of the head, of all and of the first node as the largest and as a negative number.
  const std::string whole = stream_of(*grid_with_everything<openvdb::Int32Grid>(), openvdb::io::COMPRESS_ACTIVE_MASK);
  int refused = 0;
  for (size_t at = 0; at + 4 < std::min<size_t>(whole.size(), 1200); ++at)
    for (const uint32_t value : {0x7fffffffu, 0xffffffffu, 0x80000000u}) {
      std::string bytes = whole;
      std::memcpy(&bytes[at], &value, sizeof value);
      openvdb::Int32Tree tree(0);
      refused += !read(bytes, tree).ok();
    }
  EXPECT_GT(refused, 300);
}

}  // namespace
}  // namespace world
