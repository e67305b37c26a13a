#include "sim/bodies/inhabitants.h"

#include <chrono>

#include <fmt/format.h>

#include "world/base/text.h"

namespace sim {

namespace {

constexpr uint64_t kTicksToLookUp = 64;

double ms_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

int digit_of(char c) { return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1; }

BodyDescription description_of(const world::BodyRequest& request) {
  BodyDescription d;
  d.foot = request.position, d.size = request.size, d.velocity = request.velocity;
  d.density = request.density_kg_per_m3, d.restitution = request.restitution, d.friction = request.friction;
  return d;
}

}  // namespace

Inhabitants::Inhabitants(const world::World& world, const SimKnobs& knobs, uint64_t seed)
    : world_(world), body_settings_(BodySettings::from(knobs)), particle_settings_(ParticleSettings::from(knobs)) {
  body_settings_.tick = particle_settings_.tick = kMatterTick;
  body_settings_.seed = seed;
}

world::Result<std::unique_ptr<Inhabitants>> Inhabitants::make(const world::World& world, const SimKnobs& knobs,
                                                              uint64_t seed) {
  const world::SimulationRequest& asked = world.simulation;
  if (asked.bodies.empty() && asked.particles.empty()) return std::unique_ptr<Inhabitants>();
  std::unique_ptr<Inhabitants> made(new Inhabitants(world, knobs, seed));
  if (!asked.bodies.empty()) {
    made->bodies_ = std::make_unique<Bodies>(world.store);
    for (const world::BodyRequest& request : asked.bodies) {
      const world::Result<BodyId> added = made->bodies_->add(description_of(request));
      if (!added)
        return world::Error{added.error().kind, fmt::format("[[body]] {}: {}", request.name, added.error().message)};
    }
    made->bodies_count_.made = true;
  }
  if (asked.particles.empty()) return made;
  const std::span<const ParticleKind> kinds = particle_kinds();
  world::VoxelBox around;
  for (const world::ParticleSource& source : asked.particles) {
    const auto kind = find_particle_kind(kinds, source.kind);
    if (!kind) {
      std::vector<std::string> names;
      for (const ParticleKind& known : kinds) names.push_back(known.name);
      return world::input_error(fmt::format("[[particles]]: there is no kind \"{}\" (did you mean \"{}\"?)",
                                            source.kind, world::nearest_text(source.kind, names)));
    }
    made->kind_of_.push_back(*kind);
    around.include(source.box);
  }
  made->particles_ =
      std::make_unique<Particles>(world.store, kinds, static_cast<size_t>(std::max(knobs.particle_limit, 1)), seed);
  made->particles_->set_origin({(around.min.x + around.max.x) / 2, around.min.y, (around.min.z + around.max.z) / 2});
  made->particles_count_.made = true;
  return made;
}

void Inhabitants::spawn(uint64_t tick) {
  for (size_t s = 0; s < kind_of_.size(); ++s) {
    const world::ParticleSource& source = world_.simulation.particles[s];
    const double per_tick = source.per_s * kMatterTick.seconds();
    particles_->spawn_in(kind_of_[s], source.box, static_cast<int>(due_in_tick(per_tick, tick)), source.velocity,
                         source.spread_mps, particle_settings_);
  }
}

void Inhabitants::set_unloaded(world::RegionPos r, bool unloaded) {
  if (!bodies_) return;
  bodies_->set_unloaded(r, unloaded);
  awake_ = true;
}

void Inhabitants::step(uint64_t tick) {
  if (bodies_) {
    const auto start = std::chrono::steady_clock::now();
    // A level that rises within a voxel changes no block: what sleeps in a liquid looks up now and then.
    if (tick % kTicksToLookUp == 0)
      for (const Body& body : bodies_->all())
        if (body.state == BodyState::asleep && body.submerged > 0) bodies_->set_velocity(body.id, {0, 0, 0});
    const BodyReport report = bodies_->step(body_settings_);
    awake_ = report.awake > 0;
    bodies_count_.moved += report.awake;
    bodies_count_.ms += ms_since(start);
  }
  if (!particles_) return;
  const auto start = std::chrono::steady_clock::now();
  spawn(tick);
  particles_count_.moved += particles_->step(particle_settings_).moved;
  particles_count_.ms += ms_since(start);
}

Inhabitants::Count Inhabitants::bodies_count() const {
  Count count = bodies_count_;
  if (bodies_) count.bytes = bodies_->all().size() * sizeof(Body);
  return count;
}

Inhabitants::Count Inhabitants::particles_count() const {
  Count count = particles_count_;
  if (particles_) count.bytes = particles_->bytes();
  return count;
}

std::string Inhabitants::state() const {
  std::string text;
  if (!bodies_) return text;
  constexpr char kDigits[] = "0123456789abcdef";
  for (const char c : bodies_->bytes()) {
    const auto byte = static_cast<unsigned char>(c);
    text += kDigits[byte >> 4], text += kDigits[byte & 15];
  }
  return text;
}

world::Status Inhabitants::restore(std::string_view state) {
  if (!bodies_) return world::input_error("the world holds bodies, but asks for none");
  std::string bytes;
  for (size_t i = 0; i + 1 < state.size(); i += 2) {
    const int high = digit_of(state[i]), low = digit_of(state[i + 1]);
    if (high < 0 || low < 0) return world::input_error("bodies are written in hexadecimal digits");
    bytes += static_cast<char>(high << 4 | low);
  }
  return bodies_->restore(bytes);
}

}  // namespace sim
