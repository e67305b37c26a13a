#include "render/liquid_levels.h"

#include <algorithm>
#include <span>

namespace render {

using namespace world;

namespace {

constexpr int32_t kFullAmount = 4096;

int level_of(int32_t amount) {
  return std::clamp((amount * kFullLevel + kFullAmount / 2) / kFullAmount, 1, kFullLevel);
}

/// False where all are full.
bool levels_of(const IntLayer& amounts, const BlockPalette& palette, StoreReader& reader, LeafPos l,
               LiquidLevels::Leaf& out) {
  std::array<int32_t, kLeafVoxels> amount;
  LeafMask active;
  if (!amounts.read_leaf(l, amount, active)) return false;
  const auto is_liquid = [&](BlockId id) { return palette[id].phase == Phase::liquid; };
  const LeafBlocks blocks = reader.leaf(l);
  std::array<BlockId, 64> above;  // of the leaf's top, by x*8 + z
  {
    const LeafBlocks next = reader.leaf({l.x, l.y + 1, l.z});
    for (int x = 0; x < kLeafSize; ++x)
      for (int z = 0; z < kLeafSize; ++z) above[static_cast<size_t>(x * 8 + z)] = next[x * 64 + z];
  }
  out.fill(kFullLevel);
  bool any = false;
  for (int x = 0; x < kLeafSize; ++x)
    for (uint64_t bits = active.word[x]; bits; bits &= bits - 1) {
      const int in_slice = __builtin_ctzll(bits), i = x * 64 + in_slice;
      if (!is_liquid(blocks[i])) continue;
      const bool top = in_slice >= 56;
      if (is_liquid(top ? above[static_cast<size_t>(x * 8 + in_slice - 56)] : blocks[i + 8])) continue;
      const int level = level_of(amount[static_cast<size_t>(i)]);
      out[static_cast<size_t>(i)] = static_cast<uint8_t>(level);
      any |= level < kFullLevel;
    }
  return any;
}

}  // namespace

std::vector<LeafPos> LiquidLevels::forget() {
  std::vector<LeafPos> gone;
  for (const auto& [pos, levels] : leaves_) gone.push_back(pos);
  std::sort(gone.begin(), gone.end());
  leaves_.clear();
  store_ = 0;
  mark_ = {};
  return gone;
}

std::vector<LeafPos> LiquidLevels::follow(const WorldView& view, bool on) {
  const Store& store = view.store();
  const IntLayer* const amounts = on ? store.find_int_layer(Layer::liquid) : nullptr;
  if (!amounts) {
    if (store_ != 0) auto ignored = store_ == store.identity() ? store.take_dirty(subscriber_) : std::vector<LeafPos>();
    return forget();
  }
  std::vector<LeafPos> look;
  bool all = false;
  if (store_ != store.identity()) {
    all = true;
    store_ = store.identity();
    subscriber_ = store.subscribe();
    mark_ = {};
  }
  const std::vector<LeafPos> dirty = store.take_dirty(subscriber_);
  const std::optional<std::vector<LeafPos>> written = amounts->changes(mark_);
  if (all || !written) {
    look = amounts->leaves();
    for (const auto& [pos, levels] : leaves_) look.push_back(pos);
  } else {
    look = *written;
    // A leaf's blocks say what its own amounts are of, and what lies over the leaf below.
    for (const LeafPos l : dirty) look.push_back(l), look.push_back({l.x, l.y - 1, l.z});
  }
  std::sort(look.begin(), look.end());
  look.erase(std::unique(look.begin(), look.end()), look.end());
  looked_at_ += look.size();
  std::vector<LeafPos> changed;
  StoreReader reader(store);
  Leaf levels;
  for (const LeafPos l : look) {
    const bool any = levels_of(*amounts, view.palette(), reader, l, levels);
    const auto found = leaves_.find(l);
    if (found == leaves_.end() ? !any : any && *found->second == levels) continue;
    changed.push_back(l);
    if (!any)
      leaves_.erase(found);
    else if (found == leaves_.end())
      leaves_.emplace(l, std::make_unique<Leaf>(levels));
    else
      *found->second = levels;
  }
  return changed;
}

}  // namespace render
