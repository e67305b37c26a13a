/// gas: smoke, steam, methane, carbon dioxide and others of finite volume. What is lighter than air rises, what is
/// heavier pools; both spread and thin, through air only. The flows: sim/matter/gas_kernel.h.
///
/// A tick takes first what changes places as a whole, then the gases one after the other, the heaviest first. A voxel
/// holds one of them; to a gas what is neither itself nor air is a wall. Blocks of fire stand where they burn.
///
///   bubbles    sim/matter/gas_swaps.h
///   heat       What goes takes its part of the voxel's energy along: units that go over those that fill the voxel. The
///              energy of steam is that beyond air at rest, so that steam that mixes with cold air is no longer warm
///              all through.
///   thinning   Gases of thins_out_per_s in reactions.toml (smoke, steam) mix with the air where they are thin; what
///              goes is booked as out. Others stay for ever, to the unit.
#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "sim/matter/gas_kernel.h"
#include "sim/matter/gas_swaps.h"
#include "sim/matter/matter.h"
#include "sim/matter/rule.h"
#include "sim/matter/thermal.h"
#include "world/base/jobs.h"
#include "world/store/leaf_sets.h"
#include "world/store/leaf_shifts.h"

namespace sim {

namespace {

using world::BlockId;
using world::LeafMask;

constexpr size_t kPagesATask = 16;
constexpr double kTickSeconds = 0.05;
constexpr size_t kFacePage[6] = {around_index(-1, 0, 0), around_index(1, 0, 0),  around_index(0, -1, 0),
                                 around_index(0, 1, 0),  around_index(0, 0, -1), around_index(0, 0, 1)};

/// Flames are gases too, but stand beside what burns: rules/fire.cpp.
bool flows_as_gas(const world::Block& block) {
  return block.phase == world::Phase::gas && block.name != "air" && !(block.emission.max() > 0);
}

/// What a page is to the gas that flows now.
struct GasPage {
  GasView view;
  alignas(64) uint16_t next[world::kLeafVoxels];
  GasFlow flow;
  uint64_t viewed = 0;                  // the round in which view.own was written
  std::unique_ptr<Cells::Heats> heats;  // what they become, where they do
  bool warms = false;
};

class Gas final : public Rule {
 public:
  explicit Gas(size_t rule) : rule_(rule), swaps_(rule) {}
  RuleReport step(Cells& cells, const Tick& tick) override;

 private:
  void follow(const Cells& cells, double rest_k);
  FluidRole role(BlockId id) const { return blocks_.roles[id]; }
  void flow_of(Cells& cells, BlockId gas, RuleReport& report);
  void view(const Cells& cells, PageId p, BlockId gas);
  void view_beside(const Cells& cells, PageId p, BlockId gas);
  void warm(const Cells& cells, PageId p);
  void add_candidate(const Cells& cells, PageId p) {
    is_candidate_.resize(cells.page_limit(), 0);
    if (is_candidate_[p] || !cells.find_blocks(p)) return;
    is_candidate_[p] = 1;
    candidates_.push_back(p);
  }
  const GasPage* viewed(PageId p) const {
    return p < pages_.size() && pages_[p] && pages_[p]->viewed == round_ ? pages_[p].get() : nullptr;
  }
  /// Of a voxel of the gas that flows, or of air (0): energy beyond air at rest, in units of heat.
  int64_t born_energy(int amount) const {
    return amount == 0 || !born_warm_ ? 0 : energies_[static_cast<size_t>(amount)];
  }

