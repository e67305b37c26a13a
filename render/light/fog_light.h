/// Light that media scatter towards the eye where no path follows it (FogLight::unhidden), as a source radiance in
/// place of an integral over what arrives:
///
///   emission + albedo (mean of the sky's radiance over all directions + E_sun p(cos))
/// p is the phase function, of the angle between the sun's light and its way to the eye.
/// error  nothing hides the sun and the sky, neither land nor the medium itself, and light that is scattered more than
///        once is missing. In an even sky, where nothing is absorbed, it is exact: fog can't be seen. With fog_sun_rays
///        the sun is what comes to places along the ray, past land and through media. Subject fog_light
/// source McGuire, Hughes et al. Computer Graphics: Principles and Practice, 3rd edition. 2013, section 14.7.4
#pragma once

#include <span>

#include "render/knobs.h"
#include "render/sky_view.h"
#include "world/media/medium.h"

namespace render {

/// By band, W/(m^2 sr) and W/m^2.
struct ScatteredIn {
  world::Vec3d sky{0};  // albedo * mean radiance
  world::Vec3d sun{0};  // albedo * irradiance, still without the phase function
};
/// What arrives at all media of a picture: the mean of the sky's radiance over all directions, and the sun's
/// irradiance.
struct FogSource {
  world::Vec3d sky{0}, sun{0};
};
FogSource fog_source(const SkyView& sky, FogLight kind);
ScatteredIn scattered_in(const world::Medium& medium, const FogSource& source);

/// Whether fog asks for the sun along rays: fog_shafts.shared.h.
bool fog_shafts(std::span<const world::Medium> media, const SkyView& sky, const RenderKnobs& knobs);

}  // namespace render
