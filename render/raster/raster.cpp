#include "render/raster/raster.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "render/effects/samples.h"
#include "render/extract/extractor.h"
#include "render/extract/levels.h"
#include "render/extract/proxies.h"
#include "render/knob_ranges.h"
#include "render/light/shadow_voxels.h"
#include "render/raster/culling.h"
#include "render/raster/rasterizer.h"
#include "render/see_through.h"
#include "render/bsdf/bsdf.h"
#include "render/trace/geometry.h"
#include "world/proxies/proxy.h"

namespace render {

namespace {

using Clock = std::chrono::steady_clock;
double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// Whether a world has a surface that the knobs ask for in place of its cubes.
bool shows_surface(const world::Store& store, const RenderKnobs& knobs) {
  return knobs.contours != ContourShape::off && (store.find_layer(world::Layer::distance) ||
                                                 (store.find_layer(world::Layer::density) && knobs.contour_iso > 0));
}

/// View depth closer than which nothing can lie in the picture, at most 5 cm: so the near plane cuts no hole into a
/// wall that the camera touches. Depth is reversed and in float, so that a tiny near plane costs no precision.
double near_plane(const world::WorldView& view, const Camera& camera, const PixelRays& rays, bool in_shape,
                  const raster::Rasterizer& rasterizer) {
  const world::MaskVolume& occupied = view.masks(world::MaskKind::occupied);
  const bool inside = occupied.test(camera.position.voxel);
  double nearest = in_shape ? 0 : 1;
  for (int dx = -1; dx <= 1 && !rasterizer.triangles_alone; ++dx)
    for (int dy = -1; dy <= 1; ++dy)
      for (int dz = -1; dz <= 1; ++dz) {
        const world::VoxelPos step{dx, dy, dz};
        if (step == world::VoxelPos{} || (!inside && !occupied.test(camera.position.voxel + step))) continue;
        const Vec3d low = Vec3d(dx, dy, dz) - camera.position.fraction;
        nearest = std::min(nearest, glm::length(glm::max(low, glm::min(low + 1.0, Vec3d(0)))));
      }
  nearest = rasterizer.triangles().distance(camera.position, nearest);
  return std::clamp(0.5 * nearest, 0.5 * raster::kNearestFace, 0.05) / rays.longest;
}

class Raster : public RasterBackend {
 public:
  bool reads_light(const world::World&, const RenderKnobs&) const override { return true; }
  explicit Raster(const gpu::DeviceOptions& options) : options_(options) {}

  world::Status open() {
    if (rasterizer_) earlier_messages_ = messages();
    rasterizer_.reset();
    shadow_store_ = 0;
    meshes_.clear(), surface_ = {};
    TRY(rasterizer_, raster::Rasterizer::make(options_));
    return {};
  }

  world::Result<Frame> render(const world::WorldView& view, const Camera& camera, const RenderKnobs& knobs, int width,
                              int height) override {
    if (width < 1 || height < 1)
      return world::usage_error("a picture must be at least 1x1 pixel, not " + std::to_string(width) + "x" +
                                std::to_string(height));
    TRY_STATUS(check_ranges(knobs));
    TRY_STATUS(check_bsdfs(view.palette()));
    TRY_STATUS(world::check_proxies(view.palette()));
    // A lost device is made anew, with all that it held; three times in a row is a fault.
    for (int attempt = 0;; ++attempt) {
      auto frame = attempt_render(view, camera, knobs, width, height);
      if (frame.ok() || !rasterizer_ || !rasterizer_->device().lost() || attempt == 3) return frame;
      TRY_STATUS(open());
    }
  }

  std::vector<std::string> messages() const override {
    std::vector<std::string> all = earlier_messages_;
    if (rasterizer_) {
      const auto now = rasterizer_->device().messages();
      all.insert(all.end(), now.begin(), now.end());
    }
    return all;
  }
  raster::Rasterizer& rasterizer() override { return *rasterizer_; }
  void draw_bare(bool bare) override { rasterizer_->bare = bare; }

