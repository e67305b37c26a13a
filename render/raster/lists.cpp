/// transparency=lists: every interface goes into a list of its pixel, and a compute pass puts them in exact order. On a
/// processor it goes into the list of its block of pixels: layer_blocks.h; elsewhere:
///
///   heads  [pixels] uint          which node is the last
///   own    [pixels] 2 uint        the interface and its plane of the first node
///   nodes  [n] 4 uint             the node before, the interface, its plane; 16 bytes a further layer of a pixel
/// Where the nodes don't fit, they are counted, and the picture is drawn again with room for them. Beyond what a buffer
/// of the device holds they are dropped; row "transparency_dropped" says how many.
/// source  Jason Yang, Justin Hensley, Holger Gruen, Nicolas Thibieroz. Real-Time Concurrent Linked List Construction
///         on the GPU. 2010
#include <algorithm>

#include "render/raster/block_lists.h"
#include "render/raster/layer_blocks.h"
#include "render/raster/transparency_pass.h"

#include "list_tiles.comp.spv.h"
#include "lists.comp.spv.h"
#include "lists.frag.spv.h"
#include "transparency.vert.spv.h"

namespace render::raster {

namespace {

constexpr VkFormat kOwnFormat = VK_FORMAT_R32G32_UINT;
constexpr uint32_t kNodeBytes = 16;

class ListOrder : public LayerOrder {
 public:
  world::Status fit(PassContext& context) override {
    behind_ = {};
    forget_pixels();
    const VkExtent2D extent = context.targets.extent();
    const uint64_t tiles = count_of(blocks_of(extent));
    can_list_ = tiles <= context.device.limits().maxComputeWorkGroupCount[0] &&
                std::max(extent.width, extent.height) <= 8u << kTileBits;
    const uint64_t tile_bytes = can_list_ ? tiles * sizeof(uint32_t) : sizeof(uint32_t);
    TRY(tiles_, gpu::make_texel_buffer(context.device, tile_bytes, VK_FORMAT_R32_UINT,
                                       VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, gpu::MemoryUse::device));
    return {};
  }

  world::Status prepare(PassContext& context, const Drawing& drawing, const LayerDraws& draws,
                        LayerConstants& constants) override {
    by_block_ = blocks_.fits(context, drawing, draws);
    if (by_block_) {
      forget_pixels();
    } else {
      blocks_.rest(context);
      TRY_STATUS(fit_pixels(context));
    }
    constants.eye.y = static_cast<int>(wanted_);
    constants.eye.w = drawing.width;
    // Beside layers, what the eye is in and mirrors change pixels.
    listed_ = can_list_ && draws.eye_in_air && drawing.knobs.reflection == Reflection::none;
    const auto all = layer_constants(drawing, draws,
                                     {{kSpecCoveragePattern, static_cast<uint32_t>(drawing.knobs.coverage_pattern)},
                                      {kSpecRefraction, static_cast<uint32_t>(drawing.knobs.refraction)},
                                      {kSpecReflection, static_cast<uint32_t>(drawing.knobs.reflection)},
                                      {kSpecListedTiles, listed_},
                                      {kSpecLayerBlocks, by_block_}});
    if (!resolve_ || all != made_for_) {
      if (!by_block_) {
        TRY(list_, make_graphics(context.device, transparency_vert_spv, lists_frag_spv,
                                 {.colour = {kOwnFormat},
                                  .depth = context.targets.depth_format,
                                  .depth_write = false,
                                  .depth_compare = VK_COMPARE_OP_GREATER_OR_EQUAL},
                                 all));
        TRY(list_tiles_, make_compute(context.device, list_tiles_comp_spv));
      }
      TRY(resolve_, make_compute(context.device, lists_comp_spv, all));
      made_for_ = all;
    }
    if (by_block_) TRY_STATUS(blocks_.prepare(context, draws, listed_));
    copies_ = drawing.knobs.refraction == Refraction::screen || drawing.knobs.reflection == Reflection::screen;
    if (!copies_) {
      behind_ = {};
      context.bindings.forget(kBindBehind);
    } else if (!behind_.handle) {
      TRY(behind_,
          gpu::make_image(context.device, context.targets.extent(), kColourFormat,
                          VK_IMAGE_USAGE_STORAGE_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT, VK_IMAGE_ASPECT_COLOR_BIT));
    }
    if (copies_) context.bindings.bind(kBindBehind, behind_);
    TRY_STATUS(prepare_mirror(context, drawing, constants));
    context.bindings.bind(kBindLayerTiles, tiles_);
    if (by_block_) {
      for (const uint32_t binding : {kBindLayerHeads, kBindLayerNodes, kBindLayerCount, kBindLayerTileMarks})
        context.bindings.forget(binding);
      context.bindings.bind(kBindLayerOwnNodes, context.targets.seen);  // named there, and not read
    } else {
      context.bindings.bind(kBindLayerHeads, heads_);
      context.bindings.bind(kBindLayerNodes, nodes_);
      context.bindings.bind(kBindLayerCount, count_);
      context.bindings.bind(kBindLayerOwnNodes, own_);
      context.bindings.bind(kBindLayerTileMarks, tile_marks_);
    }
    TRY_STATUS(dispatch_.prepare(context.device, context.slices, resolve_.handle,
                                 listed_ ? tiles_.size / sizeof(uint32_t) : 0));
    context.bindings.bind(kBindLayerDispatch, dispatch_.arguments());
    return {};
  }

