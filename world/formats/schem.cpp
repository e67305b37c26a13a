// Sponge schematics (.schem), versions 1 to 3 in, version 2 out (more programs read it).
//
// A gzipped NBT tree: Width, Height, Length; a palette of block states; an index a block, as a varint of 7 bits a byte,
// in the order (y * Length + z) * Width + x. Version 3 puts these into "Blocks", and all into a compound "Schematic".
// Axes are ours. Offset says where the corner lies from where it is pasted: it goes to the metadata, and the corner to
// the origin. A file of ours says in Metadata.Loam where its world lay, and defines the blocks that have no name in
// Minecraft, as "loam:NAME": so a world comes back as it was.
// source  SpongePowered, Schematic-Specification, versions 1 to 3
#include <algorithm>

#include <fmt/format.h>
#include <zlib.h>

#include <cstdio>

#include "world/formats/cubes/box_filler.h"
#include "world/formats/format.h"
#include "world/formats/nbt/large_arrays.h"
#include "world/formats/nbt/nbt.h"
#include "world/formats/schem/varints.h"
#include "world/formats/translation/translation.h"

namespace world {
namespace {

constexpr int kMostSide = 65535;
constexpr uint32_t kMostPaletteIndex = 1 << 20;
constexpr uint64_t kNotInPalette = UINT64_MAX;
constexpr int kWrittenVersion = 2, kWrittenDataVersion = 3465;  // Minecraft 1.20.1, whose names we write
constexpr uint64_t kMostBlocks = INT32_MAX;                     // the index array's length is a signed 32-bit number

struct Schematic {
  int version = 1, data_version = 0;
  VoxelPos size{0, 0, 0}, offset{0, 0, 0};
  std::vector<std::pair<std::string, int64_t>> palette;
  std::span<const uint8_t> indices;  // or empty, and
  size_t indices_end = 0;            // where reading stood behind them
  uint32_t block_entities = 0, entities = 0;
  std::optional<VoxelPos> origin;  // of our own files
  std::string definitions;         // TOML, of our own files
};

VoxelPos three(std::span<const uint8_t> ints) {
  const auto at = [&](size_t i) { return nbt::big_endian<int32_t>(ints.data() + i * 4); };
  return ints.size() == 12 ? VoxelPos{at(0), at(1), at(2)} : VoxelPos{0, 0, 0};
}

void read_palette(nbt::Reader& in, Schematic& out) {
  for (nbt::Entry p; in.next(p);) {
    const int64_t index = in.integer(p);
    if (index < 0 || index >= kMostPaletteIndex) return void(in.wrong("an index of the palette is impossible"));
    out.palette.emplace_back(p.name, index);
  }
}

void read_ours(nbt::Reader& in, Schematic& out) {
  for (nbt::Entry e; in.next(e);) {
    if (e.name == "Loam" && e.type == nbt::Type::compound) {
      for (nbt::Entry o; in.next(o);) {
        if (o.name == "Origin") {
          out.origin = three(in.array(o, nbt::Type::int_array));
        } else if (o.name == "Blocks") {
          for (uint32_t n = in.list(o, nbt::Type::text); n > 0 && !in.failed(); --n) out.definitions += in.text();
        } else {
          in.skip(o);
        }
      }
    } else {
      in.skip(e);
    }
  }
}

void read_schematic(nbt::Reader& in, Schematic& out, int depth) {
  for (nbt::Entry e; in.next(e);) {
    const bool compound = e.type == nbt::Type::compound;
    if (compound && depth < 2 && (e.name == "Schematic" || e.name == "Blocks")) {
      read_schematic(in, out, depth + 1);
    } else if (e.name == "Version") {
      out.version = static_cast<int>(in.integer(e));
    } else if (e.name == "DataVersion") {
      out.data_version = static_cast<int>(in.integer(e));
    } else if (e.name == "Width") {
      out.size.x = static_cast<uint16_t>(in.integer(e));
    } else if (e.name == "Height") {
      out.size.y = static_cast<uint16_t>(in.integer(e));
    } else if (e.name == "Length") {
      out.size.z = static_cast<uint16_t>(in.integer(e));
    } else if (e.name == "Offset" && e.type == nbt::Type::int_array) {
      out.offset = three(in.array(e, nbt::Type::int_array));
    } else if (e.name == "Palette" && compound) {
      read_palette(in, out);
    } else if (e.name == "BlockData" || (e.name == "Data" && e.type == nbt::Type::byte_array)) {
      out.indices = in.array(e, nbt::Type::byte_array);
      out.indices_end = in.offset();
    } else if (e.name == "Metadata" && compound) {
      read_ours(in, out);
    } else if ((e.name == "BlockEntities" || e.name == "TileEntities" || e.name == "Entities") &&
               e.type == nbt::Type::list) {
      const auto [type, count] = in.list(e);
      (e.name == "Entities" ? out.entities : out.block_entities) = count;
      for (uint32_t i = 0; i < count && !in.failed(); ++i) in.skip(type);
    } else {
      in.skip(e);
    }
  }
}

/// Slabs of eight layers are decoded at a time, so that indices never lie in memory as a whole.
Status fill(const Schematic& from, VoxelPos corner, const std::vector<BlockId>& block_of_index,
            std::vector<uint64_t>& counts, nbt::ArrayStream indices, const std::string& name, MemoryBudget& budget,
            Store& store) {
  const size_t layer = static_cast<size_t>(from.size.x) * static_cast<size_t>(from.size.z);
  const int slab = std::min(kLeafSize, from.size.y);
  if (!budget.take(layer * static_cast<size_t>(slab) * sizeof(BlockId)))
    return input_error(name + ": its layers take more memory than a file of this size ever needs");
  std::vector<BlockId> blocks(layer * static_cast<size_t>(slab));
  BoxFiller filler(store, budget);
  VarintReader in(std::move(indices));
  for (int y = 0; y < from.size.y;) {
    // Up to the next boundary of leaves.
    const int layers = std::min(kLeafSize - ((corner.y + y) & 7), from.size.y - y);
    for (size_t i = 0; i < layer * static_cast<size_t>(layers); ++i) {
      const uint32_t index = in.next();
      if (index >= counts.size() || counts[index] == kNotInPalette) {
        return input_error(fmt::format("{}: block {} of its {} has the index {}, which {}", name,
                                       layer * static_cast<size_t>(y) + i, layer * static_cast<size_t>(from.size.y),
                                       index, in.failed() ? "is cut off" : "the palette doesn't have"));
      }
      ++counts[index];
      blocks[i] = block_of_index[index];
    }
    const size_t width = static_cast<size_t>(from.size.x);
    const auto at = [&](int x, int dy, int z) {
      return blocks[layer * static_cast<size_t>(dy) + width * static_cast<size_t>(z) + static_cast<size_t>(x)];
    };
    if (!filler.fill(corner + VoxelPos{0, y, 0}, {from.size.x, layers, from.size.z}, at))
      return input_error(name + ": its blocks take more memory than a file of this size ever needs");
    y += layers;
  }
  filler.finish();
  return {};
}

Result<World> read_schem(const std::filesystem::path& path, const ImportOptions& options, ImportReport& report) {
  const std::string name = path.string();
  TRY(const nbt::ElidedFile file, nbt::ElidedFile::open(path));
  nbt::Reader in(file.tree(), name);
  Schematic schematic;
  in.root();
  read_schematic(in, schematic, 0);
  if (in.failed()) return in.error();
  const VoxelPos size = schematic.size;
  const uint64_t volume = static_cast<uint64_t>(size.x) * static_cast<uint64_t>(size.y) * static_cast<uint64_t>(size.z);
  if (schematic.version < 1 || schematic.version > 3)
    return input_error(fmt::format("{}: its version is {}, expected 1 to 3", name, schematic.version));
  const nbt::ElidedFile::LargeArray* const large = file.large_array_at(schematic.indices_end);
  const uint64_t index_bytes = large ? large->bytes : schematic.indices.size();
  if (volume > index_bytes) {
    return input_error(fmt::format("{}: {} x {} x {} blocks were announced, but its index data has {} bytes", name,
                                   size.x, size.y, size.z, index_bytes));
  }
  const VoxelPos corner = schematic.origin.value_or(VoxelPos{0, 0, 0});
  constexpr int kReach = kWorldBorder - kMostSide;
  for (int a = 0; a < 3; ++a)
    if (corner[a] < -kReach || corner[a] > kReach)
      return input_error(fmt::format("{}: lies outside of the world's border", name));

  World world(standard_blocks());
  BlockPalette definitions;
  if (!schematic.definitions.empty()) {
    const Status read = add_blocks_from_toml(definitions, schematic.definitions, name + " (Metadata.Loam.Blocks)");
    if (!read.ok()) report.warnings.push_back(read.error().message + "; its own blocks were not read");
  }
  Translator translator(translation_table("minecraft"), *world.palette, &definitions);
  std::sort(schematic.palette.begin(), schematic.palette.end());
  std::vector<BlockId> block_of_index;
  std::vector<uint64_t> counts;  // voxels by index
  std::map<std::string_view, int> names;
  for (const auto& [state, index] : schematic.palette) {
    if (static_cast<size_t>(index) >= counts.size()) {
      counts.resize(static_cast<size_t>(index) + 1, kNotInPalette);
      block_of_index.resize(counts.size());
    }
    counts[static_cast<size_t>(index)] = 0;
    block_of_index[static_cast<size_t>(index)] = translator.block(state);
    ++names[std::string_view(state).substr(0, state.find('['))];
  }
  nbt::ArrayStream indices = large ? nbt::ArrayStream(file, *large) : nbt::ArrayStream(schematic.indices);
  TRY_STATUS(fill(schematic, corner, block_of_index, counts, std::move(indices), name, file.budget(), world.store));
  if (options.count_states) {
    for (const auto& [state, index] : schematic.palette)
      if (counts[static_cast<size_t>(index)]) report.states[state] += counts[static_cast<size_t>(index)];
  }

  report.fact("version", std::to_string(schematic.version));
  report.fact("data version", schematic.data_version ? std::to_string(schematic.data_version) : "none");
  report.fact("size", fmt::format("{} x {} x {}", size.x, size.y, size.z));
  report.fact("offset", fmt::format("{} {} {}", schematic.offset.x, schematic.offset.y, schematic.offset.z));
  report.fact("palette", std::to_string(schematic.palette.size()));
  report.fact("palette names", std::to_string(names.size()));
  TRY_STATUS(translator.finish(world, "schem", path, options, report,
                               LeftBehind{schematic.entities, schematic.block_entities}));
  world.metadata["schem.offset"] = fmt::format("{} {} {}", schematic.offset.x, schematic.offset.y, schematic.offset.z);
  return world;
}

// ---- writing ---------------------------------------------------------------------------------------------------

/// A gzip file that is written piece by piece; the first failure is kept.
class GzipFile {
 public:
  explicit GzipFile(const std::filesystem::path& path) : file_(gzopen(path.c_str(), "wb6")) {
    if (file_) gzbuffer(file_, 1 << 18);
  }
  ~GzipFile() {
    if (file_) gzclose(file_);
  }
  GzipFile(const GzipFile&) = delete;
  GzipFile& operator=(const GzipFile&) = delete;
  void write(std::string_view bytes) {
    while (!bytes.empty() && file_) {
      const auto piece = static_cast<unsigned>(std::min<size_t>(bytes.size(), 1 << 28));
      if (gzwrite(file_, bytes.data(), piece) != static_cast<int>(piece)) return fail();
      bytes.remove_prefix(piece);
    }
  }
  bool close() {
    const bool good = file_ && gzclose(file_) == Z_OK;
    file_ = nullptr;
    return good && !failed_;
  }

