/// A save holds all that a scene says: luminaires, media, meshes, cameras, knobs, with the same bits; and every older
/// version is read.
#include "world/saves/surroundings.h"

#include "tests/world/saves/saves_support.h"
#include "world/media/brick_field.h"
#include "world/meshes/builder.h"
#include "world/saves/check.h"
#include "world/saves/meta.h"
#include "world/store/density_field.h"

namespace world {
namespace {

namespace fs = std::filesystem;

std::shared_ptr<const LightImage> stripes(int width, int height) {
  auto image = std::make_shared<LightImage>(LightImage{width, height, {}});
  for (int i = 0; i < width * height; ++i)
    image->pixels.push_back({0.1f * static_cast<float>(i % 7), 1.0f / 3, static_cast<float>(i)});
  return image;
}

/// Something of every kind, with numbers that no short decimal is.
World furnished_world() {
  World world = sample_world();
  world.knobs = {{"exposure", "0.5"}, {"light_transport", "path"}};
  world.environment.temperature = Kelvin{1.0 / 3};
  world.environment.clouds = {0.3f,      -71.3f, 90.1f, 1.0f / 3 + 400, 0.013f, {0.1, 0, -7.7}, {1.0 / 3, 0, 1e9 + 0.7},
                              UINT32_MAX};
  world.simulation = {UINT64_MAX, {"rain", "a \"quoted\" name"}, {{"liquid_rule", "pipes"}, {"a b", "\n"}}};
  world.simulation.bodies = {
      {"crate", WorldPoint::from(0.1, -7.3, 1e9 + 0.7), {1.0 / 3, 64, 0.1}, {-1.0 / 7, 0, 1}, 1.0 / 3 + 1, 0.3, 0.7},
      {}};
  world.simulation.particles = {
      {"rain", {{-5, 1, 2}, {5, 1, 1'000'000'000}}, 1.0 / 3, {0, -6.5, 0.1}, 0.7, "water", 50.1},
      {"snow", {{0, 0, 0}, {0, 0, 0}}, 0, {0, 0, 0}, 0, "", 0}};
  world.simulation.state = {{"support", "ground -4\npiece 1 2\n"}, {"x", "not [ toml"}};
  CameraPlacement camera;
  camera.name = "a \"quoted\" name, \n\t \xc3\xa9";
  camera.position = WorldPoint::from(0.1, -7.3, 1e9 + 0.7);
  camera.forward = glm::normalize(Vec3d(0.3, -0.1, 0.7));
  camera.vertical_fov_deg = 41.3, camera.lens_radius_m = 0.013, camera.focus_distance_m = 7.7;
  world.cameras = {camera, CameraPlacement{}};

  Luminaire slide;
  slide.kind = "gobo", slide.name = "slide", slide.position = WorldPoint::from(1.5, 2.25, -3.125);
  slide.axis = glm::normalize(Vec3f(0.1f, -0.9f, 0.3f)),
  slide.up = glm::normalize(glm::cross(slide.axis, Vec3f(1, 0, 0)));
  slide.power = {1.0f / 3, 2.0f / 3, 1e6f}, slide.half_angle = 0.31f, slide.inner_half_angle = 0.3f,
  slide.radius = 0.01f;
  slide.light_image = stripes(5, 3), slide.shadows = false, slide.visible = false;
  Luminaire lamp;
  lamp.kind = "mesh", lamp.name = "lamp", lamp.radiance = {0.7f, 0.1f, 12.9f};
  lamp.triangles = {{0, 0, 0}, {1, 0, 0}, {0, 0.1f, 1}, {0, 0, 0}, {0, 1, 0}, {1.0f / 3, 0, 0}};
  Luminaire sky;
  sky.kind = "hemisphere", sky.axis = {0, 1, 0}, sky.up = {0, 0, 1}, sky.radiance = {1, 2, 3}, sky.whole_sphere = true;
  sky.light_image = slide.light_image;
  world.luminaires = {slide, lamp, sky};
  for (int i = 0; i < 300; ++i) {  // more than a row holds
    Luminaire omni;
    omni.kind = "omni", omni.name = "omni " + std::to_string(i), omni.power = {static_cast<float>(i) / 7, 1, 1};
    omni.position = WorldPoint::from(i * 0.1, 1, -i), omni.radius = 0.01f;
    world.luminaires.push_back(omni);
  }

  Medium fog;
  fog.kind = "height_fog", fog.name = "fog", fog.absorption = {0.1f, 0.2f, 0.3f}, fog.scale_height = 17.3f;
  fog.scattering = {1e-3f, 2e-3f, 3e-3f}, fog.anisotropy = -0.37f, fog.emission = {0, 0, 0.1f};
  Medium smoke;
  smoke.kind = "density_grid", smoke.name = "smoke", smoke.position = WorldPoint::from(-3.3, 4.4, 5.5);
  smoke.voxel_size = 0.3f;
  std::vector<FieldLeaf> leaves(2);
  leaves[0].leaf = {0, 0, 0}, leaves[1].leaf = {-40, 3, 1};
  for (size_t i = 0; i < kLeafVoxels; ++i)
    leaves[0].values[i] = i % 3 ? 0 : static_cast<float>(i) / 511, leaves[1].values[i] = 0.25f;
  smoke.field = *BrickField::make(leaves, smoke.sampling, "smoke");
  Medium other = smoke;
  other.name = "the same smoke elsewhere", other.position = WorldPoint::from(100, 0, 0);
  world.media = {fog, smoke, other};
  for (Medium& medium : world.media) {
    const auto kinds = medium_kinds();
    medium.kind_number = static_cast<int>(std::find(kinds.begin(), kinds.end(), medium.kind) - kinds.begin());
  }

  MeshReport report;
  const double profile[] = {0, 0, 1, 0.3, 0.2, 2, 0, 2};
  MeshInstance bottle;
  bottle.name = "bottle",
  bottle.mesh = std::make_shared<const TriangleMesh>(*revolved_mesh(profile, 17, "here", report));
  bottle.transform = glm::dmat3(0.3, 0.1, 0, -0.1, 1.7, 0, 0.01, 0, -2.2);
  bottle.position = WorldPoint::from(0.7, 0, -1e8 + 0.3), bottle.block = "stone", bottle.interior_medium = "smoke";
  bottle.block_id = *world.palette->find("stone"), bottle.smooth = true, bottle.radiance = {0, 0.5f, 0};
  bottle.checker_block = "grass", bottle.checker_id = *world.palette->find("grass"), bottle.checkers = {3.5f, 8};
  MeshInstance twin = bottle;
  twin.name = "twin", twin.null_surface = true, twin.checker_block.clear(), twin.checker_id = kAir;
  world.meshes = {bottle, twin};
  return world;
}

/// Equal in these fields.
template <class Record, class... Fields>
void expect_same(const Record& a, const Record& b, Fields Record::*... fields) {
  const auto same = [&](auto field) { EXPECT_EQ(a.*field, b.*field); };
  (same(fields), ...);
}

void expect_equal_surroundings(const World& a, const World& b) {
  // All fields that a save has: rows of text of both, and the assets by their hashes.
  const auto rows = meta_of(a).rows, others = meta_of(b).rows;
  EXPECT_EQ(rows.size(), others.size());
  for (const auto& [key, text] : rows) EXPECT_TRUE(others.contains(key) && others.at(key) == text) << key;
  // What is behind them, bit for bit; not by the functions that wrote it.
  ASSERT_EQ(a.cameras.size(), b.cameras.size());
  for (size_t i = 0; i < a.cameras.size(); ++i) {
    using C = CameraPlacement;
    expect_same(a.cameras[i], b.cameras[i], &C::name, &C::forward, &C::lens_radius_m);
    expect_same(a.cameras[i].position, b.cameras[i].position, &WorldPoint::voxel, &WorldPoint::fraction);
  }
  ASSERT_EQ(a.luminaires.size(), b.luminaires.size());
  for (size_t i = 0; i < a.luminaires.size(); ++i) {
    const Luminaire &x = a.luminaires[i], &y = b.luminaires[i];
    using L = Luminaire;
    expect_same(x, y, &L::name, &L::power, &L::axis, &L::half_angle, &L::triangles, &L::shadows);
    ASSERT_EQ(!x.light_image, !y.light_image);
    if (x.light_image) {
      expect_same(*x.light_image, *y.light_image, &LightImage::width, &LightImage::pixels);
    }
  }
  ASSERT_EQ(a.media.size(), b.media.size());
  for (size_t i = 0; i < a.media.size(); ++i) {
    const Medium &x = a.media[i], &y = b.media[i];
    expect_same(x, y, &Medium::kind, &Medium::kind_number, &Medium::absorption, &Medium::anisotropy);
    ASSERT_EQ(!x.field, !y.field);
    for (int k = 0; x.field && k < 2000; ++k) {
      const Vec3d p(k * 0.013 - 5, k % 8, k % 11);
      ASSERT_EQ(x.field->density(p), y.field->density(p)) << k;
    }
  }
  ASSERT_EQ(a.meshes.size(), b.meshes.size());
  for (size_t i = 0; i < a.meshes.size(); ++i) {
    const MeshInstance &x = a.meshes[i], &y = b.meshes[i];
    using M = TriangleMesh;
    expect_same(*x.mesh, *y.mesh, &M::positions, &M::triangles, &M::normals, &M::texture_coordinates);
    EXPECT_EQ(x.transform, y.transform);
    EXPECT_EQ((*a.palette)[x.block_id].name, (*b.palette)[y.block_id].name);
    EXPECT_EQ(x.checkers, y.checkers);
  }
  EXPECT_EQ(a.knobs, b.knobs);
  EXPECT_EQ(a.environment, b.environment);
  EXPECT_EQ(a.simulation, b.simulation);
}

int64_t count_of(const fs::path& path, const char* query) {
  const Database db = *Database::open(path, Database::Access::read);
  return *db.integer(query);
}

TEST(LoamSave, HoldsAllThatStandsInAWorldBesideItsVoxels) {
  const TemporaryFolder folder;
  const World world = furnished_world();
  ASSERT_TRUE(write_world(world, folder / "a.loam").ok());
  const auto read = load(folder / "a.loam");
  ASSERT_TRUE(read.ok()) << read.error().message;
  expect_equal_surroundings(world, *read);
  EXPECT_TRUE(check_save(folder / "a.loam")->clean());
  // Shared by two luminaires, two media, two meshes: there once.
  EXPECT_EQ(read->luminaires[0].light_image, read->luminaires[2].light_image);
  EXPECT_EQ(read->media[1].field, read->media[2].field);
  EXPECT_EQ(read->meshes[0].mesh, read->meshes[1].mesh);
  EXPECT_EQ(count_of(folder / "a.loam", "SELECT count(*) FROM asset"), 4);
}

TEST(LoamSave, WritesAssetsOnceAndDropsThoseThatNothingNames) {
  const TemporaryFolder folder;
  const fs::path path = folder / "a.loam";
  auto session = SaveSession::create(path, furnished_world(), {});
  ASSERT_TRUE(session.ok()) << session.error().message;
  World& world = (*session)->world();
  EXPECT_FALSE((*session)->has_changes());
  world.luminaires[0].power = {1, 2, 3};
  EXPECT_TRUE((*session)->has_changes());
  ASSERT_TRUE((*session)->save().ok());
  EXPECT_EQ((*session)->last_report().bytes, 0u) << "assets that were there are not written again";
  world.meshes.clear();
  ASSERT_TRUE((*session)->save().ok());
  EXPECT_EQ(count_of(path, "SELECT count(*) FROM asset"), 3);
  EXPECT_FALSE((*session)->has_changes());
  const auto read = load(path);
  ASSERT_TRUE(read.ok()) << read.error().message;
  expect_equal_surroundings(world, *read);
}

TEST(LoamSave, LargeAssetsAreCutAndCheckedPartByPart) {
  auto image = std::make_shared<LightImage>(LightImage{2048, 1500, {}});
  for (int i = 0; i < 2048 * 1500; ++i) image->pixels.push_back({static_cast<float>(i % 1009), 1, 2});
  const Asset asset = asset_of(std::shared_ptr<const LightImage>(image));
  EXPECT_EQ(asset.parts.size(), 3u);  // of 36.9 MB
  std::map<int64_t, PackedAsset> rows;
  ASSERT_TRUE(for_each_part(asset, [&](int64_t key, const std::string& bytes) -> Status {
                EXPECT_LE(bytes.size(), kAssetPartBytes);
                TRY(rows[key], pack_asset(bytes));
                return {};
              }).ok());
  const auto read_part = [&](int64_t key, size_t number) -> Result<std::string> {
    TRY(const std::string bytes, unpack_asset(rows.at(key).codec, rows.at(key).bytes));
    EXPECT_EQ(asset_key(bytes, number), key);
    return bytes;
  };
  const auto whole = AssetReader(read_part, 1 << 30).image(asset.parts);
  ASSERT_TRUE(whole.ok()) << whole.error().message;
  EXPECT_EQ((*whole)->pixels, image->pixels);
  EXPECT_FALSE(AssetReader(read_part, 1 << 20).image(asset.parts).ok()) << "memory is bounded";
  EXPECT_FALSE(AssetReader(read_part, 1 << 30).image({asset.parts[0], asset.parts[1]}).ok());
  EXPECT_FALSE(AssetReader(read_part, 1 << 30).mesh(asset.parts).ok()) << "an image is no mesh";
}

TEST(LoamSave, PartsThatShrinkALotAreKeptAsTheyAre) {
  // Else a small file could make its reader take much memory, and the reader would have to refuse it.
  const auto zeros = pack_asset(std::string(kAssetPartBytes, '\0'));
  ASSERT_TRUE(zeros.ok());
  EXPECT_EQ(zeros->codec, "raw");
  const auto few = pack_asset(std::string(100, 'x'));
  ASSERT_TRUE(few.ok());
  EXPECT_EQ(*unpack_asset(few->codec, few->bytes), std::string(100, 'x'));
}

TEST(LoamSave, ADamagedAssetIsNamedAndARepairLeavesOutWhatNamesIt) {
  const TemporaryFolder folder;
  const fs::path path = folder / "a.loam";
  const World world = furnished_world();
  ASSERT_TRUE(write_world(world, path).ok());
  sql(path,
      "UPDATE asset SET bytes = zeroblob(length(bytes)) WHERE key = (SELECT key FROM asset WHERE codec = 'zstd' "
      "ORDER BY length(bytes) DESC LIMIT 1)");
  const auto read = load(path);
  ASSERT_FALSE(read.ok());
  EXPECT_NE(read.error().message.find("asset"), std::string::npos) << read.error().message;
  const auto repaired = repair_save(path);
  ASSERT_TRUE(repaired.ok()) << repaired.error().message;
  EXPECT_FALSE(repaired->lost.empty());
  const auto again = load(path);
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->store.content_hash(), world.store.content_hash());
  EXPECT_EQ(again->cameras.size(), world.cameras.size());
  EXPECT_LT(meta_of(*again).rows.size(), meta_of(world).rows.size());
}

TEST(LoamSave, ARepairKeepsSurroundings) {
  const TemporaryFolder folder;
  const fs::path path = folder / "a.loam";
  const World world = furnished_world();
  ASSERT_TRUE(write_world(world, path).ok());
  sql(path, "UPDATE region SET hash = hash + 1 WHERE rowid = (SELECT rowid FROM region WHERE layer = 'block' LIMIT 1)");
  const auto repaired = repair_save(path);
  ASSERT_TRUE(repaired.ok()) << repaired.error().message;
  EXPECT_EQ(repaired->version, kSaveVersion);
  const auto again = load(path);
  ASSERT_TRUE(again.ok()) << again.error().message;
  expect_equal_surroundings(world, *again);
}

/// A density layer over three regions, and two media that sample it.
World foggy_world() {
  World world = sample_world();
  FloatLayer& density = world.store.make_layer(Layer::density);
  for (int i = 0; i < 3000; ++i) density.set({i * 37 % 301 - 150, i * 53 % 97, i % 13}, static_cast<float>(i % 9) / 7);
  Medium fog;
  fog.kind = "density_grid", fog.name = "fog", fog.scattering = {1, 2, 3};
  Medium blocky = fog;
  blocky.name = "blocky", blocky.sampling = FieldSampling::nearest;
  world.media = {fog, blocky};
  EXPECT_TRUE(fill_density_grids(&density, world.media).ok());
  return world;
}

void expect_same_fog(const World& a, const World& b) {
  ASSERT_EQ(a.media.size(), b.media.size());
  for (size_t i = 0; i < a.media.size(); ++i) {
    ASSERT_TRUE(a.media[i].field && b.media[i].field);
    for (int k = 0; k < 3000; ++k) {
      const Vec3d p(k * 37 % 301 - 150.2, k * 53 % 97 + 0.3, k % 13);
      ASSERT_EQ(a.media[i].field->density(p), b.media[i].field->density(p)) << k;
    }
  }
}

TEST(LoamSave, AMediumOverTheWorldsLayerIsSavedWithTheLayerAlone) {
  const TemporaryFolder folder;
  const fs::path path = folder / "a.loam";
  World world = foggy_world();
  EXPECT_TRUE(meta_of(world).assets.empty());
  ASSERT_TRUE(write_world(world, path).ok());
  const auto again = load(path);
  ASSERT_TRUE(again.ok()) << again.error().message;
  expect_same_fog(world, *again);
  // Where regions are left to a streamer the fog is there too, and a repair keeps it.
  const auto file = SaveFile::open(path, SaveFile::Access::read);
  const auto frame = (*file)->read_frame();
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  EXPECT_EQ(frame->store.find_layer(Layer::density), nullptr);
  expect_same_fog(world, *frame);
  sql(path, "UPDATE region SET hash = hash + 1 WHERE rowid = (SELECT rowid FROM region WHERE layer = 'block' LIMIT 1)");
  ASSERT_TRUE(repair_save(path).ok());
  const auto repaired = load(path);
  ASSERT_TRUE(repaired.ok()) << repaired.error().message;
  expect_same_fog(world, *repaired);
  // The control: a layer that changed since is another one, and the field is what was seen.
  world.store.make_layer(Layer::density).set({0, 0, 0}, 5);
  EXPECT_EQ(meta_of(world).assets.size(), 2u);
  ASSERT_TRUE(write_world(world, folder / "b.loam").ok());
  const auto changed = load(folder / "b.loam");
  ASSERT_TRUE(changed.ok()) << changed.error().message;
  expect_same_fog(world, *changed);
}

TEST(LoamSave, RecordsThatCannotBeAreRefused) {
  const auto refused = [](const std::string& key, const std::string& text) {
    World world(standard_blocks());
    AssetReader none([](int64_t, size_t) -> Result<std::string> { return input_error("missing"); }, 0);
    const Status read = read_surroundings(world, key, text, "a.loam", none);
    EXPECT_FALSE(read.ok()) << text;
    if (read.ok()) return std::string();
    EXPECT_TRUE(read.error().message.starts_with("a.loam: ")) << read.error().message;
    return read.error().message;
  };
  refused("scene.luminaire.000000", "[[luminaire]]\nkind = \"sun\"\n");
  refused("scene.luminaire.000000", "[[luminaire]]\nkind = \"omni\"\npower = [-1, 0, 0]\n");
  refused("scene.luminaire.000000", "[[luminaire]]\nkind = \"omni\"\npower = [nan, 0, 0]\n");
  refused("scene.luminaire.000000", "[[luminaire]]\nkind = \"omni\"\nwatts = [1, 0, 0]\n");
  refused("scene.luminaire.000000", "[[luminaire]]\nkind = \"gobo\"\nlight_image = [\"12\"]\n");
  refused("scene.medium.000000", "[[medium]]\nname = \"a\"\nkind = \"height_fog\"\n");
  refused("scene.medium.000000", "[[medium]]\nname = \"a\"\nkind = \"density_grid\"\n");
  refused("scene.medium.000000", "[[medium]]\nname = \"a\"\nkind = \"density_grid\"\nlayer = \"distance\"\n");
  refused("scene.mesh.000000", "[[mesh]]\nname = \"a\"\n");
  refused("scene.camera.000000", "[[camera]]\nforward = [1, 1, 0]\n");
  refused("scene.camera.000000", "[[camera]]\nposition = [0.5, 0, 0, 0, 0, 0]\n");
  refused("scene.camera.000000", "[[camera]]\nposition = [3e9, 0, 0, 0, 0, 0]\n");
  refused("scene.simulation", "seed = 7\n");
  refused("scene.simulation", "seed = \"-1\"\n");
  refused("scene.simulation", "seed = \"18446744073709551616\"\n");
  refused("scene.simulation", "effect = [\"rain\"]\n");
  refused("scene.simulation", "[knobs]\na = 1\n");
  refused("scene.body.000000", "[[body]]\nsize = [65, 1, 1]\n");
  refused("scene.body.000000", "[[body]]\nweight = 3\n");
  refused("scene.particles.000000", "[[particles]]\nkind = \"rain\"\n");
  refused("scene.particles.000000", "[[particles]]\nkind = \"rain\"\nbox = [0, 0, 0, -1, 0, 0]\n");
  refused("scene.furniture.000000", "[[furniture]]\n");
  refused("scene.camera.000000", "[[camera");
}

TEST(LoamSave, VersionTwoIsReadAsItIsAndBecomesTheNewestWhereItIsEdited) {
  const TemporaryFolder folder;
  const fs::path path = folder / "old.loam";
  const World world = sample_world();
  write_older_save(world, path, 2);
  const auto before = *read_file(path);
  {
    const auto read = load(path);
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_EQ(read->store.content_hash(), world.store.content_hash());
    EXPECT_EQ(read->metadata, world.metadata);
    EXPECT_EQ(*read_file(path), before) << "reading must not write";
    EXPECT_EQ(check_save(path)->version, 2);
    EXPECT_TRUE(check_save(path)->clean());
  }
  {
    auto session = SaveSession::open(path, {});
    ASSERT_TRUE(session.ok()) << session.error().message;
    Luminaire omni;
    omni.kind = "omni", omni.radius = 0.01f, omni.power = {1, 2, 3};
    (*session)->world().luminaires.push_back(omni);
    ASSERT_TRUE((*session)->close().ok());
  }
  const auto file = SaveFile::open(path, SaveFile::Access::read);
  ASSERT_TRUE(file.ok()) << file.error().message;
  EXPECT_EQ((*file)->version(), kSaveVersion);
  const auto read = (*file)->read_all();
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->store.content_hash(), world.store.content_hash());
  ASSERT_EQ(read->luminaires.size(), 1u);
  EXPECT_EQ(read->luminaires[0].power, (Power3{1, 2, 3}));
}

}  // namespace
}  // namespace world
