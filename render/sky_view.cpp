#include "render/sky_view.h"

#include <fmt/format.h>

namespace render {

world::Result<SkyView> sky_view(const world::Environment& environment, const RenderKnobs& knobs,
                                std::shared_ptr<const world::SkyLight>& kept) {
  SkyView view(environment);
  if (knobs.time_of_day < 0) return view;
  const auto within = [](const char* knob, double value, double low, double high) -> world::Status {
    if (value >= low && value <= high) return {};
    return world::usage_error(fmt::format("the knob {} is {}, but must lie between {} and {}", knob, value, low, high));
  };
  TRY_STATUS(within("time_of_day", knobs.time_of_day, 0, 24));
  TRY_STATUS(within("latitude", knobs.latitude, -90, 90));
  TRY_STATUS(within("day_of_year", knobs.day_of_year, 1, 366));
  TRY_STATUS(within("turbidity", knobs.turbidity, 2, 10));
  const world::SkySetting setting{knobs.time_of_day, knobs.latitude, knobs.day_of_year, knobs.turbidity, knobs.moon};
  if (!kept || !(kept->setting() == setting)) kept = std::make_shared<const world::SkyLight>(setting);
  view.light = kept;
  world::set_sky(view.environment, *kept);
  return view;
}

}  // namespace render
