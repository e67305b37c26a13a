#include "world/scenes/effects.h"

#include <algorithm>
#include <functional>

namespace world {

namespace {

struct EffectRule {
  const char* name;
  const char* absent;  // what a world without it lacks
  bool (*calls)(const Block&);
};

// One row an effect: the block property that calls for it.
const EffectRule kBlockEffects[] = {
    {"block_light", "no block emits light", [](const Block& b) { return b.emission.max() > 0; }},
    {"transmission", "no block lets light through", [](const Block& b) { return !b.opaque && b.proxy.empty(); }},
    {"proxies", "no block has a proxy shape", [](const Block& b) { return !b.proxy.empty(); }},
    {"glossy", "every block is Lambertian", [](const Block& b) { return b.bsdf != "lambert"; }},
    {"liquid", "no block is liquid", [](const Block& b) { return b.phase == Phase::liquid; }},
    {"granular", "no block is granular", [](const Block& b) { return b.phase == Phase::granular; }},
    {"gas", "no block is a gas", [](const Block& b) { return b.phase == Phase::gas; }},
    {"fire", "no block can burn", [](const Block& b) { return b.ignition.has_value(); }},
};

/// Calls for it where some of the scene's things have strength; names the first.
template <class Things, class HasStrength>
EffectCall of_things(const char* name, const Things& things, HasStrength has_strength) {
  EffectCall call{name, false, std::string("the scene has no ") + name};
  size_t strong = 0;
  for (const auto& thing : things) {
    if (!has_strength(thing)) continue;
    if (strong++ == 0) call.why = thing.name;
  }
  call.called_for = strong > 0;
  if (strong > 1) call.why += " and others, " + std::to_string(strong);
  return call;
}

}  // namespace

std::vector<EffectCall> called_effects(const World& world) {
  std::vector<EffectCall> effects;
  const Irradiance3& sun = world.environment.sun_irradiance;
  const bool sunlit = sun.max() > 0 && world.environment.sun_direction.y > -1;
  effects.push_back({"sun", sunlit, sunlit ? "the scene has a sun" : "the sun's irradiance is 0"});
  const bool sky = world.environment.sky_zenith.max() > 0 || world.environment.sky_horizon.max() > 0;
  effects.push_back({"sky", sky, sky ? "the scene has a sky" : "the sky's radiance is 0"});
  const bool clouds = world.environment.clouds.cover > 0;
  effects.push_back({"clouds", clouds, clouds ? "the scene has [clouds]" : "the scene has no [clouds]"});
  const Census census = world.store.census();
  for (const EffectRule& rule : kBlockEffects) {
    EffectCall call{rule.name, false, rule.absent};
    uint64_t voxels = 0;
    for (const auto& [id, count] : census) {
      const Block& block = (*world.palette)[id];
      if (!rule.calls(block)) continue;
      if (!call.called_for) call.why = block.name;
      call.called_for = true;
      voxels += count;
    }
    if (call.called_for)
      call.why += voxels > census.at(*world.palette->find(call.why))
                      ? " and others, " + std::to_string(voxels) + " voxels"
                      : ", " + std::to_string(voxels) + " voxels";
    effects.push_back(call);
  }
  effects.push_back(of_things("luminaires", world.luminaires, [](const Luminaire& l) {
    return l.enabled && (l.power.max() > 0 || l.irradiance.max() > 0 || l.radiance.max() > 0);
  }));
  effects.push_back(of_things("media", world.media,
                              [](const Medium& m) { return m.absorption.max() > 0 || m.scattering.max() > 0; }));
  effects.push_back(of_things("meshes", world.meshes, [](const MeshInstance&) { return true; }));
  const SimulationRequest& asked = world.simulation;
  const auto of_tables = [&](const char* name, const std::string& table, size_t count) {
    effects.push_back(
        {name, count > 0, count > 0 ? table + " of the scene, " + std::to_string(count) : "the scene has no " + table});
  };
  of_tables("bodies", "[[body]]", asked.bodies.size());
  of_tables("particles", "[[particles]]", asked.particles.size());
  for (const std::string& name : world.simulation.effects) {
    const auto known =
        std::find_if(effects.begin(), effects.end(), [&](const EffectCall& effect) { return effect.name == name; });
    EffectCall& effect = known == effects.end() ? effects.emplace_back() : *known;
    if (!effect.called_for) effect = {name, true, "the scene asks for it"};
  }
  return effects;
}

}  // namespace world
