/// One scene for rays: the voxel grid, the meshes, and the luminaires that have an area and are visible.
///
/// What is a surface in the grid, for a ray that goes from a voxel of block A into one of block B, A != B:
///   B lets no light through               the face of B, from A
///   A or B is air                         the face of the other, from outside or from inside
///   both let light through                one face, of the one with the larger id (as in render/raycast/raycast.h)
///   A lets no light through               none: a ray that starts within such a block leaves it unseen
/// A block lets light through where its BSDF has an impulse to the other side (dielectric, thin, partly covered).
/// Within a block rays walk on while the id stays the same. Light that crosses a block loses exp(-absorption *
/// distance).
///
/// A block that has a shape (render/trace/proxies.h) is air with that shape in it: solid boxes of its material, and
/// sheets seen from both sides. Its emission is spread evenly over the shape.
///
/// Where a liquid ends within its voxel (render/liquid_levels.h), what is above it there is air: its top is a face of
/// the voxel that lies lower, `front` and `behind` are both that voxel, and `height` says how high it is.
///
/// A luminaire is seen from its emitting side and ends a ray there; from behind it isn't there. One on a face of a
/// voxel lies before that face: its distance counts as smaller by 1e-4 of itself.
///
/// The next ray starts without an offset: in the voxel before or behind a face, exactly on it; on a mesh, where the box
/// around the rounded point ends (world/space/ray_shapes.h), with the triangle's name so that it isn't met again.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "render/bsdf/bsdf.h"
#include "render/knobs.h"
#include "render/light/fog_light.h"
#include "render/liquid_levels.h"
#include "render/sky_view.h"
#include "render/trace/grid_caster.h"
#include "render/trace/mesh_scene.h"
#include "render/trace/proxies.h"
#include "world/base/function_ref.h"
#include "world/space/box_tree.h"
#include "world/world.h"

namespace render {

/// The mesh instances that a ray is inside of, the last entered last: of those that hold a medium or let light through.
/// Of more than kMost nested ones the outermost are forgotten.
class MeshesAround {
 public:
  static constexpr int kMost = 8;
  void enter(uint32_t instance);
  void leave(uint32_t instance);
  int count() const { return count_; }
  uint32_t operator[](int i) const { return instances_[static_cast<size_t>(i)]; }

 private:
  std::array<uint32_t, kMost> instances_{};
  int count_ = 0;
};

struct TraceRay {
  world::GridRay ray;  // direction of length 1: t is in m
  MeshOrigin from;
  int from_part = kNoPart;  // of the shape in the start's voxel
  MeshesAround around;

  world::WorldPoint start() const {
    world::WorldPoint p;
    p.voxel = ray.voxel;
    p.fraction = ray.fraction;
    return p;
  }
};

/// Where a ray passes the null surface of a mesh.
struct Crossing {
  double t = 0;
  uint32_t instance = 0;
  bool enters = false;
};

enum class SurfaceKind { none, voxel, shape, mesh, luminaire };

struct Surface {
  SurfaceKind kind = SurfaceKind::none;
  double t = world::kInfinity;
  world::VoxelPos front,
      behind;                 // of a voxel's face: on this side and beyond. Of a mesh, front is where `point` counts
  double height = 0;          // of a liquid's top that lies within the voxel; else 0
  Vec3d point{0};             // from the corner of front
  Vec3d error{0};             // of a mesh's point, on each axis
  int face = world::kNoFace;  // of `behind`, where that is a voxel's
  uint32_t index = 0;         // mesh: the instance; luminaire: into TraceScene::luminaires
  uint32_t triangle = 0;      // of a mesh
  int part = kNoPart;         // of a shape
  world::BlockId block = world::kAir;   // whose surface it is
  bool inside = false;                  // the ray comes from within that block or mesh
  world::BlockId beyond = world::kAir;  // of a voxel's face: what the ray would come into
  Vec3f normal{0}, shading_normal{0};   // unit, on the side that the ray comes from
  const Bsdf* bsdf = nullptr;
  BsdfParameters parameters{};
  float texture = 1;        // what a texture has multiplied the matte part of the parameters by
  Vec3f emission{0};        // W/(m^2 sr), sent back along the ray
  float luminaire_pdf = 0;  // with which the luminaire's sample() would have chosen this direction
  MeshesAround around;      // of the ray where it arrives

