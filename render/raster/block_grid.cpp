#include "render/raster/block_grid.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "render/raster/place_table.h"
#include "render/raster/raster.shared.h"

namespace render::raster {

using namespace world;

namespace {

/// Whether a leaf and the six around it are opaque through and through.
bool is_hidden(const MaskVolume& opaque, const MaskRegion* region, LeafPos leaf) {
  if (!region || !region->leaf_full(leaf)) return false;
  for (int f = 0; f < kFaces; ++f) {
    const VoxelPos s = face_step(f);
    const LeafPos beside{leaf.x + s.x, leaf.y + s.y, leaf.z + s.z};
    const MaskRegion* of = region_from_leaf(beside) == region->pos ? region : opaque.region(region_from_leaf(beside));
    if (!of || !of->leaf_full(beside)) return false;
  }
  return true;
}

LeafPos leaf_of_region(RegionPos pos, int index) {
  const LeafPos first = leaf_from_region(pos);
  return {first.x + (index >> 8), first.y + (index >> 4 & 15), first.z + (index & 15)};
}

int group_in_region(LeafPos leaf) { return (leaf.x >> 2 & 3) * 16 + (leaf.y >> 2 & 3) * 4 + (leaf.z >> 2 & 3); }

uint32_t uniform_word(BlockId block) { return kBlockUniform | block; }

/// Of one code all through, or a code for each voxel.
struct CodedLeaf {
  uint16_t uniform = 0;
  bool mixed = false;
  BlockGrid::LeafCodes codes;
};

CodedLeaf coded(StoreReader& reader, LeafPos leaf, const BlockGrid::CodeLeaf& code) {
  const LeafBlocks blocks = reader.leaf(leaf);
  CodedLeaf out;
  if (!code) {
    if (!blocks.values) {
      out.uniform = blocks.uniform;
      return out;
    }
    std::memcpy(out.codes.data(), blocks.values, sizeof out.codes);
    out.mixed = true;
    return out;
  }
  if (!blocks.values && blocks.uniform == kAir) return out;
  code(reader, leaf, blocks, out.codes);
  out.uniform = out.codes[0];
  out.mixed = std::any_of(out.codes.begin(), out.codes.end(), [&](uint16_t c) { return c != out.uniform; });
  return out;
}

world::Error too_large(uint64_t bytes, uint64_t limit) {
  return {ErrorKind::usage, "the world is too large to trace rays on this device (" + std::to_string(bytes >> 20) +
                                " MiB of blocks, at most " + std::to_string(limit >> 20) +
                                "); set reflection and refraction to screen or none, and transparency to lists"};
}

}  // namespace

Result<uint64_t> BlockGrid::follow(gpu::Device& device, const WorldView& view, std::span<const LeafPos> dirty,
                                   bool whole, const CodeLeaf& code) {
  if (whole || empty()) return rebuild(device, view, code);
  if (dirty.empty()) return uint64_t{0};
  // A changed leaf may open its neighbours to rays. Words of leaves, and ids of those that are mixed.
  std::vector<LeafPos> leaves;
  for (const LeafPos l : dirty) {
    leaves.push_back(l);
    for (int f = 0; f < kFaces; ++f) {
      const VoxelPos s = face_step(f);
      leaves.push_back({l.x + s.x, l.y + s.y, l.z + s.z});
    }
  }
  std::sort(leaves.begin(), leaves.end());
  leaves.erase(std::unique(leaves.begin(), leaves.end()), leaves.end());
  const MaskVolume &occupied = view.masks(MaskKind::occupied), &opaque = view.masks(MaskKind::opaque);
  StoreReader reader(view.store());
  struct Word {
    uint64_t at;
    uint32_t value;
  };
  std::vector<Word> words;
  std::vector<std::pair<uint32_t, LeafCodes>> ids;
  for (const LeafPos l : leaves) {
    const RegionPos pos = region_from_leaf(l);
    const auto place = places_.find(pos);
    const CodedLeaf blocks = coded(reader, l, code);
    if (place == places_.end()) {
      if (blocks.mixed || blocks.uniform != 0) return rebuild(device, view, code);
      continue;
    }
    const uint64_t first = uint64_t{place->second} * kLeafWords;
    const MaskRegion* region = occupied.region(pos);
    uint64_t groups = region ? region->any_groups : 0;
    for (uint32_t w = 0; w < 2; ++w) words.push_back({first + w, static_cast<uint32_t>(groups >> (32 * w))});
    const uint64_t at = first + 2 + static_cast<uint64_t>(index_in_region(l));
    if (!blocks.mixed || is_hidden(opaque, opaque.region(pos), l)) {
      words.push_back({at, uniform_word(blocks.mixed ? blocks.codes[0] : blocks.uniform)});
      continue;
    }
    auto mixed = mixed_.find(l);
    if (mixed == mixed_.end()) {
      if (used_ == room_) return rebuild(device, view, code);
      mixed = mixed_.emplace(l, used_++).first;
    }
    words.push_back({at, mixed->second});
    ids.emplace_back(mixed->second, blocks.codes);
  }
  const uint64_t word_bytes = words.size() * 4, id_bytes = ids.size() * kIdWords * 4;
  TRY(const gpu::Buffer staging,
      gpu::make_buffer(device, word_bytes + id_bytes, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, gpu::MemoryUse::upload));
  std::vector<VkBufferCopy> word_copies, id_copies;
  for (size_t i = 0; i < words.size(); ++i) {
    std::memcpy(staging.mapped() + 4 * i, &words[i].value, 4);
    // The same word may come twice, with the same value: copies must not overlap.
    if (i == 0 || std::none_of(word_copies.begin(), word_copies.end(),
                               [&](const VkBufferCopy& c) { return c.dstOffset == words[i].at * 4; }))
      word_copies.push_back({4 * i, words[i].at * 4, 4});
  }
  for (size_t i = 0; i < ids.size(); ++i) {
    const uint64_t from = word_bytes + i * kIdWords * 4;
    std::memcpy(staging.mapped() + from, ids[i].second.data(), sizeof ids[i].second);
    id_copies.push_back({from, uint64_t{ids[i].first} * kIdWords * 4, kIdWords * 4});
  }
  TRY_STATUS(device.run([&](VkCommandBuffer commands) {
    vkCmdCopyBuffer(commands, staging.handle, leaves_.handle, static_cast<uint32_t>(word_copies.size()),
                    word_copies.data());
    if (!id_copies.empty())
      vkCmdCopyBuffer(commands, staging.handle, ids_.handle, static_cast<uint32_t>(id_copies.size()), id_copies.data());
  }));
  return word_bytes + id_bytes;
}

Result<uint64_t> BlockGrid::rebuild(gpu::Device& device, const WorldView& view, const CodeLeaf& code) {
  const MaskVolume &occupied = view.masks(MaskKind::occupied), &opaque = view.masks(MaskKind::opaque);
  const std::vector<const MaskRegion*> regions = occupied.regions();
  places_.clear();
  mixed_.clear();
  min_ = occupied.min_region(), max_ = occupied.max_region();
  table_size_ = place_slots(regions.size());
  std::vector<ivec4> table(table_size_, ivec4(0));
  std::vector<uint32_t> leaves(regions.size() * kLeafWords);
  StoreReader reader(view.store());
  std::vector<LeafPos> mixed;
  for (uint32_t r = 0; r < regions.size(); ++r) {
    const MaskRegion& region = *regions[r];
    places_[region.pos] = r;
    add_place(table, region.pos, r);
    uint32_t* const words = leaves.data() + uint64_t{r} * kLeafWords;
    uint64_t held = 0;  // groups
    const MaskRegion* const solid = opaque.region(region.pos);
    for (int i = 0; i < kLeavesPerRegion; ++i) {
      const LeafPos leaf = leaf_of_region(region.pos, i);
      uint32_t& word = words[2 + i];
      word = uniform_word(kAir);
      if (!region.leaf_any(leaf)) continue;
      const CodedLeaf blocks = coded(reader, leaf, code);
      if (!blocks.mixed || is_hidden(opaque, solid, leaf)) {
        word = uniform_word(blocks.mixed ? blocks.codes[0] : blocks.uniform);
        held |= uint64_t{word != uniform_word(0)} << group_in_region(leaf);
        continue;
      }
      held |= uint64_t{1} << group_in_region(leaf);
      word = static_cast<uint32_t>(mixed.size());
      mixed_.emplace(leaf, word);
      mixed.push_back(leaf);
    }
    words[0] = static_cast<uint32_t>(held), words[1] = static_cast<uint32_t>(held >> 32);
  }
  used_ = static_cast<uint32_t>(mixed.size());
  room_ = used_ + used_ / 8 + 64;
  const uint64_t table_bytes = table.size() * sizeof(ivec4), leaf_bytes = leaves.size() * 4,
                 id_bytes = uint64_t{room_} * kIdWords * 4,
                 limit = uint64_t{4} * device.limits().maxTexelBufferElements;
  if (std::max(leaf_bytes, id_bytes) > limit) return too_large(std::max(leaf_bytes, id_bytes), limit);
  const auto texels = [&](uint64_t bytes, VkFormat format) {
    return gpu::make_texel_buffer(device, bytes, format, VK_BUFFER_USAGE_TRANSFER_DST_BIT, gpu::MemoryUse::device);
  };
  TRY(regions_, texels(table_bytes, VK_FORMAT_R32G32B32A32_SINT));
  TRY(leaves_, texels(leaf_bytes, VK_FORMAT_R32_UINT));
  TRY(ids_, texels(id_bytes, VK_FORMAT_R32_UINT));
  const uint64_t leaves_at = table_bytes, ids_at = table_bytes + leaf_bytes;
  TRY(const gpu::Buffer staging, gpu::make_buffer(device, ids_at + mixed.size() * kIdWords * 4,
                                                  VK_BUFFER_USAGE_TRANSFER_SRC_BIT, gpu::MemoryUse::upload));
  std::memcpy(staging.mapped(), table.data(), table_bytes);
  if (leaf_bytes) std::memcpy(staging.mapped() + leaves_at, leaves.data(), leaf_bytes);
  for (size_t i = 0; i < mixed.size(); ++i)
    std::memcpy(staging.mapped() + ids_at + i * kIdWords * 4, coded(reader, mixed[i], code).codes.data(), kIdWords * 4);
  TRY_STATUS(device.run([&](VkCommandBuffer commands) {
    const VkBufferCopy copies[] = {
        {0, 0, table_bytes}, {leaves_at, 0, leaf_bytes}, {ids_at, 0, mixed.size() * kIdWords * 4}};
    vkCmdCopyBuffer(commands, staging.handle, regions_.handle, 1, &copies[0]);
    if (leaf_bytes) vkCmdCopyBuffer(commands, staging.handle, leaves_.handle, 1, &copies[1]);
    if (!mixed.empty()) vkCmdCopyBuffer(commands, staging.handle, ids_.handle, 1, &copies[2]);
  }));
  return table_bytes + leaf_bytes + mixed.size() * kIdWords * 4;
}

}  // namespace render::raster
