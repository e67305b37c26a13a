#include "render/raster/inhabitants_pass.h"

#include "balls.frag.spv.h"
#include "balls.vert.spv.h"
#include "boxes.frag.spv.h"
#include "boxes.vert.spv.h"

namespace render::raster {

namespace {

DrawnInhabitants drawn_of(const Drawing& drawing, const Inhabitants& some) {
  return drawn_inhabitants(drawing.view, some, drawing.camera, drawing.knobs, drawing.width, drawing.height);
}

}  // namespace

PassKind BodiesPass::kind() {
  return {"bodies",
          [](const Drawing& drawing, TargetNeeds& needs) {
            if (drawing.inhabitants.bodies.empty()) return false;
            needs.colour = true;
            return true;
          },
          []() -> std::unique_ptr<Pass> { return std::make_unique<BodiesPass>(); }};
}

world::Status BodiesPass::prepare(PassContext& context, const Drawing& drawing, FrameReport&) {
  const DrawnInhabitants drawn = drawn_of(drawing, {drawing.inhabitants.origin, {}, drawing.inhabitants.bodies});
  count_ = static_cast<uint32_t>(drawn.boxes.size());
  if (!pipeline_) {
    TRY(pipeline_, make_graphics(context.device, boxes_vert_spv, boxes_frag_spv,
                                 {.colour = {kColourFormat}, .depth = context.targets.depth_format}));
  }
  TRY_STATUS(
      context.fill(boxes_, drawn.boxes.data(), count_ * sizeof(shared::DrawnBox), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT));
  context.bindings.bind(kBindBoxes, boxes_);
  return {};
}

void BodiesPass::record(VkCommandBuffer commands, PassContext& context, const Drawing&) {
  const Targets& targets = context.targets;
  const VkImageView colour = targets.colour.view;
  image_barrier(commands, targets.colour.handle, VK_IMAGE_ASPECT_COLOR_BIT, kComputeReadWrite, kColourReadWrite);
  image_barrier(commands, targets.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT,
                kDepthReadWrite | kComputeRead | kFragmentRead, kDepthReadWrite);
  begin_rendering(commands, targets, {&colour, 1}, targets.depth.view, false);
  context.bindings.use(commands, pipeline_);
  vkCmdDraw(commands, 36, count_, 0, 0);
  vkCmdEndRendering(commands);
  image_barrier(commands, targets.colour.handle, VK_IMAGE_ASPECT_COLOR_BIT, kColourReadWrite,
                kComputeReadWrite | kColourReadWrite);
  image_barrier(commands, targets.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT, kDepthReadWrite,
                kDepthReadWrite | kComputeRead | kFragmentRead);
}

world::Status BodiesPass::finish(PassContext&, FrameReport& report) {
  PassReport& row = row_of(report, "bodies");
  row.draws = count_ > 0;
  row.bytes = count_ * sizeof(shared::DrawnBox);
  return {};
}

PassKind ParticlesPass::kind() {
  return {"particles",
          [](const Drawing& drawing, TargetNeeds& needs) {
            if (drawing.inhabitants.particles.empty()) return false;
            needs.colour = true;
            return true;
          },
          []() -> std::unique_ptr<Pass> { return std::make_unique<ParticlesPass>(); }};
}

world::Status ParticlesPass::prepare(PassContext& context, const Drawing& drawing, FrameReport&) {
  const DrawnInhabitants drawn = drawn_of(drawing, {drawing.inhabitants.origin, drawing.inhabitants.particles, {}});
  count_ = static_cast<uint32_t>(drawn.balls.size());
  if (!pipeline_) {
    VkPipelineColorBlendAttachmentState over{};
    over.blendEnable = VK_TRUE;  // colours come times their opacity
    over.srcColorBlendFactor = over.srcAlphaBlendFactor = VK_BLEND_FACTOR_ONE;
    over.dstColorBlendFactor = over.dstAlphaBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA;
    over.colorWriteMask =
        VK_COLOR_COMPONENT_R_BIT | VK_COLOR_COMPONENT_G_BIT | VK_COLOR_COMPONENT_B_BIT | VK_COLOR_COMPONENT_A_BIT;
    TRY(pipeline_, make_graphics(context.device, balls_vert_spv, balls_frag_spv,
                                 {.topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_STRIP,
                                  .colour = {kColourFormat},
                                  .blend = {over},
                                  .depth_test = false,
                                  .depth_write = false}));
  }
  TRY_STATUS(
      context.fill(balls_, drawn.balls.data(), count_ * sizeof(shared::DrawnBall), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT));
  context.bindings.bind(kBindBalls, balls_);
  return {};
}

void ParticlesPass::record(VkCommandBuffer commands, PassContext& context, const Drawing&) {
  const Targets& targets = context.targets;
  const VkImageView colour = targets.colour.view;
  image_barrier(commands, targets.colour.handle, VK_IMAGE_ASPECT_COLOR_BIT, kColourReadWrite | kComputeReadWrite,
                kColourReadWrite);
  image_barrier(commands, targets.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT,
                kDepthReadWrite | kComputeRead | kFragmentRead, kFragmentRead);
  begin_rendering(commands, targets, {&colour, 1}, VK_NULL_HANDLE, false);
  context.bindings.use(commands, pipeline_);
  vkCmdDraw(commands, 4, count_, 0, 0);
  vkCmdEndRendering(commands);
}

world::Status ParticlesPass::finish(PassContext&, FrameReport& report) {
  PassReport& row = row_of(report, "particles");
  row.draws = count_ > 0;
  row.bytes = count_ * sizeof(shared::DrawnBall);
  return {};
}

}  // namespace render::raster
