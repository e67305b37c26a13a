#include "render/raster/meshes_pass.h"

#include <algorithm>
#include <numeric>

#include "meshes.frag.spv.h"
#include "meshes.vert.spv.h"
#include "render/raster/transparency.shared.h"

namespace render::raster {

namespace {

/// Longer runs are drawn in parts.
constexpr uint32_t kMostInDraw = 1 << 16;

}  // namespace

PassKind MeshesPass::kind() {
  return {"meshes", [](const Drawing& drawing, TargetNeeds&) { return !drawing.triangles.empty(); },
          []() -> std::unique_ptr<Pass> { return std::make_unique<MeshesPass>(); }};
}

world::Status MeshesPass::prepare(PassContext& context, const Drawing& drawing, FrameReport&) {
  const bool clips = drawing.behind != nullptr;
  if (Pipeline& made = pipelines_[clips]; !made) {
    const Constant constant{kSpecClips, clips};
    TRY(made, make_graphics(context.device, meshes_vert_spv, meshes_frag_spv,
                            {.colour = {kSeenFormat}, .depth = context.targets.depth_format}, {&constant, 1}));
  }
  if (!indices_.handle) {
    TRY(indices_, gpu::make_buffer(context.device, uint64_t{kMostInDraw} * 12, VK_BUFFER_USAGE_INDEX_BUFFER_BIT,
                                   gpu::MemoryUse::upload));
    auto* index = reinterpret_cast<uint32_t*>(indices_.mapped());
    std::iota(index, index + 3 * kMostInDraw, 0u);
  }
  drawing.triangles.cull(drawing.camera, drawing.rays, drawing.knobs.view_distance, runs_);
  bytes_ = drawing.triangles.bytes();
  return {};
}

void MeshesPass::record(VkCommandBuffer commands, PassContext& context, const Drawing& drawing) {
  if (runs_.empty()) return;
  const Targets& targets = context.targets;
  image_barrier(commands, targets.seen.handle, VK_IMAGE_ASPECT_COLOR_BIT, kColourReadWrite, kColourReadWrite);
  image_barrier(commands, targets.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT, kDepthReadWrite | kComputeRead,
                kDepthReadWrite);
  const VkImageView seen = targets.seen.view;
  begin_rendering(commands, targets, {&seen, 1}, targets.depth.view, false);
  vkCmdBindIndexBuffer(commands, indices_.handle, 0, VK_INDEX_TYPE_UINT32);
  context.bindings.use(commands, pipelines_[drawing.behind != nullptr]);
  for (const DrawnTriangles::Run& run : runs_)
    for (uint32_t done = 0; done < run.count; done += kMostInDraw)
      vkCmdDrawIndexed(commands, 3 * std::min(run.count - done, kMostInDraw), 1, 0,
                       static_cast<int32_t>(3 * (run.first + done)), 0);
  vkCmdEndRendering(commands);
}

world::Status MeshesPass::finish(PassContext&, FrameReport& report) {
  PassReport& row = row_of(report, "meshes");
  uint64_t triangles = 0;
  for (const DrawnTriangles::Run& run : runs_) triangles += run.count;
  row.draws = runs_.size();
  row.bytes = bytes_;
  report.work.push_back({"triangles", triangles});
  return {};
}

void MeshesPass::rest() {
  indices_ = {};
  runs_ = {};
}

}  // namespace render::raster
