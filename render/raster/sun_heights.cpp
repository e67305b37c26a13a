#include "render/raster/sun_heights.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "world/base/jobs.h"

namespace render::raster {

namespace {

constexpr uint64_t kCells = uint64_t{world::ParallelRays::kBlockCells} * world::ParallelRays::kBlockCells;
constexpr uint64_t kBlockBytes = kCells * sizeof(world::ParallelRays::Cell);
static_assert(sizeof(world::ParallelRays::Cell) == 4);

world::Result<gpu::Buffer> make_cells(gpu::Device& device, uint64_t bytes) {
  return gpu::make_texel_buffer(device, bytes, VK_FORMAT_R32_UINT, VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                                gpu::MemoryUse::device);
}

}  // namespace

world::Status SunHeights::open(gpu::Device& device) {
  TRY(cells_, make_cells(device, 0));
  return {};
}

world::Status SunHeights::clear(gpu::Device& device) {
  if (!frame_) return {};
  frame_.reset();
  sent_.clear();
  version_ = 0;
  return open(device);
}

world::Result<uint64_t> SunHeights::follow(gpu::Device& device, const world::ParallelRays& rays) {
  if (rays.version() == version_) return uint64_t{0};
  const world::ParallelRays::Frame& frame = rays.frame();
  const uint64_t count =
      rays.has_map() ? static_cast<uint64_t>(frame.blocks[0]) * static_cast<uint64_t>(frame.blocks[1]) : 0;
  const uint64_t limit = std::min<uint64_t>(binding_limit, 4ull * device.limits().maxTexelBufferElements);
  if (count == 0 || count * kBlockBytes > limit) {
    TRY_STATUS(clear(device));
    version_ = rays.version();
    return uint64_t{0};
  }
  version_ = 0;  // until all is there
  if (!frame_ || sent_.size() != count) {
    sent_.assign(count, 0);
    TRY(cells_, make_cells(device, count * kBlockBytes));
  }
  frame_ = frame;
  const auto across = static_cast<size_t>(frame.blocks[1]);
  world::parallel_ranges(count, 4, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i)
      (void)rays.block(static_cast<int32_t>(i / across), static_cast<int32_t>(i % across));
  });
  std::vector<const world::ParallelRays::Block*> changed;
  std::vector<VkBufferCopy> copies;
  for (size_t i = 0; i < count; ++i) {
    const auto& block = rays.block(static_cast<int32_t>(i / across), static_cast<int32_t>(i % across));
    if (block.version == sent_[i]) continue;
    copies.push_back({changed.size() * kBlockBytes, i * kBlockBytes, kBlockBytes});
    changed.push_back(&block);
    sent_[i] = block.version;
  }
  if (!changed.empty()) {
    TRY(const gpu::Buffer staging, gpu::make_buffer(device, changed.size() * kBlockBytes,
                                                    VK_BUFFER_USAGE_TRANSFER_SRC_BIT, gpu::MemoryUse::upload));
    for (size_t i = 0; i < changed.size(); ++i)
      std::memcpy(staging.mapped() + i * kBlockBytes, changed[i]->cell, kBlockBytes);
    TRY_STATUS(device.run([&](VkCommandBuffer commands) {
      vkCmdCopyBuffer(commands, staging.handle, cells_.handle, static_cast<uint32_t>(copies.size()), copies.data());
    }));
  }
  version_ = rays.version();
  return changed.size() * kBlockBytes;
}

void SunHeights::describe(const Camera& camera, PictureConstants& picture) const {
  picture.sun_cells = picture.sun_base = ivec4(0);
  picture.sun_u = picture.sun_v = vec4(0);
  if (!frame_) return;
  const world::ParallelRays::Frame& f = *frame_;
  const world::VoxelPos voxel = camera.position.voxel;
  const int main = f.axis[0];
  const int64_t along = int64_t{voxel[main]} - f.low[main], k = f.down ? f.size[0] - 1 - along : along;
  double base[2];
  for (int i = 0; i < 2; ++i)
    base[i] = static_cast<double>(int64_t{voxel[f.axis[1 + i]]} - f.low[f.axis[1 + i]] + f.shift[i]) -
              f.slope[i] * static_cast<double>(k);
  // Too far away for cells to be told apart: no map.
  constexpr double kMost = 1 << 24;
  if (std::abs(static_cast<double>(k)) > kMost || std::abs(base[0]) > kMost || std::abs(base[1]) > kMost) return;
  const double whole[2] = {std::floor(base[0]), std::floor(base[1])};
  picture.sun_cells = ivec4(f.blocks[0], f.blocks[1], main | (f.down ? 4 : 0), static_cast<int>(k));
  // Along the main axis, by which u and v move, a ray of the map counts from the side that it comes from.
  picture.sun_base = ivec4(static_cast<int>(whole[0]), static_cast<int>(whole[1]),
                           std::bit_cast<int>(static_cast<float>(1 / std::abs(f.direction[main]))), 0);
  const auto cells = [&](int i) {
    const double slope = f.slope[i];
    glm::dvec4 row(0, 0, 0, base[i] - whole[i] - (f.down ? slope : 0));
    row[f.axis[1 + i]] = 1;
    row[main] = f.down ? slope : -slope;
    return vec4(row);
  };
  picture.sun_u = cells(0), picture.sun_v = cells(1);
}

}  // namespace render::raster
