/// Turns what each pixel sees into radiance: one compute pass over bands of rows. Compiled for what a picture asks for.
#pragma once

#include "render/raster/pass.h"

namespace render::raster {

/// What the shading pass is compiled for: what a picture doesn't ask for isn't in it.
struct ShadeVariant {
  SunShadow sun_shadow = SunShadow::none;
  SurfaceLight::Kind light = SurfaceLight::Kind::none;
  LightInterpolation interpolation = LightInterpolation::face;
  bool corner_occlusion = false;
  bool shapes = false;    // pixels may see faces of shapes
  bool to_image = false;  // into targets.colour
  friend auto operator<=>(const ShadeVariant&, const ShadeVariant&) = default;
};

class ShadePass : public Pass {
 public:
  static PassKind kind();
  world::Status prepare(PassContext& context, const Drawing& drawing, FrameReport& report) override;
  void record(VkCommandBuffer commands, PassContext& context, const Drawing& drawing) override;
  world::Status finish(PassContext& context, FrameReport& report) override;

 private:
  std::map<ShadeVariant, Pipeline> pipelines_;
  const Pipeline* pipeline_ = nullptr;
  gpu::Buffer materials_;
};

}  // namespace render::raster
