/// Light in voxels around triangles: meshes and smooth surfaces are lit as the world is, by both backends.
#include "render/light/voxel_light.h"

#include <deque>

#include <gtest/gtest.h>

#include "render/raster/rasterizer.h"
#include "render/raster/triangle_light.h"
#include "tests/render/raster/both_backends.h"
#include "tests/render/raster/compare_pictures.h"
#include "tests/render/raster/small_meshes.h"

namespace render {
namespace {

using world::LightVolume;
using world::Vec3d;
using world::VoxelPos;
using world::World;

constexpr int kWidth = 240, kHeight = 135;

/// A room of 20 x 8 x 20 within rock, with a lamp on its floor and a pillar; or with nothing but the rock.
World cave(bool lit) {
  World w(world::standard_blocks());
  world::EditBatch batch;
  batch.fill({{-16, -6, -16}, {16, 14, 16}}, block(w, "limestone"));
  batch.fill({{-10, 0, -10}, {9, 7, 9}}, world::kAir);
  batch.fill({{-4, 0, 2}, {-4, 7, 2}}, block(w, "marble"));
  if (lit) batch.set({4, 0, -3}, block(w, "lamp_warm"));
  apply(w, batch);
  return w;
}
Camera in_cave() { return camera_at({}, {8.3, 4.6, 8.2}, {-0.8, -0.4, -1}, 75); }

/// Levels of a world's own regions: the sky's 15 but below the highest opaque voxel of a column, and block light that
/// loses one a voxel from the blocks that glow, in each band from another level.
LightVolume flooded(const World& w) {
  LightVolume volume(world::LightModel::flood_rgb, 15, false);
  const world::MaskVolume& opaque = w.store.masks(world::MaskKind::opaque);
  for (const world::RegionPos r : w.store.regions())
    for (world::LightField& field : volume.fields()) {
      world::LightRegion& region = field.regions().insert(r);
      region.set_tile(&field == &volume.sky() ? 15 : 0);
      region.split();
    }
  const auto set = [&](world::LightField& field, VoxelPos v, int level) {
    world::LightRegion* region = field.regions().find(world::region_from_voxel(v));
    if (!region) return;
    const int at = world::index_in_region(world::leaf_from_voxel(v));
    const world::LightLeafView view = region->leaf(at);
    world::LightLeaf leaf = view.leaf ? *view.leaf : world::LightLeaf::of(view.tile);
    leaf.set(world::index_in_leaf(v), level);
    region->set_leaf(at, leaf);
  };
  const world::VoxelBox box = w.store.bounds();
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int z = box.min.z; z <= box.max.z; ++z) {
      int y = box.max.y;
      while (y >= box.min.y && !opaque.test({x, y, z})) --y;
      for (; y >= box.min.y; --y) set(volume.sky(), {x, y, z}, 0);
    }
  std::deque<std::pair<VoxelPos, int>> open;
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z)
        if ((*w.palette)[w.store.get({x, y, z})].emission.max() > 0) open.push_back({{x, y, z}, 15});
  while (!open.empty()) {
    const auto [v, level] = open.front();
    open.pop_front();
    for (int face = 0; face < world::kFaces && level > 1; ++face) {
      const VoxelPos next = v + world::face_step(face);
      if (opaque.test(next) || volume.block(0).get(next) >= level - 1) continue;
      set(volume.block(0), next, level - 1);
      set(volume.block(1), next, std::max(level - 3, 0));
      set(volume.block(2), next, std::max(level - 6, 0));
      open.emplace_back(next, level - 1);
    }
  }
  return volume;
}

