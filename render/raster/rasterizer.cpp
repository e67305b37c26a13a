#include "render/raster/rasterizer.h"

#include <algorithm>
#include <chrono>
#include <cstring>

namespace render::raster {

namespace {

using Clock = std::chrono::steady_clock;
double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// Timestamps: start, after the first faces, the occlusion test, the second faces, and the shading.
constexpr uint32_t kTimes = 5;
/// A near plane below this makes interpolated depth too coarse for the occlusion test, m.
constexpr double kNearestForOcclusion = 0.005;

/// No camera is nearer than this to a plane of the grid, m: one on a plane is moved off it. Clipping in float can place
/// no nearer face.
constexpr double kOffPlane = 1e-9;

vec4 to_vec4(const Vec3d& v, double w = 0) { return vec4(glm::vec3(v), static_cast<float>(w)); }
vec4 to_vec4(const Rgb& c, float w = 0) { return vec4(c.r, c.g, c.b, w); }

PictureConstants picture_constants(const Camera& camera, const PixelRays& rays, const world::Environment& environment,
                                   const Shading& shading, const SurfaceLightDecoder& light, const RenderKnobs& knobs,
                                   const ShadowGrid& grid, const LightGrid& lit, double near, int width, int height) {
  PictureConstants p{};
  p.corner = to_vec4(rays.corner);
  p.step_x = to_vec4(rays.step_x);
  p.step_y = to_vec4(rays.step_y);
  p.clip_x = to_vec4(rays.right / rays.tan_half_x);
  p.clip_y = to_vec4(-rays.up / rays.tan_half_y);  // Vulkan's y points down
  p.clip_w = to_vec4(rays.forward);
  p.fraction = to_vec4(camera.position.fraction, near);
  p.fraction_rest = to_vec4(camera.position.fraction - Vec3d(glm::vec3(camera.position.fraction)));
  p.sun = to_vec4(environment.sun_direction, knobs.view_distance);
  p.sky_zenith = to_vec4(environment.sky_zenith);
  p.sky_horizon = to_vec4(environment.sky_horizon);
  p.sky_ground = to_vec4(environment.sky_ground);
  for (int f = 0; f < world::kFaces; ++f) {
    p.sky_lit[f] = to_vec4(shading.sky_lit[f]);
    p.sun_lit[f] = to_vec4(shading.sun_lit[f], shading.sun_faces[f] ? 1.0f : 0.0f);
  }
  for (int level = 0; level < 16; ++level) {
    p.level_sky[level / 4][level % 4] = light.sky[static_cast<size_t>(level)];
    p.level_block[level / 4][level % 4] = light.block[static_cast<size_t>(level)];
  }
  p.light = ivec4(static_cast<int>(lit.table_size() - 1), 0, 0, 0);
  const world::VoxelPos voxel = camera.position.voxel;
  const world::RegionPos low = grid.min_region(), high = grid.max_region();
  p.camera_voxel = ivec4(voxel.x, voxel.y, voxel.z, 0);
  p.region_min = ivec4(low.x, low.y, low.z, static_cast<int>(grid.table_size() - 1));
  p.region_max = ivec4(high.x, high.y, high.z, 0);
  const double metres_per_pixel = 2 * rays.tan_half_y / height;
  p.screen = vec4(width, height, static_cast<float>(1.25 / 256 * metres_per_pixel), 0);
  return p;
}

void image_barrier(VkCommandBuffer commands, VkImage image, VkImageAspectFlags aspect, VkImageLayout from,
                   VkPipelineStageFlags2 stage_from, VkAccessFlags2 access_from, VkPipelineStageFlags2 stage_to,
                   VkAccessFlags2 access_to) {
  auto barrier = gpu::vk_info<VkImageMemoryBarrier2>(VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2);
  barrier.srcStageMask = stage_from;
  barrier.srcAccessMask = access_from;
  barrier.dstStageMask = stage_to;
  barrier.dstAccessMask = access_to;
  barrier.oldLayout = from;
  barrier.newLayout = VK_IMAGE_LAYOUT_GENERAL;
  barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  barrier.image = image;
  barrier.subresourceRange = {aspect, 0, 1, 0, 1};
  auto info = gpu::vk_info<VkDependencyInfo>(VK_STRUCTURE_TYPE_DEPENDENCY_INFO);
  info.imageMemoryBarrierCount = 1;
  info.pImageMemoryBarriers = &barrier;
  vkCmdPipelineBarrier2(commands, &info);
}

constexpr VkPipelineStageFlags2 kDepthStages =
    VK_PIPELINE_STAGE_2_EARLY_FRAGMENT_TESTS_BIT | VK_PIPELINE_STAGE_2_LATE_FRAGMENT_TESTS_BIT;

void memory_barrier(VkCommandBuffer commands, VkPipelineStageFlags2 stage_from, VkAccessFlags2 access_from,
                    VkPipelineStageFlags2 stage_to, VkAccessFlags2 access_to) {
  auto barrier = gpu::vk_info<VkMemoryBarrier2>(VK_STRUCTURE_TYPE_MEMORY_BARRIER_2);
  barrier.srcStageMask = stage_from;
  barrier.srcAccessMask = access_from;
  barrier.dstStageMask = stage_to;
  barrier.dstAccessMask = access_to;
  auto info = gpu::vk_info<VkDependencyInfo>(VK_STRUCTURE_TYPE_DEPENDENCY_INFO);
  info.memoryBarrierCount = 1;
  info.pMemoryBarriers = &barrier;
  vkCmdPipelineBarrier2(commands, &info);
}

}  // namespace

world::Result<std::unique_ptr<Rasterizer>> Rasterizer::make(const gpu::DeviceOptions& options) {
  std::unique_ptr<Rasterizer> made(new Rasterizer);
  TRY_STATUS(made->open(options));
  return made;
}

world::Status Rasterizer::open(const gpu::DeviceOptions& options) {
  TRY(device_, gpu::Device::make(options));
  TRY_STATUS(pipelines_.open(*device_));
  auto queries = gpu::vk_info<VkQueryPoolCreateInfo>(VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO);
  queries.queryType = VK_QUERY_TYPE_TIMESTAMP;
  queries.queryCount = kTimes;
  VkQueryPool pool = VK_NULL_HANDLE;
  VK_CHECK(vkCreateQueryPool(device_->handle(), &queries, nullptr, &pool));
  times_ = gpu::Owned<VkQueryPool>(*device_, pool);
  TRY_STATUS(light_grid_.open(*device_));
  TRY(sun_map_, gpu::make_buffer(*device_, 0, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, gpu::MemoryUse::upload));
  return shadow_grid_.open(*device_);
}

world::Status Rasterizer::fit_targets(int width, int height) {
  if (targets_.width == width && targets_.height == height) return {};
  const uint32_t limit = device_->limits().maxImageDimension2D;
  if (width < 1 || height < 1 || static_cast<uint32_t>(width) > limit || static_cast<uint32_t>(height) > limit)
    return world::usage_error("the picture's size " + std::to_string(width) + "x" + std::to_string(height) +
                              " must lie within 1x1 and " + std::to_string(limit) + "x" + std::to_string(limit));
  targets_ = {};
  const VkExtent2D extent{static_cast<uint32_t>(width), static_cast<uint32_t>(height)};
  TRY(targets_.seen,
      gpu::make_image(*device_, extent, kSeenFormat, VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_SAMPLED_BIT,
                      VK_IMAGE_ASPECT_COLOR_BIT));
  TRY(targets_.depth, gpu::make_image(*device_, extent, kDepthFormat,
                                      VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT | VK_IMAGE_USAGE_SAMPLED_BIT,
                                      VK_IMAGE_ASPECT_DEPTH_BIT));
  TRY(targets_.radiance, gpu::make_buffer(*device_, uint64_t{extent.width} * extent.height * sizeof(Rgb),
                                          VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, gpu::MemoryUse::readback));
  const uint64_t tiles =
      uint64_t{(extent.width + kTilePixels - 1) / kTilePixels} * ((extent.height + kTilePixels - 1) / kTilePixels);
  TRY(targets_.tiles,
      gpu::make_buffer(*device_, tiles * sizeof(float), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, gpu::MemoryUse::device));
  // Bands of a multiple of 64 rows start at multiples of 768 bytes, which suits every device's offset alignment.
  const uint64_t range = std::min<uint64_t>(binding_limit, device_->limits().maxStorageBufferRange);
  const uint64_t rows = range / (sizeof(Rgb) * extent.width);
  targets_.band_rows = static_cast<uint32_t>(std::clamp<uint64_t>(rows / 64 * 64, 64, 64 * 1024));
  targets_.width = width;
  targets_.height = height;
  return {};
}

world::Status Rasterizer::fit_indices() {
  if (indexed_records_ && indexed_records_ >= pool_.largest_chunk()) return {};
  const uint32_t records = std::max(4096u, pool_.largest_chunk() + pool_.largest_chunk() / 2);
  TRY(indices_,
      gpu::make_buffer(*device_, uint64_t{records} * 24, VK_BUFFER_USAGE_INDEX_BUFFER_BIT, gpu::MemoryUse::upload));
  auto* index = reinterpret_cast<uint32_t*>(indices_.mapped());
  for (uint32_t r = 0; r < records; ++r)
    for (const uint32_t corner : {0u, 1u, 2u, 2u, 1u, 3u}) *index++ = 4 * r + corner;
  indexed_records_ = records;
  return {};
}

world::Status Rasterizer::fill(gpu::Buffer& buffer, const void* data, size_t bytes, VkBufferUsageFlags usage,
                               gpu::MemoryUse use) {
  if (buffer.size < bytes || !buffer.handle) {
    TRY(buffer, gpu::make_buffer(*device_, bytes + bytes / 2, usage, use));
  }
  if (bytes && data) std::memcpy(buffer.mapped(), data, bytes);
  return {};
}

world::Status Rasterizer::write_sets() {
  const uint32_t bands = (static_cast<uint32_t>(targets_.height) + targets_.band_rows - 1) / targets_.band_rows;
  const uint32_t sets = static_cast<uint32_t>(pool_.pages()) + bands;  // the occlusion test uses the first band's
  if (sets > descriptor_sets_) {
    const VkDescriptorPoolSize sizes[] = {{VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, sets},
                                          {VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE, sets * 2},
                                          {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, sets * kBindings}};
    auto info = gpu::vk_info<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
    info.maxSets = sets;
    info.poolSizeCount = 3;
    info.pPoolSizes = sizes;
    VkDescriptorPool pool = VK_NULL_HANDLE;
    VK_CHECK(vkCreateDescriptorPool(device_->handle(), &info, nullptr, &pool));
    descriptors_ = gpu::Owned<VkDescriptorPool>(*device_, pool);
    descriptor_sets_ = sets;
  } else {
    VK_CHECK(vkResetDescriptorPool(device_->handle(), descriptors_, 0));
  }
  std::vector<VkDescriptorSet> all(sets);
  const std::vector<VkDescriptorSetLayout> layouts(sets, pipelines_.set_layout());
  auto info = gpu::vk_info<VkDescriptorSetAllocateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO);
  info.descriptorPool = descriptors_;
  info.descriptorSetCount = sets;
  info.pSetLayouts = layouts.data();
  VK_CHECK(vkAllocateDescriptorSets(device_->handle(), &info, all.data()));
  page_sets_.assign(all.begin(), all.begin() + static_cast<ptrdiff_t>(pool_.pages()));
  band_sets_.assign(all.begin() + static_cast<ptrdiff_t>(pool_.pages()), all.end());

