/// The part of a world that moves: leaves of the store, opened as pages of bit planes while something in or beside
/// them is awake. Rules read and write pages; flush() writes what changed back to the store.
///
///   page 0            closed all over: what lies outside of the world's border, or in a region that is unloaded
///   page n            a leaf: its place, its 26 neighbours, and by plane 512 bits
///     grain, closed   of its voxels; what is neither can be entered by grains: air, gases, liquids
///     blocks          512 ids, made where planes don't say all of it; see has_blocks()
///
/// A page is plain where it holds air, voxels that never move, and grains of one kind: then planes and kind() say what
/// is where, and moving a grain is moving a bit. Else it is rich, and its ids are kept. Plain pages in which something
/// else than one kind of grain may arrive have ids too, until the next flush.
///
/// Rules that run at the same time write their own page only. Pages come and go between passes, on one thread.
/// bytes  about 600 a page, and 1024 for ids
#pragma once

#include <array>
#include <atomic>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "sim/matter/traits.h"
#include "world/store/leaf_mask.h"
#include "world/store/region_table.h"
#include "world/store/store.h"

namespace sim {

using PageId = uint32_t;
constexpr PageId kClosedPage = 0;

/// The amount of a liquid or gas that fills a voxel: units of 1/4096 m^3 of it at rest.
constexpr int kFullVoxel = 4096;

/// All that a voxel holds, and that moves with it.
struct Cell {
  world::BlockId block = world::kAir;
  uint16_t amount = 0;  // of a liquid or gas, 1..65535; 0 for others
  int32_t heat = 0;     // above rest, in the units of sim/matter/rules/heat.cpp
  friend bool operator==(const Cell&, const Cell&) = default;
};

/// Of the 27 around a page, itself in the middle: (dx + 1) * 9 + (dy + 1) * 3 + dz + 1.
constexpr int around_index(int dx, int dy, int dz) { return (dx + 1) * 9 + (dy + 1) * 3 + dz + 1; }
constexpr int kSelf = around_index(0, 0, 0), kAbove = around_index(0, 1, 0), kBelow = around_index(0, -1, 0);

/// Pages that one rule has to look at.
class AwakeSet {
 public:
  const std::vector<PageId>& now() const { return now_; }
  bool empty() const { return next_.empty(); }
  void add(PageId p) {
    if (!called_ || p == kClosedPage) return;
    if (p >= marked_.size()) marked_.resize(p + 1, 0);
    if (marked_[p]) return;
    marked_[p] = 1;
    next_.push_back(p);
  }
  /// What was added so far is now(), and nothing is added yet.
  void begin() {
    now_.swap(next_);
    next_.clear();
    for (const PageId p : now_) marked_[p] = 0;
  }
  std::span<const PageId> next() const { return next_; }
  void clear() {
    begin();
    now_.clear();
  }
  /// Nothing is ever added for a rule that isn't called for.
  void set_called(bool called) { called_ = called; }
  bool is_called() const { return called_; }
  /// Takes out what `gone` says of a page.
  template <class Gone>
  void remove(Gone gone) {
    std::erase_if(next_, [&](PageId p) {
      if (gone(p)) marked_[p] = 0;
      return gone(p);
    });
  }

 private:
  bool called_ = true;
  std::vector<PageId> now_, next_;
  std::vector<uint8_t> marked_;  // in next_
};

class Cells {
 public:
  using Blocks = std::array<world::BlockId, world::kLeafVoxels>;
  using Amounts = std::array<uint16_t, world::kLeafVoxels>;
  /// On cache lines: rows of eight lie in one. On huge pages: a step of conduction in 7 M voxels took 1.14 times as
  /// long on small ones (measured on a Xeon, 2026).
  struct alignas(64) Heats : std::array<int32_t, world::kLeafVoxels> {
    static void* operator new(size_t);
    static void operator delete(void* heats);
  };
  static constexpr world::BlockId kNoKind = world::kAir;

