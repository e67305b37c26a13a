// MagicaVoxel .vox -> world.
//
// The file is z up, the world y up: a point (x, y, z) of the file becomes (x, z, -y), a quarter turn about x and no
// mirroring, so the cell [y, y + 1) becomes the voxel -y - 1.
// Where instances overlap, the one that comes later in the scene graph wins.
// Hidden parts come along, and the report names them; visible_only leaves them out.
// Each colour that is used becomes a block "vox:INDEX": sRGB to linear, each band kept within [kMinAlbedo, kMaxAlbedo],
// because no real surface reflects nothing or everything and light transport needs the bounds.
// Materials (MATL; the older MATT in the same words):
//   _diffuse            opaque, lambert
//   _metal              opaque, blinn_phong: the share _metal (1 where missing) of the colour is glossy, the rest
//                       matte; shininess is 1 - _rough (0.1 where missing)
//   _glass, _blend      not opaque, dielectric; _ri or 1 + _ior; one metre of it passes the colour, or the
//                       share _alpha (_trans in later files) of everything where that is more
//   _media              not opaque, a gas; extinction 10 * _d per metre, of which 1 - colour is absorbed
//   _emit > 0           emits kEmittedWatts * _emit * 10^_flux * colour; the file has no unit, the scale is ours:
//                       _emit = 1 at _flux 0 is the power of a lamp block
//   _loam               in files of ours: the block itself, as TOML, where the above can't say all of it
// Not carried over: _g, and _rough of other materials. The order of the palette on the screen (IMAP),
// row names (NOTE) and cameras (rCAM) go to the metadata.
#include "world/formats/vox.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <variant>

#include <fmt/format.h>

#include "world/base/text.h"
#include "world/formats/collector.h"

