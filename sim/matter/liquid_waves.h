/// Liquid with inertia: shallow water on the columns of a liquid. Internal to sim/matter.
///
/// A well is a run of voxels of one column between a floor and a ceiling, with liquid from its floor up; wells side by
/// side whose openings overlap exchange liquid through an edge, which has a velocity. In parts of a tick
///   du/dt = -g d(surface)/dx + (what comes in from upstream carries its own velocity) - drag,   Q = h upstream * u
/// with the depth of the side that it comes from, so that depths stay above zero, and dams break as fast as they
/// should. Amounts are integers: an edge takes from one well what it gives to the other, never more than there is or
/// fits. Velocities are kept in 2^-16 m/s, so that a state has no more digits than are saved.
///
/// Drag is that of a rough bed, of viscosity, and of eddies smaller than voxels: all that moves halves in 28 s.
///
/// What falls, falls by the rule's other half. Wells that are full up to a roof and touch are a conduit:
/// liquid_conduits.cpp. Bodies that are calm find their level, to the unit, by liquid_level.h.
///
/// time   tick / parts, where (u + sqrt(g h)) dt stays below 0.6 voxels
/// error  first order in space and time; a wave shorter than some voxels dies out. Depths below 128 m count as 128 m
/// cost   some 100 ns a well and part, on one thread
/// source Guus Stelling, Sander Duinmeijer. A staggered conservative scheme for every Froude number in rapidly varied
///        shallow water flows. 2003
#pragma once

#include <array>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "sim/matter/liquid_heat.h"
#include "sim/matter/liquid_pages.h"
#include "world/base/errors.h"

namespace sim {

class LiquidWaves {
 public:
  struct Liquid {
    double viscosity = 1e-6;  // kinematic, m^2/s
    int film = 64;            // less than that wets nothing dry
    double tick_s = 0.05;
    uint64_t salt = 0;  // of the tick: who gets what can't be divided
  };
  /// One tick. `flowing`: pages that hold some of it, viewed; those around them are opened. The changed amounts are in
  /// `pages`, to be stored; see touched(). Heat goes along into `heat`'s cells: a well through which something flows is
  /// mixed.
  void step(Cells& cells, LiquidPages& pages, LiquidHeat& heat, std::span<const PageId> flowing, const Liquid& liquid);
  const std::vector<PageId>& touched() const { return touched_; }
  /// Pages in whose columns something moves, or would.
  const std::vector<PageId>& wavy() const { return wavy_; }
  bool is_wavy(PageId p) const { return p < is_wavy_.size() && is_wavy_[p]; }

  /// The parts of the last tick, and velocities, a line each: x y z axis u; sorted.
  std::string state() const;
  /// Adds what such a line says.
  world::Status restore(std::string_view line);
  bool empty() const { return velocities_.empty(); }

