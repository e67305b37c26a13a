/// The store: one sparse OpenVDB tree a layer, behind a header that knows no OpenVDB.
///
///   root table -> 4096^3 nodes -> regions (128^3) -> leaves (8^3, 512 block ids, 1 KiB) or tiles (one id, no bytes)
///   beside the tree: regions at rest, packed by palette (world/store/packed_region.h); the first edit opens them
///
/// Reading is free for any number of threads while nobody edits; editing needs exclusive access, and a CHECK stops an
/// edit while a WorldView lives. Every edit goes through apply(), write_leaves() or adopt(), which keep the census (how
/// many voxels of each block, by region), the dirty sets, the undo log and the derived masks.
/// A tile says one id for its whole cube, exactly as 512 equal voxels would.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "world/base/errors.h"
#include "world/blocks/block.h"
#include "world/space/coords.h"
#include "world/store/edit.h"
#include "world/store/layer.h"
#include "world/store/mask_volume.h"

namespace world {

/// 512 block ids, or one for all of them.
struct LeafBlocks {
  const BlockId* values = nullptr;  // by index_in_leaf; null where the leaf is uniform
  BlockId uniform = kAir;
  BlockId operator[](int index) const { return values ? values[index] : uniform; }
};

struct StoreNodes;     // OpenVDB's side, in world/store/tree.h
class PreparedRegion;  // world/store/snapshot.h
class StoreSnapshot;

/// Builds one region apart from the store, on any thread. Each leaf starts as air.
class RegionBuilder {
 public:
  explicit RegionBuilder(RegionPos pos);
  ~RegionBuilder();
  RegionBuilder(RegionBuilder&&) noexcept;
  RegionBuilder& operator=(RegionBuilder&&) noexcept;

  RegionPos pos() const { return pos_; }
  /// `values` by index_in_leaf; leaf by index_in_region. Uniform leaves become tiles.
  void set_leaf(int leaf_index, std::span<const BlockId, kLeafVoxels> values);
  void set_uniform(int leaf_index, BlockId block);
  LeafBlocks leaf(int leaf_index) const;

 private:
  friend class Store;
  struct Impl;
  RegionPos pos_;
  std::unique_ptr<Impl> impl_;
};

using Census = std::map<BlockId, uint64_t>;  // never holds air or zeros

struct LayerInfo {
  std::string name;
  size_t bytes = 0;
  uint64_t active_voxels = 0;
};

class Store {
 public:
  /// The palette must outlive the store and may grow, not change.
  explicit Store(const BlockPalette& palette);
  ~Store();
  Store(Store&&) noexcept;
  Store& operator=(Store&&) noexcept;

  // ---- reading ----
  BlockId get(VoxelPos v) const;     // for tools and tests: a descent of the tree each time
  LeafBlocks leaf(LeafPos l) const;  // valid until the next edit
  /// All leaves that are not uniform, sorted by position.
  std::vector<LeafPos> mixed_leaves() const;
  /// Regions that hold anything but air, sorted by position.
  std::vector<RegionPos> regions() const;
  VoxelBox bounds() const;  // exact, of voxels that are not air
  Census census() const;
  Census region_census(RegionPos r) const;
  uint64_t voxel_count() const;  // not air
  size_t bytes_memory() const;   // block layer and derived masks
  std::vector<LayerInfo> layers() const;
  /// A hash of all blocks that depends on positions and block names only, not on tiles, ids or history.
  uint64_t content_hash() const;

  /// Derived bits of one kind, built on the first call and kept up to date by edits. Not from several threads at once.
  const MaskVolume& masks(MaskKind kind) const;

  // ---- writing ----
  /// Applies the batch in order. Positions outside the world's border are an error and change nothing.
  Result<EditReport> apply(const EditBatch& batch, UndoLog* undo = nullptr);
  /// The same as a batch that sets every voxel of these leaves in turn, in a fraction of its time. Order is free; of a
  /// leaf that comes twice the last counts.
  Result<EditReport> write_leaves(std::span<const LeafWrite> leaves, UndoLog* undo = nullptr);
  /// Puts a built region in the place of what was there.
  void adopt(RegionBuilder&& region);
  /// Turns leaves of one value into tiles; after many random edits.
  void prune();

  // ---- what changed; not from several threads at once ----
  /// Differs between any two stores of a run, and moves with the store: tells a consumer whose changes it follows.
  uint64_t identity() const;
  /// A consumer of changes; it starts with nothing dirty.
  int subscribe() const;
  /// Leaves changed since the last call for this consumer, sorted, each once.
  std::vector<LeafPos> take_dirty(int subscriber) const;

  // ---- what a save lacks; of one saver ----
  /// Regions whose blocks edits, adopt() or undo changed since they were last saved or installed, sorted. Layers keep
  /// their own.
  std::vector<RegionPos> unsaved() const;
  bool has_unsaved() const;            // blocks, or values of a layer, or a layer that was dropped
  bool is_unsaved(RegionPos r) const;  // its blocks, or values of a layer there
  void mark_saved();                   // blocks and layers
  void mark_unsaved(std::span<const RegionPos> regions);
  /// The regions as they are now, to be read on another thread while editing goes on.
  StoreSnapshot snapshot(std::span<const RegionPos> regions) const;

  // ---- what is in memory ----
  /// Puts a region in place that a save or a generator holds already: not a change to be saved.
  void install(PreparedRegion&& region);
  void install(Layer layer, RegionPos r, AnyLayer&& part);
  /// Forgets a region and what layers hold there, as if it were air, without calling that a change to be saved.
  void evict(RegionPos r);
  /// Packs regions by palette until they are edited again; blocks read the same.
  void pack(RegionPos r);
  void pack();
  bool is_packed(RegionPos r) const;
  /// Gives back what bulk reads of a packed region unpacked; ends the life of its LeafBlocks.
  void refreeze(RegionPos r);
  size_t region_bytes(RegionPos r) const;  // of its blocks and masks, and of layers there
  unsigned mask_kinds() const;             // bit k: masks of kind k have been asked for

  // ---- further layers: they exist only once something makes them ----
  /// The layer, or null where nothing has made it. To ask for one that is of integers by the functions without `int`,
  /// or the other way round, is a bug.
  const FloatLayer* find_layer(Layer layer) const;
  const IntLayer* find_int_layer(Layer layer) const;
  const AnyLayer* find_any_layer(Layer layer) const;
  FloatLayer& make_layer(Layer layer);
  IntLayer& make_int_layer(Layer layer);
  AnyLayer& make_any_layer(Layer layer);
  void drop_layer(Layer layer);
  /// Layers that were dropped since the last mark_saved(): a save has rows of them still.
  std::vector<Layer> dropped_layers() const;
  void mark_dropped(std::span<const Layer> layers);

  // ---- view count, see view.h ----
  void begin_view() const;
  void end_view() const;

  StoreNodes& nodes() { return *nodes_; }
  const StoreNodes& nodes() const { return *nodes_; }
  const BlockPalette& palette() const { return *palette_; }

 private:
  friend class UndoLog;
  void leaf_changed(LeafPos l);
  void note_change(LeafPos l);  // to savers and subscribers
  /// Swaps the blocks that an undo step holds with those of the store.
  void swap_leaves(std::vector<LeafUndo>& step);
  const BlockPalette* palette_;
  std::unique_ptr<StoreNodes> nodes_;
};

/// A cursor for one thread: remembers the last nodes visited, so neighbouring reads skip the descent.
class StoreReader {
 public:
  explicit StoreReader(const Store& store);
  ~StoreReader();
  BlockId get(VoxelPos v);
  LeafBlocks leaf(LeafPos l);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace world
