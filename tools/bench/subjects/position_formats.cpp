/// How far a vertex is drawn from its place when a position is stored in this or that format, by distance from the
/// origin.
///
/// A thousand vertices within 256 m of a camera; the output is vertex - camera, as a shader or a ray wants it.
/// Positions are whole multiples of 2^-60 m in 128-bit integers, so that the reference is exact at any distance.
#include <array>
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "tools/bench/benchmark.h"
#include "world/base/random.h"
#include "world/numbers/fixed.h"
#include "world/space/world_point.h"

namespace tools {

namespace {

using Exact = __int128;  // times 2^-60 m
using ExactPoint = std::array<Exact, 3>;
using world::Vec3d;
using world::Vec3f;
using world::WorldPoint;

constexpr int kExactLog2 = 60, kVertices = 1000, kRounds = 1000;
constexpr double kViewDistance = 256;

struct Scene {
  ExactPoint camera;
  std::vector<ExactPoint> vertices;
};

/// A camera at `distance` along x and somewhere near on the other axes; everything with fractions of 2^-60 m.
Scene scene_at(double distance, uint64_t seed) {
  const auto fraction = [&](int64_t i, int axis) {
    return static_cast<Exact>(world::random_bits(seed, i, axis, 1) >> 4);
  };
  const auto near = [&](int64_t i, int axis) {
    const uint64_t bits = world::random_bits(seed, i, axis, 0);
    return static_cast<int64_t>(world::uniform01_double(bits) * 2 * kViewDistance - kViewDistance);
  };
  Scene scene;
  const std::array<int64_t, 3> base{static_cast<int64_t>(distance), 70, -static_cast<int64_t>(0.6 * distance)};
  for (int a = 0; a < 3; ++a) scene.camera[a] = (static_cast<Exact>(base[a]) << kExactLog2) + fraction(-1, a);
  for (int i = 0; i < kVertices; ++i) {
    ExactPoint p;
    for (int a = 0; a < 3; ++a) p[a] = (static_cast<Exact>(base[a] + near(i, a)) << kExactLog2) + fraction(i, a);
    scene.vertices.push_back(p);
  }
  return scene;
}

int64_t whole(Exact v) { return static_cast<int64_t>(v >> kExactLog2); }
double part(Exact v) { return std::ldexp(static_cast<double>(v & ((Exact{1} << kExactLog2) - 1)), -kExactLog2); }
/// The nearest double: 128-bit integers convert with one rounding.
double rounded(Exact v) { return std::ldexp(static_cast<double>(v), -kExactLog2); }

// ---- the formats: stored type, from the exact point, and vertex - camera in the precision that the format computes in
// ----

struct FloatAbsolute {
  using Stored = Vec3f;
  using Camera = Vec3f;
  static Vec3f store(const ExactPoint& p) { return {float(rounded(p[0])), float(rounded(p[1])), float(rounded(p[2]))}; }
  static Vec3f camera(const ExactPoint& p) { return store(p); }
  static Vec3f relative(const Vec3f& p, const Vec3f& camera) { return p - camera; }
};

struct DoubleAbsolute {
  using Stored = Vec3d;
  using Camera = Vec3d;
  static Vec3d store(const ExactPoint& p) { return {rounded(p[0]), rounded(p[1]), rounded(p[2])}; }
  static Vec3d camera(const ExactPoint& p) { return store(p); }
  static Vec3d relative(const Vec3d& p, const Vec3d& camera) { return p - camera; }
};

/// What a vertex buffer holds: floats from the corner of the region; the region's own place minus the camera's is an
/// integer.
struct FloatFromRegion {
  struct Stored {
    world::RegionPos region;
    Vec3f offset;  // in [0, 128)
  };
  using Camera = WorldPoint;
  static WorldPoint camera(const ExactPoint& p) {
    return {{int32_t(whole(p[0])), int32_t(whole(p[1])), int32_t(whole(p[2]))}, {part(p[0]), part(p[1]), part(p[2])}};
  }
  static Stored store(const ExactPoint& p) {
    const WorldPoint point = camera(p);
    const world::RegionPos region = world::region_from_voxel(point.voxel);
    const world::VoxelPos in_region = point.voxel - world::voxel_from_region(region);
    return {region, Vec3f(Vec3d(in_region.x, in_region.y, in_region.z) + point.fraction)};
  }
  static Vec3f relative(const Stored& p, const WorldPoint& camera) {
    const world::VoxelPos d = world::voxel_from_region(p.region) - camera.voxel;
    return (Vec3f(d.x, d.y, d.z) - Vec3f(camera.fraction)) + p.offset;
  }
};

struct Fixed3232 {
  using Number = world::Fixed<32, 32>;
  using Stored = std::array<Number, 3>;
  using Camera = Stored;
  static Stored store(const ExactPoint& p) {
    Stored s;
    const auto code = [](Exact v) {
      return static_cast<int64_t>((v + (Exact{1} << (kExactLog2 - 33))) >> (kExactLog2 - 32));
    };
    for (int a = 0; a < 3; ++a) s[a] = Number::from_code(code(p[a]));
    return s;
  }
  static Stored camera(const ExactPoint& p) { return store(p); }
  static Vec3d relative(const Stored& p, const Stored& camera) {
    return {(p[0] - camera[0]).value(), (p[1] - camera[1]).value(), (p[2] - camera[2]).value()};
  }
};

struct VoxelAndFraction {
  using Stored = WorldPoint;
  using Camera = WorldPoint;
  static WorldPoint store(const ExactPoint& p) { return FloatFromRegion::camera(p); }
  static WorldPoint camera(const ExactPoint& p) { return store(p); }
  static Vec3d relative(const WorldPoint& p, const WorldPoint& camera) { return p - camera; }
};

template <class Format>
ErrorSample errors_of(const Scene& scene) {
  const auto camera = Format::camera(scene.camera);
  double worst = 0, squares = 0, sum = 0;
  for (const ExactPoint& p : scene.vertices) {
    const auto relative = Format::relative(Format::store(p), camera);
    for (int a = 0; a < 3; ++a) {
      // Below 2^12 m and a multiple of 2^-60 m or rounded to one: the difference is exact in 128 bits.
      const Exact got = static_cast<Exact>(std::ldexp(static_cast<long double>(relative[a]), kExactLog2));
      const double error = rounded(got - (p[a] - scene.camera[a]));
      worst = std::max(worst, std::abs(error)), squares += error * error, sum += error;
    }
  }
  const double count = 3.0 * static_cast<double>(scene.vertices.size());
  return {{worst, std::sqrt(squares / count)}, sum / count};
}

template <class Format>
double transform_all(const std::vector<typename Format::Stored>& stored, const typename Format::Camera& camera) {
  decltype(Format::relative(stored[0], camera)) sum(0);
  for (int round = 0; round < kRounds; ++round) {
    for (const auto& p : stored) sum += Format::relative(p, camera);
    keep(sum);
  }
  return static_cast<double>(stored.size()) * kRounds * sizeof(typename Format::Stored);
}

template <class Format>
void add_settings(std::vector<Setting>& settings, const std::string& method, bool is_default, uint64_t seed) {
  for (int power = 0; power <= 9; ++power) {
    const double distance = std::pow(10.0, power);
    const auto scene = std::make_shared<const Scene>(scene_at(distance, seed));
    const auto stored = std::make_shared<std::vector<typename Format::Stored>>();
    for (const ExactPoint& p : scene->vertices) stored->push_back(Format::store(p));
    const auto camera = Format::camera(scene->camera);
    Setting setting{.method = method, .setting = fmt::format("{}@1e{}", method, power)};
    setting.problem = fmt::format("1e{} m", power), setting.knob = distance, setting.is_default = is_default;
    setting.measure = [scene](uint64_t) { return errors_of<Format>(*scene); };
    setting.run = [stored, camera] { return transform_all<Format>(*stored, camera); };
    settings.push_back(std::move(setting));
  }
}

}  // namespace

void add_subject_position_formats(Registry& registry) {
  Subject subject{.question = "which format of a position, at which distance from the origin?",
                  .reference = "128-bit integers of 2^-60 m: exact",
                  .metrics = {"worst error of vertex - camera (m)", "RMS error (m)"},
                  .work_unit = "bytes read; a call makes 1e6 transforms: 1 ms a call is 1 ns a transform"};
  // Half an ulp grows with the coordinate; what counts from the camera or a region doesn't know the distance.
  subject.expected_slopes = {{"float absolute", {1, 1e3}},
                             {"double absolute", {1, 1e3}},
                             {"float from region", {0, 1}},
                             {"fixed 32.32", {0, 1}},
                             {"voxel and fraction", {0, 1}}};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    add_settings<FloatAbsolute>(settings, "float absolute", false, context.seed());
    add_settings<FloatFromRegion>(settings, "float from region", false, context.seed());
    add_settings<DoubleAbsolute>(settings, "double absolute", false, context.seed());
    add_settings<Fixed3232>(settings, "fixed 32.32", false, context.seed());
    add_settings<VoxelAndFraction>(settings, "voxel and fraction", true, context.seed());
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
