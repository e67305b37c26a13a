/// Embree on the visible faces of a world, merged into rectangles: what a renderer with a triangle caster would do.
///
/// Its rays are turned into its own layout beforehand, so that only the casting is timed. Sealed cavities are left out
/// of the geometry (no ray of the benchmark gets into one), so Embree gets the fewest faces that give its answers.
#pragma once

#include <memory>
#include <span>

#include "render/extract/extractor.h"
#include "tools/bench/ray_sets.h"
#include "world/world.h"

namespace tools {

enum class EmbreeShape { quads, triangles };
enum class EmbreeQuality { medium, high };

/// How rays are handed over: one by one, in packets, or as a stream of 4096 single rays (rtcIntersect1M).
enum class EmbreeWidth { one, eight, sixteen, stream };
enum class EmbreeHint { incoherent, coherent };

/// The faces of a world, or of a shape, before Embree sees them.
struct EmbreeFaces {
  std::vector<world::Vec3f> corners;  // four a rectangle, counter-clockwise seen from outside
};
EmbreeFaces embree_faces(const world::World& world);

/// A shape put somewhere, as it is.
struct EmbreeInstance {
  size_t shape = 0;  // index into the shapes given
  world::Vec3f offset{0};
};

class EmbreeRays {
 public:
  EmbreeRays(const EmbreeFaces& faces, EmbreeShape shape, EmbreeQuality quality);
  /// Faces that are there once, and shapes as instances; triangles, medium quality.
  EmbreeRays(const EmbreeFaces& once, std::span<const EmbreeFaces> shapes, std::span<const EmbreeInstance> instances);
  ~EmbreeRays();
  /// One instance more, and the tree over all of them built anew.
  void place(const EmbreeInstance& instance);

  struct Loaded;  // rays in Embree's own layout
  static std::shared_ptr<const Loaded> load(std::span<const BenchRay> rays);

  /// Casts all rays on the threads that the row allows, hits into a buffer of each task. Returns how many there were.
  double first_hits(const Loaded& rays, EmbreeWidth width, EmbreeHint hint) const;
  /// Only whether anything is hit.
  double any_hits(const Loaded& rays, EmbreeWidth width, EmbreeHint hint) const;

  /// By rtcIntersect1. Where a ray passes an edge, floats may decide for the other voxel.
  std::vector<RayAnswer> answers(std::span<const BenchRay> rays) const;
  /// By rtcIntersect1; infinite where nothing is hit.
  std::vector<float> distances(std::span<const BenchRay> rays) const;
  size_t bytes() const;  // what Embree says it holds, vertices included

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// A world that is edited: a scene for each chunk of 64^3, built at Embree's fastest, as instances of one scene. An
/// edit builds the chunk's scene anew, and the tree over the instances.
class EmbreeChunks {
 public:
  explicit EmbreeChunks(const render::Extractor& extractor);
  ~EmbreeChunks();
  /// Takes over the chunks that changed since.
  void update(const render::Extractor& extractor);
  RayAnswer first_hit(const BenchRay& ray) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tools
