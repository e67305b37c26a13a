#include "world/formats/mca/anvil.h"

#include <algorithm>
#include <array>
#include <charconv>

#include <fmt/format.h>
#include <xxhash.h>

#include "world/base/file.h"
#include "world/formats/archive/inflate.h"
#include "world/formats/bytes.h"
#include "world/formats/nbt/block_state.h"

namespace world::mca {
namespace {

constexpr size_t kSector = 4096;
constexpr int kChunksPerSide = 32;
constexpr uint64_t kMostRegionBytes = uint64_t{1} << 32, kMostExternalBytes = uint64_t{1} << 28;
/// A chunk may inflate to this and 64 times what it takes packed: many times what the game itself writes.
constexpr uint64_t kChunkLimit = 8 << 20, kChunkRatio = 64;
constexpr int kNotSpanningFrom = 2529;  // DataVersion of the snapshot 20w17a, on the way to 1.16
constexpr const char* kNoMemory = "no memory is left for it: the file claims more than one of its size ever holds";
constexpr uint64_t kCubeBytes = 128;    // of a cube without its indices
constexpr int kMostSections = 1 << 10;  // of one chunk; the game's own limit is 256

/// "r.-1.2.mca" -> (-1, 2)
std::optional<std::pair<int32_t, int32_t>> region_place(const std::filesystem::path& path) {
  const std::string name = path.filename().string();
  int32_t x = 0, z = 0;
  const char* const end = name.data() + name.size();
  if (!name.starts_with("r.")) return {};
  const auto [after_x, bad_x] = std::from_chars(name.data() + 2, end, x);
  if (bad_x != std::errc() || after_x == end || *after_x != '.') return {};
  const auto [after_z, bad_z] = std::from_chars(after_x + 1, end, z);
  if (bad_z != std::errc() || std::string_view(after_z, static_cast<size_t>(end - after_z)) != ".mca") return {};
  return std::pair{x, z};
}

/// Hashes the bytes of a palette entry as they lie in the file.
struct BytesHash {
  using is_transparent = void;
  size_t operator()(std::string_view bytes) const { return XXH3_64bits(bytes.data(), bytes.size()); }
};

/// The arrays of one section, in the inflated bytes.
struct Section {
  int y = 0;
  bool has_y = false, has_palette = false;
  std::span<const uint8_t> palette;  // its entries, one after the other
  uint32_t palette_count = 0;
  std::span<const uint8_t> packed;          // of indices
  std::span<const uint8_t> ids, data, add;  // before 1.13
  std::span<const uint8_t> sky, block;      // light
};

struct Chunk {
  ChunkInfo info;
  std::vector<Section> sections;
};

void read_palette(nbt::Reader& in, const nbt::Entry& e, Section& section) {
  section.palette_count = in.list(e, nbt::Type::compound);
  const uint8_t* const begin = in.cursor();
  for (uint32_t i = 0; i < section.palette_count && !in.failed(); ++i) in.skip(nbt::Type::compound);
  section.palette = {begin, static_cast<size_t>(in.cursor() - begin)};
  section.has_palette = !in.failed();
}

void read_block_states(nbt::Reader& in, Section& section) {
  for (nbt::Entry e; in.next(e);) {
    if (e.name == "palette") {
      read_palette(in, e, section);
    } else if (e.name == "data") {
      section.packed = in.array(e, nbt::Type::long_array);
    } else {
      in.skip(e);
    }
  }
}

void read_section(nbt::Reader& in, Chunk& chunk) {
  Section section;
  for (nbt::Entry e; in.next(e);) {
    if (e.name == "Y") {
      section.y = static_cast<int>(std::clamp<int64_t>(in.integer(e), INT16_MIN, INT16_MAX));
      section.has_y = true;
    } else if (e.name == "block_states" && e.type == nbt::Type::compound) {
      read_block_states(in, section);
    } else if (e.name == "Palette") {
      read_palette(in, e, section);
    } else if (e.name == "BlockStates") {
      section.packed = in.array(e, nbt::Type::long_array);
    } else if (e.name == "Blocks") {
      section.ids = in.array(e, nbt::Type::byte_array);
    } else if (e.name == "Data") {
      section.data = in.array(e, nbt::Type::byte_array);
    } else if (e.name == "Add") {
      section.add = in.array(e, nbt::Type::byte_array);
    } else if (e.name == "SkyLight") {
      section.sky = in.array(e, nbt::Type::byte_array);
    } else if (e.name == "BlockLight") {
      section.block = in.array(e, nbt::Type::byte_array);
    } else {
      in.skip(e);
    }
  }
  if (in.failed()) return;
  if (chunk.sections.size() < static_cast<size_t>(kMostSections))
    chunk.sections.push_back(section);
  else
    in.wrong("a chunk has more sections than any world is high");
}

/// The entries of the root (1.18 on) or of its "Level" (before); names that differ don't collide.
void read_level(nbt::Reader& in, Chunk& chunk, int depth) {
  for (nbt::Entry e; in.next(e);) {
    if (e.name == "DataVersion") {
      chunk.info.data_version = static_cast<int>(std::clamp<int64_t>(in.integer(e), 0, INT32_MAX));
    } else if (e.name == "Level" && depth == 0 && e.type == nbt::Type::compound) {
      read_level(in, chunk, depth + 1);
    } else if (e.name == "Status") {
      chunk.info.status = std::string(in.text(e).substr(0, 64));
    } else if (e.name == "LightPopulated") {
      chunk.info.light_populated = in.integer(e) != 0;
    } else if (e.name == "TerrainPopulated" && chunk.info.status.empty()) {
      chunk.info.status = std::to_string(in.integer(e));
    } else if (e.name == "Sections" || e.name == "sections") {
      for (uint32_t n = in.list(e, nbt::Type::compound); n > 0 && !in.failed(); --n) read_section(in, chunk);
    } else if ((e.name == "Entities" || e.name == "TileEntities" || e.name == "block_entities" ||
                e.name == "entities") &&
               e.type == nbt::Type::list) {
      const auto [type, count] = in.list(e);
      (e.name == "Entities" || e.name == "entities" ? chunk.info.entities : chunk.info.block_entities) =
          static_cast<int>(count);
      for (uint32_t i = 0; i < count && !in.failed(); ++i) in.skip(type);
    } else {
      in.skip(e);
    }
  }
}

}  // namespace

Result<RegionFile> open_region(const std::filesystem::path& path) {
  RegionFile region;
  region.path = path;
  const std::string file = path.string();
  const auto place = region_place(path);
  constexpr int32_t kMostRegion = kWorldBorder / (kChunksPerSide * kCubeSize) - 1;
  if (!place || std::max(std::abs(int64_t{place->first}), std::abs(int64_t{place->second})) > kMostRegion) {
    return input_error(
        fmt::format("{}: the name must say where the region lies, as r.-1.2.mca does, within {} regions of the origin",
                    file, kMostRegion));
  }
  std::tie(region.x, region.z) = *place;
  TRY(region.bytes, read_file(path, kMostRegionBytes));
  const std::span<const uint8_t> bytes = region.bytes;
  if (bytes.empty()) return region;  // the game makes such files
  if (bytes.size() < 2 * kSector) {
    return byte_error(file, bytes.size(), "the file ends inside its header of 8192 bytes; it is damaged or cut off");
  }
  std::vector<bool> taken(bytes.size() / kSector + 1);  // sectors of earlier chunks
  for (int i = 0; i < kChunksPerSide * kChunksPerSide; ++i) {
    const uint32_t location = nbt::big_endian<uint32_t>(bytes.data() + i * 4);
    if (location == 0) continue;
    PackedChunk chunk;
    chunk.x = region.x * kChunksPerSide + i % kChunksPerSide;
    chunk.z = region.z * kChunksPerSide + i / kChunksPerSide;
    const size_t at = (location >> 8) * kSector;
    if (at < 2 * kSector || at + 5 > bytes.size()) {
      chunk.problem = fmt::format("its place in the header (sector {}) lies outside of the file", location >> 8);
    } else if (taken[at / kSector]) {
      chunk.problem = fmt::format("its place in the header (sector {}) is that of another chunk", location >> 8);
    } else {
      taken[at / kSector] = true;
      const uint32_t length = nbt::big_endian<uint32_t>(bytes.data() + at);
      chunk.compression = bytes[at + 4];
      const bool external = chunk.compression & 128;
      chunk.compression &= 127;
      if (external) {
        const auto beside = path.parent_path() / fmt::format("c.{}.{}.mcc", chunk.x, chunk.z);
        auto read = read_file(beside, kMostExternalBytes);
        if (read)
          chunk.external = std::move(*read);
        else
          chunk.problem = "its data should lie in another file: " + read.error().message;
      } else if (length < 1 || length - 1 > bytes.size() - at - 5) {
        chunk.problem = fmt::format("byte {}: {} bytes were announced, but the file has {} left", at, length,
                                    bytes.size() - at - 4);
      } else {
        chunk.bytes = bytes.subspan(at + 5, length - 1);
      }
    }
    region.chunks.push_back(std::move(chunk));
  }
  for (PackedChunk& chunk : region.chunks)
    if (!chunk.external.empty()) chunk.bytes = chunk.external;
  return region;
}

std::vector<std::filesystem::path> region_files(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> found;
  for (const auto& inside : {folder, folder / "region"}) {
    std::error_code error;
    for (std::filesystem::directory_iterator at(inside, error), end; !error && at != end; at.increment(error))
      if (region_place(at->path())) found.push_back(at->path());
    if (!found.empty()) break;
  }
  std::sort(found.begin(), found.end());
  return found;
}

// ---- ChunkReader -----------------------------------------------------------------------------------------------

struct ChunkReader::Impl {
  StateTable& states;
  MemoryBudget& budget;
  Inflater inflater;
  Chunk chunk;
  std::unordered_map<std::string, StateNumber, BytesHash, std::equal_to<>>
      known;  // bytes of a palette entry -> its state
  std::vector<StateNumber> numeric = std::vector<StateNumber>(65536, UINT32_MAX);  // id << 4 | data -> state
  std::array<uint16_t, kCubeVoxels> indices;
  std::array<uint8_t, kCubeVoxels> bytes;

