#include "render/raster/light_grid.h"

#include <algorithm>
#include <cstring>

#include <fmt/format.h>

#include "render/raster/place_table.h"

namespace render::raster {

world::Status LightGrid::open(gpu::Device& device) {
  const SurfaceLight nothing;
  TRY(const uint64_t sent, send(device, nothing));
  (void)sent;
  return {};
}

world::Result<uint64_t> LightGrid::follow(gpu::Device& device, const SurfaceLight& light) {
  if (light.version() == version_) return uint64_t{0};
  if (version_ + 1 == light.version() && !light.patched().empty()) {
    TRY(const std::optional<uint64_t> patched, send_patched(device, light));
    if (patched) {
      version_ = light.version();
      return *patched;
    }
  }
  TRY(const uint64_t sent, send(device, light));
  version_ = light.version();
  return sent;
}

world::Result<std::optional<uint64_t>> LightGrid::send_patched(gpu::Device& device, const SurfaceLight& light) {
  if (light.places().size() != regions_sent_ || light.leaves().size() * sizeof(SurfaceLightLeaf) > leaves_.size ||
      light.codes().size() * sizeof(uint32_t) > codes_.size)
    return std::optional<uint64_t>();
  std::vector<VkBufferCopy> places, records, codes;
  std::vector<std::pair<const void*, uint64_t>> parts;  // in the order of the copies
  uint64_t total = 0;
  const auto add = [&](std::vector<VkBufferCopy>& copies, const void* data, uint64_t to, uint64_t bytes) {
    copies.push_back({total, to, bytes});
    parts.emplace_back(data, bytes);
    total += bytes;
  };
  for (const uint32_t place : light.patched()) {
    const uint32_t& at = light.leaf_of()[place];
    add(places, &at, place * sizeof(uint32_t), sizeof(uint32_t));
    if (at == 0) continue;
    const SurfaceLightLeaf& leaf = light.leaves()[at - 1];
    add(records, &leaf, (at - 1) * sizeof(SurfaceLightLeaf), sizeof(SurfaceLightLeaf));
    add(codes, &light.codes()[leaf.first], leaf.first * sizeof(uint32_t), leaf.room * sizeof(uint32_t));
  }
  TRY(const gpu::Buffer staging,
      gpu::make_buffer(device, total, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, gpu::MemoryUse::upload));
  std::byte* to = staging.mapped();
  for (const auto& [data, bytes] : parts) {
    std::memcpy(to, data, bytes);
    to += bytes;
  }
  TRY_STATUS(device.run([&](VkCommandBuffer commands) {
    const auto copy = [&](const gpu::Buffer& buffer, const std::vector<VkBufferCopy>& copies) {
      if (!copies.empty())
        vkCmdCopyBuffer(commands, staging.handle, buffer.handle, static_cast<uint32_t>(copies.size()), copies.data());
    };
    copy(leaf_of_, places);
    copy(leaves_, records);
    copy(codes_, codes);
  }));
  return std::optional<uint64_t>(total);
}

world::Result<uint64_t> LightGrid::send(gpu::Device& device, const SurfaceLight& light) {
  regions_sent_ = light.places().size();
  table_size_ = place_slots(light.places().size());
  std::vector<ivec4> table(table_size_, ivec4(0));
  for (const auto& [pos, place] : light.places()) add_place(table, pos, place);
  struct Part {
    gpu::Buffer& buffer;
    VkFormat format;
    const void* data;
    uint64_t bytes;
  };
  constexpr VkFormat kWords = VK_FORMAT_R32_UINT;
  const Part parts[] = {{regions_, VK_FORMAT_R32G32B32A32_SINT, table.data(), table.size() * sizeof(ivec4)},
                        {leaf_of_, kWords, light.leaf_of().data(), light.leaf_of().size() * sizeof(uint32_t)},
                        {leaves_, kWords, light.leaves().data(), light.leaves().size() * sizeof(SurfaceLightLeaf)},
                        {codes_, kWords, light.codes().data(), light.codes().size() * sizeof(uint32_t)}};
  const uint64_t limit =
      std::min<uint64_t>(binding_limit, uint64_t{device.limits().maxTexelBufferElements} * sizeof(uint32_t));
  uint64_t total = 0;
  for (const Part& part : parts) {
    if (part.bytes > limit)
      return world::usage_error(
          fmt::format("the world's light is too large for this device ({} MiB, at most {} MiB); set "
                      "light_model to none or use the raycast backend",
                      part.bytes >> 20, limit >> 20));
    total += part.bytes;
  }
  TRY(const gpu::Buffer staging,
      gpu::make_buffer(device, total, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, gpu::MemoryUse::upload));
  uint64_t at = 0;
  for (const Part& part : parts) {
    // With room for what edits add.
    const uint64_t room = std::min(limit, part.bytes + part.bytes / 8) / sizeof(ivec4) * sizeof(ivec4);
    TRY(part.buffer, gpu::make_texel_buffer(device, std::max(room, part.bytes), part.format,
                                            VK_BUFFER_USAGE_TRANSFER_DST_BIT, gpu::MemoryUse::device));
    if (part.bytes) std::memcpy(staging.mapped() + at, part.data, part.bytes);
    at += part.bytes;
  }
  TRY_STATUS(device.run([&](VkCommandBuffer commands) {
    uint64_t from = 0;
    for (const Part& part : parts) {
      const VkBufferCopy copy{from, 0, part.bytes};
      if (part.bytes) vkCmdCopyBuffer(commands, staging.handle, part.buffer.handle, 1, &copy);
      from += part.bytes;
    }
  }));
  return total;
}

}  // namespace render::raster
