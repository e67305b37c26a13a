/// Bodies and particles of a picture, made ready for a camera: what both ways of drawing them share.
///
/// A particle is a ball of thin matter that lets (1 - opacity) of the light through along its diameter: a ray that
/// passes c metres of it loses 1 - (1 - opacity)^(c / diameter), so that it is soft at its rim, where it dips into a
/// surface, and around a camera inside it. One smaller than a pixel is drawn a pixel wide and as much fainter. One that
/// moves is a streak: the mean of where it is while the shutter is open (knob `shutter`).
///
/// cost   two rays a particle or body (sun and sky), a sort
/// error  a particle has one radiance: that of a matte ball from all sides, in the sun or not, under the sky or (where
///        a ray upwards is blocked) a fifth of it. Balls that overlap are laid over each other by their middles. Clouds
///        before a ball or a body are those before its middle
/// source William T. Reeves. Particle Systems - A Technique for Modeling a Class of Fuzzy Objects. 1983; for soft edges
///        Tristan Lorach. Soft Particles. 2007, and Umenhoffer, Szirmay-Kalos, Szijarto. Spherical Billboards and their
///        Application to Rendering Explosions. 2006
#pragma once

#include <span>
#include <vector>

#include "render/backend.h"
#include "render/inhabitants.shared.h"
#include "render/shading.h"

namespace render {

struct DrawnInhabitants {
  std::vector<shared::DrawnBall> balls;  // from far to near
  std::vector<shared::DrawnBox> boxes;
  bool empty() const { return balls.empty() && boxes.empty(); }
};

/// Those that may be seen.
DrawnInhabitants drawn_inhabitants(const world::WorldView& view, const Inhabitants& inhabitants, const Camera& camera,
                                   const RenderKnobs& knobs, int width, int height);

/// The bodies alone.
std::vector<shared::DrawnBox> drawn_bodies(const world::WorldView& view, const Inhabitants& inhabitants,
                                           const Camera& camera, const RenderKnobs& knobs, int width, int height);

/// Columns [x0, x1) and rows [y0, y1) of a picture.
struct PixelRectangle {
  int x0, x1, y0, y1;
};
/// What each box may cover.
std::vector<PixelRectangle> rectangles_of(std::span<const shared::DrawnBox> boxes, const Camera& camera, int width,
                                          int height);

/// How far what a pixel shows is along its ray, m; infinity: nothing.
struct PixelDistances {
  std::vector<float> first;   // the first surface: bodies behind it are hidden
  std::vector<float> opaque;  // that isn't looked straight through: so are particles behind this one
};
/// Draws them over a picture. `boxes_drawn`: it has the boxes already; either way particles behind them are hidden.
void draw_over(const DrawnInhabitants& drawn, const Camera& camera, PixelDistances& distances, Image& image,
               bool boxes_drawn = false);

}  // namespace render
