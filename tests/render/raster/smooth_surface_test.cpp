// Level sets by the rasterizer: triangles in place of cubes, against the trilinear field that the ray caster meets.
#include <cmath>

#include <gtest/gtest.h>

#include "render/extract/isosurface.h"
#include "render/image/display.h"
#include "render/image/flip.h"
#include "render/raster/raster.h"
#include "render/raster/rasterizer.h"
#include "render/raycast/raycast.h"
#include "tests/render/raster/level_set_worlds.h"

namespace render {
namespace {

using world::Vec3d;
using world::VoxelPos;
using world::World;

constexpr int kWidth = 320, kHeight = 180;

RasterBackend& raster() {
  static const std::unique_ptr<RasterBackend> backend = [] {
    auto made = make_raster({.validation = true});
    CHECK(made.ok());
    return std::move(*made);
  }();
  return *backend;
}

Image drawn(Backend& backend, const World& w, const Camera& camera, const RenderKnobs& knobs,
            FrameReport* report = nullptr) {
  auto frame = backend.render(world::WorldView(w), camera, knobs, kWidth, kHeight);
  if (!frame.ok()) ADD_FAILURE() << frame.error().message;
  if (frame.ok() && report) *report = frame->report;
  return frame.ok() ? std::move(frame->image) : Image(kWidth, kHeight);
}
Image cast(const World& w, const Camera& camera, const RenderKnobs& knobs) {
  auto backend = make_raycast_backend();
  return drawn(**backend, w, camera, knobs);
}

struct Agreement {
  size_t beyond = 0;  // pixels that differ by more than 8/255
  double mean = 0;    // difference, of 255
  double flip = 0;
};
Agreement agreement(const Image& a, const Image& b) {
  const Image8 x = display_image(a, 0), y = display_image(b, 0);
  Agreement found;
  double sum = 0;
  for (size_t i = 0; i < x.pixels.size(); i += 3) {
    int worst = 0;
    for (size_t c = 0; c < 3; ++c) worst = std::max(worst, std::abs(x.pixels[i + c] - y.pixels[i + c]));
    found.beyond += worst > 8, sum += worst;
  }
  found.mean = sum / (static_cast<double>(x.pixels.size()) / 3);
  found.flip = flip_map(x, y).mean;
  return found;
}

/// Pixels with a neighbour that differs by more than 16/255: outlines, and edges of shadows.
size_t edge_pixels(const Image& image) {
  const Image8 x = display_image(image, 0);
  size_t edges = 0;
  for (int row = 0; row + 1 < x.height; ++row)
    for (int column = 0; column + 1 < x.width; ++column) {
      const size_t at = 3 * static_cast<size_t>(row * x.width + column);
      bool edge = false;
      for (const size_t beside : {at + 3, at + 3 * static_cast<size_t>(x.width)})
        for (size_t c = 0; c < 3; ++c) edge |= std::abs(x.pixels[at + c] - x.pixels[beside + c]) > 16;
      edges += edge;
    }
  return edges;
}

/// RMS distance of a mesh's triangles, at their middles, from the surface, in voxels.
double rms_distance(const World& w, ContourMesh method) {
  const auto field = world::surface_field(w.store, 0);
  const auto mesh = isosurface(world::SolidField(*field, &w.store.masks(world::MaskKind::occupied)),
                               static_cast<SurfaceMethod>(method));
  CHECK(mesh.ok());
  double squares = 0;
  for (const glm::uvec3& t : mesh->triangles)
    squares += std::pow(distance_at((mesh->vertices[t.x] + mesh->vertices[t.y] + mesh->vertices[t.z]) / 3.0), 2);
  return std::sqrt(squares / static_cast<double>(mesh->triangles.size()));
}

// What the picture may differ by follows from how far the triangles lie from the surface: outlines and edges of shadows
// move by no more than that in the mean, at the pixels that a voxel has, and along them that share of the pixels
// differs. Inside, normals are up to 60 / R + 0.3 degrees off (contours.h), R = 5 voxels at least; a cosine changes by
// their sine, which is less than 8/255 of what the display shows.
TEST(RasterSmoothSurface, IsAsNearTheFieldThatTheRayCasterMeetsAsItsTrianglesAre) {
  const World w = rings(false);
  RenderKnobs knobs;
  knobs.contours = ContourShape::field;
  const Image field = cast(w, at_rings(), knobs);
  constexpr double kNearest = 28;  // m from the camera to the ball
  const double pixels_a_voxel = kHeight / (2 * std::tan(at_rings().vertical_fov / 2)) / kNearest;
  const auto edges = static_cast<double>(edge_pixels(field));
  knobs.contour_mesh = ContourMesh::blocks;
  const Agreement of_blocks = agreement(drawn(raster(), w, at_rings(), knobs), field);
  for (const ContourMesh method : {ContourMesh::surface_nets, ContourMesh::marching_cubes,
                                   ContourMesh::marching_tetrahedra, ContourMesh::openvdb}) {
    knobs.contour_mesh = method;
    const std::string name(knob_choices(method)[static_cast<size_t>(method)]);
    const Agreement found = agreement(drawn(raster(), w, at_rings(), knobs), field);
    const double bound = edges * std::min(rms_distance(w, method) * pixels_a_voxel, 1.0);
    std::printf("%-20s %zu pixels differ by more than 8/255 (bound %.0f), mean %.3f/255, FLIP %.5f\n", name.c_str(),
                found.beyond, bound, found.mean, found.flip);
    EXPECT_LE(static_cast<double>(found.beyond), bound) << name;
    EXPECT_LT(found.flip, 0.01) << name;
    EXPECT_LT(20 * found.mean, of_blocks.mean) << name << ": blocks are first order";
  }
  EXPECT_EQ(raster().messages(), std::vector<std::string>{});
}

TEST(RasterSmoothSurface, HasTheBlocksThatItIsMadeOf) {
  const World w = rings();
  RenderKnobs knobs;
  knobs.contours = ContourShape::field;
  const Agreement found = agreement(drawn(raster(), w, at_rings(), knobs), cast(w, at_rings(), knobs));
  // Where two kinds meet, triangles end up to a voxel beside the voxels' border.
  EXPECT_LT(found.beyond, kWidth * kHeight / 200);
}

TEST(RasterSmoothSurface, FollowsEdits) {
  World w = rings();
  RenderKnobs knobs;
  knobs.contours = ContourShape::field;
  FrameReport report;
  const Image before = drawn(raster(), w, at_rings(), knobs);
  world::EditBatch batch;
  batch.fill({{8, 8, 0}, {20, 30, 12}}, world::kAir);
  apply(w, batch);
  const Image after = drawn(raster(), w, at_rings(), knobs);
  auto fresh = make_raster({});
  ASSERT_TRUE(fresh.ok());
  EXPECT_TRUE(after.pixels == drawn(**fresh, w, at_rings(), knobs).pixels);
  EXPECT_FALSE(after.pixels == before.pixels);
  // Back to cubes, and no triangle is left.
  knobs.contours = ContourShape::off;
  const Image cubes = drawn(raster(), w, at_rings(), knobs);
  EXPECT_TRUE(cubes.pixels == drawn(**fresh, w, at_rings(), knobs).pixels);
  EXPECT_TRUE(raster().rasterizer().triangles().empty());
  EXPECT_EQ(raster().messages(), std::vector<std::string>{});
}

TEST(RasterSmoothSurface, IsTheSameTenThousandKilometresFromTheOrigin) {
  constexpr VoxelPos kFar{10'000'000, 0, -10'000'000};
  RenderKnobs knobs;
  knobs.contours = ContourShape::field;
  const Agreement found =
      agreement(drawn(raster(), rings(true, kFar), at_rings(kFar), knobs), drawn(raster(), rings(), at_rings(), knobs));
  EXPECT_LT(found.mean, 0.01);
}

TEST(RasterSmoothSurface, IsNotAskedForWhereThereIsNoLevelSet) {
  const World w = hills();
  RenderKnobs knobs;
  FrameReport with, without;
  const Image off = drawn(raster(), w, hill_cameras()[0].camera, knobs, &without);
  knobs.contours = ContourShape::field;
  EXPECT_TRUE(drawn(raster(), w, hill_cameras()[0].camera, knobs, &with).pixels == off.pixels);
  EXPECT_EQ(with.passes.size(), without.passes.size());
}

}  // namespace
}  // namespace render
