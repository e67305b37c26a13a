#include "render/raster/occlusion_test.h"

#include "depth_tiles.comp.spv.h"
#include "occlusion.comp.spv.h"
#include "pack_draws.comp.spv.h"

namespace render::raster {

namespace {

constexpr uint32_t kTestGroup = 64;  // local_size_x of occlusion.comp.glsl
constexpr uint32_t kCandidateWords = kClusterRecords / 32;
static_assert(kCandidateWords == 4);

}  // namespace

world::Status OcclusionTest::open(PassContext& context) {
  TRY(tiles_, make_compute(context.device, depth_tiles_comp_spv));
  TRY(test_, make_compute(context.device, occlusion_comp_spv));
  const Constant lists{kSpecListsFaces, 1};
  TRY(lists_, make_compute(context.device, occlusion_comp_spv, {&lists, 1}));
  TRY(pack_, make_compute(context.device, pack_draws_comp_spv));
  return {};
}

world::Status OcclusionTest::fit(PassContext& context) {
  const VkExtent2D extent = context.targets.extent();
  const uint64_t tiles =
      uint64_t{(extent.width + kTilePixels - 1) / kTilePixels} * ((extent.height + kTilePixels - 1) / kTilePixels);
  TRY(tile_depths_, gpu::make_texel_buffer(context.device, tiles * sizeof(float), VK_FORMAT_R32_SFLOAT,
                                           VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, gpu::MemoryUse::device));
  return {};
}

world::Status OcclusionTest::prepare(PassContext& context, const DrawList& list, const gpu::Buffer& draws,
                                     const gpu::Buffer* tile_depths) {
  ends_ = list.candidates_end;
  draw_ends_ = list.second_end;
  first_draw_ = list.first_end.empty() ? 0 : list.first_end.back();
  TRY_STATUS(context.fill_texels(candidates_, VK_FORMAT_R32G32B32A32_UINT, list.candidates.data(),
                                 list.candidates.size() * sizeof(Candidate)));
  TRY_STATUS(context.fill(visible_, nullptr, list.candidates.size() * sizeof(RecordBits),
                          VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, gpu::MemoryUse::readback));
  listed_.clear(), by_face_.clear();
  finds_tiles_ = tile_depths == nullptr;
  if (list.lists_faces) {
    listed_ = list.second_listed;
    for (size_t page = 0; page < ends_.size(); ++page) {
      const uint32_t first = page > 0 ? ends_[page - 1] : 0;
      by_face_.push_back(ends_[page] > first && list.candidates[first].by_face != 0);
    }
  }
  const uint64_t drawn = list.lists_faces ? 0 : list.second_faces;
  TRY_STATUS(context.fill(second_indices_, nullptr, drawn * 6 * sizeof(uint32_t),
                          VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_INDEX_BUFFER_BIT,
                          gpu::MemoryUse::device));
  TRY_STATUS(context.fill(counts_, nullptr, draw_ends_.size() * sizeof(uint32_t),
                          VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT,
                          gpu::MemoryUse::device));
  context.bindings.bind(kBindTiles, tile_depths ? *tile_depths : tile_depths_);
  context.bindings.bind(kBindCandidates, candidates_);
  context.bindings.bind(kBindVisible, visible_);
  context.bindings.bind(kBindDraws, draws);
  context.bindings.bind(kBindSecondIndices, second_indices_);
  context.bindings.bind(kBindDrawCounts, counts_);
  return {};
}

void OcclusionTest::record(VkCommandBuffer commands, PassContext& context,
                           std::span<const gpu::Buffer* const> page_of) {
  const Targets& targets = context.targets;
  if (finds_tiles_) {
    image_barrier(commands, targets.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT, kDepthReadWrite, kComputeRead);
    const auto tiles = [](int pixels) { return (static_cast<uint32_t>(pixels) + kTilePixels - 1) / kTilePixels; };
    context.bindings.use(commands, tiles_);
    vkCmdDispatch(commands, (tiles(targets.width) + 15) / 16, (tiles(targets.height) + 3) / 4, 1);
  }
  // The test writes into draws and indices that earlier ones may still read.
  memory_barrier(commands, kComputeWrite | kIndirectRead | kIndexRead, kComputeReadWrite);
  uint32_t begin = 0;
  for (size_t page = 0; page < ends_.size(); ++page) {
    if (ends_[page] == begin) continue;
    context.bindings.bind(kBindFaces, *page_of[page]);
    const bool lists = !listed_.empty() && by_face_[page];
    const Pipeline& by = lists ? lists_ : test_;
    context.bindings.use(commands, by);
    const uint32_t range[] = {begin, ends_[page], lists ? listed_[page] : 0, static_cast<uint32_t>(page)};
    by.push(commands, range);
    vkCmdDispatch(commands, ((ends_[page] - begin) * kCandidateWords + kTestGroup - 1) / kTestGroup, 1, 1);
    begin = ends_[page];
  }
  if (context.device.counts_draws()) {
    memory_barrier(commands, kComputeWrite, kComputeReadWrite);
    context.bindings.use(commands, pack_);
    uint32_t first = first_draw_;
    for (uint32_t page = 0; page < draw_ends_.size(); first = draw_ends_[page++]) {
      if (draw_ends_[page] == first) continue;
      const uint32_t range[] = {first, draw_ends_[page], page};
      pack_.push(commands, range);
      vkCmdDispatch(commands, 1, 1, 1);
    }
  }
  memory_barrier(commands, kComputeWrite, kIndirectRead | kIndexRead | kHostRead);
  if (finds_tiles_)
    image_barrier(commands, targets.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT, kComputeRead, kDepthReadWrite);
}

std::span<const RecordBits> OcclusionTest::visible() const {
  return {reinterpret_cast<const RecordBits*>(visible_.mapped()), ends_.empty() ? 0 : ends_.back()};
}

}  // namespace render::raster
