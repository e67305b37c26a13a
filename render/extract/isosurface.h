/// Triangle meshes of a smooth surface, by five methods, from values at the middles of voxels (world/store/
/// solid_field.h).
///
///   blocks               the faces of the voxels whose middle is inside: what the rasterizer draws
///   surface_nets         the same faces, their corners moved to the mean of the places where the cell's edges meet the
///                        surface
///   marching_cubes       in each cell loops through those places; on a face that could be joined two ways, as the
///                        bilinear values of the face are, so that the cells on both sides agree
///   marching_tetrahedra  the same in six tetrahedra a cell, where nothing is ambiguous
///   openvdb              OpenVDB's mesher, at an adaptivity
///
/// All are closed: each edge of a triangle runs as often one way as the other; in marching_cubes and
/// marching_tetrahedra once each way. Leaves are meshed side by side and share their vertices; the mesh is the same for
/// any number of threads. A value of exactly 0 puts several vertices into one place: triangles without area are left
/// in.
///
/// error  distance to the surface, second order in voxels but for blocks (first); benchmark subject smooth_surface
/// source William Lorensen, Harvey Cline. Marching Cubes. 1987. Gregory Nielson, Bernd Hamann. The Asymptotic Decider.
///        1991 (faces). Akio Doi, Akio Koide. An Efficient Method of Triangulating Equi-Valued Surfaces by Using
///        Tetrahedral Cells. 1991. Sarah Frisken Gibson. Constrained Elastic Surface Nets. 1998. The tables are
///        derived.
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "world/store/solid_field.h"

namespace render {

enum class SurfaceMethod : int { blocks, surface_nets, marching_cubes, marching_tetrahedra, openvdb };
std::span<const std::string_view> surface_method_names();  // in order
std::optional<SurfaceMethod> surface_method_from_name(std::string_view name);

/// `adaptivity`, 0 to 1, is openvdb's. Fails where there are more than 2^32 vertices or triangles.
world::Result<world::VoxelMesh> isosurface(const world::SolidField& field, SurfaceMethod method, double adaptivity = 0);

/// By vertex, unit: of the triangles around it, by their area; (0, 0, 0) where they have none.
std::vector<world::Vec3f> vertex_normals(const world::VoxelMesh& mesh);

}  // namespace render
