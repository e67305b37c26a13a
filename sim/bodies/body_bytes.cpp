// Bodies as bytes: a version, what is common to all, then each body's fields one after the other, little-endian;
// doubles by their bits.
#include <bit>
#include <cstring>

#include "sim/bodies/bodies.h"
#include "world/base/random.h"

namespace sim {

namespace {

constexpr uint64_t kVersion = 0x0001'5345'4944'4f42ull;  // "BODIES", 1

/// Visits the fields of a body in one order: for writing, reading and hashing.
template <class Body, class Visit>
void each_field(Body& body, const Visit& visit) {
  visit(body.id), visit(body.state), visit(body.touching), visit(body.calm_ticks);
  for (auto* v : {&body.box.min, &body.box.size, &body.velocity, &body.drawn_from})
    visit(v->x), visit(v->y), visit(v->z);
  for (auto* v : {&body.drive, &body.described.size, &body.described.velocity, &body.described.foot.fraction})
    visit(v->x), visit(v->y), visit(v->z);
  visit(body.submerged), visit(body.step_height);
  auto& d = body.described;
  visit(d.foot.voxel.x), visit(d.foot.voxel.y), visit(d.foot.voxel.z);
  visit(d.density), visit(d.restitution), visit(d.friction), visit(d.drag_coefficient), visit(d.step_height);
}

template <class T>
uint64_t bits_of(const T& value) {
  if constexpr (std::is_same_v<T, double>)
    return std::bit_cast<uint64_t>(value);
  else
    return static_cast<uint64_t>(value);
}

void put(std::string& to, uint64_t value) {
  for (int i = 0; i < 8; ++i) to.push_back(static_cast<char>(value >> (8 * i)));
}

/// Takes eight bytes, or notes that there are none.
struct Taker {
  std::string_view bytes;
  bool short_of = false;
  uint64_t next() {
    if (bytes.size() < 8) return short_of = true, 0;
    uint64_t value = 0;
    for (int i = 0; i < 8; ++i) value |= static_cast<uint64_t>(static_cast<unsigned char>(bytes[i])) << (8 * i);
    bytes.remove_prefix(8);
    return value;
  }
};

bool in(double value, double low, double high) { return value >= low && value <= high; }

/// Whether the step may rely on it as on one that add() made.
bool sound(const Body& b) {
  if (b.id == 0 || b.state > BodyState::quarantined || b.calm_ticks > kSleepTicks) return false;
  for (int a = 0; a < 3; ++a) {
    constexpr int64_t kBorder = int64_t{world::kWorldBorder} << kFixedLog2;
    if (b.box.min[a] < -kBorder - 128 * kFixedOne || b.box.min[a] > kBorder + 64 * kFixedOne) return false;
    if (b.box.size[a] < kFixedOne / 256 || b.box.size[a] > 64 * kFixedOne) return false;
    if (!in(from_fixed(b.velocity[a]), -kFastestBody, kFastestBody)) return false;
    if (b.drawn_from[a] < -2 * kBorder || b.drawn_from[a] > 2 * kBorder) return false;
    if (!in(b.drive[a], -1e9, 1e9)) return false;
  }
  return in(b.submerged, 0, 1) && b.step_height >= 0 && b.step_height <= 2 * kFixedOne &&
         in(b.described.density, 1, 1e5) && in(b.described.restitution, 0, 1) && in(b.described.friction, 0, 10) &&
         in(b.described.drag_coefficient, 0, 100);
}

}  // namespace

uint64_t Bodies::content_hash() const {
  uint64_t hash = world::hash_combine(tick_, next_id_);
  for (const Body& body : bodies_) {
    // Of a body that is set apart nothing counts any more.
    if (body.state == BodyState::quarantined) continue;
    each_field(body, [&](const auto& field) { hash = world::hash_combine(hash, bits_of(field)); });
  }
  return hash;
}

std::string Bodies::bytes() const {
  std::string out;
  for (const uint64_t value : {kVersion, tick_, uint64_t{next_id_}, uint64_t{bodies_.size()}}) put(out, value);
  for (const Body& body : bodies_) each_field(body, [&](const auto& field) { put(out, bits_of(field)); });
  return out;
}

world::Status Bodies::restore(std::string_view bytes) {
  Taker taker{bytes};
  if (taker.next() != kVersion) return world::input_error("these bytes hold no bodies of a version that is known");
  const uint64_t tick = taker.next(), next_id = taker.next(), count = taker.next();
  std::vector<Body> bodies;
  for (uint64_t i = 0; i < count && !taker.short_of; ++i) {
    Body body;
    each_field(body, [&]<class T>(T& field) {
      const uint64_t value = taker.next();
      if constexpr (std::is_same_v<T, double>)
        field = std::bit_cast<double>(value);
      else
        field = static_cast<T>(value);
    });
    const bool in_order = bodies.empty() || bodies.back().id < body.id;
    if (!taker.short_of && (!in_order || body.id >= next_id || !sound(body)))
      return world::input_error("body " + std::to_string(i) + " is damaged: a number of it is out of its range");
    bodies.push_back(body);
  }
  if (taker.short_of || !taker.bytes.empty() || next_id > UINT32_MAX)
    return world::input_error("the bytes of bodies end too early or too late");
  bodies_ = std::move(bodies), tick_ = tick, next_id_ = static_cast<BodyId>(next_id);
  return {};
}

}  // namespace sim
