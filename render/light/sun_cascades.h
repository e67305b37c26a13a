/// Maps of the sun in cascades around the eye (sun_cascades.shared.h), made by rays through the grid: fine texels near
/// the eye and coarse ones far off, in the memory of a few maps whatever the size of the world.
///
/// knobs   sun_map_cascades, sun_cascade_texels, sun_map_split, view_distance
/// cost    4 bytes a texel; a coherent ray for each texel that comes into a cascade as the eye moves, and for each that
///         an edited leaf throws its shadow on
/// error   as of SunMap, with the texel of the cascade at hand
#pragma once

#include <array>
#include <span>
#include <vector>

#include "render/knobs.h"
#include "render/light/sun_cascades.shared.h"
#include "render/light/sun_map.shared.h"
#include "world/store/ray_stream.h"
#include "world/world.h"

namespace render {

/// The ends of `count` cascades from near to far, m: for each the mean of a logarithmic split and an even one, `split`
/// of the first.
std::vector<double> sun_cascade_ends(int count, double near, double far, double split);

class SunCascades {
 public:
  /// Makes the texels that the eye's place, the sun, the knobs or edits call for. Fails where a knob can't be.
  /// `opaque`: of what throws shadows; `moved`: leaves of it that changed, beside those of the store.
  world::Status follow(const world::WorldView& view, const world::RayStream& opaque, const world::WorldPoint& eye,
                       const RenderKnobs& knobs, const world::Vec3d& sun, std::span<const world::LeafPos> moved = {});
  void clear();

  /// As SunMap::lit(). All light beyond the last cascade.
  float lit(const world::WorldPoint& point, float cosine, int filter = 1) const;

  int count() const { return static_cast<int>(cascades_.size()); }
  double texel(int cascade) const { return cascades_[static_cast<size_t>(cascade)].texel; }
  double reach(int cascade) const { return cascades_[static_cast<size_t>(cascade)].reach; }
  const shared::SunMapFrame& frame() const { return frame_; }
  /// As sun_cascades.shared.h lays them out; empty where there is no map.
  std::span<const float> words() const { return words_; }
  /// Runs of words that the last follow() wrote anew.
  struct Run {
    size_t first, count;
  };
  std::span<const Run> changed() const { return changed_; }
  /// Rays that the last follow() cast.
  uint64_t cast() const { return cast_; }
  uint64_t version() const { return version_; }
  size_t bytes() const { return words_.capacity() * sizeof(float); }

 private:
  struct Cascade {
    double texel = 0, reach = 0;
    int low_x = 0, low_y = 0;  // the first texels that it holds
    bool made = false;
  };
  struct Rectangle {
    int x0, y0, x1, y1;  // texels; the last ones are left out
  };
  world::Vec3d in_light(const world::WorldPoint& p) const;
  float lit_in(int cascade, const glm::vec3& place, float cosine, int filter) const;
  void make(const world::RayStream& opaque, int cascade, Rectangle texels);
  void move(const world::RayStream& opaque, int cascade, int low_x, int low_y);
  void make_below(const world::RayStream& opaque, std::span<const world::LeafPos> leaves);

  std::vector<Cascade> cascades_;
  std::vector<float> words_;
  std::vector<Run> changed_;
  shared::SunMapFrame frame_{};
  world::Vec3d u_{0}, v_{0}, w_{0};
  world::VoxelPos origin_;
  double first_ = 0, last_ = 0;  // depths between which the world lies, m
  int side_ = 0;                 // texels
  std::array<float, 4> made_for_{};
  world::Vec3d sun_{0.0};
  uint64_t version_ = 0, cast_ = 0, store_ = 0, blocks_ = 0;
  int subscriber_ = 0;
};

}  // namespace render
