/// What changed in a world from one moment to the next, in few bytes, so that two runs that differ for the first time
/// say in which voxels: their sketches are taken from each other, and what both have cancels.
///
/// A voxel's value, its block or what a layer holds there, is an entry, and a change toggles two: what was, what is.
/// An entry is in one cell of each of two tables; a cell is the exclusive or of its entries, so that one that holds a
/// single entry can be read, and that entry taken out of the other table, and so on. Half of all entries are in the
/// cells of level 0, a fourth in those of level 1, ...: of few differences all are found, of many some.
///
///   cell  x, y, z, value, check: 32 bits each
///
/// cost   up to 136 cells of 20 bytes; none of what didn't change
/// error  one voxel that differs is missed in one of 400 cases (both its entries in one cell of both tables); of
///        1 to 100,000 at least one is found otherwise, measured in the test
/// source David Eppstein, Michael T. Goodrich, Frank Uyeda, George Varghese. What's the Difference? Efficient Set
///        Reconciliation without Prior Context. 2011
#pragma once

#include <array>
#include <compare>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/play/known_blocks.h"
#include "world/store/layer.h"
#include "world/world.h"

namespace tools {

struct VoxelEntry {
  world::Layer layer = world::Layer::block;
  world::VoxelPos pos;
  uint32_t value = 0;  // name_hash() of a block; the number that a layer of integers holds
  auto operator<=>(const VoxelEntry&) const = default;
};
uint32_t name_hash(std::string_view block_name);

class ChangeSketch {
 public:
  void toggle(const VoxelEntry& entry);
  /// Takes the other from it, or adds it: that is the same.
  void toggle(const ChangeSketch& other);
  bool empty() const;
  /// Those that can be read, sorted.
  std::vector<VoxelEntry> entries() const;
  /// The cells that hold anything, hexadecimal; and back, or nothing where that is no such text.
  std::string text() const;
  static std::optional<ChangeSketch> from(std::string_view text);

 private:
  static constexpr int kTables = 2, kLevels = 16, kCellsOfFirst = 8, kCellsOfOthers = 4;
  static constexpr int kCells = kCellsOfFirst + (kLevels - 1) * kCellsOfOthers;
  using Cell = std::array<uint32_t, 5>;
  static int cell_of(int table, uint64_t entry_hash);
  static std::optional<VoxelEntry> read(int table, int cell, const Cell& from);
  std::array<std::array<Cell, kCells>, kTables> cells_{};
};

/// Follows a world's blocks and layers of integers. The world must outlive it.
class ChangeFollower {
 public:
  explicit ChangeFollower(const world::World& world);
  /// What changed since the last call. What the simulation keeps in pages of its own must have been written back.
  ChangeSketch take();

 private:
  ChangeSketch sketch_of_layers() const;
  const world::World& world_;
  int subscriber_;
  KnownBlocks known_;
  std::vector<uint32_t> names_;  // of the palette
  ChangeSketch layers_;          // all that they held at the last call
};

}  // namespace tools
