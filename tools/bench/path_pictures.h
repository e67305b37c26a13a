/// Small pictures by the reference, and how far one of few samples lies from the truth, which is known by two halves A
/// and B made from other seeds: (X - A)(X - B) is, in the mean, the squared error of X exactly, whatever the noise of
/// the halves. Light scatters at most 8 times, in the halves too, so that only noise and what a knob changes is
/// measured. Each error is the root of its mean over pixels, bands and a few seeds, over the mean of the truth;
/// trimmed, without the 1 % of pixels that lie furthest off. source  Eric Veach. Robust Monte Carlo Methods for Light
/// Transport Simulation. 1997, section 2.4
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "render/camera.h"
#include "render/knobs.h"
#include "tools/bench/benchmark.h"

namespace tools {

/// A world and its first camera; must outlive what is made of it.
struct PathStage {
  const world::World* world = nullptr;
  render::Camera camera;
  render::RenderKnobs knobs;  // the world's own
  int width = 0, height = 0, half_samples = 0;
};
Result<std::shared_ptr<const PathStage>> path_stage(BenchContext& context, const world::World& world);

/// None where it fails, or a sample wasn't finite.
std::optional<render::Image> path_picture(const PathStage& stage, const render::RenderKnobs& knobs, uint64_t seed);

/// Two independent pictures of many samples, and the mean over both, pixels and bands.
struct PictureHalves {
  std::optional<render::Image> a, b;
  double mean = 0;
};
std::shared_ptr<PictureHalves> picture_halves(const PathStage& stage, const render::RenderKnobs& knobs, uint64_t seed);

/// RMS error, the same trimmed, and bias.
ErrorSample path_errors(const PathStage& stage, const PictureHalves& halves, const render::RenderKnobs& knobs,
                        uint64_t seed);
std::vector<std::string> path_metrics();

}  // namespace tools
