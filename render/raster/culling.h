/// What of a world a camera can see, on the processor: clusters of faces within the frustum and the view distance that
/// look towards the camera, as indirect draws.
#pragma once

#include <vector>

#include "render/camera.h"
#include "render/raster/face_pool.h"

namespace render::raster {

struct ChunkCorner {
  int32_t x, y, z;  // relative to the camera's voxel, exact
  int32_t page;     // of the pools; the shaders don't read it
};

/// The box of a cluster, relative to the camera's voxel, as the occlusion test reads it.
struct Candidate {
  int32_t low[3], draw;  // draw: in the second pass, or -1 where the first draws it
  int32_t high[3], unused;
};
static_assert(sizeof(Candidate) == 32);

struct DrawList {
  std::vector<ChunkCorner> chunks;  // drawn; firstInstance of a draw is an index
  /// Draws of the first pass, then of the second, each page by page of the pool.
  std::vector<VkDrawIndexedIndirectCommand> draws;
  std::vector<uint32_t> first_end, second_end;  // of each page, in `draws`
  std::vector<Candidate> candidates;            // empty where no occlusion test is worth it
  std::vector<FaceCluster*> clusters;           // of each candidate
  uint64_t first_faces = 0;                     // drawn by the first pass
  uint64_t left_out = 0;                        // records in chunks beyond most_chunks
};

/// A pool whose pages follow those of the pools before it in a DrawList.
struct CulledPool {
  FacePool* pool;
  uint32_t most_chunks =
      ~0u;  // of it, nearest first: a draw list that is longer leaves out the others' and counts them
};

/// What of the pools to draw from the camera, `rays` being the camera's at the picture's size. Chunks front to back.
///
/// First pass: what may have been seen last time, or the nearest faces. Its depth then says which of the others may be
/// seen; those are drawn by a second pass. So each picture is whole whatever was seen before, and pictures that follow
/// each other draw little that is hidden. Where few faces lie in the frustum, or may_test is false, all are in the
/// first pass.
void cull(std::span<const CulledPool> pools, const Camera& camera, const PixelRays& rays, double view_distance,
          bool may_test, DrawList& out);

}  // namespace render::raster
