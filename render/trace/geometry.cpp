#include "render/trace/geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "world/space/ray_shapes.h"

namespace render {

using world::BlockId;
using world::GridAxes;
using world::GridRay;
using world::kAir;
using world::kInfinity;
using world::VoxelPos;
using world::WalkPlace;
using world::WorldPoint;

namespace {

constexpr double kPi = 3.14159265358979323846;

Vec3f vector_of(auto bands) { return {bands.r, bands.g, bands.b}; }
bool any(auto bands) { return bands.max() > 0; }

bool has_strength(const world::Medium& m) { return any(m.absorption) || any(m.scattering); }

/// Whether the surface lets some light through, by an impulse.
bool transmits(const Bsdf& bsdf, const BsdfParameters& parameters) {
  const Vec3f n(0, 1, 0);
  const Impulses impulses = bsdf.incoming_impulses(parameters, glm::normalize(Vec3f(0.3f, 0.9f, 0.1f)), n);
  for (int i = 0; i < impulses.count; ++i)
    if (impulses.impulse[i].direction.y < 0 && impulses.impulse[i].magnitude != Vec3f(0)) return true;
  return false;
}

/// Tentative collisions along the longest ray through a density grid, if the majorant were its largest density.
double most_collisions(const world::Medium& m) {
  Vec3d low(0), high(0);
  m.field->bounds(low, high);
  const double sigma = double{m.absorption.max()} + m.scattering.max();
  return sigma * m.field->max() * m.voxel_size * glm::length(high - low);
}
constexpr double kMostCollisions = 1e5;  // some 5 ms a ray

Vec3d difference(VoxelPos a, VoxelPos b) { return Vec3d(double(a.x) - b.x, double(a.y) - b.y, double(a.z) - b.z); }

}  // namespace

void MeshesAround::enter(uint32_t instance) {
  if (count_ == kMost) {
    std::move(instances_.begin() + 1, instances_.end(), instances_.begin());
    --count_;
  }
  instances_[static_cast<size_t>(count_++)] = instance;
}

void MeshesAround::leave(uint32_t instance) {
  for (int i = count_; i-- > 0;)
    if (instances_[static_cast<size_t>(i)] == instance) {
      std::move(instances_.begin() + i + 1, instances_.begin() + count_, instances_.begin() + i);
      --count_;
      return;
    }
}

TraceRay Surface::spawn(const Vec3f& direction) const {
  TraceRay next;
  next.ray.direction = Vec3d(direction);
  next.around = around;
  const bool through = dot(direction, normal) < 0;
  if (kind == SurfaceKind::voxel) {
    next.ray.voxel = through ? behind : front;
    next.ray.fraction = point;
    if (height > 0) return next;
    const int axis = world::face_axis(face);
    if (through) next.ray.fraction[axis] = 1 - point[axis];  // the same plane, from the voxel beyond
    return next;
  }
  if (kind == SurfaceKind::shape) {
    next.ray.voxel = front;
    next.ray.fraction = clamp(point, Vec3d(0), Vec3d(1));
    next.from_part = part;
    return next;
  }
  const Vec3d moved = world::offset_ray_origin<double>({point, error}, Vec3d(normal), Vec3d(direction));
  WorldPoint corner;
  corner.voxel = front;
  const WorldPoint start = corner + moved;
  next.ray.voxel = start.voxel;
  next.ray.fraction = start.fraction;
  if (kind == SurfaceKind::mesh) {
    next.from = {index, triangle};
    if (through) inside ? next.around.leave(index) : next.around.enter(index);
  }
  return next;
}

// --- scene --------------------------------------------------------------------------------------------------------

bool calls_for_trace_scene(const world::World& world) {
  // A null surface shows nothing but the medium that it bounds.
  const auto shows = [](const world::MeshInstance& m) { return !m.null_surface || !m.interior_medium.empty(); };
  return std::any_of(world.meshes.begin(), world.meshes.end(), shows) ||
         std::any_of(world.luminaires.begin(), world.luminaires.end(), world::gives_light) ||
         std::any_of(world.media.begin(), world.media.end(), has_strength);
}

TraceScene::TraceScene(const world::WorldView& view, uint32_t gloss, const SkyView& sky)
    : view_(&view),
      gloss_(gloss),
      sky_(sky),
      occupied_(view.masks(world::MaskKind::occupied)),
      opaque_(view.masks(world::MaskKind::opaque)) {}

world::Result<TraceScene> TraceScene::build(const world::WorldView& view, uint32_t gloss) {
  return build(view, gloss, view.environment(), RenderKnobs{});
}

world::Result<TraceScene> TraceScene::build(const world::WorldView& view, uint32_t gloss, const SkyView& sky,
                                            const RenderKnobs& knobs, FogLight fog) {
  TRY_STATUS(check_bsdfs(view.palette()));
  TraceScene scene(view, gloss, sky);
  scene.levels_.follow(view, knobs.liquid_surface != LiquidSurface::full);
  TRY(scene.shapes_, world::block_shapes(view.palette()));
  if (knobs.proxy_shapes == ProxyShapes::cube) std::ranges::fill(scene.shapes_.shape, nullptr);
  TRY(scene.meshes_, MeshScene::build(view.world()));
  scene.add_materials();
  TRY_STATUS(scene.add_media(fog));
  TRY_STATUS(scene.add_instances());
  TRY_STATUS(scene.add_luminaires());
  return scene;
}

void TraceScene::add_materials() {
  const world::BlockPalette& palette = view_->palette();
  const float index_air = palette[kAir].index_of_refraction;
  materials_.resize(palette.size());
  for (size_t id = 0; id < palette.size(); ++id) {
    const world::Block& block = palette[static_cast<BlockId>(id)];
    Material& m = materials_[id];
    m.bsdf = bsdf_of(block);
    m.outside = bsdf_parameters(block, index_air, false, gloss_);
    m.inside = bsdf_parameters(block, index_air, true, gloss_);
    // Lambertian: P = pi A L, with A = 6 m^2 of a cube.
    const world::Proxy* shape = shapes_.shape[id];
    m.emission = vector_of(block.emission) * static_cast<float>(1 / (kPi * (shape ? world::shown_area(*shape) : 6)));
    m.absorption = vector_of(block.absorption);
    m.index = block.index_of_refraction;
    const Vec3f up(0, 1, 0);
    m.finite = m.bsdf->finite_density(m.outside, up, up, up) != Vec3f(0);
    m.transmits = id != kAir && !block.opaque && transmits(*m.bsdf, m.outside);
  }
}

BsdfParameters TraceScene::parameters(BlockId block, float index_other, bool inside) const {
  const Material& m = materials_[block];
  if (index_other == materials_[kAir].index) return inside ? m.inside : m.outside;
  return bsdf_parameters(view_->palette()[block], index_other, inside, gloss_);
}

world::Status TraceScene::add_media(FogLight fog) {
  const world::World& world = view_->world();
  const FogSource source = world.media.empty() ? FogSource{} : fog_source(sky_, fog);
  for (const world::Medium& medium : world.media) {
    if (!has_strength(medium)) continue;
    SceneMedium m;
    m.medium = &medium;
    m.absorption = Vec3d(vector_of(medium.absorption));
    m.scattering = Vec3d(vector_of(medium.scattering));
    m.extinction = m.absorption + m.scattering;
    m.emission = Vec3d(vector_of(medium.emission));
    m.scattered_in = render::scattered_in(medium, source);
    m.to_sun = sky_.environment.sun_direction;
    m.scatters = any(medium.scattering);
    m.emits = any(medium.emission);
    m.everywhere = medium.name.empty() ||
                   std::none_of(world.meshes.begin(), world.meshes.end(),
                                [&](const world::MeshInstance& mesh) { return mesh.interior_medium == medium.name; });
    m.tracks = medium.field && most_collisions(medium) <= kMostCollisions;
    media_.push_back(m);
  }
  return {};
}

world::Status TraceScene::add_instances() {
  for (const world::MeshInstance& mesh : view_->world().meshes) {
    Instance instance;
    instance.null_surface = mesh.null_surface;
    instance.emission = vector_of(mesh.radiance);
    if (!mesh.interior_medium.empty()) {
      bool known = false;
      for (const world::Medium& m : view_->world().media) known |= m.name == mesh.interior_medium;
      if (!known)
        return world::input_error(fmt::format("{}: interior_medium \"{}\" is the name of no [[medium]] of the scene",
                                              mesh.where, mesh.interior_medium));
      for (size_t i = 0; i < media_.size(); ++i)
        if (media_[i].medium->name == mesh.interior_medium) instance.medium = static_cast<int>(i);
    }
    instance.tracked = instance.medium >= 0 || (!mesh.null_surface && materials_[mesh.block_id].transmits);
    instances_.push_back(instance);
  }
  return {};
}

world::Status TraceScene::add_luminaires() {
  for (const world::Luminaire& l : view_->world().luminaires) {
    if (!gives_light(l)) continue;
    TRY(world::LuminaireSampler sampler, world::LuminaireSampler::make(l));
    SceneLuminaire s{&l, std::move(sampler)};
    const float area = s.sampler.surface_area();
    s.impulse = s.sampler.impulse();
    s.finite = std::isfinite(area);
    s.area = s.finite && area > 0 && !s.impulse;
    s.physical = l.lambertian && l.glossy && l.global_illumination && l.shadows;
    s.met = l.visible && !s.impulse && (s.area || !s.finite);
    if (s.area && s.met) area_luminaires_.push_back(static_cast<uint32_t>(luminaires_.size()));
    luminaires_.push_back(std::move(s));
  }
  // Boxes around them, wider by more than the rounding of positions far from the anchor.
  std::vector<world::Box> boxes;
  for (const uint32_t i : area_luminaires_) {
    const world::Luminaire& l = *luminaires_[i].luminaire;
    if (boxes.empty()) luminaire_anchor_.voxel = l.position.voxel;
    double reach = std::max(l.radius, glm::length(l.extent) / 2);
    for (const Vec3f& corner : l.triangles) reach = std::max<double>(reach, glm::length(corner));
    const Vec3d centre = l.position - luminaire_anchor_;
    reach = reach * (1 + 1e-6) + 1e-12 * glm::length(centre);
    boxes.push_back({centre - reach, centre + reach});
  }
  luminaire_boxes_ = world::BoxTree(boxes);
  return {};
}

std::optional<uint32_t> TraceScene::meet_luminaires(const WorldPoint& start, const Vec3d& direction, double t_most,
                                                    world::FunctionRef<bool(uint32_t)> counts,
                                                    world::LuminaireHit& hit) const {
  if (area_luminaires_.empty()) return std::nullopt;
  const auto distance_to = [&](int k) {
    const uint32_t i = area_luminaires_[static_cast<size_t>(k)];
    if (!counts(i)) return -1.0;
    const auto met = luminaires_[i].sampler.meet(start - luminaires_[i].luminaire->position, Vec3f(direction));
    return met ? met->distance : -1.0;
  };
  const int nearest =
      luminaire_boxes_.nearest(start - luminaire_anchor_, direction, distance_to, t_most / (1 - kLuminaireTolerance));
  if (nearest < 0) return std::nullopt;
  const uint32_t i = area_luminaires_[static_cast<size_t>(nearest)];
  hit = *luminaires_[i].sampler.meet(start - luminaires_[i].luminaire->position, Vec3f(direction));
  return i;
}

size_t TraceScene::bytes() const {
  return meshes_.bytes() + instances_.size() * sizeof(Instance) + media_.size() * sizeof(SceneMedium) +
         luminaires_.size() * sizeof(SceneLuminaire) + luminaire_boxes_.bytes();
}

void TraceCounts::add(const TraceCounts& o) {
  camera_rays += o.camera_rays, scattered_rays += o.scattered_rays, shadow_rays += o.shadow_rays;
  photon_rays += o.photon_rays, mesh_queries += o.mesh_queries, media_intervals += o.media_intervals;
  luminaire_samples += o.luminaire_samples, block_light_samples += o.block_light_samples;
  transmissions += o.transmissions;
}

// --- rays ---------------------------------------------------------------------------------------------------------

Tracer::Tracer(const TraceScene& scene) : scene_(&scene), reader_(scene.view().store()) {}

const world::LeafBlocks& Tracer::leaf(VoxelPos voxel) {
  const world::LeafPos pos = leaf_from_voxel(voxel);
  if (pos != leaf_pos_) {
    leaf_pos_ = pos, leaf_ = reader_.leaf(pos);
    leaf_levels_ = scene_->liquid_levels().leaf(pos);
  }
  return leaf_;
}

int Tracer::level(VoxelPos voxel) {
  if (!scene_->liquid_levels().any()) return kFullLevel;
  leaf(voxel);
  return leaf_levels_ ? (*leaf_levels_)[static_cast<size_t>(index_in_leaf(voxel))] : kFullLevel;
}

BlockId Tracer::block_on(const GridRay& ray, const WalkPlace& place) {
  const int high = level(place.voxel);
  if (high < kFullLevel && !LevelCrossing(ray, place.voxel, high).in_liquid(place.t, place.axis)) return kAir;
  return block(place.voxel);
}

/// From `place`, in a voxel whose liquid ends within it, through the surface or into the next voxel.
bool Tracer::next_in_voxel(const GridAxes& axes, const GridRay& ray, WalkPlace& place, double t_limit, BlockId from,
                           BlockId& to) {
  const LevelCrossing surface(ray, place.voxel, level(place.voxel));
  WalkPlace next = place;
  const bool leaves = world::mask_walk::leave_cube(axes, next, 0, t_limit);
  if (!surface.crossed(place.t, place.axis) && surface.t() <= t_limit &&
      (!leaves || surface.crossed(next.t, next.axis))) {
    to = from == kAir ? block(place.voxel) : kAir;
    place.t = surface.t(), place.axis = 1;
    return true;
  }
  if (!leaves) return false;
  place = next;
  to = block_on(ray, place);
  return true;
}

BlockId Tracer::block(VoxelPos voxel) { return leaf(voxel)[index_in_leaf(voxel)]; }

bool Tracer::in_solid(const GridRay& ray) {
  const BlockId id = block_of(ray);
  return id != kAir && !scene_->shape(id) && !scene_->materials()[id].transmits;
}

/// From `place`, in a voxel of the block `from`, to the first voxel of another.
bool Tracer::next_change(const GridAxes& axes, WalkPlace& place, double& t_limit, BlockId from, BlockId& to) {
  if (from == kAir) {
    if (!scene_->occupied().first_set(axes, place, t_limit)) return false;
    to = block(place.voxel);
    return true;
  }
  do {
    const bool uniform = !leaf(place.voxel).values && !leaf_levels_;
    if (!world::mask_walk::leave_cube(axes, place, uniform ? world::kLeafSize - 1 : 0, t_limit)) return false;
    to = block(place.voxel);
  } while (to == from && level(place.voxel) == kFullLevel);
  return true;
}

bool Tracer::meet_shape(const TraceRay& r, VoxelPos voxel, BlockId id, double t_limit, int from_part, Surface& s) {
  const world::Proxy& shape = *scene_->shape(id);
  const uint8_t joins = scene_->shapes().joins_at(shape, voxel, [this](VoxelPos v) { return block(v); });
  ProxyHit hit;
  if (!intersect_proxy(shape, joins, r.ray, voxel, t_limit, hit, from_part)) return false;
  const TraceScene::Material& material = scene_->materials()[id];
  if (hit.inside && !material.transmits) return false;
  const bool behind = dot(Vec3d(hit.normal), r.ray.direction) > 0;
  s.kind = SurfaceKind::shape;
  s.t = hit.t;
  s.block = id;
  s.inside = hit.inside;
  s.front = s.behind = voxel;
  s.point = hit.point;
  s.error = hit.error;
  s.part = hit.part;
  s.normal = s.shading_normal = behind ? -hit.normal : hit.normal;
  s.bsdf = material.bsdf;
  s.parameters = hit.inside ? material.inside : material.outside;
  s.emission = hit.inside ? Vec3f(0) : material.emission;
  return true;
}

void Tracer::meet_grid(const TraceRay& r, Surface& s) {
  const auto& materials = scene_->materials();
  const GridAxes axes(r.ray);
  WalkPlace place{r.ray.voxel, 0, -1};
  double t_limit = std::min(r.ray.t_max, std::numeric_limits<double>::max());
  BlockId from = block_on(r.ray, place), to = kAir;
  int from_part = r.from_part;
  VoxelPos within;  // the voxel whose liquid's top was met
  bool on_top = false;
  for (;; from = to, from_part = kNoPart) {
    const int high = level(place.voxel);
    on_top = false;
    if (high < kFullLevel) {
      within = place.voxel;
      const double t = place.t;
      const int axis = place.axis;
      if (!next_in_voxel(axes, r.ray, place, t_limit, from, to)) return;
      on_top = place.voxel == within && (place.t != t || place.axis != axis);
    } else if (scene_->shape(from)) {
      if (meet_shape(r, place.voxel, from, t_limit, from_part, s)) return;
      if (!world::mask_walk::leave_cube(axes, place, 0, t_limit)) return;
      to = block_on(r.ray, place);
    } else if (!next_change(axes, place, t_limit, from, to)) {
      return;
    } else {
      to = block_on(r.ray, place);
    }
    if (scene_->face_between(from, to) != TraceScene::FaceOf::neither) break;
  }
  if (scene_->shape(from)) from = kAir;
  if (scene_->shape(to)) to = kAir;
  const bool leaves = scene_->face_between(from, to) == TraceScene::FaceOf::first;
  s.kind = SurfaceKind::voxel;
  s.t = place.t;
  s.block = leaves ? from : to;
  s.inside = leaves;
  s.beyond = to;
  s.face = world::entered_face(place.axis, axes.upwards[place.axis] != 0);
  s.behind = place.voxel;
  s.front = on_top ? place.voxel : place.voxel + world::face_step(s.face);
  const Vec3d from_corner = difference(s.front, r.ray.voxel);
  for (int a = 0; a < 3; ++a) {
    const double offset = r.ray.fraction[a] + place.t * r.ray.direction[a] - from_corner[a];
    s.point[a] = a == place.axis ? (world::face_sign(s.face) > 0 ? 0.0 : 1.0) : std::clamp(offset, 0.0, 1.0);
  }
  if (on_top) s.point.y = s.height = double(level(place.voxel)) / kFullLevel;
  s.normal = Vec3f(0);
  s.normal[place.axis] = static_cast<float>(world::face_sign(s.face));
  s.shading_normal = s.normal;
  s.bsdf = materials[s.block].bsdf;
  s.parameters = scene_->parameters(s.block, materials[leaves ? to : from].index, leaves);
  s.emission = leaves ? Vec3f(0) : materials[s.block].emission;
}

void Tracer::meet_meshes(const TraceRay& r, std::vector<Crossing>& crossings, Surface& s) {
  if (scene_->meshes().empty()) return;
  GridRay ray = r.ray;
  MeshOrigin from = r.from;
  double passed = 0;
  for (;;) {
    ray.t_max = std::min(r.ray.t_max, s.t) - passed;
    if (!(ray.t_max >= 0)) return;
    ++counts.mesh_queries;
    const MeshHit hit = scene_->meshes().intersect(ray, from);
    if (!hit.hit) return;
    const world::MeshInstance& mesh = scene_->world().meshes[hit.instance];
    const bool inside = dot(Vec3d(hit.normal), r.ray.direction) > 0;
    Surface at;
    at.kind = SurfaceKind::mesh;
    at.front = ray.voxel;
    at.point = hit.point;
    at.error = hit.error;
    at.normal = inside ? -hit.normal : hit.normal;
    at.index = hit.instance;
    at.triangle = hit.triangle;
    if (mesh.null_surface) {
      if (scene_->instances()[hit.instance].tracked) crossings.push_back({passed + hit.t, hit.instance, !inside});
      const TraceRay next = at.spawn(Vec3f(r.ray.direction));
      passed += dot(difference(next.ray.voxel, ray.voxel) + (next.ray.fraction - ray.fraction), r.ray.direction);
      ray.voxel = next.ray.voxel;
      ray.fraction = next.ray.fraction;
      from = next.from;
      continue;
    }
    at.t = passed + hit.t;
    at.inside = inside;
    at.shading_normal = inside ? -hit.shading_normal : hit.shading_normal;
    if (!(dot(Vec3d(at.shading_normal), r.ray.direction) < 0)) at.shading_normal = at.normal;
    const bool second = mesh.checkers.x > 0 && mesh.checkers.y > 0 &&
                        (static_cast<int64_t>(std::floor(hit.u * mesh.checkers.x)) +
                         static_cast<int64_t>(std::floor(hit.v * mesh.checkers.y))) %
                                2 !=
                            0;
    at.block = second ? mesh.checker_id : mesh.block_id;
    at.bsdf = scene_->materials()[at.block].bsdf;
    WorldPoint corner;
    corner.voxel = ray.voxel;
    const WorldPoint point = corner + hit.point;
    const BlockId outside = scene_->liquid_levels().above_surface(point) ? kAir : block(point.voxel);
    at.parameters = scene_->parameters(at.block, scene_->materials()[outside].index, inside);
    at.emission = inside ? Vec3f(0) : scene_->instances()[hit.instance].emission;
    s = at;
    return;
  }
}

void Tracer::meet_luminaires(const TraceRay& r, uint32_t not_this, Surface& s) {
  world::LuminaireHit hit;
  const auto met = scene_->meet_luminaires(
      r.start(), r.ray.direction, std::min(s.t, r.ray.t_max), [&](uint32_t i) { return i != not_this; }, hit);
  if (!met) return;
  s = {};
  s.kind = SurfaceKind::luminaire;
  s.t = std::min(hit.distance, r.ray.t_max);
  s.index = *met;
  s.emission = vector_of(hit.radiance);
  s.luminaire_pdf = hit.pdf;
  s.front = r.ray.voxel;
  s.point = r.ray.fraction + s.t * r.ray.direction;
}

namespace {

/// The surface with what the ray is inside of where it arrives; what it would cross behind is forgotten.
Surface with_around(const TraceRay& ray, std::vector<Crossing>& crossings, Surface s) {
  while (!crossings.empty() && crossings.back().t > s.t) crossings.pop_back();
  s.around = ray.around;
  for (const Crossing& c : crossings) c.enters ? s.around.enter(c.instance) : s.around.leave(c.instance);
  return s;
}

}  // namespace

Surface Tracer::intersect(const TraceRay& ray, std::vector<Crossing>& crossings, bool luminaires, uint32_t not_this) {
  Surface s;
  crossings.clear();
  meet_grid(ray, s);
  meet_meshes(ray, crossings, s);
  if (luminaires) meet_luminaires(ray, not_this, s);
  return with_around(ray, crossings, s);
}

Surface Tracer::intersect_meshes(const TraceRay& ray, std::vector<Crossing>& crossings) {
  Surface s;
  crossings.clear();
  meet_meshes(ray, crossings, s);
  return with_around(ray, crossings, s);
}

bool Tracer::meets_opaque(const GridRay& ray) {
  const GridAxes axes(ray);
  WalkPlace place{ray.voxel, 0, -1};
  double t_limit = std::min(ray.t_max, std::numeric_limits<double>::max());
  while (scene_->opaque().first_set(axes, place, t_limit)) {
    if (level(place.voxel) == kFullLevel) return true;
    if (!world::mask_walk::leave_cube(axes, place, 0, t_limit)) return false;
  }
  return false;
}

Vec3f Tracer::absorption(const TraceRay& ray) {
  for (int i = ray.around.count(); i-- > 0;) {
    const auto& mesh = scene_->world().meshes[ray.around[i]];
    if (!mesh.null_surface && scene_->materials()[mesh.block_id].transmits)
      return scene_->materials()[mesh.block_id].absorption;
  }
  const BlockId start = block_of(ray.ray);
  return start != kAir && !scene_->shape(start) && scene_->materials()[start].transmits
             ? scene_->materials()[start].absorption
             : Vec3f(0);
}

MeshesAround Tracer::around(const WorldPoint& point) {
  MeshesAround found;
  const auto& instances = scene_->instances();
  if (std::none_of(instances.begin(), instances.end(), [](const auto& i) { return i.tracked; })) return found;
  std::vector<int> leaves(instances.size(), 0);
  TraceRay r;
  r.ray = GridRay(point, glm::normalize(Vec3d(0.2113, 0.9137, 0.3469)));  // along no axis and no likely edge
  for (int i = 0; i < 10000; ++i) {
    ++counts.mesh_queries;
    const MeshHit hit = scene_->meshes().intersect(r.ray, r.from);
    if (!hit.hit) break;
    const bool inside = dot(Vec3d(hit.normal), r.ray.direction) > 0;
    leaves[hit.instance] += inside ? 1 : -1;
    Surface at;
    at.kind = SurfaceKind::mesh;
    at.front = r.ray.voxel;
    at.point = hit.point, at.error = hit.error;
    at.normal = inside ? -hit.normal : hit.normal;
    at.index = hit.instance, at.triangle = hit.triangle;
    r = at.spawn(Vec3f(r.ray.direction));
  }
  for (size_t i = 0; i < instances.size(); ++i)
    if (instances[i].tracked && leaves[i] > 0) found.enter(static_cast<uint32_t>(i));
  return found;
}

}  // namespace render
