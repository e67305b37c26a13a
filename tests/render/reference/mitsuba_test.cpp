// Pictures of Mitsuba 3's own test data against ours, for the scenes that Loam can express: FACTS.md, "Renderer
// references". Each pixel and band is a z-test, z = |mean - reference| / sqrt(variance / spp), with our own variance of
// a sample, from below clamped as Mitsuba's test does; its level of 0.01 for the whole picture is Sidak's for one
// pixel, and at least 99.75 % of pixels pass.
//
// Conventions: a camera without a field of view has 50 mm on 36 x 24 mm film along the diagonal, 34.02 degrees on a
// square's side; max_depth counts edges, ours events, one fewer; z-up scenes are turned by (x, y, z) -> (x, z, -y).
#include <cmath>
#include <functional>

#include "render/image/png_exr.h"
#include "tests/render/trace/trace_worlds.h"
#include "tests/support.h"
#include "world/media/brick_field.h"

namespace render {
namespace {

using namespace world;

const double kFiftyMillimetres = 2 * std::atan(std::hypot(36, 24) / 100 / std::sqrt(2.0)) * 180 / kTestPi;

struct Theirs {
  Image mean, variance;
};
std::optional<Theirs> reference(const std::string& name) {
  Theirs theirs;
  for (auto& [image, ending] : {std::pair(&theirs.mean, "_ref_rgb.exr"), {&theirs.variance, "_ref_rgb_var.exr"}}) {
    const auto path = shared_data("gt/mitsuba/" + name + ending);
    if (!path) return std::nullopt;
    auto file = read_exr(*path);
    EXPECT_TRUE(file.ok()) << (file.ok() ? "" : file.error().message);
    if (!file.ok()) return std::nullopt;
    *image = std::move(file->image);
  }
  return theirs;
}

/// The part of pixels that pass, of those that `counts`.
double passing(const Frame& ours, const Theirs& all, const std::function<bool(int, int)>& counts) {
  const Image& theirs = all.mean;
  EXPECT_EQ(ours.image.width, theirs.width);
  EXPECT_EQ(ours.image.height, theirs.height);
  int tests = 0, passed = 0;
  for (int y = 0; y < theirs.height; ++y)
    for (int x = 0; x < theirs.width; ++x) tests += counts(x, y) ? 3 : 0;
  const double alpha = 1 - std::pow(1 - 0.01, 1.0 / tests);
  double worst = 0;
  for (int y = 0; y < theirs.height; ++y)
    for (int x = 0; x < theirs.width; ++x) {
      if (!counts(x, y)) continue;
      const Rgb a = ours.image.at(x, y), b = theirs.at(x, y), v = ours.variance.at(x, y), w = all.variance.at(x, y);
      for (const auto& [mean, expected, variance] :
           {std::tuple(a.r, b.r, std::max(v.r, w.r)), {a.g, b.g, std::max(v.g, w.g)}, {a.b, b.b, std::max(v.b, w.b)}}) {
        const double z = std::abs(mean - expected) * std::sqrt(ours.report.samples / std::max(1e-4, double{variance}));
        worst = std::max(worst, z);
        passed += std::erfc(z / std::sqrt(2.0)) > alpha;
      }
    }
  std::printf("%d tests, %d pass, largest z %.2f\n", tests, passed, worst);
  return static_cast<double>(passed) / tests;
}
bool everywhere(int, int) { return true; }

constexpr double kPassing = 0.9975;

/// A unit sphere of so many rings, with normals.
std::shared_ptr<const TriangleMesh> sphere_mesh(int rings) {
  auto mesh = std::make_shared<TriangleMesh>();
  const int columns = 2 * rings;
  for (int r = 0; r <= rings; ++r)
    for (int c = 0; c <= columns; ++c) {
      const double a = kTestPi * r / rings, b = 2 * kTestPi * (c % columns) / columns;
      const Vec3f p(std::sin(a) * std::cos(b), std::cos(a), std::sin(a) * std::sin(b));
      mesh->positions.push_back(p);
      mesh->normals.push_back(p);
    }
  const auto at = [&](int r, int c) { return static_cast<unsigned>(r * (columns + 1) + c); };
  for (int r = 0; r < rings; ++r)
    for (int c = 0; c < columns; ++c) {
      if (r > 0) mesh->triangles.push_back({at(r, c), at(r, c + 1), at(r + 1, c)});
      if (r + 1 < rings) mesh->triangles.push_back({at(r, c + 1), at(r + 1, c + 1), at(r + 1, c)});
    }
  return mesh;
}

MeshInstance instance(std::shared_ptr<const TriangleMesh> mesh, BlockId block) {
  MeshInstance m;
  m.mesh = std::move(mesh);
  m.block_id = block;
  m.position = WorldPoint::from(0, 0, 0);
  return m;
}

MeshInstance from_file(const std::string& name, BlockId block) {
  MeshReport report;
  const auto path = shared_data("gt/mitsuba/" + name);
  auto mesh = read_mesh_file(path.value_or(""), report);
  EXPECT_TRUE(mesh.ok()) << (mesh.ok() ? "" : mesh.error().message);
  MeshInstance m = instance(std::make_shared<TriangleMesh>(std::move(*mesh)), block);
  m.smooth = !m.mesh->normals.empty();
  return m;
}

const glm::dmat3 kYUpFromZUp(Vec3d(1, 0, 0), Vec3d(0, 0, -1), Vec3d(0, 1, 0));  // columns

TEST(Mitsuba, FloatingSphereInDirectionalLight) {
  const auto theirs = reference("floating_sphere/refs/test_directional");
  if (!theirs) GTEST_SKIP();
  World w = dark_world();
  const BlockId white = add_block(w, matte("white", {0.9999f, 0.9999f, 0.9999f}));
  w.meshes.push_back(from_file("meshes/rectangle.obj", white));
  w.meshes.back().transform = kYUpFromZUp;
  w.meshes.push_back(instance(sphere_mesh(64), white));
  w.meshes.back().smooth = true;
  w.meshes.back().transform = glm::dmat3(0.1);
  w.meshes.back().position = WorldPoint::from(0, 1, 0);
  Luminaire l;
  l.kind = l.name = "directional";
  l.axis = {0, -1, 0};
  l.irradiance = {1, 1, 1};
  w.luminaires.push_back(l);
  RenderKnobs knobs = sampled(64);
  knobs.max_depth = 1;
  const Frame ours = trace(w, looking({0, 1, 5}, {0, 0.5, 0}, kFiftyMillimetres), knobs, 48, 48);
  EXPECT_GE(passing(ours, *theirs, everywhere), kPassing);
}

TEST(Mitsuba, DiffuseAndDielectricSpheresUnderAConstantSky) {
  const auto theirs = reference("bsdf_spheres/refs/test_constant");
  if (!theirs) GTEST_SKIP();
  World w = dark_world();
  set_sky(w, 1);
  Block diamond = matte("diamond", {0.5f, 0.5f, 0.5f});
  diamond.bsdf = "dielectric";
  diamond.opaque = false;
  diamond.index_of_refraction = 2.419f;
  w.meshes.push_back(instance(sphere_mesh(96), add_block(w, matte("diffuse", {0.2f, 0.5f, 0.3f}))));
  w.meshes.back().position = WorldPoint::from(0, 0, 6);
  w.meshes.push_back(instance(sphere_mesh(96), add_block(w, diamond)));
  // The other spheres only stand in the way. Two rectangles below, cut out by images that we lack, are missing.
  const BlockId black = add_block(w, matte("black", {1e-6f, 1e-6f, 1e-6f}));
  for (const auto& [y, z] : {std::pair(-3, 0), {3, 0}, {6, 0}, {6, 3}, {3, 3}, {0, 3}, {-3, 3}, {-6, 3}}) {
    w.meshes.push_back(instance(sphere_mesh(48), black));
    w.meshes.back().position = WorldPoint::from(0, z, -y);
  }
  for (MeshInstance& m : w.meshes) m.smooth = true;
  RenderKnobs knobs = sampled(256);
  knobs.max_depth = 1;
  const Frame ours = trace(w, looking({-24, 0, 0}, {0, 0, 0}, kFiftyMillimetres), knobs, 48, 48);
  // The two spheres have radii of 3.3 pixels around columns 43.6 and 24 of the middle rows.
  const auto near = [](int x, int y) {
    return std::hypot(x - 23.5, y - 23.5) < 4.7 || std::hypot(x - 43.1, y - 23.5) < 4.7;
  };
  EXPECT_GE(passing(ours, *theirs, near), kPassing);
}

/// The room of Mitsuba's media tests: a checkered floor and wall, and the museum around where there is a sky.
std::optional<World> media_room(bool sky) {
  World w = dark_world();
  const auto museum = shared_data("hdri/museum.exr");
  if (!museum || !shared_data("gt/mitsuba/participating_media/meshes/background.obj")) return std::nullopt;
  MeshInstance background =
      from_file("participating_media/meshes/background.obj", add_block(w, matte("dark", {0.2f, 0.2f, 0.2f})));
  background.smooth = false;
  background.checker_id = add_block(w, matte("light", {0.4f, 0.4f, 0.4f}));
  background.checkers = {32, 32};  // its texture coordinates run upwards, Mitsuba's down
  std::swap(background.block_id, background.checker_id);
  w.meshes.push_back(background);
  if (sky) {
    const auto file = read_exr(*museum);
    EXPECT_TRUE(file.ok());
    Luminaire l;
    l.kind = l.name = "hemisphere";
    l.axis = {0, 1, 0};
    l.up = {0, 0, 1};
    l.radiance = {1, 1, 1};
    l.whole_sphere = true;
    l.light_image = std::make_shared<LightImage>(
        LightImage{file->image.width, file->image.height, {file->image.pixels.begin(), file->image.pixels.end()}});
    w.luminaires.push_back(l);
  }
  return w;
}
const Camera kMediaCamera = looking({0, 0.5, 4}, {0, -0.5, 0}, kFiftyMillimetres);

Medium medium(float scale, Vec3f extinction, Vec3f albedo) {
  Medium m;
  m.kind = "homogeneous";
  m.name = "medium1";
  const Vec3f s = scale * extinction * albedo, a = scale * extinction * (1.0f - albedo);
  m.scattering = {s.x, s.y, s.z};
  m.absorption = {a.x, a.y, a.z};
  return m;
}

void add_null(World& w, const std::string& mesh) {
  w.meshes.push_back(from_file("participating_media/meshes/" + mesh, kAir));
  w.meshes.back().null_surface = true;
  w.meshes.back().interior_medium = "medium1";
}

Frame media_picture(const World& w, int spp, int depth) {
  RenderKnobs knobs = sampled(spp);
  knobs.max_depth = depth;
  return trace(w, kMediaCamera, knobs, 48, 48);
}

TEST(Mitsuba, HomogeneousMediumWithinNullSurfaces) {
  const auto theirs = reference("participating_media/refs/test_homo_null_envmap");
  auto w = media_room(true);
  if (!theirs || !w) GTEST_SKIP();
  w->media.push_back(medium(3, {1, 1, 1}, {0.99f, 0.5f, 0.5f}));
  add_null(*w, "sphere_tiny.obj");
  add_null(*w, "sphere_base.obj");
  EXPECT_GE(passing(media_picture(*w, 64, 5), *theirs, everywhere), kPassing);
}

TEST(Mitsuba, ExtinctionThatDiffersByBand) {
  const auto theirs = reference("participating_media/refs/test_homo_spectral_sigmat");
  auto w = media_room(true);
  if (!theirs || !w) GTEST_SKIP();
  w->media.push_back(medium(10, {1, 0.2f, 1}, {0.5f, 0.5f, 0.99f}));
  add_null(*w, "sphere_tiny.obj");
  add_null(*w, "sphere_base.obj");
  EXPECT_GE(passing(media_picture(*w, 64, 5), *theirs, everywhere), kPassing);
}

TEST(Mitsuba, ADensityGridAroundAMatteBall) {
  const auto theirs = reference("participating_media/refs/test_hetero_sigmat");
  auto w = media_room(true);
  const auto volume = shared_data("gt/mitsuba/participating_media/textures/sigmat.vol");
  if (!theirs || !w || !volume) GTEST_SKIP();
  Medium m = medium(5, {1, 1, 1}, {0.99f, 0.5f, 0.5f});
  m.kind = "density_grid";
  m.voxel_size = 1.5f / 16;
  m.position = WorldPoint::from(-0.5, -0.5, -0.5);
  const auto field = read_vol_file(*volume, FieldSampling::trilinear, 1);
  ASSERT_TRUE(field.ok()) << field.error().message;
  m.field = *field;
  w->media.push_back(m);
  add_null(*w, "unit_cube_centered.obj");
  // Mitsuba's medium ends at the grid's box, [-0.5, 1] on each axis, where its shape goes from -0.75 to 0.75.
  w->meshes.back().transform = glm::dmat3(1.25);
  w->meshes.back().position = WorldPoint::from(0.125, 0.125, 0.125);
  w->meshes.push_back(
      from_file("participating_media/meshes/sphere_base.obj", add_block(*w, matte("ball", {0.5f, 0.5f, 0.5f}))));
  EXPECT_GE(passing(media_picture(*w, 64, 5), *theirs, everywhere), kPassing);
}

TEST(Mitsuba, AnAreaLightAndAMediumWithinThinGlass) {
  const auto theirs = reference("participating_media/refs/test_homo_area_light");
  auto w = media_room(false);
  if (!theirs || !w) GTEST_SKIP();
  w->media.push_back(medium(2.5f, {1, 1, 1}, {0.99f, 0.999f, 0.99f}));
  add_null(*w, "sphere_tiny.obj");
  Block thin = matte("thin_water", {1e-6f, 1e-6f, 1e-6f});
  thin.bsdf = "thin";
  thin.opaque = false;
  thin.index_of_refraction = 1.333f;
  thin.transmission = {1, 1, 1};
  w->meshes.push_back(from_file("participating_media/meshes/sphere_base.obj", add_block(*w, thin)));
  w->meshes.back().interior_medium = "medium1";
  w->meshes.push_back(
      from_file("participating_media/meshes/angled_cube.obj", add_block(*w, matte("black", {1e-6f, 1e-6f, 1e-6f}))));
  w->meshes.back().radiance = {18.387f, 10.9873f, 8.75357f};
  w->meshes.back().position = WorldPoint::from(0.8, 0, 0);
  EXPECT_GE(passing(media_picture(*w, 64, 5), *theirs, everywhere), kPassing);
}

}  // namespace
}  // namespace render
