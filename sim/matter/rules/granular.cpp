/// granular: sand, gravel, snow, ash. Falls, slides off slopes steeper than its angle of repose, and sinks in liquids
/// and gases that are lighter, by changing places with them. The rule itself: sim/matter/granular_kernel.h.
///
/// A tick on the pages that are awake: decide, then accept and move on those and the pages that something goes to.
/// Where voxels hold more than air and one kind of grain, what they hold moves along.
#include <atomic>
#include <bit>

#include "sim/matter/granular_kernel.h"
#include "sim/matter/rule.h"
#include "world/base/jobs.h"
#include "world/store/leaf_shifts.h"

namespace sim {

namespace {

using world::BlockId;
using world::LeafMask;

constexpr size_t kGrain = 128;  // pages a task

class Granular final : public Rule {
 public:
  explicit Granular(size_t rule) : rule_(rule) {}
  RuleReport step(Cells& cells, const Tick& tick) override;

 private:
  void grow(const Cells& cells) {
    if (pages_.size() >= cells.page_limit()) return;
    pages_.resize(cells.page_limit());
    roughness_.resize(cells.page_limit());
  }
  static void set_place(GranularPage& page, int index, uint32_t rough, const BlockTraits& traits) {
    const uint64_t bit = 1ull << (index & 63);
    uint64_t &smooth = page.smooth.word[index >> 6], &steep = page.steep.word[index >> 6];
    smooth = rough < traits.smooth_of ? smooth | bit : smooth & ~bit;
    steep = rough < traits.steep_of ? steep | bit : steep & ~bit;
  }
  void prepare(Cells& cells, PageId p);
  static bool is_plain(const Cells& cells, PageId p, BlockId& kind);
  void keep_lighter_liquids(Cells& cells, PageId p);
  void find_targets(Cells& cells);
  void read_swaps(Cells& cells, size_t n);
  LeafMask write_swaps(Cells& cells, size_t n);

