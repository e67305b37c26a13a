#include "tools/bench/metal_yard.h"

namespace tools {

std::shared_ptr<world::World> metal_yard() {
  auto w = std::make_shared<world::World>(world::standard_blocks());
  world::EditBatch batch;
  batch.fill({{-16, 0, -16}, {31, 0, 31}}, *w->palette->find("plaster"));
  int x = 0;
  for (const char* name : {"gold_block", "rusty_iron", "obsidian", "copper_block"}) {
    const auto block = w->palette->find(name);
    CHECK(block.has_value());
    batch.fill({{x, 1, 2}, {x + 2, 3, 4}}, *block);
    batch.fill({{x, 0, 8}, {x + 2, 0, 12}}, *block);
    x += 4;
  }
  CHECK(w->store.apply(batch).ok());
  world::CameraPlacement camera;
  camera.position = world::WorldPoint::from(7.5, 7.2, 20.3);
  camera.forward = glm::normalize(world::Vec3d(0.02, -0.42, -1));
  w->cameras.push_back(camera);
  w->environment.sun_direction =
      glm::normalize(world::Vec3d(0.25, 0.6, -0.8));  // before the camera, as highlights want
  return w;
}

}  // namespace tools
