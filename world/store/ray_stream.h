/// Many rays at once against one volume: the first set voxel of each, by SIMD lanes that refill as rays end.
///
/// Each lane walks the empty cubes of a BrickVolume in float, relative to its own start voxel, with a bound on its
/// error: where a decision (which plane comes first, which voxel lies behind it) is closer than that bound, the ray is
/// walked anew in double by MaskWalker. So hits are those of first_hit_flat, bit for bit, on every processor: voxel,
/// face and t, whatever the width of the lanes and whether products are fused.
///
/// error  none against MaskWalker. Directions are scaled to a largest component of 1; then |position error| of a
///        crossing at t <= (10 t + 2) 2^-24
/// cost   on one core with AVX2: 36 to 42 ns a primary ray in packets, 70 to 80 a diffuse ray in lanes
///        (measured 2026-11-26); nothing is allocated
/// source for the kind of walk: Samuli Laine, Tero Karras. Efficient Sparse Voxel Octrees. 2010 (empty cubes),
///        Amanatides, Woo 1987 (planes); for filtered exactness: Jonathan Shewchuk. Adaptive Precision Floating-Point
///        Arithmetic and Fast Robust Geometric Predicates. 1997
#pragma once

#include <limits>
#include <memory>
#include <span>

#include "world/store/brick_volume.h"
#include "world/store/mask_walk.h"
#include "world/store/store.h"

namespace world {

/// A ray in floats, half as many bytes as a GridRay; exact in itself, since its numbers are what the hit follows from.
struct StreamRay {
  VoxelPos voxel;
  Vec3f fraction{0};   // 0..1
  Vec3f direction{0};  // any length
  float t_max = std::numeric_limits<float>::infinity();

  operator GridRay() const { return {{voxel, Vec3d(fraction)}, Vec3d(direction), t_max}; }
};
static_assert(sizeof(StreamRay) == 40);

struct StreamReport {
  uint64_t rays = 0;
  uint64_t exact = 0;  // walked anew in double
  uint64_t steps = 0;  // of vectors of lanes
  void add(const StreamReport& o) { rays += o.rays, exact += o.exact, steps += o.steps; }
};

/// Keeps a BrickVolume of one MaskVolume, which must outlive it. Casting may run on all threads.
class RayStream {
 public:
  explicit RayStream(const MaskVolume& volume);
  /// After these leaves changed.
  void update(std::span<const LeafPos> dirty);

  /// hits[i]: the first set voxel on rays[i], its start's own included; as MaskWalker::first_set, but for `end` of
  /// rays that hit nothing, which is t_max, and their t.
  void first_set(std::span<const GridRay> rays, std::span<GridHit> hits, StreamReport* report = nullptr) const;
  void first_set(std::span<const StreamRay> rays, std::span<GridHit> hits, StreamReport* report = nullptr) const;
  /// The same hits, for rays of which each 64 in a row run much the same way: pixels of a tile of 8x8, or parallel rays
  /// from near each other. Several times faster where they do, a little slower where they don't.
  void first_set_coherent(std::span<const GridRay> rays, std::span<GridHit> hits, StreamReport* report = nullptr) const;
  void first_set_coherent(std::span<const StreamRay> rays, std::span<GridHit> hits,
                          StreamReport* report = nullptr) const;
  /// blocked[i]: 1 where anything is set on rays[i], else 0.
  void any_set(std::span<const GridRay> rays, std::span<uint8_t> blocked, StreamReport* report = nullptr) const;
  /// The same for rays that run alike, as first_set_coherent.
  void any_set_coherent(std::span<const GridRay> rays, std::span<uint8_t> blocked,
                        StreamReport* report = nullptr) const;
  void any_set_coherent(std::span<const StreamRay> rays, std::span<uint8_t> blocked,
                        StreamReport* report = nullptr) const;

  const BrickVolume& bricks() const { return bricks_; }
  const MaskWalker& walker() const { return walker_; }

 private:
  // Ray: GridRay or StreamRay.
  /// At most UnsureRays::kMost, without walking anew what is unsure.
  template <class Ray>
  void walk_lanes(std::span<const Ray> rays, GridHit* hits, struct UnsureRays& unsure, StreamReport& report) const;
  template <class Ray>
  void walk_all(std::span<const Ray> rays, std::span<GridHit> hits, StreamReport* report) const;
  template <class Ray>
  void walk_packets(std::span<const Ray> rays, std::span<GridHit> hits, StreamReport* report) const;
  template <class Ray>
  void walk_rest(struct RestOfRays& rest, std::span<const Ray> rays, std::span<GridHit> hits,
                 StreamReport& report) const;
  /// Loads rays into packets of 64 each, which pass together what is empty for all of them.
  template <class Ray>
  void frame_packets(struct Packet* packets, std::span<const Ray> rays) const;
  /// The up to 64 rays of a packet; returns those, a bit each, that must go on in lanes.
  template <class Ray>
  uint64_t first_set_packet(struct Packet& packet, struct SliceCache& cache, std::span<const Ray> rays,
                            std::span<GridHit> hits, StreamReport& report) const;
  /// The exact walk from where the ray crosses the plane, before which it meets nothing.
  GridHit first_set_from(const GridRay& ray, int axis, int32_t plane) const;

  const MaskVolume* volume_;
  BrickVolume bricks_;
  MaskWalker walker_;
};

class ParallelRays;

/// The streams of one store's masks, which follow its edits. Belongs to one thread; what stream() gave may be cast from
/// by all until the next call.
class StoreRays {
 public:
  StoreRays();
  ~StoreRays();
  const RayStream& stream(const Store& store, MaskKind kind);
  /// For rays of one direction; those of the last one asked for are kept.
  const ParallelRays& parallel(const Store& store, MaskKind kind, const Vec3d& direction);
  size_t bytes() const;

 private:
  uint64_t store_ = 0;  // identity of the store followed
  int subscriber_ = 0;
  std::unique_ptr<RayStream> streams_[kMaskKinds];
  std::unique_ptr<ParallelRays> parallel_[kMaskKinds];
};

}  // namespace world