  Impl(StateTable& s, MemoryBudget& b) : states(s), budget(b), inflater(b) {}

  void parse(std::span<const uint8_t> tree, const std::string& file) {
    nbt::Reader in(tree, file);
    in.root();
    read_level(in, chunk, 0);
    if (in.failed()) chunk.info.problem = in.error().message;
  }

  /// The state of the palette entry that `in` stands before.
  std::optional<StateNumber> palette_entry(nbt::Reader& in) {
    const uint8_t* const begin = in.cursor();
    in.skip(nbt::Type::compound);
    if (in.failed()) return {};
    const std::string_view raw(reinterpret_cast<const char*>(begin), static_cast<size_t>(in.cursor() - begin));
    if (const auto found = known.find(raw); found != known.end()) return found->second;
    nbt::Reader entry({begin, raw.size()}, "");
    const auto text = nbt::read_block_state(entry);
    if (!text) return {};
    const auto number = states.number(*text);
    if (number && known.size() < StateTable::kMostStates && raw.size() <= StateTable::kMostTextBytes &&
        budget.take(raw.size() + 120))
      known.emplace(raw, *number);
    return number;
  }

  /// What is wrong with the section's blocks, or nothing.
  std::string add_cube(const Section& section, std::vector<Cube>& cubes) {
    if (!section.has_y) return "a section doesn't say its height";
    Cube cube;
    cube.pos = {chunk.info.x, section.y, chunk.info.z};
    std::string problem;
    if (section.has_palette) {
      problem = cube_of_palette(section, cube);
    } else {
      problem = cube_of_ids(section, cube);
    }
    if (problem.empty() && !budget.take(kCubeBytes)) problem = kNoMemory;
    if (problem.empty()) {
      cubes.push_back(std::move(cube));
      return {};
    }
    return fmt::format("section {}: {}", section.y, problem);
  }