  void record(VkCommandBuffer commands, PassContext& context, const Drawing&, const LayerDraws& draws) override {
    dispatch_.clear(commands);
    if (by_block_) {
      memory_barrier(commands, kClearWrite, kComputeReadWrite);
      blocks_.record(commands, context, draws);
    } else {
      record_draws(commands, context, draws);
    }
    context.times.mark(commands, "transparency_resolve");
    if (listed_ && !by_block_) {
      context.bindings.use(commands, list_tiles_);
      vkCmdDispatch(commands, static_cast<uint32_t>(tiles_.size / sizeof(uint32_t) + 63) / 64, 1, 1);
      memory_barrier(commands, kComputeReadWrite, kComputeReadWrite | kIndirectRead);
    }
    if (copies_) copy_behind(commands, context.targets);
    context.bindings.use(commands, resolve_);
    const auto push = [&](const std::array<uint32_t, 2>& first_group) {
      resolve_.push(commands, std::array{first_group[0], first_group[1], blocks_.of_block()});
    };
    if (listed_)
      dispatch_.record(commands, context.slices, [&](uint32_t first_group) { push(std::array{first_group, 0u}); });
    else
      context.slices.dispatch(commands, resolve_.handle, context.targets.extent(), push);
    if (by_block_) blocks_.restore(context);
  }

  world::Status finish(PassContext& context, FrameReport& report) override {
    if (listed_) dispatch_.finish(context.slices, dispatch_.head().listed);
    if (by_block_) {
      again_ = !blocks_.finish(context, report);
      return {};
    }
    const uint32_t asked = *reinterpret_cast<const uint32_t*>(count_.mapped());
    row_of(report, "transparency_resolve").bytes = uint64_t{asked} * kNodeBytes;
    again_ = asked > wanted_ && wanted_ < most_;
    if (asked > wanted_ && !again_) report.passes.push_back({"transparency_dropped", 0, asked - wanted_, 0});
    if (again_) wanted_ = static_cast<uint32_t>(std::min<uint64_t>(most_, uint64_t{asked} + asked / 4));
    return {};
  }
  bool again() const override { return again_; }
  bool needs_block_grid(const Drawing& drawing) const override {
    return drawing.knobs.refraction == Refraction::traced || drawing.knobs.reflection == Reflection::traced;
  }

 private:
  static constexpr Access kFragmentReadWrite{
      VK_PIPELINE_STAGE_2_FRAGMENT_SHADER_BIT,
      VK_ACCESS_2_SHADER_STORAGE_READ_BIT | VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT};

  void forget_pixels() {
    heads_ = {}, own_ = {};
    nodes_ = {}, count_ = {}, tile_marks_ = {};
  }
  /// Lists of pixels.
  world::Status fit_pixels(PassContext& context) {
    const VkExtent2D extent = context.targets.extent();
    constexpr VkBufferUsageFlags kStorage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
    if (!heads_.handle) {
      TRY(heads_,
          gpu::make_image(context.device, extent, VK_FORMAT_R32_UINT,
                          VK_IMAGE_USAGE_STORAGE_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT, VK_IMAGE_ASPECT_COLOR_BIT));
      TRY(own_,
          gpu::make_image(context.device, extent, kOwnFormat,
                          VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_SAMPLED_BIT, VK_IMAGE_ASPECT_COLOR_BIT));
      TRY(count_, gpu::make_buffer(context.device, sizeof(uint32_t), kStorage | VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                                   gpu::MemoryUse::readback));
      TRY(tile_marks_, gpu::make_buffer(context.device, tiles_.size, kStorage | VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                                        gpu::MemoryUse::device));
      cleared_ = false;
      const VkPhysicalDeviceLimits& limits = context.device.limits();
      most_ = std::min(limits.maxStorageBufferRange / kNodeBytes, limits.maxTexelBufferElements);
      wanted_ = std::clamp(extent.width * extent.height / 4, 4096u, most_);
    }
    if (nodes_.handle && nodes_.size >= uint64_t{wanted_} * kNodeBytes) return {};
    nodes_ = {};
    TRY(nodes_, gpu::make_texel_buffer(context.device, uint64_t{wanted_} * kNodeBytes, VK_FORMAT_R32G32B32A32_UINT,
                                       kStorage, gpu::MemoryUse::device));
    return {};
  }