  const auto write = [&](VkDescriptorSet set, uint32_t binding, const gpu::Buffer& buffer, VkDeviceSize offset = 0,
                         VkDeviceSize range = VK_WHOLE_SIZE) {
    const VkDescriptorBufferInfo what{buffer.handle, offset, range};
    auto w = gpu::vk_info<VkWriteDescriptorSet>(VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET);
    w.dstSet = set;
    w.dstBinding = binding;
    w.descriptorCount = 1;
    w.descriptorType = binding == kBindPicture ? VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER : VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    w.pBufferInfo = &what;
    vkUpdateDescriptorSets(device_->handle(), 1, &w, 0, nullptr);
  };
  const auto write_image = [&](VkDescriptorSet set, uint32_t binding, VkImageView view) {
    const VkDescriptorImageInfo what{VK_NULL_HANDLE, view, VK_IMAGE_LAYOUT_GENERAL};
    auto w = gpu::vk_info<VkWriteDescriptorSet>(VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET);
    w.dstSet = set;
    w.dstBinding = binding;
    w.descriptorCount = 1;
    w.descriptorType = VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE;
    w.pImageInfo = &what;
    vkUpdateDescriptorSets(device_->handle(), 1, &w, 0, nullptr);
  };
  for (size_t page = 0; page < page_sets_.size(); ++page) {
    write(page_sets_[page], kBindPicture, picture_);
    write(page_sets_[page], kBindFaces, pool_.page(page));
    write(page_sets_[page], kBindChunks, chunks_);
  }
  const uint64_t row_bytes = sizeof(Rgb) * static_cast<uint64_t>(targets_.width);
  for (uint32_t band = 0; band < bands; ++band) {
    const VkDescriptorSet set = band_sets_[band];
    const uint32_t first = band * targets_.band_rows;
    const uint32_t rows = std::min(targets_.band_rows, static_cast<uint32_t>(targets_.height) - first);
    write(set, kBindPicture, picture_);
    write(set, kBindMaterials, materials_);
    write(set, kBindRadiance, targets_.radiance, first * row_bytes, rows * row_bytes);
    write(set, kBindRegions, shadow_grid_.regions());
    write(set, kBindGroups, shadow_grid_.groups());
    write(set, kBindMasks, shadow_grid_.masks());
    write(set, kBindLightRegions, light_grid_.regions());
    write(set, kBindLightLeafOf, light_grid_.leaf_of());
    write(set, kBindLightLeaves, light_grid_.leaves());
    write(set, kBindLightCodes, light_grid_.codes());
    write(set, kBindSunMap, sun_map_);
    write(set, kBindTiles, targets_.tiles);
    write(set, kBindCandidates, candidates_);
    write(set, kBindDraws, draws_);
    write(set, kBindVisible, visible_);
    write_image(set, kBindSeen, targets_.seen.view);
    write_image(set, kBindDepth, targets_.depth.view);
  }
  return {};
}

