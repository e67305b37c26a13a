#include "render/raster/inhabitants_pass.h"

#include "balls.frag.spv.h"
#include "balls.vert.spv.h"
#include "boxes.frag.spv.h"
#include "boxes.vert.spv.h"
#include "render/raster/transparency.shared.h"

namespace render::raster {

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
  const std::vector<shared::DrawnBox> boxes =
      drawn_bodies(drawing.view, drawing.inhabitants, drawing.camera, drawing.knobs, drawing.width, drawing.height);
  count_ = static_cast<uint32_t>(boxes.size());
  std::vector<Constant> constants = shading_constants(drawing);
  constants.push_back({kSpecClips, drawing.behind != nullptr});
  Pipeline& pipeline = pipelines_[constants];
  if (!pipeline) {
    TRY(pipeline, make_graphics(context.device, boxes_vert_spv, boxes_frag_spv,
                                {.colour = {kColourFormat}, .depth = context.targets.depth_format}, constants));
  }
  drawn_by_ = &pipeline;
  TRY_STATUS(context.fill(boxes_, boxes.data(), count_ * sizeof(shared::DrawnBox), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT));
  // Rays ask the binding how many there are.
  if (count_)
    context.bindings.bind(kBindBoxes, boxes_, 0, count_ * sizeof(shared::DrawnBox));
  else
    context.bindings.forget(kBindBoxes);
  return {};
}

void BodiesPass::record(VkCommandBuffer commands, PassContext& context, const Drawing&) {
  const Targets& targets = context.targets;
  const VkImageView colour = targets.colour.view;
  image_barrier(commands, targets.colour.handle, VK_IMAGE_ASPECT_COLOR_BIT, kComputeReadWrite, kColourReadWrite);
  image_barrier(commands, targets.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT,
                kDepthReadWrite | kComputeRead | kFragmentRead, kDepthReadWrite);
  begin_rendering(commands, targets, {&colour, 1}, targets.depth.view, false);
  context.bindings.use(commands, *drawn_by_);
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
  DrawnInhabitants drawn =
      drawn_inhabitants(drawing.view, {drawing.inhabitants.origin, drawing.inhabitants.particles, {}}, drawing.camera,
                        drawing.knobs, drawing.width, drawing.height);
  if (const MirrorPlane* const mirror = drawing.behind) {
    const world::WorldPoint& eye = drawing.camera.position;
    const double plane = double(mirror->plane) - eye.voxel[mirror->axis] - eye.fraction[mirror->axis];
    std::erase_if(drawn.balls, [&](const shared::DrawnBall& b) {
      return (double(b.middle[mirror->axis]) - plane) * mirror->side < 0;
    });
  }
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
