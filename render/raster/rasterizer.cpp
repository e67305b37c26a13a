#include "render/raster/rasterizer.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "render/raster/stopwatch.h"
#include "world/base/jobs.h"

namespace render::raster {

namespace {

/// No camera is nearer than this to a plane of the grid, m: one on a plane is moved off it. Clipping in float can place
/// no nearer face.
constexpr double kOffPlane = 1e-9;

PictureConstants picture_constants(const Drawing& drawing, const ShadowGrid& grid, const LightGrid& lit,
                                   const shared::SunMapFrame& map) {
  const Camera& camera = drawing.camera;
  const PixelRays& rays = drawing.rays;
  const world::Environment& environment = drawing.environment;
  const Shading& shading = drawing.shading;
  const SurfaceLightDecoder light(drawing.light, shading);
  PictureConstants p{};
  set_view(p, camera, rays, drawing.near, drawing.width, drawing.height);
  p.sun = to_vec4(environment.sun_direction, drawing.knobs.view_distance);
  p.sky_zenith = to_vec4(environment.sky_zenith);
  p.sky_horizon = to_vec4(environment.sky_horizon);
  p.sky_ground = to_vec4(environment.sky_ground);
  for (int level = 0; level < 16; ++level) {
    p.level_sky[level / 4][level % 4] = light.sky[static_cast<size_t>(level)];
    p.level_block[level / 4][level % 4] = light.block[static_cast<size_t>(level)];
  }
  p.light = ivec4(static_cast<int>(lit.table_size() - 1), 0, 0, 0);
  const world::VoxelPos voxel = camera.position.voxel;
  if (const MirrorPlane* behind = drawing.behind)
    p.light = ivec4(p.light.x, behind->axis, behind->plane - voxel[behind->axis], behind->side);
  const world::RegionPos low = grid.min_region(), high = grid.max_region();
  p.camera_voxel = ivec4(voxel.x, voxel.y, voxel.z, 0);
  p.region_min = ivec4(low.x, low.y, low.z, static_cast<int>(grid.table_size() - 1));
  p.region_max = ivec4(high.x, high.y, high.z, 0);
  if (drawing.sky.light) p.sky = drawing.sky.light->model();
  const auto& clouds = drawing.sky.clouds;
  // The camera of a mirror's picture is elsewhere.
  if (clouds.steps > 0 || clouds.shadows)
    p.clouds = clouds.from == voxel ? clouds.layer : world::cloud_layer(environment, voxel);
  p.sun_irradiance =
      to_vec4(Vec3d(environment.sun_irradiance.r, environment.sun_irradiance.g, environment.sun_irradiance.b),
              drawing.knobs.occlusion_distance);
  p.map_u = map.u, p.map_v = map.v, p.map_w = map.w, p.map_low = map.low, p.map_size = map.size;
  return p;
}

}  // namespace

world::Result<std::unique_ptr<Rasterizer>> Rasterizer::make(const gpu::DeviceOptions& options) {
  std::unique_ptr<Rasterizer> made(new Rasterizer);
  TRY_STATUS(made->open(options));
  return made;
}

world::Status Rasterizer::open(const gpu::DeviceOptions& options) {
  TRY(device_, gpu::Device::make(options));
  TRY_STATUS(bindings_.open(*device_));
  TRY_STATUS(times_.open(*device_));
  TRY_STATUS(light_grid_.open(*device_));
  TRY_STATUS(fill_textures({}));
  TRY_STATUS(sun_heights_.open(*device_));
  TRY(sun_map_, gpu::make_texel_buffer(*device_, 0, VK_FORMAT_R32_SFLOAT, 0, gpu::MemoryUse::upload));
  stages_.resize(pass_kinds().size());
  set_level_count(0);
  return shadow_grid_.open(*device_);
}

void Rasterizer::set_level_count(int levels) {
  levels_.resize(static_cast<size_t>(levels) + 1);
  extracted_.resize(levels_.size());
  for (auto& level : levels_)
    if (!level) level = std::make_unique<FacePool>();
}

world::Result<uint64_t> Rasterizer::set_faces(std::span<const ExtractedChunk* const> chunks,
                                              const std::vector<bool>& trees) {
  if (splits_trees_ == trees.empty()) {
    splits_trees_ = !trees.empty();
    levels_[0]->clear();
    trees_.clear();
  }
  if (!splits_trees_) return set_level(0, chunks);
  extracted_[0] = chunks;
  return trees_.update(*device_, chunks, trees, *levels_[0]);
}

world::Result<uint64_t> Rasterizer::set_level(int level, std::span<const ExtractedChunk* const> chunks) {
  extracted_[static_cast<size_t>(level)] = chunks;
  FacePool& pool = *levels_[static_cast<size_t>(level)];
  if (pool.holds(chunks)) return uint64_t{0};
  return pool.update(*device_, pool_sources(chunks));
}

world::Result<uint64_t> Rasterizer::set_shapes(const ShapeExtractor* shapes) {
  block_shapes_ = shapes && shapes->any() ? shapes : nullptr;
  std::span<const ShapeChunk* const> chunks;
  if (block_shapes_) chunks = shapes->chunks();
  if (shape_pool_.holds(chunks) && shape_points_.holds(chunks)) return uint64_t{0};
  TRY(const uint64_t of_faces, shape_pool_.update(*device_, pool_sources(chunks)));
  TRY(const uint64_t of_points, shape_points_.update(*device_, instance_sources(chunks)));
  return of_faces + of_points;
}

/// What the knob asks for, or where the device hasn't that the format that every device has, and a warning.
VkFormat Rasterizer::depth_format(DepthFormat asked) {
  warning_.clear();
  const VkFormat format = asked == DepthFormat::d16   ? VK_FORMAT_D16_UNORM
                          : asked == DepthFormat::d24 ? VK_FORMAT_X8_D24_UNORM_PACK32
                                                      : kDepthFormat;
  constexpr VkFormatFeatureFlags kNeeded =
      VK_FORMAT_FEATURE_DEPTH_STENCIL_ATTACHMENT_BIT | VK_FORMAT_FEATURE_SAMPLED_IMAGE_BIT;
  if (format == kDepthFormat || device_->has_format(format, kNeeded)) return format;
  warning_ = "this device has no depth of " + std::string(knob_choices(asked)[static_cast<size_t>(asked)]) +
             ": depth_format=d32 in its place";
  return kDepthFormat;
}

world::Status Rasterizer::fit_targets(int width, int height, const TargetNeeds& needs, VkFormat depth) {
  const bool has_colour = targets_.colour.handle != VK_NULL_HANDLE;
  if (targets_.width == width && targets_.height == height && has_colour == needs.colour &&
      targets_.depth_format == depth)
    return {};
  const uint32_t limit = device_->limits().maxImageDimension2D;
  if (width < 1 || height < 1 || static_cast<uint32_t>(width) > limit || static_cast<uint32_t>(height) > limit)
    return world::usage_error("the picture's size " + std::to_string(width) + "x" + std::to_string(height) +
                              " must lie within 1x1 and " + std::to_string(limit) + "x" + std::to_string(limit));
  targets_ = {};
  colour_copy_ = {};
  // One of them won't be made.
  bindings_.forget(kBindRadiance);
  bindings_.forget(kBindColour);
  for (Stage& stage : stages_) stage.fits = false;
  targets_.depth_format = depth;
  const VkExtent2D extent{static_cast<uint32_t>(width), static_cast<uint32_t>(height)};
  // A processor writes them by dispatches too: face_blocks.h.
  const bool written = device_->is_processor();
  TRY(targets_.seen, gpu::make_host_image(*device_, extent, kSeenFormat,
                                          VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_SAMPLED_BIT));
  TRY(targets_.depth, gpu::make_image(*device_, extent, depth,
                                      VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT | VK_IMAGE_USAGE_SAMPLED_BIT |
                                          (written ? VK_IMAGE_USAGE_TRANSFER_DST_BIT : 0),
                                      VK_IMAGE_ASPECT_DEPTH_BIT));
  const uint64_t pixels = uint64_t{extent.width} * extent.height;
  if (needs.colour) {
    TRY(targets_.colour, gpu::make_host_image(*device_, extent, kColourFormat,
                                              VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_SAMPLED_BIT |
                                                  VK_IMAGE_USAGE_STORAGE_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT |
                                                  VK_IMAGE_USAGE_TRANSFER_DST_BIT));
  } else {
    TRY(targets_.radiance,
        gpu::make_buffer(*device_, pixels * sizeof(Rgb), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, gpu::MemoryUse::readback));
  }
  // Bands of a multiple of 64 rows start at multiples of 768 bytes, which suits every device's offset alignment. One of
  // an image is bound by the list of its pixels.
  const uint64_t range = std::min<uint64_t>(binding_limit, device_->limits().maxStorageBufferRange);
  const uint64_t rows = range / ((needs.colour ? sizeof(uint32_t) : sizeof(Rgb)) * extent.width);
  targets_.band_rows = static_cast<uint32_t>(std::clamp<uint64_t>(rows / 64 * 64, 64, 64 * 1024));
  targets_.width = width;
  targets_.height = height;
  return {};
}

world::Status Rasterizer::bind_shared(const Drawing& drawing) {
  PictureConstants constants = picture_constants(drawing, shadow_grid_, light_grid_, sun_map_frame_);
  lighting_.describe(drawing.view, drawing.camera, drawing.knobs, seed, constants);
  sun_heights_.describe(drawing.camera, constants);
  triangles_.describe(constants);
  triangle_light_.describe(constants);
  TRY_STATUS(context().fill(picture_, &constants, sizeof constants, VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT));
  bindings_.bind(kBindPicture, picture_);
  vec4 face_lit[2 * world::kFaces];
  for (int f = 0; f < world::kFaces; ++f) {
    face_lit[f] = to_vec4(drawing.shading.sky_lit[f]);
    face_lit[world::kFaces + f] = to_vec4(drawing.shading.sun_lit[f], drawing.shading.sun_faces[f] ? 1.0f : 0.0f);
  }
  TRY_STATUS(context().fill_texels(face_lit_, VK_FORMAT_R32G32B32A32_SFLOAT, face_lit, sizeof face_lit));
  bindings_.bind(kBindFaceLit, face_lit_);
  bindings_.bind(kBindRegions, shadow_grid_.regions());
  bindings_.bind(kBindLeaves, shadow_grid_.leaves());
  bindings_.bind(kBindMasks, shadow_grid_.masks());
  bindings_.bind(kBindLightRegions, light_grid_.regions());
  bindings_.bind(kBindLightLeafOf, light_grid_.leaf_of());
  bindings_.bind(kBindLightLeaves, light_grid_.leaves());
  bindings_.bind(kBindLightCodes, light_grid_.codes());
  bindings_.bind(kBindSunHeights, sun_heights_.cells());
  bindings_.bind(kBindSunMap, sun_map_);
  sun_blockers_.bind(bindings_);
  // Where there is none, an empty one is bound.
  const auto bind_if_made = [&](uint32_t binding, const gpu::Buffer& buffer) {
    buffer.handle ? bindings_.bind(binding, buffer) : bindings_.forget(binding);
  };
  bind_if_made(kBindLighting, lighting_.words());
  bind_if_made(kBindMedia, lighting_.media_texels());
  bind_if_made(kBindSeenLuminaires, lighting_.seen());
  bind_if_made(kBindMeshes, triangles_.texels());
  bind_if_made(kBindVoxelLeaves, triangle_light_.leaves());
  bind_if_made(kBindVoxelCodes, triangle_light_.codes());
  if (!triangles_.empty()) {
    std::vector<vec4> sky;
    static_assert(kSkyAngles == world::SkyLight::kAngles);
    if (drawing.sky.light)
      for (const world::Irradiance3& e : drawing.sky.light->irradiances()) sky.emplace_back(e.r, e.g, e.b, 0);
    TRY_STATUS(
        context().fill_texels(sky_table_, VK_FORMAT_R32G32B32A32_SFLOAT, sky.data(), sky.size() * sizeof sky[0]));
    bindings_.bind(kBindSkyTable, sky_table_);
  }
  bindings_.bind(kBindTexels, texels_);
  bindings_.bind(kBindSeen, targets_.seen);
  bindings_.bind(kBindDepth, targets_.depth);
  // What the other way of reading back had bound is gone with its targets.
  bindings_.forget(targets_.colour.handle ? kBindRadiance : kBindColour);
  if (targets_.colour.handle) bindings_.bind(kBindColour, targets_.colour);
  return {};
}

world::Status Rasterizer::record(VkCommandBuffer commands, const Drawing& drawing) {
  PassContext shared = context();
  times_.begin(commands);
  image_discard(commands, targets_.seen.handle, VK_IMAGE_ASPECT_COLOR_BIT, kComputeRead, kColourReadWrite);
  image_discard(commands, targets_.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT, kDepthReadWrite | kComputeRead,
                kDepthReadWrite);
  if (targets_.colour.handle)
    image_discard(commands, targets_.colour.handle, VK_IMAGE_ASPECT_COLOR_BIT, kCopyRead,
                  kComputeWrite | kColourReadWrite);
  const auto kinds = pass_kinds();
  for (size_t i = 0; i < kinds.size(); ++i) {
    if (!stages_[i].called_for) continue;
    times_.mark(commands, kinds[i].name);
    stages_[i].pass->record(commands, shared, drawing);
  }
  record_read_back(commands);
  if (finishes_) effects_.record(commands, [&](const char* name) { times_.mark(commands, name); });
  times_.end(commands);
  return bindings_.status();
}

void Rasterizer::record_read_back(VkCommandBuffer commands) {
  if (!targets_.colour.handle) return memory_barrier(commands, kComputeWrite, kHostRead);
  image_barrier(commands, targets_.colour.handle, VK_IMAGE_ASPECT_COLOR_BIT, kColourReadWrite | kComputeReadWrite,
                copies_colour() ? kCopyRead : kHostRead);
  if (!copies_colour()) return;
  VkBufferImageCopy copy{};
  copy.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
  copy.imageExtent = {targets_.extent().width, targets_.extent().height, 1};
  vkCmdCopyImageToBuffer(commands, targets_.colour.handle, VK_IMAGE_LAYOUT_GENERAL, colour_copy_.handle, 1, &copy);
  memory_barrier(commands, kCopyWrite, kHostRead);
}

void Rasterizer::read_back(Image& image) const {
  if (!targets_.colour.handle) {
    std::memcpy(image.pixels.data(), targets_.radiance.mapped(), image.pixels.size() * sizeof(Rgb));
    return;
  }
  const auto width = static_cast<size_t>(image.width);
  world::parallel_ranges(static_cast<size_t>(image.height), 64, [&](size_t begin, size_t end) {
    for (size_t y = begin; y < end; ++y) {
      const auto* colour = copies_colour()
                               ? reinterpret_cast<const vec4*>(colour_copy_.mapped()) + y * width
                               : reinterpret_cast<const vec4*>(targets_.colour.row(static_cast<uint32_t>(y)));
      Rgb* pixel = image.pixels.data() + y * width;
      for (size_t x = 0; x < width; ++x) pixel[x] = {colour[x].r, colour[x].g, colour[x].b};
    }
  });
}

world::Result<uint64_t> Rasterizer::follow_sun_maps(const SunMaps& maps) {
  if (maps.version() == sun_map_version_) return uint64_t{0};
  const std::span<const float> words = maps.words();
  uint64_t bytes = words.size_bytes();
  const uint64_t limit = std::min(binding_limit, uint64_t{4} * device_->limits().maxTexelBufferElements);
  if (bytes > limit)
    return world::usage_error("the sun's map is too large for this device (" + std::to_string(bytes >> 20) +
                              " MiB, at most " + std::to_string(limit >> 20) +
                              "); set a larger sun_map_texel, or fewer sun_cascade_texels");
  if (!maps.changed().empty() && maps.version() == sun_map_version_ + 1 && sun_map_.size >= bytes) {
    bytes = 0;
    for (const SunCascades::Run& run : maps.changed()) {
      const std::span<const float> part = words.subspan(run.first, run.count);
      std::memcpy(sun_map_.mapped() + run.first * sizeof(float), part.data(), part.size_bytes());
      bytes += part.size_bytes();
    }
  } else {
    TRY_STATUS(context().fill_texels(sun_map_, VK_FORMAT_R32_SFLOAT, words.data(), bytes));
  }
  sun_map_frame_ = maps.frame();
  sun_map_version_ = maps.version();
  return bytes;
}

/// Where there are none, a texel stands for them.
world::Status Rasterizer::fill_textures(const TextureSet& textures) {
  texels_ = {};
  block_textures_.clear();
  if (!textures.empty()) block_textures_ = textures.blocks();
  return context().fill_texels(texels_, VK_FORMAT_R8G8B8A8_SNORM, textures.texels().data(),
                               textures.texels().size() * sizeof(uint32_t));
}

world::Result<uint64_t> Rasterizer::follow_textures(const TextureSet& textures) {
  if (textures.version() == textures_version_) return uint64_t{0};
  textures_version_ = textures.version();
  TRY_STATUS(fill_textures(textures));
  return textures.bytes();
}

world::Result<Frame> Rasterizer::draw(const world::WorldView& view, const Camera& placed, const SkyView& sky,
                                      const Shading& shading, SurfaceLight::Kind light, const RenderKnobs& knobs,
                                      double near, int width, int height, const Finish& finish) {
  Stopwatch watch, whole;
  Camera camera = placed;
  // A camera on a face's plane sees the face on its upper side, as a ray does.
  camera.position.fraction = glm::clamp(camera.position.fraction, kOffPlane, 1 - kOffPlane);
  const PixelRays rays(camera, width, height);
  std::vector<FacePool*> levels;
  for (const auto& level : levels_) levels.push_back(level.get());
  TRY_STATUS(lighting_.see(*device_, camera, width, height));
  const Drawing drawing{view,
                        levels,
                        extracted_,
                        trees_,
                        shape_pool_,
                        shape_points_,
                        block_shapes_,
                        triangles_,
                        camera,
                        rays,
                        sky,
                        sky.environment,
                        lighting_,
                        block_textures_,
                        shading,
                        knobs,
                        light,
                        near,
                        width,
                        height,
                        finish.inhabitants,
                        impostor_bytes,
                        bare,
                        triangles_alone,
                        counts_sun_rays,
                        may_list_faces,
                        behind,
                        mirrored,
                        selected ? &*selected : nullptr,
                        whole_mirror,
                        sun_blockers_.any(),
                        liquid_levels};
  Frame frame;
  FrameReport& report = frame.report;

  // Which passes the picture calls for, and what they need.
  const auto kinds = pass_kinds();
  TargetNeeds needs;
  for (size_t i = 0; i < kinds.size(); ++i)
    stages_[i].called_for = (!bare || i == 0) && kinds[i].called_for(drawing, needs);
  // An image is shaded faster than bands, where a list of its pixels can be bound.
  const uint64_t range = std::min<uint64_t>(binding_limit, device_->limits().maxStorageBufferRange);
  if (!bare && uint64_t(std::max(width, 1)) * uint64_t(std::max(height, 1)) * sizeof(vec4) <= range)
    needs.colour = true;
  const VkFormat depth = depth_format(knobs.depth_format);
  if (depth != targets_.depth_format) {
    for (Stage& stage : stages_) stage.pass.reset(), stage.fits = false;  // their pipelines are for the other format
    bindings_.forget_all();
  }
  TRY_STATUS(fit_targets(width, height, needs, depth));
  TRY_STATUS(bindings_.begin_picture());
  TRY_STATUS(bind_shared(drawing));
  PassContext shared = context();
  for (size_t i = 0; i < kinds.size(); ++i) {
    Stage& stage = stages_[i];
    if (!stage.called_for) {
      // A picture for a mirror is part of another one, which may call for it.
      if (behind) continue;
      if (stage.pass) stage.pass->rest();
      stage.fits = false;
      continue;
    }
    if (!stage.pass) {
      auto made = kinds[i].make();
      TRY_STATUS(made->open(shared));
      stage.pass = std::move(made);
    }
    if (!stage.fits) TRY_STATUS(stage.pass->fit(shared));
    stage.fits = true;
    TRY_STATUS(stage.pass->prepare(shared, drawing, report));
  }
  const bool in_image = targets_.colour.handle != VK_NULL_HANDLE;
  const ShadedPicture shaded{in_image ? &colour_copy_ : &targets_.radiance, in_image ? 4u : 3u, finish.sample,
                             finish.samples};
  finishes_ = DeviceEffects::called_for(finish.plan, shaded);
  if (in_image && copies_colour() && !colour_copy_.handle) {
    TRY(colour_copy_,
        gpu::make_buffer(*device_, uint64_t{targets_.extent().width} * targets_.extent().height * sizeof(vec4),
                         VK_BUFFER_USAGE_TRANSFER_DST_BIT | VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                         gpu::MemoryUse::readback));
  }
  if (finishes_) TRY_STATUS(effects_.prepare(*device_, finish.plan, shaded));
  double prepare_ms = watch.lap_ms();
  for (const PassReport& row : report.passes) prepare_ms -= row.ms;
  report.passes.insert(report.passes.begin(), {"prepare", prepare_ms, 0, 0});

  TRY_STATUS(device_->run_checked([&](VkCommandBuffer commands) { return record(commands, drawing); }));
  TRY_STATUS(times_.report(report));
  watch.lap_ms();
  for (Stage& stage : stages_) {
    if (!stage.called_for) continue;
    TRY_STATUS(stage.pass->finish(shared, report));
    // Those behind it, which may remember pictures, never learn of this one.
    if (stage.pass->again()) return draw(view, placed, sky, shading, light, knobs, near, width, height, finish);
  }
  report.device = device_->name();
  if (!shaded.last()) {
    report.ms = whole.lap_ms();
    return frame;
  }
  frame.image = Image::unset(width, height);
  if (finishes_) {
    const EffectOutcome outcome = effects_.read(frame.image);
    report.metered_ev = outcome.metered_ev, report.not_finite = outcome.not_finite;
    for (const PassReport& pass : effect_passes(finish.plan)) {
      PassReport& row = row_of(report, pass.name);
      row.draws = pass.draws, row.bytes = pass.bytes;
    }
  } else {
    read_back(frame.image);
  }
  report.passes.push_back({"read_back", watch.lap_ms(), 0,
                           finishes_ ? finished_bytes(finish.plan) : frame.image.pixels.size() * sizeof(Rgb)});
  report.ms = whole.lap_ms();
  return frame;
}

}  // namespace render::raster
