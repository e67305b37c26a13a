/// All sources of light of a scene, and which of them a point should ask: the sun, the sky, luminaires, the exposed
/// faces of emitting blocks, meshes that shine.
///
/// A sample picks one source with a known probability, half of it in proportion to a bound of the irradiance that the
/// source could give there, half shared evenly. Sources at no place stand each for itself; those that have a place,
/// be they 10^5, are the leaves of one binary tree, which is descended by the power below each node over the squared
/// distance, zero where the node shines elsewhere or lies below the point's horizon.
///
/// Shapes of blocks are sampled over their area. A voxel's faces that a point sees are sampled uniformly over the solid
/// angle that they fill (below 1e-3 sr over their area), so that a sample's weight stays bounded where lamp and wall
/// touch (hard case B14). memory  100 bytes an emitting voxel or triangle cost    a sample descends 2 log2(n) nodes;
/// building sorts n log2(n) times source  Alejandro Conty Estevez, Christopher Kulla. Importance Sampling of Many
/// Lights with Adaptive Tree Splitting.
///         2018; Carlos Urena, Marcos Fajardo, Alan King. An Area-Preserving Parametrization for Spherical Rectangles.
///         2013; Eric Veach, Leonidas Guibas. Optimally Combining Sampling Techniques for Monte Carlo Rendering. 1995
#pragma once

#include <map>
#include <unordered_map>
#include <vector>

#include "render/trace/geometry.h"
#include "render/trace/sampler.h"

namespace render {

using world::Vec2f;

/// Who is lit: a point, and, unless light may come from all around, the normal of the side that it may come from.
struct Receiver {
  world::WorldPoint position;
  Vec3f normal{0};
  bool one_sided = false;
};

enum class LightKind : uint32_t { sun, sky, luminaire, voxel, triangle };

/// What a shadow ray is to reach.
struct LightTarget {
  LightKind kind = LightKind::sky;
  uint32_t index = 0;  // luminaire: into TraceScene::luminaires; triangle: the instance
  uint32_t triangle = 0;
  world::VoxelPos voxel;
  int face = world::kNoFace;
};

struct LightSample {
  Vec3f direction{0};   // unit, towards the light
  double distance = 0;  // m; infinity where it lies at no place
  Vec3d radiance{0};    // that comes from there; where pdf is 0, irradiance of a plane that faces it, over its
                        // probability
  double pdf = 0;       // of the choice of the light and of the direction, 1/sr; 0: an impulse
  LightTarget target;
  const world::Luminaire* luminaire = nullptr;  // whose switches hold; null: it is physics
};

struct LightPhoton {
  world::WorldPoint origin;
  Vec3f direction{0};
  Vec3d power{0};  // W; its mean over photons is the power of all lights
  LightTarget source;
};

class LightSet {
 public:
  /// `photons`: makes emit() ready too.
  static LightSet build(const TraceScene& scene, bool photons = false);

  bool empty() const { return far_.empty() && nodes_.empty(); }
  /// False: no light can reach the receiver, or this sample is black.
  bool sample(const Receiver& receiver, float pick, Vec2f u, LightSample& sample) const;
  /// One given source: the sun, the sky, or a luminaire.
  bool sample_one(LightTarget source, const Receiver& receiver, Vec2f u, LightSample& sample) const;

  // With which sample() would have chosen what a ray from the receiver met, 1/sr; 0 where it could not.
  double pdf_sky(const Receiver& receiver, const Vec3f& direction) const;
  double pdf_luminaire(const Receiver& receiver, uint32_t luminaire, double direction_pdf) const;
  double pdf_voxel(const Receiver& receiver, const Surface& surface, const Vec3f& direction, double distance) const;
  double pdf_triangle(const Receiver& receiver, uint32_t instance, uint32_t triangle, const Vec3f& direction,
                      double distance) const;

  /// A photon, from a source picked in proportion to its power; those at no place shine through a disk before the
  /// scene. `u`: 5 numbers.
  bool emit(const float (&u)[5], LightPhoton& photon) const;

  size_t local_count() const { return emitters_.size(); }
  /// Voxels that emit and show a face.
  size_t voxel_count() const { return voxels_.size(); }
  size_t bytes() const;
  const world::SceneSphere& scene_sphere() const { return sphere_; }  // relative to anchor()
  const world::WorldPoint& anchor() const { return anchor_; }

