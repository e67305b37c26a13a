/// A pass of the rasterizer: a class in its own file, made when the first picture calls for it. Rasterizer keeps the
/// order (passes.cpp), the shared targets and what is bound; a pass keeps its own pipelines, buffers and images.
///
/// To add one: a row in passes.cpp, its .cpp and shaders beside it. Its bindings get numbers of its own in
/// raster.shared.h; no layout is repeated in C++.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "render/backend.h"
#include "render/gpu/time_slices.h"
#include "render/light/surface_light.h"
#include "render/raster/barriers.h"
#include "render/raster/bindings.h"
#include "render/raster/face_pool.h"
#include "render/raster/lighting.h"
#include "render/raster/mirror.h"
#include "render/raster/raster.shared.h"
#include "render/raster/tree_pool.h"
#include "render/raster/triangles.h"
#include "render/shading.h"
#include "render/textures/texture_set.h"

namespace render::raster {

constexpr VkFormat kSeenFormat = VK_FORMAT_R32G32_UINT;
constexpr VkFormat kDepthFormat = VK_FORMAT_D32_SFLOAT;  // where knobs and device allow it: see Targets
constexpr VkFormat kColourFormat = VK_FORMAT_R32G32B32A32_SFLOAT;

/// What the passes called for beside seen, depth and the radiance that is read back.
struct TargetNeeds {
  bool colour = false;  // radiance as an image that later passes blend into, sample and replace
};

/// Shared images of one size, in VK_IMAGE_LAYOUT_GENERAL; what they hold doesn't outlive a picture.
struct Targets {
  int width = 0, height = 0;
  gpu::DeviceImage seen;  // kSeenFormat: what each pixel sees, see raster.shared.h
  VkFormat depth_format = kDepthFormat;
  gpu::DeviceImage depth;   // reversed: near plane / view depth, 0 where nothing is seen
  gpu::DeviceImage colour;  // kColourFormat: linear radiance, a = 1; made where a pass needs it. Shading writes it, the
                            // passes behind it change it, and at the end it is what is read back
  gpu::DeviceImage stencil;  // made by a pass that needs one: stencil.h
  gpu::Buffer radiance;      // float[3 * pixels], for the processor
  uint32_t band_rows = 0;    // rows whose radiance fits one storage buffer binding
  VkExtent2D extent() const { return seen.extent; }
};

/// A box that is outlined.
struct Selection {
  world::WorldPoint low;
  Vec3d size{1};
  double width_px = 2;
};

/// One picture: what all passes read. The world may be read by any pass; what it derives it keeps and follows itself.
struct Drawing {
  const world::WorldView& view;
  std::span<FacePool* const> faces;                                   // of cubes, by level; culling notes what is seen
  std::span<const std::span<const ExtractedChunk* const>> extracted;  // what `faces` hold, by level
  TreePool& trees;                     // of `faces`, what billboards may stand for; empty where they aren't asked for
  FacePool& shapes;                    // of blocks that have a shape of their own
  FacePool& shape_points;              // the same, a record a voxel
  const ShapeExtractor* block_shapes;  // whose quads those records name; null where there are none
  const DrawnTriangles& triangles;     // of meshes and smooth surfaces
  const Camera& camera;                // off the planes of the grid
  const PixelRays& rays;
  const SkyView& sky;
  const world::Environment& environment;  // of the sky
  const Lighting& lighting;
  std::span<const TextureOfBlock> block_textures;  // by block; empty: none has one, or the knobs ask for none
  const Shading& shading;
  const RenderKnobs& knobs;
  SurfaceLight::Kind light;
  double near;  // view depth in metres closer than which nothing lies in the picture
  int width, height;
  Inhabitants inhabitants;
  uint64_t impostor_bytes;                  // see Rasterizer::impostor_bytes
  bool bare;                                // see Rasterizer::bare
  bool triangles_alone;                     // see Rasterizer::triangles_alone
  bool counts_sun_rays;                     // see Rasterizer::counts_sun_rays
  bool may_list_faces;                      // see Rasterizer::may_list_faces
  const MirrorPlane* behind = nullptr;      // the picture is taken from behind this plane, for the one seen in it
  const MirrorPicture* mirrored = nullptr;  // what that showed
  const Selection* selected = nullptr;      // what is outlined
  bool whole_mirror = false;                // see Rasterizer::whole_mirror
  bool sun_blockers = false;                // what isn't opaque takes its part of the sun's light
  bool liquid_levels = false;               // some liquid ends within its voxel
};

/// For every pipeline that includes render/raster/shading/surface.glsl.h or sky.glsl.h: what shading is compiled for.
/// What a picture doesn't ask for isn't in it. Two pictures with equal constants can share a pipeline.
std::vector<Constant> shading_constants(const Drawing& drawing);

inline vec4 to_vec4(const Vec3d& v, double w = 0) { return vec4(glm::vec3(v), static_cast<float>(w)); }
inline vec4 to_vec4(const Rgb& c, float w = 0) { return vec4(c.r, c.g, c.b, w); }
/// What of a picture's constants places faces on it. near: as Drawing's.
void set_view(PictureConstants& constants, const Camera& camera, const PixelRays& rays, double near, int width,
              int height);

/// Times of a picture: a mark starts a row of the report, which ends at the next mark. They say how what is in a row is
/// cut the next time.
class Timestamps {
 public:
  explicit Timestamps(gpu::TimeSlices& slices) : slices_(slices) {}
  world::Status open(gpu::Device& device);
  void begin(VkCommandBuffer commands);
  void mark(VkCommandBuffer commands, const char* name);
  void end(VkCommandBuffer commands);
  /// Appends a row for each mark, with its time; what more a row says is for the passes.
  world::Status report(FrameReport& report) const;