/// Of every wall in a box of leaves what `arrives` says.
world::SurfaceIrradiance irradiance(const World& w, world::LeafPos low, std::array<int32_t, 3> size,
                                    world::FunctionRef<world::Irradiance3(VoxelPos, int)> arrives) {
  world::SurfaceIrradiance made;
  made.low = low, made.size = size;
  const world::MaskVolume& opaque = w.store.masks(world::MaskKind::opaque);
  for (int x = 0; x < size[0]; ++x)
    for (int y = 0; y < size[1]; ++y)
      for (int z = 0; z < size[2]; ++z) {
        world::SurfaceIrradiance::Leaf& leaf = made.leaves.emplace_back();
        const VoxelPos corner = world::voxel_from_leaf(low + world::LeafPos{x, y, z});
        for (int face = 0; face < world::kFaces; ++face)
          for (int v = 0; v < world::kLeafVoxels; ++v) {
            if ((v & 63) == 0) leaf.first[face][v >> 6] = static_cast<uint32_t>(made.values.size());
            const VoxelPos voxel = corner + world::offset_in_leaf(v);
            if (opaque.test(voxel) || !opaque.test(voxel + world::face_step(face))) continue;
            leaf.wall[face].set(v);
            made.values.push_back(arrives(voxel, face));
          }
      }
  return made;
}
/// Brighter beside the lamp of the cave, and otherwise for each face.
world::SurfaceIrradiance of_cave(const World& w) {
  return irradiance(w, {-3, -1, -3}, {6, 4, 6}, [](VoxelPos v, int face) {
    const float distance = static_cast<float>(glm::length(Vec3d(v.x - 4, v.y, v.z + 3)));
    const float e = 900 / (1 + distance * distance) * (1 + 0.2f * static_cast<float>(face));
    return world::Irradiance3{e, 0.8f * e, 0.5f * e};
  });
}

std::vector<world::MeshInstance> some_meshes(const World& w) {
  world::MeshInstance round = instance(w, ball(2, 48), "brick_red", {}, {1.2, 2.3, -2.4});
  round.smooth = true;
  return {round, instance(w, ball(1.6, 10), "marble", {}, {6.1, 1.3, 1.7}),
          instance(w, sheet(2), "grass", {}, {-2.1, 3.2, -5.3}, glm::dmat3({1, 0.4, 0}, {0, 1, 0.3}, {0, 0.3, 1}))};
}

RenderKnobs with(LightModel model, LightInterpolation interpolation) {
  RenderKnobs knobs;
  // Layers, coarser levels and filters of textures are other tests'.
  knobs.transparency = Transparency::opaque, knobs.lod_error_px = 0, knobs.textures = TextureFilter::off;
  knobs.light_model = model, knobs.light_interpolation = interpolation;
  return knobs;
}

constexpr LightInterpolation kInterpolations[] = {LightInterpolation::face, LightInterpolation::linear};

class VoxelLightPictures : public BothBackends {};

TEST_F(VoxelLightPictures, AMeshInAClosedCaveIsDark) {
  World w = cave(false);
  w.meshes = some_meshes(w);
  const LightVolume levels = flooded(w);
  const world::SurfaceIrradiance none =
      irradiance(w, {-3, -1, -3}, {6, 4, 6}, [](VoxelPos, int) { return world::Irradiance3{}; });
  for (Backend* backend : {static_cast<Backend*>(raster_.get()), raycast_.get()}) {
    backend->light = {&levels, &none, 1};
    const auto brightest = [&](const RenderKnobs& knobs) {
      float most = 0;
      for (const Rgb& p : draw(*backend, w, in_cave(), knobs, kWidth, kHeight).image.pixels)
        most = std::max(most, p.max());
      return most;
    };
    const float open = brightest(with(LightModel::none, {}));
    EXPECT_GT(open, 0.1f) << "under the open sky it glows";
    for (const LightModel model : {LightModel::flood_rgb, LightModel::flux})
      for (const LightInterpolation interpolation : kInterpolations) {
        RenderKnobs knobs = with(model, interpolation);
        if (model == LightModel::flood_rgb) knobs.sun_shadow = SunShadow::sky_light;
        // The squares of a normal's parts sum to 1 but for rounding.
        EXPECT_LE(brightest(knobs), 1e-5f * open) << static_cast<int>(model) << static_cast<int>(interpolation);
      }
  }
}

