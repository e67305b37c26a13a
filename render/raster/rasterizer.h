/// Draws a world's visible faces with Vulkan, headless: keeps the device, the shared targets, what is bound and the
/// order of the passes (pass.h); the passes do the rest. The backend in raster.h feeds it.
#pragma once

#include <memory>
#include <optional>

#include "render/effects/device_chain.h"
#include "render/light/sun_maps.h"
#include "render/raster/light_grid.h"
#include "render/textures/texture_set.h"
#include "render/raster/pass.h"
#include "render/raster/shadow_grid.h"
#include "render/raster/sun_blockers.h"
#include "render/raster/sun_heights.h"
#include "render/raster/triangle_light.h"
#include "render/raster/tree_pool.h"

namespace render::raster {

/// What becomes of a picture once it is shaded: it is one of several that are averaged, then gets its effects. Only the
/// last of them has an image.
struct Finish {
  const EffectPlan& plan;
  uint32_t sample = 0, samples = 1;
  Inhabitants inhabitants{};
};

class Rasterizer {
 public:
  static world::Result<std::unique_ptr<Rasterizer>> make(const gpu::DeviceOptions& options);

  /// Follows the extractor. Returns the bytes sent. trees: blocks whose faces billboards may stand for; empty: none.
  world::Result<uint64_t> set_faces(std::span<const ExtractedChunk* const> chunks, const std::vector<bool>& trees);
  /// The same of a coarser level; those beyond `levels` go.
  world::Result<uint64_t> set_level(int level, std::span<const ExtractedChunk* const> chunks);
  void set_level_count(int levels);
  /// The same of shapes, which must live until the picture is drawn; null: none.
  world::Result<uint64_t> set_shapes(const ShapeExtractor* shapes);
  /// near: view depth in metres closer than which nothing lies in the picture.
  world::Result<Frame> draw(const world::WorldView& view, const Camera& camera, const SkyView& sky,
                            const Shading& shading, SurfaceLight::Kind light, const RenderKnobs& knobs, double near,
                            int width, int height, const Finish& finish);

  /// Used where casts_rays(), and for corner_occlusion.
  ShadowGrid& shadow_grid() { return shadow_grid_; }
  LightGrid& light_grid() { return light_grid_; }
  SunHeights& sun_heights() { return sun_heights_; }
  SunBlockers& sun_blockers() { return sun_blockers_; }
  /// Sends the sun's maps, or what of them is new, where they have a new version. Returns the bytes sent.
  world::Result<uint64_t> follow_sun_maps(const SunMaps& maps);
  /// Luminaires, media and how blocks scatter, where the world calls for them. Followed before draw().
  Lighting& lighting() { return lighting_; }
  /// Triangles beside the faces: those of the world's meshes, and of its smooth surface.
  DrawnTriangles& triangles() { return triangles_; }
  const DrawnTriangles& triangles() const { return triangles_; }
  /// The world's light on them.
  TriangleLight& triangle_light() { return triangle_light_; }
  /// Sends the texels where they have a new version. Returns the bytes sent.
  world::Result<uint64_t> follow_textures(const TextureSet& textures);
  /// Of the numbers by which lights are sampled.
  uint64_t seed = 1;
  /// Bytes that one storage buffer binding may reach, at most the device's; tests lower it.
  uint64_t binding_limit = ~uint64_t{0};
  /// Bytes that impostors may take; tests lower it.
  uint64_t impostor_bytes = uint64_t{128} << 20;
  /// Pictures are the triangles of what is seen in a constant colour, by the device's own edges, and nothing else: what
  /// a benchmark holds others against.
  bool bare = false;
  /// Triangles stand for the voxels, of which there are no faces: rays to lights meet nothing else.
  bool triangles_alone = false;
  /// Some liquid ends within its voxel: faces may be parts (render/extract/face_record.shared.h).
  bool liquid_levels = false;
  /// Faces of cubes may be drawn by dispatches (face_blocks.h): tests say no.
  bool may_list_faces = true;
  /// The report says how many pixels cast a ray to the sun: sun_rays.
  bool counts_sun_rays = false;
  /// What is outlined in the picture.
  std::optional<Selection> selected;
  /// Pictures taken from behind a mirror are shaded whole, not only where they may be seen: for tests.
  bool whole_mirror = false;
  /// Of the next draw(): see Drawing.
  const MirrorPlane* behind = nullptr;
  const MirrorPicture* mirrored = nullptr;

  /// What of the last picture is not as the knobs ask, since the device can't; empty: nothing.
  const std::string& warning() const { return warning_; }

  /// Into how many pieces passes over the picture are cut.
  gpu::TimeSlices& slices() { return slices_; }
  gpu::Device& device() { return *device_; }
  FacePool& pool() { return *levels_[0]; }

 private:
  struct Stage {                 // of pass_kinds(), in order
    std::unique_ptr<Pass> pass;  // null until a picture calls for it
    bool fits = false;           // made for the targets as they are
    bool called_for = false;     // by the picture at hand
  };
  Rasterizer() = default;
  world::Status open(const gpu::DeviceOptions& options);
  PassContext context() { return {*device_, bindings_, targets_, times_, slices_}; }
  world::Status fit_targets(int width, int height, const TargetNeeds& needs, VkFormat depth);
  VkFormat depth_format(DepthFormat asked);
  world::Status fill_textures(const TextureSet& textures);
  world::Status bind_shared(const Drawing& drawing);
  world::Status record(VkCommandBuffer commands, const Drawing& drawing);
  /// Of an image that the processor can't read where it lies, or that effects read on the device.
  bool copies_colour() const { return finishes_ || targets_.colour.row_bytes == 0; }
  void record_read_back(VkCommandBuffer commands);
  void read_back(Image& image) const;

  std::unique_ptr<gpu::Device> device_;                            // first member: dies last
  std::vector<std::unique_ptr<FacePool>> levels_;                  // of cubes
  std::vector<std::span<const ExtractedChunk* const>> extracted_;  // what they hold
  TreePool trees_;
  bool splits_trees_ = false;
  FacePool shape_pool_{FacePool::box_of_voxel}, shape_points_{FacePool::box_of_voxel};
  const ShapeExtractor* block_shapes_ = nullptr;
  ShadowGrid shadow_grid_;
  LightGrid light_grid_;
  SunHeights sun_heights_;
  SunBlockers sun_blockers_;
  Lighting lighting_;
  DrawnTriangles triangles_;
  TriangleLight triangle_light_;
  gpu::Buffer sky_table_;  // for their light
  gpu::Buffer texels_;
  uint64_t textures_version_ = 0;
  std::vector<TextureOfBlock> block_textures_;  // empty: no block has one
  gpu::Buffer sun_map_;
  shared::SunMapFrame sun_map_frame_{};
  uint64_t sun_map_version_ = 0;
  Targets targets_;
  gpu::Buffer picture_, face_lit_, colour_copy_;
  std::string warning_;
  Bindings bindings_;
  gpu::TimeSlices slices_;
  Timestamps times_{slices_};
  std::vector<Stage> stages_;
  DeviceEffects effects_;
  bool finishes_ = false;  // the picture at hand has effects or several samples
};

}  // namespace render::raster
