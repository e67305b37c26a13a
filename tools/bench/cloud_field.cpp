#include "tools/bench/cloud_field.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "world/media/brick_field.h"

namespace tools {

float cloud_density(world::VoxelPos v) {
  const world::Vec3d p(v.x - 23.5, v.y - 23.5, v.z - 23.5);
  const double ball = 1 - glm::length(p) / 23, waves = std::sin(0.5 * p.x) * std::cos(0.4 * p.y + 0.3 * p.z);
  return static_cast<float>(std::max(0.0, ball + 0.4 * waves));
}

world::Result<std::shared_ptr<const world::DensityField>> cloud_field() {
  std::vector<world::FieldLeaf> leaves;
  for (int x = 0; x < kCloudLeaves; ++x)
    for (int y = 0; y < kCloudLeaves; ++y)
      for (int z = 0; z < kCloudLeaves; ++z) {
        world::FieldLeaf leaf{{x, y, z}, {}};
        for (size_t i = 0; i < leaf.values.size(); ++i)
          leaf.values[i] =
              cloud_density(world::voxel_from_leaf(leaf.leaf) + world::offset_in_leaf(static_cast<int>(i)));
        leaves.push_back(leaf);
      }
  TRY(std::shared_ptr<const world::DensityField> field,
      world::BrickField::make(std::move(leaves), world::Medium{}.sampling, "cloud"));
  return field;
}

}  // namespace tools
