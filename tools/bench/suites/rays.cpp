/// The ray caster on the valley, from all of its cameras: casting alone, against those who cast the same rays; what an
/// edit and the structure cost; and whole pictures.
#include <bit>
#include <cmath>

#include <fmt/format.h>

#include "render/raycast/raycast.h"
#include "tools/bench/benchmark.h"
#include "tools/bench/ray_sets.h"
#include "tools/bench/rivals/embree_rays.h"
#include "tools/bench/rivals/nanovdb_rays.h"
#include "tools/bench/rivals/openvdb_rays.h"
#include "tools/bench/world_copy.h"
#include "world/scenes/scene.h"
#include "world/store/parallel_rays.h"
#include "world/store/ray_stream.h"

namespace tools {

namespace {

using render::Camera;
using world::BlockId;
using world::GridHit;
using world::GridRay;
using world::LeafPos;
using world::MaskKind;
using world::MaskVolume;
using world::Store;
using world::StreamRay;
using world::VoxelPos;
using world::World;

/// Ours, as all rows below use it: to measure another caster, change this class.
class Caster {
 public:
  /// Builds what casting needs from the store's blocks.
  explicit Caster(const Store& store) : stream_(store.masks(MaskKind::occupied)) {}
  /// Follows an edit of these leaves.
  void update(std::span<const LeafPos> dirty) { stream_.update(dirty); }
  /// `coherent`: each 64 in a row are pixels of a tile.
  void first_hits(std::span<const StreamRay> rays, std::span<GridHit> hits, bool coherent) const {
    if (coherent)
      stream_.first_set_coherent(rays, hits);
    else
      stream_.first_set(rays, hits);
  }
  /// Shadow rays of one sun.
  std::shared_ptr<const world::ParallelRays> sun(const world::Vec3d& direction) const {
    return std::make_shared<world::ParallelRays>(stream_, direction);
  }
  size_t bytes() const { return stream_.bricks().bytes(); }

 private:
  world::RayStream stream_;
};

/// What the rows of one run share.
struct Input {
  const World* world = nullptr;
  std::vector<Camera> cameras;
  int width = 1280, height = 720;

