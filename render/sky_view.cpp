#include "render/sky_view.h"

#include "render/knob_ranges.h"

namespace render {

world::Result<SkyView> sky_view(const world::Environment& environment, const RenderKnobs& knobs,
                                std::shared_ptr<const world::SkyLight>& kept) {
  TRY_STATUS(check_ranges(knobs));
  SkyView view(environment);
  if (knobs.time_of_day < 0) return view;
  const world::SkySetting setting{knobs.time_of_day, knobs.latitude, knobs.day_of_year, knobs.turbidity, knobs.moon};
  if (!kept || !(kept->setting() == setting)) kept = std::make_shared<const world::SkyLight>(setting);
  view.light = kept;
  world::set_sky(view.environment, *kept);
  return view;
}

}  // namespace render
