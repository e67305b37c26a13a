/// growth: grass spreads, saplings become trees, reeds, cacti and wheat grow, leaves decay that have lost their log.
/// What is what: sim/matter/plants.h.
///
///   grass    dirt under air beside grass, up to a step of one voxel, becomes grass
///   trees    the sapling is the growing tip: it leaves a log, and leaves around that, and goes up; a tree is as high
///   as
///            a hash of seed and place says. What is in its way stops it
///   reeds    up to three voxels on ground beside water; cacti without
///   wheat    onto farmland beside wheat's, with water within four voxels of it
///   leaves   more than six steps through leaves from any log become air
///
/// All but the last need light: nothing opaque but leaves in the column, 64 voxels up. (Levels of light aren't read:
/// they are found when a picture asks for them. So it is lit under a roof that is higher than that.)
///
/// A scene asks for it by name, else a landscape would never rest; where there is a sapling and nobody asked, trees
/// grow and nothing else. A leaf of voxels is looked at once in 16 ticks, and only while it holds something that may
/// change but for light; what happens is drawn by a hash of seed, voxel and tick. Events are few: they are applied one
/// after the other, in the order of their hashes.
#include <algorithm>
#include <bit>

#include "sim/matter/changed_voxels.h"
#include "sim/matter/matter.h"
#include "sim/matter/plants.h"
#include "sim/matter/sides.h"
#include "world/base/jobs.h"
#include "world/base/random.h"
#include "world/store/leaf_sets.h"
#include "world/store/leaf_shifts.h"

namespace sim {

namespace {

using world::BlockId;
using world::LeafMask;
using world::LeafPos;
using world::VoxelPos;

constexpr size_t kPagesATask = 16;
constexpr uint64_t kStream = 0x960;  // of random numbers: this rule's
constexpr uint64_t kLookTicks = 16;  // 0.8 s
constexpr int kLeafSteps = 6;        // from a log, that leaves live
constexpr int kSkyReach = 64;        // voxels
constexpr int kWaterReach = 4;       // of wheat
constexpr uint16_t kGrows = plant::dirt | plant::leaves | plant::sapling | plant::stalk | plant::farmland;
// One in so many looks, on average.
constexpr uint64_t kGrassLooks = 16, kTreeLooks = 8, kStalkLooks = 32, kWheatLooks = 32, kDecayLooks = 8;

enum class Event : uint8_t { grass, tree, stalk, wheat, decay };

struct Drawn {
  uint64_t hash;
  VoxelPos v;  // that becomes something else; of a tree, its tip
  Event event;
  BlockId block;  // stalk: which
};

/// What a page holds.
struct PlantPage {
  uint32_t content = 0;
  bool ready = false, listed = false, wanted = false;
  LeafPos pos;
  uint16_t bits = 0;  // of all its blocks
  LeafMask open, dirt, grass, farmland, wheat, leaves, log, sapling, stalk;
};

class Growth final : public Rule {
 public:
  explicit Growth(size_t rule) : rule_(rule) {}
  void start(Cells& cells, const MatterOptions& options) override;
  RuleReport step(Cells& cells, const Tick& tick) override;

 private:
  void prepare(const Cells& cells, PageId p);
  void prepare_all(Cells& cells, std::span<const PageId> pages);
  bool look(const Cells& cells, PageId p, const Tick& tick, std::vector<Drawn>& drawn) const;
  LeafMask far_leaves(const Cells& cells, PageId p) const;
  LeafMask beside_grass(const Cells& cells, PageId p) const;
  /// The block of a voxel near a page that is looked at.
  static BlockId at(const Cells& cells, VoxelPos v) {
    const LeafPos l = world::leaf_from_voxel(v);
    const PageId p = cells.find(l);
    return p == kClosedPage ? cells.store().leaf(l)[world::index_in_leaf(v)] : cells.block(p, world::index_in_leaf(v));
  }
  uint16_t bits_at(const Cells& cells, VoxelPos v) const { return plants_[at(cells, v)]; }
  bool is_lit(const Cells& cells, VoxelPos v) const;
  bool has_water_beside(const Cells& cells, VoxelPos v, int reach) const;
  bool may_stalk_grow(const Cells& cells, VoxelPos v, const StalkKind& kind) const;
  void set(Cells& cells, VoxelPos v, BlockId block);
  void apply(Cells& cells, const Drawn& drawn, const Tick& tick);
  void grow_tree(Cells& cells, VoxelPos tip, const Tick& tick);

