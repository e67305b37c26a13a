/// A torus as a level set: how near each way to draw it comes, and what it costs to make from the field.
///
/// The torus is tilted and lies off the grid; a voxel holds its exact distance. Meshes are measured at points spread
/// over their area; contours, which rays meet, where rays along the torus's normal meet them. Time is that of making
/// the mesh, or the contours, from the layer; the work is what is then drawn or kept.
#include <array>
#include <cmath>
#include <map>
#include <memory>

#include <fmt/format.h>

#include "render/extract/isosurface.h"
#include "tools/bench/benchmark.h"
#include "world/store/contour_walk.h"

namespace tools {

namespace {

using world::ContourShape;
using world::SolidField;
using world::Vec3d;
using world::VoxelPos;

constexpr double kRing = 9.1, kTube = 3.2, kTurn = 6.283185307179586;  // m
const Vec3d kMiddle(0.37, -0.21, 0.13);

/// The axis leans by 35 degrees to the y axis.
struct Frame {
  Vec3d u, axis, w;
  Frame() : axis(glm::normalize(Vec3d(0.4, 1, 0.57))) {
    u = glm::normalize(glm::cross(axis, Vec3d(0, 0, 1)));
    w = glm::cross(u, axis);
  }
};
const Frame kFrame;

struct OnTorus {
  double distance;
  Vec3d normal;
};
OnTorus torus_at(const Vec3d& p) {
  const Vec3d d = p - kMiddle;
  const double height = glm::dot(d, kFrame.axis);
  const Vec3d flat = d - height * kFrame.axis, out = d - kRing * glm::normalize(flat);
  return {glm::length(out) - kTube, glm::normalize(out)};
}

/// The level set in a layer, and the blocks that go with it, at one voxel size.
struct Sampled {
  double voxel_m;
  world::FloatLayer distance;
  world::MaskVolume blocks;
  std::unique_ptr<world::SurfaceField> field;

