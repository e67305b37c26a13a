#include "render/raster/mirror_stencil_pass.h"

#include <algorithm>
#include <utility>

#include "mirror_seen.frag.spv.h"
#include "mirror_stencil.vert.spv.h"
#include "stencil.frag.spv.h"
#include "whole.vert.spv.h"
#include "render/see_through.h"

namespace render::raster {

PassKind MirrorStencilPass::kind() {
  return {"mirror_stencil",
          [](const Drawing& drawing, TargetNeeds&) {
            // Kept through the eye's picture, for the next one in the mirror.
            return (drawing.behind && !drawing.whole_mirror) || drawing.mirrored;
          },
          []() -> std::unique_ptr<Pass> { return std::make_unique<MirrorStencilPass>(); }};
}

world::Status MirrorStencilPass::open(PassContext&) { return {}; }
world::Status MirrorStencilPass::fit(PassContext& context) { return fit_stencil(context); }

void MirrorStencilPass::follow(const world::WorldView& view, const MirrorPlane& plane) {
  if (store_ != view.store().identity()) {
    store_ = view.store().identity(), subscriber_ = view.store().subscribe();
    plane_ = {-1, 0, 0};
  }
  const bool edited = !view.store().take_dirty(subscriber_).empty();
  if (!edited && plane_.axis == plane.axis && plane_.plane == plane.plane) return;
  plane_ = plane;
  const world::MaskVolume& occupied = view.masks(world::MaskKind::occupied);
  const SeeThroughKinds kinds(view.palette());
  std::vector<uint8_t> mirrors(view.palette().size());
  for (size_t i = 0; i < mirrors.size(); ++i) {
    const auto id = static_cast<world::BlockId>(i);
    mirrors[i] = kinds.contains(id) || is_mirror(view.palette()[id]);
  }

  // Which leaves hold any on either side of the plane.
  std::vector<std::pair<int32_t, int32_t>> found;  // v, u
  world::StoreReader reader(view.store());
  const int axis = plane.axis, axis_u = (axis + 1) % 3, axis_v = (axis + 2) % 3;
  for (const int32_t layer : {plane.plane - 1, plane.plane})
    for (const world::MaskRegion* region : occupied.regions()) {
      const int32_t at[3] = {region->pos.x, region->pos.y, region->pos.z};
      if (at[axis] != layer >> 7) continue;
      for (int i = 0; i < 256; ++i) {
        int32_t leaf_at[3];
        leaf_at[axis] = layer >> 3, leaf_at[axis_u] = at[axis_u] * 16 + (i & 15),
        leaf_at[axis_v] = at[axis_v] * 16 + (i >> 4);
        const world::LeafPos leaf{leaf_at[0], leaf_at[1], leaf_at[2]};
        if (!region->leaf_any(leaf)) continue;
        const world::LeafBlocks blocks = reader.leaf(leaf);
        bool any = !blocks.values && mirrors[blocks.uniform];
        for (int k = 0; k < 64 && !any && blocks.values; ++k) {
          int in_leaf[3];
          in_leaf[axis] = layer & 7, in_leaf[axis_u] = k & 7, in_leaf[axis_v] = k >> 3;
          any = mirrors[blocks.values[in_leaf[0] * 64 + in_leaf[1] * 8 + in_leaf[2]]] != 0;
        }
        if (any) found.emplace_back(leaf_at[axis_v], leaf_at[axis_u]);
      }
    }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  strips_.clear();
  for (const auto& [v, u] : found) {
    if (!strips_.empty() && strips_.back().v == v && strips_.back().u1 == u)
      ++strips_.back().u1;
    else
      strips_.push_back({u, u + 1, v});
  }
}

world::Status MirrorStencilPass::prepare(PassContext& context, const Drawing& drawing, FrameReport&) {
  drawn_ = 0;
  if (!drawing.behind) return {};
  if (!pipeline_) {
    TRY(pipeline_,
        make_graphics(context.device, mirror_stencil_vert_spv, stencil_frag_spv, into_stencil(context.targets)));
    GraphicsState counted = where_stencil(context.targets, 1);
    counted.stencil_op.passOp = VK_STENCIL_OP_INCREMENT_AND_CLAMP, counted.stencil_op.writeMask = 0xff;
    TRY(seen_, make_graphics(context.device, whole_vert_spv, mirror_seen_frag_spv, counted));
  }
  follow(drawing.view, *drawing.behind);
  // Relative to the camera, as its voxel and a fraction.
  const world::WorldPoint& eye = drawing.camera.position;
  const int axis_u = (plane_.axis + 1) % 3, axis_v = (plane_.axis + 2) % 3;
  const auto from_eye = [&](int axis, int32_t leaf) {
    return static_cast<float>(double(leaf) * 8 - eye.voxel[axis] - eye.fraction[axis]);
  };
  std::vector<vec4> strips;
  for (const Strip& s : strips_)
    strips.emplace_back(from_eye(axis_u, s.u0), from_eye(axis_v, s.v), from_eye(axis_u, s.u1),
                        from_eye(axis_v, s.v + 1));
  TRY_STATUS(
      context.fill(strips_buffer_, strips.data(), strips.size() * sizeof(vec4), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT));
  context.bindings.bind(kBindMirrorStrips, strips_buffer_);
  drawn_ = static_cast<uint32_t>(strips.size());
  return {};
}

void MirrorStencilPass::record(VkCommandBuffer commands, PassContext& context, const Drawing& drawing) {
  if (!drawing.behind) return;
  discard_stencil(commands, context.targets);
  image_barrier(commands, context.targets.seen.handle, VK_IMAGE_ASPECT_COLOR_BIT, kColourReadWrite, kFragmentRead);
  begin_with_stencil(commands, context.targets, {}, true, false);
  context.bindings.use(commands, pipeline_);
  if (drawn_) vkCmdDraw(commands, 6, 5 * drawn_, 0, 0);
  context.bindings.use(commands, seen_);
  vkCmdDraw(commands, 3, 1, 0, 0);
  vkCmdEndRendering(commands);
  stencil_barrier(commands, context.targets);
}

world::Status MirrorStencilPass::finish(PassContext&, FrameReport& report) {
  row_of(report, "mirror_stencil").draws = drawn_ > 0;
  return {};
}

}  // namespace render::raster