  /// The store must outlive it and stay where it is. `rules` awake sets are kept. Nothing goes below floor_y, a
  /// multiple of 8: what is there is closed. `subscriber`: of the store, where there is one already.
  Cells(world::Store& store, uint64_t seed, size_t rules, int32_t floor_y, std::optional<int> subscriber = {});

  // ---- pages ----
  size_t page_limit() const { return pos_.size(); }  // page ids are below this
  size_t open_pages() const { return pos_.size() - 1 - free_.size(); }
  world::LeafPos pos(PageId p) const { return pos_[p]; }
  const std::array<PageId, 27>& around(PageId p) const { return around_[p]; }
  /// Counts changes of which pages there are, and who is beside whom.
  uint64_t page_changes() const { return page_changes_; }
  /// The page of a leaf, opened where it isn't; kClosedPage outside of the world.
  PageId open(world::LeafPos l);
  PageId find(world::LeafPos l) const;
  /// Opens the neighbours too: what a rule needs before it looks at a page.
  void open_around(PageId p);
  bool is_open_around(PageId p) const { return ring_[p] != 0; }
  /// A random number of the page, of the seed and its place.
  uint64_t hash(PageId p) const { return hash_[p]; }

  // ---- what is where ----
  world::LeafMask* grain() { return grain_.data(); }
  const world::LeafMask* closed() const { return closed_.data(); }
  /// grain | closed.
  world::LeafMask* occupied() { return occupied_.data(); }
  const world::LeafMask& occupied_mask(PageId p) const { return occupied_[p]; }
  const MatterTraits& traits() const { return traits_; }
  /// A page at a glance: the kind of its grains where it is plain, and two flags.
  struct Tag {
    world::BlockId kind = kNoKind;
    bool rich = false, has_blocks = false;
  };
  Tag tag(PageId p) const { return tag_[p]; }
  world::BlockId kind(PageId p) const { return tag_[p].kind; }
  void set_kind(PageId p, world::BlockId kind) { tag_[p].kind = kind; }
  bool is_rich(PageId p) const { return tag_[p].rich; }
  /// Whether a page so far held this block, if it is a liquid or gas; whether one held a liquid; and whether all were
  /// plain, with grains of one kind, which that is.
  bool met(world::BlockId id) const { return id < met_.size() && met_[id]; }
  bool met_liquid() const { return met_liquid_; }
  bool met_fluid() const { return met_fluid_; }  // or a gas
  bool met_one_kind(world::BlockId& kind) const {
    kind = met_kind_;
    return !met_rich_ && !met_heat_;
  }
  /// Whether a page so far held heat.
  bool met_heat() const { return met_heat_; }
  world::BlockId block(PageId p, int index) const;
  const world::BlockId* find_blocks(PageId p) const { return blocks_[p] ? blocks_[p]->data() : nullptr; }
  /// Counts how often the content was read anew: what a rule derives from ids holds as long as it is the same.
  uint32_t version(PageId p) const { return version_[p]; }
  /// Counts changes of what is where, by rules and by edits alike: what a rule derives from ids holds as long as it is
  /// the same.
  uint32_t content_changes(PageId p) const { return content_changes_[p]; }
  /// Its ids, written out; nothing is made.
  void ids(PageId p, std::span<world::BlockId, world::kLeafVoxels> into) const { values_of(p, into); }
  const world::BlockPalette& palette() const { return store_.palette(); }
  int32_t floor_y() const { return floor_leaf_ * world::kLeafSize; }
  const world::Store& store() const { return store_; }  // lags behind until flush()
  /// Its ids, made where there are none; whoever moves something in the page keeps them right from then on.
  Blocks& blocks(PageId p);
  /// How much of the liquids and gases there is: null where all of the page are full voxels, or there are none.
  const uint16_t* find_amounts(PageId p) const { return amounts_[p] ? amounts_[p]->data() : nullptr; }
  uint16_t amount(PageId p, int index) const {
    if (amounts_[p]) return (*amounts_[p])[static_cast<size_t>(index)];
    return is_fluid(block(p, index)) ? kFullVoxel : 0;
  }
  /// Made where there are none. Ids too.
  Amounts& amounts(PageId p);
  /// Heat above rest: null where there is none.
  const int32_t* find_heats(PageId p) const { return heats_[p] ? heats_[p]->data() : nullptr; }
  Heats& heats(PageId p);
  /// Puts other heats in the place of a page's; tell stir_heat() of it.
  void swap_heats(PageId p, std::unique_ptr<Heats>& with) {
    heats_[p].swap(with);
    set_met_heat();
  }
  /// Whether amounts or heat are kept for it.
  bool holds_more(PageId p) const { return amounts_[p] || heats_[p]; }
  bool is_fluid(world::BlockId id) const {
    return traits_[id].content == Content::liquid || traits_[id].content == Content::gas;
  }
  Cell cell(PageId p, int index) const {
    return {block(p, index), amount(p, index), heats_[p] ? (*heats_[p])[static_cast<size_t>(index)] : 0};
  }
  /// Writes a voxel of a page with ids, and its bits of the planes. Tell stir() of it.
  void put(PageId p, int index, const Cell& cell);
  void set_rich(PageId p) { tag_[p].rich = true; }  // not in a world of one kind
  const std::array<PageId, 27>* arounds() const { return around_.data(); }
  const uint64_t* hashes() const { return hash_.data(); }