  const size_t rule_;  // its awake set
  std::unique_ptr<ThermalTraits> thermal_;
  std::vector<GasNature> natures_;  // by block
  FluidBlocks blocks_;
  GasSwaps swaps_;
  GasNature nature_;  // of the gas that flows
  bool born_warm_ = false;
  std::vector<int32_t> energies_;  // of the gas that flows, by amount, where it is born warm or cold
  BlockId energies_of_ = world::kAir;
  uint64_t round_ = 0;  // counts gases over all ticks
  std::vector<std::unique_ptr<GasPage>> pages_;
  std::vector<PageId> candidates_;  // with ids, awake or changed in this tick
  std::vector<uint8_t> is_candidate_;
  std::vector<PageId> list_;
  std::vector<uint8_t> holds_, listed_;
  std::vector<BlockId> met_;           // gases and liquids, the heaviest first
  std::atomic<int64_t> lost_heat_{0};  // units that 32 bits didn't hold
};

void Gas::follow(const Cells& cells, double rest_k) {
  const world::BlockPalette& palette = cells.palette();
  if (!thermal_) thermal_ = std::make_unique<ThermalTraits>(palette, std::vector<Reaction>{}, rest_k);
  thermal_->follow();
  const auto& thins = standard_reactions().thins_out_per_s;
  const double air = palette[world::kAir].density.value;
  while (natures_.size() < palette.size()) {
    const world::Block& block = palette[static_cast<BlockId>(natures_.size())];
    const auto rate = thins.find(block.name);
    natures_.push_back(gas_nature(block.density.value, air, rate == thins.end() ? 0 : rate->second, kTickSeconds));
    blocks_.densities.push_back(static_cast<float>(block.density.value));
    blocks_.roles.push_back(blocks_.roles.empty()                 ? FluidRole::open
                            : flows_as_gas(block)                 ? FluidRole::gas
                            : block.phase == world::Phase::liquid ? FluidRole::liquid
                                                                  : FluidRole::other);
  }
}

void Gas::view(const Cells& cells, PageId p, BlockId gas) {
  GasPage& page = *pages_[p];
  page.viewed = round_;
  if (const BlockId* blocks = cells.find_blocks(p)) {
    view_gas(blocks, cells.find_amounts(p), gas, page.view.own);
    return;
  }
  for (int x = 0; x < 8; ++x) {
    const uint64_t occupied = cells.occupied_mask(p).word[x];
    for (int b = 0; b < 64; ++b) page.view.own[x * 64 + b] = occupied >> b & 1 ? kNoGas : uint16_t{0};
  }
}

/// The index in its leaf of the k-th voxel that touches a face.
constexpr int touching_index(int k, int face) {
  const int far = world::face_sign(face) > 0 ? 7 : 0;
  switch (world::face_axis(face)) {
    case 0:
      return far * 64 + k;
    case 1:
      return (k >> 3) * 64 + far * 8 + (k & 7);
    default:
      return k * 8 + far;
  }
}

/// Voxels of the neighbours: from their own view, where they have one.
void Gas::view_beside(const Cells& cells, PageId p, BlockId gas) {
  GasView& view = pages_[p]->view;
  const auto fill = [&](int face, auto index_of) {
    const PageId from = cells.around(p)[kFacePage[face]];
    uint16_t* into = view.beside[face];
    if (const GasPage* other = viewed(from)) {
      for (int i = 0; i < 64; ++i) into[i] = other->view.own[index_of(i)];
    } else if (const BlockId* blocks = cells.find_blocks(from)) {
      const uint16_t* amounts = cells.find_amounts(from);
      for (int i = 0; i < 64; ++i) {
        const int k = index_of(i);
        const uint16_t amount = amounts ? amounts[k] : uint16_t{kFullVoxel};
        into[i] = blocks[k] == gas ? amount : blocks[k] == world::kAir ? uint16_t{0} : kNoGas;
      }
    } else {
      const LeafMask& occupied = cells.occupied_mask(from);
      for (int i = 0; i < 64; ++i) into[i] = occupied.test(index_of(i)) ? kNoGas : uint16_t{0};
    }
  };
  fill(world::kFaceNegX, [](int k) { return touching_index(k, world::kFacePosX); });
  fill(world::kFacePosX, [](int k) { return touching_index(k, world::kFaceNegX); });
  fill(world::kFaceNegY, [](int k) { return touching_index(k, world::kFacePosY); });
  fill(world::kFacePosY, [](int k) { return touching_index(k, world::kFaceNegY); });
  fill(world::kFaceNegZ, [](int k) { return touching_index(k, world::kFacePosZ); });
  fill(world::kFacePosZ, [](int k) { return touching_index(k, world::kFaceNegZ); });
}

/// Of an energy that fills a voxel with so much, the part that goes with `units`.
int64_t energy_with(int64_t energy, int units, int amount) { return energy * units / std::max(amount, kFullVoxel); }

/// The page's heats after the flow, where there are any.
void Gas::warm(const Cells& cells, PageId p) {
  GasPage& page = *pages_[p];
  const std::array<PageId, 27>& around = cells.around(p);
  page.warms = false;
  const int32_t* own_heats = cells.find_heats(p);
  bool any = own_heats || born_warm_;
  for (const size_t k : kFacePage) any |= cells.find_heats(around[k]) != nullptr;
  if (!any) return;
  const auto energy = [&](const int32_t* heats, int index, int amount) {
    return (heats ? int64_t{heats[index]} : 0) + born_energy(amount);
  };
  if (!page.heats) page.heats = std::make_unique<Cells::Heats>();
  if (own_heats)
    std::copy_n(own_heats, world::kLeafVoxels, page.heats->begin());
  else
    page.heats->fill(0);
  // Where there is gas, and beside that.
  const auto holds = [](uint16_t amount) { return amount != 0 && amount != kNoGas; };
  LeafMask gas;
  for (int i = 0; i < world::kLeafVoxels; ++i)
    gas.word[i >> 6] |= static_cast<uint64_t>(holds(page.view.own[i])) << (i & 63);
  LeafMask near = gas;
  for (int face = 0; face < 6; ++face) {
    LeafMask beyond;
    for (int k = 0; k < 64; ++k)
      if (holds(page.view.beside[face][k])) beyond.set(touching_index(k, world::opposite_face(face)));
    near = near | world::across(gas, beyond, face);
  }
  world::for_each_voxel(near, [&](int i) {
    const auto n = static_cast<size_t>(i);
    const int here = page.view.own[i];
    if (here == kNoGas) return;
    const int64_t before = energy(own_heats, i, here);
    int64_t after = before;
    for (int face = 0; face < 6; ++face) {
      const int axis = world::face_axis(face), stride = axis == 0 ? 64 : axis == 1 ? 8 : 1;
      const int along = i / stride & 7, sign = world::face_sign(face);
      const bool leaves = along == (sign > 0 ? 7 : 0);
      const int touching = axis == 0 ? i & 63 : axis == 1 ? (i >> 6) << 3 | (i & 7) : i >> 3;
      const int j = leaves ? i - sign * 7 * stride : i + sign * stride;
      const int there = leaves ? page.view.beside[face][touching] : page.view.own[j];
      const int units = gas_flow(here, there, face, nature_);
      if (units > 0) after -= energy_with(before, units, here);
      if (units < 0) {
        const int32_t* heats = leaves ? cells.find_heats(around[kFacePage[face]]) : own_heats;
        after += energy_with(energy(heats, j, there), -units, there);
      }
    }
    const int64_t wanted = after - born_energy(page.next[i]);
    const int64_t heat = std::clamp<int64_t>(wanted, INT32_MIN, INT32_MAX);
    if (heat != wanted) lost_heat_ += wanted - heat;
    page.warms |= heat != (*page.heats)[n];
    (*page.heats)[n] = static_cast<int32_t>(heat);
  });
}

void Gas::flow_of(Cells& cells, BlockId gas, RuleReport& report) {
  ++round_;
  nature_ = natures_[gas];
  born_warm_ = (*thermal_)[gas].born != 0;
  if (born_warm_ && energies_of_ != gas) {
    energies_of_ = gas;
    energies_.resize(65536);
    for (int a = 0; a < 65536; ++a)
      energies_[static_cast<size_t>(a)] = static_cast<int32_t>(
          std::llround(static_cast<double>((*thermal_)[gas].born) * thermal_->capacity(gas, std::max(a, 1))));
  }
  // Pages that hold some of it.
  holds_.assign(candidates_.size(), 0);
  world::parallel_ranges(candidates_.size(), 4 * kPagesATask, [&](size_t begin, size_t end) {
    for (size_t n = begin; n < end; ++n) holds_[n] = !mask_of(cells.find_blocks(candidates_[n]), gas).is_none();
  });
  list_.clear();
  for (size_t n = 0; n < candidates_.size(); ++n)
    if (holds_[n]) list_.push_back(candidates_[n]);
  if (list_.empty()) return;
  const auto each = [&](size_t from, auto work) {
    world::parallel_ranges(list_.size() - from, kPagesATask, [&](size_t begin, size_t end) {
      for (size_t n = from + begin; n < from + end; ++n) work(list_[n], *pages_[list_[n]]);
    });
  };

  // Flow, in these and in those that something reaches.
  for (size_t first = 0; first < list_.size();) {
    const size_t last = list_.size();
    for (size_t n = first; n < last; ++n) cells.open_around(list_[n]);
    pages_.resize(cells.page_limit());
    listed_.resize(cells.page_limit(), 0);
    for (size_t n = first; n < last; ++n) {
      listed_[list_[n]] = 1;
      if (!pages_[list_[n]]) pages_[list_[n]] = std::make_unique<GasPage>();
    }
    each(first, [&](PageId p, GasPage&) { view(cells, p, gas); });
    each(first, [&](PageId p, GasPage& page) {
      view_beside(cells, p, gas);
      page.flow = flow_gas(page.view, nature_, page.next);
    });
    for (size_t n = first; n < last; ++n)
      for (uint32_t reaches = pages_[list_[n]]->flow.reaches; reaches; reaches &= reaches - 1) {
        const PageId to = cells.around(list_[n])[kFacePage[std::countr_zero(reaches)]];
        if (listed_[to]) continue;
        listed_[to] = 1;
        list_.push_back(to);
      }
    first = last;
  }
  for (const PageId p : list_) listed_[p] = 0;

  // Heat is read everywhere before any is written.
  each(0, [&](PageId p, GasPage& page) {
    page.warms = false;
    if (page.flow.flows) warm(cells, p);
  });
  std::atomic<uint64_t> changed{0};
  std::atomic<int64_t> lost{0};
  each(0, [&](PageId p, GasPage& page) {
    if (page.warms) {
      const int32_t* before = cells.find_heats(p);
      int64_t came = 0;
      for (size_t i = 0; i < world::kLeafVoxels; ++i) came += int64_t{(*page.heats)[i]} - (before ? before[i] : 0);
      // What gases are born with goes with their amounts: of heats alone the sum is another.
      if (came != 0) cells.book_heat(came);
      cells.swap_heats(p, page.heats);
      cells.stir_heat(p);
    }
    lost += page.flow.lost;
    if (!page.flow.flows || std::equal(page.next, page.next + world::kLeafVoxels, page.view.own)) return;
    Cells::Amounts& amounts = cells.amounts(p);
    const LeafMask moved = store_gas(page.view.own, page.next, gas, cells.blocks(p).data(), amounts.data());
    cells.set_rich(p);
    cells.stir(p, moved);
    changed += static_cast<uint64_t>(moved.count());
  });
  if (lost > 0) cells.book(gas, -lost);
  for (const PageId p : list_) {
    if (!pages_[p]->flow.flows) continue;
    cells.awake(rule_).add(p);
    // The next gas may find air where this one was.
    add_candidate(cells, p);
    for (const size_t k : kFacePage) add_candidate(cells, cells.around(p)[k]);
  }
  report.voxels_changed += changed;
  report.leaves_visited += list_.size();
}

RuleReport Gas::step(Cells& cells, const Tick& tick) {
  RuleReport report;
  AwakeSet& set = cells.awake(rule_);
  set.begin();
  if (set.now().empty()) return report;
  follow(cells, tick.options->rest_k);
  met_.clear();
  for (size_t id = 0; id < blocks_.roles.size(); ++id)
    if (const auto block = static_cast<BlockId>(id); role(block) != FluidRole::other && cells.met(block))
      met_.push_back(block);
  std::stable_sort(met_.begin(), met_.end(),
                   [&](BlockId a, BlockId b) { return blocks_.densities[a] > blocks_.densities[b]; });
  const auto is_gas = [&](BlockId id) { return role(id) == FluidRole::gas; };
  for (const PageId p : candidates_) is_candidate_[p] = 0;
  candidates_.clear();
  for (const PageId p : set.now()) add_candidate(cells, p);
  if (std::none_of(met_.begin(), met_.end(), is_gas)) return report;
  if (met_.size() > 1) {
    for (const PageId p : candidates_) cells.open_around(p);
    for (const PageId p : swaps_.step(cells, tick, candidates_, met_, blocks_, report.voxels_changed))
      add_candidate(cells, p);
  }
  for (const BlockId id : met_)
    if (is_gas(id)) flow_of(cells, id, report);
  cells.spread();
  if (lost_heat_ != 0)
    report.notes.push_back(fmt::format("{} units of heat didn't fit into their voxels", lost_heat_.load()));
  report.bytes = pages_.capacity() * sizeof(pages_[0]);
  for (const auto& page : pages_)
    if (page) report.bytes += sizeof(GasPage) + (page->heats ? sizeof(Cells::Heats) : 0);
  return report;
}

}  // namespace

RuleInfo gas_info() {
  return {.name = "gas",
          .what = "smoke, steam, methane and others rise or pool, spread and thin; bubbles rise",
          .conserves = "amount of each gas, but for what smoke and steam lose to the air; energy",
          .layers = "blocks, gas, heat",
          .calls = flows_as_gas};
}
std::unique_ptr<Rule> make_gas_rule(size_t rule) { return std::make_unique<Gas>(rule); }

}  // namespace sim
