#include "render/raycast/straight_walk.h"

#include <cmath>

namespace render {

using namespace world;
using glsl::vec3;

GridHit walk_straight(const GridRay& ray, const MaskWalker& occupied, const SeeThroughKinds& kinds, LeafCache& blocks,
                      WalkPlace place, double t_limit, BlockId& medium, std::vector<StraightLayer>& layers,
                      MeetShape meet_shape) {
  const GridAxes axes(ray);
  const GridHit nothing{WalkEnd::t_max, {}, kNoFace, t_limit};
  const auto hit_at = [&] {
    return GridHit{WalkEnd::hit, place.voxel, entered_face(place.axis, axes.upwards[place.axis] != 0), place.t};
  };
  bool at_change = place.axis >= 0 || blocks.level(place.voxel) < kFullLevel;
  for (;;) {
    // On to the next change of block. A voxel of a shape is air.
    while (!at_change) {
      if (medium == kAir && !occupied.volume().test(place.voxel)) {
        if (!occupied.find(axes, place, t_limit)) return nothing;
        break;
      }
      const bool uniform = medium != kAir && blocks.uniform(place.voxel);
      if (!mask_walk::leave_cube(axes, place, uniform ? 7 : 0, t_limit)) return nothing;
      at_change = blocks.get(place.voxel) != medium || blocks.level(place.voxel) < kFullLevel;
    }
    at_change = false;
    const BlockId block = blocks.get(place.voxel);
    if (const int level = blocks.level(place.voxel); level < kFullLevel) {
      // In at a side, a bottom or the air above, and on through the surface.
      const LevelCrossing surface(ray, place.voxel, level);
      const auto pass_into = [&](BlockId next, const GridHit& at) {
        if (next == medium) return true;
        if (next != kAir && !kinds.contains(next)) return false;
        layers.push_back({at, kinds.kind(medium), kinds.kind(next), next > medium});
        medium = next;
        return true;
      };
      if (place.axis >= 0 && !pass_into(surface.in_liquid(place.t, place.axis) ? block : kAir, hit_at()))
        return hit_at();
      WalkPlace next = place;
      const bool leaves = mask_walk::leave_cube(axes, next, 0, t_limit);
      const bool crosses = !surface.crossed(place.t, place.axis) && surface.t() <= t_limit &&
                           (!leaves || surface.crossed(next.t, next.axis));
      if (crosses) {
        // As a crossing of the plane of the grid above.
        GridHit at{WalkEnd::hit, place.voxel, kFacePosY, surface.t()};
        if (surface.rises()) ++at.voxel.y, at.face = kFaceNegY;
        if (!pass_into(surface.rises() ? kAir : block, at)) return at;
      }
      if (!leaves) return nothing;
      place = next;
      at_change = true;
      continue;
    }
    GridHit on_shape;
    const ShapeMeeting meeting = block == kAir ? ShapeMeeting::none : meet_shape(place, block, on_shape);
    const BlockId next = meeting == ShapeMeeting::none ? block : kAir;
    if (next != medium) {
      if (next != kAir && !kinds.contains(next)) return hit_at();
      layers.push_back({hit_at(), kinds.kind(medium), kinds.kind(next), next > medium});
      medium = next;
    }
    if (meeting == ShapeMeeting::met) return on_shape;
  }
}

namespace {

vec3 bands(const Rgb& c) { return {c.r, c.g, c.b}; }

/// What one layer does, with the run of the block beyond, as the two passes of section 14.10.3 take it; and what clouds
/// add before it, of which stays there what doesn't come with the light from behind.
struct Passes {
  vec3 shown, passed, added;
  float near_scale, far_scale;
  vec3 stays() const { return added * (near_scale - passed * far_scale); }
};

}  // namespace

Rgb straight_radiance(const StraightPixel& pixel, const Vec3d& direction, const SeeThroughKinds& kinds,
                      std::span<const StraightLayer> layers, CoveragePattern coverage, bool sorted,
                      FunctionRef<Rgb(const StraightLayer&)> surface, FunctionRef<Rgb(const StraightLayer&)> mirrored,
                      FunctionRef<world::shared::CloudView(float)> clouds) {
  const uint32_t pattern = static_cast<uint32_t>(coverage);
  const std::vector<shared::SeeThroughBlock>& all = kinds.blocks();
  const float n_eye = all[pixel.eye].absorption.w;
  const auto scale_in = [&](uint16_t kind) { return shared::radiance_scale(n_eye, all[kind].absorption.w); };
  thread_local std::vector<Passes> passes;
  passes.clear();
  shared::StraightView view = shared::start_of_view();
  vec3 by_eye(1);  // of the block that the eye is in
  const auto run_before = [&](const shared::SeeThroughBlock& block, float t) {
    (passes.empty() ? by_eye : passes.back().passed) *= shared::absorbed_along(vec3(block.absorption), t - view.t);
    view.t = t;
  };
  for (const StraightLayer& layer : layers) {
    const shared::SeeThroughBlock &owner = all[layer.owner()], &near = all[layer.near];
    const int axis = face_axis(layer.at.face);
    const float cosine = static_cast<float>(std::abs(direction[axis])) / pixel.metres_per_t;
    const shared::InterfaceShares shares =
        interface_shares(owner, n_eye, near.absorption.w, all[layer.far].absorption.w, cosine);
    const float t = static_cast<float>(layer.at.t) * pixel.metres_per_t;
    const vec3 matte = shares.matte > 0 ? bands(surface(layer)) : vec3(0);
    const vec3 from_mirror = shares.mirrored != vec3(0) ? bands(mirrored(layer)) : vec3(0);
    const world::shared::CloudView before = clouds(t);
    uint32_t mask = 0;
    if (coverage != CoveragePattern::exact && owner.matte.w == static_cast<float>(shared::kSeeThroughCoverage)) {
      const int32_t plane = layer.at.voxel[axis] + (layer.at.face & 1);
      mask = shared::coverage_mask(pattern, owner.emitted.w, pixel.x, pixel.y,
                                   static_cast<uint32_t>(plane * 6 + layer.at.face));
    }
    if (sorted) {
      // Each layer by itself: what a view of nothing but it shows and lets through.
      shared::StraightView alone = shared::start_of_view();
      alone.t = t;
      alone = met_interface(alone, owner, shares, vec3(near.absorption), t, from_mirror, matte, layer.outside,
                            shared::kCoverageExact, mask);
      run_before(near, t);
      passes.push_back(
          {before.through * alone.added, alone.through, before.added, scale_in(layer.near), scale_in(layer.far)});
    } else {
      view = met_media(view, vec3(before.through), before.added);
      view = met_interface(view, owner, shares, vec3(near.absorption), t, from_mirror, matte, layer.outside, pattern,
                           mask);
    }
  }
  vec3 seen;
  if (sorted) {
    run_before(all[pixel.end], pixel.t_end);
    const vec3 behind = scale_in(pixel.end) * bands(pixel.behind);
    Colour4 image{behind.x, behind.y, behind.z, 1};
    for (size_t i = passes.size(); i-- > 0;) {
      const Passes& p = passes[i];
      image = blend(kBlendTransmit, {p.passed.x, p.passed.y, p.passed.z, 1}, image);
      const vec3 shown = p.shown + p.stays();
      image = blend(kBlendAdd, {shown.x, shown.y, shown.z, 0}, image);
    }
    seen = by_eye * vec3(image.r, image.g, image.b);
  } else {
    const vec3 added = clouds(pixel.t_end).added;
    view = met_media(view, vec3(1), added);
    seen = end_of_view(view, all[pixel.end], n_eye, pixel.t_end, max(bands(pixel.behind) - added, vec3(0)), pattern);
  }
  return {seen.x, seen.y, seen.z};
}

}  // namespace render
