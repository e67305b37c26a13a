/// Turns what each pixel sees into radiance. Compiled for what a picture asks for.
///
/// The picture is shaded by a triangle over all of it: the test of depth parts the sky from surfaces, so that neither
/// runs through the other's shader (software runs all branches of one for all of its lanes). Triangles
/// that are no faces, and faces of shapes, where these are few, are listed and shaded by a dispatch over them alone. A
/// picture too large for an image is shaded in bands of rows by dispatches. Rays to the sun are cast in place: listing
/// those that its height map leaves open, casting them by a dispatch and shading again what lies in shadow took 58 ms
/// where this takes 34 (valley, 338,000 rays).
#pragma once

#include <map>

#include "render/raster/pass.h"

namespace render::raster {

class ShadePass : public Pass {
 public:
  static PassKind kind();
  world::Status prepare(PassContext& context, const Drawing& drawing, FrameReport& report) override;
  void record(VkCommandBuffer commands, PassContext& context, const Drawing& drawing) override;
  world::Status finish(PassContext& context, FrameReport& report) override;

 private:
  void begin_put_off(VkCommandBuffer commands);
  void record_put_off(VkCommandBuffer commands, PassContext& context);

  std::map<std::vector<Constant>, Pipeline> pipelines_;
  // Of the picture: bands, or sky and surfaces; null where nothing is put off.
  const Pipeline *bands_ = nullptr, *sky_ = nullptr, *surfaces_ = nullptr, *put_off_pipeline_ = nullptr;
  bool counts_rays_ = false, in_stencil_ = false;  // in_stencil_: only where a mirror is
  gpu::Buffer put_off_, materials_;                // put_off_: shading/put_off.glsl.h
  gpu::ListDispatch put_off_dispatch_;
};

}  // namespace render::raster
