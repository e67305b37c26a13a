/// Surfaces and points from files -> world: what the formats of meshes and of point clouds share.
#pragma once

#include "world/formats/format.h"
#include "world/formats/heights/picture.h"
#include "world/meshes/colours.h"
#include "world/meshes/points.h"
#include "world/meshes/polygons.h"
#include "world/sources/shape.h"

namespace world {

/// Metres of the file a voxel: what the options say, else the largest of 1, 2 and 5 times a power of ten at which the
/// longest side has at least 100 voxels.
double voxel_size_for(const ShapeBox& bounds, const ImportOptions& options);

/// A mesh as a solid (or a shell, by the options) of one block "mesh:NAME", opaque and white; or where the mesh has
/// colours of "mesh:NAME:RRGGBB" (paint.h). The point (0, 0, 0) of
/// the file is the low corner of voxel (0, 0, 0): the voxel of a point is floor(point / size). `name` is for errors;
/// `stem` the block's.
Result<World> world_from_mesh(const TriangleMesh& mesh, const MeshFileFacts& facts, const MeshReport& read,
                              const MeshColours& colours, std::span<const ColourPicture> textures,
                              const std::string& name, const std::string& stem, const ImportOptions& options,
                              ImportReport& report);

/// Each voxel that a point lies in, of the block "points:NAME", or "points:NAME:RRGGBB" of their colours; with
/// options.point_radius_m, balls around the points. Scanners have z upwards: a point (x, y, z) of the file lies at (x,
/// z, -y), unless the options say that y is up.
Result<World> world_from_points(const PointSet& points, uint64_t file_bytes, const std::string& name,
                                const std::string& stem, const ImportOptions& options, ImportReport& report);

}  // namespace world
