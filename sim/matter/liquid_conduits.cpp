/// Pressure in what is full: passages of waves under roofs. A part of liquid_waves.h.
///
/// Wells that are full up to a roof hold as much as they can: what comes in at one mouth goes out at another. A conduit
/// has a head P, such that its mouths together take what they give; at each mouth, with the surface H of the well
/// beside it,
///   dv/dt = g (P - H) / L - drag,   sum of A v = 0
/// with v out of the conduit, A the opening, and L = volume / sum of A, which is half of the length of a pipe of one
/// width: so long pipes swing slowly. Drag is that of the bed, of viscosity and eddies, and v|v| / 2L times 1 where it
/// comes out and 1/2 where it goes in, what a jet and a sharp edge lose: wide basins empty by Torricelli's law.
///
/// A mouth whose opening isn't all under water has H at the opening's top, and only gives out, while P is above that;
/// else it is an edge like others, by which the conduit runs dry, and air comes in: so a siphon that has a place with
/// air doesn't run. One that is full does.
///
/// Amounts go from mouth to mouth, whole units, as much in as out. What can't be divided goes by a hash of place and
/// tick: that, by a unit, is all that depends on the side. Heat goes by way of the conduit's, which is mixed.
///
/// What is reached of conduits, of the columns at their mouths, and of conduits that lie beyond those, is looked at
/// while any part of it is awake, up to kMostPages; pipes that are longer are closed there. source Benjamin Wylie,
/// Victor Streeter. Fluid Transients in Systems. 1993 (rigid columns); Jean-Charles de Borda.
///        Memoire sur l'ecoulement des fluides par les orifices des vases. 1766 (losses)
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <span>
#include <tuple>
#include <unordered_set>

#include "sim/matter/liquid_waves.h"
#include "world/base/random.h"

