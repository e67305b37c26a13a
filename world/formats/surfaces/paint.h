/// Colours of surfaces and points on voxels that have been filled.
///
/// A surface is sampled at half a voxel; what falls into a voxel is averaged, linearly. A voxel at the surface that
/// holds no sample takes the mean of its 26 neighbours, or where those hold none what is nearest through filled voxels;
/// what no face shows has the mean of all. Colours are kept with 8 bits a band, at most kMostColours of them
/// (ColourBlocks).
#pragma once

#include <span>

#include "world/formats/format.h"
#include "world/formats/heights/picture.h"
#include "world/meshes/colours.h"
#include "world/meshes/mesh.h"
#include "world/world.h"

namespace world {

constexpr size_t kMostColours = 4096;

/// `textures` by material; null where it has none. voxel = floor(turn * point / size).
Status paint_mesh(World& world, BlockId block, const TriangleMesh& mesh, const MeshColours& colours,
                  std::span<const ColourPicture> textures, const glm::dmat3& turn, double size, ImportReport& report);
Status paint_points(World& world, BlockId block, std::span<const Vec3d> positions, std::span<const uint32_t> colours,
                    const glm::dmat3& turn, double size, ImportReport& report);

}  // namespace world