  struct Swap {
    uint16_t index;
    BlockId block;
  };
  /// Of one page: what comes where grains went, then the grains that come, and the places where those are smooth and
  /// steep.
  struct Swaps {
    size_t count = 0, grains_from = 0;
    bool reads_fluids = false;  // else what comes where grains went is air, and isn't listed
    LeafMask smooth, steep;
    Swap swap[world::kLeafVoxels];
  };
  struct CellSwap {
    int index;
    Cell cell;
  };
  const size_t rule_;  // its awake set
  using Roughness = std::array<uint16_t, world::kLeafVoxels>;
  std::vector<GranularPage> pages_;
  std::vector<std::unique_ptr<Roughness>> roughness_;  // by page, where places_of is kMixedPlaces
  std::vector<PageId> targets_;                        // awake pages, and those that something goes to
  std::vector<uint8_t> is_target_;
  std::vector<BlockId> kinds_, plain_kinds_;
  std::vector<PageId> plain_, rich_;               // targets in which bits move; in which what voxels hold moves along
  std::vector<LeafMask> moved_;                    // by plain
  std::vector<PageMoves> moves_;                   // by rich
  std::vector<Swaps> swaps_;                       // by rich
  std::vector<std::vector<CellSwap>> cell_swaps_;  // the same where pages hold more than ids
};

/// Whether bits say all of what happens in the page: it has no ids to keep right, nothing but one kind of grain may
/// meet in it, and there is no heat that would have to move along. `kind`: that kind.
bool Granular::is_plain(const Cells& cells, PageId p, BlockId& kind) {
  constexpr size_t kFaces[6] = {
      kAbove, kBelow, around_index(1, 0, 0), around_index(-1, 0, 0), around_index(0, 0, 1), around_index(0, 0, -1)};
  const Cells::Tag own = cells.tag(p);
  BlockId all = own.kind;
  bool rich = own.has_blocks;
  if (cells.met_heat()) {
    rich |= cells.find_heats(p) != nullptr;
    for (const size_t i : kFaces) rich |= cells.find_heats(cells.around(p)[i]) != nullptr;
  }
  const std::array<PageId, 27>& around = cells.around(p);
  for (const size_t i : kFaces) {
    const Cells::Tag other = cells.tag(around[i]);
    rich |= other.rich | ((other.kind != all) & (other.kind != Cells::kNoKind) & (all != Cells::kNoKind));
    all = all == Cells::kNoKind ? other.kind : all;
  }
  kind = all;
  return !rich;
}

/// The places of a page where its grains are smooth or steep. Moves of this rule keep them right.
void Granular::prepare(Cells& cells, PageId p) {
  GranularPage& page = pages_[p];
  const Cells::Tag tag = cells.tag(p);
  const BlockId wanted = tag.rich ? kMixedPlaces : tag.kind;
  if (wanted == Cells::kNoKind || (page.places_of == wanted && page.version == cells.version(p))) return;
  page.places_of = wanted;
  page.version = cells.version(p);
  page.smooth = page.steep = {};
  const uint64_t hash = cells.hash(p);
  if (!tag.rich) {
    const BlockTraits& traits = cells.traits()[tag.kind];
    for (int i = 0; i < world::kLeafVoxels; ++i) set_place(page, i, roughness(hash, i), traits);
    page.any_smooth = traits.smooth_of > 0, page.any_steep = traits.steep_of > 0;
    return;
  }
  std::unique_ptr<Roughness>& rough = roughness_[p];
  if (!rough) {
    rough = std::make_unique<Roughness>();
    for (int i = 0; i < world::kLeafVoxels; ++i) (*rough)[static_cast<size_t>(i)] = roughness(hash, i);
  }
  const LeafMask& grain = cells.grain()[p];
  const BlockId* blocks = cells.find_blocks(p);
  for (int x = 0; x < 8; ++x)
    for (uint64_t bits = grain.word[x]; bits; bits &= bits - 1) {
      const int i = x * 64 + std::countr_zero(bits);
      set_place(page, i, (*rough)[static_cast<size_t>(i)], cells.traits()[blocks[i]]);
    }
  page.any_smooth = page.any_steep = true;
}

/// Takes back what was decided where a grain would enter a liquid that isn't lighter.
void Granular::keep_lighter_liquids(Cells& cells, PageId p) {
  GranularPage& page = pages_[p];
  const world::VoxelPos low = world::voxel_from_leaf(cells.pos(p));
  const auto keep = [&](LeafMask& mask, world::VoxelPos step) {
    for (int x = 0; x < 8; ++x)
      for (uint64_t bits = mask.word[x]; bits; bits &= bits - 1) {
        const int i = x * 64 + std::countr_zero(bits);
        const world::VoxelPos to = low + world::offset_in_leaf(i) + step;
        const world::LeafPos l = world::leaf_from_voxel(to), d = l - cells.pos(p);
        const PageId other = cells.around(p)[static_cast<size_t>(around_index(d.x, d.y, d.z))];
        const BlockTraits& into = cells.traits()[cells.block(other, world::index_in_leaf(to))];
        if (into.content == Content::liquid && into.density >= cells.traits()[cells.block(p, i)].density) mask.clear(i);
      }
  };
  if (page.falls) keep(page.fall, {0, -1, 0});
  if (page.slides)
    for (int d = 0; d < kSides; ++d) keep(page.slide[d], kSideStep[d]);
}

/// Awake pages, and those that something leaves them for.
void Granular::find_targets(Cells& cells) {
  const std::vector<PageId>& awake = cells.awake(rule_).now();
  targets_.assign(awake.begin(), awake.end());
  is_target_.resize(cells.page_limit(), 0);
  for (const PageId p : awake) is_target_[p] = 1;
  constexpr int kTo[5] = {around_index(1, 0, 0), around_index(0, 0, 1), around_index(-1, 0, 0), around_index(0, 0, -1),
                          kBelow};
  for (size_t n = 0; n < awake.size(); ++n) {
    const PageId p = awake[n];
    for (uint32_t spill = pages_[p].spill; spill; spill &= spill - 1) {
      const PageId to = cells.around(p)[static_cast<size_t>(kTo[std::countr_zero(spill)])];
      if (is_target_[to]) continue;
      is_target_[to] = 1;
      targets_.push_back(to);
    }
  }
  for (size_t n = awake.size(); n < targets_.size(); ++n) cells.open_around(targets_[n]);
  for (const PageId p : targets_) is_target_[p] = 0;
}

/// What the voxels of a rich target will hold: what their partners hold now.
void Granular::read_swaps(Cells& cells, size_t n) {
  const PageId p = rich_[n];
  const PageMoves& m = moves_[n];
  Swaps& swaps = swaps_[n];
  swaps.count = 0;
  swaps.smooth = swaps.steep = {};
  cell_swaps_[n].clear();
  const Roughness* rough = pages_[p].places_of == kMixedPlaces ? roughness_[p].get() : nullptr;
  const auto read = [&](const LeafMask& mask, int face, bool grains) {
    if (mask.is_none()) return;
    // Along the face's axis an index is `stride` apart from its neighbour's, or at the other end of the next page.
    const int axis = world::face_axis(face), stride = axis == 0 ? 64 : axis == 1 ? 8 : 1;
    const int step = world::face_sign(face) * stride;
    const LeafMask edge = world::side_of(face);
    const world::VoxelPos d = world::face_step(face);
    const PageId beyond = cells.around(p)[static_cast<size_t>(around_index(d.x, d.y, d.z))];
    const bool whole = cells.holds_more(p) || cells.holds_more(beyond);
    const BlockId *own = cells.find_blocks(p), *other = cells.find_blocks(beyond);
    Swap* end = swaps.swap + swaps.count;
    for (int x = 0; x < 8; ++x) {
      uint64_t smooth = 0, steep = 0;
      const auto take = [&](int i, BlockId block) {
        *end++ = {static_cast<uint16_t>(i), block};
        if (!grains || !rough) return;
        const BlockTraits& traits = cells.traits()[block];
        const uint32_t r = (*rough)[static_cast<size_t>(i)];
        smooth |= static_cast<uint64_t>(r < traits.smooth_of) << (i & 63);
        steep |= static_cast<uint64_t>(r < traits.steep_of) << (i & 63);
      };
      for (uint64_t bits = mask.word[x] & ~edge.word[x]; bits; bits &= bits - 1) {
        const int i = x * 64 + std::countr_zero(bits);
        if (whole) cell_swaps_[n].push_back({i, cells.cell(p, i + step)});
        take(i, own[i + step]);
      }
      for (uint64_t bits = mask.word[x] & edge.word[x]; bits; bits &= bits - 1) {
        const int i = x * 64 + std::countr_zero(bits), there = i - 7 * step;
        if (whole) cell_swaps_[n].push_back({i, cells.cell(beyond, there)});
        take(i, other ? other[there] : cells.block(beyond, there));
      }
      swaps.smooth.word[x] |= smooth, swaps.steep.word[x] |= steep;
    }
    swaps.count = static_cast<size_t>(end - swaps.swap);
  };
  // Without a fluid anywhere, and without heat here or beside it, what comes for a grain is air.
  const std::array<PageId, 27>& around = cells.around(p);
  swaps.reads_fluids = cells.met_fluid() || cells.holds_more(p) || cells.holds_more(around[kBelow]);
  for (const world::VoxelPos& step : kSideStep)
    swaps.reads_fluids |= cells.holds_more(around[static_cast<size_t>(around_index(step.x, step.y, step.z))]);
  if (swaps.reads_fluids) {
    read(m.out_below, world::kFaceNegY, false);
    for (int d = 0; d < kSides; ++d) read(m.out[d], kSideFace[d], false);
  }
  swaps.grains_from = swaps.count;
  read(m.in_above, world::kFacePosY, true);
  for (int d = 0; d < kSides; ++d) read(m.in[d], world::opposite_face(kSideFace[d]), true);
}

/// Writes what read_swaps() found, and the planes of it. Returns the voxels that changed.
LeafMask Granular::write_swaps(Cells& cells, size_t n) {
  const PageId p = rich_[n];
  LeafMask &grain = cells.grain()[p], &occupied = cells.occupied()[p];
  const PageMoves& m = moves_[n];
  LeafMask moved;
  for (int x = 0; x < 8; ++x) {
    const uint64_t gone =
        m.out_below.word[x] | m.out[0].word[x] | m.out[1].word[x] | m.out[2].word[x] | m.out[3].word[x];
    const uint64_t come = m.in_above.word[x] | m.in[0].word[x] | m.in[1].word[x] | m.in[2].word[x] | m.in[3].word[x];
    grain.word[x] = (grain.word[x] & ~gone) | come;
    occupied.word[x] = (occupied.word[x] & ~gone) | come;
    moved.word[x] = gone | come;
  }
  const Swaps& swaps = swaps_[n];
  if (moved.is_none()) return moved;
  Cells::Blocks& blocks = cells.blocks(p);
  GranularPage& page = pages_[p];
  bool rich = false;
  for (int x = 0; x < 8; ++x) {
    const uint64_t come = grain.word[x] & moved.word[x], gone = moved.word[x] & ~come;
    if (page.places_of == kMixedPlaces) {
      page.smooth.word[x] = (page.smooth.word[x] & ~come) | swaps.smooth.word[x];
      page.steep.word[x] = (page.steep.word[x] & ~come) | swaps.steep.word[x];
    }
    if (swaps.reads_fluids) continue;
    for (uint64_t bits = gone; bits; bits &= bits - 1)
      blocks[static_cast<size_t>(x * 64 + std::countr_zero(bits))] = world::kAir;
  }
  size_t k = 0;
  for (; k < swaps.grains_from; ++k) {
    blocks[swaps.swap[k].index] = swaps.swap[k].block;
    rich |= swaps.swap[k].block != world::kAir;
  }
  BlockId kind = cells.kind(p);
  if (kind == Cells::kNoKind && k < swaps.count) kind = swaps.swap[k].block;
  for (; k < swaps.count; ++k) {
    blocks[swaps.swap[k].index] = swaps.swap[k].block;
    rich |= swaps.swap[k].block != kind;
  }
  cells.set_kind(p, kind);
  if (rich) cells.set_rich(p);
  for (const CellSwap& swap : cell_swaps_[n]) cells.put(p, swap.index, swap.cell);
  return moved;
}

RuleReport Granular::step(Cells& cells, const Tick& tick) {
  AwakeSet& set = cells.awake(rule_);
  set.begin();
  RuleReport report;
  if (set.now().empty()) return report;
  for (const PageId p : set.now()) cells.open_around(p);
  grow(cells);
  const auto planes = [&] {
    return GranularPlanes{cells.closed(),  cells.grain(),  cells.occupied(), pages_.data(),
                          cells.arounds(), cells.hashes(), tick.number};
  };

  // Decide.
  const std::span<const PageId> awake = set.now();
  world::parallel_ranges(awake.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t n = begin; n < end; ++n) prepare(cells, awake[n]);
    decide_pages(planes(), awake.subspan(begin, end - begin));
    if (!cells.met_liquid()) return;
    for (size_t n = begin; n < end; ++n)
      if (BlockId kind; !is_plain(cells, awake[n], kind)) keep_lighter_liquids(cells, awake[n]);
  });
  find_targets(cells);
  grow(cells);