 private:
  world::Result<Frame> attempt_render(const world::WorldView& view, const Camera& camera, const RenderKnobs& asked,
                                      int width, int height) {
    const auto start = Clock::now();
    if (!rasterizer_) TRY_STATUS(open());
    // A smooth surface stands for all blocks: no faces, no layers, and no grid or map of them for shadows.
    const bool smooth = rasterizer_->triangles_alone = shows_surface(view.store(), asked);
    RenderKnobs knobs = asked;
    if (smooth) {
      knobs.transparency = Transparency::opaque, knobs.corner_occlusion = false, knobs.lod_error_px = 0;
      if (knobs.sun_shadow == SunShadow::map) knobs.sun_shadow = SunShadow::ray;
    }
    TRY_STATUS(check_light(light, knobs));
    TRY(const SkyView sky, sky_view(view, knobs, sky_light_, camera.position));
    std::vector<world::LeafPos> dirty;
    shadows_changed_ = {};
    if (!smooth) {
      TRY(dirty, follow(view, camera, knobs, width, height));
    }
    const std::span<const ExtractedChunk* const> no_faces;
    const double extract_ms = ms_since(start);
    const auto upload_start = Clock::now();
    std::vector<bool> trees;
    if (knobs.billboard_error_px > 0) trees = raster::tree_blocks(view.palette());
    TRY(uint64_t bytes, rasterizer_->set_faces(smooth ? no_faces : extractor_.chunks(), trees));
    const int levels = smooth ? 0 : levels_.count();
    rasterizer_->set_level_count(levels);
    for (int k = 1; k <= levels; ++k) {
      TRY(const uint64_t level_bytes, rasterizer_->set_level(k, levels_.level(k).chunks()));
      bytes += level_bytes;
    }
    TRY(const uint64_t shape_bytes, rasterizer_->set_shapes(smooth ? nullptr : &shapes_));
    bytes += shape_bytes;
    TRY(const uint64_t mesh_bytes, send_triangles(view, smooth, knobs));
    bytes += mesh_bytes;
    light_.follow(view, light, knobs.light_model);
    TRY(const uint64_t light_bytes, rasterizer_->light_grid().follow(rasterizer_->device(), light_));
    bytes += light_bytes;
    raster::TriangleLight& of_triangles = rasterizer_->triangle_light();
    of_triangles.binding_limit = rasterizer_->binding_limit;
    TRY(const uint64_t triangle_light_bytes,
        of_triangles.follow(rasterizer_->device(), view, light, light_.kind(), rasterizer_->triangles()));
    bytes += triangle_light_bytes;
    TRY_STATUS(
        sun_maps_.follow(view, shadows_, shadows_changed_, camera.position, knobs, sky.environment.sun_direction));
    TRY(const uint64_t map_bytes, rasterizer_->follow_sun_maps(sun_maps_));
    bytes += map_bytes;
    raster::Lighting& lighting = rasterizer_->lighting();
    lighting.binding_limit = rasterizer_->binding_limit;
    const bool maps = knobs.luminaire_shadow == LuminaireShadow::map && calls_for_trace_scene(view.world());
    const world::RayStream* spot_maps =
        maps ? &(smooth ? rays_.stream(view.store(), world::MaskKind::opaque) : shadows_.stream()) : nullptr;
    TRY(const uint64_t lighting_bytes, lighting.follow(rasterizer_->device(), view, sky, spot_maps, knobs));
    TRY_STATUS(textures_.follow(view.palette(), knobs));
    TRY(const uint64_t texture_bytes, rasterizer_->follow_textures(textures_));
    bytes += lighting_bytes + texture_bytes;
    if (!smooth &&
        (knobs.sun_shadow == SunShadow::ray || knobs.corner_occlusion || knobs.sky_rays > 0 || lighting.casts_rays())) {
      TRY(const uint64_t more, send_shadow_grid());
      bytes += more;
    } else if (shadows_changed_.any()) {
      shadow_store_ = 0;
    }
    if (!smooth && (knobs.sun_shadow == SunShadow::ray || lighting.variant().fog_shafts) &&
        sky.environment.sun_irradiance != world::Irradiance3{}) {
      const world::ParallelRays& to_sun = shadows_.parallel(sky.environment.sun_direction);
      TRY(const uint64_t more, rasterizer_->sun_heights().follow(rasterizer_->device(), to_sun));
      bytes += more;
    } else {
      TRY_STATUS(rasterizer_->sun_heights().clear(rasterizer_->device()));
    }
    raster::SunBlockers& blockers = rasterizer_->sun_blockers();
    if (smooth) {
      blockers.clear();
    } else {
      TRY(const uint64_t more, blockers.follow(rasterizer_->device(), view, shapes_, dirty, knobs));
      bytes += more;
    }
    const double upload_ms = ms_since(upload_start);
    const Shading shading(sky, view.palette());
    rasterizer_->seed = sampling.seed;
    rasterizer_->liquid_levels = !smooth && liquid_levels_.any();
    lighting.eye_above_liquid = !smooth && liquid_levels_.above_surface(camera.position);
    const double near = near_plane(
        view, camera, PixelRays(camera, width, height),
        !smooth && (shapes_.has_shape(camera.position.voxel) || liquid_levels_.at(camera.position.voxel) < kFullLevel),
        *rasterizer_);
    TRY(const std::optional<raster::MirrorPicture> mirrored,
        picture_in_mirror(view, camera, sky, shading, knobs, width, height));
    rasterizer_->mirrored = mirrored ? &*mirrored : nullptr;
    auto drawn = draw_samples(view, camera, sky, shading, knobs, near, width, height);
    rasterizer_->mirrored = nullptr;
    TRY(Frame frame, std::move(drawn));
    frame.report.passes.insert(frame.report.passes.begin(),
                               {{"extract", extract_ms, 0, 0}, {"upload", upload_ms, 0, bytes}});
    if (knobs.sun_shadow == SunShadow::map) frame.report.work.push_back({"sun_map", sun_maps_.cast()});
    if (rasterizer_->liquid_levels) frame.report.work.push_back({"liquid_levels", liquid_levels_.leaves().size()});
    if (blockers.any()) frame.report.work.push_back({"tinted_shadows", blockers.bytes()});
    frame.report.warnings = rasterizer_->device().warnings();
    for (const std::string& dropped : rasterizer_->triangles().dropped()) frame.report.warnings.push_back(dropped);
    if (!of_triangles.dropped().empty()) frame.report.warnings.push_back(of_triangles.dropped());
    if (of_triangles.bytes() > 0) frame.report.work.push_back({"triangle_light", of_triangles.bytes()});
    if (!rasterizer_->warning().empty()) frame.report.warnings.push_back(rasterizer_->warning());
    frame.report.ms = ms_since(start);
    return frame;
  }

