#include "render/raster/small_shapes.h"

#include <bit>

#include "shape_blocks.comp.spv.h"
#include "shape_keys.comp.spv.h"
#include "shape_pixels.comp.spv.h"
#include "render/raster/block_lists.h"

namespace render::raster {

namespace {

constexpr VkBufferUsageFlags kStorage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
constexpr VkBufferUsageFlags kCleared = kStorage | VK_BUFFER_USAGE_TRANSFER_DST_BIT;

/// Sides of the squares of pixels that an invocation looks at at once, and up to which diagonal of a voxel, px, it
/// takes the smaller ones. All shapes of a vector take as long as the one that has the most squares. Measured on
/// 105,625 plants of 1 to 4 px, on two cores with lavapipe: 18 ms, 19 with 3 alone, 25 with 4.
constexpr std::array<uint32_t, 2> kTileSides{2, 3};
constexpr double kSmallTile = 3.4;

static_assert(world::kMostProxyParts * world::kFaces <= 1u << kShapeFaceBits);
static_assert(kMostListed <= kMostShapes);

uint64_t pixels_of(const BlockRows& rows) { return uint64_t{rows.pixels} * rows.blocks.height * kBlockPixels; }

}  // namespace

bool SmallShapes::fits(const PassContext& context) {
  const VkExtent2D extent = context.targets.extent();
  const uint64_t most = context.device.limits().maxStorageBufferRange / sizeof(uint64_t);
  return context.device.has_atomic64() &&
         uint64_t{extent.width + kBlockPixels} * (extent.height + kBlockPixels) <= most;
}

world::Result<const SmallShapes::Pipelines*> SmallShapes::pipelines(PassContext& context, bool blends) {
  Pipelines& found = made_[blends];
  if (!found.pixels) {
    for (size_t tile = 0; tile < kTileSides.size(); ++tile) {
      const std::array constants{Constant{kSpecBlends, blends}, Constant{kSpecShapeTile, kTileSides[tile]}};
      TRY(found.keys[tile], make_compute(context.device, shape_keys_comp_spv, constants));
    }
    TRY(found.blocks, make_compute(context.device, shape_blocks_comp_spv));
    TRY(found.pixels, make_compute(context.device, shape_pixels_comp_spv));
  }
  return &found;
}

world::Status SmallShapes::fit(PassContext& context, const BlockRows& rows) {
  const bool same = same_extent(rows_.blocks, rows.blocks);
  rows_ = rows;
  if (same && keys_.handle) return {};
  const uint64_t bytes = count_of(rows.blocks) * sizeof(uint32_t);
  TRY(keys_, gpu::make_texel_buffer(context.device, pixels_of(rows) * sizeof(uint64_t), VK_FORMAT_R32G32B32A32_UINT,
                                    kCleared, gpu::MemoryUse::device));
  TRY(touched_, gpu::make_buffer(context.device, bytes, kCleared, gpu::MemoryUse::device));
  TRY(blocks_, gpu::make_texel_buffer(context.device, bytes, VK_FORMAT_R32_UINT, kStorage, gpu::MemoryUse::device));
  fresh_ = true;
  return {};
}

/// Those with larger squares first; of each page front to back.
void SmallShapes::list_points(const Drawing& drawing, const DrawList& list) {
  shapes_.clear(), ranges_.clear();
  const double small_from = pixels_at_one_metre(drawing.rays, drawing.height) * kVoxelDiagonal / kSmallTile;
  for (uint32_t tile = kTileSides.size(); tile-- > 0;) {
    uint32_t next = 0;
    for (uint32_t page = 0; page < list.points_end.size(); ++page) {
      const auto first = static_cast<uint32_t>(shapes_.size());
      for (; next < list.points_end[page]; ++next) {
        const ListedPoints& points = list.points[next];
        if ((points.distance >= small_from) != (tile == 0)) continue;
        for (uint32_t i = 0; i < points.count; ++i) shapes_.push_back({points.first + i, points.chunk});
      }
      const uint32_t count = static_cast<uint32_t>(shapes_.size()) - first;
      if (count > 0) ranges_.push_back({page, tile, first, count});
    }
  }
}

world::Status SmallShapes::prepare(PassContext& context, const Drawing& drawing, const DrawList& list,
                                   const BlockRows& rows) {
  list_points(drawing, list);
  if (shapes_.empty()) return {};
  TRY_STATUS(fit(context, rows));
  TRY(by_, pipelines(context, list.blends));
  TRY_STATUS(context.fill_texels(listed_, VK_FORMAT_R32G32_UINT, shapes_.data(), shapes_.size() * sizeof(ListedFace)));
  TRY_STATUS(fit_texels(context, setups_, VK_FORMAT_R32G32_UINT, std::bit_ceil(shapes_.size()) * 2 * sizeof(uint32_t)));
  const std::array<uint32_t, kHeadWords> head{0, 1, 1, 0};
  TRY_STATUS(context.fill(head_, head.data(), sizeof head, kStorage | VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT));
  Bindings& bind = context.bindings;
  bind.bind(kBindListedShapes, listed_);
  bind.bind(kBindShapeSetups, setups_);
  bind.bind(kBindShapeKeys, keys_);
  bind.bind(kBindShapeKeyTexels, keys_);
  bind.bind(kBindTouchedBlocks, touched_);
  bind.bind(kBindShapeBlocks, blocks_);
  bind.bind(kBindShapeHead, head_);
  return {};
}

void SmallShapes::record(VkCommandBuffer commands, PassContext& context, std::span<const gpu::Buffer* const> page_of) {
  if (shapes_.empty()) return;
  memory_barrier(commands, kComputeWrite, kComputeReadWrite);
  if (fresh_) {
    for (const gpu::Buffer* buffer : {&keys_, &touched_})
      vkCmdFillBuffer(commands, buffer->handle, 0, VK_WHOLE_SIZE, 0);
    memory_barrier(commands, kClearWrite, kComputeReadWrite);
    fresh_ = false;
  }
  for (const Range& range : ranges_) {
    const Pipeline& keys = by_->keys[range.tile];
    context.bindings.bind(kBindFaces, *page_of[range.page]);
    context.bindings.use(commands, keys);
    keys.push(commands, ShapeRange{range.first, range.count, rows_.pixels});
    vkCmdDispatch(commands, groups_of(range.count, kShapesInGroup), 1, 1);
  }
  memory_barrier(commands, kComputeWrite, kComputeReadWrite);
  const auto blocks = static_cast<uint32_t>(count_of(rows_.blocks));
  context.bindings.use(commands, by_->blocks);
  by_->blocks.push(commands, std::array{blocks, rows_.blocks.width});
  vkCmdDispatch(commands, groups_of(blocks, kMarksInGroup), 1, 1);
  memory_barrier(commands, kComputeWrite, kComputeReadWrite | kIndirectRead);
  context.bindings.use(commands, by_->pixels);
  by_->pixels.push(commands, std::array{rows_.pixels, rows_.seen_pixels, context.targets.extent().height});
  vkCmdDispatchIndirect(commands, head_.handle, 0);
}

void SmallShapes::finish(FrameReport& report) const {
  report.work.push_back({"shapes_listed", shapes_.size()});
  if (shapes_.empty()) return;
  for (const gpu::Buffer* buffer : {&listed_, &setups_, &keys_, &touched_, &blocks_, &head_})
    row_of(report, "faces").bytes += buffer->size;
}

void SmallShapes::rest() {
  for (gpu::Buffer* buffer : {&listed_, &setups_, &keys_, &touched_, &blocks_, &head_}) *buffer = {};
  shapes_.clear();
}

}  // namespace render::raster