void Rasterizer::record_faces(VkCommandBuffer commands, VkPipeline faces, bool second) {
  auto colour = gpu::vk_info<VkRenderingAttachmentInfo>(VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO);
  colour.imageView = targets_.seen.view;
  colour.imageLayout = VK_IMAGE_LAYOUT_GENERAL;
  colour.loadOp = second ? VK_ATTACHMENT_LOAD_OP_LOAD : VK_ATTACHMENT_LOAD_OP_CLEAR;  // 0: sees no face
  colour.storeOp = VK_ATTACHMENT_STORE_OP_STORE;
  auto depth = gpu::vk_info<VkRenderingAttachmentInfo>(VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO);
  depth.imageView = targets_.depth.view;
  depth.imageLayout = VK_IMAGE_LAYOUT_GENERAL;
  depth.loadOp = colour.loadOp;
  depth.storeOp = VK_ATTACHMENT_STORE_OP_STORE;
  depth.clearValue.depthStencil.depth = 0;  // reversed: infinitely far
  auto rendering = gpu::vk_info<VkRenderingInfo>(VK_STRUCTURE_TYPE_RENDERING_INFO);
  rendering.renderArea = {{0, 0}, targets_.seen.extent};
  rendering.layerCount = 1;
  rendering.colorAttachmentCount = 1;
  rendering.pColorAttachments = &colour;
  rendering.pDepthAttachment = &depth;
  vkCmdBeginRendering(commands, &rendering);
  const VkViewport viewport{0, 0, static_cast<float>(targets_.width), static_cast<float>(targets_.height), 0, 1};
  vkCmdSetViewport(commands, 0, 1, &viewport);
  vkCmdSetScissor(commands, 0, 1, &rendering.renderArea);
  vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, faces);
  vkCmdBindIndexBuffer(commands, indices_.handle, 0, VK_INDEX_TYPE_UINT32);
  constexpr uint32_t kDrawBytes = sizeof(VkDrawIndexedIndirectCommand);
  uint32_t draw = second && !list_.first_end.empty() ? list_.first_end.back() : 0;
  const std::vector<uint32_t>& ends = second ? list_.second_end : list_.first_end;
  for (size_t page = 0; page < ends.size(); ++page) {
    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipelines_.layout(), 0, 1, &page_sets_[page], 0,
                            nullptr);
    while (draw < ends[page]) {
      const uint32_t some = std::min(ends[page] - draw, device_->limits().maxDrawIndirectCount);
      vkCmdDrawIndexedIndirect(commands, draws_.handle, uint64_t{draw} * kDrawBytes, some, kDrawBytes);
      draw += some;
    }
  }
  vkCmdEndRendering(commands);
}

