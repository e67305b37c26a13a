// Embree finds candidates, Loam decides. Triangles are user geometry: Embree keeps a tree of boxes and calls back for
// each triangle whose box the ray may meet; the hit itself is intersect_triangle in double, on corners in double. So a
// hit is the same as that of a loop over all triangles, bit for bit, and watertight wherever the ray comes from.
//
// That no box is missed, though Embree's rays and boxes are float:
//   base     a voxel near the middle of the meshes; R: largest coordinate of a corner, relative to it
//   ray      moved forward, in double, to where it enters the box of all meshes, then rounded: off by R 2^-24 on an
//   axis path     at most 2 sqrt(3) R long, along a direction that is off by 2^-24: off by 4 R 2^-24 at its end moving
//   rounds in double: off by 11 * 2^31 * 2^-53 m for a ray from the other end of the world boxes    widened by 8 R
//   2^-24 and 2^-18 m, then rounded outwards t        Embree's `robust` traversal bounds its own roundings; its far end
//   is rounded up
// Embree's triangles instead (float corners, and a filter that asks double) would lose hits near edges, where double
// sees the ray in a neighbour of the triangle that float sees.
// source  Ingo Wald, Sven Woop, Carsten Benthin, Gregory Johnson, Manfred Ernst. Embree: A Kernel Framework for
//         Efficient CPU Ray Tracing. 2014
#include "render/trace/mesh_scene.h"

#include <atomic>
#include <cmath>

#include <embree3/rtcore.h>
#include <fmt/format.h>
#include <xmmintrin.h>

#include "world/base/jobs.h"
#include "world/space/ray_shapes.h"

namespace render {
namespace {

using world::GridRay;
using world::MeshInstance;
using world::TriangleMesh;
using world::VoxelPos;

constexpr float kFloatInfinity = std::numeric_limits<float>::infinity();

/// Embree turns denormals off while it builds; the caller's mode comes back whatever it does. So does that of parallel
/// loops: oneTBB hands all its tasks the mode in which a thread first used it, so that first use must come before.
class KeepFloatingPointMode {
 public:
  KeepFloatingPointMode() {
    world::parallel_for(2, [](size_t) {});
  }
  ~KeepFloatingPointMode() { _mm_setcsr(mode_); }

 private:
  unsigned mode_ = _mm_getcsr();
};

float rounded_down(double x) {
  const float f = static_cast<float>(x);
  return f > x ? std::nextafter(f, -kFloatInfinity) : f;
}
float rounded_up(double x) { return -rounded_down(-x); }

struct Triangle {
  uint32_t instance, index;  // of World::meshes, of its mesh's triangles
  uint32_t first_corner;     // of the instance, in State::corners
};
static_assert(sizeof(Triangle) == 12);

struct Box {
  Vec3d low{world::kInfinity}, high{-world::kInfinity};
  void include(const Vec3d& p) { low = min(low, p), high = max(high, p); }
};

/// One query, as Embree's callback sees it: the context comes first, so that a pointer to it is one to this.
struct Query {
  RTCIntersectContext context;
  Vec3d origin, direction;  // relative to the base; as the caller gave it
  double t_max;
  double metres;  // a length of the direction, in metres
  double start;   // what the float ray was moved forward, in metres
  MeshOrigin from;
  bool any = false;  // occluded(): only opaque triangles count, and one is enough
  // The best so far.
  bool hit = false;
  uint32_t triangle = 0;  // of State::triangles
  world::TriangleHit<double> at{};
};
static_assert(std::is_standard_layout_v<Query>);

}  // namespace

struct MeshScene::State {
  VoxelPos base;
  std::vector<Vec3d> corners;  // m, relative to the base, by instance and vertex
  std::vector<Triangle> triangles;
  struct Instance {
    std::shared_ptr<const TriangleMesh> mesh;
    glm::dmat3 normal_transform;  // world from mesh; turned round where mirrored
    bool mirrored = false, smooth = false, opaque = true;
  };
  std::vector<Instance> instances;
  Box box;  // of all corners
  double widening = 0;
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::atomic<ssize_t> embree_bytes{0};

  State() = default;
  ~State() {
    const KeepFloatingPointMode keep;
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }

