/// Small worlds of light for tests of the ray backends, and pictures of them.
#pragma once

#include <cmath>
#include <cstring>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "render/reference/reference.h"
#include "render/raycast/raycast.h"
#include "render/trace/film.h"
#include "render/trace/picture.h"
#include "world/world.h"

namespace render {

constexpr double kTestPi = 3.14159265358979323846;

/// Air in the dark.
inline world::World dark_world() {
  world::World w(world::standard_blocks());
  world::Environment& e = w.environment;
  e.sun_irradiance = {};
  e.sky_zenith = e.sky_horizon = e.sky_ground = {};
  return w;
}

inline void set_sky(world::World& w, float radiance) {
  w.environment.sky_zenith = w.environment.sky_horizon = w.environment.sky_ground = {radiance, radiance, radiance};
}

inline world::Block matte(const std::string& name, world::Ratio3 albedo, world::Radiance3 emitted = {}) {
  world::Block b;
  b.name = name;
  b.albedo = albedo;
  const float whole = static_cast<float>(6 * kTestPi);
  b.emission = {emitted.r * whole, emitted.g * whole, emitted.b * whole};
  return b;
}

inline world::BlockId add_block(world::World& w, world::Block block) {
  const auto added = w.palette->add(std::move(block));
  EXPECT_TRUE(added.ok()) << (added.ok() ? "" : added.error().message);
  return added.ok() ? *added : world::kAir;
}

inline void fill(world::World& w, world::VoxelBox box, world::BlockId block) {
  world::EditBatch batch;
  batch.fill(box, block);
  EXPECT_TRUE(w.store.apply(batch).ok());
}

/// Walls of one voxel around the voxels of `inside`.
inline void fill_walls(world::World& w, world::VoxelBox inside, world::BlockId block) {
  fill(w, {inside.min - world::VoxelPos{1, 1, 1}, inside.max + world::VoxelPos{1, 1, 1}}, block);
  fill(w, inside, world::kAir);
}

inline Camera looking(Vec3d position, Vec3d target, double fov_deg) {
  Camera c;
  c.position = world::WorldPoint::from(position.x, position.y, position.z);
  c.forward = glm::normalize(target - position);
  c.vertical_fov = fov_deg * kTestPi / 180;
  return c;
}

inline RenderKnobs sampled(int spp, SampleSequence sequence = SampleSequence::random) {
  RenderKnobs k;
  k.spp = spp;
  k.max_depth = 0;
  k.sample_sequence = sequence;
  k.light_transport = LightTransport::path;
  return k;
}

inline Frame trace(const world::World& w, const Camera& camera, const RenderKnobs& knobs, int width, int height,
                   const Sampling& sampling = {}) {
  const world::WorldView view(w);
  world::Result<Frame> frame = trace_picture(view, camera, knobs, sampling, width, height);
  EXPECT_TRUE(frame.ok()) << (frame.ok() ? "" : frame.error().message);
  return frame.ok() ? std::move(*frame) : Frame{Image(width, height), {}};
}

inline bool same_bits(const Image& a, const Image& b) {
  return a.width == b.width && a.height == b.height &&
         std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(Rgb)) == 0;
}

/// The mean of a picture and its standard error, by band, over pixels taken as equal: their spread says the error.
struct PictureMean {
  double mean[3] = {0, 0, 0}, error[3] = {0, 0, 0};
};
inline PictureMean mean_of(const Image& image) {
  PixelSamples sum;
  for (const Rgb& p : image.pixels) sum.add(Vec3d(p.r, p.g, p.b));
  PictureMean m;
  for (int b = 0; b < 3; ++b) {
    m.mean[b] = sum.mean[b];
    m.error[b] = std::sqrt(sum.squares[b] / (sum.count - 1) / sum.count);
  }
  return m;
}

/// Each band's mean lies within 4 standard errors of what it should be: 1 in 16,000 trials fails by chance, and trials
/// are the same each time.
inline void expect_mean(const Image& image, Vec3d expected, const char* what, double relative_floor = 1e-6) {
  const PictureMean m = mean_of(image);
  for (int b = 0; b < 3; ++b)
    EXPECT_NEAR(m.mean[b], expected[b], 4 * m.error[b] + relative_floor * std::abs(expected[b]))
        << what << ", band " << b << ", standard error " << m.error[b];
}

inline uint64_t work(const FrameReport& report, const std::string& name) {
  for (const EffectWork& e : report.work)
    if (e.name == name) return e.work;
  ADD_FAILURE() << "no work is counted as " << name;
  return 0;
}

}  // namespace render
