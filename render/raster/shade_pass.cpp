#include "render/raster/shade_pass.h"

#include <algorithm>
#include <bit>

#include "shade.comp.spv.h"

namespace render::raster {

std::vector<Constant> shading_constants(const Drawing& drawing) {
  const RenderKnobs& knobs = drawing.knobs;
  const LightingVariant& lighting = drawing.lighting.variant();
  return {{kSpecSunShadow, static_cast<uint32_t>(knobs.sun_shadow)},
          {kSpecLight, static_cast<uint32_t>(drawing.light)},
          {kSpecInterpolation, static_cast<uint32_t>(knobs.light_interpolation)},
          {kSpecCornerOcclusion, knobs.corner_occlusion},
          {kSpecSkyModel, drawing.sky.light != nullptr},
          {kSpecLuminaires, lighting.luminaires},
          {kSpecMedia, lighting.media},
          {kSpecBsdf, lighting.bsdf},
          {kSpecLuminaireShadow, lighting.luminaire_shadow},
          {kSpecSkyRays, static_cast<uint32_t>(std::max(knobs.sky_rays, 0))},
          {kSpecTextures, drawing.textured ? static_cast<uint32_t>(knobs.textures) : 0},
          {kSpecAnisotropy, drawing.textured ? static_cast<uint32_t>(std::max(knobs.texture_anisotropy, 1)) : 1},
          {kSpecNormalDetail, drawing.textured ? std::bit_cast<uint32_t>(knobs.normal_detail) : 0},
          {kSpecSunMapFilter, static_cast<uint32_t>(std::clamp(knobs.sun_map_filter, 1, 15))}};
}

PassKind ShadePass::kind() {
  return {"shade", [](const Drawing&, TargetNeeds&) { return true; },
          []() -> std::unique_ptr<Pass> { return std::make_unique<ShadePass>(); }};
}

world::Status ShadePass::prepare(PassContext& context, const Drawing& drawing, FrameReport&) {
  std::vector<Constant> constants = shading_constants(drawing);
  constants.push_back({kSpecShapes, !drawing.shapes.chunks().empty()});
  constants.push_back({kSpecToImage, context.targets.colour.handle != VK_NULL_HANDLE});
  Pipeline& pipeline = pipelines_[constants];
  if (!pipeline) {
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
