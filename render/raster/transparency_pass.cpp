#include "render/raster/transparency_pass.h"

#include <algorithm>

#include "render/raster/culling.h"
#include "render/raster/stopwatch.h"

namespace render::raster {

std::vector<Constant> layer_constants(const Drawing& drawing, const LayerDraws& draws,
                                      std::initializer_list<Constant> more) {
  std::vector<Constant> all = shading_constants(drawing);
  all.push_back({kSpecExactEdges, drawing.knobs.face_edges == FaceEdges::exact});
  all.push_back({kSpecLayerMatte, draws.matte});
  all.push_back({kSpecLayerEmits, draws.emits});
  all.push_back({kSpecBodies, !drawing.inhabitants.bodies.empty()});
  all.push_back({kSpecShapes, !drawing.shapes.chunks().empty()});
  all.push_back({kSpecShapeCodes, draws.shape_codes});
  all.push_back({kSpecEyeInAir, draws.eye_in_air});
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

void begin_clearing_colour(VkCommandBuffer commands, const Targets& targets, std::span<const VkImageView> colour,
                           VkImageView depth) {
  begin_rendering(commands, targets, colour, depth, false);
  std::vector<VkClearAttachment> clears(colour.size());
  for (uint32_t i = 0; i < clears.size(); ++i) clears[i] = {VK_IMAGE_ASPECT_COLOR_BIT, i, {}};
  const VkClearRect whole{{{0, 0}, targets.extent()}, 0, 1};
  vkCmdClearAttachments(commands, static_cast<uint32_t>(clears.size()), clears.data(), 1, &whole);
}

void LayerDraws::record(VkCommandBuffer commands, PassContext& context, const Pipeline& pipeline) const {
  vkCmdBindIndexBuffer(commands, indices->handle, 0, VK_INDEX_TYPE_UINT32);
  for (uint32_t page = 0; page < pool->pages(); ++page) {
    bool bound = false;
    for (const Run& run : runs) {
      if (run.page != page) continue;
      if (!bound) {
        context.bindings.bind(kBindLayerFaces, pool->page(page));
        context.bindings.use(commands, pipeline);
        bound = true;
      }
      vkCmdDrawIndexed(commands, run.count * 6, 1, 0, static_cast<int32_t>(run.first * 4), run.chunk);
    }
  }
}

PassKind TransparencyPass::kind() {
  return {"transparency",
          [](const Drawing& drawing, TargetNeeds& needs) {
            if (drawing.knobs.transparency == Transparency::opaque) return false;
            if (drawing.behind) {
              needs.colour = true;  // the same targets as the picture that it is for
              return false;
            }
            const bool mirrors = drawing.knobs.reflection != Reflection::none && calls_for_mirrors(drawing.view);
            if (!mirrors && !calls_for_see_through(drawing.view)) return false;
            needs.colour = true;
            return true;
          },
          []() -> std::unique_ptr<Pass> { return std::make_unique<TransparencyPass>(); }};
}

world::Status TransparencyPass::fit(PassContext&) {
  fits_ = false;
  return {};
}

void TransparencyPass::rest() {
  faces_.clear();
  levels_ = {};
  pool_.clear();
  order_.reset();
  any_ = false;
  ordered_by_ = Transparency::opaque;
  store_ = grid_store_ = 0;
  draws_ = {};
  grid_.clear();
  indices_ = {}, chunks_ = {}, blocks_ = {}, constants_ = {}, block_kinds_ = {};
  indexed_records_ = 0;
}

std::vector<world::LeafPos> TransparencyPass::follow(const Drawing& drawing) {
  const world::Store& store = drawing.view.store();
  kinds_.emplace(drawing.view.palette());
  if (store_ != store.identity()) {
    subscriber_ = store.subscribe();
    store.take_dirty(subscriber_);
    store_ = store.identity();
    merged_ = !drawing.knobs.merge_faces;
  }
  std::vector<world::LeafPos> dirty = store.take_dirty(subscriber_);
  const std::vector<world::LeafPos> moved =
      levels_.follow(drawing.view, drawing.knobs.liquid_surface != LiquidSurface::full);
  if (!moved.empty()) {
    dirty.insert(dirty.end(), moved.begin(), moved.end());
    std::sort(dirty.begin(), dirty.end());
    dirty.erase(std::unique(dirty.begin(), dirty.end()), dirty.end());
  }
  if (merged_ != drawing.knobs.merge_faces)
    faces_.rebuild(drawing.view, *kinds_, merged_ = drawing.knobs.merge_faces, &levels_);
  else
    faces_.update(drawing.view, *kinds_, dirty, &levels_);
  return dirty;
}

world::Status TransparencyPass::follow_blocks(PassContext& context, const Drawing& drawing,
                                              std::span<const world::LeafPos> dirty, LayerConstants& constants) {
  const world::BlockPalette& palette = drawing.view.palette();
  const bool shaped = drawing.knobs.proxy_shapes != ProxyShapes::cube;
  std::vector<uint32_t> kinds;
  const auto add = [&](world::BlockId block, uint32_t level) {
    const bool open = block == world::kAir || (shaped && !palette[block].proxy.empty());  // a shape leaves its voxel so
    kinds.push_back(open ? 0 : kinds_->contains(block) ? kinds_->kind(block) : kKindSolid);
    kinds.push_back((is_mirror(palette[block]) ? 1u : 0u) | level << kKindLevelShift |
                    uint32_t{block} << kKindBlockShift);
  };
  for (size_t id = 0; id < palette.size(); ++id) add(static_cast<world::BlockId>(id), 0);
  // Codes of liquids by level; of more than there are numbers for the last ones count as full.
  const bool leveled = levels_.any();
  std::vector<uint32_t> first_code(leveled ? palette.size() : 0);
  for (size_t id = 0; id < first_code.size(); ++id) {
    const auto block = static_cast<world::BlockId>(id);
    if (palette[block].phase != world::Phase::liquid || kinds.size() / 2 + kFullLevel > kShapeCode) continue;
    first_code[id] = static_cast<uint32_t>(kinds.size() / 2) - 1;
    for (uint32_t level = 1; level < kFullLevel; ++level) add(block, level);
  }
  TRY_STATUS(context.fill_texels(block_kinds_, VK_FORMAT_R32G32_UINT, kinds.data(), kinds.size() * 4));
  context.bindings.bind(kBindBlockKinds, block_kinds_);
  draws_.shape_codes = false;
  if (!order_->needs_block_grid(drawing)) {
    grid_.clear();
    grid_store_ = 0;
    for (const uint32_t binding : {kBindBlockRegions, kBindBlockLeaves, kBindBlockIds})
      context.bindings.forget(binding);
    return {};
  }
  // What runs straight ends where the block does, with a shape there or not.
  const bool follows_rays = drawing.knobs.transparency == Transparency::lists && palette.size() <= kShapeCode;
  const ShapeExtractor* const shapes = follows_rays ? drawing.block_shapes : nullptr;
  const uint64_t shapes_named = shapes ? shapes->rebuilds() : 0;
  const bool whole = grid_store_ != store_ || leveled != grid_has_levels_ || shapes_named != grid_shapes_;
  grid_store_ = 0;  // until all is there
  grid_has_levels_ = leveled;
  grid_shapes_ = shapes_named;
  draws_.shape_codes = shapes != nullptr;
  BlockGrid::CodeLeaf code;
  if (leveled || shapes)
    code = [&](world::StoreReader& reader, world::LeafPos leaf, const world::LeafBlocks& of,
               BlockGrid::LeafCodes& codes) {
      const LiquidLevels::Leaf* const levels = levels_.leaf(leaf);
      for (size_t i = 0; i < codes.size(); ++i) {
        const world::BlockId id = of[static_cast<int>(i)];
        codes[i] = id;
        const uint32_t level = levels ? (*levels)[i] : uint32_t{kFullLevel};
        if (level < kFullLevel && first_code[id]) codes[i] = static_cast<uint16_t>(first_code[id] + level);
        if (!shapes || !shapes->shapes().shape[id]) continue;
        const world::VoxelPos voxel = voxel_from_leaf(leaf) + world::offset_in_leaf(static_cast<int>(i));
        const uint32_t first = shapes->first_quad_at(reader, voxel, id);
        codes[i] = first < kShapeCode ? static_cast<uint16_t>(kShapeCode + first) : 0;
      }
    };
  auto sent = grid_.follow(context.device, drawing.view, dirty, whole, code);
  if (!sent.ok()) return sent.error();
  grid_store_ = store_;
  const world::RegionPos low = grid_.min_region(), high = grid_.max_region();
  constants.eye.z = static_cast<int>(grid_.table_size()) - 1;
  constants.region_min = ivec4(low.x, low.y, low.z, 0);
  constants.region_max = ivec4(high.x, high.y, high.z, 0);
  context.bindings.bind(kBindBlockRegions, grid_.regions());
  context.bindings.bind(kBindBlockLeaves, grid_.leaves());
  context.bindings.bind(kBindBlockIds, grid_.ids());
  return {};
}

world::Status TransparencyPass::fit_indices(PassContext& context) {
  if (indexed_records_ && indexed_records_ >= pool_.largest_chunk()) return {};
  const uint32_t records = std::max(1024u, pool_.largest_chunk() + pool_.largest_chunk() / 2);
  TRY(indices_, gpu::make_buffer(context.device, uint64_t{records} * 24, VK_BUFFER_USAGE_INDEX_BUFFER_BIT,
                                 gpu::MemoryUse::upload));
  fill_quad_indices(indices_, records);
  indexed_records_ = records;
  return {};
}

void TransparencyPass::cull(const Drawing& drawing) {
  draws_.runs.clear();
  draws_.chunks.clear();
  draws_.extracted.clear();
  draws_.faces = 0;
  struct Seen {
    const PooledChunk* chunk;
    const ExtractedChunk* extracted;
    double distance;
    Vec3d corner;
  };
  std::vector<Seen> seen;
  const Frustum frustum(drawing.rays);
  const auto box_corner = [](const std::array<uint8_t, 3>& p) { return Vec3d(p[0], p[1], p[2]); };
  for (size_t i = 0; i < pool_.chunks().size(); ++i) {
    const PooledChunk& chunk = pool_.chunks()[i];  // in the order of faces_.chunks()
    const world::VoxelPos offset = chunk.origin - drawing.camera.position.voxel;
    const Vec3d corner = Vec3d(offset.x, offset.y, offset.z) - drawing.camera.position.fraction;
    const Vec3d low = corner + box_corner(chunk.box.min), high = corner + box_corner(chunk.box.max);
    const double distance = distance_to_box(low, high);
    if (distance <= drawing.knobs.view_distance && frustum.side(low, high) != Frustum::outside)
      seen.push_back({&chunk, faces_.chunks()[i], distance, corner});
  }
  std::sort(seen.begin(), seen.end(), [](const Seen& a, const Seen& b) {
    return a.distance != b.distance ? a.distance < b.distance : a.chunk->origin < b.chunk->origin;
  });
  for (const Seen& s : seen) {
    const world::VoxelPos offset = s.chunk->origin - drawing.camera.position.voxel;
    const uint32_t index = static_cast<uint32_t>(draws_.chunks.size());
    draws_.chunks.emplace_back(offset.x, offset.y, offset.z, 0);
    draws_.extracted.push_back(s.extracted);
    const FaceCluster* last = nullptr;
    for (const FaceCluster& cluster : s.chunk->clusters) {
      if (frustum.side(s.corner + box_corner(cluster.box.min), s.corner + box_corner(cluster.box.max)) ==
          Frustum::outside)
        continue;
      draws_.faces += cluster.count;
      if (last && last->first + last->count == cluster.first)
        draws_.runs.back().count += cluster.count;
      else
        draws_.runs.push_back({s.chunk->page, cluster.first, cluster.count, index});
      last = &cluster;
    }
  }
}

world::Status TransparencyPass::prepare(PassContext& context, const Drawing& drawing, FrameReport& report) {
  Stopwatch watch;
  const std::vector<world::LeafPos> dirty = follow(drawing);
  report.passes.push_back({"extract_see_through", watch.lap_ms(), 0, 0});
  TRY(const uint64_t sent, pool_.update(context.device, pool_sources(faces_.chunks())));
  TRY_STATUS(fit_indices(context));
  cull(drawing);
  draws_.pool = &pool_;
  draws_.indices = &indices_;
  const world::Census census = drawing.view.store().census();
  draws_.matte = kinds_->calls_for_matte(census);
  draws_.emits = std::any_of(census.begin(), census.end(), [&](const auto& row) {
    const vec4& emitted = kinds_->of(row.first).emitted;
    return emitted.x != 0 || emitted.y != 0 || emitted.z != 0;
  });

  if (ordered_by_ != drawing.knobs.transparency || !order_) {
    order_ = drawing.knobs.transparency == Transparency::weighted ? make_weighted_order()
             : drawing.knobs.transparency == Transparency::sorted ? make_sorted_order()
                                                                  : make_list_order();
    ordered_by_ = drawing.knobs.transparency;
    fits_ = false;
  }
  if (!fits_) TRY_STATUS(order_->fit(context));
  fits_ = true;

  const auto& blocks = kinds_->blocks();
  static_assert(sizeof blocks[0] == kLayerBlockTexels * sizeof(vec4));
  TRY_STATUS(
      context.fill_texels(blocks_, VK_FORMAT_R32G32B32A32_UINT, blocks.data(), blocks.size() * sizeof blocks[0]));
  TRY_STATUS(context.fill_texels(chunks_, VK_FORMAT_R32G32B32A32_SINT, draws_.chunks.data(),
                                 draws_.chunks.size() * sizeof(ivec4)));
  LayerConstants constants{};
  const world::WorldPoint& eye = drawing.camera.position;
  constants.eye.x = levels_.above_surface(eye) ? 0 : kinds_->kind(drawing.view.store().get(eye.voxel));
  draws_.eye_in_air = constants.eye.x == 0 && drawing.knobs.reflection == Reflection::none;
  constants.mirror.x = -1;
  any_ = !draws_.runs.empty() || constants.eye.x != 0 || drawing.knobs.reflection != Reflection::none;
  // The vertex shader names both ways to read records; an order binds what it draws.
  context.bindings.forget(kBindLayerFaces);
  context.bindings.forget(kBindLayerSorted);
  TRY_STATUS(follow_blocks(context, drawing, dirty, constants));
  TRY_STATUS(order_->prepare(context, drawing, draws_, constants));
  TRY_STATUS(context.fill(constants_, &constants, sizeof constants, VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT));
  context.bindings.bind(kBindLayerBlocks, blocks_);
  context.bindings.bind(kBindLayerChunks, chunks_);
  context.bindings.bind(kBindLayerConstants, constants_);
  report.passes.push_back({"upload_see_through", watch.lap_ms(), 0, sent});
  return {};
}

void TransparencyPass::record(VkCommandBuffer commands, PassContext& context, const Drawing& drawing) {
  if (!any_) return;
  image_barrier(commands, context.targets.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT, kDepthReadWrite, kDepthReadWrite);
  memory_barrier(commands, kComputeWrite, kComputeReadWrite);  // of the shaded picture
  order_->record(commands, context, drawing, draws_);
}

world::Status TransparencyPass::finish(PassContext& context, FrameReport& report) {
  PassReport& row = row_of(report, "transparency");
  row.draws = draws_.runs.size();
  row.bytes = draws_.faces * sizeof(FaceRecord);
  report.faces_drawn += draws_.faces;
  return any_ ? order_->finish(context, report) : world::Status();
}

}  // namespace render::raster
