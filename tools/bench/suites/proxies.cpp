/// Shapes inside voxels: rays over a field of 100,000 fences, stalks, torches and lanterns, against an Embree instance
/// for each of them.
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "render/trace/proxies.h"
#include "tools/bench/benchmark.h"
#include "tools/bench/ray_sets.h"
#include "tools/bench/rivals/embree_rays.h"
#include "world/base/random.h"
#include "world/store/ray_stream.h"

namespace tools {

namespace {

using world::BlockId;
using world::GridAxes;
using world::GridRay;
using world::MaskKind;
using world::MaskWalker;
using world::Proxy;
using world::Vec3d;
using world::Vec3f;
using world::VoxelPos;
using world::WalkPlace;
using world::World;

constexpr int kSide = 512;           // m of the field
constexpr size_t kShapes = 100'000;  // standing on it
constexpr double kFar = 2000;        // more than its diagonal

/// A square of stone with shapes on random places of it; one cell in 2.6 holds one.
World make_field(std::vector<VoxelPos>& places) {
  World field(world::standard_blocks());
  world::EditBatch batch;
  batch.fill({{0, -4, 0}, {kSide - 1, -1, kSide - 1}}, *field.palette->find("stone"));
  std::vector<BlockId> kinds;
  for (const char* name : {"fence_oak", "fence_oak", "reed", "tall_grass", "torch", "lantern"})
    kinds.push_back(*field.palette->find(name));
  std::vector<bool> taken(size_t{kSide} * kSide);
  for (int64_t i = 0; places.size() < kShapes; ++i) {
    const size_t cell = world::random_bits(1, i, 0, 0) % taken.size();
    if (taken[cell]) continue;
    taken[cell] = true;
    const VoxelPos v{static_cast<int32_t>(cell / kSide), 0, static_cast<int32_t>(cell % kSide)};
    places.push_back(v);
    batch.set(v, kinds[world::random_bits(2, i, 0, 0) % kinds.size()]);
  }
  CHECK(field.store.apply(batch).ok());
  return field;
}

struct Field {
  std::vector<VoxelPos> places;
  World world = make_field(places);
  world::BlockShapes shapes = *world::block_shapes(*world.palette);
  std::vector<BenchRay> rays;
  std::vector<GridRay> grid_rays;
  // For Embree: each shape with each set of joins is a mesh of its own.
  EmbreeFaces ground;
  std::vector<EmbreeFaces> meshes;
  std::vector<EmbreeInstance> instances;

  explicit Field(bool quick) {
    const int width = quick ? 320 : 1280, height = quick ? 180 : 720;
    std::vector<render::Camera> cameras(2);
    cameras[0].position = world::WorldPoint::from(40.5, 60.5, 40.5);
    cameras[0].forward = glm::normalize(Vec3d(1, -0.45, 0.8));
    cameras[1].position = world::WorldPoint::from(250.3, 1.7, 30.6);
    cameras[1].forward = glm::normalize(Vec3d(0.1, -0.05, 1));
    rays = make_ray_sets(world.store.masks(MaskKind::occupied), cameras, width, height, Vec3d(0, 1, 0), 1).primary;

    for (const BenchRay& ray : rays) grid_rays.push_back(ray.grid());
    const float side = kSide;
    ground.corners = {{0, 0, 0}, {0, 0, side}, {side, 0, side}, {side, 0, 0}};
    std::map<std::pair<const Proxy*, uint8_t>, size_t> meshes_by_shape;
    for (const VoxelPos& v : places) {
      const Proxy* shape = shapes.shape[world.store.get(v)];
      const uint8_t joins = shapes.joins_at(*shape, v, [&](VoxelPos at) { return world.store.get(at); });
      const auto [mesh, added] = meshes_by_shape.try_emplace({shape, joins}, meshes.size());
      if (added) {
        meshes.emplace_back();
        for (const world::ProxyFace& face : world::proxy_faces(*shape, joins))
          meshes.back().corners.insert(meshes.back().corners.end(), std::begin(face.corner), std::end(face.corner));
      }
      instances.push_back({mesh->second, Vec3f(v.x, v.y, v.z)});
    }
  }
};

/// Casts rays through the grid, many at once; one that finds a shape and misses it walks on by itself.
/// Casting those again together, from behind the voxel, was no faster.
class ShapeCaster {
 public:
  ShapeCaster(const Field& field, const world::RayStream& stream)
      : field_(field), stream_(stream), reader_(field.world.store) {}

