#include "render/trace/lights.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>

#include "render/shading.h"
#include "render/trace/volumes.h"

namespace render {

using world::BlockId;
using world::kAir;
using world::kInfinity;
using world::VoxelPos;
using world::WorldPoint;

namespace {

constexpr double kPi = 3.14159265358979323846;
/// Below it faces are sampled over their area: solid angles as differences of angles lose digits there, and area
/// sampling is as good. sr
constexpr double kSmallSolidAngle = 1e-3;

Vec3d vector_of(auto bands) { return {bands.r, bands.g, bands.b}; }
double mean_of(const Vec3d& v) { return (v.x + v.y + v.z) / 3; }
Vec3d difference(VoxelPos a, VoxelPos b) { return Vec3d(double(a.x) - b.x, double(a.y) - b.y, double(a.z) - b.z); }

/// A face of a voxel as a receiver sees it: `low` is its corner of least coordinates, seen from the receiver.
struct SeenFace {
  int face = 0, axis = 0, u_axis = 0, v_axis = 0;
  Vec3d low{0};
  double height = 0;  // of the receiver before its plane, > 0
  double solid_angle = 0;
};

/// Of the rectangle [u0, u1] x [v0, v1] at distance z > 0.
double rectangle_solid_angle(double u0, double u1, double v0, double v1, double z) {
  const auto corner = [z](double u, double v) { return std::atan2(u * v, z * std::sqrt(u * u + v * v + z * z)); };
  return corner(u1, v1) - corner(u0, v1) - corner(u1, v0) + corner(u0, v0);
}

/// A point of the unit square at (u0, v0) in the plane at distance z, uniform over its solid angle.
/// source  Urena, Fajardo, King. 2013
Vec2f square_point(double u0, double v0, double z, Vec2f random, double& u, double& v) {
  const double u1 = u0 + 1, v1 = v0 + 1, z0 = -z;
  const auto normalized = [](double a, double b) {
    const double l = std::sqrt(a * a + b * b);
    return std::pair(a / l, b / l);
  };
  // Normals of the planes through the receiver and the square's edges: two components of each; one is 0.
  const auto [n0y, n0z] = normalized(z0, -v0);
  const auto [n1x, n1z] = normalized(-z0, u1);
  const auto [n2y, n2z] = normalized(-z0, v1);
  const auto [n3x, n3z] = normalized(z0, -u0);
  (void)n0y, (void)n1x, (void)n2y, (void)n3x;
  const auto angle = [](double cosine) { return std::acos(std::clamp(-cosine, -1.0, 1.0)); };
  const double g0 = angle(n0z * n1z), g1 = angle(n1z * n2z), g2 = angle(n2z * n3z), g3 = angle(n3z * n0z);
  const double k = 2 * kPi - g2 - g3, solid_angle = g0 + g1 - k;
  const double au = double{random.x} * solid_angle + k;
  const double fu = (std::cos(au) * n0z - n2z) / std::sin(au);
  const double cu = std::clamp(std::copysign(1 / std::sqrt(fu * fu + n0z * n0z), fu), -1.0, 1.0);
  const double xu = std::clamp(-(cu * z0) / std::sqrt(std::max(1 - cu * cu, 1e-300)), u0, u1);
  const double d2 = xu * xu + z0 * z0;
  const double h0 = v0 / std::sqrt(d2 + v0 * v0), h1 = v1 / std::sqrt(d2 + v1 * v1);
  const double hv = h0 + double{random.y} * (h1 - h0), rest = 1 - hv * hv;
  u = xu;
  v = rest > 1e-12 ? std::clamp(hv * std::sqrt(d2 / rest), v0, v1) : v1;
  return random;
}

/// The exposed faces of a voxel that turn towards the receiver, and the sum of their solid angles.
struct SeenFaces {
  std::array<SeenFace, 3> face;
  int count = 0;
  double solid_angle = 0;
};
SeenFaces seen_faces(VoxelPos voxel, uint8_t faces, const WorldPoint& from) {
  SeenFaces seen;
  const Vec3d low = difference(voxel, from.voxel) - from.fraction;  // of the voxel, from the receiver
  for (int axis = 0; axis < 3; ++axis) {
    const bool above = low[axis] + 1 < 0;
    if (!above && !(low[axis] > 0)) continue;
    const int face = axis * 2 + (above ? 1 : 0);
    if (!(faces >> face & 1)) continue;
    SeenFace f{face, axis, (axis + 1) % 3, (axis + 2) % 3, low, above ? -(low[axis] + 1) : low[axis], 0};
    if (above) f.low[axis] += 1;
    const double u0 = low[f.u_axis], v0 = low[f.v_axis];
    f.solid_angle = rectangle_solid_angle(u0, u0 + 1, v0, v0 + 1, f.height);
    seen.solid_angle += f.solid_angle;
    seen.face[static_cast<size_t>(seen.count++)] = f;
  }
  if (seen.solid_angle >= kSmallSolidAngle) return seen;
  // Their shares by what the middle of each shows.
  seen.solid_angle = 0;
  for (int i = 0; i < seen.count; ++i) {
    SeenFace& f = seen.face[static_cast<size_t>(i)];
    Vec3d middle = f.low;
    middle[f.u_axis] += 0.5, middle[f.v_axis] += 0.5;
    const double d = glm::length(middle);
    f.solid_angle = f.height / (d * d * d);
    seen.solid_angle += f.solid_angle;
  }
  return seen;
}
bool by_solid_angle(const SeenFaces& seen) { return seen.solid_angle >= kSmallSolidAngle; }

/// An angle in [0, pi] by its sine and cosine.
struct Angle {
  float sine, cosine;
  static Angle of_cosine(float c) { return {std::sqrt(std::max(0.0f, 1 - c * c)), c}; }
  static Angle of_sine(float s) { return {s, std::sqrt(std::max(0.0f, 1 - s * s))}; }
  /// The difference, or 0 where it is negative.
  Angle less(Angle o) const {
    if (cosine > o.cosine) return {0, 1};
    return {std::max(0.0f, sine * o.cosine - cosine * o.sine), cosine * o.cosine + sine * o.sine};
  }
};

float angle_between(const Vec3f& a, const Vec3f& b) { return std::acos(std::clamp(dot(a, b), -1.0f, 1.0f)); }

/// Sky of the environment as a density over directions: by the mean of bands, linear in the height above the horizon;
/// of the haze below it, half way between horizon and ground, which is its mean.
struct SkyShape {
  double zenith, horizon, ground;
  explicit SkyShape(const world::Environment& e)
      : zenith(mean_of(vector_of(e.sky_zenith))),
        horizon(mean_of(vector_of(e.sky_horizon))),
        ground(mean_of(vector_of(e.sky_ground))) {}
  double above() const { return kPi * (horizon + zenith); }  // integral over the upper hemisphere
  double haze() const { return kPi * (horizon + ground) * kHaze; }
  double below() const { return haze() + 2 * kPi * ground * (1 - kHaze); }
  double total() const { return above() + below(); }
  double density(double y) const {
    return (y >= 0 ? horizon + (zenith - horizon) * y : y > -kHaze ? (horizon + ground) / 2 : ground) / total();
  }
  static constexpr double kHaze = world::shared::kHazeDepth;
};

}  // namespace

LightSet LightSet::build(const TraceScene& scene, bool photons) {
  LightSet set;
  set.scene_ = &scene;
  set.anchor_.voxel = {};
  set.add_voxels(scene);
  set.add_triangles(scene);
  set.add_luminaires(scene);
  set.add_far(scene);
  if (photons) set.find_sphere(scene);
  if (!set.emitters_.empty()) {
    std::vector<uint32_t> order(set.emitters_.size());
    std::iota(order.begin(), order.end(), 0u);
    set.nodes_.reserve(2 * order.size());
    set.leaf_of_.resize(order.size());
    set.build_node(order, 0, order.size(), 0);
  }
  if (photons) {
    double sum = 0;
    for (const FarLight& far : set.far_) set.power_sums_.push_back(sum += far.power);
    for (const Emitter& e : set.emitters_) set.power_sums_.push_back(sum += e.power);
  }
  return set;
}

// --- what shines --------------------------------------------------------------------------------------------------

void LightSet::add_voxels(const TraceScene& scene) {
  const world::MaskVolume& emitting = scene.view().masks(world::MaskKind::emitting);
  Tracer blocks(scene);
  std::map<uint32_t, uint32_t> known_shapes;
  bool first = true;
  for (const world::MaskRegion* region : emitting.regions())
    for (int i = 0; i < world::kLeavesPerRegion; ++i) {
      const world::LeafPos leaf = leaf_from_region(region->pos) + world::leaf_offset_in_region(i);
      if (!region->leaf_any(leaf)) continue;
      const world::LeafMask& mask = region->leaf(leaf);
      for (int index = 0; index < world::kLeafVoxels; ++index) {
        const VoxelPos voxel = voxel_from_leaf(leaf) + world::offset_in_leaf(index);
        if (!mask.test(voxel)) continue;
        VoxelEmitter v{voxel, 0, blocks.block(voxel)};
        if (const world::Proxy* shape = scene.shape(v.block)) {
          const auto block_at = [&](VoxelPos p) { return blocks.block(p); };
          v.shape = shape_of(v.block, scene.shapes().joins_at(*shape, voxel, block_at), known_shapes);
          if (shapes_[v.shape].areas.empty()) continue;
        } else {
          for (int face = 0; face < world::kFaces; ++face) {
            const BlockId beside = blocks.block(voxel + world::face_step(face));
            if (beside != v.block && scene.face_between(beside, v.block) == TraceScene::FaceOf::second)
              v.faces = static_cast<uint8_t>(v.faces | 1u << face);
          }
          if (v.faces == 0) continue;
        }
        if (first) anchor_.voxel = voxel, first = false;
        Emitter e;
        e.kind = LightKind::voxel;
        e.index = static_cast<uint32_t>(voxels_.size());
        e.centre = Vec3f(difference(voxel, anchor_.voxel) + 0.5);
        e.radius = 0.8660254f;
        const float radiance = static_cast<float>(mean_of(Vec3d(scene.materials()[v.block].emission)));
        const float area = v.shape == UINT32_MAX ? static_cast<float>(std::popcount(v.faces))
                                                 : static_cast<float>(shapes_[v.shape].areas.back());
        e.power = static_cast<float>(kPi) * radiance * area;
        // Of a cube along a diagonal, three faces show 1 / sqrt(3) each.
        e.intensity = radiance * (v.shape == UINT32_MAX ? 1.7320508f : area);
        emitter_of_voxel_[voxel] = static_cast<uint32_t>(emitters_.size());
        emitters_.push_back(e);
        voxels_.push_back(v);
      }
    }
}

uint32_t LightSet::shape_of(BlockId block, uint8_t joins, std::map<uint32_t, uint32_t>& known) {
  const auto [found, fresh] = known.try_emplace(uint32_t{block} << 8 | joins, static_cast<uint32_t>(shapes_.size()));
  if (!fresh) return found->second;
  Shape shape;
  shape.faces = world::proxy_faces(*scene_->shape(block), joins);
  double area = 0;
  for (const world::ProxyFace& f : shape.faces)
    shape.areas.push_back(area +=
                          glm::length(cross(Vec3d(f.corner[1] - f.corner[0]), Vec3d(f.corner[3] - f.corner[0]))));
  shapes_.push_back(std::move(shape));
  return found->second;
}

void LightSet::corners(uint32_t instance, uint32_t triangle, const WorldPoint& from, Vec3d (&out)[3]) const {
  const world::MeshInstance& mesh = scene_->world().meshes[instance];
  const Vec3d offset = mesh.position - from;
  const glm::uvec3 t = mesh.mesh->triangles[triangle];
  for (int i = 0; i < 3; ++i) out[i] = offset + mesh.transform * Vec3d(mesh.mesh->positions[t[i]]);
}

void LightSet::add_triangles(const TraceScene& scene) {
  for (size_t i = 0; i < scene.instances().size(); ++i) {
    const double radiance = mean_of(Vec3d(scene.instances()[i].emission));
    if (!(radiance > 0)) continue;
    const world::MeshInstance& mesh = scene.world().meshes[i];
    if (emitters_.empty()) anchor_.voxel = mesh.position.voxel;
    const double side = determinant(mesh.transform) < 0 ? -1 : 1;  // a mirrored mesh keeps its outside
    for (uint32_t k = 0; k < mesh.mesh->triangles.size(); ++k) {
      Vec3d c[3];
      corners(static_cast<uint32_t>(i), k, anchor_, c);
      const Vec3d normal = cross(c[1] - c[0], c[2] - c[0]) * side;
      const double area = glm::length(normal) / 2;
      if (!(area > 0)) continue;
      Emitter e;
      e.kind = LightKind::triangle;
      e.index = static_cast<uint32_t>(i);
      e.triangle = k;
      const Vec3d centre = (c[0] + c[1] + c[2]) / 3.0;
      e.centre = Vec3f(centre);
      e.radius = static_cast<float>(
          std::max({glm::length(c[0] - centre), glm::length(c[1] - centre), glm::length(c[2] - centre)}));
      e.axis = Vec3f(normal / (2 * area));
      e.spread = 0;
      e.intensity = static_cast<float>(radiance * area);
      e.power = static_cast<float>(kPi * radiance * area);
      emitter_of_triangle_[uint64_t{e.index} << 32 | k] = static_cast<uint32_t>(emitters_.size());
      emitters_.push_back(e);
    }
  }
}

void LightSet::add_luminaires(const TraceScene& scene) {
  emitter_of_luminaire_.assign(scene.luminaires().size(), UINT32_MAX);
  for (size_t i = 0; i < scene.luminaires().size(); ++i) {
    const SceneLuminaire& s = scene.luminaires()[i];
    if (!s.finite) continue;
    if (emitters_.empty()) anchor_.voxel = s.luminaire->position.voxel;
    const world::Luminaire& l = *s.luminaire;
    Emitter e;
    e.kind = LightKind::luminaire;
    e.index = static_cast<uint32_t>(i);
    e.centre = from_anchor(l.position);
    e.radius = s.area ? std::max(l.radius, glm::length(l.extent) / 2) : 0;
    for (const Vec3f& corner : l.triangles) e.radius = std::max(e.radius, glm::length(corner));
    e.power = static_cast<float>(mean_of(vector_of(s.sampler.total_power())));
    // At most what a one-sided Lambertian emitter sends along its axis; of a narrow spot or gobo the cone's share.
    const double cone = std::max(2 * kPi * (1 - std::cos(std::min(l.half_angle, 3.1415926f))), 1e-6);
    e.intensity = static_cast<float>(e.power / (s.area ? kPi : std::min(cone, 4 * kPi)));
    emitter_of_luminaire_[i] = static_cast<uint32_t>(emitters_.size());
    emitters_.push_back(e);
  }
}

void LightSet::add_far(const TraceScene& scene) {
  const world::Environment& e = scene.environment();
  if (e.sun_irradiance.max() > 0)
    far_.push_back({LightKind::sun, 0, mean_of(vector_of(e.sun_irradiance)), Vec3f(e.sun_direction), 0});
  if (const SkyShape sky(e); sky.total() > 0) far_.push_back({LightKind::sky, 0, sky.total() / 2, Vec3f(0), 0});
  for (size_t i = 0; i < scene.luminaires().size(); ++i) {
    const SceneLuminaire& s = scene.luminaires()[i];
    if (s.finite) continue;
    FarLight far{LightKind::luminaire, static_cast<uint32_t>(i), 0, Vec3f(0), 0};
    constexpr int kSide = 16;  // samples to estimate its strength by
    double sum = 0;
    for (int k = 0; k < kSide * kSide; ++k) {
      const Vec2f u((static_cast<float>(k % kSide) + 0.5f) / kSide, (static_cast<float>(k / kSide) + 0.5f) / kSide);
      const world::LuminaireSample sample = s.sampler.sample(Vec3d(0), u);
      sum += mean_of(vector_of(sample.biradiance));
      if (s.impulse) far.direction = sample.direction;
    }
    far.irradiance = sum / (kSide * kSide);
    far_.push_back(far);
  }
}

void LightSet::find_sphere(const TraceScene& scene) {
  const world::VoxelBox box = scene.view().store().bounds();
  Vec3d low(kInfinity), high(-kInfinity);
  const auto include = [&](const Vec3d& p) { low = min(low, p), high = max(high, p); };
  if (!box.empty()) {
    include(difference(box.min, anchor_.voxel));
    include(difference(box.max, anchor_.voxel) + 1.0);
  }
  for (const world::MeshInstance& mesh : scene.world().meshes)
    for (const Vec3f& p : mesh.mesh->positions) include((mesh.position - anchor_) + mesh.transform * Vec3d(p));
  for (const Emitter& e : emitters_) include(Vec3d(e.centre - e.radius)), include(Vec3d(e.centre + e.radius));
  if (!(low.x <= high.x)) low = high = Vec3d(0);
  sphere_ = {(low + high) / 2.0, std::max(glm::length(high - low) / 2, 1e-3)};
  for (FarLight& far : far_)
    far.power = far.irradiance * (far.direction == Vec3f(0) ? 2 : 1) * kPi * sphere_.radius * sphere_.radius;
}

// --- the tree -----------------------------------------------------------------------------------------------------

uint32_t LightSet::build_node(std::vector<uint32_t>& order, size_t begin, size_t end, uint32_t parent) {
  const uint32_t self = static_cast<uint32_t>(nodes_.size());
  nodes_.emplace_back();
  Node node;
  node.parent = parent;
  if (end - begin == 1) {
    const Emitter& e = emitters_[order[begin]];
    node.low = e.centre - e.radius, node.high = e.centre + e.radius;
    node.axis = e.axis, node.spread = e.spread, node.intensity = e.intensity;
    node.cos_spread = std::cos(node.spread), node.sin_spread = std::sin(node.spread);
    node.emitter = order[begin];
    leaf_of_[order[begin]] = self;
    nodes_[self] = node;
    return self;
  }
  Vec3f low(std::numeric_limits<float>::max()), high(-low);
  for (size_t i = begin; i < end; ++i) {
    low = min(low, emitters_[order[i]].centre);
    high = max(high, emitters_[order[i]].centre);
  }
  const Vec3f size = high - low;
  const int axis = size.x >= size.y ? (size.x >= size.z ? 0 : 2) : (size.y >= size.z ? 1 : 2);
  const size_t middle = begin + (end - begin) / 2;
  const auto at = [&](size_t i) { return order.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(begin), at(middle), at(end), [&](uint32_t a, uint32_t b) {
    const float x = emitters_[a].centre[axis], y = emitters_[b].centre[axis];
    return x != y ? x < y : a < b;
  });
  build_node(order, begin, middle, self);
  node.child = build_node(order, middle, end, self);
  const Node &a = nodes_[self + 1], &b = nodes_[node.child];
  node.low = min(a.low, b.low), node.high = max(a.high, b.high);
  node.intensity = a.intensity + b.intensity;
  // A cone that holds both cones.
  if (a.spread > 3.2f || b.spread > 3.2f) {
    node.spread = kAllAround;
  } else {
    const Vec3f sum = a.axis + b.axis;
    node.axis = glm::length(sum) > 1e-3f ? glm::normalize(sum) : a.axis;
    node.spread =
        std::max(angle_between(node.axis, a.axis) + a.spread, angle_between(node.axis, b.axis) + b.spread) + 1e-3f;
    node.cos_spread = std::cos(node.spread), node.sin_spread = std::sin(node.spread);
  }
  nodes_[self] = node;
  return self;
}

double LightSet::importance(const Node& node, const Vec3f& from_anchor, const Receiver& receiver) const {
  const Vec3f to_centre = (node.low + node.high) * 0.5f - from_anchor;
  const float radius = glm::length(node.high - node.low) * 0.5f, distance = glm::length(to_centre);
  const double squared = std::max(distance * distance, radius * radius) + 1e-12f;
  double value = node.intensity / squared;
  if (distance <= radius * 1.0001f + 1e-6f) return value;
  const Vec3f direction = to_centre / distance;
  const Angle half_width = Angle::of_sine(std::min(radius / distance, 1.0f));
  constexpr float kBelow = -2e-3f;  // rounding of the angles' cosines leaves none that matters below it
  if (receiver.one_sided) {
    const float cosine = Angle::of_cosine(dot(receiver.normal, direction)).less(half_width).cosine;
    if (cosine < kBelow) return 0;
    value *= std::max(cosine, 1e-3f);
  }
  if (node.spread < 3.2f) {
    const Angle spread{std::max(node.sin_spread, 0.0f), node.spread < 3.14159f ? node.cos_spread : -1.0f};
    const float cosine = Angle::of_cosine(-dot(node.axis, direction)).less(spread).less(half_width).cosine;
    if (cosine < kBelow) return 0;
    value *= std::max(cosine, 1e-3f);
  }
  return value;
}

double LightSet::far_importance(const FarLight& far, const Receiver& receiver) const {
  if (far.direction == Vec3f(0) || !receiver.one_sided) return far.irradiance;
  return far.irradiance * std::max(dot(far.direction, receiver.normal), 0.0f);
}

LightSet::Shares LightSet::shares(const Receiver& receiver, const Vec3f& from) const {
  Shares s;
  for (const FarLight& far : far_) {
    const double i = far_importance(far, receiver);
    if (i > 0) s.sum += i, ++s.count;
  }
  if (!nodes_.empty()) s.local = importance(nodes_[0], from, receiver);
  if (s.local > 0) s.sum += s.local, ++s.count;
  return s;
}

double LightSet::far_share(const Receiver& receiver, LightKind kind, uint32_t luminaire) const {
  for (const FarLight& far : far_)
    if (far.kind == kind && far.luminaire == luminaire)
      return shares(receiver, from_anchor(receiver.position)).of(far_importance(far, receiver));
  return 0;
}

double LightSet::local_share(const Receiver& receiver, uint32_t emitter) const {
  const Vec3f from = from_anchor(receiver.position);
  const Shares s = shares(receiver, from);
  double share = s.of(s.local);
  for (uint32_t i = leaf_of_[emitter]; i != 0 && share > 0; i = nodes_[i].parent) {
    const Node& parent = nodes_[nodes_[i].parent];
    const double a = importance(nodes_[nodes_[i].parent + 1], from, receiver),
                 b = importance(nodes_[parent.child], from, receiver);
    const double mine = i == parent.child ? b : a;
    share *= mine > 0 ? mine / (a + b) : 0;
  }
  return share;
}

bool LightSet::sample(const Receiver& receiver, float pick, Vec2f u, LightSample& sample) const {
  const Vec3f from = from_anchor(receiver.position);
  const Shares s = shares(receiver, from);
  if (s.count == 0) return false;
  double at = pick;
  const auto finish = [&](bool found, double share) {
    if (!found || !(share > 0)) return false;
    if (sample.pdf > 0)
      sample.pdf *= share;
    else
      sample.radiance /= share;
    return true;
  };
  for (const FarLight& far : far_) {
    const double share = s.of(far_importance(far, receiver));
    if (at >= share) {
      at -= share;
      continue;
    }
    return finish(sample_one({far.kind, far.luminaire, 0, {}, world::kNoFace}, receiver, u, sample), share);
  }
  if (!(s.local > 0)) return false;  // only by rounding
  double share = s.of(s.local);
  at = std::min(at / share, 1 - 0x1p-53);
  uint32_t i = 0;
  while (nodes_[i].child != 0) {
    const double a = importance(nodes_[i + 1], from, receiver), b = importance(nodes_[nodes_[i].child], from, receiver);
    if (!(a + b > 0)) return false;
    const double first = a / (a + b);
    if (at < first || !(b > 0)) {
      at = std::min(at / first, 1 - 0x1p-53);
      share *= first;
      i = i + 1;
    } else {
      at = std::clamp((at - first) / (1 - first), 0.0, 1 - 0x1p-53);
      share *= b / (a + b);
      i = nodes_[i].child;
    }
  }
  const Emitter& e = emitters_[nodes_[i].emitter];
  switch (e.kind) {
    case LightKind::voxel:
      return finish(sample_voxel(voxels_[e.index], receiver, u, sample), share);
    case LightKind::triangle:
      return finish(sample_triangle(e, receiver, u, sample), share);
    default:
      return finish(sample_luminaire(e.index, receiver, u, sample), share);
  }
}

// --- one source ---------------------------------------------------------------------------------------------------

bool LightSet::sample_one(LightTarget source, const Receiver& receiver, Vec2f u, LightSample& sample) const {
  switch (source.kind) {
    case LightKind::sun:
      return sample_sun(receiver, sample);
    case LightKind::sky:
      return sample_sky(receiver, u, sample);
    default:
      return sample_luminaire(source.index, receiver, u, sample);
  }
}

bool LightSet::sample_sun(const Receiver&, LightSample& sample) const {
  const world::Environment& e = scene_->environment();
  sample = {};
  sample.direction = Vec3f(e.sun_direction);
  sample.distance = kInfinity;
  sample.radiance = vector_of(e.sun_irradiance);
  sample.target.kind = LightKind::sun;
  return true;
}

bool LightSet::sample_sky(const Receiver&, Vec2f u, LightSample& sample) const {
  const world::Environment& e = scene_->environment();
  const SkyShape sky(e);
  const double haze = sky.haze() / sky.total(), below = sky.below() / sky.total();
  double y, at = u.x;
  if (at < haze) {
    y = -at / haze * SkyShape::kHaze;
  } else if (at < below) {
    y = -SkyShape::kHaze - (at - haze) / (below - haze) * (1 - SkyShape::kHaze);
  } else {
    // The density of y in [0, 1] goes linearly from the horizon's to the zenith's.
    at = std::min((at - below) / (1 - below), 1.0);
    const double slope = sky.zenith - sky.horizon, c = at * (sky.horizon + sky.zenith);
    y = std::clamp(c / (sky.horizon + std::sqrt(std::max(sky.horizon * sky.horizon + slope * c, 0.0))), 0.0, 1.0);
  }
  const double r = std::sqrt(std::max(0.0, 1 - y * y)), angle = 2 * kPi * double{u.y};
  sample = {};
  sample.direction = Vec3f(r * std::cos(angle), y, r * std::sin(angle));
  sample.distance = kInfinity;
  sample.radiance = vector_of(scene_->sky().radiance(Vec3d(sample.direction)));
  sample.pdf = sky_density(sample.direction);
  sample.target.kind = LightKind::sky;
  return sample.pdf > 0;
}

double LightSet::sky_density(const Vec3f& direction) const {
  return SkyShape(scene_->environment()).density(direction.y);
}

bool LightSet::sample_luminaire(uint32_t index, const Receiver& receiver, Vec2f u, LightSample& sample) const {
  const SceneLuminaire& s = scene_->luminaires()[index];
  const world::LuminaireSample drawn = s.sampler.sample(receiver.position - s.luminaire->position, u);
  if (!(drawn.biradiance.max() > 0)) return false;
  sample = {};
  sample.direction = drawn.direction;
  sample.distance = drawn.distance;
  sample.radiance = vector_of(drawn.biradiance);
  if (!s.impulse && drawn.pdf > 0) {
    sample.pdf = drawn.pdf;
    sample.radiance *= double{drawn.pdf};
  }
  sample.target.kind = LightKind::luminaire;
  sample.target.index = index;
  sample.luminaire = s.physical ? nullptr : s.luminaire;
  return true;
}

bool LightSet::sample_shape(const VoxelEmitter& v, const Receiver& receiver, Vec2f u, LightSample& sample) const {
  const Shape& shape = shapes_[v.shape];
  double at = double{u.x} * shape.areas.back();
  const size_t i =
      std::min(static_cast<size_t>(std::upper_bound(shape.areas.begin(), shape.areas.end(), at) - shape.areas.begin()),
               shape.areas.size() - 1);
  const double before = i > 0 ? shape.areas[i - 1] : 0, area = shape.areas[i] - before;
  if (!(area > 0)) return false;
  at = std::clamp((at - before) / area, 0.0, 1.0);
  const world::ProxyFace& f = shape.faces[i];
  const Vec3d corner(f.corner[0]), a = Vec3d(f.corner[1]) - corner, b = Vec3d(f.corner[3]) - corner;
  const Vec3d to =
      difference(v.voxel, receiver.position.voxel) - receiver.position.fraction + corner + at * a + double{u.y} * b;
  const double distance = glm::length(to), cosine = std::abs(dot(cross(a, b), to)) / (area * distance);
  if (!(distance > 0) || !(cosine > 0)) return false;
  sample = {};
  sample.distance = distance;
  sample.direction = Vec3f(to / distance);
  sample.radiance = Vec3d(scene_->materials()[v.block].emission);
  sample.pdf = distance * distance / (cosine * shape.areas.back());
  sample.target = {LightKind::voxel, 0, 0, v.voxel, world::kNoFace};
  return true;
}

bool LightSet::sample_voxel(const VoxelEmitter& v, const Receiver& receiver, Vec2f u, LightSample& sample) const {
  if (v.shape != UINT32_MAX) return sample_shape(v, receiver, u, sample);
  const SeenFaces seen = seen_faces(v.voxel, v.faces, receiver.position);
  if (!(seen.solid_angle > 0)) return false;
  // One number picks the face and, what is left of it, the place.
  double at = double{u.x} * seen.solid_angle;
  int i = 0;
  while (i + 1 < seen.count && at >= seen.face[static_cast<size_t>(i)].solid_angle)
    at -= seen.face[static_cast<size_t>(i++)].solid_angle;
  const SeenFace& f = seen.face[static_cast<size_t>(i)];
  u.x = static_cast<float>(std::min(at / f.solid_angle, 1 - 0x1p-24));
  const double u0 = f.low[f.u_axis], v0 = f.low[f.v_axis];
  double pu = u0 + double{u.x}, pv = v0 + double{u.y};
  if (by_solid_angle(seen)) square_point(u0, v0, f.height, u, pu, pv);
  Vec3d to = f.low;
  to[f.u_axis] = pu, to[f.v_axis] = pv;
  sample = {};
  sample.distance = glm::length(to);
  sample.direction = Vec3f(to / sample.distance);
  sample.radiance = Vec3d(scene_->materials()[v.block].emission);
  sample.pdf = by_solid_angle(seen)
                   ? 1 / seen.solid_angle
                   : f.solid_angle / seen.solid_angle * sample.distance * sample.distance * sample.distance / f.height;
  sample.target = {LightKind::voxel, 0, 0, v.voxel, f.face};
  return true;
}

bool LightSet::sample_triangle(const Emitter& e, const Receiver& receiver, Vec2f u, LightSample& sample) const {
  Vec3d c[3];
  corners(e.index, e.triangle, receiver.position, c);
  const double root = std::sqrt(double{u.x});
  const Vec3d to = c[0] * (1 - root) + c[1] * (root * (1 - double{u.y})) + c[2] * (root * double{u.y});
  const Vec3d normal = cross(c[1] - c[0], c[2] - c[0]);
  const double twice_area = glm::length(normal), distance = glm::length(to);
  const double cosine = -dot(Vec3d(e.axis), to) / distance;
  if (!(cosine > 0) || !(distance > 0)) return false;
  sample = {};
  sample.distance = distance;
  sample.direction = Vec3f(to / distance);
  sample.radiance = Vec3d(scene_->instances()[e.index].emission);
  sample.pdf = 2 * distance * distance / (cosine * twice_area);
  sample.target = {LightKind::triangle, e.index, e.triangle, {}, world::kNoFace};
  return true;
}

// --- densities of what was met ------------------------------------------------------------------------------------

double LightSet::pdf_sky(const Receiver& receiver, const Vec3f& direction) const {
  return far_share(receiver, LightKind::sky, 0) * sky_density(direction);
}

double LightSet::pdf_luminaire(const Receiver& receiver, uint32_t luminaire, double direction_pdf) const {
  const uint32_t emitter = emitter_of_luminaire_[luminaire];
  return direction_pdf * (emitter == UINT32_MAX ? far_share(receiver, LightKind::luminaire, luminaire)
                                                : local_share(receiver, emitter));
}

double LightSet::pdf_voxel(const Receiver& receiver, const Surface& s, const Vec3f& direction, double distance) const {
  const auto found = emitter_of_voxel_.find(s.behind);
  if (found == emitter_of_voxel_.end()) return 0;
  const VoxelEmitter& v = voxels_[emitters_[found->second].index];
  if (v.shape != UINT32_MAX) {
    const double cosine = std::abs(double{dot(s.normal, direction)});
    return cosine > 0
               ? distance * distance / (cosine * shapes_[v.shape].areas.back()) * local_share(receiver, found->second)
               : 0;
  }
  const SeenFaces seen = seen_faces(s.behind, v.faces, receiver.position);
  for (int i = 0; i < seen.count; ++i) {
    const SeenFace& f = seen.face[static_cast<size_t>(i)];
    if (f.face != s.face) continue;
    const double pdf = by_solid_angle(seen)
                           ? 1 / seen.solid_angle
                           : f.solid_angle / seen.solid_angle * distance * distance * distance / f.height;
    return pdf * local_share(receiver, found->second);
  }
  return 0;
}

double LightSet::pdf_triangle(const Receiver& receiver, uint32_t instance, uint32_t triangle, const Vec3f& direction,
                              double distance) const {
  const auto found = emitter_of_triangle_.find(uint64_t{instance} << 32 | triangle);
  if (found == emitter_of_triangle_.end()) return 0;
  Vec3d c[3];
  corners(instance, triangle, receiver.position, c);
  const Vec3d normal = cross(c[1] - c[0], c[2] - c[0]);
  const double twice_area = glm::length(normal), cosine = std::abs(dot(normal, Vec3d(direction))) / twice_area;
  if (!(cosine > 0)) return 0;
  return 2 * distance * distance / (cosine * twice_area) * local_share(receiver, found->second);
}

// --- photons ------------------------------------------------------------------------------------------------------

bool LightSet::emit(const float (&u)[5], LightPhoton& photon) const {
  if (power_sums_.empty() || !(power_sums_.back() > 0)) return false;
  const double at = double{u[0]} * power_sums_.back();
  const size_t i =
      std::min(static_cast<size_t>(std::upper_bound(power_sums_.begin(), power_sums_.end(), at) - power_sums_.begin()),
               power_sums_.size() - 1);
  const double share = (power_sums_[i] - (i > 0 ? power_sums_[i - 1] : 0)) / power_sums_.back();
  if (!(share > 0)) return false;
  photon = {};
  const auto through_disk = [&](const Vec3f& towards_light, const Vec3d& irradiance) {
    Vec3d a, b;
    const Vec3d d = glm::normalize(Vec3d(towards_light));
    basis_around(d, a, b);
    const double r = sphere_.radius * std::sqrt(double{u[1]}), angle = 2 * kPi * double{u[2]};
    photon.origin = anchor_ + (sphere_.centre + r * std::cos(angle) * a + r * std::sin(angle) * b + sphere_.radius * d);
    photon.direction = Vec3f(-d);
    photon.power = irradiance * (kPi * sphere_.radius * sphere_.radius / share);
  };
  const auto from_luminaire = [&](uint32_t index) {
    const SceneLuminaire& s = scene_->luminaires()[index];
    const Vec3d centre = (anchor_ - s.luminaire->position) + sphere_.centre;
    const world::EmittedPhoton out = s.sampler.emit({u[1], u[2]}, {u[3], u[4]}, {centre, sphere_.radius});
    photon.origin = s.luminaire->position + out.origin;
    photon.direction = out.direction;
    photon.power = vector_of(out.power) / share;
    photon.source = {LightKind::luminaire, index, 0, {}, world::kNoFace};
  };
  const auto cosine_direction = [&](const Vec3d& n) {
    Vec3d a, b;
    basis_around(n, a, b);
    const double r = std::sqrt(double{u[3]}), angle = 2 * kPi * double{u[4]};
    return Vec3f(glm::normalize(r * std::cos(angle) * a + r * std::sin(angle) * b +
                                std::sqrt(std::max(0.0, 1 - double{u[3]})) * n));
  };
  if (i < far_.size()) {
    const FarLight& far = far_[i];
    LightSample sample;
    if (far.kind == LightKind::luminaire) {
      from_luminaire(far.luminaire);
    } else if (far.kind == LightKind::sun) {
      sample_sun({}, sample);
      through_disk(sample.direction, sample.radiance);
      // Where the light meets the scene, not where it starts, which may lie above the clouds.
      const Vec3d way = sphere_.radius * Vec3d(photon.direction);
      photon.power *= double{scene_->sky().sun_through(photon.origin + way)};
      photon.source.kind = LightKind::sun;
    } else {
      if (!sample_sky({}, {u[3], u[4]}, sample)) return false;
      through_disk(sample.direction, sample.radiance / sample.pdf);
      photon.source.kind = LightKind::sky;
    }
    return photon.power != Vec3d(0);
  }
  const Emitter& e = emitters_[i - far_.size()];
  if (e.kind == LightKind::luminaire) {
    from_luminaire(e.index);
  } else if (e.kind == LightKind::voxel) {
    const VoxelEmitter& v = voxels_[e.index];
    photon.source = {LightKind::voxel, 0, 0, v.voxel, world::kNoFace};
    if (v.shape != UINT32_MAX) {
      // From the fronts: what a sheet sends from its back is missing.
      const Shape& shape = shapes_[v.shape];
      double place = double{u[1]} * shape.areas.back();
      const size_t k = std::min(
          static_cast<size_t>(std::upper_bound(shape.areas.begin(), shape.areas.end(), place) - shape.areas.begin()),
          shape.areas.size() - 1);
      const double before = k > 0 ? shape.areas[k - 1] : 0, area = shape.areas[k] - before;
      place = std::clamp((place - before) / area, 0.0, 1.0);
      const world::ProxyFace& f = shape.faces[k];
      const Vec3d corner(f.corner[0]), a = Vec3d(f.corner[1]) - corner, b = Vec3d(f.corner[3]) - corner;
      photon.origin.voxel = v.voxel;
      photon.origin.fraction = clamp(corner + place * a + double{u[2]} * b, Vec3d(0), Vec3d(1));
      photon.direction = cosine_direction(glm::normalize(cross(a, b)));
      photon.power = Vec3d(scene_->materials()[v.block].emission) * (kPi * shape.areas.back() / share);
      return photon.power != Vec3d(0);
    }
    const int shown = std::popcount(v.faces);
    double pick = double{u[1]} * shown;
    int which = std::min(static_cast<int>(pick), shown - 1), face = 0;
    pick -= which;
    for (; face < world::kFaces; ++face)
      if (v.faces >> face & 1 && which-- == 0) break;
    const int axis = world::face_axis(face);
    Vec3d n(0), at_face(0);
    n[axis] = world::face_sign(face);
    // In the voxel before the face, exactly on it.
    at_face[(axis + 1) % 3] = std::min(pick, 1 - 0x1p-53), at_face[(axis + 2) % 3] = double{u[2]};
    at_face[axis] = world::face_sign(face) > 0 ? 0.0 : 1.0;
    photon.origin.voxel = v.voxel + world::face_step(face);
    photon.origin.fraction = at_face;
    photon.direction = cosine_direction(n);
    photon.power = Vec3d(scene_->materials()[v.block].emission) * (kPi * shown / share);
    photon.source = {LightKind::voxel, 0, 0, v.voxel, face};
  } else {
    Vec3d c[3];
    corners(e.index, e.triangle, anchor_, c);
    const double root = std::sqrt(double{u[1]});
    photon.origin = anchor_ + (c[0] * (1 - root) + c[1] * (root * (1 - double{u[2]})) + c[2] * (root * double{u[2]}));
    photon.direction = cosine_direction(Vec3d(e.axis));
    photon.power =
        Vec3d(scene_->instances()[e.index].emission) * (kPi * glm::length(cross(c[1] - c[0], c[2] - c[0])) / 2 / share);
    photon.source = {LightKind::triangle, e.index, e.triangle, {}, world::kNoFace};
  }
  return photon.power != Vec3d(0);
}

size_t LightSet::bytes() const {
  return emitters_.size() * sizeof(Emitter) + nodes_.size() * sizeof(Node) + voxels_.size() * sizeof(VoxelEmitter) +
         leaf_of_.size() * 4 + power_sums_.size() * 8 + (emitter_of_voxel_.size() + emitter_of_triangle_.size()) * 40;
}

}  // namespace render