  std::string cube_of_palette(const Section& section, Cube& cube) {
    if (section.palette_count == 0 || section.palette_count > kCubeVoxels)
      return fmt::format("its palette has {} entries, expected 1 to {}", section.palette_count, kCubeVoxels);
    nbt::Reader in(section.palette, "");
    cube.states.reserve(section.palette_count);
    for (uint32_t i = 0; i < section.palette_count; ++i) {
      const auto state = palette_entry(in);
      if (!state) return fmt::format("entry {} of its palette is no block state, or there are too many", i);
      cube.states.push_back(*state);
    }
    if (section.packed.empty()) {
      if (section.palette_count == 1) return {};
      return "its indices are missing";
    }
    int bits = 4;
    while ((uint32_t{1} << bits) < section.palette_count) ++bits;
    bool spanning = chunk.info.data_version < kNotSpanningFrom;
    const size_t words = section.packed.size() / 8;
    if (words != packed_words(bits, spanning)) spanning = !spanning;
    if (words != packed_words(bits, spanning)) {
      return fmt::format("its indices take {} words of 64 bits, expected {} for a palette of {}", words,
                         packed_words(bits, !spanning), section.palette_count);
    }
    uint32_t most = 0;
    if (bits == 4) {
      unpack_nibbles(section.packed.data(), bytes.data());
      uint8_t most_byte = 0;  // of the same width as the indices, so that the compiler takes 16 at a time
      for (const uint8_t i : bytes) most_byte = std::max(most_byte, i);
      most = most_byte;
    } else {
      unpack_indices(section.packed.data(), bits, spanning, indices.data());
      for (const uint16_t i : indices) most = std::max<uint32_t>(most, i);
      if (most < 256)
        for (size_t i = 0; i < kCubeVoxels; ++i) bytes[i] = static_cast<uint8_t>(indices[i]);
    }
    if (most >= section.palette_count) {
      return fmt::format("an index is {}, but its palette has {} entries", most, section.palette_count);
    }
    return place_indices(cube, section.palette_count > 256) ? "" : kNoMemory;
  }

