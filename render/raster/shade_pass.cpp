#include "render/raster/shade_pass.h"

#include <algorithm>
#include <array>

#include "shade.comp.spv.h"

namespace render::raster {

PassKind ShadePass::kind() {
  return {"shade", [](const Drawing&, TargetNeeds&) { return true; },
          []() -> std::unique_ptr<Pass> { return std::make_unique<ShadePass>(); }};
}

world::Status ShadePass::prepare(PassContext& context, const Drawing& drawing, FrameReport&) {
  const RenderKnobs& knobs = drawing.knobs;
  const ShadeVariant variant{knobs.sun_shadow,
                             drawing.light,
                             knobs.light_interpolation,
                             knobs.corner_occlusion,
                             !drawing.shapes.chunks().empty(),
                             context.targets.colour.handle != VK_NULL_HANDLE};
  Pipeline& pipeline = pipelines_[variant];
  if (!pipeline) {
    const std::array constants{Constant{kSpecSunShadow, static_cast<uint32_t>(variant.sun_shadow)},
                               Constant{kSpecLight, static_cast<uint32_t>(variant.light)},
                               Constant{kSpecInterpolation, static_cast<uint32_t>(variant.interpolation)},
                               Constant{kSpecCornerOcclusion, variant.corner_occlusion},
                               Constant{kSpecShapes, variant.shapes},
                               Constant{kSpecToImage, variant.to_image}};
    TRY(pipeline, make_compute(context.device, shade_comp_spv, constants));
  }
  pipeline_ = &pipeline;
  std::vector<vec4> materials;
  materials.reserve(drawing.shading.materials.size() * 2);
  for (const Shading::Material& m : drawing.shading.materials) {
    materials.emplace_back(m.albedo[0], m.albedo[1], m.albedo[2], 0);
    materials.emplace_back(m.emitted[0], m.emitted[1], m.emitted[2], 0);
  }
  TRY_STATUS(
      context.fill(materials_, materials.data(), materials.size() * sizeof(vec4), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT));
  context.bindings.bind(kBindMaterials, materials_);
  return {};
}

void ShadePass::record(VkCommandBuffer commands, PassContext& context, const Drawing&) {
  const Targets& targets = context.targets;
  image_barrier(commands, targets.seen.handle, VK_IMAGE_ASPECT_COLOR_BIT, kColourReadWrite, kComputeRead);
  const bool to_image = targets.colour.handle != VK_NULL_HANDLE;
  const uint32_t height = targets.extent().height;
  const uint32_t band_rows = to_image ? height : targets.band_rows;
  const uint64_t row_bytes = sizeof(Rgb) * uint64_t{targets.extent().width};
  for (uint32_t first = 0; first < height; first += band_rows) {
    const uint32_t rows = std::min(band_rows, height - first);
    if (!to_image) context.bindings.bind(kBindRadiance, targets.radiance, first * row_bytes, rows * row_bytes);
    context.bindings.use(commands, *pipeline_);
    pipeline_->push(commands, first);
    vkCmdDispatch(commands, (targets.extent().width + kShadeGroup - 1) / kShadeGroup,
                  (rows + kShadeGroup - 1) / kShadeGroup, 1);
  }
}

world::Status ShadePass::finish(PassContext& context, FrameReport& report) {
  const VkExtent2D extent = context.targets.extent();
  row_of(report, "shade").bytes = uint64_t{extent.width} * extent.height * sizeof(Rgb);
  return {};
}

}  // namespace render::raster
