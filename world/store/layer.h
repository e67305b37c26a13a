/// The layers that a world may have beside its blocks, from world/store/layers.def, and one sparse layer of floats.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_set>
#include <vector>

#include "world/base/errors.h"
#include "world/space/coords.h"

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
};
/// One row for each Layer, in order.
std::span<const LayerRow> layer_rows();
std::optional<Layer> layer_from_name(std::string_view name);

/// A sparse grid of floats with a background of 0: OpenVDB behind it. Reading is free for any number of threads while
/// nobody writes.
class FloatLayer {
 public:
  FloatLayer();
  ~FloatLayer();
  FloatLayer(FloatLayer&&) noexcept;
  FloatLayer& operator=(FloatLayer&&) noexcept;

  float get(VoxelPos v) const;
  void set(VoxelPos v, float value);  // makes the voxel active, at 0 too
  bool active(VoxelPos v) const;
  uint64_t active_voxels() const;
  VoxelBox bounds() const;  // of active voxels
  size_t bytes() const;
  /// The voxels of a cube from `low` on, by (x * size + y) * size + z; NaN where not active.
  void read_cube(VoxelPos low, int size, std::span<float> values) const;
  /// Leaves with any active voxel, sorted.
  std::vector<LeafPos> leaves() const;
  /// Regions with any active voxel, sorted.
  std::vector<RegionPos> regions() const;
  /// One region as an OpenVDB stream of a Float grid; the same values always give the same bytes.
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
  FloatLayer copy_of(std::span<const RegionPos> regions) const;
  bool holds(RegionPos r) const;  // any active voxel
  size_t region_bytes(RegionPos r) const;
  /// Puts the region of `part`, which holds no other, in the place of this one's: not a write.
  void install(RegionPos r, FloatLayer&& part);
  /// Forgets a region, as if nothing had been there: not a write.
  void evict(RegionPos r);

  struct Grid;  // OpenVDB's side, in world/store/tree.h
  /// For writes that say no region: all that are there before or after count as changed.
  Grid& grid();
  const Grid& grid() const { return *grid_; }

 private:
  std::unique_ptr<Grid> grid_;
  std::unordered_set<RegionPos, PosHash> unsaved_;
  std::optional<RegionPos> last_unsaved_;  // in unsaved_: spares a look for each voxel
  bool all_unsaved_ = false;
};

}  // namespace world
