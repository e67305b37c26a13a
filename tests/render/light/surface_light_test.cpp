#include "render/light/surface_light.h"

#include <gtest/gtest.h>

#include "render/extract/faces.h"
#include "render/raster/raster.h"
#include "render/raycast/raycast.h"
#include "tests/render/raster/small_worlds.h"
#include "world/base/jobs.h"
#include "world/numbers/shared_exponent.h"

namespace render {
namespace {

using world::VoxelPos;

/// Levels drawn at random in and around a world: what a face shows has nothing to do with what would be right there.
world::LightVolume random_levels(const world::Store& store, world::LightModel model) {
  world::LightVolume volume(model, 15, model == world::LightModel::flood_rgb);
  uint64_t number = 0;
  for (world::LightField& field : volume.fields()) {
    ++number;
    for (const world::RegionPos r : store.regions()) {
      world::LightRegion& region = field.regions().insert(r);
      region.split();
      for (int leaf = 0; leaf < world::kLeavesPerRegion; ++leaf) {
        world::LightLeaf levels;
        for (int i = 0; i < world::kLeafVoxels; ++i)
          levels.set(i, static_cast<int>(world::mix64(number * 7919 + static_cast<uint64_t>(leaf * 512 + i)) % 16));
        region.set_leaf(leaf, levels);
      }
    }
  }
  return volume;
}

/// The face's own level everywhere in a world, and no other.
TEST(SurfaceLight, AFaceHasTheLevelsOfTheVoxelBeforeIt) {
  const world::World w = hills({100, -20, 40});
  const world::LightVolume volume = random_levels(w.store, world::LightModel::flood_rgb);
  SurfaceLight light;
  const world::WorldView view(w);
  const WorldLight made{&volume, nullptr, 1};
  ASSERT_TRUE(light.follow(view, made, LightModel::flood_rgb));
  EXPECT_FALSE(light.follow(view, made, LightModel::flood_rgb)) << "nothing changed";
  const FaceSource source{&w.store, &view.masks(world::MaskKind::occupied), &view.masks(world::MaskKind::opaque)};
  world::StoreReader reader(w.store);
  uint64_t faces = 0;
  for (const ChunkPos chunk : occupied_chunks(*source.occupied)) {
    ChunkFaces found;
    extract_chunk_faces(source, &reader, chunk, found);
    for (int i = 0; i < kLeavesPerChunk; ++i)
      for (int face = 0; face < world::kFaces; ++face)
        for (int v = 0; v < world::kLeafVoxels; ++v) {
          const VoxelPos voxel = world::voxel_from_leaf(leaf_in_chunk(chunk, i)) + world::offset_in_leaf(v);
          const uint32_t code = light.code(voxel, face);
          const LeafFaces* leaf = found.find(i);
          if (!leaf || !leaf->face[face].test(v)) {
            ASSERT_EQ(code, SurfaceLight::kUnknown);
            continue;
          }
          const world::LightSample expected = volume.sample(voxel + world::face_step(face));
          for (int b = 0; b < 3; ++b) {
            ASSERT_EQ(code >> (4 * b) & 15, expected.sky[static_cast<size_t>(b)]);
            ASSERT_EQ(code >> (12 + 4 * b) & 15, expected.block[static_cast<size_t>(b)]);
          }
          ++faces;
        }
  }
  EXPECT_EQ(faces, light.codes().size());
  EXPECT_GT(faces, 10000u);
}

/// Codes of every face of a world's box, and those of a light made of it anew.
void expect_equal_to_anew(const world::World& w, const SurfaceLight& light, const WorldLight& made,
                          const std::string& where) {
  const world::WorldView view(w);
  SurfaceLight anew;
  anew.follow(view, {made.levels, nullptr, 1}, LightModel::flood_rgb);
  size_t wrong = 0, faces = 0;
  world::VoxelBox box = w.store.bounds();
  for (int x = box.min.x - 9; x <= box.max.x + 9; ++x)
    for (int y = box.min.y - 9; y <= box.max.y + 9; ++y)
      for (int z = box.min.z - 9; z <= box.max.z + 9; ++z)
        for (int face = 0; face < world::kFaces; ++face) {
          const uint32_t expected = anew.code({x, y, z}, face);
          wrong += light.code({x, y, z}, face) != expected;
          faces += expected != SurfaceLight::kUnknown;
        }
  EXPECT_EQ(wrong, 0u) << where;
  EXPECT_EQ(faces, anew.codes().size()) << where;
}

/// A change of a leaf's levels, told; of single voxels' blocks; of whole regions; of all: in any order and mixed.
TEST(SurfaceLight, FollowsWhatChangedAsIfMadeAnew) {
  world::World w(world::standard_blocks());
  const world::BlockId stone = *w.palette->find("stone"), glass = *w.palette->find("glass_red"),
                       water = *w.palette->find("water");
  {
    world::EditBatch ground;
    ground.fill({{-20, -12, -20}, {20, 3, 20}}, stone);
    for (int i = 0; i < 60; ++i) {
      const uint64_t h = world::mix64(static_cast<uint64_t>(i));
      ground.set(
          {static_cast<int>(h % 36) - 18, static_cast<int>(h >> 8 & 15) - 8, static_cast<int>(h >> 16 & 31) - 16},
          world::kAir);
    }
    ASSERT_TRUE(w.store.apply(ground).ok());
  }
  world::LightVolume volume = random_levels(w.store, world::LightModel::flood_rgb);
  world::LightChanges changes;
  WorldLight made{&volume, nullptr, 1, &changes};
  SurfaceLight light;
  ASSERT_TRUE(light.follow(world::WorldView(w), made, LightModel::flood_rgb));
  int patched = 0, whole = 0;
  for (uint64_t step = 0; step < 120; ++step) {
    const auto pick = [&](uint64_t what, int n) {
      return static_cast<int>(world::mix64(step * 31 + what) % static_cast<uint64_t>(n));
    };
    const VoxelPos v{pick(0, 44) - 22, pick(1, 22) - 13, pick(2, 44) - 22};
    if (pick(3, 3) != 0) {
      world::EditBatch edit;
      const world::BlockId kinds[] = {stone, glass, water, world::kAir, world::kAir};
      edit.fill({v, v + VoxelPos{pick(4, 4), pick(5, 2), pick(6, 3)}}, kinds[pick(7, 5)]);
      ASSERT_TRUE(w.store.apply(edit).ok());
    }
    if (pick(8, 3) != 0) {
      world::LightChange change;
      world::LightField& field = volume.fields()[static_cast<size_t>(pick(9, 6))];
      const world::LeafPos l = world::leaf_from_voxel(v);
      const bool region = pick(10, 8) == 0;
      if (world::LightRegion* levels = field.regions().find(world::region_from_leaf(l))) {
        if (region) {
          levels->set_tile(pick(11, 16));
          change.regions.push_back(world::region_from_leaf(l));
        } else {
          levels->split();
          world::LightLeaf leaf;
          for (int i = 0; i < world::kLeafVoxels; ++i)
            leaf.set(i, static_cast<int>(world::mix64(step * 512 + static_cast<uint64_t>(i)) % 16));
          levels->set_leaf(world::index_in_region(l), leaf);
          change.leaves.push_back(l);
        }
      }
      change.all = pick(12, 20) == 0;
      changes.note(change);
      ++made.version;
    }
    if (pick(13, 3) == 0) continue;  // several changes at once
    if (light.follow(world::WorldView(w), made, LightModel::flood_rgb)) ++(light.patched().empty() ? whole : patched);
    expect_equal_to_anew(w, light, made, "step " + std::to_string(step));
    if (HasFailure()) return;
  }
  EXPECT_GT(patched, 30);
  EXPECT_GT(whole, 1);
}

/// What the rasterizer sends of a change draws as all sent anew does, bit for bit.
TEST(SurfaceLight, ThePictureAfterAnEditIsThatOfAFreshBackend) {
  world::World w = hills();
  world::LightVolume volume = random_levels(w.store, world::LightModel::flood_rgb);
  world::LightChanges changes;
  WorldLight made{&volume, nullptr, 1, &changes};
  auto followed = make_raster({.validation = true});
  ASSERT_TRUE(followed.ok()) << followed.error().message;
  Camera camera;
  camera.position = world::WorldPoint::from(-40.3, 31.7, -38.2);
  camera.forward = glm::normalize(world::Vec3d(0.7, -0.45, 0.6));
  RenderKnobs knobs;
  knobs.light_model = LightModel::flood_rgb;
  uint64_t first_bytes = 0;
  for (int step = 0; step < 4; ++step) {
    if (step > 0) {
      world::EditBatch edit;
      const VoxelPos v{-20 + 9 * step, 14, -14 + 8 * step};
      edit.fill({v - VoxelPos{3, 14, 3}, v + VoxelPos{3, 6, 3}}, step == 2 ? world::kAir : *w.palette->find("stone"));
      ASSERT_TRUE(w.store.apply(edit).ok());
      world::LightChange change;
      change.leaves.push_back(world::leaf_from_voxel(v));
      world::LightRegion& region = *volume.fields()[0].regions().find(world::region_from_voxel(v));
      region.set_leaf(world::index_in_region(change.leaves[0]), 15);
      changes.note(change);
      ++made.version;
    }
    (*followed)->light = made;
    const auto after = (*followed)->render(world::WorldView(w), camera, knobs, 160, 90);
    ASSERT_TRUE(after.ok()) << after.error().message;
    auto fresh = make_raster({.validation = true});
    ASSERT_TRUE(fresh.ok());
    (*fresh)->light = {&volume, nullptr, 1};
    const auto expected = (*fresh)->render(world::WorldView(w), camera, knobs, 160, 90);
    ASSERT_TRUE(expected.ok());
    EXPECT_TRUE(after->image.pixels == expected->image.pixels) << step;
    EXPECT_EQ((*followed)->messages(), std::vector<std::string>{});
    if (step == 0) {
      first_bytes = after->report.passes[1].bytes;
    } else {
      EXPECT_LT(after->report.passes[1].bytes, first_bytes / 2) << "not all is sent again";
    }
  }
}

TEST(SurfaceLight, WhereNoModelIsAskedForThereIsNothing) {
  const world::World w = hills();
  const world::LightVolume volume = random_levels(w.store, world::LightModel::flood4);
  SurfaceLight light;
  const world::WorldView view(w);
  EXPECT_FALSE(light.follow(view, {&volume, nullptr, 1}, LightModel::none));
  EXPECT_EQ(light.bytes(), 0u);
  EXPECT_EQ(light.kind(), SurfaceLight::Kind::none);
  // And what a picture no longer asks for goes.
  EXPECT_TRUE(light.follow(view, {&volume, nullptr, 1}, LightModel::flood4));
  EXPECT_GT(light.codes().size(), 0u);
  EXPECT_TRUE(light.follow(view, {&volume, nullptr, 1}, LightModel::none));
  EXPECT_EQ(light.codes().size(), 0u);
}

TEST(SurfaceLight, ASkyLevelOf15IsTheOpenSkyAndEachStepBelowAFifthSmallerDownToNothing) {
  const Shading shading(world::Environment{}, world::standard_blocks());
  const SurfaceLightDecoder decode(SurfaceLight::Kind::levels, shading);
  for (int face = 0; face < world::kFaces; ++face) {
    EXPECT_EQ(decode(0xfff, face), shading.sky_lit[face]);
    EXPECT_EQ(decode(0, face), (Rgb{0, 0, 0}));
    for (uint32_t level = 1; level < 15; ++level) {
      const auto g = [&](uint32_t l) { return decode(l << 4, face).g; };
      EXPECT_NEAR(g(level) - g(level - 1), 0.8f * (g(level + 1) - g(level)), 1e-5f * shading.sky_lit[face].g) << level;
    }
  }
  // A face 1 m from the middle of a lamp of 3000 W: P / (4 pi) times the mean cosine 1/2, sent back by an albedo of 1.
  EXPECT_FLOAT_EQ(decode(14u << 12, 0).r, static_cast<float>(3000 / (4 * M_PI) / 2 / M_PI));
  EXPECT_EQ(decode(14u << 12, 0).g, 0);
}

TEST(SurfaceLight, AnIrradianceIsDividedByPi) {
  const Shading shading(world::Environment{}, world::standard_blocks());
  const SurfaceLightDecoder decode(SurfaceLight::Kind::irradiance, shading);
  const Rgb lit = decode(world::Rgb9e5::from({256, 128, 64}).code, 2);
  EXPECT_FLOAT_EQ(lit.r, static_cast<float>(256 / M_PI));
  EXPECT_FLOAT_EQ(lit.b, static_cast<float>(64 / M_PI));
  EXPECT_EQ(decode(SurfaceLight::kUnknown, 2), shading.sky_lit[2]) << "beyond what the model covers: the open sky";
}

/// Cells by index (u + 1) + 3 (v + 1).
constexpr uint32_t kAllOpen = 0x1ff;
constexpr uint32_t without(std::initializer_list<int> cells) {
  uint32_t open = kAllOpen;
  for (const int c : cells) open &= ~(1u << c);
  return open;
}

TEST(CornerOcclusion, HasTheFourLevelsOfQuartersOfTheSky) {
  const glm::vec2 corner(1, 1);
  EXPECT_FLOAT_EQ(shared::corner_occlusion(kAllOpen, corner), 1.0f);
  EXPECT_FLOAT_EQ(shared::corner_occlusion(without({8}), corner), 0.75f);
  EXPECT_FLOAT_EQ(shared::corner_occlusion(without({5}), corner), 0.75f);
  EXPECT_FLOAT_EQ(shared::corner_occlusion(without({5, 8}), corner), 0.5f);
  EXPECT_FLOAT_EQ(shared::corner_occlusion(without({5, 7}), corner), 0.25f) << "two walls hide what is across";
  EXPECT_FLOAT_EQ(shared::corner_occlusion(without({5, 7, 8}), corner), 0.25f);
  // Away from the corner it fades.
  EXPECT_FLOAT_EQ(shared::corner_occlusion(without({5, 7, 8}), glm::vec2(0, 0)), 1.0f);
  EXPECT_FLOAT_EQ(shared::corner_occlusion(without({5, 7, 8}), glm::vec2(1, 0)), 0.75f);
}

/// Two faces side by side in one plane, of a floor with random light and holes: along their common edge both have the
/// same light, whatever is known around them.
TEST(VertexLight, IsTheSameOnBothSidesOfAnEdge) {
  for (uint64_t seed = 0; seed < 200; ++seed) {
    bool known[5][4];
    glm::vec3 light[5][4];
    for (int u = 0; u < 5; ++u)
      for (int v = 0; v < 4; ++v) {
        const uint64_t h = world::mix64(seed * 100 + static_cast<uint64_t>(u * 4 + v));
        known[u][v] = h % 4 != 0;
        light[u][v] = glm::vec3(h >> 8 & 255, h >> 16 & 255, h >> 24 & 255);
      }
    known[1][1] = known[2][1] = true;
    const auto at = [&](int centre, glm::vec2 place) {
      shared::LightCells cells;
      uint32_t bits = 0;
      for (int i = 0; i < 9; ++i) {
        const int u = centre + i % 3 - 1, v = 1 + i / 3 - 1;
        cells.value[i] = light[u][v];
        if (known[u][v]) bits |= 1u << i;
      }
      return shared::vertex_light(cells, bits, place);
    };
    for (const float along : {0.0f, 0.25f, 1.0f}) {
      const glm::vec3 left = at(1, {1, along}), right = at(2, {0, along});
      for (int b = 0; b < 3; ++b) EXPECT_NEAR(left[b], right[b], 1e-4) << seed;  // sums of up to four in two orders
    }
  }
}

TEST(LinearLight, GoesThroughTheMiddlesOfItsCells) {
  shared::LightCells cells;
  for (int i = 0; i < 9; ++i) cells.value[i] = glm::vec3(static_cast<float>(i * i));
  EXPECT_EQ(shared::linear_light(cells, kAllOpen, {0.5f, 0.5f}).x, 16.0f);
  EXPECT_FLOAT_EQ(shared::linear_light(cells, kAllOpen, {1, 0.5f}).x, (16 + 25) / 2.0f);
  EXPECT_FLOAT_EQ(shared::linear_light(cells, kAllOpen, {1, 1}).x, (16 + 25 + 49 + 64) / 4.0f);
  EXPECT_FLOAT_EQ(shared::linear_light(cells, without({5}), {1, 0.5f}).x, 16.0f) << "what isn't known changes nothing";
}

/// Both backends with every kind of light, interpolation and occlusion: the same picture.
double mean_of(const Image& image) {
  double sum = 0;
  for (const Rgb& p : image.pixels) sum += (p.r + p.g + p.b) / 3;
  return sum / static_cast<double>(image.pixels.size());
}

TEST(SurfaceLight, BothBackendsShowTheSameLight) {
  const world::World w = hills();
  const world::LightVolume levels = random_levels(w.store, world::LightModel::flood_rgb);
  world::SurfaceIrradiance irradiance;
  {
    // Every face that an opaque voxel has in the box, at random brightness.
    irradiance.low = {-8, 0, -8};
    irradiance.size = {16, 5, 16};
    const world::MaskVolume& opaque = w.store.masks(world::MaskKind::opaque);
    for (int x = 0; x < 16; ++x)
      for (int y = 0; y < 5; ++y)
        for (int z = 0; z < 16; ++z) {
          world::SurfaceIrradiance::Leaf& leaf = irradiance.leaves.emplace_back();
          const VoxelPos corner = world::voxel_from_leaf(world::LeafPos{x - 8, y, z - 8});
          for (int face = 0; face < world::kFaces; ++face)
            for (int v = 0; v < world::kLeafVoxels; ++v) {
              if ((v & 63) == 0) leaf.first[face][v >> 6] = static_cast<uint32_t>(irradiance.values.size());
              const VoxelPos voxel = corner + world::offset_in_leaf(v);
              if (opaque.test(voxel) || !opaque.test(voxel + world::face_step(face))) continue;
              leaf.wall[face].set(v);
              const uint64_t h = world::mix64(irradiance.values.size());
              irradiance.values.push_back({float(h & 1023), float(h >> 10 & 1023), float(h >> 20 & 1023)});
            }
        }
  }
  auto raster = make_raster({.validation = true});
  ASSERT_TRUE(raster.ok()) << raster.error().message;
  auto raycast = make_raycast_backend();
  ASSERT_TRUE(raycast.ok());
  const world::WorldView view(w);
  Camera camera;
  camera.position = world::WorldPoint::from(-40.3, 31.7, -38.2);
  camera.forward = glm::normalize(world::Vec3d(0.7, -0.45, 0.6));
  for (const LightModel model : {LightModel::none, LightModel::flood_rgb, LightModel::flux})
    for (const LightInterpolation interpolation :
         {LightInterpolation::face, LightInterpolation::vertex, LightInterpolation::linear})
      for (const bool corners : {false, true})
        for (const SunShadow shadow : {SunShadow::none, SunShadow::sky_light}) {
          if (shadow == SunShadow::sky_light && model != LightModel::flood_rgb) continue;
          RenderKnobs knobs;
          // Light on what is seen: not on layers before it, nor how textures are filtered, nor on coarser levels.
          knobs.transparency = Transparency::opaque, knobs.textures = TextureFilter::off, knobs.lod_error_px = 0;
          knobs.light_model = model;
          knobs.light_interpolation = interpolation;
          knobs.corner_occlusion = corners;
          knobs.sun_shadow = shadow;
          (*raster)->light = (*raycast)->light = {&levels, &irradiance, 1};
          const auto drawn = (*raster)->render(view, camera, knobs, 320, 180);
          ASSERT_TRUE(drawn.ok()) << drawn.error().message;
          const auto cast = (*raycast)->render(view, camera, knobs, 320, 180);
          ASSERT_TRUE(cast.ok()) << cast.error().message;
          size_t differing = 0;
          for (size_t i = 0; i < drawn->image.pixels.size(); ++i) {
            const Rgb a = drawn->image.pixels[i], b = cast->image.pixels[i];
            const float scale = std::max({a.max(), b.max(), 1.0f});
            differing += std::abs(a.r - b.r) + std::abs(a.g - b.g) + std::abs(a.b - b.b) > 0.01f * scale;
          }
          // As many pixels lie on edges at this size; light that jumps from face to face adds none.
          EXPECT_LE(differing, drawn->image.pixels.size() / 1000)
              << static_cast<int>(model) << static_cast<int>(interpolation) << corners << static_cast<int>(shadow);
          if (interpolation != LightInterpolation::face || corners) continue;
          // Samples over the pixels see it too: what lies beside their middles is as bright in the mean.
          knobs.spp = 4;
          const auto sampled = (*raycast)->render(view, camera, knobs, 320, 180);
          ASSERT_TRUE(sampled.ok()) << sampled.error().message;
          EXPECT_NEAR(mean_of(sampled->image), mean_of(cast->image), 0.01 * mean_of(cast->image))
              << static_cast<int>(model) << static_cast<int>(shadow);
        }
  EXPECT_EQ((*raster)->messages(), std::vector<std::string>{});
}

TEST(Backends, SayWhetherAPictureReadsTheWorldsLight) {
  const world::World w = hills();
  for (const BackendInfo& info : backends()) {
    const auto backend = info.make();
    ASSERT_TRUE(backend.ok()) << info.name;
    RenderKnobs knobs;
    EXPECT_EQ((*backend)->reads_light(w, knobs), info.name != "reference") << info.name;
    knobs.light_transport = LightTransport::path;
    EXPECT_EQ((*backend)->reads_light(w, knobs), info.name == "raster") << info.name;
    knobs.light_transport = LightTransport::direct;
    knobs.spp = 4;
    EXPECT_EQ((*backend)->reads_light(w, knobs), info.name != "reference") << info.name;
    if (info.name == "raster") continue;
    // What isn't read needn't be there.
    knobs.light_transport = LightTransport::path;
    knobs.light_model = LightModel::flood4;
    EXPECT_TRUE((*backend)->render(world::WorldView(w), Camera{}, knobs, 4, 4).ok()) << info.name;
  }
}

TEST(SurfaceLight, LightThatNothingMadeIsAnError) {
  const world::World w = hills();
  auto raycast = make_raycast_backend();
  Camera camera;
  for (const LightModel model : {LightModel::flood4, LightModel::flood_rgb, LightModel::flux}) {
    RenderKnobs knobs;
    knobs.light_model = model;
    const auto frame = (*raycast)->render(world::WorldView(w), camera, knobs, 8, 8);
    ASSERT_FALSE(frame.ok());
    EXPECT_NE(frame.error().message.find("light_model"), std::string::npos);
  }
  RenderKnobs knobs;
  knobs.sun_shadow = SunShadow::sky_light;
  EXPECT_FALSE((*raycast)->render(world::WorldView(w), camera, knobs, 8, 8).ok());
}

}  // namespace
}  // namespace render
