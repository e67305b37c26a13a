/// evaporation: liquids that boil to a gas by a row of reactions.toml (water, salt water) go from their surface into
/// the air. Only where a scene asks for it by name: a lake would never rest.
///
/// Under open air a surface loses 5 mm a day at 15 C, and elsewhere by the pressure of its saturated vapour; the days
/// are those of heat_speed. Below kSteamKelvin that is humidity that nobody sees: it is booked as out, and the heat for
/// it comes from the weather, which isn't modelled. From there on it is the gas of that row, in the voxel above, and
/// the liquid gives the heat of it, of the change and of what warms it.
///
/// A leaf is looked at in one tick of 16. Amounts are whole: the rest of a unit is drawn by a hash of seed, voxel,
/// tick. source John Dalton (the flux follows the vapour pressure). 1802; Oleg Alduchov, Robert Eskridge. Improved
///        Magnus Form Approximation of Saturation Vapor Pressure. 1996, eq. 21; 5 mm: a warm day's by a class A pan
#include <algorithm>
#include <cmath>
#include <memory>

#include "sim/matter/changed_voxels.h"
#include "sim/matter/gas_kernel.h"
#include "sim/matter/heat_plan.h"
#include "sim/matter/matter.h"
#include "sim/matter/thermal.h"
#include "world/base/jobs.h"
#include "world/base/random.h"
#include "world/store/leaf_sets.h"

namespace sim {

namespace {

using world::BlockId;
using world::LeafMask;

constexpr size_t kPagesATask = 32;
constexpr uint64_t kLookTicks = 16;
constexpr uint64_t kStream = 0xe7a;  // of random numbers: this rule's
constexpr double kMetresADay = 0.005, kSecondsADay = 86400;
constexpr double kSteamKelvin = 323.15;

/// Of water, over a flat surface; of its value at 288.15 K.
double vapour_pressure(double kelvin) {
  const auto magnus = [](double celsius) { return std::exp(17.625 * celsius / (celsius + 243.04)); };
  return magnus(std::clamp(kelvin - 273.15, -40.0, 120.0)) / magnus(15.0);
}

/// From a voxel of liquid to the air above it.
struct Vapour {
  uint16_t index, units;
  uint8_t row;
  bool is_gas;  // else humidity
};

class Evaporation final : public Rule {
 public:
  explicit Evaporation(size_t rule) : rule_(rule) {}
  RuleReport step(Cells& cells, const Tick& tick) override;

 private:
  struct Row {
    BlockId liquid, gas;
    double latent;     // units of heat that a full voxel takes up
    double expansion;  // of its volume
  };
  void read_rows(const Cells& cells, const Tick& tick);
  /// Returns whether the page has a surface.
  bool find(const Cells& cells, PageId p, const Tick& tick, std::vector<Vapour>& out) const;
  void apply(Cells& cells, PageId p, const Vapour& vapour);
  /// Beyond air at rest, in units of heat.
  double energy(const Cell& cell) const {
    const int amount = cell.block == world::kAir ? 0 : cell.amount;
    return static_cast<double>(cell.heat) +
           static_cast<double>((*thermal_)[cell.block].born) * thermal_->capacity(cell.block, amount);
  }

