#include "render/raster/shade_pass.h"

#include <algorithm>
#include <bit>

#include "shade.comp.spv.h"
#include "shade.frag.spv.h"
#include "whole.vert.spv.h"
#include "render/raster/billboards.h"
#include "render/raster/heightfields.h"
#include "render/raster/impostors.h"
#include "render/raster/stencil.h"
#include "render/raster/transparency.shared.h"

namespace render::raster {

namespace {

/// From here on a view distance takes nothing of a picture, m.
constexpr float kNoViewEnd = 1e9f;

constexpr Access kFragmentReadWrite{VK_PIPELINE_STAGE_2_FRAGMENT_SHADER_BIT, VK_ACCESS_2_SHADER_STORAGE_READ_BIT |
                                                                                 VK_ACCESS_2_SHADER_SAMPLED_READ_BIT |
                                                                                 VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT};

/// Whether faces of shapes are few beside those of cubes: then they are put off, so that other pixels don't run through
/// their shading.
bool shapes_are_few(const Drawing& drawing) {
  const auto records = [](const FacePool& pool) {
    uint64_t sum = 0;
    for (const PooledChunk& chunk : pool.chunks()) sum += chunk.count;
    return sum;
  };
  return records(drawing.shapes) < records(*drawing.faces[0]) / 4;
}

/// Of a list of pixels.
uint64_t groups_of(uint64_t pixels) { return (pixels + kShadeGroup * kShadeGroup - 1) / (kShadeGroup * kShadeGroup); }

}  // namespace

std::vector<Constant> shading_constants(const Drawing& drawing) {
  const RenderKnobs& knobs = drawing.knobs;
  const LightingVariant& lighting = drawing.lighting.variant();
  const bool textured = !drawing.block_textures.empty();
  return {{kSpecSunShadow, static_cast<uint32_t>(knobs.sun_shadow)},
          {kSpecLight, static_cast<uint32_t>(drawing.light)},
          {kSpecInterpolation, static_cast<uint32_t>(knobs.light_interpolation)},
          {kSpecCornerOcclusion, knobs.corner_occlusion},
          {kSpecSkyModel, drawing.sky.light != nullptr},
          {kSpecLuminaires, lighting.luminaires},
          {kSpecLuminaireKinds, lighting.luminaire_kinds},
          {kSpecMedia, lighting.media},
          {kSpecMediumKinds, lighting.medium_kinds},
          {kSpecFogShafts, lighting.fog_shafts},
          {kSpecBsdf, lighting.bsdf},
          {kSpecLuminaireShadow, lighting.luminaire_shadow},
          {kSpecSkyRays, static_cast<uint32_t>(std::max(knobs.sky_rays, 0))},
          {kSpecTextures, textured ? static_cast<uint32_t>(knobs.textures) : 0},
          {kSpecAnisotropy, textured ? static_cast<uint32_t>(std::max(knobs.texture_anisotropy, 1)) : 1},
          {kSpecNormalDetail, textured ? std::bit_cast<uint32_t>(knobs.normal_detail) : 0},
          {kSpecSunMapFilter, static_cast<uint32_t>(std::clamp(knobs.sun_map_filter, 1, 15))},
          {kSpecSunCascades,
           knobs.sun_shadow == SunShadow::map ? static_cast<uint32_t>(std::max(knobs.sun_map_cascades, 0)) : 0},
          {kSpecSunBlockers, drawing.sun_blockers},
          {kSpecCloudSteps, static_cast<uint32_t>(drawing.sky.clouds.steps)},
          {kSpecCloudLightSteps, static_cast<uint32_t>(drawing.sky.clouds.light_steps)},
          {kSpecCloudShadows, drawing.sky.clouds.shadows},
          {kSpecCloudsBefore, drawing.sky.clouds.before},
          {kSpecCoarseFaces, drawing.faces.size() > 1 || Impostors::called_for(drawing) ||
                                 Billboards::called_for(drawing) || Heightfields::called_for(drawing)},
          {kSpecViewEnds, knobs.view_distance < kNoViewEnd},
          {kSpecMeshes, !drawing.triangles.empty()},
          {kSpecLiquidLevels, drawing.liquid_levels},
          {kSpecTrianglesAlone, drawing.triangles_alone}};
}

PassKind ShadePass::kind() {
  return {"shade", [](const Drawing&, TargetNeeds&) { return true; },
          []() -> std::unique_ptr<Pass> { return std::make_unique<ShadePass>(); }};
}

world::Status ShadePass::prepare(PassContext& context, const Drawing& drawing, FrameReport&) {
  const bool any_shapes = !drawing.shapes.chunks().empty();
  const bool any_triangles = !drawing.triangles.empty();
  const bool in_image = context.targets.colour.handle != VK_NULL_HANDLE;
  const bool few_shapes = in_image && any_shapes && shapes_are_few(drawing);
  const uint32_t put_off = (few_shapes ? kSeenShape : 0) | (in_image && any_triangles ? kSeenMesh : 0);
  const std::vector<Constant> shading = shading_constants(drawing);
  const auto with = [&](std::initializer_list<Constant> more) {
    std::vector<Constant> all = shading;
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  counts_rays_ = drawing.counts_sun_rays;
  const auto compute = [&](bool of_list) -> world::Result<const Pipeline*> {
    const auto all = with({{kSpecShapes, of_list ? few_shapes : any_shapes},
                           {kSpecMeshPixels, any_triangles},
                           {kSpecShadedPart, of_list ? kShadedPutOff : kShadedAll},
                           {kSpecToImage, in_image},
                           {kSpecCountsRays, counts_rays_},
                           {kSpecPutOff, of_list}});
    Pipeline& made = pipelines_[all];
    if (!made) {
      TRY(made, make_compute(context.device, shade_comp_spv, all));
    }
    return &made;
  };
  const auto whole = [&](uint32_t part, VkCompareOp depth,
                         std::initializer_list<Constant> more) -> world::Result<const Pipeline*> {
    auto all = with(more);
    all.push_back({kSpecShadedPart, part});
    Pipeline& made = pipelines_[all];
    if (!made) {
      TRY(made, make_graphics(context.device, whole_vert_spv, shade_frag_spv,
                              {.colour = {kColourFormat},
                               .depth = context.targets.depth_format,
                               .depth_write = false,
                               .depth_compare = depth},
                              all));
    }
    return &made;
  };
  bands_ = sky_ = surfaces_ = put_off_pipeline_ = nullptr;
  in_stencil_ = in_image && drawing.behind && !drawing.whole_mirror;
  if (in_stencil_) {
    // As the two below, told apart by the stencil in place of depth.
    const auto in_mirror = [&](uint32_t part, uint32_t value,
                               std::initializer_list<Constant> more) -> world::Result<const Pipeline*> {
      auto all = with(more);
      all.insert(all.end(), {{kSpecShadedPart, part}, {kSpecClips, true}});
      Pipeline& made = pipelines_[all];
      if (!made) {
        GraphicsState state = where_stencil(context.targets, value);
        state.colour = {kColourFormat};
        TRY(made, make_graphics(context.device, whole_vert_spv, shade_frag_spv, state, all));
      }
      return &made;
    };
    TRY(sky_, in_mirror(kShadedSky, 1, {}));
    TRY(surfaces_,
        in_mirror(kShadedSurfaces, 2, {{kSpecShapes, any_shapes && !few_shapes}, {kSpecSeenPutOff, put_off}}));
  } else if (in_image) {
    // Depth is reversed, and 0 where nothing is seen.
    TRY(sky_, whole(kShadedSky, VK_COMPARE_OP_EQUAL, {}));
    TRY(surfaces_,
        whole(kShadedSurfaces, VK_COMPARE_OP_LESS,
              {{kSpecShapes, any_shapes && !few_shapes}, {kSpecSeenPutOff, put_off}, {kSpecCountsRays, counts_rays_}}));
  } else {
    TRY(bands_, compute(false));
  }
  if (put_off) {
    TRY(put_off_pipeline_, compute(true));
  }
  const VkExtent2D extent = context.targets.extent();
  const uint64_t most = put_off_pipeline_ ? uint64_t{extent.width} * extent.height : 0;
  TRY_STATUS(context.fill(put_off_, nullptr, most * sizeof(uint32_t), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                          gpu::MemoryUse::device));
  TRY_STATUS(put_off_dispatch_.prepare(context.device, context.slices,
                                       put_off_pipeline_ ? VkPipeline{put_off_pipeline_->handle} : VK_NULL_HANDLE,
                                       groups_of(most)));
  context.bindings.bind(kBindPutOff, put_off_);
  context.bindings.bind(kBindPutOffDispatch, put_off_dispatch_.arguments());
  std::vector<uvec4> materials;
  materials.reserve(drawing.shading.materials.size() * 2);
  for (size_t id = 0; id < drawing.shading.materials.size(); ++id) {
    const Shading::Material& m = drawing.shading.materials[id];
    const auto add = [&](const float(&bands)[3], uint32_t w) {
      materials.emplace_back(std::bit_cast<uint32_t>(bands[0]), std::bit_cast<uint32_t>(bands[1]),
                             std::bit_cast<uint32_t>(bands[2]), w);
    };
    const TextureOfBlock texture = id < drawing.block_textures.size() ? drawing.block_textures[id] : TextureOfBlock{};
    add(m.albedo, texture.tiles);
    add(m.emitted, std::bit_cast<uint32_t>(texture.contrast));
  }
  TRY_STATUS(
      context.fill_texels(materials_, VK_FORMAT_R32G32B32A32_UINT, materials.data(), materials.size() * sizeof(uvec4)));
  context.bindings.bind(kBindMaterials, materials_);
  return {};
}

void ShadePass::record(VkCommandBuffer commands, PassContext& context, const Drawing&) {
  const Targets& targets = context.targets;
  const uint32_t height = targets.extent().height, width = targets.extent().width;
  image_barrier(commands, targets.seen.handle, VK_IMAGE_ASPECT_COLOR_BIT, kColourReadWrite,
                kComputeRead | kFragmentRead);
  begin_put_off(commands);
  if (surfaces_) {
    image_barrier(commands, targets.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT, kDepthReadWrite, kDepthReadWrite);
    const VkImageView colour = targets.colour.view;
    if (in_stencil_)
      begin_with_stencil(commands, targets, {&colour, 1}, false, true);
    else
      begin_rendering(commands, targets, {&colour, 1}, targets.depth.view, false);
    for (const Pipeline* part : {sky_, surfaces_}) {
      context.bindings.use(commands, *part);
      context.slices.draw(commands, part->handle, targets.extent());
    }
    vkCmdEndRendering(commands);
    image_barrier(commands, targets.colour.handle, VK_IMAGE_ASPECT_COLOR_BIT, kColourReadWrite, kComputeReadWrite);
    record_put_off(commands, context);
    return;
  }
  const uint64_t row_bytes = sizeof(Rgb) * uint64_t{width};
  for (uint32_t first = 0; first < height; first += targets.band_rows) {
    const uint32_t rows = std::min(targets.band_rows, height - first);
    context.bindings.bind(kBindRadiance, targets.radiance, first * row_bytes, rows * row_bytes);
    context.bindings.use(commands, *bands_);
    context.slices.dispatch(commands, bands_->handle, {width, rows}, [&](const auto& first_group) {
      bands_->push(commands, std::array{first_group[0], first_group[1], first, rows});
    });
  }
  if (counts_rays_) put_off_dispatch_.read_head(commands);
}

void ShadePass::begin_put_off(VkCommandBuffer commands) {
  if (!put_off_pipeline_ && !counts_rays_) return;
  memory_barrier(commands, kComputeReadWrite | kIndirectRead, kClearWrite);
  put_off_dispatch_.clear(commands);
  memory_barrier(commands, kClearWrite, kComputeReadWrite | kFragmentReadWrite);
}

void ShadePass::record_put_off(VkCommandBuffer commands, PassContext& context) {
  if (!put_off_pipeline_) {
    if (counts_rays_) put_off_dispatch_.read_head(commands);
    return;
  }
  memory_barrier(commands, kComputeWrite | kFragmentReadWrite, kComputeReadWrite | kIndirectRead);
  context.times.mark(commands, "shade_put_off");
  context.bindings.use(commands, *put_off_pipeline_);
  put_off_dispatch_.record(commands, context.slices, [&](uint32_t first_group) {
    put_off_pipeline_->push(commands, std::array{first_group, 0u, 0u, context.targets.extent().height});
  });
}

world::Status ShadePass::finish(PassContext& context, FrameReport& report) {
  const VkExtent2D extent = context.targets.extent();
  row_of(report, "shade").bytes = uint64_t{extent.width} * extent.height * sizeof(Rgb);
  const shared::ListHead& counted = put_off_dispatch_.head();
  if (counts_rays_) report.work.push_back({"sun_rays", counted.counted});
  if (!put_off_pipeline_) return {};
  put_off_dispatch_.finish(context.slices, groups_of(counted.listed));
  report.work.push_back({"pixels_put_off", counted.listed});
  return {};
}

}  // namespace render::raster