  /// What the plane that mirrors most of the picture shows, where the knob asks for it and there is one.
  world::Result<std::optional<raster::MirrorPicture>> picture_in_mirror(const world::WorldView& view,
                                                                        const Camera& camera, const SkyView& sky,
                                                                        const Shading& shading,
                                                                        const RenderKnobs& knobs, int width,
                                                                        int height) {
    std::optional<raster::MirrorPicture> picture;
    if (knobs.reflection != Reflection::planar || knobs.transparency != Transparency::lists ||
        !(calls_for_see_through(view) || calls_for_mirrors(view)))
      return picture;
    const auto plane =
        raster::find_mirror_plane(view, rays_.stream(view.store(), world::MaskKind::occupied), camera, width, height);
    if (!plane) return picture;
    const Camera behind = raster::mirrored_camera(camera, *plane);
    const double near = near_plane(view, behind, PixelRays(behind, width, height), false, *rasterizer_);
    rasterizer_->behind = &*plane;
    const EffectPlan no_effects;
    RenderKnobs plain = knobs;
    plain.anti_aliasing = AntiAliasing::none;  // what temporal mixing remembers is the eye's picture
    auto drawn = rasterizer_->draw(view, behind, sky, shading, light_.kind(), plain, near, width, height,
                                   {.plan = no_effects, .inhabitants = inhabitants});
    rasterizer_->behind = nullptr;
    TRY(Frame frame, std::move(drawn));
    picture = raster::MirrorPicture{*plane, behind, std::move(frame.image)};
    return picture;
  }

  /// A picture a sample, averaged on the device, and its effects after the last.
  world::Result<Frame> draw_samples(const world::WorldView& view, const Camera& camera, const SkyView& sky,
                                    const Shading& shading, const RenderKnobs& knobs, double near, int width,
                                    int height) {
    TRY(const EffectPlan plan, plan_effects(view, camera, knobs, width, height));
    // A part of a picture has no last one that it could be mixed with.
    const bool alone = knobs.anti_aliasing == AntiAliasing::temporal && camera.window != PictureWindow{};
    const std::vector<glm::dvec2> shifts = sample_shifts(alone ? AntiAliasing::none : knobs.anti_aliasing, pictures_++);
    const bool fits = DeviceEffects::fits(rasterizer_->device(), plan);
    if (!fits && shifts.size() > 1)
      return world::usage_error("anti_aliasing can't be done at this size on this device; draw the picture in strips");
    const EffectPlan none;
    Frame frame;
    const auto samples = static_cast<uint32_t>(shifts.size());
    for (uint32_t sample = 0; sample < samples; ++sample) {
      TRY(Frame one,
          rasterizer_->draw(view, shifted(camera, width, height, shifts[sample]), sky, shading, light_.kind(), knobs,
                            near, width, height, {fits ? plan : none, sample, samples, inhabitants}));
      one.report.add_passes(frame.report);
      frame = std::move(one);
    }
    // Too large to be bound at once.
    if (!fits && !plan.empty()) TRY_STATUS(finish_picture(view, camera, knobs, frame));
    return frame;
  }