 private:
  static constexpr uint32_t kNone = UINT32_MAX;
  struct Well {
    int32_t floor = 0, ceiling = 0;  // y of the lowest voxel; of the first above that is closed, or holds what falls
    int64_t amount = 0, before = 0;  // from its floor up
    uint32_t block = 0;
    uint8_t column = 0;                                              // x * 8 + z in the leaf
    bool drop = false;                                               // its floor isn't known: what comes in falls on
    bool roofed = false;                                             // something closed lies on its ceiling
    std::array<uint32_t, 2> next{kNone, kNone}, prev{kNone, kNone};  // edges along x, z
    int64_t out = 0, in = 0;                                         // in a part of a tick
    int64_t may_give = 0, may_take = 0;                              // of that, through mouths of conduits
    int64_t heat = 0;                                                // of its voxels, mixed once something flows
    bool flowed = false;
    bool is_conduit() const { return roofed && amount > 0 && room() == 0; }
    int64_t surface() const { return int64_t{floor} * kFullVoxel + amount; }
    int64_t room() const { return int64_t{ceiling - floor} * kFullVoxel - amount; }
  };
  struct Edge {
    uint32_t a = 0, b = 0;
    int32_t low = 0, high = 0;       // y of the opening
    uint8_t axis = 0;                // 0: x, 1: z
    double u = 0, next_u = 0;        // m/s, from a to b
    double u_before = 0;             // when the tick began
    double depth = 0;                // of what flows, m
    int64_t from_a = 0, from_b = 0;  // amounts above the opening's floor
    int64_t flow = 0;
    int64_t room = 0, deposit = 0;  // of the voxel in which what drops arrives
    int64_t flow_heat = 0, deposit_heat = 0;
    bool pressed = false;  // the mouth of a conduit whose pressure moves what is in it
    double off_level = 0;  // m: of the pressure there, from that at which nothing would flow
  };
  /// Wells that are full up to their roofs and touch, and what flows through them in one piece.
  struct Conduit {
    uint32_t first = 0, last = 0;     // of mouths_
    int32_t datum = INT32_MAX;        // the lowest floor
    int64_t volume = 0;               // of its wells
    int64_t heat = 0, heat_more = 0;  // of its wells before; and what came through its mouths
    bool flowed = false;
  };
  /// An edge between a well of a conduit and one that has a surface of its own.
  struct Mouth {
    uint32_t edge = 0, conduit = 0;
    bool inwards = false;  // along its axis
    uint64_t order = 0;    // by hash
    // Of a part of a tick:
    enum class State : uint8_t { open, blocked, by_waves } state = State::open;
    double next_out = 0;  // m/s, out of the conduit
    int64_t wanted = 0;   // by its velocity
    int64_t amount = 0;   // that flows
  };
  /// Pages of one column of leaves.
  struct Block {
    int32_t x = 0, z = 0;
    std::vector<std::pair<int32_t, PageId>> pages;  // by y
    std::array<uint32_t, 65> first{};               // wells of each column
  };
  struct Key {
    world::VoxelPos v;
    int axis;
    friend bool operator==(const Key&, const Key&) = default;
  };
  struct KeyHash {
    size_t operator()(const Key& k) const;
  };

  void find_blocks(Cells& cells, LiquidPages& pages, std::span<const PageId> flowing);
  static void find_wells(const LiquidPages& pages, Block& block, uint32_t number, std::vector<Well>& wells);
  void find_all_wells(const LiquidPages& pages);
  bool follow_conduits(Cells& cells, LiquidPages& pages);
  void find_conduits(uint64_t salt);
  void press(double dt, const Liquid& liquid);
  void press_conduit(const Conduit& conduit, double dt, const Liquid& liquid);
  void flow_through_conduits(double dt);
  void mix_conduits();
  void find_edges(const LiquidPages& pages);
  void join(const LiquidPages& pages, uint32_t a_begin, uint32_t a_end, uint32_t b_begin, uint32_t b_end, int axis);
  Key key_of(const Edge& e) const;
  const Block* block_at(int32_t x, int32_t z) const;
  PageId page_of(const Well& w, int32_t y) const;
  void find_depths();
  bool meets(const Edge& e, uint32_t other) const;
  double upstream(const Edge& e, uint32_t at_a, uint32_t at_b) const;
  void accelerate(Edge& e, double dt, const Liquid& liquid);
  void flow(double dt, const Liquid& liquid);
  void find_heats(const Cells& cells);
  void carry_heats();
  void write_heats(Cells& cells, LiquidHeat& heat);
  void write(LiquidPages& pages);
  void keep(int film);
  void set(LiquidPages& pages, const Well& w, int32_t y, int amount);

  std::unordered_map<Key, int32_t, KeyHash> velocities_;  // not 0; v: the lowest voxel of the edge, on the side of a
  int parts_ = 0;                                         // of the last tick
  std::vector<Block> blocks_;                             // by x, then z
  std::vector<Well> wells_;
  std::vector<Edge> edges_;
  std::vector<Conduit> conduits_;
  std::vector<Mouth> mouths_;         // by conduit, then by order
  std::vector<uint32_t> conduit_of_;  // by well, where there are conduits
  bool has_heat_ = false;
  std::vector<PageId> touched_, wavy_;
  std::vector<uint8_t> is_touched_, is_wavy_;
};

}  // namespace sim