  world::Status add(const MeshInstance& instance, uint32_t number, bool opaque);
  world::Status commit();
  void corners_of(const Triangle& t, const Vec3d* (&corner)[3]) const {
    const glm::uvec3& v = instances[t.instance].mesh->triangles[t.index];
    for (int i = 0; i < 3; ++i) corner[i] = &corners[t.first_corner + v[i]];
  }
  bool start(Query& query, const GridRay& ray, RTCRay& out) const;
  static void bounds(const RTCBoundsFunctionArguments* arguments);
  template <class Arguments>
  static void meet(const Arguments* arguments, RTCRay& ray, Query& query);
};

world::Status MeshScene::State::add(const MeshInstance& instance, uint32_t number, bool opaque) {
  Instance kept;
  const Vec3d moved = instance.position - world::WorldPoint{base, Vec3d(0.0)};
  if (instance.mesh) {
    const TriangleMesh& mesh = *instance.mesh;
    const glm::dmat3& m = instance.transform;
    // Normals go with the cofactors, which are the inverse transpose times the determinant.
    kept.normal_transform = glm::dmat3(cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1]));
    kept.mirrored = dot(m[0], kept.normal_transform[0]) < 0;
    if (corners.size() + mesh.positions.size() > 0xffffffffu)
      return world::input_error(fmt::format("{}: all meshes together have more than 2^32 vertices", instance.where));
    const uint32_t first = static_cast<uint32_t>(corners.size());
    for (const Vec3f& p : mesh.positions) {
      const Vec3d corner = moved + m * Vec3d(p);
      for (int a = 0; a < 3; ++a)
        if (!(std::abs(corner[a] + base[a]) <= world::kWorldBorder))
          return world::input_error(
              fmt::format("{}: the mesh \"{}\" reaches outside the world", instance.where, instance.name));
      corners.push_back(corner);
      box.include(corner);
    }
    for (uint32_t i = 0; i < mesh.triangles.size(); ++i) {
      const glm::uvec3& v = mesh.triangles[i];
      if (world::triangle_normal(corners[first + v.x], corners[first + v.y], corners[first + v.z]))
        triangles.push_back({number, i, first});
    }
  }
  kept.mesh = instance.mesh;
  kept.smooth = instance.smooth;
  kept.opaque = opaque;
  instances.push_back(std::move(kept));
  return {};
}

void MeshScene::State::bounds(const RTCBoundsFunctionArguments* arguments) {
  const State& state = *static_cast<const State*>(arguments->geometryUserPtr);
  const Vec3d* corner[3];
  state.corners_of(state.triangles[arguments->primID], corner);
  const Vec3d low = min(min(*corner[0], *corner[1]), *corner[2]) - state.widening,
              high = max(max(*corner[0], *corner[1]), *corner[2]) + state.widening;
  RTCBounds& b = *arguments->bounds_o;
  b.lower_x = rounded_down(low.x), b.lower_y = rounded_down(low.y), b.lower_z = rounded_down(low.z);
  b.upper_x = rounded_up(high.x), b.upper_y = rounded_up(high.y), b.upper_z = rounded_up(high.z);
}

template <class Arguments>
void MeshScene::State::meet(const Arguments* arguments, RTCRay& ray, Query& query) {
  if (!arguments->valid[0]) return;
  const State& state = *static_cast<const State*>(arguments->geometryUserPtr);
  const Triangle& t = state.triangles[arguments->primID];
  if (query.any && !state.instances[t.instance].opaque) return;
  if (t.index == query.from.triangle && t.instance == query.from.instance) return;
  const Vec3d* corner[3];
  state.corners_of(t, corner);
  const auto hit = world::intersect_triangle(query.origin, query.direction, *corner[0], *corner[1], *corner[2],
                                             query.hit ? query.at.t : query.t_max);
  if (!hit) return;
  // On an edge that two share, the first in the world's order, so that the tree's order does not matter.
  if (query.hit && hit->t == query.at.t && arguments->primID > query.triangle) return;
  query.hit = true;
  query.triangle = arguments->primID;
  query.at = *hit;
  ray.tfar = query.any ? -kFloatInfinity
                       : std::min(ray.tfar, rounded_up(hit->t * query.metres - query.start + state.widening));
}

