/// The layers that a world may have beside its blocks, from world/store/layers.def, and one sparse layer of floats.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
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

  /// The values as they are now, readable on another thread: shared until the next write to this layer, which copies.
  FloatLayer snapshot() const;
  /// Raised by each write.
  uint64_t version() const { return version_; }

  struct Grid;  // OpenVDB's side, in world/store/tree.h
  Grid& grid();
  const Grid& grid() const { return *grid_; }

 private:
  std::unique_ptr<Grid> grid_;
  uint64_t version_ = 0;
};

}  // namespace world
