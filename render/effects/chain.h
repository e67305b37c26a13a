/// The effects of a picture between radiance and the display, as its knobs ask: members and order in chain.shared.h.
///
/// A plan says what is to be done for one picture; empty where no effect has strength, and then nothing is made. It is
/// carried out on processors (apply_effects) or on a device (device_chain.h), by the same formulas.
///
/// error  what both give differs by at most 1e-4 of a band: tests/render/effects_test.cpp
/// fails  usage, where a knob is out of its range
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "render/backend.h"
#include "render/effects/effect.shared.h"
#include "render/effects/bloom.shared.h"
#include "render/effects/flare_spots.h"

namespace render {

struct EffectPlan {
  shared::EffectFrame frame{};
  uint32_t effects = 0;                        // 1 << EFFECT_<name>
  std::vector<shared::BloomStep> bloom_steps;  // in order: each reads what those before wrote
  size_t blurred_numbers = 0;                  // floats that the steps need
  bool meter = false;                          // finds metered_ev out from the picture
  uint32_t format = 0;                         // of the finished picture: shared::kFormat...
  float metered_ev = 0;                        // where it need not

  bool empty() const { return effects == 0 && format == 0; }
};

/// `spots` of the lens flare; asked for where its knob has strength alone.
world::Result<EffectPlan> plan_effects(const Camera& camera, const RenderKnobs& knobs, int width, int height,
                                       std::span<const FlareSpot> spots);
world::Result<EffectPlan> plan_effects(const world::WorldView& view, const Camera& camera, const RenderKnobs& knobs,
                                       int width, int height);

/// What is only found out on the way.
struct EffectOutcome {
  double metered_ev = 0;            // that automatic exposure added
  uint64_t not_finite = 0;          // pixels that held a NaN or an infinity: shown as black, or as bright as can be
  std::vector<float> blurred = {};  // the lobes of bloom, where the plan says
};

/// Turns the picture into that after all effects of the plan; one without any stays as it is.
EffectOutcome apply_effects(const EffectPlan& plan, Image& image);
/// As a tile of a larger picture, which a smaller one of all of it stands for: what spreads over the whole is taken
/// from that one.
struct WholePicture {
  int width = 0, height = 0;  // of the smaller one
  EffectPlan plan;
  EffectOutcome outcome;
};
void apply_effects(const EffectPlan& plan, const WholePicture& whole, Image& tile);

/// What the passes of a plan are called in a report: members joined by +, bloom's levels and the metering by
/// themselves.
std::string effect_pass_name(const EffectPlan& plan);
/// Of the finished picture, in its format.
uint64_t finished_bytes(const EffectPlan& plan);
/// Bytes that each pass reads and writes.
std::vector<PassReport> effect_passes(const EffectPlan& plan);

/// The end of a backend's picture on processors: plans, applies, reports.
world::Status finish_picture(const world::WorldView& view, const Camera& camera, const RenderKnobs& knobs,
                             Frame& frame);

/// The knobs without what is behind the lens, for pictures that are kept as radiance: no automatic exposure, tone
/// mapping or grain.
RenderKnobs without_display_effects(RenderKnobs knobs);
/// And without any effect.
RenderKnobs without_effects(RenderKnobs knobs);

}  // namespace render
