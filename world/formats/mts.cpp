// Luanti's schematics (.mts): trees, logs, ruins.
//
//   "MTSM", version 1 to 4, size x y z; probabilities of the y slices (3 on); names; zlib of content ids [n] of 16
//   bits, param1 [n], param2 [n]; index z * sx * sy + y * sx + x. All big-endian.
// param1 holds the probability that a node is placed (7 bits from version 4 on, 127 always, 0 never), and whether it
// replaces what is there: a world needs no dice, so every node is placed. Axes: as in luanti.cpp, z turned round.
// source  Luanti, src/mapgen/mg_schematic.h
#include <fmt/format.h>

#include "world/formats/archive/inflate.h"
#include "world/formats/bytes.h"
#include "world/formats/cubes/box_filler.h"
#include "world/formats/format.h"
#include "world/formats/luanti/map_block.h"
#include "world/formats/nbt/nbt.h"
#include "world/formats/translation/translation.h"

namespace world {
namespace {

constexpr uint64_t kMostFileBytes = uint64_t{1} << 30;
constexpr int kLastVersion = 4;

uint16_t u16(ByteReader& in) {
  const auto b = in.bytes(2);
  return b.size() == 2 ? nbt::big_endian<uint16_t>(b.data()) : uint16_t{0};
}

Result<World> read_mts(const std::filesystem::path& path, const ImportOptions& options, ImportReport& report) {
  const std::string name = path.string();
  TRY(const std::vector<uint8_t> bytes, read_file(path, kMostFileBytes));
  MemoryBudget budget(bytes.size());
  ByteReader in(bytes, name);
  const auto magic = in.bytes(4);
  if (in.failed() || std::string_view(reinterpret_cast<const char*>(magic.data()), 4) != "MTSM")
    return byte_error(name, 0, "expected 'MTSM'; it is no schematic of Luanti");
  const uint16_t version = u16(in);
  const VoxelPos size{u16(in), u16(in), u16(in)};
  if (in.failed()) return in.end_error("its header");
  if (version < 1 || version > kLastVersion)
    return in.error(fmt::format("the version {} is not one that is read (1 to {})", version, kLastVersion));
  if (version >= 3) in.bytes(static_cast<size_t>(size.y));
  std::vector<std::string> names;
  for (int n = u16(in); n > 0 && !in.failed(); --n) {
    const auto text = in.bytes(u16(in));
    names.emplace_back(text.begin(), text.end());
  }
  if (in.failed()) return in.end_error("its names");
  const uint64_t volume = static_cast<uint64_t>(size.x) * static_cast<uint64_t>(size.y) * static_cast<uint64_t>(size.z);
  Inflater inflater(budget);
  const uint64_t at = in.offset();
  const auto nodes = inflater.inflate(in.bytes(in.remaining()), volume * 4);
  if (!nodes) return byte_error(name, at, nodes.error().message);
  if (nodes->size() != volume * 4) {
    return byte_error(name, at,
                      fmt::format("{} x {} x {} nodes take {} bytes, but it holds {}", size.x, size.y, size.z,
                                  volume * 4, nodes->size()));
  }

  World world(standard_blocks());
  Translator translator(translation_table("luanti"), *world.palette);
  std::map<std::pair<uint16_t, uint8_t>, BlockId> turned;  // stairs, by content and param2
  std::vector<BlockId> block_of;
  std::vector<bool> turns;
  for (const std::string& node : names) {
    turns.push_back(luanti::node_state(node, 0) != node);
    block_of.push_back(translator.block(node));
  }
  const auto content_at = [&](size_t i) { return nbt::big_endian<uint16_t>(nodes->data() + 2 * i); };
  const uint8_t* const param1 = nodes->data() + volume * 2;
  const uint8_t* const param2 = nodes->data() + volume * 3;
  uint64_t never = 0, sometimes = 0;
  for (size_t i = 0; i < volume; ++i) {
    const uint16_t content = content_at(i);
    if (content >= names.size())
      return byte_error(name, at, fmt::format("node {} has the content {}, but {} names", i, content, names.size()));
    if (turns[content] && !turned.contains({content, param2[i]}))
      turned[{content, param2[i]}] = translator.block(luanti::node_state(names[content], param2[i]));
    const int probability = version >= 4 ? param1[i] & 127 : param1[i] / 2;
    if (options.count_states) ++report.states[names[content]];
    never += probability == 0;
    sometimes += probability > 0 && probability < 127;
  }
  BoxFiller filler(world.store, budget);
  const size_t row = static_cast<size_t>(size.x), slice = row * static_cast<size_t>(size.y);
  const bool filled = filler.fill({0, 0, -size.z}, size, [&](int x, int y, int z) {
    const size_t i =
        slice * static_cast<size_t>(size.z - 1 - z) + row * static_cast<size_t>(y) + static_cast<size_t>(x);
    const uint16_t content = content_at(i);
    return turns[content] ? turned.at({content, param2[i]}) : block_of[content];
  });
  if (!filled) return input_error(name + ": its nodes take more memory than a file of this size ever needs");
  filler.finish();

  report.fact("version", std::to_string(version));
  report.fact("size", fmt::format("{} x {} x {}", size.x, size.y, size.z));
  report.fact("node names", std::to_string(names.size()));
  report.fact("placed by chance", std::to_string(sometimes));
  report.fact("never placed", std::to_string(never));
  TRY_STATUS(translator.finish(world, "mts", path, options, report));
  return world;
}

}  // namespace

const Format& mts_format() {
  static const Format format = {
      .name = "mts",
      .extensions = {".mts"},
      .what = "Luanti (Minetest) schematics",
      .recognizes =
          [](const std::vector<uint8_t>& head) {
            return head.size() >= 4 && head[0] == 'M' && head[1] == 'T' && head[2] == 'S' && head[3] == 'M';
          },
      .read = read_mts,
      .write = nullptr,
  };
  return format;
}

}  // namespace world
