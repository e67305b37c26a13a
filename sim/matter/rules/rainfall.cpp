/// rainfall: a liquid that comes down below a box of the sky, as the scene's [[particles]] say that bring one. So much
/// a tick as they say, in drops of kDrop units on columns by chance; each is put onto the first solid, grain or liquid
/// below the middle of the sky, and booked as made. Drops fall at once: those that are seen are particles, and bring
/// nothing.
///
/// cost   a look down a column a drop, some 40 ns a leaf of air
/// error  no wind: drops come down straight. A drop is lost, and not booked, over a hole in the world, or where another
///        gas than air or another liquid fills the place
#include "sim/clock.h"
#include "sim/matter/matter.h"
#include "world/base/random.h"

namespace sim {

namespace {

using world::BlockId;
using world::LeafPos;
using world::VoxelPos;

constexpr int kDrop = 64;  // units of 1/4096 m^3: a film of 16 mm on its voxel, 16 litres
constexpr uint64_t kStream = 0x7a19;

class Rainfall final : public Rule {
 public:
  explicit Rainfall(size_t rule) : rule_(rule) {}

  void start(Cells& cells, const MatterOptions& options) override { stay_awake(cells, options); }

  RuleReport step(Cells& cells, const Tick& tick) override {
    RuleReport report;
    cells.awake(rule_).begin();
    const std::vector<world::ParticleSource>& sources = tick.options->sources;
    for (size_t s = 0; s < sources.size(); ++s) {
      const auto liquid = cells.palette().find(sources[s].brings);
      if (!liquid || cells.traits()[*liquid].content != Content::liquid) continue;
      const world::VoxelBox& box = sources[s].box;
      const VoxelPos size = box.max - box.min + VoxelPos{1, 1, 1};
      const double m3_per_s = sources[s].mm_per_h * 1e-3 / 3600 * size.x * size.z;
      const double drops = m3_per_s * kMatterTick.seconds() * kFullVoxel / kDrop;
      const uint64_t count = due_in_tick(std::min(drops, kMostDrops), tick.number);
      for (uint64_t k = 0; k < count; ++k) {
        const uint64_t r =
            world::random_bits(tick.seed, static_cast<int64_t>(s), static_cast<int64_t>(k), 0, tick.number, kStream);
        const auto along = [](uint64_t bits, int32_t voxels) {
          return static_cast<int32_t>(((bits & 0xffffffff) * static_cast<uint64_t>(voxels)) >> 32);
        };
        const VoxelPos from{box.min.x + along(r, size.x), box.max.y, box.min.z + along(r >> 32, size.z)};
        report.voxels_changed += fall(cells, from, *liquid);
      }
      report.leaves_visited += count;
    }
    cells.spread();
    stay_awake(cells, *tick.options);
    return report;
  }

 private:
  static constexpr double kMostDrops = 1e6;  // a tick

  /// It rains in the next tick, too.
  void stay_awake(Cells& cells, const MatterOptions& options) {
    for (const world::ParticleSource& source : options.sources)
      if (!source.brings.empty() && source.mm_per_h > 0)
        cells.awake(rule_).add(cells.open(world::leaf_from_voxel(source.box.min)));
  }

  static Content content_at(const Cells& cells, PageId p, const world::LeafBlocks& leaf, int i) {
    return cells.traits()[p == kClosedPage ? leaf[i] : cells.block(p, i)].content;
  }

  /// A drop down the column below v; false where it is lost.
  static bool fall(Cells& cells, VoxelPos v, BlockId liquid) {
    const int32_t floor = cells.floor_y();
    while (v.y >= floor) {
      const LeafPos l = world::leaf_from_voxel(v);
      const PageId p = cells.find(l);
      const world::LeafBlocks leaf = p == kClosedPage ? cells.store().leaf(l) : world::LeafBlocks{};
      if (p == kClosedPage && !leaf.values && leaf.uniform == world::kAir) {
        v.y = world::voxel_from_leaf(l).y - 1;
        continue;
      }
      const Content content = content_at(cells, p, leaf, world::index_in_leaf(v));
      if (content == Content::empty || content == Content::gas) {
        --v.y;
        continue;
      }
      if (content == Content::liquid && pour(cells, v, liquid)) return true;
      return pour(cells, v + VoxelPos{0, 1, 0}, liquid);
    }
    return false;
  }

  /// Adds a drop to a voxel of air, or to one of the same liquid that has room.
  static bool pour(Cells& cells, VoxelPos v, BlockId liquid) {
    const PageId p = cells.open(world::leaf_from_voxel(v));
    const int i = world::index_in_leaf(v);
    if (p == kClosedPage) return false;
    Cell cell = cells.cell(p, i);
    if (cell.block == world::kAir)
      cell.block = liquid, cell.amount = 0;
    else if (cell.block != liquid || cell.amount + kDrop > kFullVoxel)
      return false;
    cell.amount = static_cast<uint16_t>(cell.amount + kDrop);
    cells.put(p, i, cell);
    cells.book(liquid, kDrop);
    cells.open_around(p);
    world::LeafMask changed;
    changed.set(i);
    cells.stir(p, changed);
    return true;
  }

  const size_t rule_;  // its awake set
};

}  // namespace

RuleInfo rainfall_info() {
  return {.name = "rainfall",
          .what = "a liquid comes down from the sky, as much as the scene says",
          .conserves = "nothing: the liquid that it brings is booked",
          .layers = "blocks, liquid",
          .calls = [](const world::Block&) { return false; }};
}
std::unique_ptr<Rule> make_rainfall_rule(size_t rule) { return std::make_unique<Rainfall>(rule); }

}  // namespace sim
