/// transparency=weighted: sums that need no order, see weighted.frag.glsl. Three targets of four floats: what passes is
/// a sum of logarithms, which half floats would round to steps of a thousandth and more.
#include "render/raster/blend_state.h"
#include "render/raster/transparency_pass.h"

#include "transparency.vert.spv.h"
#include "weighted.comp.spv.h"
#include "weighted.frag.spv.h"

namespace render::raster {

namespace {

class WeightedOrder : public LayerOrder {
 public:
  world::Status fit(PassContext& context) override {
    for (gpu::DeviceImage* image : {&shown_, &depth_, &rest_}) {
      TRY(*image,
          gpu::make_image(context.device, context.targets.extent(), kColourFormat,
                          VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_SAMPLED_BIT, VK_IMAGE_ASPECT_COLOR_BIT));
    }
    return {};
  }

  world::Status prepare(PassContext& context, const Drawing& drawing, const LayerDraws& draws,
                        LayerConstants&) override {
    const auto all = layer_constants(drawing, draws);
    if (!sum_ || all != made_for_) {
      const auto add = blend_attachment(kBlendAdd);
      TRY(sum_, make_graphics(context.device, transparency_vert_spv, weighted_frag_spv,
                              {.colour = {kColourFormat, kColourFormat, kColourFormat},
                               .blend = {add, add, add},
                               .depth = context.targets.depth_format,
                               .depth_write = false,
                               .depth_compare = VK_COMPARE_OP_GREATER_OR_EQUAL},
                              all));
      TRY(resolve_, make_compute(context.device, weighted_comp_spv, all));
      made_for_ = all;
    }
    context.bindings.bind(kBindLayerShown, shown_);
    context.bindings.bind(kBindLayerDepth, depth_);
    context.bindings.bind(kBindLayerRest, rest_);
    return {};
  }

  void record(VkCommandBuffer commands, PassContext& context, const Drawing&, const LayerDraws& draws) override {
    for (const gpu::DeviceImage* image : {&shown_, &depth_, &rest_})
      image_discard(commands, image->handle, VK_IMAGE_ASPECT_COLOR_BIT, kComputeRead, kColourReadWrite);
    const VkImageView views[] = {shown_.view, depth_.view, rest_.view};
    begin_clearing_colour(commands, context.targets, views, context.targets.depth.view);
    draws.record(commands, context, sum_);
    vkCmdEndRendering(commands);
    for (const gpu::DeviceImage* image : {&shown_, &depth_, &rest_})
      image_barrier(commands, image->handle, VK_IMAGE_ASPECT_COLOR_BIT, kColourReadWrite, kComputeRead);
    context.times.mark(commands, "transparency_resolve");
    context.bindings.use(commands, resolve_);
    context.slices.dispatch(commands, resolve_.handle, context.targets.extent(),
                            [&](const auto& first_group) { resolve_.push(commands, first_group); });
  }

  world::Status finish(PassContext& context, FrameReport& report) override {
    const VkExtent2D extent = context.targets.extent();
    row_of(report, "transparency_resolve").bytes = uint64_t{extent.width} * extent.height * 48;
    return {};
  }

 private:
  Pipeline sum_, resolve_;
  std::vector<Constant> made_for_;
  gpu::DeviceImage shown_, depth_, rest_;
};

}  // namespace

std::unique_ptr<LayerOrder> make_weighted_order() { return std::make_unique<WeightedOrder>(); }

}  // namespace render::raster