  /// The distances of the first hits; infinite where there is none.
  void first_hits(std::span<const GridRay> rays, std::span<double> distances) {
    hits_.resize(rays.size());
    stream_.first_set_coherent(rays, hits_);
    for (size_t i = 0; i < rays.size(); ++i)
      distances[i] = hits_[i].hit() ? on_from(rays[i], hits_[i]) : world::kInfinity;
  }

 private:
  double on_from(const GridRay& ray, const world::GridHit& hit) {
    const Proxy* shape = field_.shapes.shape[block(hit.voxel)];
    render::ProxyHit met;
    if (!shape) return hit.t;
    if (meets(*shape, ray, hit.voxel, met)) return met.t;
    const GridAxes axes(ray);
    const MaskWalker& walker = stream_.walker();
    WalkPlace place{hit.voxel, hit.t, hit.face == world::kNoFace ? -1 : world::face_axis(hit.face)};
    while (world::mask_walk::leave_cube(axes, place, 0, kFar) && walker.find(axes, place, kFar)) {
      shape = field_.shapes.shape[block(place.voxel)];
      if (!shape) return place.t;
      if (meets(*shape, ray, place.voxel, met)) return met.t;
    }
    return world::kInfinity;
  }
  bool meets(const Proxy& shape, const GridRay& ray, VoxelPos v, render::ProxyHit& met) {
    const uint8_t joins = field_.shapes.joins_at(shape, v, [&](VoxelPos at) { return block(at); });
    return render::intersect_proxy(shape, joins, ray, v, kFar, met);
  }
  BlockId block(VoxelPos v) {
    const world::LeafPos l = leaf_from_voxel(v);
    if (l != leaf_pos_) leaf_pos_ = l, leaf_ = reader_.leaf(l);
    return leaf_[index_in_leaf(v)];
  }

