/// What of a world a camera can see, on the processor: buckets of faces within the frustum and the view distance that
/// look towards the camera, as indirect draws.
#pragma once

#include <vector>

#include "render/camera.h"
#include "render/raster/face_pool.h"

namespace render::raster {

struct ChunkCorner {
  int32_t x, y, z, unused;  // relative to the camera's voxel, exact
};

struct DrawList {
  std::vector<ChunkCorner> chunks;                               // drawn; firstInstance of a draw is an index
  std::vector<std::vector<VkDrawIndexedIndirectCommand>> pages;  // a list of draws for each page of the pool
  uint64_t faces = 0, draws = 0;
};

/// `rays` is the camera's at the picture's size. Front to back; chunks wholly inside the frustum before those that
/// straddle it, because one clipped vertex slows a software rasterizer's whole batch.
void cull(const FacePool& pool, const Camera& camera, const PixelRays& rays, double view_distance, DrawList& out);

}  // namespace render::raster
