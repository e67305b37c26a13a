/// Impostors of what is far: as close to where things are as their bound says, without holes, up to date, and absent
/// where the knob is 0.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "render/raster/culling.h"
#include "render/raster/impostor_view.h"
#include "render/raster/raster.h"
#include "render/raster/rasterizer.h"
#include "tests/render/raster/compare_pictures.h"
#include "tests/render/raster/far_pictures.h"
#include "tests/render/raster/small_worlds.h"
#include "world/base/random.h"

namespace render {
namespace {

constexpr int kWidth = 320, kHeight = 180;

/// Hills of 512 x 512 voxels without an edge in sight, rough enough to have many faces.
world::World rough_hills(world::VoxelPos offset = {}) {
  world::World w(world::standard_blocks());
  world::EditBatch batch;
  const world::BlockId stone = block(w, "stone"), grass = block(w, "grass"), sand = block(w, "sand");
  for (int x = -256; x < 256; ++x)
    for (int z = -256; z < 256; ++z) {
      const uint64_t h = world::mix64(static_cast<uint64_t>((x + 1000) * 4096 + z + 1000));
      const int top = static_cast<int>(20 + 9 * std::sin(x * 0.05) * std::cos(z * 0.043) + 4 * std::sin(z * 0.21)) +
                      static_cast<int>(h % 3);
      batch.fill(box_at(offset, {x, 0, z}, {x, top - 1, z}), stone);
      batch.set(offset + world::VoxelPos{x, top, z}, h % 5 ? grass : sand);
    }
  apply(w, batch);
  // A ground that no surface looks like: what a hole shows.
  w.environment.sky_ground = w.environment.sky_horizon = {-1, -1, -1};
  return w;
}

RenderKnobs with_impostors(float error_px) {
  RenderKnobs knobs;
  knobs.impostor_error_px = error_px;
  knobs.lod_error_px = 2;
  knobs.sun_shadow = SunShadow::none;
  knobs.textures = TextureFilter::off;
  knobs.transparency = Transparency::opaque;
  return knobs;
}

Frame frame(Backend& backend, const world::World& w, const Camera& camera, const RenderKnobs& knobs, int scale = 1) {
  return draw(backend, w, camera, knobs, scale * kWidth, scale * kHeight);
}

/// Once its impostors are made.
Frame settled_frame(Backend& backend, const world::World& w, const Camera& camera, const RenderKnobs& knobs) {
  for (int i = 0; i < 6; ++i) frame(backend, w, camera, knobs);
  return frame(backend, w, camera, knobs);
}

Camera over_the_hills(Vec3d moved = {}, world::VoxelPos offset = {}) {
  const Vec3d at = Vec3d(-200.3, 45.2, 3.4) + moved;
  return camera_at(offset, at, {1, -0.12, 0.1});
}

TEST(Impostors, ShowEveryPointAsNearToItsPlaceAsTheirBoundSays) {
  uint64_t numbers = 0;
  const auto within = [&](double low, double high) {
    return low + (high - low) * world::uniform01_double(world::mix64(++numbers));
  };
  double closest = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3d middle(within(-300, 300), within(-40, 40), within(-300, 300));
    const Vec3d half(within(1, 60), within(1, 30), within(1, 60));
    Camera eye;
    eye.position = world::WorldPoint::from(0.3, 0.4, 0.5);
    const auto view = raster::impostor_view(eye, middle - half, middle + half, 0.003, 100000);
    if (!view) continue;
    const Vec3d moved = within(0, 0.5 * view->nearest) *
                        glm::normalize(Vec3d(within(-1, 1), within(-1, 1), within(-1, 1)) + Vec3d(1e-9));
    const double bound = view->error(glm::length(moved));
    const PixelRays rays = view->rays();
    const Vec3d forward = rays.forward;
    for (int k = 0; k < 50; ++k) {
      const Vec3d p = middle + Vec3d(within(-1, 1), within(-1, 1), within(-1, 1)) * half;
      const double z = glm::dot(p, forward);
      ASSERT_GE(z, view->nearest * (1 - 1e-9));
      // Where its texel's middle lies, and where that is shown: on the plane.
      const double u = glm::dot(p / z - rays.corner, rays.step_x) / glm::dot(rays.step_x, rays.step_x);
      const double v = glm::dot(p / z - rays.corner, rays.step_y) / glm::dot(rays.step_y, rays.step_y);
      ASSERT_TRUE(u >= 0 && u < view->width && v >= 0 && v < view->height);
      const Vec3d through = rays.direction(std::floor(u), std::floor(v)), shown = view->plane() * through - moved;
      // What the middle of the texel sees, at the point's depth, shows at a corner of the texel at most.
      const Vec3d seen = z * rays.direction(std::floor(u) + 0.5, std::floor(v) + 0.5) - moved;
      const double angle = std::atan2(glm::length(glm::cross(seen, shown)), glm::dot(seen, shown));
      ASSERT_LE(angle, bound) << i;
      closest = std::max(closest, angle / bound);
    }
    const double reach = view->reach(2 * view->error(0));
    EXPECT_LE(view->error(reach), 2 * view->error(0));
  }
  EXPECT_GT(closest, 0.7);  // the bound is no more than it need be
}

TEST(Impostors, OfAStillAndATurningCameraShowWhatIsWithinTheTexelsError) {
  auto raster = make_raster({.validation = true}), exact = make_raster({.validation = true});
  ASSERT_TRUE(raster.ok() && exact.ok());
  const world::World w = rough_hills();
  Camera camera = over_the_hills();
  settled_frame(**raster, w, camera, with_impostors(2));
  for (const double turn : {0.0, 0.013, 0.11}) {
    camera.forward = glm::normalize(Vec3d(1, -0.12, 0.1 + turn));
    const Frame drawn = frame(**raster, w, camera, with_impostors(2));
    EXPECT_GT(work(drawn, "impostors"), 3u);
    RenderKnobs faces = with_impostors(0);
    faces.lod_error_px *= 3;  // the same levels in a picture three times as large
    const Frame large = frame(**exact, w, camera, faces, 3);
    // A quarter of 2 px, at the picture's corner up to twice as much, and the middle of a third of a pixel.
    const double radius = 0.5 * 2 + 0.25;
    // Where levels blend, both pictures choose pixel by pixel, each its own.
    const size_t wrong = misplaced(drawn.image, large.image, radius),
                 of_faces = misplaced(frame(**exact, w, camera, with_impostors(0)).image, large.image, radius);
    std::printf("  %zu and %zu of %zu pixels, %llu impostors\n", wrong, of_faces, drawn.image.pixels.size(),
                static_cast<unsigned long long>(work(drawn, "impostors")));
    // Beside slivers thinner than a third of a pixel: what spreads at the sides of chunks, 0.30 to 0.32 % of these.
    EXPECT_LT(wrong, of_faces + drawn.image.pixels.size() / 200);
  }
  EXPECT_EQ((*raster)->messages(), std::vector<std::string>{});
}

TEST(Impostors, OfAMovingCameraStayWithinTheKnobAndShowNoHole) {
  auto raster = make_raster({.validation = true}), exact = make_raster({.validation = true});
  ASSERT_TRUE(raster.ok() && exact.ok());
  const world::World w = rough_hills();
  const float knob = 3;
  settled_frame(**raster, w, over_the_hills(), with_impostors(knob));
  uint64_t made = 0;
  for (int step = 1; step <= 24; ++step) {
    const Camera camera = over_the_hills({0.4 * step, 0.15 * step, 0.25 * step});
    const Frame drawn = frame(**raster, w, camera, with_impostors(knob));
    made += work(drawn, "impostors_made");
    EXPECT_GT(work(drawn, "impostors"), 0u);
    const Image faces = frame(**exact, w, camera, with_impostors(0)).image;
    EXPECT_EQ(holes(w.environment.sky_ground, drawn.image, faces, 4), 0u) << step;
    if (step % 8) continue;
    RenderKnobs coarse = with_impostors(0);
    coarse.lod_error_px *= 3;
    const Frame large = frame(**exact, w, camera, coarse, 3);
    EXPECT_LT(misplaced(drawn.image, large.image, 2 * knob),
              misplaced(faces, large.image, 2 * knob) + drawn.image.pixels.size() / 500);
  }
  EXPECT_GT(made, 0u);
  EXPECT_EQ((*raster)->messages(), std::vector<std::string>{});
}

TEST(Impostors, ShowAnEditAtOnce) {
  auto raster = make_raster({.validation = true}), fresh = make_raster({.validation = true});
  ASSERT_TRUE(raster.ok() && fresh.ok());
  world::World w = rough_hills();
  const Camera camera = over_the_hills();
  const RenderKnobs knobs = with_impostors(2);
  const Frame before = settled_frame(**raster, w, camera, knobs);
  ASSERT_GT(work(before, "impostors"), 0u);
  world::EditBatch batch;
  batch.fill({{60, 10, -20}, {110, 60, 20}}, block(w, "brick_red"));
  batch.fill({{-20, 0, -60}, {30, 40, -30}}, world::kAir);
  apply(w, batch);
  const Frame after = frame(**raster, w, camera, knobs), anew = frame(**fresh, w, camera, knobs);
  EXPECT_EQ(work(anew, "impostors"), 0u);  // its first picture
  // What the edit changed is drawn of faces again: the same, pixel for pixel.
  const Image was = frame(**fresh, rough_hills(), camera, knobs).image;
  size_t changed = 0, wrong = 0;
  for (size_t i = 0; i < was.pixels.size(); ++i) {
    if (was.pixels[i] == anew.image.pixels[i]) continue;
    ++changed;
    wrong += !(after.image.pixels[i] == anew.image.pixels[i]);
  }
  std::printf("  %zu of %zu\n", wrong, changed);
  EXPECT_GT(changed, 300u);
  EXPECT_LT(wrong, changed / 20);  // seen past what was taken away: impostors
  // And a world that changes all the time goes without.
  for (int i = 0; i < 6; ++i) {
    world::EditBatch more;
    more.set({80, 61 + i, 0}, block(w, "sand"));
    apply(w, more);
    EXPECT_LT(work(frame(**raster, w, camera, knobs), "faces_in_impostors"), work(before, "faces_in_impostors"));
  }
}

TEST(Impostors, AreTheSameFarFromTheOrigin) {
  const world::VoxelPos far{1 << 29, 0, -(1 << 29)};
  const world::World here = rough_hills(), there = rough_hills(far);
  auto one = make_raster({.validation = true}), other = make_raster({.validation = true});
  ASSERT_TRUE(one.ok() && other.ok());
  for (int step = 0; step < 12; ++step) {
    const Vec3d moved = 0.3 * std::max(0, step - 6) * Vec3d(1, 0.2, 0.4);
    const Frame a = frame(**one, here, over_the_hills(moved), with_impostors(2));
    const Frame b = frame(**other, there, over_the_hills(moved, far), with_impostors(2));
    EXPECT_EQ(work(a, "impostors"), work(b, "impostors"));
    EXPECT_TRUE(same(a.image, b.image)) << step;
    if (step == 11) {
      EXPECT_GT(work(a, "impostors"), 0u);
    }
  }
}

TEST(Impostors, AreAbsentWhereTheKnobIsZeroAndKeepToTheirMemory) {
  auto raster = make_raster({.validation = true}), fresh = make_raster({.validation = true});
  ASSERT_TRUE(raster.ok() && fresh.ok());
  const world::World w = rough_hills();
  const Camera camera = over_the_hills();
  const Frame with = settled_frame(**raster, w, camera, with_impostors(2));
  EXPECT_TRUE(has_row(with, "impostors"));
  const Frame without = frame(**raster, w, camera, with_impostors(0));
  EXPECT_FALSE(has_row(without, "impostors"));
  EXPECT_TRUE(same(without.image, frame(**fresh, w, camera, with_impostors(0)).image));
  // Room for one page, and then for none.
  uint64_t last = work(with, "impostors");
  for (const uint64_t mib : {40, 1}) {
    (*raster)->rasterizer().impostor_bytes = mib << 20;
    frame(**raster, w, camera, with_impostors(0));
    const Frame less = settled_frame(**raster, w, camera, with_impostors(2));
    EXPECT_LE(work(less, "impostors"), last);
    last = work(less, "impostors");
    for (const PassReport& p : less.report.passes)
      if (p.name == "impostors") {
        EXPECT_LE(p.bytes, mib << 20);
      }
  }
  EXPECT_EQ(last, 0u);
}

}  // namespace
}  // namespace render
