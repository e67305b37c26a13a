#include "world/formats/surfaces/colours.h"

#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "world/units/rgb8.h"

namespace world {

namespace {

/// The value of a byte of which only the highest bits are kept: those are repeated, so that 0 and 255 stay.
uint32_t rounded(uint32_t byte, int bits) {
  const uint32_t high = byte >> (8 - bits);
  uint32_t value = 0;
  for (int at = 8 - bits; at > -bits; at -= bits) value |= at >= 0 ? high << at : high >> -at;
  return value & 255;
}

uint32_t rounded_colour(uint32_t colour, int bits) {
  return rounded(colour >> 16 & 255, bits) << 16 | rounded(colour >> 8 & 255, bits) << 8 | rounded(colour & 255, bits);
}

}  // namespace

Result<ColourBlocks> ColourBlocks::make(std::vector<uint32_t> colours, std::string prefix, size_t most,
                                        BlockPalette& palette) {
  std::sort(colours.begin(), colours.end());
  int bits = 8;
  const auto kinds = [&] {
    std::set<uint32_t> kept;
    for (const uint32_t colour : colours) kept.insert(rounded_colour(colour, bits));
    return kept.size();
  };
  if (colours.size() > most)
    while (bits > 1 && kinds() > most) --bits;
  ColourBlocks all;
  std::unordered_map<uint32_t, BlockId> made;
  uint32_t furthest = 0;
  for (const uint32_t colour : colours) {
    const uint32_t kept = rounded_colour(colour, bits);
    for (const int shift : {16, 8, 0}) {
      const uint32_t a = colour >> shift & 255, b = kept >> shift & 255;
      furthest = std::max(furthest, std::max(a, b) - std::min(a, b));
    }
    auto found = made.find(kept);
    if (found == made.end()) {
      const Ratio3 linear = linear_from_rgb8(kept);
      Block block;
      block.name = fmt::format("{}:{:06X}", prefix, kept);
      block.albedo = {std::clamp(linear.r, kMinAlbedo, kMaxAlbedo), std::clamp(linear.g, kMinAlbedo, kMaxAlbedo),
                      std::clamp(linear.b, kMinAlbedo, kMaxAlbedo)};
      TRY(const BlockId id, palette.add(std::move(block)));
      found = made.emplace(kept, id).first;
    }
    all.blocks_[colour] = found->second;
  }
  if (bits < 8)
    all.approximated_ =
        fmt::format("{} colours are too many; they were rounded to {} bits a band, by at most {} of 255",
                    colours.size(), bits, furthest);
  return all;
}

}  // namespace world