  const Field& field_;
  const world::RayStream& stream_;
  world::StoreReader reader_;
  world::LeafPos leaf_pos_{INT32_MAX, 0, 0};
  world::LeafBlocks leaf_{};
  std::vector<world::GridHit> hits_;
};

std::shared_ptr<Field> shared_field(BenchContext& context) {
  return context.shared<Field>("proxies/field", [&] { return std::make_shared<Field>(context.quick()); });
}
std::shared_ptr<EmbreeRays> shared_embree(BenchContext& context, const Field& field) {
  return context.shared<EmbreeRays>(
      "proxies/embree", [&] { return std::make_shared<EmbreeRays>(field.ground, field.meshes, field.instances); });
}

Result<Prepared> prepare_rays(BenchContext& context) {
  const auto field = shared_field(context);
  const auto embree = shared_embree(context, *field);
  const auto loaded = EmbreeRays::load(field->rays);
  const auto compared = std::make_shared<std::vector<BenchRay>>(sample_blocks(field->rays, 16));
  const auto stream = std::make_shared<world::RayStream>(field->world.store.masks(MaskKind::occupied));
  Prepared prepared;
  prepared.ours = {"shapes in the voxel", [=] {
                     return cast_in_parallel(field->grid_rays.size(), [&](size_t begin, size_t end) {
                       ShapeCaster caster(*field, *stream);
                       std::vector<double> distances(end - begin);
                       caster.first_hits({&field->grid_rays[begin], end - begin}, distances);
                       keep(distances[0]);
                     });
                   }};
  const auto rival = [&](const char* name, EmbreeWidth width, EmbreeHint hint) {
    prepared.rivals.push_back({name, [=] { return embree->first_hits(*loaded, width, hint); }});
  };
  rival("Embree instances, 16 wide, coherent", EmbreeWidth::sixteen, EmbreeHint::coherent);
  rival("Embree instances, 8 wide, incoherent", EmbreeWidth::eight, EmbreeHint::incoherent);
  rival("Embree instances, single rays", EmbreeWidth::one, EmbreeHint::incoherent);
  rival("Embree instances, stream of single rays", EmbreeWidth::stream, EmbreeHint::coherent);
  prepared.counters = [=] {
    const std::vector<float> theirs = embree->distances(*compared);
    std::vector<GridRay> rays;
    for (const BenchRay& ray : *compared) rays.push_back(ray.grid());
    std::vector<double> distances(rays.size());
    ShapeCaster(*field, *stream).first_hits(rays, distances);
    double same = 0;
    for (size_t i = 0; i < theirs.size(); ++i) {
      const double ours = distances[i];
      same += std::isinf(theirs[i]) ? std::isinf(ours) : std::abs(ours - theirs[i]) < 1e-3 * (1 + ours);
    }
    return std::map<std::string, double>{{"rays", static_cast<double>(field->rays.size())},
                                         {"shapes", static_cast<double>(field->places.size())},
                                         {"agree_embree", same / static_cast<double>(theirs.size())}};
  };
  return prepared;
}

std::vector<VoxelPos> free_places(const world::Store& store) {
  std::vector<VoxelPos> places;
  for (VoxelPos v{200, 0, 0}; v.z < kSide; ++v.z)
    if (store.get(v) == world::kAir) places.push_back(v);
  return places;
}

/// A fence put onto a free place, and taken away again; Embree only puts.
Result<Prepared> prepare_edit(BenchContext&) {
  struct Edited {
    Field field{true};
    int subscriber = field.world.store.subscribe();
    world::RayStream stream{field.world.store.masks(MaskKind::occupied)};
    EmbreeRays embree{field.ground, field.meshes, field.instances};
    BlockId fence = *field.world.palette->find("fence_oak");
    std::vector<VoxelPos> free = free_places(field.world.store);
    size_t ours = 0, theirs = 0;
  };
  const auto edited = std::make_shared<Edited>();
  const auto ray_at = [](VoxelPos v) { return BenchRay{v + VoxelPos{0, 5, 0}, {0.5f, 0.5f, 0.5f}, {0, -1, 0}}; };
  return Prepared{.ours = {"one block",
                           [=] {
                             Edited& e = *edited;
                             const VoxelPos v = e.free[e.ours / 2 % e.free.size()];
                             const bool puts = e.ours++ % 2 == 0;
                             world::EditBatch batch;
                             batch.set(v, puts ? e.fence : world::kAir);
                             if (!e.field.world.store.apply(batch).ok()) return std::nan("");
                             e.stream.update(e.field.world.store.take_dirty(e.subscriber));
                             const GridRay ray = ray_at(v).grid();
                             double t = 0;
                             ShapeCaster(e.field, e.stream).first_hits({&ray, 1}, {&t, 1});
                             return t == (puts ? 4.5 : 5.5) ? 1.0 : std::nan("");
                           }},
                  .rivals = {{"Embree, an instance more", [=] {
                                Edited& e = *edited;
                                const VoxelPos v = e.free[e.theirs++ % e.free.size()];
                                e.embree.place({e.field.instances[0].shape, Vec3f(v.x, v.y, v.z)});
                                const BenchRay ray = ray_at(v);
                                const float t = e.embree.distances({&ray, 1})[0];
                                return std::abs(t - 4.5f) < 1e-3f ? 1.0 : std::nan("");
                              }}}};
}

Result<Prepared> prepare_bytes(BenchContext& context) {
  const auto field = shared_field(context);
  const auto embree = shared_embree(context, *field);
  size_t shapes = 0;
  for (const Proxy& proxy : world::proxies())
    shapes +=
        sizeof(Proxy) + proxy.boxes.size() * sizeof(world::ProxyBox) + proxy.quads.size() * sizeof(world::ProxyQuad);
  const auto per_shape = [](size_t bytes) { return [=] { return static_cast<double>(bytes) / kShapes; }; };
  return Prepared{.ours = {"the shapes once", per_shape(shapes)},
                  .rivals = {{"Embree instances", per_shape(embree->bytes())}}};
}

}  // namespace

void add_suite_proxies(Registry& registry) {
  const char* const field = "a field of 512x512 m with 100,000 fences, stalks, torches and lanterns";
  const std::string origin = "nothing is built, so the grid may not be slower than a tree over instances";
  for (const int threads : {2, 1})
    registry.add({.name = threads == 2 ? "rays" : "rays_core",
                  .what = fmt::format("primary rays over {}, two cameras, 1280x720", field),
                  .unit = "M rays/s",
                  .scale = 1e6,
                  .threads = threads,
                  .reach = Reach{1, origin, true},
                  .prepare = prepare_rays});
  registry.add({.name = "edit",
                .what = fmt::format("one fence more in {}, until the first ray sees it", field),
                .unit = "us",
                .better = Better::lower,
                .timing = Timing::milliseconds,
                .scale = 1e-3,
                .threads = 1,
                .reach = Reach{5, "as any other edit of a voxel: no rebuild"},
                .prepare = prepare_edit});
  registry.add({.name = "bytes",
                .what = fmt::format("bytes for rays beside the store's, for each shape of {}", field),
                .unit = "B/shape",
                .better = Better::lower,
                .timing = Timing::reported,
                .prepare = prepare_bytes});
}

}  // namespace tools