  const MaskVolume& occupied() const { return world->store.masks(MaskKind::occupied); }
};

Result<std::shared_ptr<Input>> make_input(BenchContext& context) {
  auto input = std::make_shared<Input>();
  TRY(input->world, context.world("valley"));
  for (const world::CameraPlacement& placement : input->world->cameras)
    input->cameras.push_back(Camera::from(placement));
  if (context.quick()) input->width = 320, input->height = 180;
  return input;
}

// ---- casting alone ----

/// shadow_again: the sun has not moved since the last pass.
enum class Rays { primary, diffuse, shadow, shadow_again };
bool is_shadow(Rays kind) { return kind == Rays::shadow || kind == Rays::shadow_again; }

/// The slow rivals cast every so many blocks of the rays.
constexpr size_t kSlowShare = 8;
/// Answers are compared on every so many.
constexpr size_t kComparedShare = 64;

/// One kind of rays, in the form each contender wants.
struct CastInput {
  std::shared_ptr<Input> input;
  Rays kind = Rays::primary;
  std::vector<StreamRay> rays;
  std::vector<BenchRay> slow, compared;
  std::shared_ptr<const EmbreeRays::Loaded> loaded;
  std::shared_ptr<Caster> ours;
  std::shared_ptr<const world::ParallelRays> kept_sun;  // of shadow_again
  std::shared_ptr<EmbreeRays> embree;
  std::shared_ptr<NanoVdbRays> nanovdb;
  std::shared_ptr<OpenVdbRays> openvdb;
};

Result<std::shared_ptr<CastInput>> make_cast_input(BenchContext& context, Rays kind) {
  auto cast = std::make_shared<CastInput>();
  TRY(cast->input, make_input(context));
  const Input& input = *cast->input;
  const auto sets = context.shared<RaySets>("rays/sets", [&] {
    return std::make_shared<RaySets>(make_ray_sets(input.occupied(), input.cameras, input.width, input.height,
                                                   input.world->environment.sun_direction, context.seed()));
  });
  cast->kind = kind;
  const std::vector<BenchRay>& rays = kind == Rays::primary   ? sets->primary
                                      : kind == Rays::diffuse ? sets->diffuse
                                                              : sets->shadow;
  for (const BenchRay& ray : rays) cast->rays.push_back(ray.stream());
  cast->slow = sample_blocks(rays, kSlowShare);
  cast->compared = sample_blocks(rays, kComparedShare);
  cast->loaded = EmbreeRays::load(rays);
  cast->ours = context.shared<Caster>("rays/ours", [&] { return std::make_shared<Caster>(input.world->store); });
  if (kind == Rays::shadow_again) cast->kept_sun = cast->ours->sun(world::Vec3d(cast->rays[0].direction));
  cast->embree = context.shared<EmbreeRays>("rays/embree", [&] {
    return std::make_shared<EmbreeRays>(embree_faces(*input.world), EmbreeShape::triangles, EmbreeQuality::medium);
  });
  cast->nanovdb =
      context.shared<NanoVdbRays>("rays/nanovdb", [&] { return std::make_shared<NanoVdbRays>(input.occupied()); });
  cast->openvdb =
      context.shared<OpenVdbRays>("rays/openvdb", [&] { return std::make_shared<OpenVdbRays>(input.occupied()); });
  return cast;
}

double cast_ours(const CastInput& cast) {
  // What rays of one direction share is made within the time, unless the row says that it is kept.
  const auto sun = cast.kind == Rays::shadow ? cast.ours->sun(world::Vec3d(cast.rays[0].direction)) : cast.kept_sun;
  return cast_in_parallel(cast.rays.size(), [&](size_t begin, size_t end) {
    const std::span rays(&cast.rays[begin], end - begin);
    if (sun) {
      thread_local std::vector<uint8_t> blocked(kRaysAtOnce);
      sun->any_set(rays, {blocked.data(), rays.size()});
      keep(blocked[0]);
    } else {
      thread_local std::vector<GridHit> hits(kRaysAtOnce);
      cast.ours->first_hits(rays, {hits.data(), rays.size()}, cast.kind == Rays::primary);
      keep(hits[0]);
    }
  });
}

/// What the definition of a hit, one voxel a step, says of the compared rays.
std::vector<GridHit> exact_hits(const CastInput& cast) {
  const MaskVolume& occupied = cast.input->occupied();
  std::vector<GridHit> hits(cast.compared.size());
  cast_in_parallel(hits.size(), [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      GridRay ray = cast.compared[i].grid();
      ray.t_max = 2000;  // more than the valley's diagonal
      hits[i] = world::first_hit_flat(ray, [&](VoxelPos v) { return occupied.test(v); });
    }
  });
  return hits;
}

Status check_ours(const CastInput& cast) {
  const std::vector<GridHit> exact = exact_hits(cast);
  std::vector<StreamRay> rays;
  for (const BenchRay& ray : cast.compared) rays.push_back(ray.stream());
  std::vector<GridHit> hits(rays.size());
  std::vector<uint8_t> blocked(rays.size());
  const bool any = is_shadow(cast.kind);
  if (any)
    cast.ours->sun(world::Vec3d(rays[0].direction))->any_set(rays, blocked);
  else
    cast.ours->first_hits(rays, hits, cast.kind == Rays::primary);
  size_t different = 0;
  for (size_t i = 0; i < exact.size(); ++i) {
    const GridHit &a = exact[i], &b = hits[i];
    different += any ? a.hit() != (blocked[i] != 0)
                     : a.hit() != b.hit() || (a.hit() && (a.voxel != b.voxel || a.face != b.face || a.t != b.t));
  }
  if (different == 0) return {};
  return world::Error{world::ErrorKind::comparison,
                      fmt::format("{} of {} rays differ from the voxel by voxel walk", different, exact.size())};
}

std::map<std::string, double> count_agreement(const CastInput& cast) {
  const std::vector<GridHit> exact = exact_hits(cast);
  const auto agreement = [&](const std::vector<RayAnswer>& answers) {
    double same = 0;
    for (size_t i = 0; i < exact.size(); ++i) same += answers[i] == RayAnswer{exact[i].hit(), exact[i].voxel};
    return same / static_cast<double>(exact.size());
  };
  return {{"rays", static_cast<double>(cast.rays.size())},
          {"agree_embree", agreement(cast.embree->answers(cast.compared))},
          {"agree_nanovdb", agreement(cast.nanovdb->answers(cast.compared))},
          {"agree_nanovdb_stock", agreement(cast.nanovdb->stock_answers(cast.compared))},
          {"agree_openvdb", agreement(cast.openvdb->answers(cast.compared))}};
}

Result<Prepared> prepare_cast(BenchContext& context, Rays kind) {
  TRY(const std::shared_ptr<CastInput> cast, make_cast_input(context, kind));
  const bool any = is_shadow(kind);
  Prepared prepared{.ours = {"loam", [=] { return cast_ours(*cast); }}};
  const auto embree = [&](const char* name, EmbreeWidth width, EmbreeHint hint) {
    prepared.rivals.push_back({name, [=] {
                                 return any ? cast->embree->any_hits(*cast->loaded, width, hint)
                                            : cast->embree->first_hits(*cast->loaded, width, hint);
                               }});
  };
  const auto coherent = EmbreeHint::coherent, incoherent = EmbreeHint::incoherent;
  if (kind != Rays::diffuse) embree("Embree, 16 wide, coherent", EmbreeWidth::sixteen, coherent);
  embree("Embree, 16 wide, incoherent", EmbreeWidth::sixteen, incoherent);
  embree("Embree, 8 wide, incoherent", EmbreeWidth::eight, incoherent);
  embree("Embree, single rays", EmbreeWidth::one, incoherent);
  embree("Embree, stream of single rays", EmbreeWidth::stream, kind == Rays::primary ? coherent : incoherent);
  prepared.rivals.push_back({"NanoVDB, HDDA", [=] { return cast->nanovdb->first_hits(cast->slow); }});
  prepared.rivals.push_back(
      {"NanoVDB, HDDA as it comes (skips voxels)", [=] { return cast->nanovdb->stock_first_hits(cast->slow); }});
  prepared.rivals.push_back({"OpenVDB, VolumeRayIntersector", [=] { return cast->openvdb->first_hits(cast->slow); }});
  prepared.counters = [=] { return count_agreement(*cast); };
  prepared.check = [=] { return check_ours(*cast); };
  return prepared;
}

// ---- edits and the structure ----

/// The 256^3 voxels in the middle of the valley, edited at 64 places of its surface in turn: dug, then filled again.
struct EditedWorld {
  World world;
  int subscriber;
  Caster caster;
  render::Extractor extractor;
  std::vector<VoxelPos> surface;
  size_t turn = 0;