  const size_t rule_;  // its awake set
  bool only_trees_ = false;
  PlantBlocks plants_;
  std::vector<PlantPage> pages_;
  std::vector<PageId> list_, looked_, stale_;
  std::vector<std::vector<Drawn>> drawn_;  // by looked_
  std::vector<uint8_t> may_;
  ChangedVoxels changed_;
};

/// Wakes what may grow.
void Growth::start(Cells& cells, const MatterOptions& options) {
  only_trees_ = std::find(options.effects.begin(), options.effects.end(), "growth") == options.effects.end();
  plants_.follow(cells.palette());
  const uint16_t wanted = only_trees_ ? uint16_t{plant::sapling} : kGrows;
  world::StoreReader reader(cells.store());
  for (const world::RegionPos& r : cells.store().regions())
    for (int i = 0; i < world::kLeavesPerRegion; ++i) {
      const LeafPos l = world::leaf_from_region(r) + world::leaf_offset_in_region(i);
      const world::LeafBlocks leaf = reader.leaf(l);
      const auto grows = [&](BlockId id) { return (plants_[id] & wanted) != 0; };
      if (leaf.values ? std::any_of(leaf.values, leaf.values + world::kLeafVoxels, grows) : grows(leaf.uniform))
        cells.awake(rule_).add(cells.open(l));
    }
}

void Growth::prepare(const Cells& cells, PageId p) {
  PlantPage& page = pages_[p];
  page.wanted = false;
  page.ready = true;
  page.content = cells.content_changes(p);
  page.pos = cells.pos(p);
  page.bits = 0;
  std::array<BlockId, world::kLeafVoxels> ids;
  cells.ids(p, ids);
  constexpr std::pair<uint16_t, LeafMask PlantPage::*> kMasks[] = {
      {plant::open, &PlantPage::open},   {plant::dirt, &PlantPage::dirt},
      {plant::grass, &PlantPage::grass}, {plant::farmland, &PlantPage::farmland},
      {plant::wheat, &PlantPage::wheat}, {plant::leaves, &PlantPage::leaves},
      {plant::log, &PlantPage::log},     {plant::sapling, &PlantPage::sapling},
      {plant::stalk, &PlantPage::stalk}};
  for (const auto& [bit, mask] : kMasks) page.*mask = {};
  for (int i = 0; i < world::kLeafVoxels; ++i) {
    const uint16_t bits = plants_[ids[static_cast<size_t>(i)]];
    page.bits |= bits;
    if (bits == 0) continue;
    for (const auto& [bit, mask] : kMasks)
      if (bits & bit) (page.*mask).set(i);
  }
}

void Growth::prepare_all(Cells& cells, std::span<const PageId> pages) {
  stale_.clear();
  for (const PageId p : pages) {
    PlantPage& page = pages_[p];
    if (p == kClosedPage || page.wanted) continue;
    if (page.ready && page.content == cells.content_changes(p) && page.pos == cells.pos(p)) continue;
    page.wanted = true;
    stale_.push_back(p);
  }
  world::parallel_ranges(stale_.size(), kPagesATask, [&](size_t begin, size_t end) {
    for (size_t n = begin; n < end; ++n) prepare(cells, stale_[n]);
  });
}

/// Leaves that no log holds any more: those that six steps through leaves from all logs don't reach. No such way leads
/// further than the 27 pages.
LeafMask Growth::far_leaves(const Cells& cells, PageId p) const {
  const std::array<PageId, 27>& around = cells.around(p);
  std::array<LeafMask, 27> reached, next;
  for (size_t k = 0; k < 27; ++k) reached[k] = pages_[around[k]].log;
  for (int step = 0; step < kLeafSteps; ++step) {
    for (int dx = 0; dx < 3; ++dx)
      for (int dy = 0; dy < 3; ++dy)
        for (int dz = 0; dz < 3; ++dz) {
          const auto k = static_cast<size_t>(dx * 9 + dy * 3 + dz);
          next[k] = reached[k];
          const LeafMask& leaves = pages_[around[k]].leaves;
          if (leaves.is_none()) continue;
          LeafMask touched;
          for (int face = 0; face < 6; ++face) {
            const VoxelPos d = world::face_step(face);
            const int x = dx + d.x, y = dy + d.y, z = dz + d.z;
            const bool inside = x >= 0 && x < 3 && y >= 0 && y < 3 && z >= 0 && z < 3;
            const LeafMask& beyond = inside ? reached[static_cast<size_t>(x * 9 + y * 3 + z)] : world::kNoneMask;
            touched = touched | world::across(reached[k], beyond, face);
          }
          next[k] = next[k] | (touched & leaves);
        }
    reached = next;
  }
  return world::without(pages_[p].leaves, reached[kSelf]);
}

/// Voxels with grass at one of their four sides, level or a step up or down.
LeafMask Growth::beside_grass(const Cells& cells, PageId p) const {
  const std::array<PageId, 27>& around = cells.around(p);
  const auto grass = [&](int dx, int dy, int dz) -> const LeafMask& {
    return pages_[around[static_cast<size_t>(around_index(dx, dy, dz))]].grass;
  };
  // Of a column of pages: what has grass level with it, above or below.
  const auto within_a_step = [&](int dx, int dz) {
    const LeafMask& level = grass(dx, 0, dz);
    return level | world::across(level, grass(dx, 1, dz), world::kFacePosY) |
           world::across(level, grass(dx, -1, dz), world::kFaceNegY);
  };
  const LeafMask own = within_a_step(0, 0);
  LeafMask beside;
  for (int side = 0; side < kSides; ++side)
    beside = beside | world::across(own, within_a_step(kSideStep[side].x, kSideStep[side].z), kSideFace[side]);
  return beside;
}

bool Growth::is_lit(const Cells& cells, VoxelPos v) const {
  for (int up = 1; up <= kSkyReach; ++up) {
    const VoxelPos w = v + VoxelPos{0, up, 0};
    if (!world::inside_world(w)) return true;
    if (!(bits_at(cells, w) & plant::passes)) return false;
  }
  return true;
}

/// Water beside a voxel, or within `reach` of it level with it.
bool Growth::has_water_beside(const Cells& cells, VoxelPos v, int reach) const {
  for (int dx = -reach; dx <= reach; ++dx)
    for (int dz = -reach; dz <= reach; ++dz)
      if (std::abs(dx) + std::abs(dz) <= reach && (bits_at(cells, v + VoxelPos{dx, 0, dz}) & plant::water)) return true;
  return false;
}

/// v: the stalk's top.
bool Growth::may_stalk_grow(const Cells& cells, VoxelPos v, const StalkKind& kind) const {
  VoxelPos base = v - VoxelPos{0, 1, 0};
  int height = 1;
  while (height < kind.height && at(cells, base) == kind.block) base.y -= 1, ++height;
  if (height >= kind.height || !(bits_at(cells, base) & plant::bears)) return false;
  return !kind.needs_water || has_water_beside(cells, base, 1);
}

/// Draws what happens in the page. Returns whether anything may, in light.
bool Growth::look(const Cells& cells, PageId p, const Tick& tick, std::vector<Drawn>& drawn) const {
  const PlantPage& page = pages_[p];
  const std::array<PageId, 27>& around = cells.around(p);
  const VoxelPos low = world::voxel_from_leaf(page.pos);
  bool may = false;
  const auto draw = [&](VoxelPos v, Event event, uint64_t looks, BlockId block = world::kAir) {
    may = true;
    const uint64_t hash =
        world::random_bits(tick.seed, v.x, v.y, v.z, tick.number, kStream + static_cast<uint64_t>(event));
    if (hash % looks == 0) drawn.push_back({world::mix64(hash), v, event, block});
  };
  const LeafMask under_air = world::across(page.open, pages_[around[kAbove]].open, world::kFacePosY);
  world::for_each_voxel(page.sapling, [&](int i) {
    const VoxelPos tip = low + world::offset_in_leaf(i);
    const TreeKind* tree = plants_.tree(at(cells, tip));
    if (!tree) return;
    const BlockId under = at(cells, tip - VoxelPos{0, 1, 0});
    if (under == tree->log || (plants_[under] & plant::bears)) draw(tip, Event::tree, kTreeLooks);
  });
  if (only_trees_) return may;
  if (!(page.dirt & under_air).is_none())
    world::for_each_voxel(page.dirt & under_air & beside_grass(cells, p),
                          [&](int i) { draw(low + world::offset_in_leaf(i), Event::grass, kGrassLooks); });
  world::for_each_voxel(page.stalk & under_air, [&](int i) {
    const VoxelPos v = low + world::offset_in_leaf(i);
    const StalkKind* kind = plants_.stalk(at(cells, v));
    if (kind && may_stalk_grow(cells, v, *kind)) draw(v + VoxelPos{0, 1, 0}, Event::stalk, kStalkLooks, kind->block);
  });
  world::for_each_voxel(page.farmland & under_air, [&](int i) {
    const VoxelPos v = low + world::offset_in_leaf(i), above = v + VoxelPos{0, 1, 0};
    const bool sown = std::any_of(kSideStep, kSideStep + kSides, [&](VoxelPos step) {
      return (bits_at(cells, above + step) & plant::wheat) && (bits_at(cells, v + step) & plant::farmland);
    });
    if (sown && has_water_beside(cells, v, kWaterReach)) draw(above, Event::wheat, kWheatLooks);
  });
  if (!page.leaves.is_none())
    world::for_each_voxel(far_leaves(cells, p),
                          [&](int i) { draw(low + world::offset_in_leaf(i), Event::decay, kDecayLooks); });
  return may;
}

void Growth::set(Cells& cells, VoxelPos v, BlockId block) {
  if (!world::inside_world(v)) return;
  const PageId p = cells.open(world::leaf_from_voxel(v));
  if (p == kClosedPage) return;
  const int i = world::index_in_leaf(v);
  cells.transmute(p, i, {.block = block, .heat = cells.cell(p, i).heat});
  changed_.add(cells, p, i);
}

/// A step of a tree: a log where the tip was, leaves around it, and the tip above; at the end, leaves.
void Growth::grow_tree(Cells& cells, VoxelPos tip, const Tick& tick) {
  const TreeKind& tree = *plants_.tree(at(cells, tip));
  constexpr VoxelPos kUp{0, 1, 0};
  int logs = 0;
  while (logs < tree.least_height + tree.heights && at(cells, tip - VoxelPos{0, logs + 1, 0}) == tree.log) ++logs;
  const VoxelPos base = tip - VoxelPos{0, logs, 0};
  const int height =
      tree.least_height + static_cast<int>(world::random_bits(tick.seed, base.x, base.y, base.z, 0, kStream + 16) %
                                           static_cast<uint64_t>(tree.heights));
  const auto leaves_around = [&](VoxelPos middle, int radius) {
    for (int dx = -radius; dx <= radius; ++dx)
      for (int dz = -radius; dz <= radius; ++dz) {
        const int steps = std::abs(dx) + std::abs(dz);
        const VoxelPos v = middle + VoxelPos{dx, 0, dz};
        if (steps > 0 && steps <= 2 * radius - 1 && at(cells, v) == world::kAir) set(cells, v, tree.leaves);
      }
  };
  if (logs >= height || at(cells, tip + kUp) != world::kAir) {
    set(cells, tip, tree.leaves);
    leaves_around(tip, 1);
    return;
  }
  set(cells, tip, tree.log);
  set(cells, tip + kUp, tree.sapling);
  const int below_top = height - 1 - logs;
  if (tree.cone) {
    if (logs >= 2) leaves_around(tip, below_top % 2 == 1 ? 2 : 1);
  } else if (below_top < 3) {
    leaves_around(tip, below_top == 0 ? 1 : 2);
  }
}

void Growth::apply(Cells& cells, const Drawn& drawn, const Tick& tick) {
  const VoxelPos v = drawn.v;
  const uint16_t now = bits_at(cells, v);  // another event may have been there
  switch (drawn.event) {
    case Event::grass:
      if ((now & plant::dirt) && is_lit(cells, v)) set(cells, v, plants_.grass());
      break;
    case Event::tree:
      if ((now & plant::sapling) && is_lit(cells, v)) grow_tree(cells, v, tick);
      break;
    case Event::stalk:
      if ((now & plant::open) && is_lit(cells, v)) set(cells, v, drawn.block);
      break;
    case Event::wheat:
      if ((now & plant::open) && is_lit(cells, v)) set(cells, v, plants_.wheat());
      break;
    case Event::decay:
      if (now & plant::leaves) set(cells, v, world::kAir);
      break;
  }
}

RuleReport Growth::step(Cells& cells, const Tick& tick) {
  RuleReport report;
  AwakeSet& set_awake = cells.awake(rule_);
  set_awake.begin();
  if (set_awake.now().empty()) return report;
  plants_.follow(cells.palette());
  // Awake pages, and those around what changed: leaves there may have lost a log.
  list_.assign(set_awake.now().begin(), set_awake.now().end());
  const size_t awake = list_.size();
  for (size_t n = 0; n < awake; ++n) cells.open_around(list_[n]);
  if (pages_.size() < cells.page_limit()) pages_.resize(cells.page_limit());
  for (size_t n = 0; n < awake; ++n) pages_[list_[n]].listed = true;
  for (size_t n = 0; n < awake; ++n) {
    const PlantPage& page = pages_[list_[n]];
    if (page.ready && page.content == cells.content_changes(list_[n]) && page.pos == cells.pos(list_[n])) continue;
    for (const PageId p : cells.around(list_[n])) {
      if (p == kClosedPage || pages_[p].listed) continue;
      pages_[p].listed = true;
      list_.push_back(p);
    }
  }
  for (const PageId p : list_) pages_[p].listed = false;
  prepare_all(cells, list_);
  // Those whose turn it is; others stay awake for it.
  const uint16_t wanted = only_trees_ ? uint16_t{plant::sapling} : kGrows;
  looked_.clear();
  for (const PageId p : list_) {
    if (!(pages_[p].bits & wanted)) continue;
    if ((tick.number + cells.hash(p)) % kLookTicks == 0)
      looked_.push_back(p);
    else
      set_awake.add(p);
  }
  std::vector<PageId> around;
  for (const PageId p : looked_) {
    cells.open_around(p);
    around.insert(around.end(), cells.around(p).begin(), cells.around(p).end());
  }
  if (pages_.size() < cells.page_limit()) pages_.resize(cells.page_limit());
  prepare_all(cells, around);
  if (drawn_.size() < looked_.size()) drawn_.resize(looked_.size());
  may_.assign(looked_.size(), 0);
  world::parallel_ranges(looked_.size(), kPagesATask, [&](size_t begin, size_t end) {
    for (size_t n = begin; n < end; ++n) {
      drawn_[n].clear();
      may_[n] = look(cells, looked_[n], tick, drawn_[n]);
    }
  });
  std::vector<Drawn> all;
  for (size_t n = 0; n < looked_.size(); ++n) {
    if (may_[n]) set_awake.add(looked_[n]);
    all.insert(all.end(), drawn_[n].begin(), drawn_[n].end());
  }
  std::sort(all.begin(), all.end(), [](const Drawn& a, const Drawn& b) { return a.hash < b.hash; });
  for (const Drawn& drawn : all) apply(cells, drawn, tick);
  report.voxels_changed += changed_.stir(cells);
  cells.spread();
  report.leaves_visited = looked_.size();
  report.bytes = pages_.capacity() * sizeof(PlantPage);
  return report;
}

}  // namespace

RuleInfo growth_info() {
  return {.name = "growth",
          .what = "grass spreads, saplings become trees, reeds and wheat grow, leaves without a log decay",
          .conserves = "nothing: what grows and decays is booked",
          .layers = "blocks",
          .calls = [](const world::Block& block) { return (plant_bits(block) & plant::sapling) != 0; }};
}
std::unique_ptr<Rule> make_growth_rule(size_t rule) { return std::make_unique<Growth>(rule); }

}  // namespace sim
