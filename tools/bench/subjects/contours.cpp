/// What a ball of voxels looks like to rays as cubes, as planes and as a trilinear field, and what each costs.
///
/// Rays come from three radii away and aim at places within 0.9 radius of the middle; one that misses the shape counts
/// as wrong by a whole radius. Radii are in voxels: twice the radius is half the voxel size.
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "tools/bench/benchmark.h"
#include "world/base/random.h"
#include "world/store/contour_walk.h"

namespace tools {

namespace {

using world::ContourShape;
using world::LeafPos;
using world::Vec3d;
using world::VoxelPos;

const Vec3d kMiddle(0.31, -0.17, 0.43);  // no symmetry to any plane of the grid

struct Ball {
  double radius;
  world::MaskVolume blocks;
  std::unique_ptr<world::Contours> contours;
  std::vector<world::GridRay> rays;

  float distance(VoxelPos v) const {
    return static_cast<float>(glm::length(Vec3d(v.x + 0.5, v.y + 0.5, v.z + 0.5) - kMiddle) - radius);
  }
  Ball(double r, int count, uint64_t seed) : radius(r) {
    const int reach = static_cast<int>(std::ceil(radius)) + 3, leaves = reach / 8 + 1;
    for (int x = -leaves; x < leaves; ++x)
      for (int y = -leaves; y < leaves; ++y)
        for (int z = -leaves; z < leaves; ++z) {
          world::LeafMask mask;
          for (int i = 0; i < world::kLeafVoxels; ++i)
            if (distance(voxel_from_leaf(LeafPos{x, y, z}) + world::offset_in_leaf(i)) <= 0) mask.set(i);
          blocks.set_leaf({x, y, z}, mask);
        }
    contours =
        std::make_unique<world::Contours>(blocks,
                                          world::function_surface([this](VoxelPos v) { return distance(v); },
                                                                  {{-reach, -reach, -reach}, {reach, reach, reach}}),
                                          true);
    for (int i = 0; i < count; ++i) {
      const auto direction = [&](uint64_t stream) {
        const auto draw = [&](uint64_t k) {
          return world::uniform01_double(world::random_bits(seed, i, 0, 0, 0, stream + k));
        };
        const double y = 2 * draw(0) - 1, turn = 6.283185307179586 * draw(1), w = std::sqrt(1 - y * y);
        return Vec3d(w * std::cos(turn), y, w * std::sin(turn));
      };
      const Vec3d from = kMiddle + 3 * radius * direction(0), aim = kMiddle + 0.9 * radius * direction(2);
      rays.emplace_back(world::WorldPoint::from(from.x, from.y, from.z), glm::normalize(aim - from));
    }
  }
  Ball(const Ball&) = delete;

  world::ContourHit cast(const world::GridRay& ray, ContourShape shape, const world::MaskWalker& cubes,
                         const world::ContourWalker& smooth) const {
    if (shape != ContourShape::off) return smooth.first_hit(ray);
    world::ContourHit hit{cubes.first_set(ray)};
    if (hit.hit() && hit.grid.face >= 0) hit.normal[world::face_axis(hit.grid.face)] = world::face_sign(hit.grid.face);
    return hit;
  }
};

ErrorSample errors_of(const Ball& ball, ContourShape shape) {
  const world::MaskWalker cubes(ball.blocks);
  const world::ContourWalker smooth(*ball.contours, shape);
  double places = 0, worst_place = 0, normals = 0, bias = 0;
  for (const world::GridRay& ray : ball.rays) {
    const world::ContourHit hit = ball.cast(ray, shape, cubes, smooth);
    double height = -ball.radius, angle = 90;
    if (hit.hit()) {
      const Vec3d start = Vec3d(ray.voxel.x, ray.voxel.y, ray.voxel.z) + ray.fraction;
      const Vec3d out = start + hit.grid.t * ray.direction - kMiddle;
      height = glm::length(out) - ball.radius;
      angle = 57.29577951308232 * std::atan2(glm::length(glm::cross(out, hit.normal)), glm::dot(out, hit.normal));
    }
    places += height * height, worst_place = std::max(worst_place, std::abs(height));
    normals += angle * angle, bias += height;
  }
  const double n = static_cast<double>(ball.rays.size());
  return {{std::sqrt(places / n), worst_place, std::sqrt(normals / n)}, bias / n};
}

double cast_all(const Ball& ball, ContourShape shape) {
  const world::MaskWalker cubes(ball.blocks);
  const world::ContourWalker smooth(*ball.contours, shape);
  double sum = 0;
  for (const world::GridRay& ray : ball.rays) sum += ball.cast(ray, shape, cubes, smooth).grid.t;
  keep(sum);
  return static_cast<double>(ball.rays.size());
}

}  // namespace

void add_subject_contours(Registry& registry) {
  Subject subject{.question = "what does a smooth surface cost in place of cubes, at the same voxel size?",
                  .reference = "the ball itself, closed form",
                  .metrics = {"RMS distance of hits from the surface (voxels)", "worst distance (voxels)",
                              "RMS angle of the normal (degrees)"},
                  .work_unit = "rays, one by one"};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    for (const double radius : {4.0, 16.0, 64.0}) {
      const auto ball = std::make_shared<const Ball>(radius, context.quick() ? 5000 : 100000, context.seed());
      for (const auto& [shape, name] :
           {std::pair{ContourShape::off, "cubes"}, std::pair{ContourShape::planes, "planes"},
            std::pair{ContourShape::field, "field"}}) {
        Setting s{.method = name, .setting = fmt::format("{}@radius {}", name, radius)};
        s.problem = fmt::format("radius {} voxels", radius), s.knob = radius, s.is_default = shape == ContourShape::off;
        s.measure = [ball, shape = shape](uint64_t) { return errors_of(*ball, shape); };
        s.run = [ball, shape = shape] { return cast_all(*ball, shape); };
        settings.push_back(std::move(s));
      }
    }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
