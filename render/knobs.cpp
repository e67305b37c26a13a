#include "render/knobs.h"

#include <map>
#include <string>

#include <fmt/format.h>

#include "render/knob_ranges.h"

namespace render {

namespace {

/// What a knob buys and costs, with its range where that isn't in it.
std::string with_range(const std::string& name, std::string what) {
  static const std::map<std::string, std::pair<double, double>> ranges = {
#define RANGE(name, low, high) {#name, {low, high}},
#include "render/knob_ranges.def"
#undef RANGE
  };
  const auto found = ranges.find(name);
  if (found == ranges.end()) return what;
  const auto [low, high] = found->second;
  const std::string range = high < 1e9 ? fmt::format("{:g} to {:g}", low, high) : fmt::format("at least {:g}", low);
  if (what.find(range) == std::string::npos) what += "; " + range;
  return what;
}

}  // namespace

const world::KnobTable<RenderKnobs>& render_knobs() {
  static const world::KnobTable<RenderKnobs> table = [] {
    world::KnobTable<RenderKnobs> t;
#define KNOB(name, type, fast, usual, exact, unit, what) \
  t.add<type>(#name, &RenderKnobs::name, fast, usual, exact, unit, with_range(#name, what));
#define RANGE(name, low, high) t.limit<decltype(RenderKnobs::name)>(#name, low, high);
#include "render/knobs.def"
#include "render/knob_ranges.def"
#undef KNOB
#undef RANGE
    return t;
  }();
  return table;
}

world::Status check_ranges(const RenderKnobs& knobs) {
  RenderKnobs read;
#define RANGE(name, low, high)                        \
  if (!(knobs.name >= (low) && knobs.name <= (high))) \
    return render_knobs().set(read, #name, fmt::format("{}", knobs.name));
#include "render/knob_ranges.def"
#undef RANGE
  return {};
}

}  // namespace render
