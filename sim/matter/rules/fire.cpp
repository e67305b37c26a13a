/// fire: solids that ignite burn where there is air beside them, light what is near, and leave ash or nothing. Knob
/// fire_model:
///
///   heat    A fuel burns while it is at its ignition temperature and has air, a flame or smoke beside it: in its hours
///           (of heat_speed) it gives the energy of its mass. 2/5 of that is radiated to what is not a gas across its
///           six faces, twice as much upwards, and to itself; the rest goes off with the smoke. What is as warm as a
///           flame takes in no more. Lava, magma rock and embers radiate as black bodies to fuels beside them, and lose
///           that; so does a block of fire that touches nothing that burns, out of nothing: a torch that is fed.
///   chance  Flames jump to air beside a fuel, and eat it, by chance: no temperatures. As block games do it.
///
/// In both, blocks of fire stand in the air beside what burns, emit their light, and end as smoke or air. Liquids and
/// gases burn by rows of reactions.toml.
#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <sstream>
#include <unordered_map>

#include <fmt/format.h>

#include "sim/matter/fire_kernel.h"
#include "sim/matter/fuels.h"
#include "sim/matter/heat_plan.h"
#include "sim/matter/matter.h"
#include "world/base/jobs.h"
#include "world/store/leaf_sets.h"
#include "world/store/leaf_shifts.h"

namespace sim {

namespace {

using world::BlockId;
using world::LeafMask;

constexpr size_t kPagesATask = 32;
constexpr size_t kMostRounds = 16;     // blocks of a page that are looked for one by one
constexpr double kFlameKelvin = 1300;  // of wood fires: Dougal Drysdale. An Introduction to Fire Dynamics. 2011
constexpr double kRadiated = 0.4;      // of the heat of combustion: the same, table 5.13, upper end
constexpr double kStefanBoltzmann = 5.670374e-8;  // W/(m^2 K^4)
constexpr double kShares = 8;                     // of what is radiated: up 2, five faces 1 each, itself 1
constexpr uint32_t kAllFuel = 65536;
// Chances in a tick, as powers of one half.
constexpr int kFlameRises = 3;                         // air beside what burns becomes fire
constexpr int kFlameDies = 4, kLongFlame = 8;          // fire with nothing to burn beside it; with a fuel beside it
constexpr int kSmokes = 2;                             // fire that ends leaves smoke
constexpr int kJumps = 4, kEats = 6, kEatenBurns = 1;  // of the model by chance
constexpr size_t kFacePage[6] = {around_index(-1, 0, 0), around_index(1, 0, 0),  around_index(0, -1, 0),
                                 around_index(0, 1, 0),  around_index(0, 0, -1), around_index(0, 0, 1)};

/// What a voxel of a fuel loses and gives in a tick.
struct Burn {
  uint16_t spent = 0;    // of kAllFuel
  int64_t share = 0;     // units, of kShares
  int64_t freed = 0;     // units in all
  int64_t radiated = 0;  // units, where it glows instead: through a face
};

/// Voxels of a page that burn alike.
struct Burning {
  LeafMask mask;
  uint16_t spent;
  int64_t share;
};

using FuelSpent = std::array<uint16_t, world::kLeafVoxels>;  // of kAllFuel

constexpr uint8_t kHeavy = 1 << 5;  // of a block's code

struct FirePage {
  uint32_t content = 0;
  bool ready = false, listed = false, live = false;
  world::LeafPos pos;
  LeafMask fuel, flame, air, feeds, hot, heavy;  // heavy: neither air nor gas
  LeafMask burns, torch;                         // of this tick
  LeafMask cool;                                 // fuels below a flame's temperature
  std::vector<Burning> burning;
  FuelSpent* spent = nullptr;  // one of Fire's, where any of the leaf's fuel has burnt
};

/// Heavy voxels of a page by block, as far as there is room: what no tick asks for where nothing burns.
struct FireKinds {
  static constexpr size_t kMost = 8;
  size_t count = 0;
  std::array<BlockId, kMost> id;
  std::array<LeafMask, kMost> mask;
  LeafMask others;          // of further blocks
  LeafMask takes;           // heavy ones below a flame's temperature
  uint64_t takes_tick = 0;  // when they were found
};

class Fire final : public Rule {
 public:
  explicit Fire(size_t rule) : rule_(rule) {}
  RuleReport step(Cells& cells, const Tick& tick) override;
  std::string state() const override;
  world::Status restore(Cells& cells, std::string_view state) override;

