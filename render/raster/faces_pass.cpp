#include "render/raster/faces_pass.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "bare.frag.spv.h"
#include "faces.frag.spv.h"
#include "faces.vert.spv.h"
#include "shape_points.frag.spv.h"
#include "shape_points.vert.spv.h"
#include "shapes.frag.spv.h"
#include "shapes.vert.spv.h"
#include "render/raster/stopwatch.h"
#include "render/raster/transparency.shared.h"

namespace render::raster {

namespace {

/// A near plane below this makes interpolated depth too coarse for the occlusion test, m.
constexpr double kNearestForOcclusion = 0.005;

/// Times as large as a knob says for a pipeline's points: where dispatches draw shapes, it pays for larger ones. In the
/// valley at 256 m they take 5.4 ms with 1, 4.0 with 2, 4.4 with 4.
constexpr float kListedPoints = 2;

}  // namespace

PassKind FacesPass::kind() {
  return {"faces", [](const Drawing&, TargetNeeds&) { return true; },
          []() -> std::unique_ptr<Pass> { return std::make_unique<FacesPass>(); }};
}

world::Status FacesPass::open(PassContext& context) { return occlusion_.open(context); }

world::Status FacesPass::fit(PassContext& context) {
  blocks_.forget_targets();
  return occlusion_.fit(context);
}

world::Status FacesPass::fit_indices(PassContext& context, uint32_t largest) {
  if (indexed_records_ && indexed_records_ >= largest) return {};
  const uint32_t records = std::max(4096u, largest + largest / 2);
  TRY(indices_, gpu::make_buffer(context.device, uint64_t{records} * 24, VK_BUFFER_USAGE_INDEX_BUFFER_BIT,
                                 gpu::MemoryUse::upload));
  fill_quad_indices(indices_, records);
  TRY(point_indices_, gpu::make_buffer(context.device, uint64_t{records} * 4, VK_BUFFER_USAGE_INDEX_BUFFER_BIT,
                                       gpu::MemoryUse::upload));
  auto* point = reinterpret_cast<uint32_t*>(point_indices_.mapped());
  std::iota(point, point + records, 0u);
  indexed_records_ = records;
  return {};
}

world::Result<const Pipeline*> FacesPass::pipeline(PassContext& context, const Drawing& drawing, Drawn what,
                                                   bool blends) {
  const FaceEdges edges = drawing.bare ? FaceEdges::hardware : drawing.knobs.face_edges;
  const bool clips = drawing.behind != nullptr;
  Pipeline& found = pipelines_[{edges, what, blends, clips, drawing.bare, drawing.liquid_levels}];
  if (!found) {
    const std::array constants{Constant{kSpecExactEdges, edges == FaceEdges::exact}, Constant{kSpecBlends, blends},
                               Constant{kSpecClips, clips}, Constant{kSpecLiquidLevels, drawing.liquid_levels}};
    GraphicsState state{.colour = {kSeenFormat}, .depth = context.targets.depth_format};
    std::span<const uint32_t> vertex = faces_vert_spv, fragment = faces_frag_spv;
    if (what == Drawn::shapes) vertex = shapes_vert_spv, fragment = shapes_frag_spv;
    if (what == Drawn::points) {
      state.topology = VK_PRIMITIVE_TOPOLOGY_POINT_LIST;
      vertex = shape_points_vert_spv, fragment = shape_points_frag_spv;
    }
    if (drawing.bare) fragment = bare_frag_spv;
    TRY(found, make_graphics(context.device, vertex, fragment, state, constants));
  }
  return &found;
}

world::Status FacesPass::prepare(PassContext& context, const Drawing& drawing, FrameReport& report) {
  Stopwatch watch;
  // Level by level: each is drawn where its error on the screen is small enough.
  const auto distance_of = [&](size_t level) {
    return level_distance(static_cast<int>(level), drawing.rays, drawing.height, drawing.knobs.lod_error_px);
  };
  pools_.clear();
  uint32_t largest = 0;
  for (size_t k = 0; k < drawing.faces.size(); ++k) {
    CulledPool pool{drawing.faces[k], static_cast<int>(k)};
    pool.by_face = true;
    if (k > 0) pool.from = distance_of(k);
    if (k + 1 < drawing.faces.size()) pool.to = distance_of(k + 1);
    pools_.push_back(pool);
    largest = std::max(largest, pool.pool->largest_chunk());
  }
  if (!drawing.trees.pool().chunks().empty()) {
    pools_.push_back({&drawing.trees.pool(), 0, 0, pools_[0].to});
    pools_.back().by_face = true;
    largest = std::max(largest, drawing.trees.pool().largest_chunk());
  }
  const bool may_list = drawing.may_list_faces && blocks_.fits(context) && !drawing.bare && !drawing.behind &&
                        drawing.knobs.face_edges == FaceEdges::exact;
  ListWhere where;
  if (may_list) where = {FaceBlocks::fewest(context), SmallShapes::fits(context)};
  const bool any_shapes = !drawing.shapes.chunks().empty();
  if (any_shapes) {
    // A device without large points draws none.
    const float asked = drawing.knobs.shape_points_px * (where.points ? kListedPoints : 1);
    const float most = std::min(asked, context.device.limits().pointSizeRange[1] / 4);
    CulledPool shapes{&drawing.shapes, 0, 0, pools_[0].to, kMostShapeChunks};
    if (most >= 1 && !drawing.bare)
      shapes.farthest = pixels_at_one_metre(drawing.rays, drawing.height) * kVoxelDiagonal / most;
    pools_.push_back(shapes);
    if (shapes.farthest < kNoNextLevel) {
      shapes.pool = &drawing.shape_points, shapes.points = true;
      shapes.nearest = std::exchange(shapes.farthest, kNoNextLevel);
      pools_.push_back(shapes);
    }
    largest = std::max(largest, drawing.shapes.largest_chunk());
    TRY_STATUS(table_.prepare(context, drawing));
  }
  TRY_STATUS(fit_indices(context, largest));
  watch.lap_ms();
  // What is stored coarsely would hide what it doesn't.
  const bool may_test = drawing.near >= kNearestForOcclusion && context.targets.depth_format == kDepthFormat;
  // Impostors are made in images of the usual format, by the pipeline of faces.
  const bool pictured =
      Impostors::called_for(drawing) && Impostors::fit(context.device) && context.targets.depth_format == kDepthFormat;
  world::Status chosen;
  const bool clouded = Billboards::called_for(drawing) && context.targets.depth_format == kDepthFormat;
  const bool landed = Heightfields::called_for(drawing) && context.targets.depth_format == kDepthFormat;
  TakeChunks take;
  if (landed || pictured || clouded)
    take = [&](std::span<SeenChunk> seen) {
      if (landed) chosen = heightfields_.choose(context, drawing, seen);
      if (!chosen.ok()) return;
      if (pictured) chosen = impostors_.choose(context, drawing, seen);
      if (clouded) billboards_.choose(context, drawing, seen);
    };
  if (!drawing.behind) {  // a picture for a mirror is part of another one
    if (!pictured) impostors_.rest();
    if (!clouded) billboards_.rest();
    if (!landed) heightfields_.rest();
  }
  cull(pools_, drawing.camera, drawing.rays, drawing.knobs.view_distance, may_test, where, list_, take);
  TRY_STATUS(chosen);
  report.passes.push_back({"cull", watch.lap_ms(), 0, 0});
  drawn_by_.clear();
  for (const CulledPool& pool : pools_) {
    const Drawn what = pool.points ? Drawn::points : pool.pool == &drawing.shapes ? Drawn::shapes : Drawn::cubes;
    TRY(const Pipeline* const by, pipeline(context, drawing, what, list_.blends));
    drawn_by_.push_back(by);
  }
  draws_impostors_ = pictured && impostors_.any();
  if (draws_impostors_) {
    TRY(makes_impostors_, pipeline(context, drawing, Drawn::cubes, false));
    TRY_STATUS(impostors_.prepare(context, drawing, list_.blends));
  }
  draws_billboards_ = clouded && billboards_.any();
  if (draws_billboards_) TRY_STATUS(billboards_.prepare(context, list_.blends));
  draws_heightfields_ = landed && heightfields_.any();
  if (draws_heightfields_) TRY_STATUS(heightfields_.prepare(context, list_.blends));
  TRY_STATUS(context.fill_texels(chunks_, VK_FORMAT_R32G32B32A32_SINT, list_.chunks.data(),
                                 list_.chunks.size() * sizeof(ChunkCorner)));
  TRY_STATUS(context.fill(draws_, list_.draws.data(), list_.draws.size() * sizeof(VkDrawIndexedIndirectCommand),
                          VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT | VK_BUFFER_USAGE_STORAGE_BUFFER_BIT));
  context.bindings.bind(kBindChunks, chunks_);
  page_of_.clear();
  for (const CulledPool& pool : pools_)
    for (size_t page = 0; page < pool.pool->pages(); ++page) page_of_.push_back(&pool.pool->page(page));
  if (list_.lists_faces) {
    TRY_STATUS(blocks_.prepare(context, drawing, list_));
    TRY_STATUS(small_shapes_.prepare(context, drawing, list_, blocks_.rows(context)));
  }
  if (!drawing.behind) {  // a picture for a mirror is part of another one
    if (!may_list) blocks_.rest(context);
    if (!where.points || !any_shapes) small_shapes_.rest();
  }
  if (list_.candidates.empty()) return {};
  TRY_STATUS(context.fill(first_indices_, list_.indices.data(), list_.indices.size() * sizeof(uint32_t),
                          VK_BUFFER_USAGE_INDEX_BUFFER_BIT));
  return occlusion_.prepare(context, list_, draws_, list_.lists_faces ? &blocks_.tile_depths() : nullptr);
}

/// clear: to 0, which sees no face.
void FacesPass::record_draws(VkCommandBuffer commands, PassContext& context, bool second, bool clear) {
  const uint32_t of_first = list_.first_end.empty() ? 0 : list_.first_end.back();
  if (!clear && (second ? list_.draws.size() == of_first : of_first == 0)) return;
  const VkImageView seen = context.targets.seen.view;
  begin_rendering(commands, context.targets, {&seen, 1}, context.targets.depth.view, clear);
  constexpr uint32_t kDrawBytes = sizeof(VkDrawIndexedIndirectCommand);
  uint32_t draw = second ? of_first : 0;
  const std::vector<uint32_t>& ends = second ? list_.second_end : list_.first_end;
  size_t page = 0;
  for (size_t p = 0; p < pools_.size(); ++p)
    for (size_t of_pool = 0; of_pool < pools_[p].pool->pages(); ++of_pool, ++page) {
      if (draw == ends[page]) continue;
      const bool listed = pools_[p].by_face && !list_.candidates.empty();
      const gpu::Buffer& indices = listed             ? (second ? occlusion_.second_indices() : first_indices_)
                                   : pools_[p].points ? point_indices_
                                                      : indices_;
      vkCmdBindIndexBuffer(commands, indices.handle, 0, VK_INDEX_TYPE_UINT32);
      context.bindings.bind(kBindFaces, pools_[p].pool->page(of_pool));
      context.bindings.use(commands, *drawn_by_[p]);
      if (second && context.device.counts_draws()) {
        vkCmdDrawIndexedIndirectCount(commands, draws_.handle, uint64_t{draw} * kDrawBytes, occlusion_.counts().handle,
                                      page * sizeof(uint32_t), ends[page] - draw, kDrawBytes);
        draw = ends[page];
      }
      while (draw < ends[page]) {
        const uint32_t some = std::min(ends[page] - draw, context.device.limits().maxDrawIndirectCount);
        vkCmdDrawIndexedIndirect(commands, draws_.handle, uint64_t{draw} * kDrawBytes, some, kDrawBytes);
        draw += some;
      }
    }
  vkCmdEndRendering(commands);
}

/// Faces of cubes and small shapes by dispatches, then what pipelines draw.
void FacesPass::record_blocks(VkCommandBuffer commands, PassContext& context) {
  blocks_.record_first(commands, context, page_of_);
  if (!list_.candidates.empty()) {
    context.times.mark(commands, "occlusion");
    memory_barrier(commands, kComputeWrite, kComputeRead);
    occlusion_.record(commands, context, page_of_);
    context.times.mark(commands, "faces_uncovered");
    blocks_.record_second(commands, context, page_of_);
  }
  small_shapes_.record(commands, context, page_of_);
  blocks_.record_depth(commands, context);
  record_draws(commands, context, false, false);
  if (!list_.candidates.empty()) record_draws(commands, context, true, false);
}

void FacesPass::record(VkCommandBuffer commands, PassContext& context, const Drawing&) {
  if (list_.lists_faces)
    record_blocks(commands, context);
  else
    record_draws(commands, context, false, true);
  if (draws_heightfields_) heightfields_.record(commands, context);
  if (draws_impostors_) impostors_.record(commands, context, *makes_impostors_, indices_);
  if (draws_billboards_) billboards_.record(commands, context, indices_, indexed_records_);
  if (list_.lists_faces || list_.candidates.empty()) return;
  context.times.mark(commands, "occlusion");
  occlusion_.record(commands, context, page_of_);
  context.times.mark(commands, "faces_uncovered");
  image_barrier(commands, context.targets.seen.handle, VK_IMAGE_ASPECT_COLOR_BIT, kColourReadWrite, kColourReadWrite);
  record_draws(commands, context, true, false);
}

world::Status FacesPass::finish(PassContext& context, FrameReport& report) {
  PassReport& first = row_of(report, "faces");
  first.draws = list_.first_end.empty() ? 0 : list_.first_end.back();
  first.bytes = list_.first_faces * sizeof(FaceRecord);
  again_ = list_.lists_faces && !blocks_.finish(context, report);
  report.faces_drawn += list_.first_faces;
  if (list_.lists_faces) small_shapes_.finish(report);
  if (draws_impostors_) impostors_.finish(report);
  if (draws_billboards_) billboards_.finish(report);
  if (draws_heightfields_) heightfields_.finish(report);
  uint64_t hidden = 0;  // by what is drawn
  const CulledFaces& c = list_.culled;
  const uint64_t in_billboards = draws_billboards_ ? billboards_.faces() : 0;
  const uint64_t in_heightfields = draws_heightfields_ ? heightfields_.faces() : 0;
  const auto tell = [&] {
    report.work.insert(report.work.end(), {{"faces_of_the_world", c.world},
                                           {"faces_beyond_view_distance", c.distance},
                                           {"faces_at_coarser_levels", c.detail},
                                           {"faces_outside_the_frustum", c.frustum},
                                           {"faces_looking_away", c.back},
                                           {"faces_of_coarser_levels", c.coarse},
                                           {"faces_in_impostors", c.taken - in_billboards - in_heightfields},
                                           {"faces_in_billboards", in_billboards},
                                           {"faces_in_heightfields", in_heightfields},
                                           {"faces_hidden", hidden}});
    return world::Status();
  };
  if (list_.candidates.empty()) return tell();
  // What the occlusion test said decides what the next picture draws first.
  row_of(report, "occlusion").bytes = list_.candidates.size() * sizeof(Candidate);
  PassReport& second = row_of(report, "faces_uncovered");
  const auto visible = occlusion_.visible();
  for (size_t i = 0; i < list_.candidates.size(); ++i) {
    const Candidate& candidate = list_.candidates[i];
    FaceCluster& cluster = *list_.clusters[i];
    cluster.seen = visible[i];
    RecordBits neither;
    for (size_t word = 0; word < neither.size(); ++word) neither[word] = ~visible[i][word] & ~candidate.drawn[word];
    const uint32_t left_out = cluster.among(neither);
    hidden += left_out;
    const uint32_t drawn = cluster.count - cluster.among(candidate.drawn) - left_out;
    if (drawn == 0) continue;
    second.bytes += drawn * sizeof(FaceRecord);
    report.faces_drawn += drawn;
    ++second.draws;
  }
  return tell();
}

}  // namespace render::raster