  bool hit() const { return kind != SurfaceKind::none; }
  world::WorldPoint position() const {
    world::WorldPoint p;
    p.voxel = front;
    p.fraction = point;
    return p;
  }
  /// A ray from here; `direction` of length 1 picks the side.
  TraceRay spawn(const Vec3f& direction) const;
};

/// A luminaire that gives light, made ready.
struct SceneLuminaire {
  const world::Luminaire* luminaire = nullptr;
  world::LuminaireSampler sampler;
  bool finite = true;    // has a place
  bool area = false;     // finite, and can be met
  bool impulse = false;  // a point or a direction
  bool physical = true;  // no switch turns any of its light off
  bool met = false;      // seen, and met by rays that scatter: area, visible; at infinity, visible, no impulse
};

/// A medium of strength.
struct SceneMedium {
  const world::Medium* medium = nullptr;
  bool everywhere = true;  // else it only fills meshes
  Vec3d absorption{0}, scattering{0}, extinction{0}, emission{0};
  ScatteredIn scattered_in;  // beside what is followed
  Vec3d to_sun{0, 1, 0};     // unit
  bool scatters = false, emits = false;
  bool tracks = false;  // a density grid, and not so dense that tracking would never get through
};

class TraceScene {
 public:
  /// `gloss`: which lobe glossy surfaces have, as of bsdf_parameters().
  static world::Result<TraceScene> build(const world::WorldView& view, uint32_t gloss = shared::kGlossFresnel);
  /// With another sky than the world's, and what the knobs say of how high liquids stand and which shapes blocks have.
  /// fog: what media scatter beside what is followed.
  static world::Result<TraceScene> build(const world::WorldView& view, uint32_t gloss, const SkyView& sky,
                                         const RenderKnobs& knobs, FogLight fog = FogLight::none);

  struct Material {
    const Bsdf* bsdf = nullptr;
    BsdfParameters outside{}, inside{};  // seen from air, and from within towards air
    Vec3f absorption{0};                 // 1/m
    Vec3f emission{0};                   // W/(m^2 sr) of its faces, or of its shape
    float index = 1;                     // of refraction
    bool transmits = false;              // has impulses to the other side
    bool finite = false;                 // scatters not by impulses alone
  };
  struct Instance {
    int medium = -1;  // into media
    bool null_surface = false, tracked = false;
    Vec3f emission{0};
  };

  const world::WorldView& view() const { return *view_; }
  const world::World& world() const { return view_->world(); }
  const SkyView& sky() const { return sky_; }
  const world::Environment& environment() const { return sky_.environment; }
  const std::vector<Material>& materials() const { return materials_; }
  const std::vector<Instance>& instances() const { return instances_; }
  const std::vector<SceneLuminaire>& luminaires() const { return luminaires_; }
  const std::vector<SceneMedium>& media() const { return media_; }
  const MeshScene& meshes() const { return meshes_; }
  const GridCaster& occupied() const { return occupied_; }
  const GridCaster& opaque() const { return opaque_; }
  /// Any medium with strength, anywhere.
  bool has_media() const { return !media_.empty(); }
  /// Whose face a ray sees that goes from a voxel of one block into one of another: see the head of this file.
  enum class FaceOf { neither, first, second };
  FaceOf face_between(world::BlockId first, world::BlockId second) const {
    if (shape(first)) first = world::kAir;
    if (shape(second)) second = world::kAir;
    if (first == second) return FaceOf::neither;
    if (first != world::kAir && !materials_[first].transmits) return FaceOf::neither;
    const bool leaves =
        second == world::kAir || (first != world::kAir && materials_[second].transmits && first > second);
    return leaves ? FaceOf::first : FaceOf::second;
  }
  /// What stands in a block's voxels; null: the cube.
  const world::Proxy* shape(world::BlockId block) const { return shapes_.shape[block]; }
  const world::BlockShapes& shapes() const { return shapes_; }
  const LiquidLevels& liquid_levels() const { return levels_; }
  /// BSDF parameters of a surface towards any other medium.
  BsdfParameters parameters(world::BlockId block, float index_other, bool inside) const;
  /// Bytes that media, meshes and luminaires made the scene keep.
  size_t bytes() const;
  /// The first luminaire with an area that a ray meets, in (0, t_most] m, of those that `counts(index)`; `hit` says
  /// where. Its distance counts as smaller by kLuminaireTolerance.
  std::optional<uint32_t> meet_luminaires(const world::WorldPoint& start, const Vec3d& direction, double t_most,
                                          world::FunctionRef<bool(uint32_t)> counts, world::LuminaireHit& hit) const;

 private:
  TraceScene(const world::WorldView& view, uint32_t gloss, const SkyView& sky);
  world::Status add_luminaires();
  world::Status add_media(FogLight fog);
  void add_materials();
  world::Status add_instances();