namespace world {

namespace {

constexpr float kMinAlbedo = 0.004f, kMaxAlbedo = 0.98f;
constexpr double kEmittedWatts = kVoxEmittedWatts;
constexpr uint64_t kMaxFileBytes = uint64_t{1} << 31;
constexpr uint64_t kNodeBytes = 32;  // a node of the scene graph in the file, at least
constexpr uint64_t kMaxInstancedVoxels = uint64_t{1} << 27;
constexpr size_t kMostKeptBytes = 4096;
constexpr size_t kMaxMetadataEntries = 64, kMaxMetadataBytes = 256;

/// IEC 61966-2-1.
double linear_from_srgb(uint8_t byte) {
  const double s = byte / 255.0;
  return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}

/// The number of an attribute, or `without` where it is missing or no finite number.
double number(const vox::Dictionary& attributes, const char* key, double without) {
  const auto found = attributes.find(key);
  if (found == attributes.end()) return without;
  const std::string& text = found->second;
  double value = without;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && std::isfinite(value) ? value : without;
}

std::string text(const vox::Dictionary& attributes, const char* key, const char* without) {
  const auto found = attributes.find(key);
  return found == attributes.end() ? without : found->second;
}

/// Names in files are any bytes; reports and saves want short, printable text.
std::string printable(std::string_view bytes) {
  std::string clean;
  for (const char c : bytes.substr(0, kMaxMetadataBytes)) clean += c >= 32 && c < 127 ? c : '?';
  return clean;
}

const vox::Dictionary* material_of(const vox::File& file, int colour) {
  const auto found = file.materials.find(colour);
  return found == file.materials.end() ? nullptr : &found->second;
}

std::string type_of(const vox::Dictionary* material) {
  const std::string type = material ? text(*material, "_type", "_diffuse") : "_diffuse";
  return type.empty() ? "_diffuse" : type;
}

bool known_type(const std::string& type) {
  for (const char* known : {"_diffuse", "_metal", "_glass", "_blend", "_media", "_emit"}) {
    if (type == known) return true;
  }
  return false;
}

Block plain_block(int colour, vox::Colour c, const vox::Dictionary* of_colour) {
  const auto band = [](uint8_t byte) {
    return std::clamp(static_cast<float>(linear_from_srgb(byte)), kMinAlbedo, kMaxAlbedo);
  };
  Block block;
  block.name = fmt::format("vox:{}", colour);
  block.albedo = {band(c.r), band(c.g), band(c.b)};
  if (!of_colour) return block;
  const vox::Dictionary& material = *of_colour;
  const std::string type = type_of(of_colour);

  if (type == "_metal") {
    block.bsdf = "blinn_phong";
    block.shininess = static_cast<float>(1 - std::clamp(number(material, "_rough", 0.1), 0.0, 1.0));
    const float metal = static_cast<float>(std::clamp(number(material, "_metal", 1), 0.0, 1.0));
    const Ratio3 reflectance = block.albedo;
    const auto matte = [&](float value) { return std::max(value * (1 - metal), kMinAlbedo); };
    block.albedo = {matte(reflectance.r), matte(reflectance.g), matte(reflectance.b)};
    const auto rest = [](float value, float albedo) { return std::max(value - albedo, 0.0f); };
    block.glossy = {rest(reflectance.r, block.albedo.r), rest(reflectance.g, block.albedo.g),
                    rest(reflectance.b, block.albedo.b)};
  }
  if (type == "_glass" || type == "_blend") {
    block.opaque = false;
    block.bsdf = "dielectric";
    const double index = number(material, "_ri", 1 + number(material, "_ior", 0.3));
    block.index_of_refraction = static_cast<float>(std::clamp(index, 1.0, 4.0));
    const double passed = std::clamp(number(material, "_trans", number(material, "_alpha", 0)), 0.0, 1.0);
    const auto absorbed = [&](float albedo) { return static_cast<float>(-std::log(std::max<double>(albedo, passed))); };
    block.absorption = {absorbed(block.albedo.r), absorbed(block.albedo.g), absorbed(block.albedo.b)};
  }
  if (type == "_media") {
    block.opaque = false;
    block.phase = Phase::gas;
    block.density = {1.2};
    block.hardness = 0;
    const float extinction = static_cast<float>(std::clamp(10 * number(material, "_d", 0.05), 0.0, 1e3));
    block.absorption = {extinction * (1 - block.albedo.r), extinction * (1 - block.albedo.g),
                        extinction * (1 - block.albedo.b)};
  }
  const double emit = std::clamp(number(material, "_emit", 0), 0.0, 1e3);
  if (emit > 0) {
    const double flux = std::clamp(number(material, "_flux", 0), 0.0, 6.0);
    const float watts = static_cast<float>(kEmittedWatts * emit * std::pow(10.0, flux));
    block.emission = {block.albedo.r * watts, block.albedo.g * watts, block.albedo.b * watts};
  }
  return block;
}

/// The block that a file of ours keeps beside a colour, or nothing.
std::optional<Block> kept_block(const vox::Dictionary* material) {
  const std::string toml = material ? text(*material, "_loam", "") : "";
  if (toml.empty() || toml.size() > kMostKeptBytes) return {};
  BlockPalette one;
  if (!add_blocks_from_toml(one, toml, "_loam").ok() || one.size() != 2) return {};
  return one[1];
}

void add_metadata(World& world, const vox::File& file, const std::string& name) {
  set_origin(world, "vox", name);
  world.metadata["vox.version"] = std::to_string(file.version);
  const auto join = [](const vox::Dictionary& dictionary) {
    std::string all;
    for (const auto& [key, value] : dictionary) all += (all.empty() ? "" : " ") + key + "=" + value;
    return printable(all);
  };
  for (size_t i = 0; i < std::min(file.cameras.size(), kMaxMetadataEntries); ++i) {
    world.metadata[fmt::format("vox.camera.{}", i)] = join(file.cameras[i]);
  }
  for (size_t i = 0; i < std::min(file.notes.size(), kMaxMetadataEntries); ++i) {
    if (!file.notes[i].empty()) world.metadata[fmt::format("vox.note.{}", i)] = printable(file.notes[i]);
  }
  size_t layers = 0;
  for (const auto& [id, attributes] : file.layers) {
    if (!attributes.empty() && layers++ < kMaxMetadataEntries)
      world.metadata[fmt::format("vox.layer.{}", id)] = join(attributes);
  }
  if (file.index_map) {
    std::string all;
    for (const uint8_t entry : *file.index_map) all += (all.empty() ? "" : " ") + std::to_string(entry);
    world.metadata["vox.index_map"] = all;
  }
}

/// What the table says about the file, whatever was left out of the world.
void add_facts(const vox::File& file, const std::vector<vox::Instance>& all, ImportReport& report) {
  uint64_t voxels = 0, instanced = 0, rotated = 0, hidden = 0;
  for (const vox::Model& model : file.models) voxels += model.voxels.size();
  std::map<std::string, uint64_t> hidden_parts;
  for (const vox::Instance& instance : all) {
    const uint64_t n = file.models[static_cast<size_t>(instance.model)].voxels.size();
    instanced += n;
    rotated += instance.transform.rotated();
    hidden += instance.hidden;
    if (instance.hidden) hidden_parts[instance.name] += n;
  }
  report.fact("file version", std::to_string(file.version));
  report.fact("models", std::to_string(file.models.size()));
  report.fact("voxels", std::to_string(voxels));
  report.fact("instances", fmt::format("{} ({} rotated, {} hidden)", all.size(), rotated, hidden));
  report.fact("instanced voxels", std::to_string(instanced));
  report.fact("palette", file.has_palette ? "RGBA" : "default");
  if (file.pack) report.fact("PACK", std::to_string(*file.pack));
  if (file.old_materials) report.fact("MATT", std::to_string(file.old_materials));
  for (const auto& [part, n] : hidden_parts) {
    report.warnings.push_back(fmt::format("the hidden part '{}' ({} voxels) was found", printable(part), n));
    if (hidden_parts.size() <= kMaxMetadataEntries)
      report.fact(("hidden part " + printable(part)).c_str(), fmt::format("{} voxels", n));
  }
  std::string skipped;
  for (const auto& [id, count] : file.unknown_chunks) {
    if (skipped.size() > kMaxMetadataBytes) break;
    skipped += (skipped.empty() ? "" : ", ") + fmt::format("{} {}", count, id);
  }
  if (!skipped.empty()) report.fact("other chunks", skipped);
  if (file.trailing_bytes)
    report.warnings.push_back(fmt::format("{} bytes after the main chunk were skipped", file.trailing_bytes));
  if (file.version != 150 && file.version != 200) {
    report.warnings.push_back(fmt::format("the file version {} is not one that is known (150, 200)", file.version));
  }
}

void count_colours(std::span<const vox::Voxel> voxels, std::array<uint64_t, 256>& used) {
  // Four tables: neighbours are often alike, and additions to one counter wait for each other.
  std::array<std::array<uint64_t, 256>, 4> table{};
  for (size_t i = 0; i < voxels.size(); ++i) ++table[i & 3][voxels[i].colour];
  for (size_t c = 0; c < 256; ++c) used[c] += table[0][c] + table[1][c] + table[2][c] + table[3][c];
}

/// From the file's axes, z up, to the world's.
VoxelPos world_from_cell(const std::array<int64_t, 3>& cell) {
  return {static_cast<int32_t>(cell[0]), static_cast<int32_t>(cell[2]), static_cast<int32_t>(-cell[1] - 1)};
}
bool inside_border(const std::array<int64_t, 3>& cell) {
  return std::max({std::abs(cell[0]), std::abs(cell[1]), std::abs(cell[2])}) < int64_t{kWorldBorder};
}

/// Puts the voxels of an instance into the collector: true, or false where that has no room, or the first cell that
/// lies outside of the world.
std::variant<bool, std::array<int64_t, 3>> place(const vox::Instance& instance, const vox::Model& model,
                                                 const std::array<BlockId, 256>& block_of, VoxelCollector& collector) {
  const std::array<int32_t, 3>& size = model.size;
  const auto cell = [&](const vox::Voxel& v) { return vox::cell(instance.transform, model, v); };
  const bool empty = std::min({size[0], size[1], size[2]}) == 0;
  const auto last = [&](size_t axis) { return static_cast<uint8_t>(empty ? 0 : size[axis] - 1); };
  const std::array<int64_t, 3> corners[2] = {cell({0, 0, 0, 0}), cell({last(0), last(1), last(2), 0})};
  // Tables pay off beyond some thousand voxels.
  if (model.voxels.size() < 4096 || !inside_border(corners[0]) || !inside_border(corners[1])) {
    for (const vox::Voxel& v : model.voxels) {
      if (v.colour == 0) continue;
      const auto at = cell(v);
      if (!inside_border(at)) return at;
      if (!collector.set(world_from_cell(at), block_of[v.colour])) return false;
    }
    return true;
  }
  // Each coordinate of the model runs along one axis of the world. So the leaf of a voxel, among those that the model
  // may touch, and the voxel's place in it are sums of what each coordinate adds: leaf << 9 | index_in_leaf.
  const VoxelPos a = world_from_cell(corners[0]), b = world_from_cell(corners[1]);
  const LeafPos low = leaf_from_voxel({std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)});
  const LeafPos high = leaf_from_voxel({std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)});
  const VoxelPos extent{high.x - low.x + 1, high.y - low.y + 1, high.z - low.z + 1};
  const auto key = [&](VoxelPos v) {
    const LeafPos l = leaf_from_voxel(v) - low;
    return static_cast<uint32_t>(((l.x * extent.y + l.y) * extent.z + l.z) << 9 | index_in_leaf(v));
  };
  std::array<std::array<uint32_t, 256>, 3> adds{};
  for (size_t axis = 0; axis < 3; ++axis)
    for (int k = 0; k < size[axis]; ++k) {
      const auto c = static_cast<uint8_t>(k);
      const vox::Voxel v{axis == 0 ? c : uint8_t{0}, axis == 1 ? c : uint8_t{0}, axis == 2 ? c : uint8_t{0}, 0};
      adds[axis][c] = key(world_from_cell(cell(v))) - (axis == 0 ? 0 : key(a));
    }
  std::vector<VoxelCollector::Blocks*> leaves(static_cast<size_t>(extent.x * extent.y * extent.z), nullptr);
  for (const vox::Voxel& v : model.voxels) {
    if (v.colour == 0) continue;
    const uint32_t at = adds[0][v.x] + adds[1][v.y] + adds[2][v.z];
    VoxelCollector::Blocks*& blocks = leaves[at >> 9];
    if (!blocks) {
      blocks = collector.leaf(leaf_from_voxel(world_from_cell(cell(v))));
      if (!blocks) return false;
    }
    (*blocks)[at & 511] = block_of[v.colour];
  }
  return true;
}

}  // namespace

