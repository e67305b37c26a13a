#include "render/raster/outline_pass.h"

#include "outline.frag.spv.h"
#include "outline.vert.spv.h"

namespace render::raster {

namespace {

constexpr float kOpacity = 0.85f;
/// The box lies by this before the faces that it holds, m, and reaches as far beyond them.
constexpr double kOut = 0.002;

}  // namespace

PassKind OutlinePass::kind() {
  return {"outline",
          [](const Drawing& drawing, TargetNeeds& needs) {
            if (!drawing.selected || drawing.behind) return false;
            needs.colour = true;
            return true;
          },
          []() -> std::unique_ptr<Pass> { return std::make_unique<OutlinePass>(); }};
}

world::Status OutlinePass::prepare(PassContext& context, const Drawing& drawing, FrameReport&) {
  if (!mark_) {
    GraphicsState state = into_stencil(context.targets);
    TRY(mark_, make_graphics(context.device, outline_vert_spv, outline_frag_spv, state, {}));
    state = where_stencil(context.targets, 0);
    state.colour = {kColourFormat};
    // Copies overlap: each pixel is drawn once.
    state.stencil_op.passOp = VK_STENCIL_OP_INCREMENT_AND_CLAMP;
    state.stencil_op.writeMask = 0xff;
    VkPipelineColorBlendAttachmentState over{};
    over.blendEnable = VK_TRUE;
    over.srcColorBlendFactor = over.srcAlphaBlendFactor = VK_BLEND_FACTOR_ONE;
    over.dstColorBlendFactor = over.dstAlphaBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA;
    over.colorWriteMask =
        VK_COLOR_COMPONENT_R_BIT | VK_COLOR_COMPONENT_G_BIT | VK_COLOR_COMPONENT_B_BIT | VK_COLOR_COMPONENT_A_BIT;
    state.blend = {over};
    TRY(draw_, make_graphics(context.device, outline_vert_spv, outline_frag_spv, state, {}));
  }
  const Selection& s = *drawing.selected;
  const Vec3d low = s.low - drawing.camera.position;
  push_.low = to_vec4(low - kOut, s.width_px);
  push_.high = to_vec4(low + s.size + kOut);
  push_.colour = vec4(0, 0, 0, kOpacity);
  return {};
}

void OutlinePass::record(VkCommandBuffer commands, PassContext& context, const Drawing&) {
  const Targets& targets = context.targets;
  image_barrier(commands, targets.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT,
                kDepthReadWrite | kComputeRead | kFragmentRead, kFragmentRead);
  image_barrier(commands, targets.colour.handle, VK_IMAGE_ASPECT_COLOR_BIT, kColourReadWrite | kComputeReadWrite,
                kColourReadWrite);
  discard_stencil(commands, targets);
  begin_with_stencil(commands, targets, {}, true, false);
  context.bindings.use(commands, mark_);
  mark_.push(commands, push_);
  vkCmdDraw(commands, 36, 1, 0, 0);
  vkCmdEndRendering(commands);
  stencil_barrier(commands, targets);
  const VkImageView colour = targets.colour.view;
  begin_with_stencil(commands, targets, {&colour, 1}, false, false);
  context.bindings.use(commands, draw_);
  draw_.push(commands, push_);
  vkCmdDraw(commands, 36, 8, 0, 1);
  vkCmdEndRendering(commands);
  image_barrier(commands, targets.colour.handle, VK_IMAGE_ASPECT_COLOR_BIT, kColourReadWrite,
                kColourReadWrite | kComputeReadWrite);
}

world::Status OutlinePass::finish(PassContext&, FrameReport& report) {
  row_of(report, "outline").draws = 2;
  return {};
}

}  // namespace render::raster