void Rasterizer::record_occlusion(VkCommandBuffer commands) {
  image_barrier(commands, targets_.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT, VK_IMAGE_LAYOUT_GENERAL, kDepthStages,
                VK_ACCESS_2_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT, VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT,
                VK_ACCESS_2_SHADER_SAMPLED_READ_BIT);
  vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipelines_.layout(), 0, 1, &band_sets_[0], 0,
                          nullptr);
  const auto tiles = [](int pixels) { return (static_cast<uint32_t>(pixels) + kTilePixels - 1) / kTilePixels; };
  vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipelines_.depth_tiles());
  vkCmdDispatch(commands, (tiles(targets_.width) + 15) / 16, (tiles(targets_.height) + 3) / 4, 1);
  memory_barrier(commands, VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT,
                 VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, VK_ACCESS_2_SHADER_STORAGE_READ_BIT);
  // The test writes into draws that the first pass may still read.
  memory_barrier(commands, VK_PIPELINE_STAGE_2_DRAW_INDIRECT_BIT, 0, VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT,
                 VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT);
  const uint32_t count = static_cast<uint32_t>(list_.candidates.size());
  vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipelines_.occlusion());
  vkCmdPushConstants(commands, pipelines_.layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof count, &count);
  vkCmdDispatch(commands, (count + 63) / 64, 1, 1);
  memory_barrier(commands, VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT,
                 VK_PIPELINE_STAGE_2_DRAW_INDIRECT_BIT | VK_PIPELINE_STAGE_2_HOST_BIT,
                 VK_ACCESS_2_INDIRECT_COMMAND_READ_BIT | VK_ACCESS_2_HOST_READ_BIT);
  image_barrier(commands, targets_.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT, VK_IMAGE_LAYOUT_GENERAL,
                VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, 0, kDepthStages,
                VK_ACCESS_2_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT | VK_ACCESS_2_DEPTH_STENCIL_ATTACHMENT_READ_BIT);
  image_barrier(commands, targets_.seen.handle, VK_IMAGE_ASPECT_COLOR_BIT, VK_IMAGE_LAYOUT_GENERAL,
                VK_PIPELINE_STAGE_2_COLOR_ATTACHMENT_OUTPUT_BIT, VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT,
                VK_PIPELINE_STAGE_2_COLOR_ATTACHMENT_OUTPUT_BIT,
                VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT | VK_ACCESS_2_COLOR_ATTACHMENT_READ_BIT);
}

