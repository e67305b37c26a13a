/// The layers that a world may have beside its blocks, from world/store/layers.def, and one sparse layer of numbers.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_set>
#include <variant>
#include <vector>

#include "world/base/errors.h"
#include "world/space/coords.h"
#include "world/store/leaf_mask.h"

namespace world {

enum class Layer : int {
#define LAYER(name, type, background, unit, what) name,
#include "world/store/layers.def"
#undef LAYER
};

/// What OpenVDB does to the values of a stream; it keeps active values only in either case.
enum class StreamCompression { none, blosc };

struct LayerRow {
  std::string_view name, type, unit, what;
  bool is_integer;  // an IntLayer; else a FloatLayer, but for `block`
};
/// One row for each Layer, in order.
std::span<const LayerRow> layer_rows();
std::optional<Layer> layer_from_name(std::string_view name);

/// Where one who follows a layer's changes stands. A fresh one has seen nothing.
struct LayerMark {
  uint64_t layer = 0, seen = 0;
};

/// A sparse grid of T, which is float or int32_t, with a background of 0: OpenVDB behind it. Reading is free for any
/// number of threads while nobody writes.
template <class T>
class GridLayer {
 public:
  GridLayer();
  ~GridLayer();
  GridLayer(GridLayer&&) noexcept;
  GridLayer& operator=(GridLayer&&) noexcept;

  T get(VoxelPos v) const;        // 0 where not active
  void set(VoxelPos v, T value);  // makes the voxel active, at 0 too
  bool active(VoxelPos v) const;
  uint64_t active_voxels() const;
  VoxelBox bounds() const;  // of active voxels
  size_t bytes() const;
  /// The voxels of a cube from `low` on, by (x * size + y) * size + z; `inactive` where not active.
  void read_cube(VoxelPos low, int size, T inactive, std::span<T> values) const;
  /// Leaves with any active voxel, sorted.
  std::vector<LeafPos> leaves() const;
  /// Regions with any active voxel, sorted.
  std::vector<RegionPos> regions() const;

  // ---- a leaf at a time, by index_in_leaf: what heavy work reads and writes ----
  /// False where no voxel of the leaf is active; all values are 0 then. They are 0 where a bit of `active` is clear.
  bool read_leaf(LeafPos l, std::span<T, kLeafVoxels> values, LeafMask& active) const;
  /// Puts values and active voxels in the place of the leaf's; values count where their bit is set. Without any set bit
  /// nothing is left of the leaf.
  void write_leaf(LeafPos l, std::span<const T, kLeafVoxels> values, const LeafMask& active);

  /// One region as an OpenVDB stream of a Float or Int32 grid; the same values always give the same bytes.
  Result<std::string> encode_region(RegionPos r, StreamCompression compression) const;
  /// Adds what encode_region gave; refuses other grids, NaN and infinities.
  Status decode_region(std::span<const char> bytes, RegionPos r);

  // ---- by region: layers come, go and are saved with the regions of their world ----
  /// Regions that writes changed since mark_saved(), sorted.
  std::vector<RegionPos> unsaved() const;
  bool is_unsaved(RegionPos r) const;
  void mark_saved();
  void mark_unsaved(std::span<const RegionPos> regions);
  /// A layer of copies of these regions, for a thread that saves them.
  GridLayer copy_of(std::span<const RegionPos> regions) const;
  bool holds(RegionPos r) const;  // any active voxel
  size_t region_bytes(RegionPos r) const;
  /// Puts the region of `part`, which holds no other, in the place of this one's: not a write.
  void install(RegionPos r, GridLayer&& part);
  /// Forgets a region, as if nothing had been there: not a write.
  void evict(RegionPos r);

  // ---- what changed; not from several threads at once ----
  /// Leaves that were written, installed or evicted since the mark was here last, sorted, each once; and moves the mark
  /// on. None where the mark is of another layer or too far behind: any leaf may be another then. Nothing is kept for
  /// this before the first call.
  std::optional<std::vector<LeafPos>> changes(LayerMark& mark) const;

  struct Grid;  // OpenVDB's side, in world/store/tree.h
  /// For writes that say no region: all that are there before or after count as changed.
  Grid& grid();
  const Grid& grid() const { return *grid_; }

 private:
  void mark_changed(RegionPos r);
  void note_leaf(LeafPos l);
  void forget_changes();
  std::unique_ptr<Grid> grid_;
  mutable uint64_t identity_ = 0;  // of the journal; 0: nobody follows
  std::vector<LeafPos> journal_;   // of leaves that changed, the oldest first
  uint64_t journal_begin_ = 0;     // changes before it
  mutable uint64_t told_ = 0;      // changes that any mark has seen
  std::unordered_set<RegionPos, PosHash> unsaved_;
  std::optional<RegionPos> last_unsaved_;  // in unsaved_: spares a look for each voxel
  bool all_unsaved_ = false;
};
extern template class GridLayer<float>;
extern template class GridLayer<int32_t>;
using FloatLayer = GridLayer<float>;
using IntLayer = GridLayer<int32_t>;

/// A layer of the type that its row says; std::visit gets at it.
using AnyLayer = std::variant<FloatLayer, IntLayer>;
/// An empty one of the type of that layer, which isn't `block`.
AnyLayer empty_layer(Layer layer);

}  // namespace world
