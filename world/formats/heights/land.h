/// Heights -> land: what all formats of elevation share.
///
/// Voxel x goes east, z south, y up; the origin is the north-west corner of the window at height 0. All three
/// directions have the same metres per voxel, so the land has its true shape: by default the north-south spacing of the
/// posts, at which each row of voxels is a row of posts; columns are resampled (bilinear) where posts lie closer or
/// farther in x. A voxel is ground where its bottom lies below the land: y < height * vertical_scale /
/// metres_per_voxel. Where `sea` says that height 0 is the sea, negative heights near it are noise of the radar: where
/// height <= 0, the ground ends at least one voxel deeper and water fills up to y = -1. The inside is solid stone
/// (tiles of 8^3, which cost nothing), down to at least depth_voxels below the lowest ground; the floor is rounded down
/// to a multiple of 8 for that reason. Where a post is missing there is nothing.
///
/// What lies on top follows height, slope and latitude; a rough picture of what grows there in late spring, not data:
///   steep                 granite, stone           slope above 1.1 / 0.85
///   sea floor, beach      sand                     beach: up to 4 m and nearly flat, in tiles that hold sea
///   above the snow line   snow                     at 4500 m - 50 m per degree of latitude (2400 m in the Pyrenees,
///                                                  2200 m in the Alps), +- 150 m
///   up to 300 m below     scree, dry_grass
///   up to 700 m below     dry_grass, grass         alpine meadows
///   up to 1700 m below    pine_needles, grass      woods, seen from above, with clearings
///   else                  grass, pine_needles      fields and woods
#pragma once

#include "world/formats/format.h"

namespace world {

/// Posts of known or missing height over a plane.
struct HeightGrid {
  int columns = 0, rows = 0;
  std::vector<double> heights;          // [row from north][column from west], m; NaN where there is no post
  double spacing_x = 1, spacing_z = 1;  // m between posts
  double latitude = 45;                 // degrees, for the snow line
  bool sea = false;                     // height 0 and below is the sea
  bool beaches = false;                 // and its shores are sand

  double at(int row, int column) const {
    return heights[static_cast<size_t>(row) * static_cast<size_t>(columns) + static_cast<size_t>(column)];
  }
};

/// The part of `columns` x `rows` posts that the options ask for; `name` is for errors.
Result<ImportOptions::Window> window_of(int columns, int rows, const ImportOptions& options, const std::string& name);

/// `window` is the part of the grid that becomes land. Adds the facts of what was made. `format` and `name`, of the
/// file, are for the metadata and for errors.
Result<World> land_from_heights(const HeightGrid& grid, const ImportOptions::Window& window, std::string_view format,
                                const std::string& name, const ImportOptions& options, ImportReport& report);

/// Least, greatest and mean height, and the number of posts, as facts for the table.
void add_height_facts(const HeightGrid& grid, ImportReport& report);

}  // namespace world
