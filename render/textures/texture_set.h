/// The texels of a palette's textures: one array that both backends read (texture.shared.h says how), made once for a
/// palette.
///
///   blocks  [n] of each block
///   texels  a pyramid a tile, from -1 to 1, 0 in the mean over a block's tiles; four of them a word
/// cost    22 KiB a textured block of the palette that the world holds
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "render/knobs.h"
#include "render/textures/texture.shared.h"
#include "world/world.h"

namespace render {

struct TextureOfBlock {
  uint32_t tiles = 0;  // where its kTextureTiles tiles begin in the texels; 0: it has none
  float contrast = 0;
};

class TextureSet {
 public:
  /// Made anew where the palette has grown. Fails where a block names a kind that there is none of.
  world::Status follow(const world::BlockPalette& palette, const RenderKnobs& knobs);
  /// No block has one, or the knobs ask for none.
  bool empty() const { return texels_.empty(); }
  const std::vector<uint32_t>& texels() const { return texels_; }
  /// By block; empty where there is none.
  const std::vector<TextureOfBlock>& blocks() const { return blocks_; }
  TextureOfBlock of(world::BlockId block) const { return block < blocks_.size() ? blocks_[block] : TextureOfBlock{}; }
  uint64_t version() const { return version_; }
  size_t bytes() const { return texels_.size() * 4 + blocks_.size() * sizeof(TextureOfBlock); }

  /// What the block's albedo is multiplied by at a place of a face. `step_x`, `step_y`: to the next pixels on its
  /// plane, m.
  float factor(const RenderKnobs& knobs, world::BlockId block, world::VoxelPos voxel, int face,
               const glm::vec3& fraction, const glm::vec3& step_x, const glm::vec3& step_y) const;
  /// The unit normal that the sun and luminaires meet there; the face's own where normal_detail is 0.
  glm::vec3 normal(const RenderKnobs& knobs, world::BlockId block, world::VoxelPos voxel, int face,
                   const glm::vec3& fraction, const glm::vec3& step_x, const glm::vec3& step_y) const;

 private:
  std::vector<TextureOfBlock> blocks_;
  std::vector<uint32_t> texels_;
  size_t palette_ = 0;
  uint64_t version_ = 0;
};

/// The kinds, sorted.
std::vector<std::string> texture_kinds();

}  // namespace render