 private:
  static constexpr uint32_t kMost = 64;
  gpu::TimeSlices& slices_;
  gpu::Device* device_ = nullptr;
  gpu::Owned<VkQueryPool> pool_;
  std::vector<const char*> names_;
};

struct PassContext {
  gpu::Device& device;
  Bindings& bindings;
  Targets& targets;
  Timestamps& times;
  gpu::TimeSlices& slices;

  /// gpu::fill(), gpu::fill_texels()
  world::Status fill(gpu::Buffer& buffer, const void* data, size_t bytes, VkBufferUsageFlags usage,
                     gpu::MemoryUse use = gpu::MemoryUse::upload) const {
    return gpu::fill(device, buffer, data, bytes, usage, use);
  }
  world::Status fill_texels(gpu::Buffer& buffer, VkFormat format, const void* data, size_t bytes) const {
    return gpu::fill_texels(device, buffer, format, data, bytes);
  }
};

class Pass {
 public:
  virtual ~Pass() = default;
  /// Once, before all else.
  virtual world::Status open(PassContext&) { return {}; }
  /// When the targets are new: images of the picture's size.
  virtual world::Status fit(PassContext&) { return {}; }
  /// Before anything of the picture is recorded: pipelines, buffers, what is bound. Adds rows for its work on the
  /// processor where that is worth one.
  virtual world::Status prepare(PassContext& context, const Drawing& drawing, FrameReport& report) = 0;
  /// Rasterizer has marked the pass's name; further marks divide it. Barriers before what it reads of others are its
  /// own.
  virtual void record(VkCommandBuffer commands, PassContext& context, const Drawing& drawing) = 0;
  /// Once the device is done: draws and bytes of its rows, and what it reads back.
  virtual world::Status finish(PassContext&, FrameReport&) { return {}; }
  /// After finish(): the picture must be drawn once more, as what was read back asked for more room. Passes behind this
  /// one don't finish then.
  virtual bool again() const { return false; }
  /// A picture doesn't call for the pass: it gives back what it holds but its pipelines.
  virtual void rest() {}
};

/// The row that a mark or prepare() has made.
PassReport& row_of(FrameReport& report, std::string_view name);

struct PassKind {
  const char* name;
  /// Whether a picture calls for it; sets what it needs of the targets.
  bool (*called_for)(const Drawing& drawing, TargetNeeds& needs);
  std::unique_ptr<Pass> (*make)();
};
/// In the order in which they are recorded.
std::span<const PassKind> pass_kinds();

/// A dispatch over pixels, in groups of kShadeGroup x kShadeGroup. The pipeline is bound.
void dispatch_pixels(VkCommandBuffer commands, VkExtent2D pixels);

/// Sets viewport and scissor to the whole of the targets and begins rendering into `colour` views and depth (or null),
/// loading what they hold, or clearing it to 0.
void begin_rendering(VkCommandBuffer commands, const Targets& targets, std::span<const VkImageView> colour,
                     VkImageView depth, bool clear);

}  // namespace render::raster