Result<World> world_from_vox(const vox::File& file, const std::string& name, const ImportOptions& options,
                             ImportReport& report) {
  TRY(const std::vector<vox::Instance> all, vox::instances(file, name, options.frame));
  uint64_t instanced = 0;
  for (const vox::Instance& instance : all) instanced += file.models[static_cast<size_t>(instance.model)].voxels.size();
  if (instanced > kMaxInstancedVoxels) {
    return input_error(
        fmt::format("{}: its scene shows {} voxels; at most {} are read", name, instanced, kMaxInstancedVoxels));
  }
  add_facts(file, all, report);

  World world;
  // A block for each colour that is used, in order of the palette.
  std::array<uint64_t, 256> used{};
  for (const vox::Instance& instance : all) {
    if (options.visible_only && instance.hidden) continue;
    count_colours(file.models[static_cast<size_t>(instance.model)].voxels, used);
  }
  std::array<BlockId, 256> block_of{};
  std::map<std::string, int> types;
  int colours = 0;
  for (int colour = 1; colour < 256; ++colour) {
    if (!used[static_cast<size_t>(colour)]) continue;
    const vox::Dictionary* const material = material_of(file, colour);
    const std::string type = type_of(material);
    std::optional<Block> kept = kept_block(material);
    // The name of another colour is no block of ours.
    if (kept && kept->name.starts_with("vox:") && kept->name != fmt::format("vox:{}", colour)) kept.reset();
    const auto id = kept ? world.palette->add(std::move(*kept)) : Result<BlockId>(Error{});
    if (id) {
      block_of[static_cast<size_t>(colour)] = *id;
    } else {
      TRY(block_of[static_cast<size_t>(colour)],
          world.palette->add(plain_block(colour, file.palette[static_cast<size_t>(colour)], material)));
    }
    ++types[type];
    ++colours;
    if (!known_type(type)) report.unmapped["material " + printable(type)] += used[static_cast<size_t>(colour)];
  }
  if (options.strict && !report.unmapped.empty()) {
    return input_error(fmt::format("{}: the {} is not known; leave --strict out to read it as diffuse", name,
                                   report.unmapped.begin()->first));
  }
  if (used[0])
    report.warnings.push_back(
        fmt::format("{} voxels have the colour 0, which means empty; they were left out", used[0]));

  // The scene graph can show a few voxels at places without end: what they take follows from the file's own size.
  uint64_t stored = file.nodes.size() * kNodeBytes;
  for (const vox::Model& model : file.models) stored += model.voxels.size() * sizeof(vox::Voxel);
  MemoryBudget budget(stored);
  VoxelCollector collector(&budget);
  for (const vox::Instance& instance : all) {
    if (options.visible_only && instance.hidden) continue;
    const vox::Model& model = file.models[static_cast<size_t>(instance.model)];
    const auto placed = place(instance, model, block_of, collector);
    if (const auto* outside = std::get_if<std::array<int64_t, 3>>(&placed)) {
      return input_error(
          fmt::format("{}: the part '{}' lies at ({}, {}, {}), outside of the world's border of {} voxels", name,
                      printable(instance.name), (*outside)[0], (*outside)[1], (*outside)[2], int64_t{kWorldBorder}));
    }
    if (!std::get<bool>(placed)) {
      return input_error(fmt::format(
          "{}: its voxels are scattered over more cubes of 8 x 8 x 8 than a file of this size ever needs", name));
    }
  }
  report.fact("distinct voxels", std::to_string(collector.distinct()));
  report.fact("colours used", std::to_string(colours));
  std::string materials;
  for (const auto& [type, count] : types)
    materials += (materials.empty() ? "" : ", ") + fmt::format("{} {}", printable(type), count);
  report.fact("materials used", materials);
  collector.move_into(world.store);
  add_metadata(world, file, name);
  return world;
}

Block block_of_colour(int colour, vox::Colour c, const vox::Dictionary& material) {
  if (std::optional<Block> kept = kept_block(&material)) return *kept;
  return plain_block(colour, c, &material);
}

const Format& vox_format() {
  static const Format format = {
      .name = "vox",
      .extensions = {".vox"},
      .what = "MagicaVoxel models and scenes",
      .recognizes =
          [](const std::vector<uint8_t>& head) {
            return head.size() >= 4 && head[0] == 'V' && head[1] == 'O' && head[2] == 'X' && head[3] == ' ';
          },
      .read = [](const std::filesystem::path& path, const ImportOptions& options,
                 ImportReport& report) -> Result<World> {
        TRY(const std::vector<uint8_t> bytes, read_file(path, kMaxFileBytes));
        TRY(const vox::File file, vox::parse(bytes, path.string()));
        return world_from_vox(file, path.string(), options, report);
      },
      .write = write_vox,
      .losses = vox_losses,
  };
  return format;
}

}  // namespace world