void Rasterizer::record_shading(VkCommandBuffer commands, VkPipeline shade) {
  image_barrier(commands, targets_.seen.handle, VK_IMAGE_ASPECT_COLOR_BIT, VK_IMAGE_LAYOUT_GENERAL,
                VK_PIPELINE_STAGE_2_COLOR_ATTACHMENT_OUTPUT_BIT, VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT,
                VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, VK_ACCESS_2_SHADER_SAMPLED_READ_BIT);
  vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, shade);
  for (uint32_t band = 0; band < band_sets_.size(); ++band) {
    const uint32_t first = band * targets_.band_rows;
    const uint32_t rows = std::min(targets_.band_rows, static_cast<uint32_t>(targets_.height) - first);
    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipelines_.layout(), 0, 1, &band_sets_[band], 0,
                            nullptr);
    vkCmdPushConstants(commands, pipelines_.layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof first, &first);
    vkCmdDispatch(commands, (static_cast<uint32_t>(targets_.width) + kShadeGroup - 1) / kShadeGroup,
                  (rows + kShadeGroup - 1) / kShadeGroup, 1);
  }
  memory_barrier(commands, VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT,
                 VK_PIPELINE_STAGE_2_HOST_BIT, VK_ACCESS_2_HOST_READ_BIT);
}

