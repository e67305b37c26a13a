#include "sim/matter/matter.h"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <sstream>
#include <utility>

#include "sim/matter/thermal.h"
#include "world/base/errors.h"
#include "world/base/random.h"

namespace sim {

#define RULE(name)        \
  RuleInfo name##_info(); \
  std::unique_ptr<Rule> make_##name##_rule(size_t rule);
#include "sim_matter_rules.list.h"
#undef RULE

const std::vector<RuleRow>& rule_rows() {
  static const std::vector<RuleRow> rows = {
#define RULE(name) {name##_info(), make_##name##_rule},
#include "sim_matter_rules.list.h"
#undef RULE
  };
  return rows;
}

struct Matter::Running {
  std::unique_ptr<Rule> rule;  // null: not called for
  std::string why;
  uint64_t leaves_visited = 0, voxels_changed = 0;
  double ms = 0;
  size_t bytes = 0;
  std::vector<std::string> notes;
};

namespace {

constexpr const char* kBodiesState = "bodies";  // the part of a world's state that is theirs
constexpr const char* kRulesState = "rules";    // and the names of the rules that ran
constexpr const char* kRanWhenSaved = "it ran when the world was saved";

/// Calls visit(block, voxel, value) for the active voxels of a layer of integers.
template <class Visit>
void for_each_active(const world::Store& store, world::Layer layer, Visit visit) {
  const world::IntLayer* values = store.find_int_layer(layer);
  if (!values) return;
  std::array<int32_t, world::kLeafVoxels> value;
  world::LeafMask active;
  for (const world::LeafPos& l : values->leaves()) {
    if (!values->read_leaf(l, value, active)) continue;
    const world::LeafBlocks leaf = store.leaf(l);
    for (int i = 0; i < world::kLeafVoxels; ++i)
      if (active.test(i))
        visit(leaf[i], world::voxel_from_leaf(l) + world::offset_in_leaf(i), value[static_cast<size_t>(i)]);
  }
}

/// A world stands on the floor of its lowest region: what falls off its edge doesn't fall for ever.
int32_t floor_of(const world::World& world) {
  int32_t lowest = INT32_MAX;
  for (const world::RegionPos& r : world.store.regions()) lowest = std::min(lowest, r.y);
  return lowest == INT32_MAX ? 0 : lowest * world::kRegionSize;
}

/// Rules that ran when the world was saved. What called for one may be gone, as the fire whose heat still spreads.
std::vector<std::string> rules_that_ran(const world::World& world) {
  const auto at = world.simulation.state.find(kRulesState);
  if (at == world.simulation.state.end()) return {};
  std::istringstream names(at->second);
  return {std::istream_iterator<std::string>(names), {}};
}

bool holds(const std::vector<std::string>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool brings_rain(const world::World& world) {
  const std::vector<world::ParticleSource>& sources = world.simulation.particles;
  return std::any_of(sources.begin(), sources.end(), [](const auto& source) { return !source.brings.empty(); });
}

}  // namespace

std::vector<EffectReport> called_rules(const world::World& world) {
  std::vector<EffectReport> all;
  const world::Census census = world.store.census();
  const std::vector<std::string> ran = rules_that_ran(world);
  for (const RuleRow& row : rule_rows()) {
    EffectReport report;
    report.name = row.info.name;
    report.why = "no block calls for it, and the scene doesn't ask";
    uint64_t voxels = 0;
    for (const auto& [id, count] : census) {
      const world::Block& block = (*world.palette)[id];
      if (!row.info.calls(block)) continue;
      if (voxels == 0) report.why = block.name;
      report.called_for = true;
      voxels += count;
      if (voxels > count && !report.why.ends_with(" and others")) report.why += " and others";
    }
    std::vector<std::string> asked = world.simulation.effects;
    if (brings_rain(world)) asked.push_back("rainfall");
    if (report.called_for) {
      report.why += ", " + std::to_string(voxels) + " voxels";
    } else if (holds(asked, report.name)) {
      report.called_for = true;
      report.why = "the scene asks for it";
    } else if (holds(ran, report.name)) {
      report.called_for = true;
      report.why = kRanWhenSaved;
    }
    all.push_back(std::move(report));
  }
  return all;
}

Matter::Matter(world::World& world, const MatterOptions& options)
    : world_(world),
      options_(options),
      tick_(options.tick),
      subscriber_(world.store.subscribe()),
      ran_(rules_that_ran(world)),
      rules_(rule_rows().size()) {
  options_.sources = world.simulation.particles;
  if (brings_rain(world)) options_.effects.push_back("rainfall");
  options_.rest_k = world.environment.temperature.value;
  call_rules();
  flush();
  start_ = stored();
  flushed_ = start_;
}
Matter::~Matter() = default;

void Matter::make_cells() {
  if (cells_) return;
  cells_ = std::make_unique<Cells>(world_.store, options_.seed, rule_rows().size(), floor_of(world_), subscriber_);
  for (size_t r = 0; r < rules_.size(); ++r) cells_->awake(r).set_called(rules_[r].rule != nullptr);
  for (const world::RegionPos& r : away_) cells_->unload(r);
}

world::Status Matter::begin() {
  for (const std::string& effect : options_.effects) {
    const std::vector<RuleRow>& rows = rule_rows();
    if (std::any_of(rows.begin(), rows.end(), [&](const RuleRow& row) { return row.info.name == effect; })) continue;
    std::string names;
    for (const RuleRow& row : rows) names += (names.empty() ? "" : ", ") + std::string(row.info.name);
    return world::input_error("[simulation] effects: there is no rule \"" + effect + "\"; there are " + names);
  }
  for (const std::string& name : ran_)
    if (std::none_of(rule_rows().begin(), rule_rows().end(), [&](const RuleRow& row) { return row.info.name == name; }))
      return world::input_error("the saved world names a rule \"" + name + "\" that this program doesn't have");
  for (const world::ParticleSource& source : options_.sources) {
    if (source.brings.empty()) continue;
    const auto block = world_.palette->find(source.brings);
    if (!block || (*world_.palette)[*block].phase != world::Phase::liquid)
      return world::input_error("[[particles]]: brings = \"" + source.brings + "\", which is no block that is liquid");
  }
  TRY(inhabitants_, Inhabitants::make(world_, options_.knobs, options_.seed));
  const std::map<std::string, std::string>& state = world_.simulation.state;
  for (size_t r = 0; r < rules_.size(); ++r)
    if (const auto at = state.find(std::string(rule_rows()[r].info.name)); rules_[r].rule && at != state.end())
      TRY_STATUS(rules_[r].rule->restore(*cells_, at->second));
  if (const auto at = state.find(kBodiesState); inhabitants_ && at != state.end())
    TRY_STATUS(inhabitants_->restore(at->second));
  for (const world::RegionPos& r : away_)
    if (inhabitants_) inhabitants_->set_unloaded(r, true);
  return {};
}

void Matter::save_state() {
  flush();
  std::map<std::string, std::string>& state = world_.simulation.state;
  state.clear();
  const auto keep = [&](std::string_view name, std::string text) {
    if (!text.empty()) state[std::string(name)] = std::move(text);
  };
  std::string ran;
  for (size_t r = 0; r < rules_.size(); ++r) {
    if (!rules_[r].rule) continue;
    keep(rule_rows()[r].info.name, rules_[r].rule->state());
    ran += (ran.empty() ? "" : " ") + std::string(rule_rows()[r].info.name);
  }
  keep(kRulesState, ran);
  if (inhabitants_) keep(kBodiesState, inhabitants_->state());
}

/// Makes the rules that are called for now and weren't.
void Matter::call_rules() {
  const std::vector<RuleRow>& rows = rule_rows();
  std::vector<size_t> made;
  std::vector<world::BlockId> present;
  for (const auto& [id, count] : world_.store.census()) present.push_back(id);
  // What rules made since.
  for (size_t id = 0; cells_ && id < world_.palette->size(); ++id)
    if (cells_->booked(static_cast<world::BlockId>(id)).in > 0) present.push_back(static_cast<world::BlockId>(id));
  // Of the scene's own rows, where their partner is there too.
  const auto is_present = [&](const std::string& name) {
    const auto id = world_.palette->find(name);
    return id && std::find(present.begin(), present.end(), *id) != present.end();
  };
  const auto reacts = [&](world::BlockId id) {
    return std::any_of(options_.reactions.begin(), options_.reactions.end(), [&](const Reaction& row) {
      const bool partner = row.b.empty() || row.b == (*world_.palette)[world::kAir].name || is_present(row.b);
      return row.a == (*world_.palette)[id].name && partner;
    });
  };
  for (size_t r = 0; r < rows.size(); ++r) {
    Running& running = rules_[r];
    if (running.rule || holds(options_.without, rows[r].info.name)) continue;
    const auto calls = [&](world::BlockId id) {
      return rows[r].info.calls((*world_.palette)[id]) || (rows[r].info.reacts && reacts(id));
    };
    for (const world::BlockId id : present)
      if (calls(id)) {
        running.why = (*world_.palette)[id].name;
        running.rule = rows[r].make(r);
        break;
      }
    const bool asked = holds(options_.effects, rows[r].info.name);
    if (!running.rule && (asked || holds(ran_, rows[r].info.name))) {
      running.why = asked ? "the scene asks for it" : kRanWhenSaved;
      running.rule = rows[r].make(r);
    }
    if (running.rule) made.push_back(r);
  }
  if (made.empty()) return;
  make_cells();
  std::vector<uint8_t> feels_heat;
  bool any_feels_heat = false;
  for (size_t r = 0; r < rows.size(); ++r) {
    feels_heat.push_back(rules_[r].rule != nullptr && rows[r].info.feels_heat);
    any_feels_heat |= feels_heat.back() != 0;
  }
  cells_->set_feels_heat(std::move(feels_heat));
  for (size_t r = 0; r < rows.size(); ++r) cells_->awake(r).set_called(rules_[r].rule != nullptr);
  out_of_rest_ = any_feels_heat ? blocks_out_of_rest(*world_.palette, options_.rest_k) : std::vector<uint8_t>{};
  // What a scene's rows name needn't move to react.
  for (const Reaction& row : options_.reactions)
    for (const std::string* name : {&row.a, &row.b})
      if (const auto id = world_.palette->find(*name); id && *id != world::kAir) {
        out_of_rest_.resize(world_.palette->size(), 0);
        out_of_rest_[*id] = 1;
      }
  flush();  // what is awake is found in the store
  cells_->wake_all(out_of_rest_);
  for (const size_t r : made) rules_[r].rule->start(*cells_, options_);
}

/// What others put in and took out of the store since it was last written, and what came and went with regions.
void Matter::note_edits() {
  const Stored now = stored(), before = flushed_ ? *flushed_ : booked();
  std::map<world::BlockId, int64_t> change = now.amounts;
  for (const auto& [block, amount] : before.amounts) change[block] -= amount;
  for (const auto& [block, amount] : change) (amount > 0 ? edited_[block].in : edited_[block].out) += std::abs(amount);
  const int64_t heat = now.heat - before.heat;
  (heat > 0 ? edited_heat_.in : edited_heat_.out) += std::abs(heat);
  flushed_ = now;
  call_rules();
}

void Matter::apply(const std::vector<world::EditBatch>& batches) {
  Cells::Told told;
  for (const world::EditBatch& batch : batches) cells_->edit(batch, told, waiting_);
  for (const auto& [block, amount] : told.amounts)
    if (flushed_) flushed_->amounts[block] += amount;
  if (flushed_) flushed_->heat += told.heat;
  closed_ = false;
  call_rules();
}

void Matter::set_unloaded(world::RegionPos r, bool unloaded) {
  if (unloaded ? !away_.insert(r).second : away_.erase(r) == 0) return;
  if (inhabitants_) inhabitants_->set_unloaded(r, unloaded);
  closed_ = false;
  if (const auto waits = waiting_.find(r); !unloaded && waits != waiting_.end()) {
    arrived_.push_back(std::move(waits->second));
    waiting_.erase(waits);
  }
  if (!cells_) return;
  if (unloaded) {
    flush();
    cells_->unload(r);
  } else {
    cells_->load(r, out_of_rest_);
  }
}

StepReport Matter::step() {
  const Tick tick{tick_++, options_.seed, &options_};
  const StepReport report = step_rules(tick);
  if (inhabitants_) {
    // They live in the store's blocks. What the store holds isn't counted for that: the books say.
    if (cells_ && cells_->flush() > 0) flushed_.reset();
    inhabitants_->step(tick.number);
  }
  return report;
}

StepReport Matter::step_rules(const Tick& tick) {
  StepReport report;
  std::vector<world::EditBatch> batches = std::exchange(arrived_, {});
  for (world::EditBatch& batch : edits_.take(tick.number)) batches.push_back(std::move(batch));
  if (!cells_) {
    // Nothing is called for: only an edit changes that.
    if (!world_.store.take_dirty(subscriber_).empty()) note_edits();
    if (!cells_ && batches.empty()) return report;
    make_cells();
  } else if (cells_->follow_edits()) {
    note_edits();
  }
  if (!batches.empty()) apply(batches);
  if (cells_->settled()) {
    close();
    return report;
  }
  closed_ = false;
  for (size_t r = 0; r < rules_.size(); ++r) {
    Running& running = rules_[r];
    if (!running.rule || cells_->awake(r).empty()) continue;
    const auto start = std::chrono::steady_clock::now();
    const RuleReport done = running.rule->step(*cells_, tick);
    running.ms += std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    running.leaves_visited += done.leaves_visited;
    running.voxels_changed += done.voxels_changed;
    running.bytes = std::max(running.bytes, done.bytes);
    if (!done.notes.empty()) running.notes = done.notes;
    report.leaves_visited += done.leaves_visited;
    report.voxels_changed += done.voxels_changed;
  }
  // What rules made may call for others: ash falls, steam rises.
  size_t made = 0;
  for (size_t id = 0; id < world_.palette->size(); ++id) made += cells_->booked(static_cast<world::BlockId>(id)).in > 0;
  if (made != made_kinds_) {
    made_kinds_ = made;
    call_rules();
  }
  if (cells_->settled()) close();
  return report;
}

/// Writes everything back and holds nothing, once all is at rest.
void Matter::close() {
  if (closed_) return;
  closed_ = true;
  flush();
  cells_->close_idle();
}

void Matter::wake_all() {
  if (cells_) cells_->wake_all();
}

bool Matter::settled() const {
  const bool rests = !cells_ || cells_->settled();
  return rests && edits_.waiting() == 0 && arrived_.empty() && !(inhabitants_ && inhabitants_->awake());
}

size_t Matter::awake_leaves() const {
  if (!cells_) return 0;
  std::vector<PageId> all;
  for (size_t r = 0; r < rules_.size(); ++r)
    if (rules_[r].rule) all.insert(all.end(), cells_->awake(r).next().begin(), cells_->awake(r).next().end());
  std::sort(all.begin(), all.end());
  return static_cast<size_t>(std::unique(all.begin(), all.end()) - all.begin());
}

void Matter::flush() {
  if (cells_ && cells_->flush() > 0) flushed_ = stored();
}

uint64_t Matter::state_hash() {
  flush();
  uint64_t layers = 0;  // a sum of hashes of voxels: in any order
  for (const world::LayerRow& row : world::layer_rows()) {
    if (!row.is_integer) continue;
    const world::Layer layer = *world::layer_from_name(row.name);
    for_each_active(world_.store, layer, [&](world::BlockId, world::VoxelPos v, int32_t value) {
      layers += world::random_bits(static_cast<uint64_t>(int64_t{value}), v.x, v.y, v.z, static_cast<uint64_t>(layer));
    });
  }
  uint64_t hash = world::hash_combine(world_.store.content_hash(), layers);
  for (const Running& running : rules_)
    if (running.rule)
      for (const char c : running.rule->state()) hash = world::hash_combine(hash, static_cast<unsigned char>(c));
  if (bodies()) hash = world::hash_combine(hash, bodies()->content_hash());
  return hash;
}

Matter::Stored Matter::stored() const {
  Stored all;
  for (const auto& [block, voxels] : world_.store.census())
    all.amounts[block] = static_cast<int64_t>(voxels) * kFullVoxel;
  for (const world::Layer layer : {world::Layer::liquid, world::Layer::gas})
    for_each_active(world_.store, layer, [&](world::BlockId block, world::VoxelPos, int32_t amount) {
      all.amounts[block] += amount - kFullVoxel;
    });
  for_each_active(world_.store, world::Layer::heat,
                  [&](world::BlockId, world::VoxelPos, int32_t heat) { all.heat += heat; });
  return all;
}

Matter::Stored Matter::booked() const {
  Stored all = start_;
  all.heat += edited_heat_.in - edited_heat_.out;
  for (const auto& [block, edited] : edited_) all.amounts[block] += edited.in - edited.out;
  for (size_t id = 0; cells_ && id < world_.palette->size(); ++id) {
    const Cells::Booked made = cells_->booked(static_cast<world::BlockId>(id));
    if (made.in != made.out) all.amounts[static_cast<world::BlockId>(id)] += made.in - made.out;
  }
  if (cells_) all.heat += cells_->booked_heat().in - cells_->booked_heat().out;
  return all;
}

std::map<world::BlockId, int64_t> Matter::amounts() {
  flush();
  return stored().amounts;
}

int64_t Matter::amount(world::BlockId block) {
  const std::map<world::BlockId, int64_t> all = amounts();
  const auto found = all.find(block);
  return found == all.end() ? 0 : found->second;
}

std::vector<LedgerRow> Matter::ledger() {
  flush();
  const Stored now = stored();
  std::map<world::BlockId, LedgerRow> rows;
  LedgerRow heat{.substance = "heat", .start = start_.heat, .now = now.heat, .is_heat = true};
  heat.in = edited_heat_.in, heat.out = edited_heat_.out;
  for (const auto& [block, amount] : start_.amounts) rows[block].start = amount;
  for (const auto& [block, amount] : now.amounts) rows[block].now = amount;
  for (const auto& [block, booked] : edited_) rows[block].in += booked.in, rows[block].out += booked.out;
  for (size_t id = 0; cells_ && id < world_.palette->size(); ++id) {
    const auto block = static_cast<world::BlockId>(id);
    const Cells::Booked booked = cells_->booked(block);
    if (booked.in != 0 || booked.out != 0) rows[block].in += booked.in, rows[block].out += booked.out;
  }
  if (cells_) heat.in += cells_->booked_heat().in, heat.out += cells_->booked_heat().out;
  rows.erase(world::kAir);
  std::vector<LedgerRow> all;
  for (auto& [block, row] : rows) {
    row.substance = (*world_.palette)[block].name;
    all.push_back(row);
  }
  std::sort(all.begin(), all.end(), [](const LedgerRow& a, const LedgerRow& b) { return a.substance < b.substance; });
  if (heat.start != 0 || heat.now != 0 || heat.in != 0 || heat.out != 0) all.push_back(heat);
  return all;
}

int Matter::amount_at(world::VoxelPos v) const {
  const world::BlockId block = cells_ ? cells_->block_at(v) : world_.store.get(v);
  if (block == world::kAir) return 0;
  const world::Phase phase = (*world_.palette)[block].phase;
  if (phase != world::Phase::liquid && phase != world::Phase::gas) return 0;
  if (cells_) return cells_->amount_at(v);
  const world::IntLayer* values =
      world_.store.find_int_layer(phase == world::Phase::liquid ? world::Layer::liquid : world::Layer::gas);
  return values && values->active(v) ? values->get(v) : kFullVoxel;
}

std::vector<EffectReport> Matter::effects() const {
  std::vector<EffectReport> all;
  for (size_t r = 0; r < rules_.size(); ++r) {
    const Running& running = rules_[r];
    EffectReport report;
    report.name = rule_rows()[r].info.name;
    report.called_for = running.rule != nullptr;
    report.why = running.why;
    report.leaves_visited = running.leaves_visited, report.voxels_changed = running.voxels_changed;
    report.ms = running.ms, report.bytes = running.bytes;
    report.notes = running.notes;
    all.push_back(std::move(report));
  }
  const auto add = [&](const char* name, const Inhabitants::Count& count) {
    EffectReport& report = all.emplace_back();
    report.name = name, report.called_for = count.made, report.why = count.made ? "the scene asks for it" : "";
    report.moved = count.moved, report.ms = count.ms, report.bytes = count.bytes;
  };
  add("bodies", inhabitants_ ? inhabitants_->bodies_count() : Inhabitants::Count{});
  add("particles", inhabitants_ ? inhabitants_->particles_count() : Inhabitants::Count{});
  return all;
}

size_t Matter::bytes() const {
  size_t all = cells_ ? cells_->bytes() : 0;
  if (inhabitants_) all += inhabitants_->bodies_count().bytes + inhabitants_->particles_count().bytes;
  return all;
}

}  // namespace sim
