/// What the files of the .vdb format share: grids of the types that are read, and how they are loaded. Internal to
/// world/formats/vdb.
#pragma once

#include <openvdb/io/Stream.h>
#include <openvdb/points/PointDataGrid.h>

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "world/formats/vdb.h"
#include "world/store/grid_stream.h"

namespace world::vdb {

constexpr uint64_t kMaxFileBytes = uint64_t{1} << 33;
constexpr const char* kBlockGrid = "block_id";
inline const std::string kBlockKey = "loam_block_", kAboutKey = "loam_about_";
/// World metadata: where the middle of voxel (0, 0, 0) lies in the file's world, m.
inline const std::string kOriginKey = "vdb.origin_m";

/// Calls visit(tree of its own type) where the grid's type is one that we know.
template <class Visit>
bool with_tree(const openvdb::GridBase& grid, Visit visit) {
  const auto try_type = [&](auto* null) {
    using Grid = std::remove_pointer_t<decltype(null)>;
    if (!grid.isType<Grid>()) return false;
    visit(static_cast<const Grid&>(grid).constTree());
    return true;
  };
  return try_type(static_cast<openvdb::FloatGrid*>(nullptr)) || try_type(static_cast<openvdb::DoubleGrid*>(nullptr)) ||
         try_type(static_cast<openvdb::Int32Grid*>(nullptr)) || try_type(static_cast<openvdb::Int64Grid*>(nullptr)) ||
         try_type(static_cast<openvdb::BoolGrid*>(nullptr)) || try_type(static_cast<openvdb::MaskGrid*>(nullptr)) ||
         try_type(static_cast<openvdb::Vec3SGrid*>(nullptr)) || try_type(static_cast<openvdb::Vec3DGrid*>(nullptr)) ||
         try_type(static_cast<openvdb::points::PointDataGrid*>(nullptr));
}

/// All grids of a file, checked.
struct Loaded {
  VdbFacts facts;
  std::vector<openvdb::GridBase::Ptr> grids;
  std::vector<std::string> unknown;  // grids of types that OpenVDB does not know here
  uint64_t file_bytes = 0;
};

/// Reads all grids, in a child process first.
Result<Loaded> load(std::span<const uint8_t> bytes, std::string_view name);
/// Goes over all values of a grid once: checks them, and fills what `facts` says of them. The sentence says what is
/// wrong. False where the type is not known.
Result<bool> survey_grid(const openvdb::GridBase& grid, VdbGridFacts& facts);
Result<World> world_from_grids(Loaded loaded, std::string_view format, const std::string& name,
                               const ImportOptions& options, ImportReport& report);

// ---- maps to the world ----
/// Whether voxels are cubes along the axes of the world, with no mirror.
bool maps_to_cubes(const openvdb::GridBase& grid);
/// How far `grid` lies from `other`, where both have the same voxels but for that.
std::optional<openvdb::Coord> whole_voxels_between(const openvdb::GridBase& grid, const openvdb::GridBase& other);
/// Trilinear values at cubes of the least voxel size, along the axes of the world; index 0 at its origin.
Result<openvdb::FloatGrid::Ptr> resampled_to_cubes(const openvdb::FloatGrid& grid);
/// Trilinear values at the voxels of `other`.
Result<openvdb::FloatGrid::Ptr> resampled_like(const openvdb::FloatGrid& grid, const openvdb::GridBase& other);

/// write() of the format.
Status write_vdb(const World& world, const std::filesystem::path& path);
/// What writing makes of a world: the blocks with palette and metadata, then the further layers. May throw.
openvdb::GridCPtrVec grids_from_world(const World& world);

inline bool inside_world(const openvdb::Coord& c) { return world::inside_world(voxel(c)); }

}  // namespace world::vdb