  std::string cube_of_ids(const Section& section, Cube& cube) {
    if (section.ids.size() != kCubeVoxels || (!section.data.empty() && section.data.size() != kCubeVoxels / 2) ||
        (!section.add.empty() && section.add.size() != kCubeVoxels / 2))
      return fmt::format("its arrays Blocks, Data and Add hold {}, {} and {} bytes, expected 4096, 2048 and 2048 or 0",
                         section.ids.size(), section.data.size(), section.add.size());
    const auto nibble = [](std::span<const uint8_t> all, size_t i) {
      return all.empty() ? 0u : static_cast<unsigned>(all[i / 2] >> (i & 1) * 4 & 15);
    };
    std::array<uint16_t, 2 * kCubeVoxels> slot_of;  // index of a key's state, by a hash of the key
    slot_of.fill(UINT16_MAX);
    std::vector<uint16_t> keys;
    for (size_t i = 0; i < kCubeVoxels; ++i) {
      const auto key =
          static_cast<uint16_t>(nibble(section.add, i) << 12 | section.ids[i] << 4 | nibble(section.data, i));
      size_t at = key * 2654435761u >> 19;
      while (slot_of[at] != UINT16_MAX && keys[slot_of[at]] != key) at = (at + 1) % slot_of.size();
      if (slot_of[at] == UINT16_MAX) {
        slot_of[at] = static_cast<uint16_t>(keys.size());
        keys.push_back(key);
        StateNumber& number = numeric[key];
        if (number == UINT32_MAX) {
          const auto made = states.number(fmt::format("{}:{}", key >> 4, key & 15));
          if (!made) return "too many kinds of block";
          number = *made;
        }
        cube.states.push_back(number);
      }
      indices[i] = slot_of[at];
    }
    if (cube.states.size() == 1) return {};
    if (cube.states.size() <= 256)
      for (size_t i = 0; i < kCubeVoxels; ++i) bytes[i] = static_cast<uint8_t>(indices[i]);
    return place_indices(cube, cube.states.size() > 256) ? "" : kNoMemory;
  }

