// Litematica's schematics (.litematic): several named regions, each with a palette of its own.
//
// A gzipped NBT tree: Regions.NAME has Position and Size (x, y, z), BlockStatePalette, and BlockStates: indices of
// max(2, ceil(log2 of the palette)) bits, packed across 64-bit words, in the order (y * |sz| + z) * |sx| + x.
// A negative size means that the region reaches from its position towards smaller coordinates, so that its corner lies
// at position + size + 1. Axes are ours; positions are taken as they are. Where regions overlap, the later one wins.
// source  maruohon, litematica, schematic/LitematicaSchematic.java, and its use in other programs
#include <fmt/format.h>

#include "world/formats/cubes/box_filler.h"
#include "world/formats/format.h"
#include "world/formats/nbt/block_state.h"
#include "world/formats/nbt/nbt_file.h"
#include "world/formats/translation/translation.h"

namespace world {
namespace {

constexpr int32_t kReach = 1 << 28;  // of positions and sizes

struct Region {
  std::string name;
  std::array<int64_t, 3> position{}, size{};
  std::vector<std::string> palette;
  std::span<const uint8_t> words;
  uint32_t block_entities = 0, entities = 0;
};

struct Litematic {
  int version = 0, data_version = 0;
  int64_t total_blocks = -1;
  std::vector<Region> regions;
};

void read_vector(nbt::Reader& in, std::array<int64_t, 3>& out) {
  for (nbt::Entry e; in.next(e);) {
    if (e.name == "x")
      out[0] = in.integer(e);
    else if (e.name == "y")
      out[1] = in.integer(e);
    else if (e.name == "z")
      out[2] = in.integer(e);
    else
      in.skip(e);
  }
}

void read_region(nbt::Reader& in, Region& out) {
  for (nbt::Entry e; in.next(e);) {
    const bool compound = e.type == nbt::Type::compound;
    if (e.name == "Position" && compound) {
      read_vector(in, out.position);
    } else if (e.name == "Size" && compound) {
      read_vector(in, out.size);
    } else if (e.name == "BlockStatePalette") {
      for (uint32_t n = in.list(e, nbt::Type::compound); n > 0 && !in.failed(); --n) {
        const auto state = nbt::read_block_state(in);
        if (!state) return void(in.wrong("an entry of a palette is no block state"));
        out.palette.push_back(*state);
      }
    } else if (e.name == "BlockStates") {
      out.words = in.array(e, nbt::Type::long_array);
    } else if ((e.name == "TileEntities" || e.name == "Entities") && e.type == nbt::Type::list) {
      const auto [type, count] = in.list(e);
      (e.name == "Entities" ? out.entities : out.block_entities) = count;
      for (uint32_t i = 0; i < count && !in.failed(); ++i) in.skip(type);
    } else {
      in.skip(e);
    }
  }
}

void read_tree(nbt::Reader& in, Litematic& out) {
  for (nbt::Entry e; in.next(e);) {
    if (e.name == "Version") {
      out.version = static_cast<int>(in.integer(e));
    } else if (e.name == "MinecraftDataVersion") {
      out.data_version = static_cast<int>(in.integer(e));
    } else if (e.name == "Metadata" && e.type == nbt::Type::compound) {
      for (nbt::Entry m; in.next(m);) {
        if (m.name == "TotalBlocks")
          out.total_blocks = in.integer(m);
        else
          in.skip(m);
      }
    } else if (e.name == "Regions" && e.type == nbt::Type::compound) {
      for (nbt::Entry r; in.next(r);) {
        if (!in.compound(r)) return;
        out.regions.emplace_back();
        out.regions.back().name = plain_name(r.name);
        read_region(in, out.regions.back());
      }
    } else {
      in.skip(e);
    }
  }
}

/// Indices packed across words, at random.
struct PackedIndices {
  const uint8_t* words;
  unsigned bits;
  uint64_t operator[](uint64_t i) const {
    const uint64_t bit = i * bits, word = bit / 64;
    const unsigned shift = bit % 64;
    uint64_t value = nbt::big_endian<uint64_t>(words + word * 8) >> shift;
    if (shift + bits > 64) value |= nbt::big_endian<uint64_t>(words + word * 8 + 8) << (64 - shift);
    return value & ((uint64_t{1} << bits) - 1);
  }
};

Status fill_region(const Region& region, const std::string& file, Translator& translator, BoxFiller& filler,
                   std::map<std::string, uint64_t>* states) {
  const std::string name = fmt::format("{}: region '{}'", file, region.name);
  VoxelPos corner, size;
  for (int a = 0; a < 3; ++a) {
    const int64_t s = region.size[static_cast<size_t>(a)], p = region.position[static_cast<size_t>(a)];
    if (std::max(std::abs(s), std::abs(p)) > kReach || s == INT64_MIN || p == INT64_MIN)
      return input_error(fmt::format("{} lies at {} and is {} long; that is outside of the world", name, p, s));
    corner[a] = static_cast<int32_t>(s < 0 ? p + s + 1 : p);
    size[a] = static_cast<int32_t>(std::abs(s));
  }
  if (region.palette.empty()) return input_error(name + " has no palette");
  unsigned bits = 2;
  while ((uint64_t{1} << bits) < region.palette.size()) ++bits;
  const auto volume =
      static_cast<unsigned __int128>(size.x) * static_cast<unsigned>(size.y) * static_cast<unsigned>(size.z);
  if ((volume * bits + 63) / 64 > region.words.size() / 8) {
    return input_error(fmt::format("{}: {} x {} x {} indices of {} bits were announced, but it has {} words of 64 bits",
                                   name, size.x, size.y, size.z, bits, region.words.size() / 8));
  }
  std::vector<BlockId> blocks;
  for (const std::string& state : region.palette) blocks.push_back(translator.block(state));
  const PackedIndices indices{region.words.data(), bits};
  uint64_t beyond = 0;
  std::vector<uint64_t> counts(blocks.size());
  const uint64_t width = static_cast<uint64_t>(size.x), length = static_cast<uint64_t>(size.z);
  const bool filled = filler.fill(corner, size, [&](int x, int y, int z) {
    const uint64_t index =
        indices[(static_cast<uint64_t>(y) * length + static_cast<uint64_t>(z)) * width + static_cast<uint64_t>(x)];
    if (index < blocks.size()) {
      ++counts[index];
      return blocks[index];
    }
    ++beyond;
    return kAir;
  });
  if (!filled) return input_error(name + " takes more memory than a file of this size ever needs");
  if (beyond)
    return input_error(fmt::format("{}: {} indices lie beyond its palette of {}", name, beyond, blocks.size()));
  for (size_t i = 0; i < counts.size() && states; ++i)
    if (counts[i]) (*states)[region.palette[i]] += counts[i];
  return {};
}

Result<World> read_litematic(const std::filesystem::path& path, const ImportOptions& options, ImportReport& report) {
  const std::string name = path.string();
  TRY(const nbt::File file, nbt::open_file(path));
  nbt::Reader in(file.tree, name);
  Litematic litematic;
  in.root();
  read_tree(in, litematic);
  if (in.failed()) return in.error();
  if (litematic.regions.empty()) return input_error(name + ": holds no regions; it is no .litematic, or damaged");

  World world(standard_blocks());
  Translator translator(translation_table("minecraft"), *world.palette);
  BoxFiller filler(world.store, *file.budget);
  report.fact("version", std::to_string(litematic.version));
  report.fact("data version", std::to_string(litematic.data_version));
  if (litematic.total_blocks >= 0) report.fact("total blocks", std::to_string(litematic.total_blocks));
  report.fact("regions", std::to_string(litematic.regions.size()));
  uint32_t entities = 0, block_entities = 0;
  for (size_t i = 0; i < litematic.regions.size(); ++i) {
    const Region& region = litematic.regions[i];
    TRY_STATUS(fill_region(region, name, translator, filler, options.count_states ? &report.states : nullptr));
    entities += region.entities;
    block_entities += region.block_entities;
    if (i < 16) {
      report.fact("region " + region.name,
                  fmt::format("{} x {} x {} at {} {} {}, palette {}", region.size[0], region.size[1], region.size[2],
                              region.position[0], region.position[1], region.position[2], region.palette.size()));
    }
  }
  filler.finish();
  TRY_STATUS(translator.finish(world, "litematic", path, options, report, LeftBehind{entities, block_entities}));
  return world;
}

}  // namespace

const Format& litematic_format() {
  static const Format format = {
      .name = "litematic",
      .extensions = {".litematic"},
      .what = "Litematica's schematics of several regions",
      .recognizes = nullptr,
      .read = read_litematic,
      .write = nullptr,
  };
  return format;
}

}  // namespace world
