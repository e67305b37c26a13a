/// What luminaire.cpp, which reads, sampler.cpp, which samples, and a device that does so itself know in common.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "world/luminaires/emitter.shared.h"
#include "world/luminaires/image_distribution.h"
#include "world/luminaires/luminaire.h"

namespace world {

struct LuminaireKind {
  std::string_view name;
  uint32_t keys;  // kKey... of emitter.shared.h
};
std::span<const LuminaireKind> luminaire_members();

/// What the formulas take of it: the frame made orthonormal, cones as parts of the sphere. Of a mesh without a
/// triangle.
shared::Emitter emitter_from(const Luminaire& luminaire);

/// What a LuminaireSampler works with, for a device that samples by the same formulas.
struct LuminaireTables {
  uint32_t number = 0;                 // of its kind, LUMINAIRE_... of every_luminaire.shared.h
  uint32_t keys = 0;                   // kKey... of emitter.shared.h
  Vec3d colour{0};                     // in the unit of the keys
  std::vector<shared::Emitter> parts;  // one, or a mesh's triangles
  std::vector<double> areas;           // m^2, sums up to and with each part; of several parts
  double area = 0;                     // m^2; infinite at no place
  bool slide = false, sky = false;     // which of both its image is
  ImageDistribution cells;             // of a sky
  std::vector<double> row_cosines;     // of the borders of a sky's rows
};
/// Fails as LuminaireSampler::make.
Result<LuminaireTables> luminaire_tables(const Luminaire& luminaire);

constexpr double kUsualClamp = 0.01;  // m: radius_m of a point that names none
// Such that no quotient of them leaves a float's range.
constexpr NumberRange kPowerRange{.min = 0, .max = 1e15};     // W
constexpr NumberRange kRadianceRange{.min = 0, .max = 1e12};  // W/(m^2 sr), and W/m^2
constexpr NumberRange kSizeRange{.min = 1e-6, .max = 1e6};    // m
constexpr NumberRange kImageRange{.min = 0, .max = 1e9};

/// Whether the numbers that its kind reads lie in their ranges; of luminaires that no scene made.
Status check_luminaire(const Luminaire& luminaire);

}  // namespace world