/// A sheet of the floor's block a hundredth of a metre above the floor: the voxel before it is the one before the
/// floor's faces, so the light is the same; between middles too, since what is closed has no part, but on the faces
/// that touch the lamp, where the floor counts the lamp's place as each face's own.
TEST_F(VoxelLightPictures, BesideALampAMeshIsLitAsTheFloorBesideIt) {
  World bare = cave(true), covered = cave(true);
  covered.meshes = {instance(covered, sheet(4), "limestone", {}, {3.3, 0.01, -2.9})};
  bare.meshes = {instance(bare, sheet(0.01f), "limestone", {}, {0, -3, 0})};  // unseen, for the same code
  const Camera camera = camera_at({}, {6.4, 5.3, 1.2}, {-0.25, -1, -0.4}, 50);
  const LightVolume levels = flooded(bare);
  const world::SurfaceIrradiance arrives = of_cave(bare);
  for (Backend* backend : {static_cast<Backend*>(raster_.get()), raycast_.get()}) {
    backend->light = {&levels, &arrives, 1};
    for (const LightModel model : {LightModel::flood_rgb, LightModel::flux})
      for (const LightInterpolation interpolation : {LightInterpolation::face, LightInterpolation::linear}) {
        const RenderKnobs knobs = with(model, interpolation);
        const Image floor = draw(*backend, bare, camera, knobs, kWidth, kHeight).image,
                    sheet = draw(*backend, covered, camera, knobs, kWidth, kHeight).image;
        EXPECT_FALSE(same(floor, sheet)) << "the sheet is in the picture";
        // A hundredth of a metre moves borders between faces by a pixel's part.
        size_t beyond = 0;
        for (size_t i = 0; i < floor.pixels.size(); ++i) {
          const Rgb a = floor.pixels[i], b = sheet.pixels[i];
          beyond += std::abs(a.g - b.g) > 0.01f * std::max(a.g, b.g);
        }
        const size_t at_most = floor.pixels.size() * (interpolation == LightInterpolation::face ? 10 : 25) / 1000;
        EXPECT_LE(beyond, at_most) << static_cast<int>(model) << static_cast<int>(interpolation);
      }
  }
}

TEST_F(VoxelLightPictures, BothBackendsShowTheSame) {
  World w = cave(true);
  w.meshes = some_meshes(w);
  world::EditBatch batch;
  batch.fill({{-3, 0, -8}, {3, 0, -6}}, block(w, "tall_grass"));
  // A shaft, so that some of it has the sky's light and the sun's.
  batch.fill({{-8, 0, -8}, {-2, 14, -2}}, world::kAir);
  apply(w, batch);
  const LightVolume levels = flooded(w);
  const world::SurfaceIrradiance arrives = of_cave(w);
  raster_->light = raycast_->light = {&levels, &arrives, 1};
  for (const LightModel model : {LightModel::flood_rgb, LightModel::flux})
    for (const LightInterpolation interpolation : kInterpolations)
      for (const SunShadow shadow : {SunShadow::ray, SunShadow::sky_light}) {
        if (shadow == SunShadow::sky_light && (model == LightModel::flux || interpolation == LightInterpolation::face))
          continue;
        RenderKnobs knobs = with(model, interpolation);
        knobs.sun_shadow = shadow;
        knobs.corner_occlusion = interpolation == LightInterpolation::linear;
        const double share = share_within(draw(*raster_, w, in_cave(), knobs, kWidth, kHeight).image,
                                          draw(*raycast_, w, in_cave(), knobs, kWidth, kHeight).image, 2);
        EXPECT_GE(share, 0.999) << static_cast<int>(model) << static_cast<int>(interpolation)
                                << static_cast<int>(shadow);
      }
}

TEST_F(VoxelLightPictures, UnderTheOpenSkyNothingChanges) {
  World w(world::standard_blocks());
  world::EditBatch batch;
  batch.set({40, 0, 40}, block(w, "stone"));  // out of sight
  apply(w, batch);
  w.meshes = some_meshes(w);
  const LightVolume levels = flooded(w);
  const world::SurfaceIrradiance nothing;
  raster_->light = raycast_->light = {&levels, &nothing, 1};
  const Image plain = draw(*raster_, w, in_cave(), with(LightModel::none, {}), kWidth, kHeight).image;
  EXPECT_EQ(raster_->rasterizer().triangle_light().bytes(), 0u);
  for (const LightModel model : {LightModel::flood_rgb, LightModel::flux})
    for (const LightInterpolation interpolation : kInterpolations) {
      const Image lit = draw(*raster_, w, in_cave(), with(model, interpolation), kWidth, kHeight).image;
      EXPECT_TRUE(same(plain, lit)) << static_cast<int>(model) << static_cast<int>(interpolation);
    }
}

