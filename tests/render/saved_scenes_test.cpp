/// A scene and its save give the same picture, sample for sample.
#include <gtest/gtest.h>

#include "render/light_files.h"
#include "tests/render/trace/trace_worlds.h"
#include "tests/support.h"
#include "world/scenes/scene.h"

namespace render {
namespace {

using namespace world;

Result<World> built(const std::string& name) {
  TRY(const Scene scene, load_scene(name));
  ImportReport report;
  TRY(World world, build_world(scene, report));
  TRY_STATUS(load_light_files(world));
  return world;
}

TEST(SavedScenes, GiveTheSamePictureAsTheScenes) {
  const TemporaryFolder folder;
  for (const char* name : {"cornell", "nightclub", "caustics", "fog_volumes", "gobo", "furnace"}) {
    SCOPED_TRACE(name);
    const auto scene = built(name);
    ASSERT_TRUE(scene.ok()) << scene.error().message;
    const auto path = folder / (std::string(name) + ".loam");
    ASSERT_TRUE(write_world(*scene, path).ok());
    const auto saved = built(path.string());
    ASSERT_TRUE(saved.ok()) << saved.error().message;
    EXPECT_EQ(saved->knobs, scene->knobs);
    const auto a = camera_of(*scene, ""), b = camera_of(*saved, "");
    ASSERT_TRUE(a.ok() && b.ok());
    EXPECT_EQ(a->name, b->name);
    const Image first = trace(*scene, Camera::from(*a), sampled(4), 24, 16).image;
    const Image second = trace(*saved, Camera::from(*b), sampled(4), 24, 16).image;
    EXPECT_EQ(first.pixels, second.pixels);
    double light = 0;
    for (const Radiance3& pixel : first.pixels) light += pixel.r + pixel.g + pixel.b;
    EXPECT_GT(light, 0) << "a black picture says nothing";
  }
}

}  // namespace
}  // namespace render
