/// The palette of blocks and the reader of world/blocks/*.toml. A block is one section:
///
///   [granite]                                  lower_snake_case; the name in scenes, saves and on the command line
///   albedo = [0.29, 0.25, 0.23]                required; diffuse reflectance, linear, each band in (0, 1)
///   density_kg_per_m3 = 2700                   required; > 0
///   heat_capacity_j_per_kg_k = 790             required; > 0
///   heat_conductivity_w_per_m_k = 2.9          required; > 0
///   hardness_mohs = 6.5                        required; 0 to 10
///   repose_deg = 35                            steepest slope at rest, 15 to 70; only of phase granular; 35 where
///                                              missing
///   viscosity_pa_s = 0.001                     dynamic, > 0, up to 1e7; only of phase liquid; that of water, 0.001,
///                                              where missing
///   phase = "solid"                            gas, liquid, granular or solid; solid where missing
///   opaque = true                              no light passes; true where missing
///   bsdf = "lambert"                           by name (render/bsdf); lambert where missing
///   glossy = [0.04, 0.04, 0.04]                k_g, 0 to 1; with albedo, which is k_L, at most 1; where missing 0, but
///                                              0.04 or what albedo leaves for blinn_phong
///   shininess = 0.5                            0 (rough) to 1 (smooth): exponent 8192^shininess; 0.5 where missing
///   transmission = [0, 0, 0]                   of a thin sheet, 0 to 1; with albedo at most 1; 0 where missing
///   coverage = 1                               the part of the surface that is there, 0 to 1; 1 where missing
///   emission_w = [0, 0, 0]                     W of the whole voxel, >= 0; dark where missing
///   absorption_per_m = [0, 0, 0]               of light that passes, >= 0; only where opaque = false
///   index_of_refraction = 1.0                  1 to 5; 1 where missing
///   ignition_k = 573                           K, > 0; does not burn where missing
///   proxy = "cross"                            shape drawn instead of the cube: the cube where missing
///   texture = "speckle"                        how its albedo varies (render/textures); even where missing
///   texture_contrast = 0.3                     the most that it varies by, over the albedo, 0 to 1; 0.3 where missing
/// Textures belong to standard blocks alone: see block_texture.h.
#include <algorithm>
#include <map>

#include "world/base/text.h"
#include "world/base/toml_reader.h"
#include "world/blocks/block.h"
#include "world/blocks/block_texture.h"

#include "block_files.h"

