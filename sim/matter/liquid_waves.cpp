#include "sim/matter/liquid_waves.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <tuple>

#include <fmt/format.h>

#include "world/base/random.h"

namespace sim {

using world::LeafPos;
using world::VoxelPos;

namespace {

constexpr double kGravity = 9.81;
constexpr double kDrag = 0.002;       // of a rough bed: half of its friction factor; quadratic
constexpr double kEddies = 1.0 / 40;  // 1/s: what whirls smaller than voxels take from all that moves
constexpr double kSteps = 65536;      // of a velocity, in 1 m/s
constexpr double kCourant = 0.6;
constexpr double kCourantLess = 0.42;  // at which fewer parts do; as few as possible would swing between two numbers of
                                       // them, and waves as short as two voxels would grow by that
constexpr int kMostParts = 64;
constexpr int kDeepest = 16;           // leaves
constexpr double kCalmSpeed = 0.05;    // m/s: what is slower, and as level as this, is left to find its level
constexpr double kCalmLevel = 0.05;    // m
constexpr double kStuckChange = 1e-3;  // m/s in a tick
constexpr int64_t kCalmStep = 205;     // the same, in units of amount
constexpr int64_t kCalmSlope = 8;      // and no more than an eighth of the depth, where that is more than a film
constexpr double kFastest = 1000;      // m/s

/// How far off level water of a depth may be left.
int64_t calm_step(int64_t depth, int film) {
  return depth < film ? kCalmStep : std::min(kCalmStep, depth / kCalmSlope);
}

}  // namespace

size_t LiquidWaves::KeyHash::operator()(const Key& k) const {
  return world::random_bits(static_cast<uint64_t>(k.axis), k.v.x, k.v.y, k.v.z);
}

const LiquidWaves::Block* LiquidWaves::block_at(int32_t x, int32_t z) const {
  const auto found = std::lower_bound(blocks_.begin(), blocks_.end(), std::pair(x, z),
                                      [](const Block& b, const auto& at) { return std::pair(b.x, b.z) < at; });
  return found != blocks_.end() && found->x == x && found->z == z ? &*found : nullptr;
}

/// The pages that flow, those around, and those below down to the floor.
void LiquidWaves::find_blocks(Cells& cells, LiquidPages& pages, std::span<const PageId> flowing) {
  std::vector<std::pair<LeafPos, PageId>> all;
  const auto add = [&](PageId p) {
    if (p != kClosedPage) all.emplace_back(cells.pos(p), p);
  };
  for (const PageId p : flowing) {
    const std::array<PageId, 27> around = cells.around(p);
    add(p);
    for (const size_t side : kSidePage) add(around[side]);
    add(around[kAbove]);
    PageId below = around[kBelow];
    for (int k = 0; k < kDeepest && below != kClosedPage; ++k) {
      add(below);
      if (!pages.view(cells, below).rows.wet) break;
      below = cells.open(cells.pos(below) + LeafPos{0, -1, 0});
    }
  }
  const auto order = [](const auto& e) { return std::tuple(e.first.x, e.first.z, e.first.y); };
  std::sort(all.begin(), all.end(), [&](const auto& a, const auto& b) { return order(a) < order(b); });
  all.erase(std::unique(all.begin(), all.end()), all.end());
  blocks_.clear();
  for (const auto& [pos, page] : all) {
    pages.view(cells, page);
    if (blocks_.empty() || blocks_.back().x != pos.x || blocks_.back().z != pos.z) {
      blocks_.emplace_back();
      blocks_.back().x = pos.x, blocks_.back().z = pos.z;
    }
    blocks_.back().pages.emplace_back(pos.y, page);
  }
}

void LiquidWaves::find_wells(const LiquidPages& pages, Block& b, uint32_t number, std::vector<Well>& wells) {
  for (int column = 0; column < 64; ++column) {
    b.first[static_cast<size_t>(column)] = static_cast<uint32_t>(wells.size());
    Well well;
    bool open = false, filled = false, bounded = false, floor_known = false;
    int32_t next_y = INT32_MIN;
    const auto close = [&](int32_t y) {
      if (!open) return;
      open = false;
      if (!bounded) well.ceiling = y;
      well.before = well.amount;
      wells.push_back(well);
    };
    for (const auto& [leaf_y, page] : b.pages) {
      const int32_t low = leaf_y * world::kLeafSize;
      if (low != next_y) {
        close(next_y);
        floor_known = false;
      }
      next_y = low + world::kLeafSize;
      const uint16_t* own = pages[page].own();
      for (int y = 0; y < world::kLeafSize; ++y) {
        const uint16_t amount = own[(column >> 3) * 64 + y * 8 + (column & 7)];
        if (amount == kNoEntry) {
          well.roofed = !bounded;
          close(low + y);
          floor_known = true;
          continue;
        }
        if (!open) {
          well = {};
          well.floor = low + y, well.block = number, well.column = static_cast<uint8_t>(column);
          well.drop = !floor_known && amount < kFullVoxel;
          open = filled = true;
          bounded = false;
        }
        floor_known = true;
        if (well.drop) continue;
        if (filled) {
          well.amount += amount;
          filled = amount >= kFullVoxel;
        } else if (amount > 0 && !bounded) {
          bounded = true;
          well.ceiling = low + y;
        }
      }
    }
    close(next_y);
  }
  b.first[64] = static_cast<uint32_t>(wells.size());
}

void LiquidWaves::find_all_wells(const LiquidPages& pages) {
  wells_.clear();
  for (uint32_t n = 0; n < blocks_.size(); ++n) find_wells(pages, blocks_[n], n, wells_);
}

LiquidWaves::Key LiquidWaves::key_of(const Edge& e) const {
  const Well& a = wells_[e.a];
  const Block& b = blocks_[a.block];
  return {{b.x * 8 + (a.column >> 3), e.low, b.z * 8 + (a.column & 7)}, e.axis};
}

PageId LiquidWaves::page_of(const Well& w, int32_t y) const {
  const auto& pages = blocks_[w.block].pages;
  const int32_t leaf_y = y >> world::kLeafLog2;
  const auto found = std::lower_bound(pages.begin(), pages.end(), leaf_y,
                                      [](const auto& entry, int32_t at) { return entry.first < at; });
  return found->second;
}

/// Edges between the wells of two columns, of which at least one side holds liquid above the opening's floor.
void LiquidWaves::join(const LiquidPages& pages, uint32_t a_begin, uint32_t a_end, uint32_t b_begin, uint32_t b_end,
                       int axis) {
  for (uint32_t a = a_begin; a < a_end; ++a)
    for (uint32_t b = b_begin; b < b_end; ++b) {
      Well &first = wells_[a], &second = wells_[b];
      if (first.drop && second.drop) continue;
      Edge e;
      e.a = a, e.b = b, e.axis = static_cast<uint8_t>(axis);
      e.low = std::max(first.floor, second.floor), e.high = std::min(first.ceiling, second.ceiling);
      if (e.low >= e.high) continue;
      const int64_t bottom = int64_t{e.low} * kFullVoxel;
      if ((first.drop || first.surface() <= bottom) && (second.drop || second.surface() <= bottom)) continue;
      const auto known = velocities_.find(key_of(e));
      if (known != velocities_.end()) e.u = e.u_before = known->second / kSteps;
      const Well* drop = first.drop ? &first : second.drop ? &second : nullptr;
      if (drop) {
        const uint16_t* own = pages[page_of(*drop, e.low)].own();
        const int there = own[(drop->column >> 3) * 64 + (e.low & 7) * 8 + (drop->column & 7)];
        e.room = std::max(0, kFullVoxel - there) / kSides;  // four sides may give
      }
      const auto number = static_cast<uint32_t>(edges_.size());
      const auto n = static_cast<size_t>(axis);
      if (first.next[n] == kNone) first.next[n] = number;
      if (second.prev[n] == kNone) second.prev[n] = number;
      edges_.push_back(e);
    }
}

void LiquidWaves::find_edges(const LiquidPages& pages) {
  for (const Block& b : blocks_) {
    const Block *ahead_x = block_at(b.x + 1, b.z), *ahead_z = block_at(b.x, b.z + 1);
    for (size_t c = 0; c < 64; ++c) {
      const auto with = [&](const Block* other, size_t column, int axis) {
        if (other) join(pages, b.first[c], b.first[c + 1], other->first[column], other->first[column + 1], axis);
      };
      c < 56 ? with(&b, c + 8, 0) : with(ahead_x, c - 56, 0);
      (c & 7) != 7 ? with(&b, c + 1, 1) : with(ahead_z, c - 7, 1);
    }
  }
}

void LiquidWaves::find_depths() {
  for (Edge& e : edges_) {
    const int64_t bottom = int64_t{e.low} * kFullVoxel, most = int64_t{e.high - e.low} * kFullVoxel;
    const auto above = [&](const Well& w) { return w.drop ? 0 : std::clamp<int64_t>(w.surface() - bottom, 0, most); };
    e.from_a = above(wells_[e.a]), e.from_b = above(wells_[e.b]);
    e.depth = static_cast<double>(e.u > 0 ? e.from_a : e.u < 0 ? e.from_b : std::max(e.from_a, e.from_b)) / kFullVoxel;
  }
}

/// Whether what flows through another edge reaches up to this one: what lies wholly under a ledge doesn't.
bool LiquidWaves::meets(const Edge& e, uint32_t other) const {
  return other != kNone && edges_[other].low + edges_[other].depth > e.low;
}

/// What edges upstream bring along, m^2/s^2: (u there - u) of what flows in. `at_a`, `at_b`: edges across a's other
/// side and b's, along the same axis.
double LiquidWaves::upstream(const Edge& e, uint32_t at_a, uint32_t at_b) const {
  const double q = e.depth * e.u;
  const auto of = [&](uint32_t edge) {
    return meets(e, edge) ? std::pair(edges_[edge].u, edges_[edge].depth * edges_[edge].u) : std::pair(0.0, 0.0);
  };
  const auto [u_a, q_a] = of(at_a);
  const auto [u_b, q_b] = of(at_b);
  const double in_a = std::max(0.0, (q_a + q) / 2), in_b = std::max(0.0, -(q_b + q) / 2);
  return in_a * (u_a - e.u) + in_b * (u_b - e.u);
}

void LiquidWaves::accelerate(Edge& e, double dt, const Liquid& liquid) {
  if (e.pressed) return;
  const double mean = static_cast<double>(e.from_a + e.from_b) / (2.0 * kFullVoxel);
  e.next_u = 0;
  if (mean <= 0) return;
  const Well &a = wells_[e.a], &b = wells_[e.b];
  const auto axis = static_cast<size_t>(e.axis), cross = 1 - axis;
  const double slope = static_cast<double>(e.from_b - e.from_a) / kFullVoxel;  // over one voxel
  double carried = upstream(e, a.prev[axis], b.next[axis]);
  // Across: what comes in from both sides has the velocity of the edges there.
  const auto side = [&](uint32_t edge_a, uint32_t edge_b, bool below) {
    const auto q = [&](uint32_t edge) { return meets(e, edge) ? edges_[edge].depth * edges_[edge].u : 0.0; };
    const double in = (below ? 0.5 : -0.5) * (q(edge_a) + q(edge_b));
    if (in <= 0) return 0.0;
    const auto well = [&](uint32_t edge) -> const Well& { return wells_[below ? edges_[edge].a : edges_[edge].b]; };
    uint32_t there = edge_a != kNone ? well(edge_a).next[axis] : kNone;
    if (there == kNone && edge_b != kNone) there = well(edge_b).prev[axis];
    return in * ((there == kNone ? 0.0 : edges_[there].u) - e.u);
  };
  carried += side(a.prev[cross], b.prev[cross], true) + side(a.next[cross], b.next[cross], false);
  const double u = e.u + dt * (carried / mean - kGravity * slope);
  const double drag = kDrag * std::abs(u) / mean + 3 * liquid.viscosity / (mean * mean) + kEddies;
  e.next_u = std::clamp(u / (1 + dt * drag), -kFastest, kFastest);
}

/// Moves liquid through all edges at once: no well gives more than it holds, or takes more than fits.
void LiquidWaves::flow(double dt, const Liquid& liquid) {
  for (Well& w : wells_) w.out = w.in = 0;
  for (Edge& e : edges_) {
    e.u = e.next_u;
    e.flow = 0;
    if (e.pressed) continue;
    const bool from_a = e.u > 0;
    const int64_t there = from_a ? e.from_a : e.from_b;
    const Well& to = wells_[from_a ? e.b : e.a];
    if (there == 0 || (to.amount == 0 && there < liquid.film)) {
      e.u = 0;
      continue;
    }
    const auto wanted = static_cast<int64_t>(std::llround(static_cast<double>(there) * std::abs(e.u) * dt));
    e.flow = std::min(wanted, there);
    if (to.drop) e.flow = std::min(e.flow, e.room - e.deposit);
    wells_[from_a ? e.a : e.b].out += e.flow;
  }
  const auto share = [](int64_t flow, int64_t of, int64_t wanted) {
    return wanted > of ? static_cast<int64_t>(static_cast<__int128>(flow) * of / wanted) : flow;
  };
  for (Edge& e : edges_) {
    if (e.flow == 0) continue;
    const Well& from = wells_[e.u > 0 ? e.a : e.b];
    e.flow = share(e.flow, from.amount, from.out);
    Well& to = wells_[e.u > 0 ? e.b : e.a];
    if (!to.drop) to.in += e.flow;
  }
  for (Edge& e : edges_) {
    if (e.flow == 0) continue;
    const Well& to = wells_[e.u > 0 ? e.b : e.a];
    if (to.drop)
      e.deposit += e.flow;
    else
      e.flow = share(e.flow, std::max<int64_t>(0, to.room()), to.in);
    if (e.flow == 0) e.u = 0;  // against a wall of it
  }
  if (has_heat_) carry_heats();
  for (const Edge& e : edges_) {
    Well &from = wells_[e.u > 0 ? e.a : e.b], &to = wells_[e.u > 0 ? e.b : e.a];
    from.amount -= e.flow;
    if (!to.drop) to.amount += e.flow;
  }
  if (!conduits_.empty()) flow_through_conduits(dt);
}

namespace {

int64_t voxels_of(int64_t amount) { return (amount + kFullVoxel - 1) / kFullVoxel; }
int index_at(uint8_t column, int32_t y) { return (column >> 3) * 64 + (y & 7) * 8 + (column & 7); }

}  // namespace

void LiquidWaves::find_heats(const Cells& cells) {
  for (Well& w : wells_)
    for (int32_t k = 0; !w.drop && k < voxels_of(w.amount); ++k)
      if (const int32_t* heats = cells.find_heats(page_of(w, w.floor + k)))
        w.heat += heats[index_at(w.column, w.floor + k)];
}

/// What flows takes its part of the heat that its well has now.
void LiquidWaves::carry_heats() {
  for (Edge& e : edges_) {
    e.flow_heat = 0;
    if (e.flow == 0) continue;
    const Well& from = wells_[e.u > 0 ? e.a : e.b];
    e.flow_heat = static_cast<int64_t>(static_cast<__int128>(from.heat) * e.flow / from.amount);
  }
  for (Edge& e : edges_) {
    if (e.flow == 0) continue;
    Well &from = wells_[e.u > 0 ? e.a : e.b], &to = wells_[e.u > 0 ? e.b : e.a];
    from.flowed = to.flowed = true;
    from.heat -= e.flow_heat;
    (to.drop ? e.deposit_heat : to.heat) += e.flow_heat;
  }
}

/// Shares the heat of each well out by amounts.
void LiquidWaves::write_heats(Cells& cells, LiquidHeat& heat) {
  for (const Well& w : wells_) {
    if (w.drop || !w.flowed) continue;
    int64_t given = 0, below = 0;  // of what is shared, up to a voxel
    for (int32_t k = 0; k < voxels_of(std::max({w.amount, w.before, int64_t{1}})); ++k) {
      const PageId p = page_of(w, w.floor + k);
      const int index = index_at(w.column, w.floor + k);
      const int32_t* heats = cells.find_heats(p);
      const int64_t before = heats && k < voxels_of(w.before) ? heats[index] : 0;
      below = std::min(w.amount, below + kFullVoxel);
      const int64_t up_to =
          w.amount == 0 ? w.heat : static_cast<int64_t>(static_cast<__int128>(w.heat) * below / w.amount);
      const int64_t change = up_to - given - before;
      given = up_to;
      if (change == 0) continue;
      heat.add(cells, p, index, change);
      cells.stir_heat(p);
    }
  }
  for (const Edge& e : edges_) {
    if (e.deposit_heat == 0) continue;
    const Well& to = wells_[wells_[e.a].drop ? e.a : e.b];
    const PageId p = page_of(to, e.low);
    heat.add(cells, p, index_at(to.column, e.low), e.deposit_heat);
    cells.stir_heat(p);
  }
}

void LiquidWaves::set(LiquidPages& pages, const Well& w, int32_t y, int amount) {
  const PageId p = page_of(w, y);
  const int index = index_at(w.column, y);
  const int now = pages[p].own()[index];
  if (now == amount) return;
  pages.add(p, index, amount - now);
  if (is_touched_[p]) return;
  is_touched_[p] = 1;
  touched_.push_back(p);
}

void LiquidWaves::write(LiquidPages& pages) {
  for (const Well& w : wells_) {
    if (w.drop || w.amount == w.before) continue;
    for (int32_t k = 0; k < voxels_of(std::max(w.amount, w.before)); ++k)
      set(pages, w, w.floor + k,
          static_cast<int>(std::clamp<int64_t>(w.amount - int64_t{k} * kFullVoxel, 0, kFullVoxel)));
  }
  for (const Edge& e : edges_) {
    if (e.deposit == 0) continue;
    const Well& to = wells_[wells_[e.a].drop ? e.a : e.b];
    const int index = index_at(to.column, e.low);
    set(pages, to, e.low, pages[page_of(to, e.low)].own()[index] + static_cast<int>(e.deposit));
  }
}

/// Which columns aren't calm, and what moves in them, for the next tick. Nearly calm edges among these go on as well:
/// deep water that lost its velocity after each tick would be pushed beyond its level again and again.
void LiquidWaves::keep(int film) {
  std::vector<uint8_t> restless(blocks_.size(), 0);
  for (const Edge& e : edges_) {
    const Well &a = wells_[e.a], &b = wells_[e.b];
    const bool is_open = e.u != 0 || (a.drop ? e.room : a.room()) > 0 || (b.drop ? e.room : b.room()) > 0;
    const bool is_level =
        e.pressed ? std::abs(e.off_level) < kCalmLevel
                  : std::abs(e.from_a - e.from_b) < calm_step(std::max(e.from_a, e.from_b), film) || !is_open;
    // What is too thin to move a unit, on a ledge, and as fast as it will ever be, would be about to leave for ever.
    const bool is_stuck = !e.pressed && e.flow == 0 && std::abs(e.u - e.u_before) < kStuckChange;
    const bool moves = std::abs(e.u) >= kCalmSpeed && !is_stuck;
    if (moves || !is_level) restless[a.block] = restless[b.block] = 1;
  }
  velocities_.clear();
  for (const Edge& e : edges_) {
    if (!restless[wells_[e.a].block] && !restless[wells_[e.b].block]) continue;
    if (const auto u = static_cast<int32_t>(std::llround(e.u * kSteps)); u != 0) velocities_.emplace(key_of(e), u);
  }
  if (velocities_.empty()) parts_ = 0;
  wavy_.clear();
  for (size_t n = 0; n < blocks_.size(); ++n)
    if (restless[n])
      for (const auto& [y, page] : blocks_[n].pages) wavy_.push_back(page);
}

void LiquidWaves::step(Cells& cells, LiquidPages& pages, LiquidHeat& heat, std::span<const PageId> flowing,
                       const Liquid& liquid) {
  find_blocks(cells, pages, flowing);
  find_all_wells(pages);
  const bool has_conduits = std::any_of(wells_.begin(), wells_.end(), [](const Well& w) { return w.is_conduit(); });
  if (has_conduits && follow_conduits(cells, pages)) find_all_wells(pages);
  is_touched_.assign(cells.page_limit(), 0);
  is_wavy_.assign(cells.page_limit(), 0);
  touched_.clear();
  edges_.clear();
  find_edges(pages);
  has_heat_ = cells.met_heat();
  if (has_heat_) find_heats(cells);
  conduits_.clear(), mouths_.clear();
  if (has_conduits) find_conduits(liquid.salt);
  find_depths();
  double fastest = 0;
  for (const Edge& e : edges_) {
    const double deep = static_cast<double>(std::max(e.from_a, e.from_b)) / kFullVoxel;
    fastest = std::max(fastest, std::abs(e.u) + std::sqrt(kGravity * deep));
  }
  const auto parts_at = [&](double courant) {
    return std::clamp(static_cast<int>(std::ceil(fastest * liquid.tick_s / courant)), 1, kMostParts);
  };
  parts_ = std::clamp(parts_, parts_at(kCourant), parts_at(kCourantLess));
  const double dt = liquid.tick_s / parts_;
  for (int part = 0; part < parts_; ++part) {
    if (part > 0) find_depths();
    if (!conduits_.empty()) press(dt, liquid);
    for (Edge& e : edges_) accelerate(e, dt, liquid);
    flow(dt, liquid);
  }
  find_depths();
  if (has_heat_ && !conduits_.empty()) mix_conduits();
  if (has_heat_) write_heats(cells, heat);
  write(pages);
  keep(liquid.film);
  for (const PageId p : wavy_) is_wavy_[p] = 1;
}

std::string LiquidWaves::state() const {
  std::vector<std::pair<Key, int32_t>> all(velocities_.begin(), velocities_.end());
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) {
    return std::tie(a.first.v, a.first.axis) < std::tie(b.first.v, b.first.axis);
  });
  std::string text = fmt::format("parts {}\n", parts_);
  for (const auto& [key, u] : all) text += fmt::format("{} {} {} {} {}\n", key.v.x, key.v.y, key.v.z, key.axis, u);
  return text;
}

world::Status LiquidWaves::restore(std::string_view line) {
  int32_t value[5];
  bool ok = true;
  const char* at = line.data();
  const char* const end = at + line.size();
  if (constexpr std::string_view kParts = "parts "; line.starts_with(kParts)) {
    const auto [next, error] = std::from_chars(at + kParts.size(), end, parts_);
    if (error != std::errc() || next != end || parts_ < 0 || parts_ > kMostParts)
      return world::input_error(
          fmt::format("parts of a tick of waves must be 0 to {}, but are \"{}\"", kMostParts, line));
    return {};
  }
  for (size_t n = 0; ok && n < 5; ++n) {
    if (n > 0 && at < end && *at == ' ') ++at;
    const auto [next, error] = std::from_chars(at, end, value[n]);
    ok = error == std::errc();
    at = next;
  }
  ok = ok && at == end;
  if (!ok || value[3] < 0 || value[3] > 1 || value[4] == 0)
    return world::input_error(
        fmt::format("a wave's velocity must be \"x y z axis u\" in integers, u not 0, but is \"{}\"", line));
  velocities_[{{value[0], value[1], value[2]}, value[3]}] = value[4];
  return {};
}

}  // namespace sim