  // Accept.
  const std::span<const PageId> targets = targets_;
  BlockId only_kind = Cells::kNoKind;
  const bool one_kind = cells.met_one_kind(only_kind);
  if (kinds_.size() < targets.size()) kinds_.resize(targets.size());
  world::parallel_ranges(targets.size(), kGrain, [&](size_t begin, size_t end) {
    accept_pages(planes(), targets.subspan(begin, end - begin));
    if (one_kind) return;
    for (size_t n = begin; n < end; ++n)
      if (!is_plain(cells, targets[n], kinds_[n])) kinds_[n] = kMixedPlaces;
  });

  // Move what rich voxels hold: read everywhere before anything is written anywhere.
  plain_.clear();
  plain_kinds_.clear();
  rich_.clear();
  if (one_kind) plain_.assign(targets.begin(), targets.end());
  for (size_t n = 0; !one_kind && n < targets.size(); ++n) {
    if (kinds_[n] == kMixedPlaces) {
      rich_.push_back(targets[n]);
      continue;
    }
    plain_.push_back(targets[n]);
    plain_kinds_.push_back(kinds_[n]);
  }
  moves_.resize(rich_.size());
  if (swaps_.size() < rich_.size()) swaps_.resize(rich_.size()), cell_swaps_.resize(rich_.size());
  world::parallel_ranges(rich_.size(), kGrain, [&](size_t begin, size_t end) {
    const auto part = std::span<const PageId>(rich_).subspan(begin, end - begin);
    find_moves(planes(), part, moves_.data() + begin);
    for (size_t n = begin; n < end; ++n) {
      cells.blocks(rich_[n]);
      read_swaps(cells, n);
    }
  });
  // Move bits, and tell who has to look again.
  if (moved_.size() < plain_.size()) moved_.resize(plain_.size());
  std::atomic<uint64_t> changed{0};
  world::parallel_ranges(plain_.size(), kGrain, [&](size_t begin, size_t end) {
    changed +=
        apply_pages(planes(), std::span<const PageId>(plain_).subspan(begin, end - begin), moved_.data() + begin);
    for (size_t n = begin; n < end; ++n) {
      if (moved_[n].is_none()) continue;
      const PageId p = plain_[n];
      cells.set_kind(p, cells.grain()[p].is_none() ? Cells::kNoKind : one_kind ? only_kind : plain_kinds_[n]);
      cells.stir(p, moved_[n]);
    }
  });
  world::parallel_ranges(rich_.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t n = begin; n < end; ++n) {
      const LeafMask moved = write_swaps(cells, n);
      if (!moved.is_none()) cells.stir(rich_[n], moved);
      changed += static_cast<uint64_t>(moved.count());
    }
  });
  cells.spread();
  report.voxels_changed = changed;
  report.leaves_visited = targets.size();
  return report;
}

}  // namespace

RuleInfo granular_info() {
  return {.name = "granular",
          .what = "sand, gravel, snow and ash fall, heap up at their angle of repose, and sink",
          .conserves = "voxels of each block",
          .layers = "blocks; liquid, gas and heat move along",
          .calls = [](const world::Block& block) { return block.phase == world::Phase::granular; }};
}
std::unique_ptr<Rule> make_granular_rule(size_t rule) { return std::make_unique<Granular>(rule); }

}  // namespace sim