  /// Brings the extracted faces up to date with the store.
  /// Returns the leaves that changed.
  world::Result<std::vector<world::LeafPos>> follow(const world::WorldView& view, const Camera& camera,
                                                    const RenderKnobs& knobs, int width, int height) {
    if (view.store().identity() != store_) {
      store_ = view.store().identity();
      subscriber_ = view.store().subscribe();
      extracted_ = camera_in_cavity_ = false;
    }
    const std::vector<world::LeafPos> dirty = view.store().take_dirty(subscriber_);
    // Levels stay once a picture has needed them.
    const int levels =
        std::max(extracted_ && knobs.lod_error_px > 0 ? levels_.count() : 0, level_count(view, camera, knobs, height));
    const auto wanted = [&] {
      return ExtractKnobs{.merge_faces = knobs.merge_faces,
                          .sealed_cavities = knobs.sealed_cavities || camera_in_cavity_,
                          .skirts = levels > 0,
                          .see_through = knobs.transparency != Transparency::opaque};
    };
    // Which chunks of a level may be drawn, wherever in its chunk the camera is. A mirror's camera is elsewhere.
    const PixelRays rays(camera, width, height);
    const auto range_of = [&](int level) {
      const world::VoxelPos eye = camera.position.voxel;
      ChunkRange range{chunk_from_voxel({eye.x >> level, eye.y >> level, eye.z >> level})};
      if (level >= levels || knobs.reflection == Reflection::planar) return range;
      const double next = raster::level_distance(level + 1, rays, height, knobs.lod_error_px) * raster::kBlendBand;
      range.need = std::ldexp(next, -level) + 4 * kChunkSize;  // to the next level's chunk, twice as large
      return range;
    };
    const bool fresh = !extracted_ || shapes_.kind() != knobs.proxy_shapes;
    TRY_STATUS(fresh ? shapes_.rebuild(view, knobs.proxy_shapes) : shapes_.update(view, dirty));
    const std::vector<world::LeafPos> moved = liquid_levels_.follow(view, knobs.liquid_surface != LiquidSurface::full);
    shadows_changed_ = shadows_.follow(view, liquid_levels_, moved, rays_);
    extractor_.shapes = &shapes_;
    extractor_.levels = &liquid_levels_;
    if (fresh || !(extractor_.knobs() == wanted()))
      extractor_.rebuild(view, wanted(), range_of(0));
    else if (!dirty.empty() || !moved.empty())
      extractor_.update(view, dirty, moved);
    extractor_.follow(view, range_of(0));
    // A camera in a cavity that was left out needs its faces, now and for the pictures that follow.
    if (extractor_.in_sealed_cavity(camera.position.voxel)) {
      camera_in_cavity_ = true;
      extractor_.rebuild(view, wanted(), range_of(0));
    }
    const ExtractKnobs coarse{knobs.merge_faces, knobs.sealed_cavities, true};
    if (fresh || levels != levels_.count() || !(coarse == coarse_))
      levels_.rebuild(view, &shapes_, levels, coarse, range_of), rasterizer_->set_level_count(0);
    else
      levels_.update(view, dirty);
    levels_.follow(range_of);
    coarse_ = coarse;
    extracted_ = true;
    return dirty;
  }

  /// Levels that are drawn anywhere within the view distance and the world.
  static int level_count(const world::WorldView& view, const Camera& camera, const RenderKnobs& knobs, int height) {
    if (!(knobs.lod_error_px > 0) || view.masks(world::MaskKind::occupied).empty()) return 0;
    const PixelRays rays(camera, height, height);
    const world::MaskVolume& occupied = view.masks(world::MaskKind::occupied);
    double farthest = 0;
    for (int a = 0; a < 3; ++a) {
      const double low = world::kRegionSize * double(occupied.min_region()[a]) - camera.position.voxel[a];
      const double high = world::kRegionSize * (double(occupied.max_region()[a]) + 1) - camera.position.voxel[a];
      farthest += std::pow(std::max(std::abs(low), std::abs(high)) + 1, 2.0);
    }
    const double reach = std::min<double>(knobs.view_distance, std::sqrt(farthest));
    int levels = 0;
    while (levels < kMostLevels && raster::level_distance(levels + 1, rays, height, knobs.lod_error_px) < reach)
      ++levels;
    return levels;
  }