namespace world {

namespace {

constexpr std::string_view kPhaseNames[] = {"gas", "liquid", "granular", "solid"};
constexpr float kUsualGlossy = 0.04f;  // what glass, plastic and most minerals mirror at normal incidence (index 1.5)
constexpr NumberRange kAlbedoRange{.min = 0, .max = 1, .open_min = true, .open_max = true};
constexpr NumberRange kShareRange{.min = 0, .max = 1};
constexpr NumberRange kAtLeastZero{.min = 0};
constexpr NumberRange kAboveZero{.min = 0, .open_min = true};
constexpr NumberRange kRefractionRange{.min = 1, .max = 5};
constexpr NumberRange kHardnessRange{.min = 0, .max = 10};
constexpr NumberRange kReposeRange{.min = 15, .max = 70};
constexpr NumberRange kViscosityRange{.min = 0, .max = 1e7, .open_min = true};

/// lower_snake_case; or source:name of an imported palette entry, where the name is printable and needs no escapes.
bool name_is_plain(std::string_view name) {
  if (const size_t colon = name.find(':'); colon != std::string_view::npos && colon > 0)
    return std::all_of(name.begin(), name.end(), [](char c) { return c > ' ' && c < 127 && c != '"' && c != '\\'; });
  if (name.empty() || name[0] < 'a' || name[0] > 'z') return false;
  return std::all_of(name.begin(), name.end(),
                     [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; });
}

Block air() {
  Block block;
  block.name = "air";
  block.phase = Phase::gas;
  block.opaque = false;
  block.index_of_refraction = 1.00029f;
  block.density = Density{1.2};
  block.heat_capacity = HeatCapacity{1005};
  block.heat_conductivity = HeatConductivity{0.026};
  block.hardness = 0;
  return block;
}

bool same(const Block& a, const Block& b) {
  return a.phase == b.phase && a.opaque == b.opaque && a.albedo == b.albedo && a.bsdf == b.bsdf &&
         a.glossy == b.glossy && a.shininess == b.shininess && a.transmission == b.transmission &&
         a.coverage == b.coverage && a.emission == b.emission && a.absorption == b.absorption &&
         a.index_of_refraction == b.index_of_refraction && a.density == b.density &&
         a.heat_capacity == b.heat_capacity && a.heat_conductivity == b.heat_conductivity && a.ignition == b.ignition &&
         a.hardness == b.hardness && a.repose_deg == b.repose_deg && a.viscosity_pa_s == b.viscosity_pa_s &&
         a.proxy == b.proxy;
}

template <class Bands>
bool read_bands(TomlTable& table, std::string_view key, Bands& out, NumberRange range, bool required = false) {
  float bands[3];
  const std::span<float> values(bands);
  if (!(required ? table.require(key, values, range) : table.read(key, values, range))) return false;
  out = {bands[0], bands[1], bands[2]};
  return true;
}

/// What is wrong where albedo and `other` scatter more than arrives, or nothing. Decimals that add to 1 may round
/// above.
std::optional<std::string> exceeds_one(const Block& block, std::string_view property, Ratio3 other) {
  const float most = (block.albedo + other).max();
  if (most <= 1 + 1e-6f) return std::nullopt;
  return "'albedo' and '" + std::string(property) + "' add up to " + number_text(most) +
         " in a band, but must be at most 1: a surface can't scatter more than arrives";
}

Status check_value(const Block& block, const char* property, float value, const NumberRange& range) {
  if (range.contains(value)) return {};
  return input_error("block '" + block.name + "': " + property + " is " + number_text(value) + ", but must be " +
                     range.text());
}
Status check_value(const Block& block, const char* property, double value, const NumberRange& range) {
  if (range.contains(value)) return {};
  return input_error("block '" + block.name + "': " + property + " is " + number_text(value) + ", but must be " +
                     range.text());
}
template <class Bands>
Status check_bands(const Block& block, const char* property, Bands bands, const NumberRange& range) {
  for (const float value : {bands.r, bands.g, bands.b}) TRY_STATUS(check_value(block, property, value, range));
  return {};
}

}  // namespace

Block read_block(const std::string& name, TomlTable& table) {
  Block block;
  block.name = name;
  if (!name_is_plain(name))
    table.fail({}, "the block name '" + name + "' must be lower_snake_case (a-z, 0-9 and _), or source:name");
  int phase = static_cast<int>(block.phase);
  table.read_choice("phase", phase, kPhaseNames);
  block.phase = static_cast<Phase>(phase);
  table.read("opaque", block.opaque);
  read_bands(table, "albedo", block.albedo, kAlbedoRange, true);
  if (table.read("bsdf", block.bsdf)) block.where_bsdf = table.where("bsdf");
  const bool has_glossy = read_bands(table, "glossy", block.glossy, kShareRange);
  if (!has_glossy && block.bsdf == "blinn_phong") {
    const auto left = [](float albedo) { return std::min(kUsualGlossy, 1 - albedo); };
    block.glossy = {left(block.albedo.r), left(block.albedo.g), left(block.albedo.b)};
  }
  if (const auto wrong = exceeds_one(block, "glossy", block.glossy)) table.fail("glossy", *wrong);
  table.read("shininess", block.shininess, kShareRange);
  read_bands(table, "transmission", block.transmission, kShareRange);
  if (const auto wrong = exceeds_one(block, "transmission", block.transmission)) table.fail("transmission", *wrong);
  table.read("coverage", block.coverage, kShareRange);
  read_bands(table, "emission_w", block.emission, kAtLeastZero);
  if (read_bands(table, "absorption_per_m", block.absorption, kAtLeastZero) && block.opaque)
    table.fail("absorption_per_m", "'absorption_per_m' needs 'opaque = false': no light enters an opaque block");
  table.read("index_of_refraction", block.index_of_refraction, kRefractionRange);
  table.require("density_kg_per_m3", block.density.value, kAboveZero);
  table.require("heat_capacity_j_per_kg_k", block.heat_capacity.value, kAboveZero);
  table.require("heat_conductivity_w_per_m_k", block.heat_conductivity.value, kAboveZero);
  double ignition = 0;
  if (table.read("ignition_k", ignition, kAboveZero)) block.ignition = Kelvin{ignition};
  table.require("hardness_mohs", block.hardness, kHardnessRange);
  if (table.read("repose_deg", block.repose_deg, kReposeRange) && block.phase != Phase::granular)
    table.fail("repose_deg", "'repose_deg' needs 'phase = \"granular\"': nothing else comes to rest in heaps");
  if (table.read("viscosity_pa_s", block.viscosity_pa_s, kViscosityRange) && block.phase != Phase::liquid)
    table.fail("viscosity_pa_s", "'viscosity_pa_s' needs 'phase = \"liquid\"': nothing else flows by it");
  if (table.read("proxy", block.proxy)) block.where_proxy = table.where("proxy");
  return block;
}

std::string_view phase_name(Phase phase) { return kPhaseNames[static_cast<int>(phase)]; }

uint8_t mask_bits(const Block& block) {
  const auto bit = [](MaskKind kind, bool set) {
    return static_cast<uint8_t>(set ? 1u << static_cast<int>(kind) : 0u);
  };
  return bit(MaskKind::occupied, block.name != "air") | bit(MaskKind::opaque, block.opaque) |
         bit(MaskKind::solid, block.phase == Phase::solid || block.phase == Phase::granular) |
         bit(MaskKind::liquid, block.phase == Phase::liquid) | bit(MaskKind::emitting, block.emission.max() > 0) |
         bit(MaskKind::granular, block.phase == Phase::granular) |
         bit(MaskKind::gas, block.phase == Phase::gas && block.name != "air");
}

Status check_block(const Block& block) {
  if (block.name.empty()) return input_error("a block has an empty name; give it one");
  TRY_STATUS(check_bands(block, "albedo", block.albedo, kAlbedoRange));
  TRY_STATUS(check_bands(block, "glossy", block.glossy, kShareRange));
  TRY_STATUS(check_bands(block, "transmission", block.transmission, kShareRange));
  TRY_STATUS(check_value(block, "shininess", block.shininess, kShareRange));
  TRY_STATUS(check_value(block, "coverage", block.coverage, kShareRange));
  if (const auto wrong = exceeds_one(block, "glossy", block.glossy))
    return input_error("block '" + block.name + "': " + *wrong);
  if (const auto wrong = exceeds_one(block, "transmission", block.transmission))
    return input_error("block '" + block.name + "': " + *wrong);
  TRY_STATUS(check_bands(block, "emission", block.emission, kAtLeastZero));
  TRY_STATUS(check_bands(block, "absorption", block.absorption, kAtLeastZero));
  TRY_STATUS(check_value(block, "index of refraction", block.index_of_refraction, kRefractionRange));
  TRY_STATUS(check_value(block, "density", block.density.value, kAboveZero));
  TRY_STATUS(check_value(block, "heat capacity", block.heat_capacity.value, kAboveZero));
  TRY_STATUS(check_value(block, "heat conductivity", block.heat_conductivity.value, kAboveZero));
  if (block.ignition) TRY_STATUS(check_value(block, "ignition", block.ignition->value, kAboveZero));
  TRY_STATUS(check_value(block, "hardness", block.hardness, kHardnessRange));
  TRY_STATUS(check_value(block, "repose", block.repose_deg, kReposeRange));
  TRY_STATUS(check_value(block, "viscosity", block.viscosity_pa_s, kViscosityRange));
  return {};
}

BlockPalette::BlockPalette() {
  ids_.emplace("air", kAir);
  blocks_.push_back(air());
  masks_.push_back(mask_bits(blocks_.back()));
}

Result<BlockId> BlockPalette::add(Block block) {
  TRY_STATUS(check_block(block));
  if (const auto taken = ids_.find(block.name); taken != ids_.end()) {
    if (same(blocks_[taken->second], block)) return taken->second;
    return input_error("the block name '" + block.name + "' is taken by a different block; choose another name");
  }
  if (blocks_.size() >= kMaxBlocks)
    return input_error("block '" + block.name + "' has no id left: a world holds at most " +
                       std::to_string(kMaxBlocks) + " blocks");
  const BlockId id = static_cast<BlockId>(blocks_.size());
  ids_.emplace(block.name, id);
  masks_.push_back(mask_bits(block));
  blocks_.push_back(std::move(block));
  return id;
}

std::optional<BlockId> BlockPalette::find(std::string_view name) const {
  const auto found = ids_.find(std::string(name));
  if (found == ids_.end()) return std::nullopt;
  return found->second;
}

std::string_view BlockPalette::nearest_name(std::string_view name) const {
  const Block* best = &blocks_.front();
  size_t best_distance = SIZE_MAX;
  for (const Block& block : blocks_) {
    const size_t distance = edit_distance(name, block.name);
    if (distance < best_distance) best_distance = distance, best = &block;
  }
  return best->name;
}

namespace {

using BlockTextures = std::map<std::string, BlockTexture, std::less<>>;

/// `textures`: gains those of the blocks.
Status add_blocks(BlockPalette& palette, std::string_view text, const std::string& file_name, BlockTextures& textures) {
  TRY(TomlDocument document, TomlDocument::parse(text, file_name));
  std::vector<Block> blocks;
  for (auto& [name, table] : document.root().tables()) {
    blocks.push_back(read_block(name, table));
    BlockTexture texture;
    if (table.read("texture", texture.kind)) {
      texture.where = table.where("texture");
      table.read("texture_contrast", texture.contrast, kShareRange);
      textures[name] = texture;
    }
    if (palette.find(name)) table.fail({}, "the block '" + name + "' is defined already; choose another name");
  }
  TRY_STATUS(document.finish());
  for (Block& block : blocks) TRY_STATUS(palette.add(std::move(block)));
  return {};
}

struct StandardBlocks {
  BlockPalette palette;
  BlockTextures textures;
};
const StandardBlocks& standard() {
  static const StandardBlocks blocks = [] {
    StandardBlocks all;
    for (const EmbeddedText* file = block_files; file->name; ++file) {
      const Status added = add_blocks(all.palette, file->text, file->name, all.textures);
      if (!added.ok()) std::cerr << added.error().message << '\n';
      CHECK(added.ok());
    }
    return all;
  }();
  return blocks;
}

}  // namespace

Status add_blocks_from_toml(BlockPalette& palette, std::string_view text, const std::string& file_name) {
  BlockTextures no_property_of_these;
  return add_blocks(palette, text, file_name, no_property_of_these);
}

const BlockTexture* block_texture(std::string_view block_name) {
  const BlockTextures& textures = standard().textures;
  const auto found = textures.find(block_name);
  return found == textures.end() ? nullptr : &found->second;
}

std::string toml_from_block(const Block& block) {
  std::string text = "[\"" + block.name + "\"]\n";
  const auto row = [&](const char* key, const std::string& value) { text += std::string(key) + " = " + value + "\n"; };
  const auto bands = [&](const char* key, const auto& b) {
    row(key, "[" + number_text(b.r) + ", " + number_text(b.g) + ", " + number_text(b.b) + "]");
  };
  row("phase", "\"" + std::string(phase_name(block.phase)) + "\"");
  row("opaque", block.opaque ? "true" : "false");
  bands("albedo", block.albedo);
  row("bsdf", "\"" + block.bsdf + "\"");
  // Those of most blocks, left out, keep the text that older files hold.
  const Block usual;
  if (block.glossy != usual.glossy || block.bsdf == "blinn_phong") bands("glossy", block.glossy);
  if (block.shininess != usual.shininess) row("shininess", number_text(block.shininess));
  if (block.transmission != usual.transmission) bands("transmission", block.transmission);
  if (block.coverage != usual.coverage) row("coverage", number_text(block.coverage));
  bands("emission_w", block.emission);
  if (!block.opaque) bands("absorption_per_m", block.absorption);
  row("index_of_refraction", number_text(block.index_of_refraction));
  row("density_kg_per_m3", number_text(block.density.value));
  row("heat_capacity_j_per_kg_k", number_text(block.heat_capacity.value));
  row("heat_conductivity_w_per_m_k", number_text(block.heat_conductivity.value));
  if (block.ignition) row("ignition_k", number_text(block.ignition->value));
  row("hardness_mohs", number_text(block.hardness));
  if (block.phase == Phase::granular && block.repose_deg != usual.repose_deg)
    row("repose_deg", number_text(block.repose_deg));
  if (block.phase == Phase::liquid && block.viscosity_pa_s != usual.viscosity_pa_s)
    row("viscosity_pa_s", number_text(block.viscosity_pa_s));
  row("proxy", "\"" + block.proxy + "\"");
  return text;
}

const BlockPalette& standard_blocks() { return standard().palette; }

}  // namespace world