  explicit EditedWorld(const World& from)
      : world(copy_regions(from, {-1, INT32_MIN, -1}, {0, INT32_MAX, 0})),
        subscriber(world.store.subscribe()),
        caster(world.store) {
    const world::VoxelBox box = world.store.bounds();
    for (int i = 0; i < 64; ++i) {
      VoxelPos v{box.min.x + 17 + i * 37 % 220, box.max.y, box.min.z + 11 + i * 91 % 220};
      while (v.y > box.min.y && world.store.get(v) == world::kAir) --v.y;
      surface.push_back(v);
    }
  }
  bool filling() const { return turn / surface.size() % 2 == 1; }
  /// Writes the next voxel and returns a ray that meets it, or when it is dug the one below, from above.
  BenchRay edit() {
    const VoxelPos v = surface[turn % surface.size()];
    world::EditBatch batch;
    batch.set(v, filling() ? BlockId{1} : world::kAir);
    const auto applied = world.store.apply(batch);
    CHECK(applied.ok() && applied->voxels_changed == 1);
    return {v + VoxelPos{0, 9, 0}, {0.5f, 0.5f, 0.5f}, {0, -1, 0}};
  }
  /// Whether the ray of edit() was answered as the voxel now is. Ends the turn.
  bool right(const RayAnswer& answer) {
    const VoxelPos v = surface[turn % surface.size()];
    const bool is_right = answer.hit && (filling() ? answer.voxel == v : answer.voxel.y < v.y);
    ++turn;
    return is_right;
  }
};

Result<Prepared> prepare_edit(BenchContext& context) {
  TRY(const World* valley, context.world("valley"));
  const auto ours = std::make_shared<EditedWorld>(*valley), theirs = std::make_shared<EditedWorld>(*valley);
  theirs->extractor.rebuild(world::WorldView(theirs->world), {});
  const auto embree = std::make_shared<EmbreeChunks>(theirs->extractor);
  return Prepared{.ours = {"loam",
                           [=] {
                             const BenchRay ray = ours->edit();
                             ours->caster.update(ours->world.store.take_dirty(ours->subscriber));
                             const StreamRay stream_ray = ray.stream();
                             GridHit hit;
                             ours->caster.first_hits({&stream_ray, 1}, {&hit, 1}, false);
                             return ours->right({hit.hit(), hit.voxel}) ? 1 : std::nan("");
                           }},
                  .rivals = {{"Embree, the chunk's faces and tree anew", [=] {
                                const BenchRay ray = theirs->edit();
                                const auto dirty = theirs->world.store.take_dirty(theirs->subscriber);
                                theirs->extractor.update(world::WorldView(theirs->world), dirty);
                                embree->update(theirs->extractor);
                                return theirs->right(embree->first_hit(ray)) ? 1 : std::nan("");
                              }}}};
}

/// A copy of the valley of which nothing is derived yet.
struct FreshWorld {
  std::unique_ptr<World> world;
  void copy(const World& from) {
    world = std::make_unique<World>(
        copy_regions(from, {INT32_MIN, INT32_MIN, INT32_MIN}, {INT32_MAX, INT32_MAX, INT32_MAX}));
  }
};

Result<Prepared> prepare_build(BenchContext& context) {
  TRY(const std::shared_ptr<Input> input, make_input(context));
  const auto fresh = std::make_shared<FreshWorld>();
  const auto faces = context.shared<EmbreeFaces>(
      "rays/faces", [&] { return std::make_shared<EmbreeFaces>(embree_faces(*input->world)); });
  const auto built = [](auto make) {
    return [=] {
      keep(make());
      return 1.0;
    };
  };
  return Prepared{
      .ours = {"loam", built([=] { return Caster(fresh->world->store).bytes(); }), [=] { fresh->copy(*input->world); }},
      .rivals = {{"Embree, medium quality, faces given",
                  built([=] { return EmbreeRays(*faces, EmbreeShape::triangles, EmbreeQuality::medium).bytes(); })},
                 {"Embree, high quality, faces given",
                  built([=] { return EmbreeRays(*faces, EmbreeShape::triangles, EmbreeQuality::high).bytes(); })},
                 {"NanoVDB, masks given", built([=] { return NanoVdbRays(input->occupied()).bytes(); })}},
      .counters = [=] {
        return std::map<std::string, double>{{"embree_quads", static_cast<double>(faces->corners.size() / 4)}};
      }};
}

Result<Prepared> prepare_bytes(BenchContext& context) {
  TRY(const std::shared_ptr<CastInput> cast, make_cast_input(context, Rays::primary));
  double voxels = 0;
  for (const world::MaskRegion* region : cast->input->occupied().regions())
    for (int g = 0; g < 64; ++g) voxels += world::kLeafVoxels * std::popcount(region->any[g] & ~region->full[g]);
  const auto per_voxel = [=](size_t bytes) { return [=] { return static_cast<double>(bytes) / voxels; }; };
  return Prepared{.ours = {"loam", per_voxel(cast->ours->bytes())},
                  .rivals = {{"NanoVDB, value masks", per_voxel(cast->nanovdb->bytes())},
                             {"Embree, triangles", per_voxel(cast->embree->bytes())}},
                  .counters = [=] {
                    return std::map<std::string, double>{{"voxels", voxels}};
                  }};
}

// ---- pictures ----

struct Pictures {
  std::shared_ptr<Input> input;
  std::unique_ptr<render::Backend> backend;