void Rasterizer::record(VkCommandBuffer commands, VkPipeline faces, VkPipeline shade) {
  const auto time = [&](uint32_t index) {
    vkCmdWriteTimestamp2(commands, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, times_, index);
  };
  vkCmdResetQueryPool(commands, times_, 0, kTimes);
  image_barrier(commands, targets_.seen.handle, VK_IMAGE_ASPECT_COLOR_BIT, VK_IMAGE_LAYOUT_UNDEFINED,
                VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, 0, VK_PIPELINE_STAGE_2_COLOR_ATTACHMENT_OUTPUT_BIT,
                VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT | VK_ACCESS_2_COLOR_ATTACHMENT_READ_BIT);
  image_barrier(commands, targets_.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT, VK_IMAGE_LAYOUT_UNDEFINED, kDepthStages,
                VK_ACCESS_2_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT, kDepthStages,
                VK_ACCESS_2_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT | VK_ACCESS_2_DEPTH_STENCIL_ATTACHMENT_READ_BIT);
  time(0);
  record_faces(commands, faces, false);
  time(1);
  if (!list_.candidates.empty()) {
    record_occlusion(commands);
    time(2);
    record_faces(commands, faces, true);
  } else {
    time(2);
  }
  time(3);
  record_shading(commands, shade);
  time(4);
}

world::Result<uint64_t> Rasterizer::follow_sun_map(const SunMap& map) {
  if (map.version() == sun_map_version_) return uint64_t{0};
  const uint64_t bytes = map.depths().size() * sizeof(float);
  const uint64_t limit = std::min<uint64_t>(binding_limit, device_->limits().maxStorageBufferRange);
  if (bytes > limit)
    return world::usage_error("the sun's map is too large for this device (" + std::to_string(bytes >> 20) +
                              " MiB, at most " + std::to_string(limit >> 20) + "); set a larger sun_map_texel");
  TRY_STATUS(fill(sun_map_, map.depths().data(), bytes, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT));
  sun_map_frame_ = map.frame();
  sun_map_version_ = map.version();
  return bytes;
}

