/// Pieces that have broken off and fall: sets of solid voxels, each moved as one, without turning.
///
/// A piece stays in the grid while it falls, so that other rules, pictures and the books see it at every tick: in whole
/// voxels it changes places with what it falls through. Each voxel keeps its block and its heat; air, gases and liquids
/// go up by the height of the piece above them, all of them. The rest of the way, a part of a voxel, is kept.
///
///   contact  of its own voxels: it stops above the first solid or grain that isn't its own, or at the world's floor
///   grains   that lie on it are carried where it would come down on them: what is in a box falls with it; on a roof
///            they fall by themselves
///   rest     where it stops it stands again, at once and for good
///   meeting  what falls onto another piece in the air becomes one with it, with the mean of their speeds
///   damage   what burns, melts or is taken out of a piece in the air is gone from it, and its parts fall by themselves
///   order    those whose lowest voxels lie lower move first; of these the one whose first voxel comes first
///
/// cost   some 16 ns a voxel of a piece and voxel of its way on one thread, columns of leaves on all
/// error  no air resistance, no turning, no breaking by the blow; speed ends at kFastestPiece, in liquids at
///        kFastestInLiquid whatever the piece weighs: wood sinks too
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "sim/matter/cells.h"
#include "sim/matter/structures.h"
#include "world/base/errors.h"

namespace sim {

constexpr int kPieceFixedLog2 = 16;                      // of speeds, 2^-16 voxel a tick, and of parts of a voxel
constexpr int32_t kPieceGravity = 1607;                  // 9.81 m/s^2 at 20 ticks/s, 1607.3
constexpr int32_t kFastestPiece = 4 << kPieceFixedLog2;  // 80 m/s
/// 5.5 m/s: a cubic metre of granite in water. Sighard Hoerner. Fluid-Dynamic Drag. 1965: a cube's coefficient is 1.05.
constexpr int32_t kFastestInLiquid = 18022;

struct Piece {
  VoxelSet voxels;
  int32_t speed = 0;  // downwards, 0 .. kFastestPiece
  int32_t gone = 0;   // of the next voxel, 0 .. 65535
};

class Pieces {
 public:
  bool empty() const { return pieces_.empty(); }
  const std::vector<Piece>& all() const { return pieces_; }
  /// Voxels of them in a leaf.
  world::LeafMask falling(world::LeafPos l) const {
    const auto at = falling_.find(l);
    return at == falling_.end() ? world::kNoneMask : at->second;
  }
  void add(Piece piece);
  /// Drops what is no solid any more, and parts what doesn't hold together. Before step().
  void follow(Cells& cells);
  struct Step {
    std::vector<VoxelSet> landed;
    uint64_t voxels_moved = 0;
  };
  /// A tick of all; tells the cells what changed.
  Step step(Cells& cells);
  /// Pages that they are on.
  void for_each_page(Cells& cells, world::FunctionRef<void(PageId)> visit) const;

  /// Text, a line a piece and leaf; empty where there are none.
  std::string state() const;
  /// Reads what state() wrote, in the place of what is there. Fails where numbers are out of their range or a voxel is
  /// no solid, or one of two pieces.
  world::Status restore(std::string_view text, Cells& cells);
  size_t bytes() const;

 private:
  enum class Blocked : uint8_t { no, by_piece, by_ground };
  void refresh();
  Blocked find_way(Cells& cells, size_t index, size_t& other);
  Blocked carry(Cells& cells, size_t index, world::VoxelPos grain, size_t& other);
  /// What is in one leaf of what moves, and the pages of that leaf and the one below.
  struct MovingPart {
    world::LeafPos leaf;
    world::LeafMask mask;
    PageId here, under;
  };
  static bool move_column(Cells& cells, std::span<const MovingPart> parts);
  void move_down(Cells& cells, Piece& piece, Step& step);
  void join(size_t index, size_t other);

  std::vector<Piece> pieces_;
  std::unordered_map<world::LeafPos, world::LeafMask, world::PosHash> falling_;
  std::vector<LeafPart> carried_;   // of the piece whose way was found last
  std::vector<MovingPart> moving_;  // of the piece that moves, columns of leaves from below upwards
  std::vector<size_t> columns_;     // where each begins in moving_, and the end
};

}  // namespace sim
