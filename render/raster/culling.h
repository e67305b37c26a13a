/// What of a world a camera can see, on the processor: clusters of faces within the frustum and the view distance that
/// look towards the camera, as indirect draws.
#pragma once

#include <array>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "render/camera.h"
#include "render/raster/face_pool.h"

namespace render::raster {

/// What a picture shows: boxes relative to the camera are told whether they may lie in it.
struct Frustum {
  std::array<Vec3d, 5> planes;  // inside: dot >= 0; through the camera

  explicit Frustum(const PixelRays& rays);
  enum Side { outside, straddling, inside };
  Side side(const Vec3d& low, const Vec3d& high) const;
};

/// From the camera, m; 0 inside.
double distance_to_box(const Vec3d& low, const Vec3d& high);

struct ChunkCorner {
  int32_t x, y, z;  // voxels, relative to the camera's, exact
  uint32_t detail;  // see kChunkLevel of raster.shared.h
};

/// A cluster as the occlusion test reads it, its box relative to the camera's voxel.
struct Candidate {
  int32_t low[3], draw;    // draw: in the second pass, or -1 where the first draws all of it
  int32_t high[3], chunk;  // chunk: in DrawList::chunks
  RecordBits drawn;        // by the first pass
  uint32_t first, count;   // records of its page
  uint32_t room;           // records that the second pass may draw lie before its own
  uint32_t by_face;        // 1: its faces are tested one by one; 0: all of it is drawn or nothing
};
static_assert(sizeof(Candidate) == 64);

/// A face that is drawn by itself.
struct ListedFace {
  uint32_t record, chunk;  // of its page; in DrawList::chunks
};

/// Points of a cluster.
struct ListedPoints {
  uint32_t first, count;  // records of its page
  uint32_t chunk;         // in DrawList::chunks
  float distance;         // m, to the nearest
};

/// A level fades in between `from` and this times it, pixel by pixel, while the one below fades out.
constexpr double kBlendBand = 1.15;

/// Records of pools, and for what they are not drawn. Faces of a cluster count as one.
struct CulledFaces {
  uint64_t world = 0;     // in the level of voxels, all
  uint64_t distance = 0;  // beyond the view distance, of the level of voxels as the following
  uint64_t detail = 0;    // coarser levels are drawn there
  uint64_t frustum = 0, back = 0;
  uint64_t coarse = 0;  // of coarser levels, in the frustum, that look towards the camera
  uint64_t taken = 0;   // of any level, in chunks that something else draws
  friend bool operator==(const CulledFaces&, const CulledFaces&) = default;
};

struct DrawList {
  std::vector<ChunkCorner> chunks;  // drawn; firstInstance of a draw is an index
  std::vector<uint32_t> pages;      // of each chunk, counted over all pools
  /// Draws of the first pass, then of the second, each page by page of the pool.
  std::vector<VkDrawIndexedIndirectCommand> draws;
  std::vector<uint32_t> first_end, second_end;  // of each page, in `draws`
  std::vector<Candidate> candidates;            // page by page; empty where no occlusion test is worth it
  std::vector<uint32_t> candidates_end;         // of each page
  std::vector<FaceCluster*> clusters;           // of each candidate
  /// Of pages whose faces are tested one by one: six a face that the first pass draws. The second pass has its own.
  std::vector<uint32_t> indices;
  /// In place of draws and indices, where faces of cubes are listed: those that the first pass draws, page by page.
  std::vector<ListedFace> listed;
  std::vector<uint32_t> listed_end, second_listed;  // of each page, in `listed`; where its part of the second's begins
  bool lists_faces = false;
  /// The same of points, where those are listed too.
  std::vector<ListedPoints> points;
  std::vector<uint32_t> points_end;
  uint32_t second_faces = 0;  // that the second pass may draw, at most
  uint64_t first_faces = 0;   // drawn by the first pass
  CulledFaces culled;
  bool blends = false;    // some chunk is drawn in part
  uint64_t left_out = 0;  // records in chunks beyond most_chunks
};

constexpr double kNoNextLevel = std::numeric_limits<double>::infinity();

/// A pool whose pages follow those of the pools before it in a DrawList.
struct CulledPool {
  FacePool* pool;
  int level = 0;             // cells of 2^level voxels
  double from = 0;           // m: drawn of chunks at least that far, whole from kBlendBand times it on
  double to = kNoNextLevel;  // m: `from` of the next level, which takes the place of this one
  uint32_t most_chunks =
      ~0u;  // of it, nearest first: a draw list that is longer leaves out the others' and counts them
  /// m: drawn of chunks at least as far as the first and nearer than the second, without a blend.
  double nearest = 0, farthest = kNoNextLevel;
  bool points = false;   // drawn a point a record; else 4 vertices and 6 indices
  bool by_face = false;  // records are faces of cubes, which the occlusion test looks at one by one
};

/// A chunk that may be seen.
struct SeenChunk {
  PooledChunk* chunk;
  uint32_t page;  // counted over all pools
  const CulledPool* pool;
  int level;
  uint32_t detail;
  double distance;
  bool straddles;
  Vec3d corner;        // relative to the camera
  Vec3d low, high;     // box of its records, relative to the camera
  bool taken = false;  // something else draws it
};
/// Marks those of the chunks, front to back, that something else draws.
using TakeChunks = std::function<void(std::span<SeenChunk>)>;

/// Whether no record of a cluster with this box, relative to the camera, can look towards the camera.
bool looks_away(const FaceCluster& cluster, const Vec3d& low, const Vec3d& high);

/// Of what faces the camera, at 1 m.
double pixels_at_one_metre(const PixelRays& rays, int height);

constexpr double kVoxelDiagonal = 1.7321;  // m

/// Distance from which on a level's surfaces, at most half a cell from where they are, lie at most error_px pixels off,
/// m.
double level_distance(int level, const PixelRays& rays, int height, double error_px);

/// Where faces of cubes are listed in place of being drawn.
struct ListWhere {
  uint64_t from = ~uint64_t{0};  // so many of them in the first pass, or twice as many points
  bool points = false;           // those are listed with them
};

/// What of the pools to draw from the camera, `rays` being the camera's at the picture's size. Chunks front to back.
///
/// First pass: faces that may have been seen last time, or the nearest. Its depth then says which of the others may be
/// seen; those are drawn by a second pass. So each picture is whole whatever was seen before, and pictures that follow
/// each other draw little that is hidden. Where few faces lie in the frustum, or may_test is false, all are in the
/// first pass, as runs of records.
void cull(std::span<const CulledPool> pools, const Camera& camera, const PixelRays& rays, double view_distance,
          bool may_test, const ListWhere& list, DrawList& out, const TakeChunks& take = {});

}  // namespace render::raster