  bool place_indices(Cube& cube, bool wide) {
    if (!budget.take(wide ? 2 * kCubeVoxels : kCubeVoxels)) return false;  // given back when the store is filled
    if (wide) {
      cube.wide = std::make_unique_for_overwrite<uint16_t[]>(kCubeVoxels);
      order_cube(CubeOrder::yzx, indices.data(), cube.wide.get());
    } else {
      cube.narrow = std::make_unique_for_overwrite<uint8_t[]>(kCubeVoxels);
      order_cube(CubeOrder::yzx, bytes.data(), cube.narrow.get());
    }
    return true;
  }

  void begin(const PackedChunk& packed) {
    chunk.info = ChunkInfo();
    chunk.info.x = packed.x;
    chunk.info.z = packed.z;
    chunk.sections.clear();
  }
};

ChunkReader::ChunkReader(StateTable& states, MemoryBudget& budget) : impl_(std::make_unique<Impl>(states, budget)) {}
ChunkReader::~ChunkReader() = default;

Result<std::span<const uint8_t>> ChunkReader::inflate(const PackedChunk& chunk) {
  if (!chunk.problem.empty()) return input_error(chunk.problem);
  if (chunk.compression == 3) return chunk.bytes;
  if (chunk.compression != 1 && chunk.compression != 2) {
    return input_error(
        fmt::format("compression {} is not one that is read: 1 (gzip), 2 (zlib), 3 (none)", chunk.compression));
  }
  return impl_->inflater.inflate(chunk.bytes, kChunkLimit + kChunkRatio * chunk.bytes.size());
}

bool ChunkReader::open(const PackedChunk& packed, const std::string& file) {
  impl_->begin(packed);
  const auto tree = inflate(packed);
  if (!tree) {
    impl_->chunk.info.problem = tree.error().message;
    return false;
  }
  impl_->parse(*tree, file);
  return true;
}

ChunkInfo ChunkReader::read(const PackedChunk& packed, const std::string& file, std::vector<Cube>& cubes) {
  ChunkInfo& info = impl_->chunk.info;
  if (!open(packed, file)) return info;
  info.sections = static_cast<int>(impl_->chunk.sections.size());
  for (const Section& section : impl_->chunk.sections) {
    if (&section == impl_->chunk.sections.data()) info.min_section_y = info.max_section_y = section.y;
    info.min_section_y = std::min(info.min_section_y, section.y);
    info.max_section_y = std::max(info.max_section_y, section.y);
    if (!section.has_palette && section.ids.empty()) continue;  // light only
    const std::string problem = impl_->add_cube(section, cubes);
    if (problem.empty())
      ++info.sections_with_blocks;
    else if (info.problem.empty())
      info.problem = problem;
  }
  return info;
}

ChunkInfo ChunkReader::read_light(const PackedChunk& packed, const std::string& file,
                                  FunctionRef<void(const SectionLight&)> visit) {
  ChunkInfo& info = impl_->chunk.info;
  if (!open(packed, file)) return info;
  for (const Section& section : impl_->chunk.sections) {
    const auto whole = [](std::span<const uint8_t> light) {
      return light.size() == kCubeVoxels / 2 ? light : std::span<const uint8_t>();
    };
    const SectionLight light{{packed.x, section.y, packed.z}, whole(section.sky), whole(section.block)};
    if (section.has_y && (!light.sky.empty() || !light.block.empty())) visit(light);
  }
  return info;
}

Result<std::vector<std::string>> read_mca_light(const std::filesystem::path& path,
                                                FunctionRef<void(const SectionLight&)> visit) {
  std::error_code error;
  const bool folder = std::filesystem::is_directory(path, error);
  const std::vector<std::filesystem::path> files =
      folder ? region_files(path) : std::vector<std::filesystem::path>{path};
  std::vector<std::string> problems;
  for (const auto& file : files) {
    TRY(const RegionFile region, open_region(file));
    MemoryBudget budget(region.bytes.size());
    StateTable states(budget);
    ChunkReader reader(states, budget);
    for (const PackedChunk& chunk : region.chunks) {
      const ChunkInfo info = reader.read_light(chunk, file.string(), visit);
      if (!info.problem.empty()) problems.push_back(fmt::format("chunk ({}, {}): {}", chunk.x, chunk.z, info.problem));
    }
  }
  return problems;
}

}  // namespace world::mca