world::Status MeshScene::State::commit() {
  const KeepFloatingPointMode keep;
  // No configuration file of the user's may change what is traced.
  device = rtcNewDevice("ignore_config_files=1");
  if (!device)
    return world::Error{world::ErrorKind::no_device,
                        fmt::format("Embree cannot start (error {})", static_cast<int>(rtcGetDeviceError(nullptr)))};
  rtcSetDeviceMemoryMonitorFunction(
      device,
      [](void* state, ssize_t bytes, bool) {
        static_cast<State*>(state)->embree_bytes += bytes;
        return true;
      },
      this);
  double largest = 0;
  for (int a = 0; a < 3; ++a) largest = std::max({largest, std::abs(box.low[a]), std::abs(box.high[a])});
  widening = largest * 0x1p-21 + 0x1p-18;
  scene = rtcNewScene(device);
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(triangles.size()));
  rtcSetGeometryUserData(geometry, this);
  rtcSetGeometryBoundsFunction(geometry, &State::bounds, nullptr);
  rtcSetGeometryIntersectFunction(geometry, [](const RTCIntersectFunctionNArguments* a) {
    meet(a, reinterpret_cast<RTCRayHit*>(a->rayhit)->ray, *reinterpret_cast<Query*>(a->context));
  });
  rtcSetGeometryOccludedFunction(geometry, [](const RTCOccludedFunctionNArguments* a) {
    meet(a, *reinterpret_cast<RTCRay*>(a->ray), *reinterpret_cast<Query*>(a->context));
  });
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene);
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_OUT_OF_MEMORY)
    return world::input_error(fmt::format("there is no memory for a tree over {} triangles", triangles.size()));
  if (error != RTC_ERROR_NONE)
    return world::Error{world::ErrorKind::no_device,
                        fmt::format("Embree cannot build a tree over {} triangles (error {})", triangles.size(),
                                    static_cast<int>(error))};
  return {};
}

/// False where the ray misses the box of all meshes, or is no ray.
bool MeshScene::State::start(Query& query, const GridRay& ray, RTCRay& out) const {
  if (!ray.valid() || ray.degenerate()) return false;
  const Vec3d voxel(double(ray.voxel.x) - base.x, double(ray.voxel.y) - base.y, double(ray.voxel.z) - base.z);
  query.origin = voxel + ray.fraction;
  query.direction = ray.direction;
  query.t_max = ray.t_max;
  const Vec3d size = abs(ray.direction);
  const double largest = std::max({size.x, size.y, size.z});
  const Vec3d scaled = ray.direction / largest, unit = scaled / length(scaled);
  query.metres = largest * length(scaled);
  // Where it is in the box: 4 widenings outside, so that rounding here can't matter.
  double t0 = 0, t1 = world::kInfinity;
  const double slack =
      4 * widening + 0x1p-50 * std::max({std::abs(query.origin.x), std::abs(query.origin.y), std::abs(query.origin.z)});
  for (int a = 0; a < 3; ++a) {
    const double low = box.low[a] - slack - query.origin[a], high = box.high[a] + slack - query.origin[a];
    if (std::abs(unit[a]) < 0x1p-500) {
      if (low > 0 || high < 0) return false;
      continue;
    }
    const double ta = low / unit[a], tb = high / unit[a];
    t0 = std::max(t0, std::min(ta, tb)), t1 = std::min(t1, std::max(ta, tb));
  }
  if (!(t0 <= t1)) return false;
  query.start = t0;
  const double limit = ray.t_max * query.metres;
  if (limit < t0) return false;
  const Vec3d moved = query.origin + t0 * unit;
  out.org_x = static_cast<float>(moved.x), out.org_y = static_cast<float>(moved.y),
  out.org_z = static_cast<float>(moved.z);
  out.dir_x = static_cast<float>(unit.x), out.dir_y = static_cast<float>(unit.y),
  out.dir_z = static_cast<float>(unit.z);
  out.tnear = 0;
  out.tfar = rounded_up(std::min(limit, t1) - t0 + slack);
  out.time = 0, out.mask = 0xffffffffu, out.id = 0, out.flags = 0;
  return true;
}

MeshScene::MeshScene() = default;
MeshScene::MeshScene(MeshScene&&) noexcept = default;
MeshScene& MeshScene::operator=(MeshScene&&) noexcept = default;
MeshScene::~MeshScene() = default;

