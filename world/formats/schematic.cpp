// The older schematics (.schematic) of MCEdit, WorldEdit and Schematica: numeric ids and data.
//
// A gzipped NBT tree: Width, Height, Length, Blocks [n] ids, Data [n] of 4 bits, AddBlocks [n / 2] nibbles with bits 8
// to 11 of the ids (the lower nibble first, as WorldEdit writes them), in the order (y * Length + z) * Width + x.
// SchematicaMapping names the ids of modded blocks. Axes are ours; the corner goes to the origin.
// source  minecraft.wiki, Schematic file format
#include <fmt/format.h>

#include "world/formats/cubes/box_filler.h"
#include "world/formats/format.h"
#include "world/formats/nbt/nbt.h"
#include "world/formats/nbt/nbt_file.h"
#include "world/formats/translation/translation.h"

namespace world {
namespace {

struct Schematic {
  VoxelPos size{0, 0, 0};
  std::span<const uint8_t> blocks, data, add;
  std::map<int, std::string> names;
  std::string materials;
  uint32_t block_entities = 0, entities = 0;
};

void read_tree(nbt::Reader& in, Schematic& out) {
  for (nbt::Entry e; in.next(e);) {
    if (e.name == "Width") {
      out.size.x = static_cast<uint16_t>(in.integer(e));
    } else if (e.name == "Height") {
      out.size.y = static_cast<uint16_t>(in.integer(e));
    } else if (e.name == "Length") {
      out.size.z = static_cast<uint16_t>(in.integer(e));
    } else if (e.name == "Blocks") {
      out.blocks = in.array(e, nbt::Type::byte_array);
    } else if (e.name == "Data") {
      out.data = in.array(e, nbt::Type::byte_array);
    } else if (e.name == "AddBlocks") {
      out.add = in.array(e, nbt::Type::byte_array);
    } else if (e.name == "Materials") {
      out.materials = in.text(e);
    } else if (e.name == "SchematicaMapping" && e.type == nbt::Type::compound) {
      for (nbt::Entry m; in.next(m);) out.names[static_cast<int>(in.integer(m)) & 4095] = m.name;
    } else if ((e.name == "TileEntities" || e.name == "Entities") && e.type == nbt::Type::list) {
      const auto [type, count] = in.list(e);
      (e.name == "Entities" ? out.entities : out.block_entities) = count;
      for (uint32_t i = 0; i < count && !in.failed(); ++i) in.skip(type);
    } else {
      in.skip(e);
    }
  }
}

Result<World> read_schematic(const std::filesystem::path& path, const ImportOptions& options, ImportReport& report) {
  const std::string name = path.string();
  TRY(const nbt::File file, nbt::open_file(path));
  nbt::Reader in(file.tree, name);
  Schematic schematic;
  in.root();
  read_tree(in, schematic);
  if (in.failed()) return in.error();
  const VoxelPos size = schematic.size;
  const uint64_t volume = static_cast<uint64_t>(size.x) * static_cast<uint64_t>(size.y) * static_cast<uint64_t>(size.z);
  if (schematic.blocks.size() < volume || schematic.data.size() < volume) {
    return input_error(fmt::format(
        "{}: {} x {} x {} blocks were announced, but Blocks and Data hold {} and {} bytes; schematics of Bedrock or "
        "Classic are not read",
        name, size.x, size.y, size.z, schematic.blocks.size(), schematic.data.size()));
  }
  if (!schematic.add.empty() && schematic.add.size() < (volume + 1) / 2)
    return input_error(fmt::format("{}: AddBlocks holds {} bytes, expected half a byte for each of {} blocks", name,
                                   schematic.add.size(), volume));

  World world(standard_blocks());
  Translator translator(translation_table("minecraft"), *world.palette);
  for (const auto& [id, mod_name] : schematic.names) translator.name_id(id, mod_name);
  const auto key_at = [&](size_t i) {
    const unsigned high = schematic.add.empty() ? 0 : schematic.add[i / 2] >> (i & 1) * 4 & 15;
    return high << 12 | static_cast<unsigned>(schematic.blocks[i]) << 4 | (schematic.data[i] & 15u);
  };
  std::vector<uint64_t> used(65536);  // voxels
  for (size_t i = 0; i < volume; ++i) ++used[key_at(i)];
  std::vector<BlockId> block_of(65536);
  int states = 0;
  std::map<unsigned, int> names;
  for (unsigned key = 0; key < used.size(); ++key) {
    if (!used[key]) continue;
    block_of[key] = translator.block(fmt::format("{}:{}", key >> 4, key & 15));
    ++states;
    ++names[key >> 4];
    if (options.count_states) report.states[fmt::format("{}:{}", key >> 4, key & 15)] = used[key];
  }
  BoxFiller filler(world.store, *file.budget);
  const size_t width = static_cast<size_t>(size.x), layer = width * static_cast<size_t>(size.z);
  const bool filled = filler.fill({0, 0, 0}, size, [&](int x, int y, int z) {
    return block_of[key_at(layer * static_cast<size_t>(y) + width * static_cast<size_t>(z) + static_cast<size_t>(x))];
  });
  if (!filled) return input_error(name + ": its blocks take more memory than a file of this size ever needs");
  filler.finish();

  report.fact("size", fmt::format("{} x {} x {}", size.x, size.y, size.z));
  report.fact("block names", std::to_string(names.size()));
  report.fact("block states", std::to_string(states));
  if (!schematic.names.empty()) report.fact("named ids", std::to_string(schematic.names.size()));
  TRY_STATUS(translator.finish(world, "schematic", path, options, report,
                               LeftBehind{schematic.entities, schematic.block_entities}));
  return world;
}

}  // namespace

const Format& schematic_format() {
  static const Format format = {
      .name = "schematic",
      .extensions = {".schematic"},
      .what = "older Minecraft schematics with numeric ids (MCEdit, WorldEdit, Schematica)",
      .recognizes = nullptr,
      .read = read_schematic,
      .write = nullptr,
  };
  return format;
}

}  // namespace world
