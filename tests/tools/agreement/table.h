/// The table of agreement between the rasterizer and the ray caster: a row an effect, with how near their pictures must
/// be and what the rest is. To hold another effect to it, add a row to rows.cpp; tools/gallery/agreement.md is written
/// from it (agreement_test.cpp).
#pragma once

#include <span>

namespace tools {

/// What is common to all rows: coarser levels of what is far are the rasterizer's, and paths the ray caster's alone.
inline constexpr const char* kSettingsOfAllRows = "lod_error_px=0 light_transport=direct";

struct AgreementBound {
  int levels = 2;           // of 255: how much a band of a pixel may differ ...
  double share = 0.999;     // ... on at least so many of the pixels
  double flip = 0.01;       // the mean of FLIP stays below it
  double elsewhere = 5e-5;  // of the pixels: at most so many differ by more and lie on no edge, see kBesidePixels
};

/// A pixel that differs lies on an edge - between faces, of a shadow, between texels - where the ray caster shows the
/// rasterizer's colour, or one to both sides of it, when it looks so far beside the pixel's middle, in eight
/// directions.
inline constexpr double kBesidePixels = 1.0 / 32;

struct AgreementRow {
  const char* effect;
  const char* world;          // of worlds.h, or a shipped scene
  const char* cameras = "";   // names, separated by commas; none: all of the world's
  const char* settings = "";  // as after --set, over those of all rows and the world's own
  const char* of_rays = "";   // further ones of the ray caster, which comes to the same by another knob
  const char* against = "";   // in place of `settings` these make another picture: there is something to compare
  int ticks = 0;              // of matter, before the picture
  AgreementBound bound = {};
  const char* rest = "";  // what differs beside edges
  int width = 320, height = 180;
};
std::span<const AgreementRow> agreement_rows();

/// What the rows can't compare.
struct Alone {
  const char* who;  // rasterizer, rays, or both: one code for both
  const char* what;
  const char* settings;  // knobs, and choices of knobs as KNOB=CHOICE, separated by blanks
};
std::span<const Alone> agreement_alone();

}  // namespace tools
