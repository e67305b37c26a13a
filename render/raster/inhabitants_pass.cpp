#include "render/raster/inhabitants_pass.h"

#include "balls.frag.spv.h"
#include "balls.vert.spv.h"
#include "boxes.frag.spv.h"
#include "boxes.vert.spv.h"

namespace render::raster {

PassKind InhabitantsPass::kind() {
  return {"inhabitants",
          [](const Drawing& drawing, TargetNeeds& needs) {
            if (drawing.inhabitants.empty()) return false;
            needs.colour = true;
            return true;
          },
          []() -> std::unique_ptr<Pass> { return std::make_unique<InhabitantsPass>(); }};
}

world::Status InhabitantsPass::prepare(PassContext& context, const Drawing& drawing, FrameReport&) {
  const DrawnInhabitants drawn = drawn_inhabitants(drawing.view, drawing.inhabitants, drawing.camera, drawing.knobs,
                                                   drawing.width, drawing.height);
  ball_count_ = static_cast<uint32_t>(drawn.balls.size()), box_count_ = static_cast<uint32_t>(drawn.boxes.size());
  if (box_count_ > 0 && !box_pipeline_) {
    TRY(box_pipeline_, make_graphics(context.device, boxes_vert_spv, boxes_frag_spv,
                                     {.colour = {kColourFormat}, .depth = kDepthFormat}));
  }
  if (ball_count_ > 0 && !ball_pipeline_) {
    VkPipelineColorBlendAttachmentState over{};
    over.blendEnable = VK_TRUE;  // colours come times their opacity
    over.srcColorBlendFactor = over.srcAlphaBlendFactor = VK_BLEND_FACTOR_ONE;
    over.dstColorBlendFactor = over.dstAlphaBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA;
    over.colorWriteMask =
        VK_COLOR_COMPONENT_R_BIT | VK_COLOR_COMPONENT_G_BIT | VK_COLOR_COMPONENT_B_BIT | VK_COLOR_COMPONENT_A_BIT;
    TRY(ball_pipeline_, make_graphics(context.device, balls_vert_spv, balls_frag_spv,
                                      {.topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_STRIP,
                                       .colour = {kColourFormat},
                                       .blend = {over},
                                       .depth_test = false,
                                       .depth_write = false}));
  }
  constexpr VkBufferUsageFlags kStorage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
  TRY_STATUS(context.fill(boxes_, drawn.boxes.data(), box_count_ * sizeof(shared::DrawnBox), kStorage));
  TRY_STATUS(context.fill(balls_, drawn.balls.data(), ball_count_ * sizeof(shared::DrawnBall), kStorage));
  context.bindings.bind(kBindBoxes, boxes_);
  context.bindings.bind(kBindBalls, balls_);
  return {};
}

void InhabitantsPass::record(VkCommandBuffer commands, PassContext& context, const Drawing&) {
  const Targets& targets = context.targets;
  const VkImageView colour = targets.colour.view;
  image_barrier(commands, targets.colour.handle, VK_IMAGE_ASPECT_COLOR_BIT, kColourReadWrite | kComputeReadWrite,
                kColourReadWrite);
  if (box_count_ > 0) {
    image_barrier(commands, targets.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT,
                  kDepthReadWrite | kComputeRead | kFragmentRead, kDepthReadWrite);
    begin_rendering(commands, targets, {&colour, 1}, targets.depth.view, false);
    context.bindings.use(commands, box_pipeline_);
    vkCmdDraw(commands, 36, box_count_, 0, 0);
    vkCmdEndRendering(commands);
    if (ball_count_ > 0)
      image_barrier(commands, targets.colour.handle, VK_IMAGE_ASPECT_COLOR_BIT, kColourReadWrite, kColourReadWrite);
  }
  if (ball_count_ == 0) return;
  image_barrier(commands, targets.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT,
                kDepthReadWrite | kComputeRead | kFragmentRead, kFragmentRead);
  begin_rendering(commands, targets, {&colour, 1}, VK_NULL_HANDLE, false);
  context.bindings.use(commands, ball_pipeline_);
  vkCmdDraw(commands, 4, ball_count_, 0, 0);
  vkCmdEndRendering(commands);
}

world::Status InhabitantsPass::finish(PassContext&, FrameReport& report) {
  PassReport& row = row_of(report, "inhabitants");
  row.draws = (box_count_ > 0) + (ball_count_ > 0);
  row.bytes = box_count_ * sizeof(shared::DrawnBox) + ball_count_ * sizeof(shared::DrawnBall);
  return {};
}

}  // namespace render::raster