 private:
  void prepare(const Cells& cells, PageId p);
  int64_t heat_that_reaches(BlockId id, float warmth) const;
  void follow_blocks(const Cells& cells);
  void list_pages(Cells& cells);
  FuelSpent& spent_of(PageId p);
  void forget_spent(PageId p);
  LeafMask near(const Cells& cells, PageId p, LeafMask FirePage::*mask) const;
  LeafMask random(const Cells& cells, PageId p, const Tick& tick, int stream, int halves) const;
  void follow_burns(double dt);
  void find_burning(const Cells& cells, PageId p);
  LeafMask takers(const Cells& cells, PageId p) const;
  int64_t give_shares(Cells::Heats& heats, const FirePage* const* around, const LeafMask& takes, bool& changed) const;
  bool warm(Cells& cells, PageId p);
  void burn(Cells& cells, PageId p, const Tick& tick, LeafMask& changed);
  void jump(Cells& cells, PageId p, const Tick& tick, LeafMask& changed);
  void end_flames(Cells& cells, PageId p, const Tick& tick, const LeafMask& dying, LeafMask& changed);

  const size_t rule_;  // its awake set
  std::unique_ptr<FireBlocks> blocks_;
  std::vector<uint8_t> codes_;                       // by block: a bit for each mask of a page
  std::vector<int64_t> flame_heat_, ignition_heat_;  // by block: from where it is as warm as a flame, and burns
  std::vector<Burn> burns_;                          // by block
  double burns_dt_ = 0;                              // the tick that they are of, s
  std::vector<FirePage> pages_;
  std::vector<FireKinds> kinds_;   // by page
  std::vector<uint8_t> burns_in_;  // by page, in this tick
  uint64_t ticks_ = 0;
  std::vector<PageId> list_;
  // By leaf and not by page: what has half burnt stays so while its page is closed.
  std::unordered_map<world::LeafPos, std::unique_ptr<FuelSpent>, world::PosHash> spent_;
  std::atomic<int64_t> freed_{0}, kept_{0};  // units, in all
};

void Fire::prepare(const Cells& cells, PageId p) {
  FirePage& page = pages_[p];
  if (page.ready && page.content == cells.content_changes(p) && page.pos == cells.pos(p)) return;
  page.pos = cells.pos(p);
  const auto spent = spent_.find(page.pos);
  page.spent = spent == spent_.end() ? nullptr : spent->second.get();
  page.ready = true;
  page.content = cells.content_changes(p);
  std::array<BlockId, world::kLeafVoxels> written;
  const BlockId* ids = cells.find_blocks(p);
  if (!ids) cells.ids(p, written), ids = written.data();
  LeafMask* const masks[] = {&page.fuel, &page.flame, &page.air, &page.feeds, &page.hot, &page.heavy};
  for (LeafMask* mask : masks) *mask = {};
  FireKinds& kinds = kinds_[p];
  kinds.count = 0;
  // Block by block: most pages hold few.
  LeafMask rest = world::kAllMask;
  for (size_t round = 0; round < kMostRounds && !rest.is_none(); ++round) {
    const BlockId id = ids[world::first_index(rest)];
    const uint8_t code = codes_[id];
    const bool heavy = code & kHeavy;
    if (heavy && kinds.count == FireKinds::kMost) break;
    const LeafMask all = voxels_of(ids, id);
    rest = without(rest, all);
    for (size_t k = 0; k < std::size(masks); ++k)
      if (code >> k & 1) *masks[k] = *masks[k] | all;
    if (heavy) kinds.id[kinds.count] = id, kinds.mask[kinds.count++] = all;
  }
  world::for_each_voxel(rest, [&](int i) {
    for (size_t k = 0; k < std::size(masks); ++k)
      if (codes_[ids[i]] >> k & 1) masks[k]->set(i);
  });
  kinds.others = page.heavy & rest;
  if (page.spent) keep_only(page.fuel, page.spent->data());
}

/// The least heat at which a full voxel is as warm, K above rest; above all heats where none is. Temperature grows with
/// heat.
int64_t Fire::heat_that_reaches(BlockId id, float warmth) const {
  const ThermalVoxel voxel = blocks_->thermal().voxel(id);
  int64_t low = INT32_MIN, high = int64_t{INT32_MAX} + 1;
  while (low < high) {
    const int64_t middle = low + (high - low) / 2;
    if (temperature(voxel, static_cast<int32_t>(middle)) >= warmth)
      high = middle;
    else
      low = middle + 1;
  }
  return high;
}

void Fire::follow_blocks(const Cells& cells) {
  blocks_->follow();
  for (size_t n = codes_.size(); n < cells.palette().size(); ++n) {
    const auto id = static_cast<BlockId>(n);
    const FireTraits& t = (*blocks_)[id];
    const Content content = cells.traits()[id].content;
    const bool heavy = content != Content::empty && content != Content::gas;
    codes_.push_back(
        static_cast<uint8_t>(t.fuel | t.flame << 1 | t.air << 2 | t.feeds << 3 | t.hot << 4 | (heavy ? kHeavy : 0)));
    flame_heat_.push_back(heat_that_reaches(id, static_cast<float>(kFlameKelvin - blocks_->thermal().rest_k())));
    ignition_heat_.push_back(heat_that_reaches(id, t.ignition));
  }
}

FuelSpent& Fire::spent_of(PageId p) {
  FirePage& page = pages_[p];
  std::unique_ptr<FuelSpent>& spent = spent_[page.pos];
  if (!spent) spent = std::make_unique<FuelSpent>();
  page.spent = spent.get();
  return *spent;
}

void Fire::forget_spent(PageId p) {
  FirePage& page = pages_[p];
  if (!page.spent || !page.fuel.is_none()) return;
  page.spent = nullptr;
  spent_.erase(page.pos);
}

/// A line a leaf: its place, then index and share of each voxel of which something has burnt.
std::string Fire::state() const {
  std::vector<world::LeafPos> leaves;
  for (const auto& [l, spent] : spent_) leaves.push_back(l);
  std::sort(leaves.begin(), leaves.end());
  std::string text;
  for (const world::LeafPos& l : leaves) {
    std::string line;
    const FuelSpent& spent = *spent_.at(l);
    for (size_t i = 0; i < spent.size(); ++i)
      if (spent[i] != 0) line += fmt::format(" {} {}", i, spent[i]);
    if (!line.empty()) text += fmt::format("{} {} {}{}\n", l.x, l.y, l.z, line);
  }
  return text;
}

world::Status Fire::restore(Cells&, std::string_view state) {
  spent_.clear();
  std::istringstream lines{std::string(state)};
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    world::LeafPos l;
    words >> l.x >> l.y >> l.z;
    auto spent = std::make_unique<FuelSpent>();
    bool read = !words.fail();
    for (size_t i = 0, part = 0; read && words >> i;) {
      read = words >> part && i < spent->size() && part < kAllFuel;
      if (read) (*spent)[i] = static_cast<uint16_t>(part);
    }
    if (!read || !words.eof())
      return world::input_error("fire: \"" + line.substr(0, 40) + "\" must be a leaf, then voxels and what has burnt");
    spent_[l] = std::move(spent);
  }
  return {};
}

/// Awake pages, and those beside them where something burns or glows.
void Fire::list_pages(Cells& cells) {
  AwakeSet& set = cells.awake(rule_);
  set.begin();
  list_.assign(set.now().begin(), set.now().end());
  const size_t awake = list_.size();
  for (size_t n = 0; n < awake; ++n) cells.open_around(list_[n]);
  if (pages_.size() < cells.page_limit()) pages_.resize(cells.page_limit()), kinds_.resize(cells.page_limit());
  world::parallel_ranges(awake, kPagesATask, [&](size_t begin, size_t end) {
    for (size_t n = begin; n < end; ++n) prepare(cells, list_[n]);
  });
  for (size_t n = 0; n < awake; ++n) pages_[list_[n]].listed = true;
  for (size_t n = 0; n < awake; ++n) {
    const FirePage& page = pages_[list_[n]];
    if (page.hot.is_none() && page.burning.empty() && !cells.find_heats(list_[n])) continue;
    for (const size_t around : kFacePage) {
      const PageId other = cells.around(list_[n])[around];
      if (other == kClosedPage || pages_[other].listed) continue;
      pages_[other].listed = true;
      list_.push_back(other);
    }
  }
  for (size_t n = awake; n < list_.size(); ++n) cells.open_around(list_[n]);
  if (pages_.size() < cells.page_limit()) pages_.resize(cells.page_limit()), kinds_.resize(cells.page_limit());
  // Neighbours of those are looked at.
  std::vector<PageId> beside;
  for (const PageId p : list_) {
    pages_[p].listed = true;
    for (const size_t around : kFacePage) {
      const PageId other = cells.around(p)[around];
      if (other == kClosedPage || pages_[other].listed) continue;
      pages_[other].listed = true;
      beside.push_back(other);
    }
  }
  const auto prepare_all = [&](const std::vector<PageId>& pages) {
    world::parallel_ranges(pages.size(), kPagesATask, [&](size_t begin, size_t end) {
      for (size_t n = begin; n < end; ++n) prepare(cells, pages[n]);
    });
    for (const PageId p : pages) pages_[p].listed = false;
  };
  prepare_all(list_);
  prepare_all(beside);
  for (const PageId p : beside) {
    FirePage& page = pages_[p];
    page.burns = page.torch = page.cool = {};
    page.burning.clear();
  }
}

/// Voxels of a page beside one of `mask`.
LeafMask Fire::near(const Cells& cells, PageId p, LeafMask FirePage::*mask) const {
  const LeafMask* beyond[6];
  for (size_t face = 0; face < 6; ++face) {
    const PageId other = cells.around(p)[kFacePage[face]];
    beyond[face] = other == kClosedPage ? &world::kNoneMask : &(pages_[other].*mask);
  }
  return world::across_any(pages_[p].*mask, beyond);
}

/// Each voxel with a chance of 1 / 2^halves.
LeafMask Fire::random(const Cells& cells, PageId p, const Tick& tick, int stream, int halves) const {
  LeafMask m = world::kAllMask;
  const uint64_t hash = world::hash_combine(cells.hash(p), tick.number);
  for (int k = 0; k < halves; ++k)
    for (int w = 0; w < 8; ++w)
      m.word[w] &= world::hash_combine(hash, static_cast<uint64_t>(0xf12e00 + stream * 256 + k * 8 + w));
  return m;
}

void Fire::follow_burns(double dt) {
  if (dt != burns_dt_) burns_.clear();
  burns_dt_ = dt;
  for (size_t n = burns_.size(); n < codes_.size(); ++n) {
    const FireTraits& t = (*blocks_)[static_cast<BlockId>(n)];
    Burn& burn = burns_.emplace_back();
    const double kelvin =
        static_cast<double>(blocks_->thermal()[static_cast<BlockId>(n)].born) + blocks_->thermal().rest_k();
    burn.radiated = std::llround(kStefanBoltzmann * kelvin * kelvin * kelvin * kelvin * dt / kHeatUnitJ);
    if (!t.fuel) continue;
    const double part = std::min(dt / (t.hours * 3600), 1.0);
    burn.spent = static_cast<uint16_t>(std::clamp(std::llround(part * kAllFuel), 1ll, 65535ll));
    const double freed = t.energy * burn.spent / kAllFuel;
    burn.share = std::llround(freed * kRadiated / kShares);
    burn.freed = std::llround(freed);
  }
}

/// Where a page holds at least so much heat.
LeafMask reached(const int32_t* heats, int64_t least) {
  if (!heats) return least <= 0 ? world::kAllMask : world::kNoneMask;
  if (least > INT32_MAX) return world::kNoneMask;
  return voxels_from(heats, static_cast<int32_t>(std::max<int64_t>(least, INT32_MIN)));
}

/// Heavy voxels that are not as warm as a flame: others take in no more.
LeafMask Fire::takers(const Cells& cells, PageId p) const {
  const FireKinds& kinds = kinds_[p];
  const int32_t* heats = cells.find_heats(p);
  LeafMask takes;
  for (size_t k = 0; k < kinds.count; ++k)
    takes = takes | without(kinds.mask[k], reached(heats, flame_heat_[kinds.id[k]]));
  world::for_each_voxel(kinds.others, [&](int i) {
    if ((heats ? heats[i] : 0) < flame_heat_[cells.block(p, i)]) takes.set(i);
  });
  return takes;
}

/// What burns in this tick: warm enough fuels with air beside them.
void Fire::find_burning(const Cells& cells, PageId p) {
  FirePage& page = pages_[p];
  page.burning.clear();
  page.burns = {};
  page.cool = page.fuel;
  const int32_t* heats = cells.find_heats(p);
  if (!heats || page.fuel.is_none()) return;
  FireKinds& kinds = kinds_[p];
  kinds.takes = takers(cells, p);
  kinds.takes_tick = ticks_;
  // What holds no heat is cool and doesn't burn, however warm it was born.
  LeafMask burns;
  for (size_t k = 0; k < kinds.count; ++k) {
    const BlockId id = kinds.id[k];
    if (!(*blocks_)[id].fuel) continue;
    burns = burns | (kinds.mask[k] & reached(heats, std::max<int64_t>(ignition_heat_[id], 1)));
    page.cool = without(page.cool,
                        flame_heat_[id] > 0 ? without(kinds.mask[k], kinds.takes) : kinds.mask[k] & reached(heats, 1));
  }
  world::for_each_voxel(kinds.others & page.fuel, [&](int i) {
    const BlockId id = cells.block(p, i);
    if (heats[i] <= 0) return;
    if (heats[i] >= ignition_heat_[id]) burns.set(i);
    if (heats[i] >= flame_heat_[id]) page.cool.clear(i);
  });
  if (burns.is_none()) return;
  page.burns = burns & near(cells, p, &FirePage::feeds);
  int64_t freed = 0;
  const auto add = [&](BlockId id, const LeafMask& mask, int count) {
    const Burn& burn = burns_[id];
    freed += burn.freed * count;
    for (Burning& b : page.burning)
      if (b.spent == burn.spent && b.share == burn.share) {
        b.mask = b.mask | mask;
        return;
      }
    page.burning.push_back({mask, burn.spent, burn.share});
  };
  for (size_t k = 0; k < kinds.count; ++k)
    if (const LeafMask mask = kinds.mask[k] & page.burns; !mask.is_none()) add(kinds.id[k], mask, mask.count());
  world::for_each_voxel(kinds.others & page.burns, [&](int i) {
    LeafMask one;
    one.set(i);
    add(cells.block(p, i), one, 1);
  });
  freed_ += freed;
}

/// What a page takes in from what burns in it and across its sides; `around`: itself, and those in which something
/// burns, or null. Returns how much that is.
int64_t Fire::give_shares(Cells::Heats& heats, const FirePage* const* around, const LeafMask& takes,
                          bool& changed) const {
  constexpr int64_t kMostHeat = INT32_MAX / 2;
  // By size of a share: for each the voxels that give it, then how often each voxel takes it.
  const auto each_share = [&](auto use) {
    for (int64_t last = -1;;) {
      int64_t next = INT64_MAX;
      for (size_t n = 0; n < 7; ++n)
        if (around[n])
          for (const Burning& b : around[n]->burning)
            if (b.share > last) next = std::min(next, b.share);
      if (next == INT64_MAX) return;
      use(next);
      last = next;
    }
  };
  int64_t most = 0, kept = 0;
  each_share([&](int64_t share) { most += share * 8; });
  const bool fits =
      most <= kMostHeat && (takes & voxels_from(heats.data(), static_cast<int32_t>(kMostHeat - most))).is_none();
  each_share([&](int64_t share) {
    LeafMask gives[7];
    const LeafMask* beyond[6];
    for (size_t n = 0; n < 7; ++n) {
      if (n > 0) beyond[n - 1] = &gives[n];
      if (!around[n]) continue;
      for (const Burning& b : around[n]->burning)
        if (b.share == share) gives[n] = gives[n] | b.mask;
    }
    const TimesMasks times = count_burning(gives[0], beyond, takes);
    if (fits) {
      const int count = add_times(times, static_cast<int32_t>(share), heats.data());
      kept += count * share;
      changed |= count > 0;
      return;
    }
    for (int k = 0; k < 4; ++k)
      world::for_each_voxel(times.times[k], [&](int i) {
        int32_t& heat = heats[static_cast<size_t>(i)];
        const auto sum = static_cast<int32_t>(std::clamp<int64_t>(heat + (share << k), INT32_MIN / 2, kMostHeat));
        kept += int64_t{sum} - heat;
        heat = sum;
        changed = true;
      });
  });
  return kept;
}

/// What the page takes in from what burns and glows, and what its own glowing blocks lose. Returns whether it changed.
bool Fire::warm(Cells& cells, PageId p) {
  FirePage& page = pages_[p];
  const FirePage* around[7] = {&page};
  bool any_burning = burns_in_[p];
  for (size_t face = 0; face < 6; ++face) {
    const PageId other = cells.around(p)[kFacePage[face]];
    around[face + 1] = burns_in_[other] ? &pages_[other] : nullptr;
    any_burning |= burns_in_[other] != 0;
  }
  LeafMask lit = page.fuel & page.cool, radiates = without(page.torch, page.flame);
  if (!lit.is_none()) lit = lit & near(cells, p, &FirePage::torch);
  if (!radiates.is_none()) radiates = radiates & near(cells, p, &FirePage::cool);
  if (!any_burning && lit.is_none() && radiates.is_none()) return false;
  FireKinds& kinds = kinds_[p];
  if (kinds.takes_tick != ticks_) kinds.takes = takers(cells, p);
  Cells::Heats& heats = cells.heats(p);
  bool changed = false;
  int64_t kept = any_burning ? give_shares(heats, around, kinds.takes, changed) : 0;
  int64_t lost = 0;
  if (lit.is_none() && radiates.is_none()) {
    kept_ += kept;
    if (kept != 0) cells.book_heat(kept);
    return changed;
  }
  // Glowing blocks and torches, as black bodies.
  for (int face = 0; face < 6; ++face) {
    const PageId other = cells.around(p)[kFacePage[face]];
    const LeafMask& torch_beyond = other == kClosedPage ? world::kNoneMask : pages_[other].torch;
    const LeafMask& cool_beyond = other == kClosedPage ? world::kNoneMask : pages_[other].cool;
    const int shift = 6 - 3 * world::face_axis(face), stride = 1 << shift;
    const int sign = world::face_sign(face);
    world::for_each_voxel(lit & world::across(page.torch, torch_beyond, face), [&](int i) {
      const bool leaves = (i >> shift & 7) == (sign > 0 ? 7 : 0);
      const BlockId glows = leaves ? cells.block(other, i - sign * 7 * stride) : cells.block(p, i + sign * stride);
      if (!kinds.takes.test(i)) return;
      int32_t& heat = heats[static_cast<size_t>(i)];
      const auto sum =
          static_cast<int32_t>(std::clamp<int64_t>(heat + burns_[glows].radiated, INT32_MIN / 2, INT32_MAX / 2));
      kept += int64_t{sum} - heat;
      heat = sum;
      changed = true;
    });
    world::for_each_voxel(radiates & world::across(page.cool, cool_beyond, face), [&](int i) {
      int32_t& heat = heats[static_cast<size_t>(i)];
      const auto left =
          static_cast<int32_t>(std::max<int64_t>(heat - burns_[cells.block(p, i)].radiated, INT32_MIN / 2));
      lost += int64_t{heat} - left;
      heat = left;
      changed = true;
    });
  }
  kept_ += kept;
  if (kept != lost) cells.book_heat(kept - lost);
  return changed;
}

/// Fuel that is spent goes, flames stand beside what burns, and end where nothing does.
void Fire::burn(Cells& cells, PageId p, const Tick& tick, LeafMask& changed) {
  FirePage& page = pages_[p];
  const auto leave = [&](int i) {
    const Cell was = cells.cell(p, i);
    const BlockId leaves = (*blocks_)[was.block].leaves;
    // As warm as it was; the rest goes off with the smoke. Air that was a fire is a flame.
    Cell now{.block = leaves == world::kAir ? blocks_->fire() : leaves};
    if (now.block == blocks_->fire() && now.block != world::kAir) now.amount = kFullVoxel;
    if (leaves != world::kAir)
      now.heat = static_cast<int32_t>(
          std::clamp<double>(blocks_->thermal().capacity(leaves) *
                                 static_cast<double>(temperature(blocks_->thermal().voxel(was.block), was.heat)),
                             INT32_MIN / 2, INT32_MAX / 2));
    cells.transmute(p, i, now);
    changed.set(i);
  };
  for (const Burning& b : page.burning) world::for_each_voxel(spend(b.mask, b.spent, page.spent->data()), leave);
  const LeafMask beside = near(cells, p, &FirePage::burns);
  if (beside.is_none() && page.flame.is_none()) return;
  if (const LeafMask room = page.air & beside; blocks_->fire() != world::kAir && !room.is_none())
    world::for_each_voxel(room & random(cells, p, tick, 0, kFlameRises), [&](int i) {
      cells.transmute(p, i, {.block = blocks_->fire(), .amount = kFullVoxel});
      changed.set(i);
    });
  if (page.flame.is_none()) return;
  const LeafMask alone = without(page.flame, beside), fuel = near(cells, p, &FirePage::fuel);
  const LeafMask dying = (without(alone, fuel) & random(cells, p, tick, 1, kFlameDies)) |
                         (alone & fuel & random(cells, p, tick, 2, kLongFlame));
  end_flames(cells, p, tick, dying, changed);
}

void Fire::end_flames(Cells& cells, PageId p, const Tick& tick, const LeafMask& dying, LeafMask& changed) {
  if (dying.is_none()) return;
  const LeafMask smokes = random(cells, p, tick, 3, kSmokes);
  world::for_each_voxel(dying, [&](int i) {
    const bool smoke = smokes.test(i) && blocks_->smoke() != world::kAir;
    cells.transmute(p, i, smoke ? Cell{.block = blocks_->smoke(), .amount = kFullVoxel} : Cell{});
    changed.set(i);
  });
}

/// The model by chance.
void Fire::jump(Cells& cells, PageId p, const Tick& tick, LeafMask& changed) {
  FirePage& page = pages_[p];
  const LeafMask lit = near(cells, p, &FirePage::hot);
  page.live = !page.flame.is_none() || !(page.fuel & lit).is_none();
  if (!page.live && (page.air & lit).is_none()) return;
  const LeafMask fuel = near(cells, p, &FirePage::fuel);
  const auto light = [&](int i) {
    cells.transmute(p, i, {.block = blocks_->fire(), .amount = kFullVoxel});
    changed.set(i);
  };
  if (blocks_->fire() != world::kAir)
    world::for_each_voxel(page.air & lit & fuel & random(cells, p, tick, 0, kJumps), light);
  const LeafMask burns_on = random(cells, p, tick, 1, kEatenBurns);
  world::for_each_voxel(page.fuel & lit & near(cells, p, &FirePage::feeds) & random(cells, p, tick, 2, kEats),
                        [&](int i) {
                          if (burns_on.test(i) && blocks_->fire() != world::kAir) return light(i);
                          cells.transmute(p, i, {.block = (*blocks_)[cells.block(p, i)].leaves});
                          changed.set(i);
                        });
  end_flames(cells, p, tick,
             (without(page.flame, fuel) & random(cells, p, tick, 4, kFlameDies)) |
                 (page.flame & fuel & random(cells, p, tick, 5, kLongFlame)),
             changed);
}

RuleReport Fire::step(Cells& cells, const Tick& tick) {
  RuleReport report;
  if (!blocks_) blocks_ = std::make_unique<FireBlocks>(cells.palette(), tick.options->reactions, tick.options->rest_k);
  follow_blocks(cells);
  ++ticks_;
  list_pages(cells);
  const SimKnobs& knobs = tick.options->knobs;
  const bool by_heat = knobs.fire_model == FireModel::heat;
  const double dt = std::max(static_cast<double>(knobs.heat_speed), 0.0) / kHeatTicksPerSecond;
  std::vector<uint8_t> heated(list_.size(), 0);
  std::vector<LeafMask> changed(list_.size());
  const auto each = [&](auto work) {
    world::parallel_ranges(list_.size(), kPagesATask, [&](size_t begin, size_t end) {
      for (size_t n = begin; n < end; ++n) work(n, list_[n]);
    });
  };
  if (by_heat) {
    follow_burns(dt);
    each([&](size_t, PageId p) { find_burning(cells, p); });
    burns_in_.assign(cells.page_limit(), 0);
    for (const PageId p : list_)
      if (!pages_[p].burning.empty()) spent_of(p), burns_in_[p] = 1;
    // A flame that touches what burns is part of that; another is a torch.
    each([&](size_t, PageId p) {
      FirePage& page = pages_[p];
      page.torch = page.hot;
      if (!page.flame.is_none()) page.torch = without(page.hot, page.flame & near(cells, p, &FirePage::burns));
      page.live = !page.burning.empty() || !page.flame.is_none();
    });
    each([&](size_t n, PageId p) { heated[n] = warm(cells, p); });
    each([&](size_t n, PageId p) { burn(cells, p, tick, changed[n]); });
  } else {
    each([&](size_t n, PageId p) { jump(cells, p, tick, changed[n]); });
  }
  AwakeSet& set = cells.awake(rule_);
  for (size_t n = 0; n < list_.size(); ++n) {
    const PageId p = list_[n];
    if (heated[n]) cells.stir_heat(p);
    if (!changed[n].is_none()) cells.stir(p, changed[n]);
    if (heated[n] || pages_[p].live) set.add(p);
    report.voxels_changed += static_cast<uint64_t>(changed[n].count());
  }
  cells.spread();
  report.leaves_visited = list_.size();
  report.bytes = pages_.capacity() * sizeof(FirePage) + kinds_.capacity() * sizeof(FireKinds);
  for (const PageId p : list_) forget_spent(p);
  report.bytes += spent_.size() * sizeof(FuelSpent);
  if (freed_ > 0)
    report.notes.push_back(fmt::format("{:.6g} MJ burnt, {:.6g} MJ of them kept by what is near",
                                       static_cast<double>(freed_) * kHeatUnitJ * 1e-6,
                                       static_cast<double>(kept_) * kHeatUnitJ * 1e-6));
  return report;
}

}  // namespace

RuleInfo fire_info() {
  return {.name = "fire",
          .what = "what is warm enough burns, lights what is near, and leaves ash",
          .conserves = "nothing: what burns is booked",
          .layers = "blocks, heat",
          .calls = calls_for_heat,
          .feels_heat = true};
}
std::unique_ptr<Rule> make_fire_rule(size_t rule) { return std::make_unique<Fire>(rule); }

}  // namespace sim