/// A torus as a level set, in the dark: by triangles, and as the ray caster meets it.
TEST_F(VoxelLightPictures, ASmoothSurfaceInTheDarkIsDark) {
  World w(world::standard_blocks());
  world::FloatLayer& distance = w.store.make_layer(world::Layer::distance);
  world::EditBatch batch;
  for (int x = -12; x < 12; ++x)
    for (int y = -12; y < 12; ++y)
      for (int z = -12; z < 12; ++z) {
        const Vec3d p = Vec3d(x, y, z) + 0.5;
        const double d = glm::length(Vec3d(glm::length(Vec3d(p.x, 0, p.z)) - 6, p.y, 0)) - 2.3;
        if (std::abs(d) < 3) distance.set({x, y, z}, static_cast<float>(d));
        if (d <= 0) batch.set({x, y, z}, block(w, "granite"));
      }
  apply(w, batch);
  w.environment.sky_ground = w.environment.sky_horizon = w.environment.sky_zenith = {1, 1, 1};
  LightVolume dark(world::LightModel::flood_rgb, 15, false);
  for (const world::RegionPos r : w.store.regions())
    for (world::LightField& field : dark.fields()) field.regions().insert(r).set_tile(0);
  const Camera camera = camera_at({}, {0.3, 15.2, 14.4}, {0, -1, -1}, 50);
  for (Backend* backend : {static_cast<Backend*>(raster_.get()), raycast_.get()}) {
    backend->light = {&dark, nullptr, 1};
    RenderKnobs knobs = with(LightModel::flood_rgb, LightInterpolation::linear);
    knobs.contours = ContourShape::field, knobs.sun_shadow = SunShadow::sky_light;
    size_t black = 0, sky = 0, other = 0;
    for (const Rgb& p : draw(*backend, w, camera, knobs, kWidth, kHeight).image.pixels)
      ++(p == Rgb{0, 0, 0} ? black : p == Rgb{1, 1, 1} ? sky : other);
    EXPECT_EQ(other, 0u);
    EXPECT_GT(black, 3000u);
    EXPECT_GT(sky, 3000u);
  }
}

/// After changes of light, of blocks and of meshes, each told as a simulation tells it; beside a backend that is told
/// at each step that all may have changed.
TEST_F(VoxelLightPictures, AfterAChangeAreThoseOfLightMadeAnew) {
  World w = cave(true);
  w.meshes = some_meshes(w);
  LightVolume levels = flooded(w);
  world::LightChanges changes;
  WorldLight made{&levels, nullptr, 1, &changes};
  const RenderKnobs knobs = with(LightModel::flood_rgb, LightInterpolation::linear);
  auto anew = make_raster({.validation = true});
  ASSERT_TRUE(anew.ok());
  Image last;
  for (int step = 0; step < 5; ++step) {
    world::LightChange change;
    if (step == 1 || step == 4) {
      const world::LeafPos leaf = world::leaf_from_voxel(step == 1 ? VoxelPos{1, 3, -2} : VoxelPos{6, 1, 2});
      levels.block(1).regions().find(world::region_from_leaf(leaf))->set_leaf(world::index_in_region(leaf), 9);
      change.leaves.push_back(leaf);
    }
    if (step == 2) {
      world::EditBatch batch;
      batch.fill({{5, 2, 1}, {7, 4, 3}}, block(w, "brick_red"));
      apply(w, batch);
    }
    if (step == 3) w.meshes[0].position.voxel.x += 5;
    changes.note(change);
    if (!change.empty()) ++made.version;
    raster_->light = made;
    const Image after = draw(*raster_, w, in_cave(), knobs, kWidth, kHeight).image;
    (*anew)->light = {&levels, nullptr, static_cast<uint64_t>(step + 1)};
    EXPECT_TRUE(same(after, draw(**anew, w, in_cave(), knobs, kWidth, kHeight).image)) << step;
    EXPECT_TRUE(step == 0 || !same(after, last)) << step;
    last = after;
  }
  // What a picture no longer calls for goes.
  EXPECT_GT(raster_->rasterizer().triangle_light().bytes(), 0u);
  w.meshes.clear();
  draw(*raster_, w, in_cave(), knobs, kWidth, kHeight);
  EXPECT_EQ(raster_->rasterizer().triangle_light().bytes(), 0u);
}

