/// What pictures of a scene cost for effects that have no strength there: each effect at strength 0, against the scene
/// that has nothing of it, by each backend; and knobs of effects that are off, or that nothing in the scene calls for,
/// against those knobs as they usually are.
#include <bit>

#include <fmt/format.h>

#include "render/backend.h"
#include "render/knobs.h"
#include "tools/bench/absent.h"
#include "tools/picture.h"
#include "tools/bench/world_fill.h"
#include "tools/knob_settings.h"
#include "world/base/random.h"
#include "world/media/medium.h"

namespace tools {

namespace {

constexpr int kWidth = 192, kHeight = 108;

void add_block(world::World& w, world::Block block, world::VoxelPos low, world::VoxelPos high) {
  const auto id = w.palette->add(std::move(block));
  CHECK(id.ok());
  world::EditBatch batch;
  batch.fill({low, high}, *id);
  CHECK(w.store.apply(batch).ok());
}

world::Block of_plaster(const world::World& w, const char* name) {
  world::Block b = (*w.palette)[w.palette->find("plaster").value()];
  b.name = name;
  return b;
}
/// The plaster's place, of another block that looks the same.
constexpr world::VoxelPos kLow{24, 12, 28}, kHigh{36, 24, 36};

/// Steps of granite around a block of plaster, under sun and sky. The plaster has a name of its own, as what stands in
/// its place does: textures go by names, and would tell the two apart.
std::shared_ptr<world::World> plain_world() {
  auto made = std::make_shared<world::World>(world::standard_blocks());
  for (int i = 0; i < 12; ++i) fill_block(*made, {{2 * i, 0, 2 * i}, {63 - 2 * i, i, 63 - i}}, "granite");
  add_block(*made, of_plaster(*made, "bare_plaster"), kLow, kHigh);
  return made;
}

render::Camera camera_of_plain() {
  render::Camera camera;
  camera.position = world::WorldPoint::from(88, 40, 92);
  camera.forward = glm::normalize(world::Vec3d(-58, -30, -62));
  return camera;
}

/// One effect at strength 0: a change of the plain world that must change nothing.
struct Zero {
  const char* effect;
  const char* what;
  void (*put)(world::World&);
  std::vector<std::string> backends{"raster", "raycast", "reference"};
};

world::Luminaire dark(const char* kind) {
  world::Luminaire l;
  l.name = l.kind = kind;
  l.position = world::WorldPoint::from(30, 40, 30);
  l.radius = 1;
  return l;
}

const Zero kZeros[] = {
    {"luminaires", "an omni, a disk and a directional of power 0",
     [](world::World& w) {
       for (const char* kind : {"omni", "disk", "directional"}) w.luminaires.push_back(dark(kind));
     }},
    {"luminaires_off", "a sphere of 1 kW that is switched off",
     [](world::World& w) {
       w.luminaires.push_back(dark("sphere"));
       w.luminaires.back().power = {1000, 1000, 1000};
       w.luminaires.back().enabled = false;
     }},
    {"media", "a homogeneous fog of density 0",
     [](world::World& w) {
       world::Medium m;
       m.name = m.kind = "homogeneous";
       w.media.push_back(m);
     }},
    {"glossy", "plaster with a glossy lobe of 0",
     [](world::World& w) {
       world::Block b = of_plaster(w, "unglossed");
       b.bsdf = "blinn_phong", b.glossy = {};
       add_block(w, b, kLow, kHigh);
     }},
    {"block_light", "plaster that glows with 0 W",
     [](world::World& w) {
       world::Block b = of_plaster(w, "unlit_lamp");
       b.emission = {};
       add_block(w, b, kLow, kHigh);
     }},
    {"proxies", "a palette with fences, and no fence",
     [](world::World& w) {
       world::Block b = of_plaster(w, "unused_fence");
       b.proxy = "fence", b.opaque = false;
       CHECK(w.palette->add(b).ok());
     }},
    {"transmission", "a palette with glass, and no glass",
     [](world::World& w) {
       world::Block b = of_plaster(w, "unused_glass");
       b.bsdf = "thin", b.opaque = false, b.transmission = {0.5f, 0.4f, 0.3f}, b.albedo = {0.1f, 0.1f, 0.1f};
       CHECK(w.palette->add(b).ok());
     }},
    {"particles", "a source of rain of 0 drops a second",
     [](world::World& w) {
       world::ParticleSource rain;
       rain.kind = "rain", rain.box = {{0, 60, 0}, {63, 60, 63}};
       w.simulation.particles.push_back(rain);
     }},
    {"clouds", "a layer of clouds that covers none of the sky",
     [](world::World& w) {
       w.environment.clouds.height = 50, w.environment.clouds.extinction = 1, w.environment.clouds.seed = 7;
     }},
    {"meshes",
     "a null surface that holds no medium",
     [](world::World& w) {
       world::TriangleMesh mesh;
       mesh.positions = {{0, 0, 0}, {60, 0, 0}, {0, 60, 0}};
       mesh.triangles = {{0, 1, 2}};
       world::MeshInstance instance;
       instance.name = "pane";
       instance.mesh = std::make_shared<const world::TriangleMesh>(std::move(mesh));
       instance.position = world::WorldPoint::from(10, 5, 50);
       instance.null_surface = true;
       w.meshes.push_back(instance);
     },
     {"raster", "raycast"}},  // paths pass it
};

/// Knobs that must change nothing of the plain world's picture.
struct Idle {
  const char* effect;  // as reports name its passes and its work
  const char* what;
  std::vector<std::string> backends, settings;
};

const Idle kIdles[] = {
    {"bloom",
     "a wide bloom in full of strength 0",
     {"raster", "raycast"},
     {"bloom=0", "bloom_radius=0.2", "bloom_threshold=0.1", "bloom_levels=0"}},
    {"lens_flare",
     "a flare of the sun, which is behind the camera",
     {"raster", "raycast"},
     {"lens_flare=2", "lens_flare_blades=8"}},
    {"grain", "grain of another seed, of strength 0", {"raster", "raycast"}, {"grain=0", "grain_seed=7"}},
    {"exposure", "the key of an automatic exposure that is off", {"raster", "raycast"}, {"exposure_key=0.5"}},
    {"transparency",
     "traced refraction and reflection where nothing is see-through",
     {"raster"},
     {"transparency=lists", "refraction=traced", "reflection=traced", "coverage_pattern=hashed"}},
    {"fog", "512 steps through fog that is not there", {"raster"}, {"fog_steps=512"}},
    {"spot_maps",
     "maps of 1024 texels of spots that are not there",
     {"raster"},
     {"luminaire_shadow=map", "spot_map_texels=1024", "luminaire_cutoff=0"}},
    {"sun_map",
     "the finest map of the sun, whose shadow is cast by rays",
     {"raster", "raycast"},
     {"sun_map_texel=0.25", "sun_map_filter=5", "sun_map_cascades=8", "sun_cascade_texels=4096"}},
    {"tinted_shadows",
     "what see-through blocks and shapes take of the sun's light, where there are none",
     {"raster", "raycast"},
     {"tinted_shadows=true"}},
    {"flux",
     "flux at its finest, in a world lit by the sky alone",
     {"raster", "raycast"},
     {"flux_directions=128", "flux_lamp_points=16", "flux_residual=1e-4"}},
    {"sky_rays", "a far occlusion that no ray asks for", {"raster"}, {"occlusion_distance=1e9"}},
    {"impostors", "impostors of what is near", {"raster"}, {"impostor_error_px=8"}},
    {"billboards", "billboard clouds where there is no tree", {"raster"}, {"billboard_error_px=8"}},
    {"heightfields", "grids of heights of what is near", {"raster"}, {"heightfield_error_px=0.1"}},
    {"particles", "a long shutter where nothing is in the air", {"raster", "raycast"}, {"shutter=0.1"}},
    {"proxies", "shapes as cubes where no block has a shape", {"raster", "raycast"}, {"proxy_shapes=cube"}},
    {"liquid_levels", "full liquids as high as they are full", {"raster", "raycast"}, {"liquid_surface=full"}},
    {"contours", "the exact surface of a level set that is not there", {"raycast"}, {"contours=field"}},
    {"photons", "photons of a transport that follows none", {"raycast"}, {"photons=400000", "photon_radius=0.5"}},
    {"clouds",
     "64 places along rays through clouds that are not there, 16 to the sun",
     {"raster", "raycast"},
     {"cloud_steps=64", "cloud_light_steps=16", "cloud_shadows=true"}},
    {"time_of_day",
     "the place and the air of a sky that has no time of day",
     {"raster", "raycast"},
     {"latitude=10", "day_of_year=30", "turbidity=8", "moon=false"}},
};

/// The work that reports name after the effect.
AbsentRun run_of(const render::Frame& frame, const std::string& effect) {
  AbsentRun run;
  for (const render::Rgb& c : frame.image.pixels)
    for (const float band : {c.r, c.g, c.b}) run.hash = world::hash_combine(run.hash, std::bit_cast<uint32_t>(band));
  run.counters["rays"] = frame.report.rays;
  run.counters["faces"] = frame.report.faces_drawn;
  run.counters["passes"] = frame.report.passes.size();
  for (const render::PassReport& pass : frame.report.passes) {
    run.counters["draws of " + pass.name] += pass.draws;
    if (pass.name == effect) ++run.passes, run.bytes += pass.bytes;
  }
  for (const render::EffectWork& work : frame.report.work) {
    run.counters["work of " + work.name] += work.work;
    if (work.name == effect) run.passes += work.work;
  }
  return run;
}

struct Drawn {
  std::shared_ptr<world::World> world;
  std::shared_ptr<render::Backend> backend;
  render::RenderKnobs knobs;
  std::string effect;
  Result<AbsentRun> operator()() const {
    const world::WorldView view(*world);
    TRY(const render::Frame frame, backend->render(view, camera_of_plain(), knobs, kWidth, kHeight));
    return run_of(frame, effect);
  }
};

}  // namespace

void add_absent_pictures(std::vector<AbsentCase>& cases) {
  // The plain world twice, by the same backend; `change` is made to the second.
  const auto add = [&](const std::string& backend, const char* infix, const char* effect, const char* what,
                       const std::function<Status(Drawn&)>& change) {
    cases.push_back({fmt::format("{}_{}{}", backend, infix, effect), fmt::format("{}, by {}", what, backend),
                     [=](BenchContext&) -> Result<AbsentCase::Pair> {
                       Drawn without{plain_world(), nullptr, {}, effect}, with{plain_world(), nullptr, {}, effect};
                       TRY_STATUS(change(with));
                       for (Drawn* drawn : {&without, &with}) {
                         TRY(drawn->backend, make_backend(backend));
                         if (backend == "reference") drawn->knobs.spp = 2;
                       }
                       return AbsentCase::Pair{without, with};
                     }});
  };
  for (const Zero& zero : kZeros)
    for (const std::string& backend : zero.backends)
      add(backend, "", zero.effect, zero.what, [&zero](Drawn& with) {
        zero.put(*with.world);
        return Status{};
      });
  for (const Idle& idle : kIdles)
    for (const std::string& backend : idle.backends)
      add(backend, "idle_", idle.effect, idle.what,
          [&idle](Drawn& with) { return set_knobs(render::render_knobs(), with.knobs, idle.settings); });
}

}  // namespace tools
