#include "tools/bench/sight_lines.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tools/picture.h"

namespace tools {
namespace {

double mean_of(const std::vector<world::Vec3d>& lines) {
  double sum = 0;
  for (const world::Vec3d& l : lines) sum += l.x + l.y + l.z;
  return sum / (3 * static_cast<double>(lines.size()));
}

/// In a box that a block lights, which paths find and light that comes straight doesn't: it has the lamp itself alone,
/// a third less than all. Pixels hold edges, to the black around the box too, where points of them don't: a tenth.
TEST(SightLines, ShowByPathsWhatPicturesByPathsShow) {
  const auto scene = world::load_scene("cornell_voxels");
  ASSERT_TRUE(scene.ok());
  const auto lines = SightLines::make(*scene, 36, 24);
  ASSERT_TRUE(lines.ok());
  render::RenderKnobs knobs;
  knobs.max_depth = 16, knobs.spp = 256;
  const auto backend = make_backend("reference");
  ASSERT_TRUE(backend.ok());
  const auto picture = (*lines)->picture(**backend, knobs);
  ASSERT_TRUE(picture.ok());
  const double by_picture = mean_of(*picture);
  const double by_lines = mean_of((*lines)->radiance(render::LightTransport::path, knobs, 256, 1));
  EXPECT_GT(by_picture, 0);
  EXPECT_NEAR(by_lines, by_picture, 0.15 * by_picture);
  EXPECT_LT(mean_of((*lines)->radiance(render::LightTransport::direct, knobs, 1, 1)), 0.7 * by_picture);
}

}  // namespace
}  // namespace tools
