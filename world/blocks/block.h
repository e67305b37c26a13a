/// What a voxel can be made of. A block is one [section] of a TOML file in world/blocks/, or one palette entry of an
/// imported file. The names of BSDFs and proxies are resolved by the module that owns them.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "world/base/errors.h"
#include "world/units/quantity.h"

namespace world {

class TomlTable;

using BlockId = uint16_t;
constexpr BlockId kAir = 0;
constexpr size_t kMaxBlocks = 65536;

enum class Phase : uint8_t { gas, liquid, granular, solid };
std::string_view phase_name(Phase phase);

struct Block {
  std::string name;  // lower_snake_case, or source:name for imported palette entries
  Phase phase = Phase::solid;
  bool opaque = true;               // no light passes: it hides what is behind it
  Ratio3 albedo{0.5f, 0.5f, 0.5f};  // diffuse reflectance, each band in (0, 1)
  std::string bsdf = "lambert";
  Ratio3 glossy;                            // k_g: glossy or mirrored, each band in [0, 1]; with albedo at most 1
  float shininess = 0.5f;                   // 0 rough .. 1 smooth; a highlight's exponent is 8192^shininess
  Ratio3 transmission;                      // passes a thin sheet, each band in [0, 1]; with albedo at most 1
  float coverage = 1.0f;                    // the part of the surface that is there, in [0, 1]
  Power3 emission;                          // W emitted by the whole voxel, >= 0
  Absorption3 absorption;                   // 1/m, >= 0; of what light passes
  float index_of_refraction = 1.0f;         // >= 1
  Density density{1000.0};                  // > 0
  HeatCapacity heat_capacity{1000.0};       // > 0
  HeatConductivity heat_conductivity{1.0};  // > 0
  std::optional<Kelvin> ignition;           // burns at this temperature; none: does not burn
  float hardness = 1.0f;                    // Mohs, 0..10
  double repose_deg = 35;                   // steepest slope at which what is granular rests, 15..70
  double viscosity_pa_s = 0.001;            // dynamic, of what is liquid, in (0, 1e7]
  std::string proxy;                        // shape drawn instead of a cube; empty: the cube
  std::string where_bsdf, where_proxy;      // file:line:column of these names, for messages; no property of the block
};

/// One bit for each kind of derived mask: what a block is to light, bodies and rules.
enum class MaskKind : int { occupied = 0, opaque, solid, liquid, emitting, granular, gas, count };
constexpr int kMaskKinds = static_cast<int>(MaskKind::count);
static_assert(kMaskKinds <= 8);
/// Bit k is MaskKind k. What is granular is solid too; air is no gas here.
uint8_t mask_bits(const Block& block);

/// The blocks of one world: id <-> name <-> properties. Id 0 is air. Ids are never reused or moved.
class BlockPalette {
 public:
  BlockPalette();  // holds air only

  /// Fails where the name is taken by a different block, a property is out of range, or ids run out.
  Result<BlockId> add(Block block);
  std::optional<BlockId> find(std::string_view name) const;
  const Block& operator[](BlockId id) const { return blocks_[id]; }
  size_t size() const { return blocks_.size(); }
  /// mask_bits of each block, indexed by id; has size() entries.
  std::span<const uint8_t> masks() const { return masks_; }
  /// The known name nearest to `name` by edit distance, for error messages.
  std::string_view nearest_name(std::string_view name) const;

 private:
  std::vector<Block> blocks_;
  std::vector<uint8_t> masks_;
  std::unordered_map<std::string, BlockId> ids_;
};

/// Checks ranges; the message names the property, its value and the allowed range.
Status check_block(const Block& block);

/// Reads one section; what is wrong is noted in its document.
Block read_block(const std::string& name, TomlTable& table);

/// Adds the blocks of one TOML text. Errors name file, line, column and the nearest known key.
Status add_blocks_from_toml(BlockPalette& palette, std::string_view text, const std::string& file_name);

/// The block as a [section] that add_blocks_from_toml reads back to an equal block.
std::string toml_from_block(const Block& block);

/// Air and all blocks of world/blocks/*.toml, which are compiled in; ids in order of file and section name.
const BlockPalette& standard_blocks();

}  // namespace world