 private:
  void fail() {
    failed_ = true;
    gzclose(file_);
    file_ = nullptr;
  }
  gzFile file_;
  bool failed_ = false;
};

Status write_schem(const World& world, const std::filesystem::path& path) {
  const std::string name = path.string();
  const VoxelBox box = world.store.bounds();
  const VoxelPos size = box.empty() ? VoxelPos{0, 0, 0} : box.max - box.min + VoxelPos{1, 1, 1};
  if (std::max({size.x, size.y, size.z}) > kMostSide || box.volume() > kMostBlocks) {
    return input_error(fmt::format(
        "{}: the world spans {} x {} x {} blocks, but a .schem holds at most {} along a side and {} in all; save it as "
        ".loam, or cut it",
        name, size.x, size.y, size.z, kMostSide, kMostBlocks));
  }
  // The most frequent blocks first: indices below 128 take one byte.
  Census census = world.store.census();
  uint64_t solid = 0;
  for (const auto& [id, count] : census) solid += count;
  if (box.volume() > solid) census[kAir] = box.volume() - solid;
  std::vector<std::pair<uint64_t, BlockId>> order;
  for (const auto& [id, count] : census) order.emplace_back(count, id);
  std::sort(order.begin(), order.end(),
            [](const auto& a, const auto& b) { return a.first != b.first ? a.first > b.first : a.second < b.second; });
  const TranslationTable& table = translation_table("minecraft");
  std::vector<uint32_t> index_of(world.palette->size());
  uint64_t data_bytes = 0;
  nbt::Writer out;
  out.open("Schematic");
  out.int_number("Version", kWrittenVersion);
  out.int_number("DataVersion", kWrittenDataVersion);
  out.short_number("Width", static_cast<uint16_t>(size.x));
  out.short_number("Height", static_cast<uint16_t>(size.y));
  out.short_number("Length", static_cast<uint16_t>(size.z));
  const int32_t corner[3] = {box.min.x, box.min.y, box.min.z};
  out.int_array("Offset", box.empty() ? std::span<const int32_t>() : corner);
  out.int_number("PaletteMax", static_cast<int32_t>(order.size()));
  out.open("Palette");
  std::vector<std::string> definitions;
  for (size_t i = 0; i < order.size(); ++i) {
    const Block& block = (*world.palette)[order[i].second];
    const std::string state = written_state(table, block);
    if (state.starts_with("loam:")) definitions.push_back(toml_from_block(block));
    out.int_number(state, static_cast<int32_t>(i));
    index_of[order[i].second] = static_cast<uint32_t>(i);
    data_bytes += order[i].first * varint_bytes(static_cast<uint32_t>(i));
  }
  out.close();
  out.open("Metadata");
  out.open("Loam");
  out.int_array("Origin", corner);
  out.list("Blocks", nbt::Type::text, static_cast<uint32_t>(definitions.size()));
  for (const std::string& text : definitions) out.put_text(text);
  out.close();
  out.close();
  if (data_bytes > kMostBlocks)
    return input_error(fmt::format("{}: its indices would take {} bytes, more than a .schem holds", name, data_bytes));
  out.array_head("BlockData", nbt::Type::byte_array, static_cast<uint32_t>(data_bytes));

  GzipFile file(path);
  file.write(out.bytes);
  StoreReader reader(world.store);
  std::string row;
  for (int y = box.min.y; y <= box.max.y; ++y)
    for (int z = box.min.z; z <= box.max.z; ++z) {
      row.clear();
      for (int x = box.min.x; x <= box.max.x;) {
        const LeafBlocks leaf = reader.leaf(leaf_from_voxel({x, y, z}));
        const int end = std::min((x | 7) + 1, box.max.x + 1);
        for (; x < end; ++x) append_varint(row, index_of[leaf[index_in_leaf({x, y, z})]]);
      }
      file.write(row);
    }
  out.bytes.clear();
  out.close();
  file.write(out.bytes);
  return file.close() ? Status{} : input_error(fmt::format("{}: cannot write; is the disk full?", name));
}

}  // namespace

const Format& schem_format() {
  static const Format format = {
      .name = "schem",
      .extensions = {".schem"},
      .what = "Sponge schematics, versions 1 to 3 (WorldEdit)",
      .recognizes = nullptr,
      .read = read_schem,
      .write = write_schem,
      .losses =
          [](const World& world) {
            std::vector<std::string> lost = lost_layers(world);
            for (std::string& more : lost_surroundings(world)) lost.push_back(std::move(more));
            return lost;
          },
  };
  return format;
}

}  // namespace world