TEST_F(VoxelLightPictures, LightThatABufferCannotHoldIsNamed) {
  World w = cave(true);
  w.meshes = some_meshes(w);
  const LightVolume levels = flooded(w);
  raster::TriangleList list;
  ASSERT_TRUE(raster::add_meshes(w, list).ok());
  raster::DrawnTriangles triangles;
  gpu::Device& device = raster_->rasterizer().device();
  ASSERT_TRUE(triangles.set(device, list, "meshes").ok());
  raster::TriangleLight light;
  light.binding_limit = 4096;
  ASSERT_TRUE(
      light.follow(device, world::WorldView(w), {&levels, nullptr, 1}, SurfaceLight::Kind::levels, triangles).ok());
  EXPECT_NE(light.dropped().find("open sky"), std::string::npos);
  light.binding_limit = ~uint64_t{0};
  ASSERT_TRUE(
      light.follow(device, world::WorldView(w), {&levels, nullptr, 1}, SurfaceLight::Kind::levels, triangles).ok());
  EXPECT_EQ(light.dropped(), "");
  EXPECT_GT(light.bytes(), 4096u);
}

/// Large, small, thin and slanted triangles: the eight voxels around every point that shading may ask about.
TEST_F(VoxelLightPictures, LeavesAroundTrianglesHoldAllThatShadingLooksAt) {
  std::vector<world::RegionPos> regions;
  for (int x = -2; x < 2; ++x)
    for (int y = -2; y < 2; ++y)
      for (int z = -2; z < 2; ++z) regions.push_back({x, y, z});
  uint64_t number = 0;
  const auto random = [&] { return static_cast<double>(world::mix64(++number) >> 11) * 0x1p-53; };
  for (int i = 0; i < 40; ++i) {
    raster::TriangleList list;
    const double size = i % 2 ? 100 : 3;
    for (int k = 0; k < 3; ++k)
      list.vertices.push_back({world::WorldPoint::from(size * (random() - 0.5) + 7, size * (random() - 0.5) - 20,
                                                       size * (random() - 0.5))});
    list.triangles.push_back({{0, 1, 2}, 0});
    list.materials.emplace_back();
    raster::DrawnTriangles triangles;
    ASSERT_TRUE(triangles.set(raster_->rasterizer().device(), list, "one").ok());
    const std::vector<world::LeafPos> leaves = triangles.leaves_around(regions);
    for (int k = 0; k < 2000; ++k) {
      const double u = random(), v = random() * (1 - u);
      const world::WorldPoint& a = list.vertices[0].position;
      const Vec3d on = u * (list.vertices[1].position - a) + v * (list.vertices[2].position - a);
      const Vec3d off = 0.25 * glm::normalize(Vec3d(random() - 0.5, random() - 0.5, random() - 0.5));
      const world::WorldPoint first = a + (on + off - 0.5);
      for (int c = 0; c < 8; ++c)
        ASSERT_TRUE(std::binary_search(leaves.begin(), leaves.end(),
                                       world::leaf_from_voxel(first.voxel + VoxelPos{c & 1, c >> 1 & 1, c >> 2})));
    }
    if (size == 3) {
      EXPECT_LE(leaves.size(), 8u) << "and few others";
    }
  }
}

/// Voxels by bits x, y, z of their number.
TEST(VoxelLight, DoesNotPassBetweenBlocksThatTouchAlongAnEdge) {
  EXPECT_EQ(shared::reached_voxels(0xff, 0), 0xffu);
  EXPECT_EQ(shared::reached_voxels(1u << 0 | 1u << 3, 0), 1u) << "along an edge";
  EXPECT_EQ(shared::reached_voxels(1u << 0 | 1u << 7, 7), 1u << 7) << "in a corner";
  // 0, 1, 3, 7, 6: the longest way that there is, with nothing beside it.
  constexpr uint32_t way = 1u << 0 | 1u << 1 | 1u << 3 | 1u << 7 | 1u << 6;
  EXPECT_EQ(shared::reached_voxels(way, 0), way);
  // All that any other flood finds.
  for (uint32_t clear = 1; clear < 256; ++clear)
    for (int from = 0; from < 8; ++from) {
      if (!(clear >> from & 1)) continue;
      uint32_t reached = 1u << from;
      for (int round = 0; round < 8; ++round)
        for (int i = 0; i < 8; ++i)
          for (const int bit : {1, 2, 4})
            if (clear >> i & 1 && reached >> (i ^ bit) & 1) reached |= 1u << i;
      ASSERT_EQ(shared::reached_voxels(clear, from), reached) << clear;
    }
}

