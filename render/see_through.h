/// Which blocks a straight ray goes on through, and what it needs to know of them. Shared by both backends; the
/// formulas are in render/see_through.shared.h.
#pragma once

#include <span>
#include <vector>

#include "render/knobs.h"
#include "render/see_through.shared.h"
#include "world/blocks/block.h"
#include "world/proxies/proxy.h"
#include "world/world.h"

namespace render {

/// The see-through blocks of a palette by number: 0 is air and all that isn't see-through, 1 the first, and so on.
///
/// A block is see-through where it isn't opaque, fills its voxel, and its BSDF lets some light through: a dielectric, a
/// sheet that transmits, a coverage below 1. So one of no strength is drawn as the opaque block that it equals.
class SeeThroughKinds {
 public:
  /// A face record has 12 bits for a kind; blocks beyond that many are drawn as opaque ones.
  static constexpr size_t kMost = 4095;

  explicit SeeThroughKinds(const world::BlockPalette& palette);
  /// Of a picture in which nothing is seen through.
  static SeeThroughKinds none(const world::BlockPalette& palette);

  uint16_t kind(world::BlockId block) const { return kind_[block]; }
  bool contains(world::BlockId block) const { return kind_[block] != 0; }
  /// By kind.
  const std::vector<shared::SeeThroughBlock>& blocks() const { return blocks_; }
  const shared::SeeThroughBlock& of(world::BlockId block) const { return blocks_[kind_[block]]; }
  /// By block: 1 where see-through.
  std::span<const uint8_t> flags() const { return flags_; }
  /// Whether the world holds any that shows a matte surface: a sheet, or partial coverage.
  bool calls_for_matte(const world::Census& census) const;
  /// Whether the world holds any.
  bool called_for(const world::Census& census) const;

 private:
  SeeThroughKinds() = default;
  std::vector<uint16_t> kind_;
  std::vector<uint8_t> flags_;
  std::vector<shared::SeeThroughBlock> blocks_;
};

/// By block: 1 where it is neither opaque, nor see-through, nor a shape that is drawn, but hides light: a cube that is
/// in no mask of opaque ones.
std::vector<uint8_t> hiding_cubes(const world::BlockPalette& palette, const SeeThroughKinds& kinds,
                                  const world::BlockShapes* drawn);
/// Whether what isn't opaque takes its part of the sun's light.
bool tints_sun(const RenderKnobs& knobs);
/// Whether the world holds anything but air that isn't opaque.
bool holds_not_opaque(const world::WorldView& view);

/// Whether its faces mirror the world, where the knob `reflection` says more than none.
inline bool is_mirror(const world::Block& block) { return block.bsdf == "mirror" && block.proxy.empty(); }
bool calls_for_mirrors(const world::WorldView& view);
/// Whether a picture of the world shows anything through anything.
bool calls_for_see_through(const world::WorldView& view);

}  // namespace render
