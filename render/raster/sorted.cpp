/// transparency=sorted: faces in the order of the painter's algorithm, each drawn twice as section 14.10.3 says: what
/// it lets through, by BlendFunc(ZERO, SRC_COLOR), then what it shows, by BlendFunc(ONE, ONE).
///
///   shown   starts at 0    shown = shown * passed + of the face     what all layers show
///   passed  starts at 1    passed = passed * of the face            what they let through of the picture behind
///
/// A face's distance is that of its middle from the eye's voxel, along the axes: for unit faces (merge_faces off) an
/// exact order, as any ray crosses the grid's voxels in the order of that distance. Merged faces overlap in ways that
/// no order of their middles gets right; what that costs is in the subject transparency_order. Faces of one distance
/// never overlap where they are unit faces, and go into one pair of draws. Of liquids that end within their voxels the
/// middles are those of what stands there, and the order is right but for walls seen along a slope. error   of merged
/// faces: the order. Refraction and reflections but of the sky are not drawn.
#include <algorithm>

#include "render/raster/blend_state.h"
#include "render/raster/transparency_pass.h"
#include "sorted.comp.spv.h"
#include "sorted.frag.spv.h"
#include "transparency.vert.spv.h"

namespace render::raster {

namespace {

struct SortedRecord {
  uint32_t word0, word1, chunk, distance;
};
static_assert(sizeof(SortedRecord) == 16);

/// The distance of a face's middle from the middle of the eye's voxel, along the axes, in parts of a voxel.
constexpr int kParts = 2 * kFullLevel;
uint32_t distance_in_parts(const FaceRecord& record, const ivec4& chunk) {
  const glm::uvec3 a = face_corner(record.word0, record.word1, 0), b = face_corner(record.word0, record.word1, 2);
  uint64_t sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    int64_t middle = kFullLevel * static_cast<int64_t>(a[axis] + b[axis]);
    if (axis == 1 && face_is_part(record.word0)) {
      const auto top = static_cast<int64_t>(part_top(see_through_part_upper(record.word1)));
      const bool lies = face_direction(record.word1) == world::kFacePosY;
      middle = int64_t{kParts} * face_voxel(record.word0).y +
               (lies ? 2 * top : top + static_cast<int64_t>(part_bottom(record.word0, record.word1)));
    }
    sum += static_cast<uint64_t>(std::abs(int64_t{kParts} * chunk[axis] + middle - kFullLevel));
  }
  return static_cast<uint32_t>(std::min<uint64_t>(sum, UINT32_MAX));
}

class SortedOrder : public LayerOrder {
 public:
  bool needs_block_grid(const Drawing&) const override { return true; }

  world::Status fit(PassContext& context) override {
    for (gpu::DeviceImage* image : {&shown_, &passed_}) {
      TRY(*image, gpu::make_image(context.device, context.targets.extent(), kColourFormat,
                                  VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_SAMPLED_BIT |
                                      VK_IMAGE_USAGE_TRANSFER_DST_BIT,
                                  VK_IMAGE_ASPECT_COLOR_BIT));
    }
    return {};
  }

  world::Status prepare(PassContext& context, const Drawing& drawing, const LayerDraws& draws,
                        LayerConstants&) override {
    auto all = layer_constants(drawing, draws, {{kSpecSortedRecords, 1}, {kSpecAddsShown, 0}});
    if (!transmit_ || all != made_for_) {
      made_for_ = all;
      GraphicsState state{.colour = {kColourFormat, kColourFormat},
                          .depth = context.targets.depth_format,
                          .depth_write = false,
                          .depth_compare = VK_COMPARE_OP_GREATER_OR_EQUAL};
      state.blend.assign(2, blend_attachment(kBlendTransmit));
      TRY(transmit_, make_graphics(context.device, transparency_vert_spv, sorted_frag_spv, state, all));
      state.blend.assign(2, blend_attachment(kBlendAdd));
      all.back().value = 1;
      TRY(add_, make_graphics(context.device, transparency_vert_spv, sorted_frag_spv, state, all));
      TRY(resolve_, make_compute(context.device, sorted_comp_spv, all));
    }
    sort(draws);
    TRY_STATUS(context.fill(sorted_, records_.data(), records_.size() * sizeof(SortedRecord),
                            VK_BUFFER_USAGE_STORAGE_BUFFER_BIT));
    if (indexed_ < largest_run_) {
      indexed_ = largest_run_ + largest_run_ / 2;
      TRY(indices_, gpu::make_buffer(context.device, uint64_t{indexed_} * 24, VK_BUFFER_USAGE_INDEX_BUFFER_BIT,
                                     gpu::MemoryUse::upload));
      fill_quad_indices(indices_, indexed_);
    }
    context.bindings.bind(kBindLayerSorted, sorted_);
    context.bindings.bind(kBindLayerShown, shown_);
    context.bindings.bind(kBindLayerDepth, passed_);
    return {};
  }