/// Across the border of voxels, beside a wall, and where the point's own voxel is the wall.
TEST(VoxelLight, IsLinearBetweenMiddlesAndNoWallHasAPart) {
  World w(world::standard_blocks());
  world::EditBatch batch;
  batch.fill({{-8, -1, -8}, {8, -1, 8}}, block(w, "stone"));
  apply(w, batch);
  LightVolume levels(world::LightModel::flood_rgb, 15, false);
  for (const world::RegionPos r : {world::RegionPos{0, 0, 0}, world::RegionPos{0, -1, 0}}) {
    for (world::LightField& field : levels.fields()) field.regions().insert(r).set_tile(0);
    world::LightRegion& region = *levels.block(0).regions().find(r);
    region.split();
    world::LightLeaf leaf = world::LightLeaf::of(4);
    for (int i = 0; i < world::kLeafVoxels; ++i)
      if (world::offset_in_leaf(i).x >= 4) leaf.set(i, 12);
    region.set_leaf(0, leaf);
  }
  const world::WorldView view(w);
  const WorldLight light{&levels, nullptr, 1};
  const VoxelCodes voxels(view, light, SurfaceLight::Kind::levels);
  const SurfaceLightDecoder decoder(SurfaceLight::Kind::levels, Shading(w.environment, *w.palette));
  const auto red = [&](double x, double y) {
    return light_at_point(decoder, LightInterpolation::linear, voxels, world::WorldPoint::from(x, y, 4.5), {0, 1, 0},
                          {1, 1, 1})
        .lit.r;
  };
  const float low = decoder.block[4], high = decoder.block[12];
  EXPECT_FLOAT_EQ(red(3.5, 2.5), low);
  EXPECT_FLOAT_EQ(red(4.5, 2.5), high);
  EXPECT_NEAR(red(4, 2.5), (low + high) / 2, 1e-4f * high);
  EXPECT_NEAR(red(4, 0.1), (low + high) / 2, 1e-4f * high) << "the floor's voxels have no part";
  EXPECT_NEAR(red(3.75, -0.1), 0.75f * low + 0.25f * high, 1e-4f * high) << "nor where the point is in one";
  const float face = light_at_point(decoder, LightInterpolation::face, voxels, world::WorldPoint::from(3.9, 0.1, 4.5),
                                    {0, 1, 0}, {1, 1, 1})
                         .lit.r;
  EXPECT_FLOAT_EQ(face, low);
}

/// Of six sides each has what the first wall behind it has; a slanted surface their mean by squares of its normal.
TEST(VoxelLight, OfIrradianceIsThatOfTheWallsBehind) {
  const World w = cave(false);
  const world::SurfaceIrradiance arrives = irradiance(w, {-3, -1, -3}, {6, 4, 6}, [](VoxelPos, int towards) {
    const float e = 64.0f * static_cast<float>(1 + world::opposite_face(towards));  // by where the wall's face looks
    return world::Irradiance3{e, e, e};
  });
  const world::WorldView view(w);
  const WorldLight light{nullptr, &arrives, 1};
  const VoxelCodes voxels(view, light, SurfaceLight::Kind::irradiance);
  const SurfaceLightDecoder decoder(SurfaceLight::Kind::irradiance, Shading(w.environment, *w.palette));
  const auto lit = [&](Vec3d normal) {
    return light_at_point(decoder, LightInterpolation::face, voxels, world::WorldPoint::from(1.5, 3.5, -1.5),
                          glm::normalize(normal), {1, 1, 1})
        .lit.g;
  };
  constexpr float kPi = 3.14159265f;
  for (int face = 0; face < world::kFaces; ++face) {
    const VoxelPos n = world::face_step(face);
    EXPECT_NEAR(lit({n.x, n.y, n.z}), 64.0f * static_cast<float>(1 + face) / kPi, 1e-3f) << face;
  }
  EXPECT_NEAR(lit({1, 1, 0}), 64.0f * (2 + 4) / 2 / kPi, 1e-3f);
  const world::WorldPoint outside = world::WorldPoint::from(100.5, 3.5, 0.5);
  EXPECT_EQ(light_at_point(decoder, LightInterpolation::linear, voxels, outside, {0, 1, 0}, {1, 2, 3}).lit,
            (Rgb{1, 2, 3}))
      << "where the model covers nothing it is the open sky's";
}

}  // namespace
}  // namespace render
