#include "render/raster/shadow_grid.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "render/raster/place_table.h"
#include "world/store/brick_volume.h"

namespace render::raster {

namespace {

constexpr uint32_t kRegionWords = 16 * 16 * 16;  // leaves
constexpr uint32_t kMaskWords = world::BrickVolume::kWordsPerLeaf;
static_assert(kMaskWords * sizeof(uint32_t) == sizeof(world::LeafMask));

uint32_t mixed_leaves(const world::MaskRegion& region) {
  uint32_t count = 0;
  for (size_t g = 0; g < 64; ++g) count += static_cast<uint32_t>(std::popcount(region.any[g] & ~region.full[g]));
  return count;
}

/// Of a group's 4^3 leaves, the bits of those in the same aligned cube of 2^3.
uint64_t cube_of(int bit) { return uint64_t{0x330033} << (bit & 0x2a); }

/// Writes a region's words and its masks, group by group and in order of bits.
void write_region(const world::MaskRegion& region, uint32_t first_mask, uint32_t* words, uint32_t* masks) {
  uint32_t mask = 0;
  for (uint32_t g = 0; g < 64; ++g) {
    const uint64_t any = region.any[g], full = region.full[g];
    for (int bit = 0; bit < 64; ++bit) {
      const world::LeafPos leaf{static_cast<int32_t>(g >> 4) * 4 + (bit >> 4),
                                static_cast<int32_t>(g >> 2 & 3) * 4 + (bit >> 2 & 3),
                                static_cast<int32_t>(g & 3) * 4 + (bit & 3)};
      uint32_t& word = words[leaf.x * 256 + leaf.y * 16 + leaf.z];
      if (!(any >> bit & 1)) {
        word = !any ? kLeafInClear32 : !(any & cube_of(bit)) ? kLeafInClear16 : kLeafClear;
      } else if (full >> bit & 1) {
        word = kLeafFull;
      } else {
        word = kLeafMixed + first_mask + mask++;
        world::BrickVolume::leaf_words(region.leaf(leaf), masks);
        masks += kMaskWords;
      }
    }
  }
}

world::Result<gpu::Buffer> make_texels(gpu::Device& device, uint64_t bytes, VkFormat format) {
  return gpu::make_texel_buffer(device, bytes, format, VK_BUFFER_USAGE_TRANSFER_DST_BIT, gpu::MemoryUse::device);
}

}  // namespace

world::Status ShadowGrid::open(gpu::Device& device) {
  const world::MaskVolume nothing;
  auto sent = rebuild(device, nothing);
  if (!sent.ok()) return sent.error();
  return {};
}

world::Result<uint64_t> ShadowGrid::rebuild(gpu::Device& device, const world::MaskVolume& opaque) {
  const std::vector<const world::MaskRegion*> regions = opaque.regions();
  places_.clear();
  min_ = opaque.min_region();
  max_ = opaque.max_region();
  // Room for each region to grow a little without moving the others.
  uint32_t index = 0;
  uint64_t masks = 0;
  for (const world::MaskRegion* region : regions) {
    const uint32_t count = mixed_leaves(*region);
    const uint32_t room = count + count / 8 + 16;
    places_[region->pos] = {index++, static_cast<uint32_t>(masks), room};
    masks += room;
  }
  table_size_ = place_slots(regions.size());

  const uint64_t table_bytes = uint64_t{table_size_} * sizeof(ivec4);
  const uint64_t leaf_bytes = regions.size() * kRegionWords * sizeof(uint32_t);
  const uint64_t mask_bytes = masks * sizeof(world::LeafMask);
  const uint64_t texels = device.limits().maxTexelBufferElements;
  const auto fits = [&](uint64_t size, uint64_t texel) { return size <= std::min(binding_limit, texels * texel); };
  if (!fits(mask_bytes, 4) || !fits(leaf_bytes, 4) || !fits(table_bytes, 16))
    return world::Error{world::ErrorKind::usage, "the world is too large for the sun's shadow on this device (" +
                                                     std::to_string(mask_bytes >> 20) + " MiB of masks, at most " +
                                                     std::to_string(std::min(binding_limit, texels * 4) >> 20) +
                                                     "); set sun_shadow to none or use the raycast backend"};
  TRY(regions_, make_texels(device, table_bytes, VK_FORMAT_R32G32B32A32_SINT));
  TRY(leaves_, make_texels(device, leaf_bytes, VK_FORMAT_R32_UINT));
  TRY(masks_, make_texels(device, mask_bytes, VK_FORMAT_R32_UINT));

  const uint64_t leaves_at = table_bytes, masks_at = leaves_at + (leaf_bytes + 63) / 64 * 64;
  TRY(const gpu::Buffer staging,
      gpu::make_buffer(device, masks_at + mask_bytes, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, gpu::MemoryUse::upload));
  const std::span table(reinterpret_cast<ivec4*>(staging.mapped()), table_size_);
  std::fill(table.begin(), table.end(), ivec4(0));
  for (const world::MaskRegion* region : regions) {
    const Place& place = places_[region->pos];
    add_place(table, region->pos, place.index);
    write_region(*region, place.first_mask,
                 reinterpret_cast<uint32_t*>(staging.mapped() + leaves_at) + place.index * kRegionWords,
                 reinterpret_cast<uint32_t*>(staging.mapped() + masks_at) + place.first_mask * kMaskWords);
  }
  TRY_STATUS(device.run([&](VkCommandBuffer commands) {
    const VkBufferCopy copies[] = {{0, 0, table_bytes}, {leaves_at, 0, leaf_bytes}, {masks_at, 0, mask_bytes}};
    vkCmdCopyBuffer(commands, staging.handle, regions_.handle, 1, &copies[0]);
    if (leaf_bytes) vkCmdCopyBuffer(commands, staging.handle, leaves_.handle, 1, &copies[1]);
    if (mask_bytes) vkCmdCopyBuffer(commands, staging.handle, masks_.handle, 1, &copies[2]);
  }));
  return table_bytes + leaf_bytes + mask_bytes;
}

world::Result<uint64_t> ShadowGrid::update(gpu::Device& device, const world::MaskVolume& opaque,
                                           std::span<const world::LeafPos> dirty) {
  std::vector<world::RegionPos> changed;
  for (const world::LeafPos leaf : dirty) changed.push_back(world::region_from_leaf(leaf));
  std::sort(changed.begin(), changed.end());
  changed.erase(std::unique(changed.begin(), changed.end()), changed.end());
  // A region that is new, or has outgrown its room, moves everything.
  uint64_t mask_count = 0;
  for (const world::RegionPos pos : changed) {
    const world::MaskRegion* region = opaque.region(pos);
    if (!region) continue;
    const auto place = places_.find(pos);
    const uint32_t count = mixed_leaves(*region);
    if (place == places_.end() || count > place->second.room) return rebuild(device, opaque);
    mask_count += count;
  }
  std::erase_if(changed, [&](const world::RegionPos pos) { return !places_.contains(pos); });
  if (changed.empty()) return uint64_t{0};

  const uint64_t leaves_bytes = changed.size() * kRegionWords * sizeof(uint32_t);
  const uint64_t bytes = leaves_bytes + mask_count * sizeof(world::LeafMask);
  TRY(const gpu::Buffer staging,
      gpu::make_buffer(device, bytes, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, gpu::MemoryUse::upload));
  std::vector<VkBufferCopy> leaf_copies, mask_copies;
  uint64_t leaves_at = 0, masks_at = leaves_bytes;
  const world::MaskRegion clear{};
  for (const world::RegionPos pos : changed) {
    const world::MaskRegion* region = opaque.region(pos);
    const Place& place = places_.at(pos);
    write_region(region ? *region : clear, place.first_mask, reinterpret_cast<uint32_t*>(staging.mapped() + leaves_at),
                 reinterpret_cast<uint32_t*>(staging.mapped() + masks_at));
    constexpr uint64_t kBytes = kRegionWords * sizeof(uint32_t);
    leaf_copies.push_back({leaves_at, place.index * kBytes, kBytes});
    leaves_at += kBytes;
    if (const uint64_t size = region ? mixed_leaves(*region) * sizeof(world::LeafMask) : 0) {
      mask_copies.push_back({masks_at, place.first_mask * sizeof(world::LeafMask), size});
      masks_at += size;
    }
  }
  TRY_STATUS(device.run([&](VkCommandBuffer commands) {
    vkCmdCopyBuffer(commands, staging.handle, leaves_.handle, static_cast<uint32_t>(leaf_copies.size()),
                    leaf_copies.data());
    if (!mask_copies.empty())
      vkCmdCopyBuffer(commands, staging.handle, masks_.handle, static_cast<uint32_t>(mask_copies.size()),
                      mask_copies.data());
  }));
  return bytes;
}

}  // namespace render::raster