  /// Into lists of pixels.
  void record_draws(VkCommandBuffer commands, PassContext& context, const LayerDraws& draws) {
    if (!cleared_) {
      image_discard(commands, heads_.handle, VK_IMAGE_ASPECT_COLOR_BIT, kComputeRead, kClearWrite);
      const VkClearColorValue none{};
      const VkImageSubresourceRange all{VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
      vkCmdClearColorImage(commands, heads_.handle, VK_IMAGE_LAYOUT_GENERAL, &none, 1, &all);
      image_discard(commands, own_.handle, VK_IMAGE_ASPECT_COLOR_BIT, kComputeRead, kColourReadWrite);
      vkCmdFillBuffer(commands, tile_marks_.handle, 0, VK_WHOLE_SIZE, 0);
      cleared_ = true;  // from here on the compute pass clears what it has read
    }
    vkCmdFillBuffer(commands, count_.handle, 0, sizeof(uint32_t), 0);
    memory_barrier(commands, kClearWrite | kComputeReadWrite, kFragmentReadWrite | kColourReadWrite);
    begin_rendering(commands, context.targets, {own_.view.address(), 1}, context.targets.depth.view, false);
    draws.record(commands, context, list_);
    vkCmdEndRendering(commands);
    memory_barrier(commands, kClearWrite | kFragmentReadWrite | kColourReadWrite, kComputeReadWrite | kHostRead);
  }

  world::Status prepare_mirror(PassContext& context, const Drawing& drawing, LayerConstants& constants) {
    const MirrorPicture* mirror = drawing.mirrored;
    if (!mirror) {
      mirrored_ = {};
      context.bindings.forget(kBindMirrored);
      return {};
    }
    TRY_STATUS(context.fill(mirrored_, mirror->image.pixels.data(), mirror->image.pixels.size() * sizeof(Rgb),
                            VK_BUFFER_USAGE_STORAGE_BUFFER_BIT));
    context.bindings.bind(kBindMirrored, mirrored_);
    const int axis = mirror->plane.axis;
    const PixelRays rays(mirror->camera, drawing.width, drawing.height);
    const auto row = [](const Vec3d& v) { return vec4(glm::vec3(v), 0); };
    constants.mirror = ivec4(axis, mirror->plane.plane - drawing.camera.position.voxel[axis], 0, 0);
    constants.mirror_x = row(rays.right / rays.tan_half_x);
    constants.mirror_y = row(-rays.up / rays.tan_half_y);
    constants.mirror_w = row(rays.forward);
    return {};
  }

  /// Pixels read what others have before their layers are added.
  void copy_behind(VkCommandBuffer commands, const Targets& targets) {
    image_discard(commands, behind_.handle, VK_IMAGE_ASPECT_COLOR_BIT, kComputeRead, kCopyWrite);
    image_barrier(commands, targets.colour.handle, VK_IMAGE_ASPECT_COLOR_BIT, kComputeReadWrite, kCopyRead);
    VkImageCopy all{};
    all.srcSubresource = all.dstSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
    all.extent = {targets.extent().width, targets.extent().height, 1};
    vkCmdCopyImage(commands, targets.colour.handle, VK_IMAGE_LAYOUT_GENERAL, behind_.handle, VK_IMAGE_LAYOUT_GENERAL, 1,
                   &all);
    image_barrier(commands, behind_.handle, VK_IMAGE_ASPECT_COLOR_BIT, kCopyWrite, kComputeRead);
    image_barrier(commands, targets.colour.handle, VK_IMAGE_ASPECT_COLOR_BIT, kCopyRead, kComputeReadWrite);
  }

  Pipeline list_, list_tiles_, resolve_;
  LayerBlocks blocks_;
  std::vector<Constant> made_for_;
  gpu::DeviceImage heads_, own_, behind_;
  gpu::Buffer nodes_, count_, tiles_, tile_marks_, mirrored_;
  gpu::ListDispatch dispatch_;      // over tiles_
  uint32_t wanted_ = 0, most_ = 0;  // nodes
  bool again_ = false, copies_ = false;
  bool by_block_ = false;  // layers are listed by block of pixels
  bool can_list_ = false;
  bool listed_ = false;   // tiles that have a layer are in tiles_, and no others change
  bool cleared_ = false;  // heads and tile_marks_ are 0 between pictures
};

}  // namespace

std::unique_ptr<LayerOrder> make_list_order() { return std::make_unique<ListOrder>(); }

}  // namespace render::raster
