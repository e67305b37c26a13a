#include <algorithm>
#include <array>
#include <fstream>

#include <fmt/format.h>
#include <zlib.h>

#include "world/formats/mca/anvil.h"
#include "world/formats/translation/translation.h"

namespace world::mca {
namespace {

constexpr int kDataVersion = 3465;  // Minecraft 1.20.1
constexpr int kRegionChunks = 32, kSector = 4096;

/// The palette of a section and its indices in Minecraft's order.
struct Section {
  std::vector<BlockId> palette;
  std::array<uint16_t, kCubeVoxels> indices;
};

Section section_at(StoreReader& store, VoxelPos corner) {
  Section section;
  for (int i = 0; i < kCubeVoxels; ++i) {
    const VoxelPos v = corner + VoxelPos{i & 15, i >> 8, i >> 4 & 15};
    const BlockId block = store.leaf(leaf_from_voxel(v))[index_in_leaf(v)];
    auto found = std::find(section.palette.begin(), section.palette.end(), block);
    if (found == section.palette.end()) found = section.palette.insert(found, block);
    section.indices[static_cast<size_t>(i)] = static_cast<uint16_t>(found - section.palette.begin());
  }
  return section;
}

std::vector<uint64_t> packed(const Section& section) {
  int bits = 4;
  while ((size_t{1} << bits) < section.palette.size()) ++bits;
  const int per_word = 64 / bits;
  std::vector<uint64_t> words(packed_words(bits, false));
  for (int i = 0; i < kCubeVoxels; ++i)
    words[static_cast<size_t>(i / per_word)] |= uint64_t{section.indices[static_cast<size_t>(i)]}
                                                << (i % per_word * bits);
  return words;
}

void put_state(nbt::Writer& out, const BlockState& state) {
  out.text("Name", state.name);
  if (!state.properties.empty()) {
    out.open("Properties");
    for (const auto& [key, value] : state.properties) out.text(key, value);
    out.close();
  }
  out.close();
}

std::string chunk_tree(const World& world, StoreReader& store, int x, int z, int min_y, int max_y) {
  const TranslationTable& table = translation_table("minecraft");
  nbt::Writer out;
  out.open("");
  out.int_number("DataVersion", kDataVersion);
  out.int_number("xPos", x);
  out.int_number("yPos", min_y);
  out.int_number("zPos", z);
  out.text("Status", "minecraft:full");
  out.list("sections", nbt::Type::compound, static_cast<uint32_t>(max_y - min_y + 1));
  for (int y = min_y; y <= max_y; ++y) {
    const Section section = section_at(store, {x * kCubeSize, y * kCubeSize, z * kCubeSize});
    out.byte_number("Y", static_cast<int8_t>(y));
    out.open("block_states");
    out.list("palette", nbt::Type::compound, static_cast<uint32_t>(section.palette.size()));
    for (const BlockId block : section.palette)
      put_state(out, parse_state(written_state(table, (*world.palette)[block])));
    if (section.palette.size() > 1) out.long_array("data", packed(section));
    out.close();
    out.close();
  }
  out.close();
  return out.bytes;
}

std::string deflated(const std::string& bytes) {
  std::string out(compressBound(bytes.size()), '\0');
  uLongf size = out.size();
  compress2(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), 6);
  out.resize(size);
  return out;
}

void put_big(std::string& out, uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) out += static_cast<char>(value >> shift & 0xff);
}

}  // namespace

Status write_region(const World& world, int32_t region_x, int32_t region_z, const std::filesystem::path& folder) {
  const VoxelBox box = world.store.bounds();
  const int min_y = box.min.y >> kCubeLog2, max_y = box.max.y >> kCubeLog2;
  const auto path = folder / fmt::format("r.{}.{}.mca", region_x, region_z);
  if (box.empty() || min_y < -128 || max_y > 127)
    return input_error(fmt::format("{}: a region reaches from y = -2048 to 2047 and can't be empty", path.string()));
  StoreReader store(world.store);
  std::string header, chunks;
  for (int i = 0; i < kRegionChunks * kRegionChunks; ++i) {
    const std::string packed_tree = deflated(chunk_tree(world, store, region_x * kRegionChunks + i % kRegionChunks,
                                                        region_z * kRegionChunks + i / kRegionChunks, min_y, max_y));
    const size_t sector = 2 + chunks.size() / kSector;
    put_big(chunks, static_cast<uint32_t>(packed_tree.size() + 1));
    chunks += '\2';
    chunks += packed_tree;
    chunks.resize((chunks.size() + kSector - 1) / kSector * kSector);
    const size_t sectors = 2 + chunks.size() / kSector - sector;
    if (sectors > 255)
      return input_error(
          fmt::format("{}: a chunk takes {} sectors, more than a region can say", path.string(), sectors));
    put_big(header, static_cast<uint32_t>(sector << 8 | sectors));
  }
  header.resize(2 * kSector);
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out << header << chunks;
  out.flush();
  return out ? Status{} : input_error(fmt::format("{}: cannot write; is the disk full?", path.string()));
}

}  // namespace world::mca
