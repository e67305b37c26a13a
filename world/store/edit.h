/// Batch edits: what to change, what changed, and how to take it back.
#pragma once

#include <vector>

#include "world/blocks/block.h"
#include "world/space/coords.h"
#include "world/store/leaf_mask.h"

namespace world {

/// Voxels and boxes to write, in order: the last write of a voxel wins.
class EditBatch {
 public:
  struct Op {
    VoxelBox box;
    BlockId block;
  };
  void set(VoxelPos v, BlockId block) { ops_.push_back({{v, v}, block}); }
  void fill(const VoxelBox& box, BlockId block) {
    if (!box.empty()) ops_.push_back({box, block});
  }
  const std::vector<Op>& ops() const { return ops_; }
  bool empty() const { return ops_.empty(); }

 private:
  std::vector<Op> ops_;
};

/// All blocks of one leaf, 512 by index_in_leaf.
struct LeafWrite {
  LeafPos leaf;
  const BlockId* values;
};

struct EditReport {
  uint64_t voxels_changed = 0;
  uint64_t leaves_changed = 0;
};

/// The old blocks of one leaf, for the voxels that an edit changed. values: one for each set bit, in index order.
struct LeafUndo {
  LeafPos leaf;
  LeafMask changed;
  std::vector<BlockId> values;
};

class Store;

/// What edits replaced, newest last. Undo and redo swap with the store, so either can be repeated.
class UndoLog {
 public:
  size_t undo_steps() const { return done_.size(); }
  size_t redo_steps() const { return undone_.size(); }
  /// Takes the last batch back; false where there is none.
  bool undo(Store& store);
  bool redo(Store& store);
  size_t bytes() const;

 private:
  friend class Store;
  std::vector<std::vector<LeafUndo>> done_, undone_;
};

}  // namespace world
