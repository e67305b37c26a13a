#include "world/store/light_volume.h"

#include "world/base/errors.h"

namespace world {

void LightRegion::split() {
  if (codes_) return;
  codes_ = std::make_unique_for_overwrite<uint16_t[]>(kLeavesPerRegion);
  std::fill_n(codes_.get(), kLeavesPerRegion, static_cast<uint16_t>(kTile + tile_));
  tiles_[tile_] = kLeavesPerRegion;
}

void LightRegion::join() {
  if (!codes_) return;
  const auto all = std::find(tiles_.begin(), tiles_.end(), kLeavesPerRegion);
  if (all != tiles_.end()) return set_tile(static_cast<int>(all - tiles_.begin()));
  // Many holes: the leaves move together, and the chunks behind them go.
  if (free_.size() < 2 * kChunk) return;
  std::vector<uint16_t> owner(used_, UINT16_MAX);
  for (int i = 0; i < kLeavesPerRegion; ++i)
    if (codes_[i] < kTile) owner[codes_[i]] = static_cast<uint16_t>(i);
  uint16_t to = 0;
  for (uint16_t from = 0; from < used_; ++from) {
    if (owner[from] == UINT16_MAX) continue;
    if (from != to) chunks_[to / kChunk][to % kChunk] = chunks_[from / kChunk][from % kChunk];
    codes_[owner[from]] = to++;
  }
  used_ = to;
  free_ = {};
  for (size_t c = (static_cast<size_t>(used_) + kChunk - 1) / kChunk; c < chunks_.size(); ++c) chunks_[c].reset();
}

bool LightRegion::set_leaf(int index, const LightLeaf& levels) {
  uint16_t& code = codes_[index];
  if (code < kTile) {
    LightLeaf& old = chunks_[code / kChunk][code % kChunk];
    if (old == levels) return false;
    old = levels;
    return true;
  }
  --tiles_[code - kTile];
  if (free_.empty()) {
    code = used_++;
    if (code % kChunk == 0) chunks_[code / kChunk].reset(new LightLeaf[kChunk]);
  } else {
    code = free_.back();
    free_.pop_back();
  }
  chunks_[code / kChunk][code % kChunk] = levels;
  return true;
}

bool LightRegion::set_leaf(int index, int tile) {
  uint16_t& code = codes_[index];
  const uint16_t wanted = static_cast<uint16_t>(kTile + tile);
  if (code == wanted) return false;
  if (code < kTile)
    free_.push_back(code);
  else
    --tiles_[code - kTile];
  ++tiles_[static_cast<size_t>(tile)];
  code = wanted;
  return true;
}

size_t LightRegion::bytes() const {
  size_t total = sizeof *this + (codes_ ? kLeavesPerRegion * sizeof codes_[0] : 0) + free_.capacity() * sizeof free_[0];
  for (const auto& chunk : chunks_) total += chunk ? kChunk * sizeof(LightLeaf) : 0;
  return total;
}

size_t LightField::bytes() const {
  size_t total = regions_.bytes();
  for (const RegionPos& r : regions_.positions()) total += regions_.find(r)->bytes();
  return total;
}

namespace {

uint64_t hash_of(const LightLeaf& leaf) {
  uint64_t hash = 1;
  for (const auto& slice : leaf.word)
    for (const uint64_t bits : slice) hash = mix64(hash + bits);
  return hash;
}

}  // namespace

uint64_t LightField::content_hash() const {
  std::array<uint64_t, kMaxLight + 1> tile_hash;
  for (int level = 0; level <= kMaxLight; ++level)
    tile_hash[static_cast<size_t>(level)] = hash_of(LightLeaf::of(level));
  uint64_t hash = mix64(outside_);
  for (const RegionPos& r : regions_.positions()) {
    const LightRegion& region = *regions_.find(r);
    hash = mix64(hash + PosHash{}(r));
    for (int i = 0; i < kLeavesPerRegion; ++i) {
      const LightLeafView leaf = region.leaf(i);
      hash = mix64(hash + (leaf.leaf ? hash_of(*leaf.leaf) : tile_hash[leaf.tile]));
    }
  }
  return hash;
}

LightVolume::LightVolume(LightModel model, int sky_level, bool coloured_sky) : model_(model), sky_level_(sky_level) {
  CHECK(sky_level >= 1 && sky_level <= kMaxLight);
  const auto add = [&](int outside) {
    fields_.emplace_back(outside);
    return fields_.size() - 1;
  };
  if (model == LightModel::none) return;
  const bool rgb = model == LightModel::flood_rgb;
  for (size_t band = 0; band < 3; ++band) sky_[band] = band == 0 || (rgb && coloured_sky) ? add(sky_level) : sky_[0];
  for (size_t band = 0; band < 3; ++band) block_[band] = band == 0 || rgb ? add(0) : block_[0];
}

LightSample LightVolume::sample(VoxelPos v) const {
  LightSample s;
  if (fields_.empty()) return s;
  for (int band = 0; band < 3; ++band) {
    s.sky[static_cast<size_t>(band)] = static_cast<uint8_t>(sky(band).get(v));
    s.block[static_cast<size_t>(band)] = static_cast<uint8_t>(block(band).get(v));
  }
  return s;
}

size_t LightVolume::bytes() const {
  size_t total = sizeof *this;
  for (const LightField& field : fields_) total += field.bytes();
  return total;
}

uint64_t LightVolume::content_hash() const {
  uint64_t hash = static_cast<uint64_t>(model_);
  for (const LightField& field : fields_) hash = mix64(hash + field.content_hash());
  return hash;
}

}  // namespace world