 private:
  struct FarLight {
    LightKind kind = LightKind::sky;
    uint32_t luminaire = 0;
    double irradiance = 0;  // mean of bands, of a plane that faces it
    Vec3f direction{0};     // towards it, where it is an impulse
    double power = 0;       // through the scene's sphere
  };
  struct VoxelEmitter {
    world::VoxelPos voxel;
    uint8_t faces = 0;  // bit: shows
    world::BlockId block = world::kAir;
    uint32_t shape = UINT32_MAX;  // into shapes_; else the cube
  };
  /// A block's shape as its neighbours make it: parallelograms, and the areas up to each.
  struct Shape {
    std::vector<world::ProxyFace> faces;
    std::vector<double> areas;
  };
  struct Emitter {
    LightKind kind = LightKind::voxel;
    uint32_t index = 0;  // into voxels_; luminaire; instance
    uint32_t triangle = 0;
    Vec3f centre{0};  // from anchor
    float radius = 0;
    float intensity = 0;        // the largest, mean of bands, W/sr
    float power = 0;            // W, mean of bands
    Vec3f axis{0};              // one-sided emitters: where they shine
    float spread = kAllAround;  // largest angle of an emitter's normal from the axis, rad
  };
  struct Node {
    Vec3f low{0}, high{0};
    Vec3f axis{0};
    float spread = 0, intensity = 0;
    float cos_spread = 1, sin_spread = 0;
    uint32_t parent = 0;
    uint32_t child = 0;    // the second; the first follows its parent. Leaf: 0
    uint32_t emitter = 0;  // of a leaf
  };
  static constexpr float kAllAround = 4;  // > pi

  void add_far(const TraceScene& scene);
  void add_voxels(const TraceScene& scene);
  void add_triangles(const TraceScene& scene);
  void add_luminaires(const TraceScene& scene);
  void find_sphere(const TraceScene& scene);
  uint32_t build_node(std::vector<uint32_t>& order, size_t begin, size_t end, uint32_t parent);
  double importance(const Node& node, const Vec3f& from_anchor, const Receiver& receiver) const;
  double far_importance(const FarLight& far, const Receiver& receiver) const;
  /// Sum and number of what can give light: each far light, and the tree as a whole.
  struct Shares {
    double sum = 0, local = 0;
    int count = 0;
    double of(double importance) const { return importance > 0 ? 0.5 * (importance / sum) + 0.5 / count : 0; }
  };
  Shares shares(const Receiver& receiver, const Vec3f& from_anchor) const;
  double far_share(const Receiver& receiver, LightKind kind, uint32_t luminaire) const;
  double local_share(const Receiver& receiver, uint32_t emitter) const;
  uint32_t shape_of(world::BlockId block, uint8_t joins, std::map<uint32_t, uint32_t>& known);
  bool sample_shape(const VoxelEmitter& emitter, const Receiver& receiver, Vec2f u, LightSample& sample) const;
  bool sample_voxel(const VoxelEmitter& emitter, const Receiver& receiver, Vec2f u, LightSample& sample) const;
  bool sample_triangle(const Emitter& emitter, const Receiver& receiver, Vec2f u, LightSample& sample) const;
  bool sample_luminaire(uint32_t index, const Receiver& receiver, Vec2f u, LightSample& sample) const;
  bool sample_sky(const Receiver& receiver, Vec2f u, LightSample& sample) const;
  bool sample_sun(const Receiver& receiver, LightSample& sample) const;
  Vec3f from_anchor(const world::WorldPoint& point) const { return Vec3f(point - anchor_); }
  double sky_density(const Vec3f& direction) const;
  void corners(uint32_t instance, uint32_t triangle, const world::WorldPoint& from, Vec3d (&out)[3]) const;

  const TraceScene* scene_ = nullptr;
  std::vector<FarLight> far_;
  std::vector<VoxelEmitter> voxels_;
  std::vector<Shape> shapes_;
  std::vector<Emitter> emitters_;
  std::vector<Node> nodes_;
  std::vector<uint32_t> leaf_of_;   // by emitter
  std::vector<double> power_sums_;  // of far lights, then of emitters, running
  std::unordered_map<world::VoxelPos, uint32_t, world::PosHash> emitter_of_voxel_;
  std::unordered_map<uint64_t, uint32_t> emitter_of_triangle_;
  std::vector<uint32_t> emitter_of_luminaire_;  // UINT32_MAX: none
  world::WorldPoint anchor_;
  world::SceneSphere sphere_;
};

}  // namespace render