  /// Draws all cameras; returns the rays cast, NaN where a picture failed.
  double draw(render::SunShadow shadow) {
    render::RenderKnobs knobs;
    knobs.sun_shadow = shadow;
    const world::WorldView view(*input->world);
    double rays = 0;
    for (const Camera& camera : input->cameras) {
      const Result<render::Frame> frame = backend->render(view, camera, knobs, input->width, input->height);
      if (!frame.ok()) return std::nan("");
      rays += static_cast<double>(frame.value().report.rays);
    }
    return rays;
  }
};

Result<Prepared> prepare_picture(BenchContext& context, render::SunShadow shadow) {
  const auto pictures = std::make_shared<Pictures>();
  TRY(pictures->input, make_input(context));
  TRY(pictures->backend, render::make_raycast_backend());
  return Prepared{
      .ours = {"loam", [=] { return pictures->draw(shadow); }},
      .counters =
          [=] {
            return std::map<std::string, double>{{"rays", pictures->draw(shadow)}};
          },
  };
}

}  // namespace

void add_suite_rays(Registry& registry) {
  const char* const table = "so much better than the best known casters, run here";
  const auto add_cast = [&](const std::string& name, const char* what, Rays kind, double times, const char* origin,
                            Reach aim, Reach aim_a_core) {
    const auto prepare = [kind](BenchContext& context) { return prepare_cast(context, kind); };
    registry.add({.name = name,
                  .what = fmt::format("{}, rays given, hits out, 1280x720 from each of the valley's cameras", what),
                  .unit = "M rays/s",
                  .scale = 1e6,
                  .threads = 2,
                  .reach = Reach{times, origin, true},
                  .limit = std::move(aim),
                  .prepare = prepare});
    registry.add({.name = name + "_core",
                  .what = fmt::format("{}, the same on one thread", what),
                  .unit = "M rays/s",
                  .scale = 1e6,
                  .threads = 1,
                  .reach = Reach{times, origin, true},
                  .limit = std::move(aim_a_core),
                  .prepare = prepare});
  };
  const std::string estimate = "the aim; an estimate of cycles a packet step, in anchors.md";
  add_cast("primary", "primary rays", Rays::primary, 2, table,
           {61, "the aim; Laine, Karras 2010 on a GTX 285: the chapter's scene of 14.7.2"}, {45, estimate});
  add_cast("diffuse", "one cosine-distributed ray from each primary hit", Rays::diffuse, 3, table,
           {42, "the aim, twice that of a core"}, {21, estimate});
  add_cast("shadow", "one ray to the sun from each face turned to it, whether anything is hit; the sun moves each time",
           Rays::shadow, 3, table, {90, "twice the limit of primary rays on a core"}, {45, "as primary rays"});
  add_cast("shadow_again", "the same rays where the sun stays", Rays::shadow_again, 3, table,
           {90, "twice the limit of primary rays on a core"}, {45, "as primary rays"});
  registry.add({.name = "edit_to_ray",
                .what = "one voxel of the surface dug or filled, until the first ray sees it; no rebuild",
                .unit = "us",
                .better = Better::lower,
                .timing = Timing::milliseconds,
                .scale = 1e-3,
                .threads = 1,
                .reach = Reach{5, "an edit between two frames must cost nothing that shows: a leaf or two, no rebuild"},
                .prepare = prepare_edit});
  registry.add({.name = "build",
                .what = "the structure that rays walk, of the whole valley, from the store's blocks",
                .unit = "ms",
                .better = Better::lower,
                .timing = Timing::milliseconds,
                .threads = 2,
                .repetitions = 3,
                .reach = Reach{1000, "less than making the world takes"},
                .prepare = prepare_build});
  registry.add({.name = "bytes",
                .what = "bytes of that structure for each voxel of a leaf that is neither empty nor full",
                .unit = "B/voxel",
                .better = Better::lower,
                .timing = Timing::reported,
                .reach = Reach{0.3, "NanoVDB's value masks, the smallest of the rivals, have 0.257 a solid voxel"},
                .prepare = prepare_bytes});

  const char* const cameras = "1280x720 from each of the valley's cameras";
  registry.add(
      {.name = "picture",
       .what = fmt::format("pictures without shadows, {}", cameras),
       .unit = "M rays/s",
       .scale = 1e6,
       .threads = 2,
       .reach = Reach{4, "the aim for a scalar walk: primary rays on the 1024x256x1024 valley, 2 threads, scalar"},
       .prepare = [](BenchContext& context) { return prepare_picture(context, render::SunShadow::none); }});
  registry.add({.name = "picture_core",
                .what = fmt::format("the same on one thread, {}", cameras),
                .unit = "M rays/s",
                .scale = 1e6,
                .threads = 1,
                .prepare = [](BenchContext& context) { return prepare_picture(context, render::SunShadow::none); }});
  registry.add({.name = "picture_and_sun",
                .what = fmt::format("pictures with the sun's shadow, all rays counted, {}", cameras),
                .unit = "M rays/s",
                .scale = 1e6,
                .threads = 2,
                .prepare = [](BenchContext& context) { return prepare_picture(context, render::SunShadow::ray); }});
}

}  // namespace tools