  explicit Sampled(double size) : voxel_m(size) {
    const int leaves = static_cast<int>(std::ceil((kRing + kTube + 1) / size)) / world::kLeafSize + 1;
    std::array<float, world::kLeafVoxels> values;
    for (int x = -leaves; x < leaves; ++x)
      for (int y = -leaves; y < leaves; ++y)
        for (int z = -leaves; z < leaves; ++z) {
          world::LeafMask inside, band;
          for (int i = 0; i < world::kLeafVoxels; ++i) {
            const VoxelPos v = voxel_from_leaf(world::LeafPos{x, y, z}) + world::offset_in_leaf(i);
            const double d = torus_at(size * (Vec3d(v.x, v.y, v.z) + 0.5)).distance / size;
            values[static_cast<size_t>(i)] = static_cast<float>(d);
            if (d <= 0) inside.set(i);
            if (std::abs(d) < 3) band.set(i);
          }
          blocks.set_leaf({x, y, z}, inside);
          distance.write_leaf({x, y, z}, values, band);
        }
    field = world::level_set_surface(distance);
  }
  Sampled(const Sampled&) = delete;
  world::VoxelMesh mesh(render::SurfaceMethod method, double adaptivity) const {
    auto made = render::isosurface(SolidField(*field, &blocks), method, adaptivity);
    return made.ok() ? std::move(*made) : world::VoxelMesh{};
  }
  world::Contours contours(bool keep_values) const {
    return world::Contours(blocks, world::level_set_surface(distance), keep_values);
  }
};

double degrees_between(const Vec3d& a, const Vec3d& b) {
  return 360 / kTurn * std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

/// Collects what lies where the surface is drawn.
struct Errors {
  double count = 0, squares = 0, sum = 0, worst = 0, faces = 0, shaded = 0;
  void add(const Vec3d& place, const Vec3d& face, const Vec3d& shade) {
    const OnTorus exact = torus_at(place);
    const double of_face = degrees_between(face, exact.normal), of_shade = degrees_between(shade, exact.normal);
    ++count, sum += exact.distance, squares += exact.distance * exact.distance;
    worst = std::max(worst, std::abs(exact.distance));
    faces += of_face * of_face, shaded += of_shade * of_shade;
  }
  ErrorSample sample() const {
    return {{std::sqrt(squares / count), worst, std::sqrt(faces / count), std::sqrt(shaded / count)}, sum / count};
  }
};

/// Fractions of an even spread over a square.
/// source Martin Roberts. The Unreasonable Effectiveness of Quasirandom Sequences. 2018 (R2)
struct Spread {
  double u, v;
};
Spread spread(int i) {
  const double u = 0.5 + 0.7548776662466927 * i, v = 0.5 + 0.5698402909980532 * i;
  return {u - std::floor(u), v - std::floor(v)};
}

ErrorSample mesh_errors(const Sampled& sampled, render::SurfaceMethod method, double adaptivity, int points) {
  const world::VoxelMesh mesh = sampled.mesh(method, adaptivity);
  const std::vector<world::Vec3f> normals = render::vertex_normals(mesh);
  const bool faceted = method == render::SurfaceMethod::blocks;
  double area = 0;
  const auto area_of = [&](const glm::uvec3& t) {
    return 0.5 * glm::cross(mesh.vertices[t.y] - mesh.vertices[t.x], mesh.vertices[t.z] - mesh.vertices[t.x]);
  };
  for (const glm::uvec3& t : mesh.triangles) area += glm::length(area_of(t));
  // The points divide the area evenly; each lies somewhere in the triangle where its share falls.
  Errors errors;
  double before = 0;
  int next = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    const Vec3d face = area_of(t);
    before += glm::length(face);
    for (; next < points && (next + 0.5) / points * area < before; ++next) {
      Spread at = spread(next);
      if (at.u + at.v > 1) at = {1 - at.u, 1 - at.v};
      const auto mix = [&](const Vec3d& a, const Vec3d& b, const Vec3d& c) {
        return a + at.u * (b - a) + at.v * (c - a);
      };
      const Vec3d place = mix(mesh.vertices[t.x], mesh.vertices[t.y], mesh.vertices[t.z]);
      errors.add(sampled.voxel_m * place, face,
                 faceted ? face : mix(Vec3d(normals[t.x]), Vec3d(normals[t.y]), Vec3d(normals[t.z])));
    }
  }
  return errors.sample();
}

ErrorSample contour_errors(const Sampled& sampled, ContourShape shape, int points) {
  const world::Contours contours = sampled.contours(shape == ContourShape::field);
  const world::ContourWalker walker(contours, shape);
  Errors errors;
  for (int i = 0; i < points; ++i) {
    // Spread evenly over the area of the torus: its density grows with the distance from the axis.
    const auto [u, v] = spread(i);
    double tube = kTurn * v;
    for (int k = 0; k < 20; ++k) tube = kTurn * v - kTube / kRing * std::sin(tube);
    const Vec3d way = std::cos(kTurn * u) * kFrame.u + std::sin(kTurn * u) * kFrame.w;
    const Vec3d normal = std::cos(tube) * way + std::sin(tube) * kFrame.axis;
    const Vec3d from = (kMiddle + kRing * way + kTube * normal) / sampled.voxel_m + 2.5 * normal;
    const world::ContourHit hit = walker.first_hit({world::WorldPoint::from(from.x, from.y, from.z), -normal});
    errors.add(sampled.voxel_m * (from - (hit.hit() ? hit.grid.t : 1e3) * normal), hit.normal, hit.normal);
  }
  return errors.sample();
}

}  // namespace

void add_subject_smooth_surface(Registry& registry) {
  Subject subject{.question = "how near do meshes and contours of a level set come to its surface, and at what cost?",
                  .reference = "the torus itself, closed form",
                  .metrics = {"RMS distance (m)", "worst distance (m)", "RMS angle of the faces' normals (degrees)",
                              "RMS angle of the shaded normals (degrees)"},
                  .work_unit = "triangles; of contours voxels",
                  .knob_unit = "m a voxel"};
  for (const char* method : {"surface_nets", "marching_cubes", "marching_tetrahedra", "openvdb", "planes", "field"})
    subject.expected_slopes[method] = {.slope = 2, .from_knob = 0};
  subject.expected_slopes["blocks"] = {.slope = 1, .from_knob = 0};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    const int points = context.quick() ? 20000 : 200000;
    std::map<double, std::shared_ptr<Sampled>> at;
    for (const double size : {0.8, 0.4, 0.2, 0.1}) {
      if (context.quick() && size < 0.2) continue;
      const std::string name = fmt::format("smooth_surface {}", size);
      at[size] = context.shared<Sampled>(name, [size] { return std::make_shared<Sampled>(size); });
    }
    const auto add = [&](std::string method, double knob, double size, auto measure, auto run) {
      Setting s;
      s.method = std::move(method);
      s.setting = fmt::format("{}@{}", s.method, knob), s.knob = knob;
      s.is_default = s.method == "marching_cubes";  // of SmoothOptions
      s.measure = [sampled = at.at(size), measure](uint64_t) { return measure(*sampled); };
      s.run = [sampled = at.at(size), run] { return run(*sampled); };
      settings.push_back(std::move(s));
    };
    const auto add_mesh = [&](std::string name, double knob, double size, render::SurfaceMethod method,
                              double adaptivity) {
      add(
          std::move(name), knob, size,
          [=](const Sampled& sampled) { return mesh_errors(sampled, method, adaptivity, points); },
          [=](const Sampled& sampled) {
            return static_cast<double>(sampled.mesh(method, adaptivity).triangles.size());
          });
    };
    for (const auto& [size, sampled] : at) {
      for (const std::string_view name : render::surface_method_names())
        add_mesh(std::string(name), size, size, *render::surface_method_from_name(name), 0);
      for (const auto& [shape, name] :
           {std::pair{ContourShape::planes, "planes"}, std::pair{ContourShape::field, "field"}})
        add(
            name, size, size, [shape = shape, points](const Sampled& s) { return contour_errors(s, shape, points); },
            [shape = shape](const Sampled& s) {
              const world::Contours contours = s.contours(shape == ContourShape::field);
              double planes = 0;
              for (const world::LeafPos& l : s.distance.leaves())
                if (const world::Contours::Planes* leaf = contours.leaf(l).planes)
                  for (const uint32_t word : *leaf) planes += word != world::kNoContour;
              return planes;
            });
    }
    // The knob of these is the adaptivity, at the finest voxels.
    for (const double adaptivity : {0.01, 0.03, 0.1, 0.3})
      add_mesh("openvdb adaptive", adaptivity, at.begin()->first, render::SurfaceMethod::openvdb, adaptivity);
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
