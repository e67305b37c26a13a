/// Particles and bodies for tests of pictures: a crowd over hills(), and bodies by a pond.
#pragma once

#include <vector>

#include "render/backend.h"
#include "tests/render/raster/small_worlds.h"
#include "world/base/random.h"

namespace render {

/// Records around the middle of hills(): balls of all sizes, some in the ground, and two bodies.
struct Crowd {
  std::vector<ParticleRecord> particles;
  std::vector<BodyRecord> bodies;
  Crowd() {
    for (uint64_t i = 0; i < 400; ++i) {
      const auto u = [&](uint64_t n) { return world::uniform01(world::mix64(i * 8 + n + 5)); };
      particles.push_back({80 * u(0) - 40,
                           30 * u(1) + 4,
                           80 * u(2) - 40,
                           0.02f + 1.5f * u(3) * u(3) * u(3),
                           {u(4), 0.8f, u(5)},
                           0.1f + 0.9f * u(6),
                           {0, 0, 0}});
      // Every third one stands still.
      if (i % 3) particles.back().velocity_x = 40 * u(7) - 20, particles.back().velocity_y = 60 * u(3) - 50;
    }
    bodies.push_back({3, 24, 3, 2, 3, 1, {0.7f, 0.2f, 0.1f}});
    bodies.push_back({-20, 12, 20, 4, 4, 4, {0.1f, 0.2f, 0.7f}});  // half in the ground
  }
  Inhabitants view() const { return {{}, particles, bodies}; }
};

/// A pond, and a pane behind it.
inline world::World pond() {
  world::World w(world::standard_blocks());
  world::EditBatch batch;
  batch.fill({{-30, -9, -30}, {30, -1, 30}}, block(w, "sand"));
  batch.fill({{-20, -8, -20}, {20, -1, 20}}, block(w, "water"));
  batch.fill({{-3, 0, -12}, {3, 5, -12}}, block(w, "glass_red"));
  apply(w, batch);
  return w;
}
/// Afloat, sunk, on the ground, and behind the pane.
inline const std::vector<BodyRecord> kBodiesByThePond = {{-4, -0.2f, 2, 1, 1, 1, {0.7f, 0.7f, 0.7f}},
                                                         {4, -7.2f, 2, 1, 0.8f, 1, {0.7f, 0.2f, 0.1f}},
                                                         {24, 1, 0, 1, 1, 1, {0.2f, 0.2f, 0.7f}},
                                                         {0, 2, -16, 1, 1, 1, {0.7f, 0.7f, 0.7f}}};
inline std::vector<NamedCamera> pond_cameras() {
  return {{"from above", camera_at({}, {0.3, 9.2, 20.1}, {0.02, -0.45, -1}, 70)},
          {"from below", camera_at({}, {0.3, -5.2, 14.1}, {0.02, 0.05, -1}, 70)}};
}

}  // namespace render
