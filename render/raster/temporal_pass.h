/// Anti-aliasing by time: each picture looks through other points of its pixels, and is mixed with what the pictures
/// before it saw of the same places.
///
/// A pixel's surface is looked up where it was in the last picture, by its depth and both cameras; what is found there
/// is kept within the range of the colours around the pixel now, so that nothing that has gone stays. The n-th picture
/// in a row counts 1/n, at least 1/8: a camera at rest comes to the mean of eight points.
///
/// bytes  48 a pixel
/// error  measured in tests/render/screen_test.cpp; where a camera moves, bilinear lookups soften
/// source Brian Karis. High Quality Temporal Supersampling. SIGGRAPH courses, 2014; John Halton. On the efficiency of
///        certain quasi-random sequences of points. 1960
#pragma once

#include "render/raster/pass.h"

namespace render::raster {

class TemporalPass : public Pass {
 public:
  static PassKind kind();
  world::Status fit(PassContext& context) override;
  world::Status prepare(PassContext& context, const Drawing& drawing, FrameReport& report) override;
  void record(VkCommandBuffer commands, PassContext& context, const Drawing& drawing) override;
  world::Status finish(PassContext& context, FrameReport& report) override;

 private:
  Pipeline pipeline_;
  gpu::Buffer history_[2];  // four floats a pixel: radiance, and how many pictures are in it
  int newest_ = -1;         // of history_; -1: none
  Camera before_, drawn_;   // of that and of the picture at hand, without their shifts
};

}  // namespace render::raster
