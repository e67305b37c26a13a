#include "sim/matter/cells.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstring>

#include "world/base/errors.h"
#include "world/base/huge_pages.h"
#include "world/base/random.h"
#include "world/store/leaf_shifts.h"

namespace sim {

using world::BlockId;
using world::LeafMask;
using world::LeafPos;
using world::VoxelPos;

namespace {

constexpr uint64_t kFirstZ = world::kFirstZMask, kLastZ = kFirstZ << 7;

bool leaf_inside_world(LeafPos l) {
  const VoxelPos low = world::voxel_from_leaf(l);
  return world::inside_world(low) && world::inside_world(low + VoxelPos{7, 7, 7});
}

/// For each axis bit 0: something near its low side, bit 1: in the middle (always, where anything is set), bit 2: near
/// its high side. Near: of the two layers there, since rules look two voxels far.
std::array<unsigned, 3> sides_near(const LeafMask& m) {
  uint64_t all = 0;
  for (const uint64_t w : m.word) all |= w;
  const uint64_t low_z = kFirstZ | kFirstZ << 1, high_z = kLastZ | kLastZ >> 1;
  const auto bits = [](bool low, bool high) { return 2u | (low ? 1u : 0u) | (high ? 4u : 0u); };
  return {bits(m.word[0] | m.word[1], m.word[6] | m.word[7]), bits(all & 0xffff, all >> 48),
          bits(all & low_z, all & high_z)};
}

/// Calls visit(index) for each byte that isn't 0.
template <class Visit>
void for_each_set(const std::vector<uint8_t>& flags, Visit visit) {
  for (size_t i = 0; i < flags.size(); i += 8) {
    const size_t end = std::min(i + 8, flags.size());
    uint64_t eight = 0;
    std::memcpy(&eight, flags.data() + i, end - i);
    if (!eight) continue;
    for (size_t k = i; k < end; ++k)
      if (flags[k]) visit(static_cast<PageId>(k));
  }
}

/// Never taken down: what ends later than it may hold heats.
world::HugePageRecords& memory_of_heats() {
  static auto& memory = *new world::HugePageRecords(sizeof(Cells::Heats));
  return memory;
}

}  // namespace

void* Cells::Heats::operator new(size_t) { return memory_of_heats().take(); }
void Cells::Heats::operator delete(void* heats) { memory_of_heats().give_back(heats); }

Cells::Cells(world::Store& store, uint64_t seed, size_t rules, int32_t floor_y, std::optional<int> subscriber)
    : store_(store),
      seed_(seed),
      floor_leaf_(floor_y >> world::kLeafLog2),
      subscriber_(subscriber ? *subscriber : store.subscribe()),
      traits_(store.palette()),
      awake_(rules) {
  met_.resize(traits_.size(), 0), booked_.resize(traits_.size());
  allocate();  // kClosedPage
  closed_[kClosedPage] = occupied_[kClosedPage] = world::kAllMask;
  around_[kClosedPage].fill(kClosedPage);
}

PageId Cells::allocate() {
  if (!free_.empty()) {
    const PageId p = free_.back();
    free_.pop_back();
    return p;
  }
  const auto p = static_cast<PageId>(pos_.size());
  pos_.emplace_back();
  around_.emplace_back();
  hash_.push_back(0);
  for (auto* counts : {&version_, &content_changes_, &heat_changes_}) counts->push_back(0);
  for (auto* plane : {&grain_, &closed_, &occupied_}) plane->emplace_back();
  tag_.emplace_back();
  for (auto* flags : {&ring_, &stirred_, &unsaved_, &heated_, &heat_unsaved_}) flags->push_back(0);
  blocks_.emplace_back();
  amounts_.emplace_back();
  heats_.emplace_back();
  return p;
}

PageId Cells::find(LeafPos l) const {
  const Slots* slots = slots_.find(world::region_from_leaf(l));
  return slots ? slots->page[static_cast<size_t>(world::index_in_region(l))] : kClosedPage;
}

PageId Cells::open(LeafPos l) {
  if (const PageId p = find(l)) return p;
  if (l.y < floor_leaf_ || !leaf_inside_world(l)) return kClosedPage;
  if (!away_.empty() && away_.contains(world::region_from_leaf(l))) return kClosedPage;
  const PageId p = allocate();
  Slots& slots = slots_.insert(world::region_from_leaf(l));
  slots.page[static_cast<size_t>(world::index_in_region(l))] = p;
  ++slots.used;
  pos_[p] = l;
  heat_unsaved_[p] = ring_[p] = stirred_[p] = unsaved_[p] = 0;
  hash_[p] = world::random_bits(seed_, l.x, l.y, l.z);
  blocks_[p].reset();
  amounts_[p].reset();
  heats_[p].reset();
  read(p, store_.leaf(l));
  read_amounts(p, world::Layer::liquid, Content::liquid);
  read_amounts(p, world::Layer::gas, Content::gas);
  read_heats(p);
  link(p);
  return p;
}

void Cells::read(PageId p, const world::LeafBlocks& leaf) {
  LeafMask grain, closed;
  BlockId kind = kNoKind;
  bool rich = false;
  if (!leaf.values) {
    const Content content = traits_[leaf.uniform].content;
    if (content == Content::grain) grain = world::kAllMask, kind = leaf.uniform;
    if (content == Content::closed) closed = world::kAllMask;
    rich = content == Content::liquid || content == Content::gas;
    if (rich) meet(leaf.uniform, content);
  } else {
    for (int i = 0; i < world::kLeafVoxels; ++i) {
      const BlockId id = leaf.values[i];
      switch (traits_[id].content) {
        case Content::empty:
          break;
        case Content::closed:
          closed.set(i);
          break;
        case Content::grain:
          grain.set(i);
          rich |= kind != kNoKind && kind != id;
          kind = id;
          break;
        case Content::liquid:
        case Content::gas:
          meet(id, traits_[id].content);
          rich = true;
          break;
      }
    }
  }
  ++version_[p];
  ++content_changes_[p];
  grain_[p] = grain, closed_[p] = closed;
  for (int x = 0; x < 8; ++x) occupied_[p].word[x] = grain.word[x] | closed.word[x];
  tag_[p] = {kind, rich, rich};
  if (rich || (kind != kNoKind && met_kind_ != kNoKind && kind != met_kind_)) met_rich_ = true;
  if (kind != kNoKind) met_kind_ = kind;
  if (rich) {
    if (!blocks_[p]) blocks_[p] = std::make_unique<Blocks>();
    for (int i = 0; i < world::kLeafVoxels; ++i) (*blocks_[p])[static_cast<size_t>(i)] = leaf[i];
  } else {
    blocks_[p].reset();
  }
}

void Cells::link(PageId p) {
  ++page_changes_;
  for (int dx = -1; dx <= 1; ++dx)
    for (int dy = -1; dy <= 1; ++dy)
      for (int dz = -1; dz <= 1; ++dz) {
        const PageId other = dx == 0 && dy == 0 && dz == 0 ? p : find(pos_[p] + LeafPos{dx, dy, dz});
        around_[p][static_cast<size_t>(around_index(dx, dy, dz))] = other;
        if (other != kClosedPage) around_[other][static_cast<size_t>(around_index(-dx, -dy, -dz))] = p;
      }
}

void Cells::open_around(PageId p) {
  if (p == kClosedPage || ring_[p]) return;
  const LeafPos l = pos_[p];
  for (int dx = -1; dx <= 1; ++dx)
    for (int dy = -1; dy <= 1; ++dy)
      for (int dz = -1; dz <= 1; ++dz)
        if (around_[p][static_cast<size_t>(around_index(dx, dy, dz))] == kClosedPage) open(l + LeafPos{dx, dy, dz});
  ring_[p] = 1;
}

void Cells::release(PageId p) {
  ++page_changes_;
  for (size_t i = 0; i < 27; ++i) {
    const PageId other = around_[p][i];
    if (other == kClosedPage || other == p) continue;
    around_[other][26 - i] = kClosedPage;
    ring_[other] = 0;
  }
  const LeafPos l = pos_[p];
  const world::RegionPos r = world::region_from_leaf(l);
  Slots& slots = *slots_.find(r);
  slots.page[static_cast<size_t>(world::index_in_region(l))] = kClosedPage;
  if (--slots.used == 0) slots_.erase(r);
  blocks_[p].reset();
  amounts_[p].reset();
  heats_[p].reset();
  free_.push_back(p);
}

BlockId Cells::block(PageId p, int index) const {
  if (blocks_[p]) return (*blocks_[p])[static_cast<size_t>(index)];
  if (grain_[p].test(index)) return tag_[p].kind;
  if (!closed_[p].test(index)) return world::kAir;
  return store_.leaf(pos_[p])[index];  // what never moves is where it was
}

void Cells::values_of(PageId p, std::span<BlockId, world::kLeafVoxels> into) const {
  if (blocks_[p]) {
    std::copy(blocks_[p]->begin(), blocks_[p]->end(), into.begin());
    return;
  }
  const world::LeafBlocks leaf = store_.leaf(pos_[p]);
  for (int x = 0; x < 8; ++x) {
    const uint64_t grain = grain_[p].word[x], closed = closed_[p].word[x];
    // Most rows hold no grain, and either nothing else or what the store knows.
    BlockId* const row = into.data() + x * 64;
    if (grain == 0 && closed == 0) {
      std::fill_n(row, 64, world::kAir);
      continue;
    }
    if (grain == 0 && ~closed == 0) {
      leaf.values ? std::copy_n(leaf.values + x * 64, 64, row) : std::fill_n(row, 64, leaf.uniform);
      continue;
    }
    if (grain == 0 && leaf.values) {
      for (int b = 0; b < 64; ++b)
        row[b] = static_cast<BlockId>(leaf.values[x * 64 + b] & (0 - (closed >> b & 1)));  // air is 0
      continue;
    }
    for (int b = 0; b < 64; ++b) {
      const int i = x * 64 + b;
      into[static_cast<size_t>(i)] = grain >> b & 1 ? tag_[p].kind : closed >> b & 1 ? leaf[i] : world::kAir;
    }
  }
}

Cells::Blocks& Cells::blocks(PageId p) {
  CHECK(p != kClosedPage);
  if (!blocks_[p]) {
    auto made = std::make_unique<Blocks>();
    values_of(p, *made);
    blocks_[p] = std::move(made);
    tag_[p].has_blocks = true;
  }
  return *blocks_[p];
}

Cells::Amounts& Cells::amounts(PageId p) {
  if (!amounts_[p]) {
    const Blocks& ids = blocks(p);
    auto made = std::make_unique<Amounts>();
    for (size_t i = 0; i < ids.size(); ++i) (*made)[i] = is_fluid(ids[i]) ? kFullVoxel : 0;
    amounts_[p] = std::move(made);
  }
  return *amounts_[p];
}

Cells::Heats& Cells::heats(PageId p) {
  if (!heats_[p]) heats_[p] = std::make_unique<Heats>();
  set_met_heat();
  return *heats_[p];
}

void Cells::put(PageId p, int index, const Cell& cell) {
  const auto i = static_cast<size_t>(index);
  Tag& tag = tag_[p];
  blocks(p)[i] = cell.block;
  const auto set = [&](LeafMask& mask, bool on) { on ? mask.set(index) : mask.clear(index); };
  const Content content = traits_[cell.block].content;
  set(grain_[p], content == Content::grain);
  set(closed_[p], content == Content::closed);
  set(occupied_[p], content == Content::grain || content == Content::closed);
  if (content == Content::grain) {
    ++version_[p];  // rules may have come by it in other ways than by moving it
    if (tag.kind == kNoKind) tag.kind = cell.block;
    tag.rich |= tag.kind != cell.block;
  }
  if (content == Content::liquid || content == Content::gas) {
    tag.rich = true;
    meet(cell.block, content);
  }
  if (tag.rich || (content == Content::grain && cell.block != met_kind_)) met_rich_ = true;
  if (amounts_[p] || (cell.amount != 0 && cell.amount != kFullVoxel)) amounts(p)[i] = cell.amount;
  if (heats_[p] || cell.heat != 0) heats(p)[i] = cell.heat;
}

// ---- who is awake ------------------------------------------------------------------------------------------------

void Cells::stir(PageId p, const LeafMask& changed) {
  // Most are marked already: what isn't written stays in the caches of other threads.
  const auto mark = [](uint8_t& flag) {
    const std::atomic_ref<uint8_t> of(flag);
    if (!of.load(std::memory_order_relaxed)) of.store(1, std::memory_order_relaxed);
  };
  unsaved_[p] = 1;
  ++content_changes_[p];
  mark(stirred_[p]);
  const std::array<unsigned, 3> near = sides_near(changed);
  if ((near[0] | near[1] | near[2]) == 2u) return;
  const std::array<PageId, 27>& around = around_[p];
  for (int dx = -1; dx <= 1; ++dx) {
    if (!(near[0] >> (dx + 1) & 1)) continue;
    for (int dy = -1; dy <= 1; ++dy) {
      if (!(near[1] >> (dy + 1) & 1)) continue;
      for (int dz = -1; dz <= 1; ++dz)
        if (near[2] >> (dz + 1) & 1) mark(stirred_[around[static_cast<size_t>(around_index(dx, dy, dz))]]);
    }
  }
}

void Cells::spread() {
  stirred_[kClosedPage] = 0;
  spread_to_.clear();
  for (AwakeSet& set : awake_)
    if (set.is_called()) spread_to_.push_back(&set);
  for_each_set(stirred_, [&](PageId p) {
    stirred_[p] = 0;
    for (AwakeSet* set : spread_to_) set->add(p);
  });
  for_each_set(heated_, [&](PageId p) {
    heated_[p] = 0;
    for (size_t r = 0; r < feels_heat_.size(); ++r)
      if (feels_heat_[r]) awake_[r].add(p);
  });
}

bool Cells::settled() const {
  return arrived_.empty() && std::all_of(awake_.begin(), awake_.end(), [](const AwakeSet& set) { return set.empty(); });
}

// ---- the books ---------------------------------------------------------------------------------------------------

void Cells::book(BlockId block, int64_t amount) {
  Booked& booked = booked_[block];
  std::atomic_ref<int64_t>(amount > 0 ? booked.in : booked.out).fetch_add(std::abs(amount), std::memory_order_relaxed);
}

void Cells::book_heat(int64_t units) {
  std::atomic_ref<int64_t>(units > 0 ? booked_heat_.in : booked_heat_.out)
      .fetch_add(std::abs(units), std::memory_order_relaxed);
}

void Cells::transmute(PageId p, int index, const Cell& now) {
  const Cell was = cell(p, index);
  const auto amount = [&](const Cell& c) { return is_fluid(c.block) ? static_cast<int64_t>(c.amount) : kFullVoxel; };
  if (was.block != world::kAir) book(was.block, -amount(was));
  if (now.block != world::kAir) book(now.block, amount(now));
  if (now.heat != was.heat) book_heat(static_cast<int64_t>(now.heat) - was.heat);
  put(p, index, now);
}

Cells::Booked Cells::booked(BlockId block) const { return block < booked_.size() ? booked_[block] : Booked{}; }

// ---- the store ---------------------------------------------------------------------------------------------------

/// What the layer says of the page's liquids, or of its gases.
void Cells::read_amounts(PageId p, world::Layer layer, Content content) {
  const world::IntLayer* values = store_.find_int_layer(layer);
  if (!values || !tag_[p].rich) return;
  std::array<int32_t, world::kLeafVoxels> amount;
  LeafMask active;
  if (!values->read_leaf(pos_[p], amount, active)) return;
  for (int x = 0; x < 8; ++x)
    for (uint64_t bits = active.word[x]; bits; bits &= bits - 1) {
      const auto i = static_cast<size_t>(x * 64 + std::countr_zero(bits));
      if (traits_[(*blocks_[p])[i]].content != content) continue;
      amounts(p)[i] = static_cast<uint16_t>(std::clamp<int32_t>(amount[i], 1, 65535));
    }
}

/// Voxels that aren't full; the layer goes where there is none.
void Cells::write_amounts(std::span<const PageId> pages, world::Layer layer, Content content) {
  const auto partial = [&](PageId p, LeafMask& active, std::array<int32_t, world::kLeafVoxels>& amount) {
    active = {};
    if (!amounts_[p]) return;
    for (size_t i = 0; i < world::kLeafVoxels; ++i) {
      amount[i] = (*amounts_[p])[i];
      if (amount[i] != kFullVoxel && traits_[(*blocks_[p])[i]].content == content) active.set(static_cast<int>(i));
    }
  };
  std::array<int32_t, world::kLeafVoxels> amount{};
  LeafMask active;
  for (const PageId p : pages) {
    partial(p, active, amount);
    if (active.is_none() && !store_.find_int_layer(layer)) continue;
    store_.make_int_layer(layer).write_leaf(pos_[p], amount, active);
  }
  const world::IntLayer* values = store_.find_int_layer(layer);
  if (values && values->active_voxels() == 0) store_.drop_layer(layer);
}

void Cells::read_heats(PageId p) {
  const world::IntLayer* values = store_.find_int_layer(world::Layer::heat);
  if (!values) return;
  LeafMask active;
  auto heats = std::make_unique<Heats>();
  if (!values->read_leaf(pos_[p], *heats, active)) return;
  heats_[p] = std::move(heats);  // 0 where nothing is active
  met_heat_.store(true, std::memory_order_relaxed);
}

/// Voxels that are warmer or colder than they were born; the layer goes where there is none.
void Cells::write_heats(std::span<const PageId> pages) {
  for (const PageId p : pages) {
    LeafMask active;
    if (heats_[p])
      for (size_t i = 0; i < world::kLeafVoxels; ++i)
        if ((*heats_[p])[i] != 0) active.set(static_cast<int>(i));
    if (active.is_none() && !store_.find_int_layer(world::Layer::heat)) continue;
    static constexpr Heats kNoHeats{};
    store_.make_int_layer(world::Layer::heat).write_leaf(pos_[p], heats_[p] ? *heats_[p] : kNoHeats, active);
    heat_unsaved_[p] = 0;
  }
  const world::IntLayer* values = store_.find_int_layer(world::Layer::heat);
  if (values && values->active_voxels() == 0) store_.drop_layer(world::Layer::heat);
}

size_t Cells::flush() {
  std::vector<PageId> pages;
  for_each_set(heat_unsaved_, [&](PageId p) { pages.push_back(p); });
  write_heats(pages);
  const size_t warmer = pages.size();
  pages.clear();
  for_each_set(unsaved_, [&](PageId p) { pages.push_back(p); });
  if (pages.empty()) return warmer;
  write_heats(pages);
  constexpr size_t kBatch = 1024;
  std::vector<Blocks> values;
  std::vector<world::LeafWrite> writes;
  for (size_t begin = 0; begin < pages.size(); begin += kBatch) {
    const size_t count = std::min(kBatch, pages.size() - begin);
    values.resize(count);
    writes.clear();
    for (size_t n = 0; n < count; ++n) {
      values_of(pages[begin + n], values[n]);
      writes.push_back({pos_[pages[begin + n]], values[n].data()});
    }
    CHECK(store_.write_leaves(writes).ok());
  }
  store_.take_dirty(subscriber_);  // our own
  write_amounts(pages, world::Layer::liquid, Content::liquid);
  write_amounts(pages, world::Layer::gas, Content::gas);
  // The store knows all again: pages may be plain.
  for (const PageId p : pages) {
    unsaved_[p] = 0;
    if (!blocks_[p]) continue;
    read(p, store_.leaf(pos_[p]));
    if (!tag_[p].rich) amounts_[p].reset();
  }
  return warmer + pages.size();
}

void Cells::close_idle() {
  std::vector<uint8_t> needed(pos_.size(), 0);
  for (const AwakeSet& set : awake_)
    for (const PageId p : set.next()) {
      needed[p] = 1;
      for (const PageId other : around_[p]) needed[other] = 1;
    }
  std::vector<uint8_t> is_free(pos_.size(), 0);
  for (const PageId p : free_) is_free[p] = 1;
  for (PageId p = 1; p < pos_.size(); ++p)
    if (!needed[p] && !is_free[p]) release(p);
}

world::BlockId Cells::block_at(VoxelPos v) const {
  const PageId p = find(world::leaf_from_voxel(v));
  return p == kClosedPage ? store_.get(v) : block(p, world::index_in_leaf(v));
}

int Cells::amount_at(VoxelPos v) const {
  const PageId p = find(world::leaf_from_voxel(v));
  if (p != kClosedPage) return amount(p, world::index_in_leaf(v));
  const bool liquid = traits_[store_.get(v)].content == Content::liquid;
  const world::IntLayer* values = store_.find_int_layer(liquid ? world::Layer::liquid : world::Layer::gas);
  return values && values->active(v) ? values->get(v) : kFullVoxel;
}

size_t Cells::bytes() const {
  size_t all = pos_.capacity() * (sizeof(LeafPos) + sizeof(around_[0]) + 3 * sizeof(LeafMask) + 24) + slots_.bytes() +
               slots_.size() * sizeof(Slots);
  for (const auto& blocks : blocks_)
    if (blocks) all += sizeof(Blocks);
  for (const auto& amounts : amounts_)
    if (amounts) all += sizeof(Amounts);
  for (const auto& heats : heats_)
    if (heats) all += sizeof(Heats);
  return all;
}

}  // namespace sim
