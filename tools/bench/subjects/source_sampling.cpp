/// How far the voxels of a source lie from its surface, and what finer voxels cost.
///
/// Each source is a ball, a ring or a box of some 20 m whose distance is known in closed form; it is placed off the
/// grid. The error is measured at the middle of every voxel face between solid and air: where voxels are decided by
/// their middles, it lies within half a voxel of the surface, so the error is first order in the voxel size. The mesh
/// is a ball of 81,920 triangles, which lie up to 0.5 mm inside it.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>

#include <fmt/format.h>

#include "tools/bench/benchmark.h"
#include "world/meshes/mesh.h"
#include "world/sources/mesh/mesh_shape.h"
#include "world/sources/source.h"

namespace tools {

namespace {

using world::Vec3d;
using world::VoxelPos;

constexpr double kPi = 3.14159265358979323846;
constexpr double kRadius = 8.3, kRing = 9.1, kTube = 3.2, kBox = 7.3;

struct Thing {
  std::shared_ptr<const world::Shape> shape;
  std::function<double(const Vec3d&)> distance;  // from the surface, below 0 inside, m
  double volume = 0;                             // m^3
};

std::shared_ptr<const world::Shape> shape_from(const std::string& keys) {
  auto document = world::TomlDocument::parse("[[source]]\nblock='stone'\n" + keys, "subject");
  std::shared_ptr<const world::Shape> shape;
  auto root = document->root();
  for (world::TomlTable table : root.array_of_tables("source")) shape = world::read_source(table, {}, {}).shape;
  return shape;
}

/// An icosahedron, each triangle divided into four `levels` times, its corners pushed out to the ball.
world::TriangleMesh ball_mesh(double radius, int levels) {
  const double g = 0.5 * (1 + std::sqrt(5.0));
  std::vector<Vec3d> corners{{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                             {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  std::vector<std::array<Vec3d, 3>> triangles;
  for (const glm::uvec3 t :
       {glm::uvec3{0, 11, 5}, {0, 5, 1},  {0, 1, 7}, {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4}, {11, 10, 2},
        {10, 7, 6},           {7, 1, 8},  {3, 9, 4}, {3, 4, 2},  {3, 2, 6},   {3, 6, 8}, {3, 8, 9},  {4, 9, 5},
        {2, 4, 11},           {6, 2, 10}, {8, 6, 7}, {9, 8, 1}})
    triangles.push_back({glm::normalize(corners[t.x]), glm::normalize(corners[t.y]), glm::normalize(corners[t.z])});
  for (int level = 0; level < levels; ++level) {
    std::vector<std::array<Vec3d, 3>> finer;
    for (const auto& [a, b, c] : triangles) {
      const Vec3d ab = glm::normalize(a + b), bc = glm::normalize(b + c), ca = glm::normalize(c + a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    triangles = std::move(finer);
  }
  world::TriangleMesh mesh;
  for (const auto& t : triangles) {
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    for (const Vec3d& p : t) mesh.positions.emplace_back(radius * p);
    mesh.triangles.emplace_back(first, first + 1, first + 2);
  }
  return mesh;
}

/// From the surface of a box around a centre.
double from_box(const Vec3d& p, const Vec3d& half) {
  const Vec3d q = glm::abs(p) - half;
  return glm::length(glm::max(q, Vec3d(0.0))) + std::min(std::max(q.x, std::max(q.y, q.z)), 0.0);
}

/// A net on a ring whose B-spline is that ring within a tenth of a millimetre, and its triangles within two: knots of a
/// circle's lie at (2 + cos step) / 3 of its radius.
std::string ring_net() {
  constexpr int kPoints = 32;
  const double step = 2 * kPi / kPoints, outward = 3 / (2 + std::cos(step));
  std::string points;
  for (int row = 0; row < kPoints; ++row)
    for (int column = 0; column < kPoints; ++column) {
      const double around = row * step, tube = column * step;
      const double from_axis = outward * (kRing + outward * kTube * std::cos(tube));
      points += fmt::format("{}{},{},{}", points.empty() ? "" : ",", from_axis * std::cos(around),
                            outward * kTube * std::sin(tube), from_axis * std::sin(around));
    }
  return fmt::format(
      "kind='spline_patch'\nerror_voxels=0.002\nrows={0}\ncolumns={0}\nclosed_rows=true\nclosed_columns=true\npoints=[{"
      "1}]",
      kPoints, points);
}

/// All of its edges are creases, so that it stays what it is.
Result<std::string> cube_cage(BenchContext& context) {
  TRY(const std::filesystem::path folder, context.scratch());
  const std::filesystem::path file = folder / "cube.obj";
  std::ofstream out(file);
  for (int corner = 0; corner < 8; ++corner)
    out << fmt::format("v {} {} {}\n", corner & 1 ? kBox : -kBox, corner & 2 ? kBox : -kBox, corner & 4 ? kBox : -kBox);
  out << "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
  return fmt::format("kind='subdivision'\nfile='{}'\nlevels=3\ncrease_angle_deg=80", file.string());
}

Result<std::vector<std::pair<std::string, Thing>>> things(BenchContext& context) {
  TRY(const std::string cage, cube_cage(context));
  const auto of_ring = [](const Vec3d& p) { return std::hypot(std::hypot(p.x, p.z) - kRing, p.y) - kTube; };
  const double ring = 2 * kPi * kPi * kRing * kTube * kTube;
  const auto of_cube = [](const Vec3d& p) { return from_box(p, Vec3d(kBox)); };
  const double cube = 8 * kBox * kBox * kBox;
  // A land as high everywhere, from x = z = 0 on.
  const std::string land =
      fmt::format("kind='heightfield'\nsize=[{0},{0}]\nbase_m={1}\ncolumns=2\nrows=2\nheights=[{2},{2},{2},{2}]",
                  2 * kBox, -kBox, kBox);
  const auto of_land = [](const Vec3d& p) { return from_box(p - Vec3d(kBox, 0, kBox), Vec3d(kBox)); };
  const auto of_ball = [](const Vec3d& p) { return glm::length(p) - kRadius; };
  const double ball = 4.0 / 3 * kPi * kRadius * kRadius * kRadius;
  world::MeshShapeReport report;
  return std::vector<std::pair<std::string, Thing>>{
      {"implicit",
       {shape_from(fmt::format("kind='implicit'\nsurface='torus'\nradius={}\ntube_radius={}", kRing, kTube)), of_ring,
        ring}},
      {"metaballs",
       {shape_from(fmt::format("kind='metaballs'\n[[source.ball]]\nposition=[0,0,0]\nradius={}", kRadius)), of_ball,
        ball}},
      {"mesh", {world::mesh_shape(ball_mesh(kRadius, 6), {}, report), of_ball, ball}},
      {"points", {world::point_shape({Vec3d(0.0)}, kRadius), of_ball, ball}},
      {"heightfield", {shape_from(land), of_land, cube}},
      {"spline_patch", {shape_from(ring_net()), of_ring, ring}},
      {"subdivision", {shape_from(cage), of_cube, cube}},
  };
}

world::Placement placed() {
  world::Placement placement{world::WorldPoint::from(0.37, -0.21, 0.13)};
  const double c = std::cos(0.6), s = std::sin(0.6);
  placement.transform = glm::dmat3(c, s, 0, -s, c, 0, 0, 0, 1);
  return placement;
}

/// Faces between solid and air, at their middles.
ErrorSample errors_of(const Thing& thing, const world::Sampling& sampling) {
  world::Store store(world::standard_blocks());
  const world::Placement placement = placed();
  const auto sampled = sample_shape(store, *thing.shape, placement, sampling, 1);
  if (!sampled) return {{NAN, NAN, NAN}, NAN};
  const glm::dmat3 back = glm::inverse(placement.transform);
  world::StoreReader reader(store);
  double worst = 0, squares = 0, sum = 0, faces = 0;
  const world::VoxelBox box = store.bounds();
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) {
        const VoxelPos v{x, y, z};
        if (reader.get(v) == world::kAir) continue;
        for (int face = 0; face < world::kFaces; ++face) {
          const VoxelPos step = world::face_step(face);
          if (reader.get(v + step) != world::kAir) continue;
          const Vec3d middle = Vec3d(0.5) + 0.5 * Vec3d(step.x, step.y, step.z);
          const Vec3d p =
              sampling.voxel_size_m * (back * (world::WorldPoint{v, Vec3d(0.0)} - placement.position + middle));
          const double d = thing.distance(p);
          worst = std::max(worst, std::abs(d)), squares += d * d, sum += d, ++faces;
        }
      }
  const double cell = std::pow(sampling.voxel_size_m, 3), volume = static_cast<double>(store.voxel_count()) * cell;
  return {{worst, std::sqrt(squares / faces), std::abs(volume / thing.volume - 1)}, sum / faces};
}

double sample_once(const Thing& thing, const world::Sampling& sampling) {
  world::Store store(world::standard_blocks());
  const auto sampled = sample_shape(store, *thing.shape, placed(), sampling, 1);
  return sampled ? static_cast<double>(sampled->queries) : NAN;
}

}  // namespace

void add_subject_source_sampling(Registry& registry) {
  Subject size{.question = "how near do the voxels of a source come to its surface, and what do finer ones cost?",
               .reference = "the surface itself, closed form (the mesh: within 0.5 mm; the spline: 2 mm)",
               .metrics = {"worst distance of faces (m)", "RMS distance (m)", "relative error of the volume"},
               .work_unit = "boxes and points asked about"};
  for (const char* kind : {"implicit", "metaballs", "mesh", "points", "heightfield", "spline_patch", "subdivision"})
    size.expected_slopes[kind] = {.slope = 1, .from_knob = 0};
  size.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    TRY(const auto all, things(context));
    for (const auto& [name, thing] : all) {
      const auto shared = std::make_shared<const Thing>(thing);
      for (const double voxel : {2.0, 1.0, 0.5, 0.25, 0.125}) {
        if (context.quick() && voxel < 0.25) continue;
        const world::Sampling sampling{.voxel_size_m = voxel};
        Setting s{.method = name, .setting = fmt::format("{}@{} m", name, voxel)};
        s.problem = name, s.knob = voxel, s.is_default = voxel == 1;
        s.measure = [shared, sampling](uint64_t) { return errors_of(*shared, sampling); };
        s.run = [shared, sampling] { return sample_once(*shared, sampling); };
        settings.push_back(std::move(s));
      }
    }
    return settings;
  };
  registry.add(std::move(size));

  Subject coverage{.name = "source_coverage",
                   .question = "which part of a voxel must be inside, and do more points in it pay?",
                   .reference = "the surface itself, closed form",
                   .metrics = {"RMS distance of faces (m)", "worst distance (m)", "relative error of the volume"},
                   .work_unit = "boxes and points asked about"};
  coverage.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    TRY(const auto all, things(context));
    const auto shared = std::make_shared<const Thing>(all.front().second);
    for (const int points : {1, 2, 4, 8}) {
      for (const double part : {0.0, 0.125, 0.25, 0.5, 0.75, 1.0}) {
        if (points == 1 && part != 0 && part != 0.5) continue;  // one point is in or out
        const world::Sampling sampling{.voxel_size_m = 0.5, .supersampling = points, .coverage = part};
        Setting s{.method = fmt::format("{} points a side", points),
                  .setting = fmt::format("{} points a side@{}", points, part)};
        s.knob = part, s.is_default = points == 1 && part == 0.5;
        s.measure = [shared, sampling](uint64_t) {
          ErrorSample e = errors_of(*shared, sampling);
          std::swap(e.errors[0], e.errors[1]);
          return e;
        };
        s.run = [shared, sampling] { return sample_once(*shared, sampling); };
        settings.push_back(std::move(s));
      }
    }
    return settings;
  };
  registry.add(std::move(coverage));
}

}  // namespace tools