  const world::WorldView* view_;
  uint32_t gloss_;
  SkyView sky_;
  GridCaster occupied_, opaque_;
  MeshScene meshes_;
  world::BlockShapes shapes_;
  LiquidLevels levels_;
  std::vector<Material> materials_;
  std::vector<Instance> instances_;
  std::vector<SceneLuminaire> luminaires_;
  std::vector<uint32_t> area_luminaires_;  // that rays meet
  world::BoxTree luminaire_boxes_;         // of them, from luminaire_anchor_
  world::WorldPoint luminaire_anchor_;
  std::vector<SceneMedium> media_;
};

/// Whether the world holds anything that only rays through a TraceScene show: luminaires that give light, media of
/// strength, meshes.
bool calls_for_trace_scene(const world::World& world);

/// What was done for each effect; all zero where a scene doesn't call for it.
struct TraceCounts {
  uint64_t camera_rays = 0, scattered_rays = 0, shadow_rays = 0, photon_rays = 0;
  uint64_t mesh_queries = 0;         // effect meshes
  uint64_t media_intervals = 0;      // effect media: stretches of rays within one
  uint64_t luminaire_samples = 0;    // effect luminaires
  uint64_t block_light_samples = 0;  // effect block_light
  uint64_t transmissions = 0;        // effect transmission: rays that went through a surface
  uint64_t rays() const { return camera_rays + scattered_rays + shadow_rays + photon_rays; }
  void add(const TraceCounts& o);
};

/// A luminaire's distance counts as smaller by this part, so that one that lies on a face of a voxel isn't hidden by
/// it.
constexpr double kLuminaireTolerance = 1e-4;

/// Traces rays; one a thread.
class Tracer {
 public:
  explicit Tracer(const TraceScene& scene);

  /// The first surface. Passes null surfaces: `crossings` says where, in order. t_max is the ray's.
  /// `luminaires`: meets them too, except `not_this`, where the ray ends on it.
  Surface intersect(const TraceRay& ray, std::vector<Crossing>& crossings, bool luminaires = true,
                    uint32_t not_this = UINT32_MAX);
  /// The first surface of a mesh, as intersect() finds it among all.
  Surface intersect_meshes(const TraceRay& ray, std::vector<Crossing>& crossings);
  /// Whether the ray meets a voxel that holds back light which comes straight: an opaque one, but no liquid that ends
  /// within its voxel (render/light/shadow_voxels.h).
  bool meets_opaque(const world::GridRay& ray);
  /// 1/m along a ray that starts so, up to its first surface.
  Vec3f absorption(const TraceRay& ray);
  world::BlockId block(world::VoxelPos voxel);
  /// The block that a ray starts in: air above a liquid that ends within its voxel.
  world::BlockId block_of(const world::GridRay& ray) { return block_on(ray, {ray.voxel, 0, -1}); }
  /// Whether a ray starts in a block that lets no light through.
  bool in_solid(const world::GridRay& ray);
  /// The mesh instances around a point: those that a ray from it leaves more often than it enters.
  MeshesAround around(const world::WorldPoint& point);

  const TraceScene& scene() const { return *scene_; }
  TraceCounts counts;

 private:
  bool next_change(const world::GridAxes& axes, world::WalkPlace& place, double& t_limit, world::BlockId from,
                   world::BlockId& to);
  void meet_grid(const TraceRay& ray, Surface& surface);
  bool meet_shape(const TraceRay& ray, world::VoxelPos voxel, world::BlockId block, double t_limit, int from_part,
                  Surface& surface);
  void meet_meshes(const TraceRay& ray, std::vector<Crossing>& crossings, Surface& surface);
  void meet_luminaires(const TraceRay& ray, uint32_t not_this, Surface& surface);
  const world::LeafBlocks& leaf(world::VoxelPos voxel);
  int level(world::VoxelPos voxel);
  /// The block at a place of a ray: of the voxel, or air above a liquid that ends within it.
  world::BlockId block_on(const world::GridRay& ray, const world::WalkPlace& place);
  bool next_in_voxel(const world::GridAxes& axes, const world::GridRay& ray, world::WalkPlace& place, double t_limit,
                     world::BlockId from, world::BlockId& to);

  const TraceScene* scene_;
  world::StoreReader reader_;
  world::LeafPos leaf_pos_{INT32_MAX, 0, 0};
  world::LeafBlocks leaf_{};
  const LiquidLevels::Leaf* leaf_levels_ = nullptr;
};

}  // namespace render