  // ---- who is awake ----
  AwakeSet& awake(size_t rule) { return awake_[rule]; }
  /// Says that voxels of a page changed: it, and those neighbours to which one of them is near, will be awake for all
  /// rules. Takes effect in spread(); for different pages, from several threads at once. The page's neighbours are
  /// open.
  void stir(PageId p, const world::LeafMask& changed);
  /// Says that voxels of a page became warmer or colder: it will be awake for the rules that feel heat. As stir().
  void stir_heat(PageId p) {
    heated_[p] = heat_unsaved_[p] = 1;
    ++heat_changes_[p];
  }
  uint32_t heat_changes(PageId p) const { return heat_changes_[p]; }
  /// Rules that stir_heat() wakes, by rule.
  void set_feels_heat(std::vector<uint8_t> rules) { feels_heat_ = std::move(rules); }
  void spread();
  bool settled() const;

  // ---- the books ----
  /// Says that a rule made (above 0) or took away so much of a block: amounts of a fluid, kFullVoxel for a voxel of
  /// another. What only moves isn't booked. From several threads at once.
  void book(world::BlockId block, int64_t amount);
  struct Booked {
    int64_t in = 0, out = 0;  // both >= 0
  };
  Booked booked(world::BlockId block) const;
  /// put(), of something else than was there: both are booked, and so is the difference of their heats.
  void transmute(PageId p, int index, const Cell& cell);
  /// Says that heat came (above 0) or went, other than from a voxel to another. From several threads at once.
  void book_heat(int64_t units);
  Booked booked_heat() const { return booked_heat_; }

  // ---- the store ----
  /// Opens what others edited in the store, and wakes it, and what may move in regions that came. They edit after a
  /// flush(), before the next step. Returns whether there was anything.
  bool follow_edits();
  /// What the store told of: amounts by block, and units of heat.
  struct Told {
    std::map<world::BlockId, int64_t> amounts;
    int64_t heat = 0;
  };
  /// Writes voxels and boxes in order, whatever is unsaved: into pages, or where a box is large and none is open into
  /// the store; `told` gets what that changed in the store. What goes and what comes is booked, to the unit. Parts in
  /// regions that are away aren't written: they are added to `waiting`. All lies within the world's border.
  void edit(const world::EditBatch& batch, Told& told, std::map<world::RegionPos, world::EditBatch>& waiting);
  /// The region's blocks aren't in the store from now on: what is there is closed. Nothing of it is unsaved.
  void unload(world::RegionPos r);
  /// They are again: what may move there and beside goes on with the next follow_edits(). `also` as in wake_all().
  void load(world::RegionPos r, std::span<const uint8_t> also);
  /// Wakes all leaves in which something could move, or that hold one of `also`: at the start of a simulation.
  void wake_all(std::span<const uint8_t> also = {});  // by block
  /// Writes changed pages to the store. Returns 0 where there were none.
  size_t flush();
  /// Closes pages that no rule will look at; flush() first.
  void close_idle();
  // ---- for reports: slow ----
  world::BlockId block_at(world::VoxelPos v) const;
  int amount_at(world::VoxelPos v) const;  // of a fluid's voxel
  size_t bytes() const;

