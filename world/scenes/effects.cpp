#include "world/scenes/effects.h"

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

}  // namespace

std::vector<EffectCall> called_effects(const World& world) {
  std::vector<EffectCall> effects;
  const Irradiance3& sun = world.environment.sun_irradiance;
  const bool sunlit = sun.max() > 0 && world.environment.sun_direction.y > -1;
  effects.push_back({"sun", sunlit, sunlit ? "the scene has a sun" : "the sun's irradiance is 0"});
  const bool sky = world.environment.sky_zenith.max() > 0 || world.environment.sky_horizon.max() > 0;
  effects.push_back({"sky", sky, sky ? "the scene has a sky" : "the sky's radiance is 0"});
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
  return effects;
}

}  // namespace world
