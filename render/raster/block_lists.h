/// What lists of faces by block of pixels share, of cubes (face_blocks.h) and of layers (layer_blocks.h).
#pragma once

#include <cmath>
#include <numeric>

#include "render/raster/face_blocks.shared.h"
#include "render/raster/pass.h"

namespace render::raster {

inline uint32_t groups_of(uint32_t elements, uint32_t group) { return (elements + group - 1) / group; }

inline VkExtent2D blocks_of(VkExtent2D picture) {
  return {groups_of(picture.width, kBlockPixels), groups_of(picture.height, kBlockPixels)};
}

inline uint64_t count_of(VkExtent2D blocks) { return uint64_t{blocks.width} * blocks.height; }

inline bool same_extent(VkExtent2D a, VkExtent2D b) { return a.width == b.width && a.height == b.height; }

/// A number without a common factor with `count`, near its golden section: i * stride % count takes each of them once,
/// and any run of them from all over. Software gives each of its threads one run of a dispatch's groups: of a picture's
/// the first would get the sky, and the last the ground.
inline uint32_t spreading_stride(uint32_t count) {
  auto stride = static_cast<uint32_t>(std::lround(0.618 * count));
  while (std::gcd(stride, count) != 1) ++stride;
  return stride;
}

/// Makes a buffer of texels that dispatches write, where it is too small.
inline world::Status fit_texels(PassContext& context, gpu::Buffer& buffer, VkFormat format, uint64_t bytes) {
  if (buffer.handle && buffer.size >= bytes) return {};
  TRY(buffer, gpu::make_texel_buffer(context.device, bytes, format, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                                     gpu::MemoryUse::device));
  return {};
}

}  // namespace render::raster
