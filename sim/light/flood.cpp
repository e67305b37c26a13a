#include "sim/light/flood.h"

#include <algorithm>

#include "sim/light/field_flood.h"

namespace sim {

using world::LeafPos;
using world::LightModel;
using world::RegionPos;

namespace {

bool holds_blocks(const world::LeafBlocks& leaf) {
  if (!leaf.values) return leaf.uniform != world::kAir;
  return std::any_of(leaf.values, leaf.values + world::kLeafVoxels, [](world::BlockId b) { return b != world::kAir; });
}

std::vector<BlockOptics> of_band(const LightRules& rules, LightModel model, size_t band) {
  if (model == LightModel::flood4) return rules.all_bands;
  std::vector<BlockOptics> by_block;
  for (const auto& bands : rules.bands) by_block.push_back(bands[band]);
  return by_block;
}

}  // namespace

FloodLight::FloodLight(const world::Store& store, LightModel model)
    : FloodLight(store, model, light_rules(store.palette())) {
  own_rules_ = true;
}

FloodLight::FloodLight(const world::Store& store, LightModel model, LightRules rules)
    : store_(store),
      subscriber_(store.subscribe()),
      own_rules_(false),
      rules_(std::move(rules)),
      volume_(model, rules_.sky_level, rules_.filters_colour()),
      workers_(std::make_unique<FloodWorkers>()) {
  CHECK(model != LightModel::none);
}

FloodLight::~FloodLight() = default;

LightReport FloodLight::compute() {
  changed_.clear();
  changed_.all = true;
  store_.take_dirty(subscriber_);
  follow_palette();
  if (rules_.filters_colour() && volume_.model() == LightModel::flood_rgb && &volume_.sky(0) == &volume_.sky(1))
    volume_ = world::LightVolume(volume_.model(), rules_.sky_level, true);
  LightReport report;
  const std::vector<RegionPos> regions = store_.regions();
  for (const RegionPos& r : domain_.with_blocks())
    if (!std::binary_search(regions.begin(), regions.end(), r)) domain_.set_blocks(r, false);
  for (const RegionPos& r : regions) domain_.set_blocks(r, true);
  domain_.change();
  const bool rgb = volume_.model() == LightModel::flood_rgb;
  fields_.clear();
  optics_.clear();
  for (size_t band = 0; band < (rgb ? 3u : 1u); ++band)
    optics_.push_back(std::make_unique<OpticsVolume>(store_, of_band(rules_, volume_.model(), band)));
  for (int band = 0; band < (rgb ? 3 : 1); ++band) {
    const OpticsVolume& optics = *optics_[static_cast<size_t>(band)];
    if (band == 0 || &volume_.sky(band) != &volume_.sky(0))
      fields_.push_back(
          std::make_unique<FieldFlood>(domain_, optics, volume_.sky(band), *workers_, volume_.sky_level(), true));
    fields_.push_back(
        std::make_unique<FieldFlood>(domain_, optics, volume_.block(band), *workers_, volume_.sky_level(), false));
  }
  for (auto& field : fields_) field->compute(report);
  computed_ = true;
  return report;
}

bool FloodLight::has_blocks(RegionPos r, const std::vector<LeafPos>& dirty) const {
  if (store_.masks(world::MaskKind::opaque).region(r)) return true;
  const LeafPos first = leaf_from_region(r);
  for (auto l = std::lower_bound(dirty.begin(), dirty.end(), first); l != dirty.end() && l->x < first.x + 16; ++l)
    if (region_from_leaf(*l) == r && holds_blocks(store_.leaf(*l))) return true;
  return !store_.region_census(r).empty();
}

LightReport FloodLight::update() {
  if (!computed_) return compute();
  changed_.clear();
  LightReport report;
  const std::vector<LeafPos> dirty = store_.take_dirty(subscriber_);
  for (size_t i = 0; i < dirty.size(); ++i) {
    const RegionPos r = region_from_leaf(dirty[i]);
    if (i == 0 || r != region_from_leaf(dirty[i - 1])) domain_.set_blocks(r, has_blocks(r, dirty));
  }
  const DomainChange change = domain_.change();
  if (dirty.empty() && change.empty()) return report;
  if (rules_.bands.size() < store_.palette().size()) {
    const bool was_filtered = rules_.filters_colour();
    follow_palette();
    if (rules_.filters_colour() != was_filtered) return compute();
    for (size_t band = 0; band < optics_.size(); ++band)
      optics_[band]->set_blocks(of_band(rules_, volume_.model(), band));
  }
  for (auto& optics : optics_) optics->update(dirty);
  inside_.clear();
  for (const LeafPos& l : dirty)
    if (domain_.contains(region_from_leaf(l))) inside_.push_back(l);
  for (const auto* regions : {&change.added, &change.removed})
    changed_.regions.insert(changed_.regions.end(), regions->begin(), regions->end());
  for (auto& field : fields_) field->update(inside_, change, report, changed_.leaves);
  return report;
}

void FloodLight::follow_palette() {
  if (!own_rules_) CHECK_LE(store_.palette().size(), rules_.all_bands.size());
  for (size_t id = rules_.bands.size(); id < store_.palette().size(); ++id) {
    rules_.bands.push_back(optics_of(store_.palette()[static_cast<world::BlockId>(id)]));
    rules_.all_bands.push_back(brightest(rules_.bands.back()));
  }
}

void FloodLight::set_unloaded(RegionPos r, bool unloaded) { domain_.set_unloaded(r, unloaded); }

size_t FloodLight::bytes() const {
  size_t total = volume_.bytes();
  for (const auto& optics : optics_) total += optics->bytes();
  return total + workers_->bytes();
}

}  // namespace sim
