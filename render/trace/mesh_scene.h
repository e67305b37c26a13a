/// The meshes of a world as rays meet them: Embree behind a header that knows no Embree.
#pragma once

#include <memory>
#include <vector>

#include "world/base/errors.h"
#include "world/space/grid_walk.h"
#include "world/world.h"

namespace render {

using world::Vec3d;
using world::Vec3f;

struct MeshHit {
  bool hit = false;
  double t = 0;           // in lengths of the ray's direction
  uint32_t instance = 0;  // index into World::meshes
  uint32_t triangle = 0;
  Vec3f normal{0};          // geometric, unit, out of the front side
  Vec3f shading_normal{0};  // interpolated where the instance is smooth, else the same
  float u = 0, v = 0;       // texture coordinates; barycentric where the mesh has none
  Vec3d point{0};           // relative to the ray's start voxel, on the triangle within `error`
  Vec3d error{0};
};

/// Which triangle a ray starts on, so that it doesn't meet it again at its start. Default: none.
struct MeshOrigin {
  uint32_t instance = 0xffffffffu, triangle = 0xffffffffu;
};

class MeshScene {
 public:
  /// Cheap where the world has no meshes: then empty() holds and nothing is allocated.
  static world::Result<MeshScene> build(const world::World& world);
  MeshScene();
  MeshScene(MeshScene&&) noexcept;
  MeshScene& operator=(MeshScene&&) noexcept;
  ~MeshScene();

  bool empty() const;
  size_t bytes() const;
  /// The nearest hit with 0 <= t <= ray.t_max.
  MeshHit intersect(const world::GridRay& ray, MeshOrigin from = {}) const;
  /// Whether anything opaque (no null surface, an opaque block's material) lies on the ray.
  bool occluded(const world::GridRay& ray, MeshOrigin from = {}) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace render