  /// The world's meshes and its smooth surface, where they aren't those that are there already.
  world::Result<uint64_t> send_triangles(const world::WorldView& view, bool smooth, const RenderKnobs& knobs) {
    const std::vector<world::MeshInstance>& meshes = view.world().meshes;
    const auto same = [](const world::MeshInstance& a, const world::MeshInstance& b) {
      return a.mesh == b.mesh && a.position.voxel == b.position.voxel && a.position.fraction == b.position.fraction &&
             a.transform == b.transform && a.block_id == b.block_id && a.null_surface == b.null_surface &&
             a.radiance == b.radiance && a.smooth == b.smooth && a.checker_id == b.checker_id &&
             a.checkers == b.checkers;
    };
    const SurfaceSent surface =
        smooth ? SurfaceSent{view.store().identity(), knobs.contour_mesh, knobs.contour_iso} : SurfaceSent{};
    bool edited = false;
    if (smooth) {
      if (surface.store != surface_store_) {
        surface_store_ = surface.store, surface_subscriber_ = view.store().subscribe();
        edited = true;
      }
      edited = !view.store().take_dirty(surface_subscriber_).empty() || edited;
    }
    if (!edited && surface == surface_ &&
        std::equal(meshes.begin(), meshes.end(), meshes_.begin(), meshes_.end(), same))
      return uint64_t{0};
    meshes_.clear(), surface_ = {};
    raster::TriangleList list;
    TRY_STATUS(add_meshes(view.world(), list));
    if (smooth)
      TRY_STATUS(add_smooth_surface(view, static_cast<SurfaceMethod>(knobs.contour_mesh), knobs.contour_iso, list));
    raster::DrawnTriangles& triangles = rasterizer_->triangles();
    triangles.binding_limit = rasterizer_->binding_limit;
    TRY(const uint64_t bytes, triangles.set(rasterizer_->device(), list,
                                            smooth ? "the triangles of meshes and of the smooth surface" : "meshes"));
    meshes_ = meshes, surface_ = surface;
    return bytes;
  }

  world::Result<uint64_t> send_shadow_grid() {
    raster::ShadowGrid& grid = rasterizer_->shadow_grid();
    grid.binding_limit = rasterizer_->binding_limit;
    if (shadow_store_ == store_ && !shadows_changed_.all)
      return grid.update(rasterizer_->device(), shadows_.volume(), shadows_changed_.leaves);
    shadow_store_ = 0;
    TRY(const uint64_t bytes, grid.rebuild(rasterizer_->device(), shadows_.volume()));
    shadow_store_ = store_;
    return bytes;
  }

  gpu::DeviceOptions options_;
  std::unique_ptr<raster::Rasterizer> rasterizer_;
  std::vector<std::string> earlier_messages_;  // of devices that were lost
  ShapeExtractor shapes_;
  LiquidLevels liquid_levels_;
  Extractor extractor_;
  CoarseLevels levels_;
  /// What the triangles on the device were made of.
  struct SurfaceSent {
    uint64_t store = 0;  // identity; 0: none
    ContourMesh method{};
    float iso = 0;
    friend bool operator==(const SurfaceSent&, const SurfaceSent&) = default;
  };
  std::vector<world::MeshInstance> meshes_;
  SurfaceSent surface_;
  uint64_t surface_store_ = 0;  // that surface_subscriber_ follows
  int surface_subscriber_ = 0;
  ExtractKnobs coarse_;
  SurfaceLight light_;
  ShadowVoxels shadows_;
  ShadowVoxels::Change shadows_changed_;
  SunMaps sun_maps_;
  std::shared_ptr<const world::SkyLight> sky_light_;
  TextureSet textures_;
  world::StoreRays rays_;
  uint64_t pictures_ = 0;      // so far: which points of pixels the next one looks through
  uint64_t store_ = 0;         // identity of the world that was extracted
  uint64_t shadow_store_ = 0;  // and of the one whose shadow grid is on the device; 0: none, or behind
  int subscriber_ = 0;
  bool extracted_ = false, camera_in_cavity_ = false;
};

}  // namespace

world::Result<std::unique_ptr<RasterBackend>> make_raster(const gpu::DeviceOptions& options) {
  auto backend = std::make_unique<Raster>(options);
  TRY_STATUS(backend->open());
  return std::unique_ptr<RasterBackend>(std::move(backend));
}

world::Result<std::unique_ptr<Backend>> make_raster_backend() {
  TRY(auto backend, make_raster({}));
  return std::unique_ptr<Backend>(std::move(backend));
}

}  // namespace render