  const size_t rule_;  // its awake set
  std::unique_ptr<ThermalTraits> thermal_;
  std::vector<Row> rows_;
  std::vector<PageId> looked_;
  std::vector<uint8_t> may_;
  std::vector<std::vector<Vapour>> vapours_;  // by looked_
  ChangedVoxels changed_;
};

void Evaporation::read_rows(const Cells& cells, const Tick& tick) {
  thermal_ = std::make_unique<ThermalTraits>(cells.palette(), tick.options->reactions, tick.options->rest_k);
  for (const std::vector<Reaction>* all : {&standard_reactions().rows, &tick.options->reactions})
    for (const Reaction& row : *all) {
      const auto a = cells.palette().find(row.a), c = cells.palette().find(row.c);
      if (!row.b.empty() || row.when != Condition::from || row.heat_mj >= 0 || !a || !c) continue;
      const world::Block &liquid = cells.palette()[*a], &gas = cells.palette()[*c];
      if (liquid.phase != world::Phase::liquid || gas.phase != world::Phase::gas) continue;
      rows_.push_back({*a, *c, -row.heat_mj * 1e6 / kHeatUnitJ, liquid.density.value / gas.density.value});
    }
}

bool Evaporation::find(const Cells& cells, PageId p, const Tick& tick, std::vector<Vapour>& out) const {
  const BlockId* ids = cells.find_blocks(p);
  if (!ids) return false;
  bool any = false;
  const double seconds = static_cast<double>(kLookTicks) / kHeatTicksPerSecond *
                         std::max(static_cast<double>(tick.options->knobs.heat_speed), 0.0);
  const double units = kMetresADay / kSecondsADay * seconds * kFullVoxel;
  const PageId above = cells.around(p)[kAbove];
  for (size_t r = 0; r < rows_.size(); ++r) {
    const Row& row = rows_[r];
    world::for_each_voxel(mask_of(ids, row.liquid), [&](int i) {
      const bool top = (i & 56) == 56;
      if ((top ? cells.block(above, i - 56) : ids[i + 8]) != world::kAir || (top && above == kClosedPage)) return;
      any = true;
      const Cell cell = cells.cell(p, i);
      const double kelvin =
          static_cast<double>(temperature(thermal_->voxel(cell.block, cell.amount), cell.heat)) + thermal_->rest_k();
      const world::VoxelPos v = world::voxel_from_leaf(cells.pos(p)) + world::offset_in_leaf(i);
      const uint64_t random = world::random_bits(tick.seed, v.x, v.y, v.z, tick.number, kStream);
      const double wanted = units * vapour_pressure(kelvin) + world::uniform01_double(random);
      const int goes = static_cast<int>(std::min(wanted, static_cast<double>(cell.amount)));
      const bool is_gas = kelvin >= kSteamKelvin;
      if (goes > 0)
        out.push_back({static_cast<uint16_t>(i), static_cast<uint16_t>(goes), static_cast<uint8_t>(r), is_gas});
    });
  }
  return any;
}

void Evaporation::apply(Cells& cells, PageId p, const Vapour& vapour) {
  const Row& row = rows_[vapour.row];
  const int i = vapour.index;
  Cell liquid = cells.cell(p, i);
  int goes = vapour.units;
  if (vapour.is_gas) {
    const bool top = (i & 56) == 56;
    const PageId q = top ? cells.around(p)[kAbove] : p;
    const int j = top ? i - 56 : i + 8;
    const Cell air = cells.cell(q, j);
    // As warm as the liquid. What it is to hold must fit.
    goes = std::min(goes, static_cast<int>(65534 / row.expansion));
    if (goes == 0) goes = 1;
    Cell gas{.block = row.gas};
    gas.amount = static_cast<uint16_t>(std::min(std::lround(goes * row.expansion), 65534l));
    const double kelvin = static_cast<double>(temperature(thermal_->voxel(liquid.block, liquid.amount), liquid.heat)) +
                          thermal_->rest_k();
    gas.heat = static_cast<int32_t>(thermal_->heat_at(row.gas, gas.amount, kelvin));
    const double taken = energy(gas) - energy(air) + row.latent * goes / kFullVoxel;
    const int32_t before = liquid.heat;
    liquid.heat = static_cast<int32_t>(
        std::clamp(static_cast<double>(liquid.heat) - std::round(taken), INT32_MIN / 2.0, INT32_MAX / 2.0));
    cells.book_heat(int64_t{liquid.heat} - before);
    cells.transmute(q, j, gas);
    cells.stir_heat(p), cells.stir_heat(q);
    changed_.add(cells, q, j);
  }
  cells.book(row.liquid, -goes);
  liquid.amount = static_cast<uint16_t>(liquid.amount - goes);
  // What was in it stays in the air.
  if (liquid.amount == 0) liquid.block = world::kAir;
  cells.put(p, i, liquid);
  changed_.add(cells, p, i);
}

RuleReport Evaporation::step(Cells& cells, const Tick& tick) {
  RuleReport report;
  AwakeSet& set = cells.awake(rule_);
  set.begin();
  if (!thermal_) read_rows(cells, tick);
  thermal_->follow();
  looked_.clear();
  for (const PageId p : set.now()) {
    const BlockId* ids = cells.find_blocks(p);
    if (!ids) continue;
    if (std::none_of(rows_.begin(), rows_.end(), [&](const Row& row) { return !mask_of(ids, row.liquid).is_none(); }))
      continue;
    if ((tick.number + cells.hash(p)) % kLookTicks == 0)
      looked_.push_back(p);
    else
      set.add(p);
  }
  for (const PageId p : looked_) cells.open_around(p);
  if (vapours_.size() < looked_.size()) vapours_.resize(looked_.size());
  may_.assign(looked_.size(), 0);
  world::parallel_ranges(looked_.size(), kPagesATask, [&](size_t begin, size_t end) {
    for (size_t n = begin; n < end; ++n) {
      vapours_[n].clear();
      may_[n] = find(cells, looked_[n], tick, vapours_[n]);
    }
  });
  // No voxel of air is above two of liquid: in any order.
  for (size_t n = 0; n < looked_.size(); ++n) {
    if (may_[n]) set.add(looked_[n]);
    for (const Vapour& vapour : vapours_[n]) apply(cells, looked_[n], vapour);
  }
  report.voxels_changed += changed_.stir(cells);
  cells.spread();
  report.leaves_visited = looked_.size();
  return report;
}

}  // namespace

RuleInfo evaporation_info() {
  return {.name = "evaporation",
          .what = "water and salt water go into the air from their surfaces",
          .conserves = "nothing: what becomes humidity or steam is booked",
          .layers = "blocks, liquid, gas, heat",
          .calls = [](const world::Block&) { return false; }};
}
std::unique_ptr<Rule> make_evaporation_rule(size_t rule) { return std::make_unique<Evaporation>(rule); }

}  // namespace sim