world::Result<Frame> Rasterizer::draw(const Camera& placed, const world::Environment& environment,
                                      const Shading& shading, SurfaceLight::Kind light, const RenderKnobs& knobs,
                                      double near, int width, int height) {
  const auto start = Clock::now();
  TRY_STATUS(fit_targets(width, height));
  TRY_STATUS(fit_indices());
  TRY(const VkPipeline faces, pipelines_.faces(knobs.face_edges));
  TRY(const VkPipeline shade,
      pipelines_.shade({knobs.sun_shadow, light, knobs.light_interpolation, knobs.corner_occlusion}));
  const double prepare_ms = ms_since(start);

  // What to draw.
  const auto cull_start = Clock::now();
  Camera camera = placed;
  // A camera on a face's plane sees the face on its upper side, as a ray does.
  camera.position.fraction = glm::clamp(camera.position.fraction, kOffPlane, 1 - kOffPlane);
  const PixelRays rays(camera, width, height);
  cull(pool_, camera, rays, knobs.view_distance, near >= kNearestForOcclusion, list_);
  const double cull_ms = ms_since(cull_start);

  // What the shaders read.
  const auto fill_start = Clock::now();
  PictureConstants constants =
      picture_constants(camera, rays, environment, shading, SurfaceLightDecoder(light, shading), knobs, shadow_grid_,
                        light_grid_, near, width, height);
  constants.map_u = sun_map_frame_.u, constants.map_v = sun_map_frame_.v, constants.map_w = sun_map_frame_.w;
  constants.map_low = sun_map_frame_.low, constants.map_size = sun_map_frame_.size;
  TRY_STATUS(fill(picture_, &constants, sizeof constants, VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT));
  TRY_STATUS(fill(chunks_, list_.chunks.data(), list_.chunks.size() * sizeof(ChunkCorner),
                  VK_BUFFER_USAGE_STORAGE_BUFFER_BIT));
  TRY_STATUS(fill(draws_, list_.draws.data(), list_.draws.size() * sizeof(VkDrawIndexedIndirectCommand),
                  VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT | VK_BUFFER_USAGE_STORAGE_BUFFER_BIT));
  TRY_STATUS(fill(candidates_, list_.candidates.data(), list_.candidates.size() * sizeof(Candidate),
                  VK_BUFFER_USAGE_STORAGE_BUFFER_BIT));
  TRY_STATUS(fill(visible_, nullptr, list_.candidates.size() * sizeof(uint32_t), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                  gpu::MemoryUse::readback));
  std::vector<vec4> materials;
  materials.reserve(shading.materials.size() * 2);
  for (const Shading::Material& m : shading.materials) {
    materials.emplace_back(m.albedo[0], m.albedo[1], m.albedo[2], 0);
    materials.emplace_back(m.emitted[0], m.emitted[1], m.emitted[2], 0);
  }
  TRY_STATUS(fill(materials_, materials.data(), materials.size() * sizeof(vec4), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT));
  TRY_STATUS(write_sets());
  const double fill_ms = ms_since(fill_start);

  TRY_STATUS(device_->run([&](VkCommandBuffer commands) { record(commands, faces, shade); }));
  uint64_t ticks[kTimes] = {};
  VK_CHECK(vkGetQueryPoolResults(device_->handle(), times_, 0, kTimes, sizeof ticks, ticks, sizeof ticks[0],
                                 VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT));
  const double tick_ms = device_->limits().timestampPeriod * 1e-6;

  const auto read_start = Clock::now();
  Frame frame;
  frame.image = Image(width, height);
  const size_t bytes = frame.image.pixels.size() * sizeof(Rgb);
  std::memcpy(frame.image.pixels.data(), targets_.radiance.mapped(), bytes);
  // What the occlusion test said decides what the next picture draws first.
  uint64_t second_faces = 0, second_draws = 0;
  const auto* visible = reinterpret_cast<const uint32_t*>(visible_.mapped());
  for (size_t i = 0; i < list_.candidates.size(); ++i) {
    list_.clusters[i]->visible = visible[i] != 0;
    if (!visible[i] || list_.candidates[i].draw < 0) continue;
    second_faces += list_.clusters[i]->count;
    ++second_draws;
  }
  const uint64_t first_draws = list_.first_end.empty() ? 0 : list_.first_end.back();
  const auto pass = [&](const char* name, uint32_t from, uint64_t draws, uint64_t read) {
    return PassReport{name, static_cast<double>(ticks[from + 1] - ticks[from]) * tick_ms, draws, read};
  };
  frame.report.faces_drawn = list_.first_faces + second_faces;
  frame.report.device = device_->name();
  frame.report.passes = {{"prepare", prepare_ms, 0, 0},
                         {"cull", cull_ms, 0, 0},
                         {"fill", fill_ms, 0, materials.size() * sizeof(vec4)},
                         pass("faces", 0, first_draws, list_.first_faces * sizeof(FaceRecord))};
  if (!list_.candidates.empty()) {
    frame.report.passes.push_back(pass("occlusion", 1, 0, list_.candidates.size() * sizeof(Candidate)));
    frame.report.passes.push_back(pass("faces_uncovered", 2, second_draws, second_faces * sizeof(FaceRecord)));
  }
  frame.report.passes.push_back(pass("shade", 3, 0, bytes));
  frame.report.passes.push_back({"read_back", ms_since(read_start), 0, bytes});
  frame.report.ms = ms_since(start);
  return frame;
}

}  // namespace render::raster