 private:
  struct Slots {
    std::array<PageId, world::kLeavesPerRegion> page{};
    int used = 0;
  };
  PageId allocate();
  void read(PageId p, const world::LeafBlocks& leaf);
  void reread(PageId p);
  void edit_page(PageId p, const world::VoxelBox& box, world::BlockId block);
  void book_leaf(world::LeafPos l, const world::VoxelBox& box, world::BlockId block, Told& told);
  bool may_move(const world::LeafBlocks& leaf, std::span<const uint8_t> also) const;
  void wake_arrived();
  void read_amounts(PageId p, world::Layer layer, Content content);
  void read_heats(PageId p);
  void write_heats(std::span<const PageId> pages);
  void write_amounts(std::span<const PageId> pages, world::Layer layer, Content content);
  void link(PageId p);
  void release(PageId p);
  void values_of(PageId p, std::span<world::BlockId, world::kLeafVoxels> into) const;

  world::Store& store_;
  uint64_t seed_;
  int32_t floor_leaf_;  // y of the lowest leaves
  int subscriber_;
  MatterTraits traits_;
  world::RegionTable<Slots> slots_;
  std::vector<world::LeafPos> pos_;
  std::vector<std::array<PageId, 27>> around_;
  std::vector<uint64_t> hash_;
  std::vector<uint32_t> version_, content_changes_, heat_changes_;
  std::vector<world::LeafMask> grain_, closed_, occupied_;
  std::vector<Tag> tag_;
  std::vector<uint8_t> ring_;               // its neighbours were opened
  std::vector<uint8_t> stirred_, unsaved_;  // since the last spread(), the last flush()
  std::vector<uint8_t> heated_;             // since the last spread()
  std::vector<uint8_t> heat_unsaved_;       // since the last flush(), beside what is unsaved_
  std::vector<uint8_t> feels_heat_;         // by rule
  std::vector<std::unique_ptr<Blocks>> blocks_;
  std::vector<std::unique_ptr<Amounts>> amounts_;
  std::vector<std::unique_ptr<Heats>> heats_;
  // Written once: all threads would wait for each other.
  void set_met_heat() {
    if (!met_heat_.load(std::memory_order_relaxed)) met_heat_.store(true, std::memory_order_relaxed);
  }
  uint64_t page_changes_ = 0;
  std::vector<PageId> free_;
  std::vector<AwakeSet> awake_;
  std::vector<AwakeSet*> spread_to_;  // those of rules that are called for
  void meet(world::BlockId id, Content content) {
    std::atomic_ref<uint8_t>(met_[id]).store(1, std::memory_order_relaxed);
    met_fluid_.store(true, std::memory_order_relaxed);
    if (content == Content::liquid) met_liquid_.store(true, std::memory_order_relaxed);
  }
  std::vector<uint8_t> met_;    // by block: fluids
  std::vector<Booked> booked_;  // by block
  Booked booked_heat_;
  std::set<world::RegionPos> away_;
  std::map<world::RegionPos, std::vector<uint8_t>> arrived_;  // since the last follow_edits(): what to wake there
  std::atomic<bool> met_liquid_{false}, met_fluid_{false}, met_rich_{false}, met_heat_{false};
  world::BlockId met_kind_ = kNoKind;
};

}  // namespace sim
