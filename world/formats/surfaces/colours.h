/// Colours of files -> blocks: each colour becomes a matte block of that albedo.
#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include "world/base/errors.h"
#include "world/blocks/block.h"

namespace world {

/// Least and greatest albedo of blocks that come from colours: nothing real is darker or brighter.
constexpr float kMinAlbedo = 0.004f, kMaxAlbedo = 0.98f;

class ColourBlocks {
 public:
  /// Gives each of these colours (0xRRGGBB, once each) a block "PREFIX:RRGGBB". Where they are more than `most`, they
  /// are rounded to as many bits a band as make them fit. The prefix is a copy: it may be a name of the palette, whose
  /// blocks move when it grows.
  static Result<ColourBlocks> make(std::vector<uint32_t> colours, std::string prefix, size_t most,
                                   BlockPalette& palette);
  BlockId operator[](uint32_t colour) const { return blocks_.at(colour); }
  /// What was rounded, as a sentence; empty where nothing was.
  const std::string& approximated() const { return approximated_; }

 private:
  std::unordered_map<uint32_t, BlockId> blocks_;
  std::string approximated_;
};

}  // namespace world