world::Result<MeshScene> MeshScene::build(const world::World& world) {
  MeshScene made;
  // Middle of the meshes, each as its position and eight corners of its own box.
  Box around;
  VoxelPos first;
  bool any = false;
  for (const MeshInstance& instance : world.meshes) {
    if (!instance.mesh || instance.mesh->triangles.empty()) continue;
    if (!any) first = instance.position.voxel, any = true;
    const Vec3d moved = instance.position - world::WorldPoint{first, Vec3d(0.0)};
    for (const Vec3f& p : instance.mesh->positions) around.include(moved + instance.transform * Vec3d(p));
  }
  if (!any) return made;
  const Vec3d middle = 0.5 * (around.low + around.high);
  auto state = std::make_unique<State>();
  for (int a = 0; a < 3; ++a)
    state->base[a] = static_cast<int32_t>(std::floor(
        world::clamp_number(middle[a] + first[a], -double{world::kWorldBorder}, double{world::kWorldBorder} - 1)));
  for (uint32_t i = 0; i < world.meshes.size(); ++i) {
    const MeshInstance& m = world.meshes[i];
    TRY_STATUS(state->add(m, i, !m.null_surface && (m.block.empty() || (*world.palette)[m.block_id].opaque)));
  }
  if (state->triangles.size() > 0xffffffffu)
    return world::input_error("all meshes together have more than 2^32 triangles");
  if (state->triangles.empty()) return made;
  TRY_STATUS(state->commit());
  made.state_ = std::move(state);
  return made;
}

bool MeshScene::empty() const { return !state_; }

size_t MeshScene::bytes() const {
  if (!state_) return 0;
  return sizeof(State) + state_->corners.capacity() * sizeof(Vec3d) + state_->triangles.capacity() * sizeof(Triangle) +
         state_->instances.capacity() * sizeof(State::Instance) + static_cast<size_t>(state_->embree_bytes.load());
}

MeshHit MeshScene::intersect(const GridRay& ray, MeshOrigin from) const {
  MeshHit found;
  if (!state_) return found;
  Query query;
  RTCRayHit at;
  query.from = from;
  if (!state_->start(query, ray, at.ray)) return found;
  rtcInitIntersectContext(&query.context);
  at.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(state_->scene, &query.context, &at);
  if (!query.hit) return found;

  const Triangle& t = state_->triangles[query.triangle];
  const State::Instance& instance = state_->instances[t.instance];
  const TriangleMesh& mesh = *instance.mesh;
  const glm::uvec3& v = mesh.triangles[t.index];
  const Vec3d* corner[3];
  state_->corners_of(t, corner);
  found.hit = true;
  found.t = query.at.t;
  found.instance = t.instance;
  found.triangle = t.index;
  const Vec3d from_start(double(state_->base.x) - ray.voxel.x, double(state_->base.y) - ray.voxel.y,
                         double(state_->base.z) - ray.voxel.z);
  found.point = query.at.on_surface.point + from_start;
  found.error = query.at.on_surface.error + 0x1p-53 * abs(found.point);
  // Built from triangles that have a normal only.
  const Vec3d normal = (instance.mirrored ? -1.0 : 1.0) * *world::triangle_normal(*corner[0], *corner[1], *corner[2]);
  found.normal = found.shading_normal = Vec3f(normal);
  const Vec3d& weight = query.at.barycentrics;
  if (instance.smooth && !mesh.normals.empty()) {
    Vec3d sum(0.0);
    for (int i = 0; i < 3; ++i) sum += weight[i] * Vec3d(mesh.normals[v[i]]);
    const Vec3d turned = instance.normal_transform * sum * (instance.mirrored ? -1.0 : 1.0);
    const double size = length(turned);
    if (size > 0 && std::isfinite(size)) found.shading_normal = Vec3f(turned / size);
  }
  found.u = static_cast<float>(weight.y), found.v = static_cast<float>(weight.z);
  if (!mesh.texture_coordinates.empty()) {
    glm::dvec2 uv(0.0);
    for (int i = 0; i < 3; ++i) uv += weight[i] * glm::dvec2(mesh.texture_coordinates[v[i]]);
    found.u = static_cast<float>(uv.x), found.v = static_cast<float>(uv.y);
  }
  return found;
}

bool MeshScene::occluded(const GridRay& ray, MeshOrigin from) const {
  if (!state_) return false;
  Query query;
  RTCRay at;
  query.from = from;
  query.any = true;
  if (!state_->start(query, ray, at)) return false;
  rtcInitIntersectContext(&query.context);
  rtcOccluded1(state_->scene, &query.context, &at);
  return query.hit;
}

}  // namespace render