  void record(VkCommandBuffer commands, PassContext& context, const Drawing&, const LayerDraws&) override {
    const VkImageSubresourceRange all{VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
    const VkClearColorValue zero{}, one{{1, 1, 1, 1}};
    for (const gpu::DeviceImage* image : {&shown_, &passed_})
      image_discard(commands, image->handle, VK_IMAGE_ASPECT_COLOR_BIT, kComputeRead, kClearWrite);
    vkCmdClearColorImage(commands, shown_.handle, VK_IMAGE_LAYOUT_GENERAL, &zero, 1, &all);
    vkCmdClearColorImage(commands, passed_.handle, VK_IMAGE_LAYOUT_GENERAL, &one, 1, &all);
    for (const gpu::DeviceImage* image : {&shown_, &passed_})
      image_barrier(commands, image->handle, VK_IMAGE_ASPECT_COLOR_BIT, kClearWrite, kColourReadWrite);
    const VkImageView views[] = {shown_.view, passed_.view};
    begin_rendering(commands, context.targets, views, context.targets.depth.view, false);
    if (!runs_.empty()) {
      vkCmdBindIndexBuffer(commands, indices_.handle, 0, VK_INDEX_TYPE_UINT32);
      const std::pair<const Pipeline*, VkDescriptorSet> passes[] = {{&transmit_, context.bindings.set_for(transmit_)},
                                                                    {&add_, context.bindings.set_for(add_)}};
      for (const Run& run : runs_) {
        for (const auto& pass : passes) {
          Bindings::bind_set(commands, *pass.first, pass.second);
          vkCmdDrawIndexed(commands, run.count * 6, 1, 0, static_cast<int32_t>(run.first * 4), 0);
        }
      }
    }
    vkCmdEndRendering(commands);
    for (const gpu::DeviceImage* image : {&shown_, &passed_})
      image_barrier(commands, image->handle, VK_IMAGE_ASPECT_COLOR_BIT, kColourReadWrite, kComputeRead);
    context.times.mark(commands, "transparency_resolve");
    context.bindings.use(commands, resolve_);
    context.slices.dispatch(commands, resolve_.handle, context.targets.extent(),
                            [&](const auto& first_group) { resolve_.push(commands, first_group); });
  }

  world::Status finish(PassContext& context, FrameReport& report) override {
    const VkExtent2D extent = context.targets.extent();
    row_of(report, "transparency").draws = 2 * runs_.size();
    row_of(report, "transparency_resolve").bytes = uint64_t{extent.width} * extent.height * 32;
    return {};
  }

 private:
  struct Run {
    uint32_t first, count;
  };

  /// Farthest first; of one distance in the order of chunks and records, which is the same in each picture (hard case
  /// A13).
  void sort(const LayerDraws& draws) {
    records_.clear();
    for (uint32_t c = 0; c < draws.extracted.size(); ++c)
      for (const FaceRecord& r : draws.extracted[c]->records)
        records_.push_back({r.word0, r.word1, c, distance_in_parts(r, draws.chunks[c])});
    std::stable_sort(records_.begin(), records_.end(),
                     [](const SortedRecord& a, const SortedRecord& b) { return a.distance > b.distance; });
    runs_.clear();
    largest_run_ = 0;
    for (uint32_t i = 0; i < records_.size(); ++i) {
      if (i == 0 || records_[i].distance != records_[i - 1].distance) runs_.push_back({i, 0});
      largest_run_ = std::max(largest_run_, ++runs_.back().count);
    }
  }

  Pipeline transmit_, add_, resolve_;
  std::vector<Constant> made_for_;
  gpu::DeviceImage shown_, passed_;
  gpu::Buffer sorted_, indices_;
  uint32_t indexed_ = 0, largest_run_ = 0;
  std::vector<SortedRecord> records_;
  std::vector<Run> runs_;
};

}  // namespace

std::unique_ptr<LayerOrder> make_sorted_order() { return std::make_unique<SortedOrder>(); }

}  // namespace render::raster
