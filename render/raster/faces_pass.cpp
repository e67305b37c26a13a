#include "render/raster/faces_pass.h"

#include <algorithm>

#include "faces.frag.spv.h"
#include "faces.vert.spv.h"
#include "shapes.frag.spv.h"
#include "shapes.vert.spv.h"
#include "render/raster/stopwatch.h"

namespace render::raster {

namespace {

/// A near plane below this makes interpolated depth too coarse for the occlusion test, m.
constexpr double kNearestForOcclusion = 0.005;

}  // namespace

PassKind FacesPass::kind() {
  return {"faces", [](const Drawing&, TargetNeeds&) { return true; },
          []() -> std::unique_ptr<Pass> { return std::make_unique<FacesPass>(); }};
}

world::Status FacesPass::open(PassContext& context) { return occlusion_.open(context); }

world::Status FacesPass::fit(PassContext& context) { return occlusion_.fit(context); }

world::Status FacesPass::fit_indices(PassContext& context, uint32_t largest) {
  if (indexed_records_ && indexed_records_ >= largest) return {};
  const uint32_t records = std::max(4096u, largest + largest / 2);
  TRY(indices_, gpu::make_buffer(context.device, uint64_t{records} * 24, VK_BUFFER_USAGE_INDEX_BUFFER_BIT,
                                 gpu::MemoryUse::upload));
  auto* index = reinterpret_cast<uint32_t*>(indices_.mapped());
  for (uint32_t r = 0; r < records; ++r)
    for (const uint32_t corner : {0u, 1u, 2u, 2u, 1u, 3u}) *index++ = 4 * r + corner;
  indexed_records_ = records;
  return {};
}

world::Result<const Pipeline*> FacesPass::pipeline(PassContext& context, FaceEdges edges, bool shapes) {
  Pipeline& found = pipelines_[{edges, shapes}];
  if (!found) {
    const Constant exact{kSpecExactEdges, edges == FaceEdges::exact};
    const GraphicsState state{.colour = {kSeenFormat}, .depth = kDepthFormat};
    TRY(found, shapes ? make_graphics(context.device, shapes_vert_spv, shapes_frag_spv, state, {&exact, 1})
                      : make_graphics(context.device, faces_vert_spv, faces_frag_spv, state, {&exact, 1}));
  }
  return &found;
}

world::Status FacesPass::prepare(PassContext& context, const Drawing& drawing, FrameReport& report) {
  pool_ = &drawing.faces;
  shape_pool_ = &drawing.shapes;
  TRY_STATUS(fit_indices(context, std::max(pool_->largest_chunk(), shape_pool_->largest_chunk())));
  TRY(cubes_, pipeline(context, drawing.knobs.face_edges, false));
  shapes_ = nullptr;
  std::vector<CulledPool> pools{{pool_}};
  if (!shape_pool_->chunks().empty()) {
    TRY(shapes_, pipeline(context, drawing.knobs.face_edges, true));
    TRY_STATUS(table_.prepare(context, drawing));
    pools.push_back({shape_pool_, kMostShapeChunks});
  }
  Stopwatch watch;
  cull(pools, drawing.camera, drawing.rays, drawing.knobs.view_distance, drawing.near >= kNearestForOcclusion, list_);
  report.passes.push_back({"cull", watch.lap_ms(), 0, 0});
  TRY_STATUS(context.fill(chunks_, list_.chunks.data(), list_.chunks.size() * sizeof(ChunkCorner),
                          VK_BUFFER_USAGE_STORAGE_BUFFER_BIT));
  TRY_STATUS(context.fill(draws_, list_.draws.data(), list_.draws.size() * sizeof(VkDrawIndexedIndirectCommand),
                          VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT | VK_BUFFER_USAGE_STORAGE_BUFFER_BIT));
  context.bindings.bind(kBindChunks, chunks_);
  if (!list_.candidates.empty()) TRY_STATUS(occlusion_.prepare(context, list_.candidates, draws_));
  return {};
}

void FacesPass::record_draws(VkCommandBuffer commands, PassContext& context, bool second) {
  const VkImageView seen = context.targets.seen.view;
  begin_rendering(commands, context.targets, {&seen, 1}, context.targets.depth.view, !second);  // 0: sees no face
  vkCmdBindIndexBuffer(commands, indices_.handle, 0, VK_INDEX_TYPE_UINT32);
  constexpr uint32_t kDrawBytes = sizeof(VkDrawIndexedIndirectCommand);
  uint32_t draw = second && !list_.first_end.empty() ? list_.first_end.back() : 0;
  const std::vector<uint32_t>& ends = second ? list_.second_end : list_.first_end;
  for (size_t page = 0; page < ends.size(); ++page) {
    if (draw == ends[page]) continue;
    const bool shapes = page >= pool_->pages();
    context.bindings.bind(kBindFaces, shapes ? shape_pool_->page(page - pool_->pages()) : pool_->page(page));
    context.bindings.use(commands, shapes ? *shapes_ : *cubes_);
    while (draw < ends[page]) {
      const uint32_t some = std::min(ends[page] - draw, context.device.limits().maxDrawIndirectCount);
      vkCmdDrawIndexedIndirect(commands, draws_.handle, uint64_t{draw} * kDrawBytes, some, kDrawBytes);
      draw += some;
    }
  }
  vkCmdEndRendering(commands);
}

void FacesPass::record(VkCommandBuffer commands, PassContext& context, const Drawing&) {
  record_draws(commands, context, false);
  if (list_.candidates.empty()) return;
  context.times.mark(commands, "occlusion");
  occlusion_.record(commands, context);
  context.times.mark(commands, "faces_uncovered");
  image_barrier(commands, context.targets.seen.handle, VK_IMAGE_ASPECT_COLOR_BIT, kColourReadWrite, kColourReadWrite);
  record_draws(commands, context, true);
}

world::Status FacesPass::finish(PassContext&, FrameReport& report) {
  PassReport& first = row_of(report, "faces");
  first.draws = list_.first_end.empty() ? 0 : list_.first_end.back();
  first.bytes = list_.first_faces * sizeof(FaceRecord);
  report.faces_drawn += list_.first_faces;
  if (list_.candidates.empty()) return {};
  // What the occlusion test said decides what the next picture draws first.
  row_of(report, "occlusion").bytes = list_.candidates.size() * sizeof(Candidate);
  PassReport& second = row_of(report, "faces_uncovered");
  const auto visible = occlusion_.visible();
  for (size_t i = 0; i < list_.candidates.size(); ++i) {
    list_.clusters[i]->visible = visible[i] != 0;
    if (!visible[i] || list_.candidates[i].draw < 0) continue;
    second.bytes += list_.clusters[i]->count * sizeof(FaceRecord);
    report.faces_drawn += list_.clusters[i]->count;
    ++second.draws;
  }
  return {};
}

}  // namespace render::raster
