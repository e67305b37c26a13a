/// Light of a world in levels of 0 to 15 a voxel, beside its blocks: what sim/light writes and render/ reads.
///
///   LightVolume   one field a channel: sky and block; or sky and block in red, green and blue
///   LightField    region (128^3): one level for all of it, or a code a leaf
///   code          one level for the leaf, or the place of a LightLeaf
///   LightLeaf     256 bytes: of each slice x the four bits of the levels, so that a voxel is read from one cache line
///
/// The sky's level says how much of the sky reaches a voxel, not its colour: a change of the sky's colour lights
/// nothing anew. Fields hold the regions that hold blocks and their 26 neighbours; elsewhere, nothing shades. A volume
/// exists only once something makes it.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "world/store/leaf_mask.h"
#include "world/store/region_table.h"

namespace world {

constexpr int kMaxLight = 15;
/// Brightness of a level over that of the one above: what block games draw them by.
constexpr double kLevelRatio = 0.8;
/// W in one band at and above which a voxel gives level 15: the lamps of world/blocks/lamp.toml give 2500 to 4600.
constexpr double kFullLampWatts = 3000;

/// The levels of 512 voxels. Word [x][k], bit y*8 + z, is bit k of the level of voxel (x, y, z).
struct alignas(64) LightLeaf {
  uint64_t word[8][4];

  int get(int index) const {
    const uint64_t* w = word[index >> 6];
    const int bit = index & 63;
    return static_cast<int>((w[0] >> bit & 1) | (w[1] >> bit & 1) << 1 | (w[2] >> bit & 1) << 2 |
                            (w[3] >> bit & 1) << 3);
  }
  void set(int index, int level) {
    uint64_t* w = word[index >> 6];
    const uint64_t bit = 1ull << (index & 63);
    for (int k = 0; k < 4; ++k) w[k] = level >> k & 1 ? w[k] | bit : w[k] & ~bit;
  }
  static LightLeaf of(int level) {
    LightLeaf leaf;
    for (auto& x : leaf.word)
      for (int k = 0; k < 4; ++k) x[k] = level >> k & 1 ? ~0ull : 0;
    return leaf;
  }
  /// Bits of the voxels of slice x whose level is `level`.
  uint64_t equal(int x, int level) const {
    uint64_t bits = ~0ull;
    for (int k = 0; k < 4; ++k) bits &= level >> k & 1 ? word[x][k] : ~word[x][k];
    return bits;
  }
  friend bool operator==(const LightLeaf& a, const LightLeaf& b) {
    for (int x = 0; x < 8; ++x)
      for (int k = 0; k < 4; ++k)
        if (a.word[x][k] != b.word[x][k]) return false;
    return true;
  }
};
static_assert(sizeof(LightLeaf) == 256);

/// A leaf of a field, valid until the next write: levels voxel by voxel, or one for all.
struct LightLeafView {
  const LightLeaf* leaf = nullptr;
  uint8_t tile = 0;
  int get(int index) const { return leaf ? leaf->get(index) : tile; }
  /// Bits of slice x with that level.
  uint64_t equal(int x, int level) const { return leaf ? leaf->equal(x, level) : level == tile ? ~0ull : 0; }
  friend bool operator==(const LightLeafView& a, const LightLeafView& b) {
    return a.leaf && b.leaf ? *a.leaf == *b.leaf : !a.leaf && !b.leaf && a.tile == b.tile;
  }
};

/// The levels of one region. Leaves are mixed, or tiles. Different leaves may be written from different threads only
/// between split() and join(), and only one thread writes into one region.
class LightRegion {
 public:
  LightLeafView leaf(int index) const {
    if (!codes_) return {nullptr, tile_};
    const uint16_t code = codes_[index];
    if (code >= kTile) return {nullptr, static_cast<uint8_t>(code - kTile)};
    return {&chunks_[code / kChunk][code % kChunk], 0};
  }
  bool is_tile() const { return !codes_; }
  void set_tile(int level) { *this = LightRegion(), tile_ = static_cast<uint8_t>(level); }
  /// A code a leaf from now on, until join().
  void split();
  /// One level for all of it again, where that is so; gives back what leaves held that became tiles.
  void join();
  /// After split(). True where this changed the leaf.
  bool set_leaf(int index, const LightLeaf& levels);
  bool set_leaf(int index, int tile);
  size_t bytes() const;

 private:
  static constexpr int kChunk = 64;
  static constexpr uint16_t kTile = 4096;  // codes from here on are levels of tiles, below places of leaves
  std::unique_ptr<uint16_t[]> codes_;      // by index_in_region; null: tile_ for all
  uint8_t tile_ = 0;
  uint16_t used_ = 0;
  std::array<uint16_t, kMaxLight + 1> tiles_{};  // leaves that are tiles, by level
  std::array<std::unique_ptr<LightLeaf[]>, kLeavesPerRegion / kChunk> chunks_;
  std::vector<uint16_t> free_;
};

/// One channel. Regions that are not there have `outside` everywhere.
class LightField {
 public:
  explicit LightField(int outside) : outside_(static_cast<uint8_t>(outside)) {}

  int get(VoxelPos v) const { return leaf(leaf_from_voxel(v)).get(index_in_leaf(v)); }
  LightLeafView leaf(LeafPos l) const {
    const LightRegion* r = regions_.find(region_from_leaf(l));
    return r ? r->leaf(index_in_region(l)) : LightLeafView{nullptr, outside_};
  }
  int outside() const { return outside_; }

  RegionTable<LightRegion>& regions() { return regions_; }
  const RegionTable<LightRegion>& regions() const { return regions_; }
  size_t bytes() const;
  /// Of positions and levels only, not of tiles or history.
  uint64_t content_hash() const;

 private:
  RegionTable<LightRegion> regions_;
  uint8_t outside_;
};

enum class LightModel { none, flood4, flood_rgb, flux };
constexpr std::array<std::string_view, 4> knob_choices(LightModel) { return {"none", "flood4", "flood_rgb", "flux"}; }

/// Levels of a voxel in red, green and blue; all alike in flood4.
struct LightSample {
  std::array<uint8_t, 3> sky{}, block{};
};

class LightVolume {
 public:
  /// `coloured_sky`: the sky has a field a band, because something filters its colour.
  LightVolume(LightModel model, int sky_level, bool coloured_sky);

  LightModel model() const { return model_; }
  int sky_level() const { return sky_level_; }  // of the open sky, 1 to 15
  /// band: 0 red, 1 green, 2 blue; all the same field where the model tells them not apart.
  LightField& sky(int band = 0) { return fields_[sky_[static_cast<size_t>(band)]]; }
  const LightField& sky(int band = 0) const { return fields_[sky_[static_cast<size_t>(band)]]; }
  LightField& block(int band = 0) { return fields_[block_[static_cast<size_t>(band)]]; }
  const LightField& block(int band = 0) const { return fields_[block_[static_cast<size_t>(band)]]; }
  LightSample sample(VoxelPos v) const;
  /// Every field once.
  std::span<LightField> fields() { return fields_; }
  std::span<const LightField> fields() const { return fields_; }
  size_t bytes() const;
  uint64_t content_hash() const;

 private:
  LightModel model_;
  int sky_level_;
  std::array<size_t, 3> sky_{}, block_{};
  std::vector<LightField> fields_;
};

}  // namespace world