namespace sim {

namespace {

constexpr double kGravity = 9.81;
constexpr double kDrag =
    0.008;  // of rough walls: of a pipe as wide as high, a quarter of which is its hydraulic radius
constexpr double kEddies = 1.0 / 10;  // 1/s: between walls all round more than of waves
constexpr double kFastest = 1000;     // m/s
constexpr double kLossOut = 1, kLossIn = 0.5;
constexpr size_t kMostPages = 8192;
constexpr int kDeepest = 16;           // leaves that something falls
constexpr double kSumSteps = 1 << 20;  // sums in whole steps are the same in any order

int64_t in_steps(double value) { return std::llround(value * kSumSteps); }

}  // namespace

/// Adds to the blocks what is reached of conduits, and says whether anything was.
bool LiquidWaves::follow_conduits(Cells& cells, LiquidPages& pages) {
  struct Reached {
    std::map<int32_t, PageId> pages;
    Block block;
    std::vector<Well> wells;
    bool is_read = false;
  };
  std::map<std::pair<int32_t, int32_t>, Reached> reached;  // by x, z
  size_t added = 0;
  for (const Block& b : blocks_) reached[{b.x, b.z}].pages.insert(b.pages.begin(), b.pages.end());
  const auto add = [&](int32_t x, int32_t y, int32_t z, Reached& to) {
    if (to.pages.contains(y) || added >= kMostPages) return;
    const PageId page = cells.open(world::LeafPos{x, y, z});
    if (page == kClosedPage) return;
    pages.view(cells, page);
    to.pages.emplace(y, page);
    to.is_read = false;
    ++added;
  };
  // Whole columns, from the floor to the surface.
  const auto read = [&](int32_t x, int32_t z, Reached& of) {
    if (of.is_read) return;
    std::vector<int32_t> left;
    for (const auto& [y, page] : of.pages) left.push_back(y);
    while (!left.empty()) {
      const int32_t y = left.back();
      left.pop_back();
      const auto found = of.pages.find(y);
      if (found == of.pages.end()) continue;
      const LiquidRows rows = pages[found->second].rows;
      for (const int step : {-1, 1}) {
        if (!(rows.wet & (step < 0 ? 1 : 8)) || of.pages.contains(y + step)) continue;
        add(x, y + step, z, of);
        left.push_back(y + step);
      }
    }
    of.is_read = true;
    of.block = {};
    of.block.x = x, of.block.z = z;
    of.block.pages.assign(of.pages.begin(), of.pages.end());
    of.wells.clear();
    find_wells(pages, of.block, 0, of.wells);
  };
  // From all that are known, through those that touch.
  struct Place {
    int32_t x, z, floor, ceiling;
  };
  std::vector<Place> front;
  std::unordered_set<Key, KeyHash> seen;
  const auto meet = [&](int32_t x, int32_t z, const Well& w) {
    if (w.is_conduit() && seen.insert({{x, w.ceiling, z}, 0}).second) front.push_back({x, z, w.floor, w.ceiling});
  };
  for (const Well& w : wells_) {
    if (!w.is_conduit()) continue;
    const Block& b = blocks_[w.block];
    read(b.x, b.z, reached[{b.x, b.z}]);
    meet(b.x * 8 + (w.column >> 3), b.z * 8 + (w.column & 7), w);
  }
  while (!front.empty()) {
    const Place from = front.back();
    front.pop_back();
    for (const auto& [dx, dz] : {std::pair(1, 0), std::pair(-1, 0), std::pair(0, 1), std::pair(0, -1)}) {
      const int32_t x = from.x + dx, z = from.z + dz;
      Reached& to = reached[{x >> 3, z >> 3}];
      for (int32_t y = from.floor >> world::kLeafLog2; y <= (from.ceiling - 1) >> world::kLeafLog2; ++y)
        add(x >> 3, y, z >> 3, to);
      read(x >> 3, z >> 3, to);
      const auto column = static_cast<size_t>((x & 7) * 8 + (z & 7));
      const auto beside = [&] {
        return std::span(to.wells).subspan(to.block.first[column], to.block.first[column + 1] - to.block.first[column]);
      };
      const auto touches = [&](const Well& w) { return w.floor < from.ceiling && from.floor < w.ceiling; };
      // What comes out falls to a floor.
      for (int k = 0; k < kDeepest; ++k) {
        const std::span<const Well> wells = beside();
        const auto drop = std::find_if(wells.begin(), wells.end(), [&](const Well& w) { return w.drop && touches(w); });
        if (drop == wells.end()) break;
        add(x >> 3, (drop->floor >> world::kLeafLog2) - 1, z >> 3, to);
        if (to.is_read) break;
        read(x >> 3, z >> 3, to);
      }
      for (const Well& w : beside())
        if (touches(w)) meet(x, z, w);
    }
  }
  if (added == 0) return false;
  blocks_.clear();
  for (auto& [at, of] : reached) {
    if (of.pages.empty()) continue;
    blocks_.emplace_back();
    blocks_.back().x = at.first, blocks_.back().z = at.second;
    blocks_.back().pages.assign(of.pages.begin(), of.pages.end());
  }
  return true;
}

/// Which wells are one conduit, and their mouths.
void LiquidWaves::find_conduits(uint64_t salt) {
  std::vector<uint32_t> parent(wells_.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&](uint32_t w) {
    while (parent[w] != w) w = parent[w] = parent[parent[w]];
    return w;
  };
  for (const Edge& e : edges_)
    if (wells_[e.a].is_conduit() && wells_[e.b].is_conduit()) {
      const uint32_t a = root(e.a), b = root(e.b);
      parent[std::max(a, b)] = std::min(a, b);
    }
  conduit_of_.assign(wells_.size(), kNone);
  for (uint32_t w = 0; w < wells_.size(); ++w) {
    if (!wells_[w].is_conduit()) continue;
    const uint32_t first = root(w);
    if (first == w) {
      conduit_of_[w] = static_cast<uint32_t>(conduits_.size());
      conduits_.emplace_back();
    }
    conduit_of_[w] = conduit_of_[first];
    Conduit& c = conduits_[conduit_of_[w]];
    c.volume += wells_[w].amount;
    c.heat += wells_[w].heat;
    c.datum = std::min(c.datum, wells_[w].floor);
  }
  for (uint32_t n = 0; n < edges_.size(); ++n) {
    const Edge& e = edges_[n];
    const uint32_t a = conduit_of_[e.a], b = conduit_of_[e.b];
    if ((a == kNone) == (b == kNone) || wells_[a == kNone ? e.a : e.b].drop) continue;
    const Key key = key_of(e);
    mouths_.push_back({.edge = n,
                       .conduit = a == kNone ? b : a,
                       .inwards = a == kNone,
                       .order = world::random_bits(salt, key.v.x, key.v.y, key.v.z, static_cast<uint64_t>(key.axis))});
  }
  std::sort(mouths_.begin(), mouths_.end(), [](const Mouth& a, const Mouth& b) {
    return std::tie(a.conduit, a.order, a.edge) < std::tie(b.conduit, b.order, b.edge);
  });
  for (uint32_t begin = 0, end; begin < mouths_.size(); begin = end) {
    for (end = begin; end < mouths_.size() && mouths_[end].conduit == mouths_[begin].conduit;) ++end;
    conduits_[mouths_[begin].conduit].first = begin;
    conduits_[mouths_[begin].conduit].last = end;
  }
}

void LiquidWaves::press(double dt, const Liquid& liquid) {
  for (const Conduit& c : conduits_)
    if (c.first < c.last) press_conduit(c, dt, liquid);
}

/// The head at which as much comes in as goes out, and the velocities at the mouths after a part of a tick.
void LiquidWaves::press_conduit(const Conduit& c, double dt, const Liquid& liquid) {
  const std::span<Mouth> mouths(mouths_.data() + c.first, c.last - c.first);
  const auto beside = [&](const Mouth& m) -> const Well& {
    return wells_[m.inwards ? edges_[m.edge].a : edges_[m.edge].b];
  };
  const auto top = [&](const Mouth& m) { return int64_t{edges_[m.edge].high} * kFullVoxel; };
  const auto is_under = [&](const Mouth& m) { return beside(m).surface() >= top(m); };
  int64_t openings = 0;
  for (Mouth& m : mouths) {
    m.state = Mouth::State::open;
    openings += edges_[m.edge].high - edges_[m.edge].low;
  }
  const double length = std::max(1.0, static_cast<double>(c.volume) / kFullVoxel / static_cast<double>(openings));
  const double per_head = dt * kGravity / length;
  // Mouths that can't do what the pressure asks of them are left out one after the other.
  for (;;) {
    const auto head = [&](const Mouth& m) {
      return static_cast<double>(std::max(beside(m).surface(), top(m)) - int64_t{c.datum} * kFullVoxel) / kFullVoxel;
    };
    const auto out = [&](const Mouth& m) { return m.inwards ? -edges_[m.edge].u : edges_[m.edge].u; };
    const auto kept = [&](const Mouth& m) {
      const double v = out(m), wide = edges_[m.edge].high - edges_[m.edge].low;
      const double drag = (v > 0 ? kLossOut : kLossIn) * std::abs(v) / (2 * length) + kDrag * std::abs(v) / wide +
                          3 * liquid.viscosity / (wide * wide) + kEddies;
      return 1 / (1 + dt * drag);
    };
    int64_t asked = 0, answers = 0, open = 0;
    for (const Mouth& m : mouths) {
      if (m.state != Mouth::State::open) continue;
      const double wide = (edges_[m.edge].high - edges_[m.edge].low) * kept(m);
      asked += in_steps(wide * (per_head * head(m) - out(m)));
      answers += in_steps(wide * per_head);
      ++open;
    }
    const double pressure = answers > 0 ? static_cast<double>(asked) / static_cast<double>(answers) : 0;
    bool all_can = true;
    for (Mouth& m : mouths) {
      if (m.state != Mouth::State::open) continue;
      const double off = pressure - head(m);
      m.next_out = std::clamp((out(m) + per_head * off) * kept(m), -kFastest, kFastest);
      edges_[m.edge].off_level = open > 1 ? off : 0;
      if (!is_under(m) && (open == 1 || m.next_out <= 0 || off <= 0))
        m.state = Mouth::State::by_waves;
      else if (m.next_out > 0 && beside(m).room() <= 0)
        m.state = Mouth::State::blocked;
      all_can &= m.state == Mouth::State::open;
    }
    if (all_can) break;
  }
  for (const Mouth& m : mouths) {
    Edge& e = edges_[m.edge];
    e.pressed = m.state != Mouth::State::by_waves;
    if (!e.pressed) continue;
    if (m.state == Mouth::State::blocked) e.next_u = e.off_level = 0;
    if (m.state == Mouth::State::open) e.next_u = m.inwards ? -m.next_out : m.next_out;
  }
}

/// Moves liquid from mouths that take in to those that give out.
void LiquidWaves::flow_through_conduits(double dt) {
  const auto beside = [&](const Mouth& m) -> Well& { return wells_[m.inwards ? edges_[m.edge].a : edges_[m.edge].b]; };
  const auto out = [&](const Mouth& m) { return m.inwards ? -edges_[m.edge].u : edges_[m.edge].u; };
  for (const Mouth& m : mouths_) beside(m).out = beside(m).in = 0;
  // What each would give out, or take in.
  for (Mouth& m : mouths_) {
    const Edge& e = edges_[m.edge];
    m.amount = m.wanted = 0;
    if (!e.pressed) continue;
    const int64_t most = int64_t{e.high - e.low} * kFullVoxel;
    m.wanted = std::llround(static_cast<double>(most) * std::abs(out(m)) * dt);
    Well& w = beside(m);
    m.amount = out(m) < 0 ? std::clamp<int64_t>(w.surface() - int64_t{e.low} * kFullVoxel, 0, m.wanted) : m.wanted;
    (out(m) < 0 ? w.out : w.in) += m.amount;
  }
  for (const Mouth& m : mouths_) {
    Well& w = beside(m);
    w.may_give = std::min(w.out, w.amount), w.may_take = std::min(w.in, std::max<int64_t>(0, w.room()));
  }
  for (Mouth& m : mouths_) {
    Well& w = beside(m);
    int64_t &wanted = out(m) < 0 ? w.out : w.in, &may = out(m) < 0 ? w.may_give : w.may_take;
    if (m.amount == 0) continue;
    const auto part = static_cast<int64_t>(static_cast<__int128>(m.amount) * may / wanted);
    wanted -= m.amount, may -= part;
    m.amount = part;
  }
  for (Conduit& c : conduits_) {
    const std::span<Mouth> mouths(mouths_.data() + c.first, c.last - c.first);
    int64_t into = 0, out_of = 0;
    for (const Mouth& m : mouths) (out(m) < 0 ? into : out_of) += m.amount;
    const int64_t moved = std::min(into, out_of);
    // In the order of their hashes, so that the parts' sum is what moves.
    int64_t into_before = 0, out_before = 0;
    for (Mouth& m : mouths) {
      int64_t& before = out(m) < 0 ? into_before : out_before;
      const int64_t all = out(m) < 0 ? into : out_of, wanted = m.amount;
      if (wanted == 0) continue;
      const auto up_to = [&](int64_t sum) { return static_cast<int64_t>(static_cast<__int128>(sum) * moved / all); };
      m.amount = up_to(before + wanted) - up_to(before);
      before += wanted;
    }
    if (moved == 0) continue;
    c.flowed = true;
    const __int128 heat_before = c.heat + c.heat_more;
    int64_t warmth = 0;
    if (has_heat_)
      for (const Mouth& m : mouths) {
        Well& w = beside(m);
        if (out(m) >= 0 || m.amount == 0) continue;
        const auto gone = static_cast<int64_t>(static_cast<__int128>(w.heat) * m.amount / w.amount);
        w.heat -= gone, warmth += gone;
        w.flowed = true;
      }
    for (const Mouth& m : mouths)
      if (out(m) < 0) beside(m).amount -= m.amount;
    for (const Mouth& m : mouths) {
      if (out(m) < 0 || m.amount == 0) continue;
      Well& w = beside(m);
      w.amount += m.amount;
      if (!has_heat_) continue;
      const auto comes = static_cast<int64_t>((heat_before + warmth) * m.amount / (c.volume + moved));
      w.heat += comes, c.heat_more -= comes;
      w.flowed = true;
    }
    c.heat_more += warmth;
  }
  // What gave less than its velocity asks for has been slowed down; a unit is what rounding takes.
  for (const Mouth& m : mouths_)
    if (m.wanted - m.amount > 1) edges_[m.edge].u *= static_cast<double>(m.amount) / static_cast<double>(m.wanted);
}

/// Shares out what came through the mouths among the wells of a conduit, as much a unit of liquid everywhere.
void LiquidWaves::mix_conduits() {
  for (Conduit& c : conduits_) c.heat = c.heat_more, c.heat_more = c.volume = 0;
  const auto for_each = [&](auto visit) {
    for (uint32_t w = 0; w < wells_.size(); ++w)
      if (conduit_of_[w] != kNone && conduits_[conduit_of_[w]].flowed) visit(wells_[w], conduits_[conduit_of_[w]]);
  };
  for_each([](Well& w, Conduit& c) { c.heat += w.heat, c.volume += w.amount; });
  for_each([](Well& w, Conduit& c) {
    w.heat = c.volume == 0 ? c.heat : static_cast<int64_t>(static_cast<__int128>(c.heat) * w.amount / c.volume);
    c.heat -= w.heat, c.volume -= w.amount;
    w.flowed = true;
  });
}

}  // namespace sim
