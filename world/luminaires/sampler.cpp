// LuminaireSampler: one table of the members, and what a member's formulas leave to it - colour, images, the choice
// among a mesh's triangles.
#include "world/luminaires/luminaire.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include "world/luminaires/every_luminaire.shared.h"
#include "world/luminaires/image_distribution.h"
#include "world/luminaires/kinds.h"
#include "world/numbers/robust.h"
#include "world/space/box_tree.h"
#include "world/space/ray_shapes.h"

namespace world {

namespace {

using shared::Emitter;
using shared::EmitterHit;
using shared::EmitterPhoton;
using shared::EmitterSample;
using Vec2d = glm::dvec2;

constexpr double kPi = std::numbers::pi;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Member {
  const char* name;
  uint32_t keys;
  double (*area)(const Emitter&);
  double (*power)(const Emitter&);
  EmitterSample (*sample)(const Emitter&, Vec3d, Vec2d);
  EmitterHit (*meet)(const Emitter&, Vec3d, Vec3d);
  EmitterPhoton (*emit)(const Emitter&, Vec2d, Vec2d, Vec3d, double);
};

const Member kMembers[] = {
#define LUMINAIRE(name)   \
  {#name,                 \
   shared::name##_keys(), \
   shared::name##_area,   \
   shared::name##_power,  \
   shared::name##_sample, \
   shared::name##_meet,   \
   shared::name##_emit},
#include "world_luminaires.list.h"
#undef LUMINAIRE
};

/// As a float: 0 for NaN and what is below 0, the largest float for what is above.
float bounded(double v) { return static_cast<float>(clamp_number(v, 0.0, double{std::numeric_limits<float>::max()})); }
template <class Bands>
Bands bands_from(const Vec3d& v) {
  return {bounded(v.x), bounded(v.y), bounded(v.z)};
}
template <class Bands>
Vec3d vector_of(const Bands& b) {
  return {b.r, b.g, b.b};
}

/// Between the centres of cells, straight; beyond the outer ones the border's value, or black.
Vec3d value_between(const LightImage& image, double x, double y, bool wraps, bool black_border) {
  const double fx = std::floor(x), fy = std::floor(y), tx = x - fx, ty = y - fy;
  const auto at = [&](int64_t column, int64_t row) -> Vec3d {
    if (wraps) column = (column % image.width + image.width) % image.width;
    const int64_t c = std::clamp<int64_t>(column, 0, image.width - 1),
                  r = std::clamp<int64_t>(row, 0, image.height - 1);
    if (black_border && (c != column || r != row)) return Vec3d(0);
    return vector_of(image.pixels[static_cast<size_t>(r * image.width + c)]);
  };
  const auto c = static_cast<int64_t>(fx), r = static_cast<int64_t>(fy);
  return (1 - ty) * ((1 - tx) * at(c, r) + tx * at(c + 1, r)) + ty * ((1 - tx) * at(c, r + 1) + tx * at(c + 1, r + 1));
}
double mean_of(const Vec3d& v) { return (v.x + v.y + v.z) / 3; }

}  // namespace

Emitter emitter_from(const Luminaire& l) {
  Emitter e{};
  e.axis = safe_normalize(Vec3d(l.axis), {0, -1, 0});
  const Vec3d up(l.up), aside = glm::cross(e.axis, glm::cross(up, e.axis));
  e.up = glm::dot(aside, aside) > 1e-12 * glm::dot(up, up) ? safe_normalize(aside) : shared::across(e.axis);
  e.right = glm::cross(e.up, e.axis);
  e.extent = l.extent;
  // Of a point, the distance below which it grows no further.
  e.radius = l.radius > 0 ? double{l.radius} : kUsualClamp;
  const auto cone = [](double half_angle) {
    // The float nearest to pi lies above it, that of 180 degrees must be the whole sphere.
    return half_angle >= kPi - 1e-6 ? 1.0 : cone_solid_angle(clamp_number(half_angle, 0.0, kPi)) / (4 * kPi);
  };
  e.cone = cone(l.half_angle);
  // The lesser of both, and a hard edge where it is no number.
  e.inner_cone = l.inner_half_angle < l.half_angle ? cone(l.inner_half_angle) : e.cone;
  e.tan_half_angle = std::tan(std::min(double{l.half_angle}, 0.5 * kPi - 1e-6));
  e.attenuation = l.attenuation;
  e.at_infinity = l.at_infinity, e.whole_sphere = l.whole_sphere, e.uniform_area = l.uniform_area;
  return e;
}

std::span<const LuminaireKind> luminaire_members() {
  static const std::vector<LuminaireKind> kinds = [] {
    std::vector<LuminaireKind> made;
    for (const Member& member : kMembers) made.push_back({member.name, member.keys});
    return made;
  }();
  return kinds;
}

/// One made ready.
struct ReadyLuminaire {
  Luminaire luminaire;
  const Member* member = nullptr;
  Vec3d colour{0};             // in the unit of the member's keys
  std::vector<Emitter> parts;  // one, or a mesh's triangles
  std::vector<double> areas;   // sums up to and with each part; of several parts
  BoxTree tree;                // over parts, where there are several
  double area = 0;
  Vec3d power{0};  // W
  const LightImage* image = nullptr;
  bool slide = false, sky = false;  // which of both the image is
  ImageDistribution cells;
  std::vector<double> row_cosines;  // sky: of the rows' borders, cut off at the horizon

  Status build();
  Status build_parts();
  Status build_image();
  void build_slide();
  void build_sky();

  struct Choice {
    const Emitter& part;
    double share;
  };
  Choice choose(Vec2d& u) const {
    if (parts.size() == 1) return {parts[0], 1};
    const double target = u.x * area;
    const size_t i = std::min<size_t>(
        static_cast<size_t>(std::upper_bound(areas.begin(), areas.end(), target) - areas.begin()), parts.size() - 1);
    const double before = i ? areas[i - 1] : 0, own = areas[i] - before;
    u.x = clamp_number((target - before) / own, 0.0, 1 - 0x1p-53);
    return {parts[i], own / area};
  }
  double share_of(size_t part) const { return (areas[part] - (part ? areas[part - 1] : 0)) / area; }

  // A slide's cells are drawn by the light that they let through, a sky's by radiance times solid angle.
  Vec3d slide_at(const Vec3d& place) const {
    return value_between(*image, place.x * image->width - 0.5, place.y * image->height - 0.5, false, true);
  }
  Vec3d sky_at(const Vec3d& direction) const {
    const Vec2d place = shared::hemisphere_sky_from_direction(parts[0], direction);
    return value_between(*image, place.x * image->width - 0.5, place.y * image->height - 0.5, true, false);
  }
  double row_solid_angle(int row) const {  // of one cell of it
    return 2 * kPi / image->width * (row_cosines[static_cast<size_t>(row)] - row_cosines[static_cast<size_t>(row) + 1]);
  }
  /// A direction of the sky and its density, 1/sr.
  std::pair<Vec3d, double> sky_direction(Vec2d u) const {
    const ImageDistribution::Cell cell = cells.sample(u);
    const double top = row_cosines[static_cast<size_t>(cell.row)], low = row_cosines[static_cast<size_t>(cell.row) + 1];
    const Vec3d direction = shared::hemisphere_direction_from_sky(
        parts[0], (cell.column + cell.within.x) / image->width, top + cell.within.y * (low - top));
    return {direction, cell.probability / row_solid_angle(cell.row)};
  }
  double sky_pdf(const Vec3d& direction) const {
    const Vec2d place = shared::hemisphere_sky_from_direction(parts[0], direction);
    const int column = std::clamp(static_cast<int>(place.x * image->width), 0, image->width - 1);
    const int row = std::clamp(static_cast<int>(place.y * image->height), 0, image->height - 1);
    const double solid_angle = row_solid_angle(row);
    return solid_angle > 0 ? cells.probability(column, row) / solid_angle : 0;
  }
  LuminaireSample sample_sky(Vec2d u) const;
  EmittedPhoton emit_slide(Vec2d u) const;
  EmittedPhoton emit_sky(Vec2d u, Vec2d v, const SceneSphere& scene) const;
};
struct LuminaireSampler::State : ReadyLuminaire {};

Status ReadyLuminaire::build() {
  for (const Member& m : kMembers)
    if (luminaire.kind == m.name) member = &m;
  if (!member) return input_error(luminaire.where + ": there is no luminaire of kind '" + luminaire.kind + "'");
  TRY_STATUS(check_luminaire(luminaire));
  TRY_STATUS(build_parts());
  const uint32_t keys = member->keys;
  colour = keys & shared::kKeyPower        ? vector_of(luminaire.power)
           : keys & shared::kKeyIrradiance ? vector_of(luminaire.irradiance)
                                           : vector_of(luminaire.radiance);
  if ((keys & shared::kKeyPower) && (keys & shared::kKeyRadiance) && colour == Vec3d(0))
    colour = kPi * area * vector_of(luminaire.radiance);
  const double part_of_colour = member->power(parts[0]);
  for (int band = 0; band < 3; ++band) power[band] = colour[band] > 0 ? colour[band] * part_of_colour : 0;
  return build_image();
}

Status ReadyLuminaire::build_parts() {
  const Emitter whole = emitter_from(luminaire);
  if (!(member->keys & shared::kKeyFile)) {
    parts = {whole};
    area = member->area(whole);
    return {};
  }
  std::vector<Box> boxes;
  for (size_t i = 0; i + 2 < luminaire.triangles.size(); i += 3) {
    const Vec3f &a = luminaire.triangles[i], &b = luminaire.triangles[i + 1], &c = luminaire.triangles[i + 2];
    const auto normal = triangle_normal(a, b, c);
    if (!normal) continue;
    Emitter part = whole;
    part.corner = a, part.edge1 = Vec3d(b) - Vec3d(a), part.edge2 = Vec3d(c) - Vec3d(a);
    part.axis = safe_normalize(Vec3d(*normal));
    const double own = member->area(part);
    if (!(own > 0)) continue;
    parts.push_back(part);
    areas.push_back(area += own);
    Box& box = boxes.emplace_back();
    for (const Vec3f& corner : {a, b, c}) box.include(Vec3d(corner));
  }
  if (parts.empty() || !std::isfinite(area))
    return input_error(fmt::format("{}: the mesh of luminaire '{}' has no triangle with an area; of {} none is left",
                                   luminaire.where, luminaire.name, luminaire.triangles.size() / 3));
  if (parts.size() > 1) tree = BoxTree(boxes);
  return {};
}

Status ReadyLuminaire::build_image() {
  slide = member->keys & shared::kKeySlide, sky = member->keys & shared::kKeySky;
  if (!slide && !sky) return {};
  image = luminaire.light_image.get();
  if (!image) {
    sky = false;
    if (!slide && luminaire.image.empty()) return {};
    return input_error(fmt::format("{}: 'image' {} of luminaire '{}' has not been loaded", luminaire.where,
                                   luminaire.image, luminaire.name));
  }
  if (image->width < 1 || image->height < 1 ||
      image->pixels.size() != static_cast<size_t>(image->width) * static_cast<size_t>(image->height))
    return input_error(fmt::format("{}: 'image' of luminaire '{}' has {} x {} pixels and {} values", luminaire.where,
                                   luminaire.name, image->width, image->height, image->pixels.size()));
  for (size_t i = 0; i < image->pixels.size(); ++i)
    for (const float v : {image->pixels[i].r, image->pixels[i].g, image->pixels[i].b})
      if (!kImageRange.contains(v))
        return input_error(
            fmt::format("{}: 'image' {} is no light: pixel ({}, {}) has a value of {}, but each must be {}",
                        luminaire.where, luminaire.image, i % static_cast<size_t>(image->width),
                        i / static_cast<size_t>(image->width), v, kImageRange.text()));
  slide ? build_slide() : build_sky();
  return {};
}

/// The total power by the midpoint rule, over parts of cells: 8 x 8 where the cone's edge cuts a cell or cells are few,
/// else 2 x 2. error: relative 1e-3 from 32 x 32 pixels on
void ReadyLuminaire::build_slide() {
  const Emitter& e = parts[0];
  const int width = image->width, height = image->height;
  std::vector<float> weights(image->pixels.size());
  Vec3d total(0);
  const auto profile_at = [&](double column, double row) {
    return shared::cone_profile(e,
                                glm::normalize(shared::gobo_direction_from_slide(e, {column / width, row / height})));
  };
  for (int row = 0, i = 0; row < height; ++row)
    for (int column = 0; column < width; ++column, ++i) {
      const double corner = profile_at(column, row);
      const bool cut = corner != profile_at(column + 1, row) || corner != profile_at(column, row + 1) ||
                       corner != profile_at(column + 1, row + 1);
      const int steps = cut || width < 32 || height < 32 ? 8 : 2;
      const double cell = 4 * e.tan_half_angle * e.tan_half_angle / (double(width) * height * steps * steps);
      Vec3d sum(0);
      for (int y = 0; y < steps; ++y)
        for (int x = 0; x < steps; ++x) {
          const Vec2d place((column + (x + 0.5) / steps) / width, (row + (y + 0.5) / steps) / height);
          const Vec3d towards = shared::gobo_direction_from_slide(e, place);
          const double r = glm::length(towards);
          sum += slide_at({place, 1}) * (shared::cone_profile(e, towards / r) * cell / (r * r * r));
        }
      total += sum;
      // A cell that is dark in the middle of all its parts may still have light.
      const double weight = mean_of(sum);
      weights[static_cast<size_t>(i)] =
          static_cast<float>(cut ? std::max(weight, 1e-3 * cell * steps * steps) : weight);
    }
  cells = ImageDistribution(width, height, weights);
  power = colour * total / (4 * kPi);
}

void ReadyLuminaire::build_sky() {
  const int width = image->width, height = image->height;
  for (int row = 0; row <= height; ++row) {
    const double cosine = row == 0 ? 1 : row == height ? -1 : std::cos(kPi * row / height);
    row_cosines.push_back(luminaire.whole_sphere ? cosine : std::max(cosine, 0.0));
  }
  // The mean over a cell of what value_between gives there: 1/8, 6/8, 1/8 on each axis.
  std::vector<float> weights(image->pixels.size());
  const auto mean_at = [&](int column, int row) {
    const auto& p = image->pixels[static_cast<size_t>(std::clamp(row, 0, height - 1)) * static_cast<size_t>(width) +
                                  static_cast<size_t>((column + width) % width)];
    return mean_of(vector_of(p));
  };
  for (int row = 0, i = 0; row < height; ++row)
    for (int column = 0; column < width; ++column, ++i) {
      double sum = 0;
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) sum += (x ? 1 : 6) * (y ? 1 : 6) * mean_at(column + x, row + y);
      weights[static_cast<size_t>(i)] = static_cast<float>(sum / 64 * row_solid_angle(row));
    }
  cells = ImageDistribution(width, height, weights);
}

LuminaireSample ReadyLuminaire::sample_sky(Vec2d u) const {
  if (cells.empty()) return {-luminaire.axis, kInfinity, {}, 0};
  const auto [direction, pdf] = sky_direction(u);
  return {Vec3f(direction), kInfinity, bands_from<Irradiance3>(colour * sky_at(direction) / pdf), bounded(pdf)};
}

EmittedPhoton ReadyLuminaire::emit_slide(Vec2d u) const {
  if (cells.empty()) return {Vec3d(0), Vec3f(parts[0].axis), {}};
  const Emitter& e = parts[0];
  const ImageDistribution::Cell cell = cells.sample(u);
  const Vec2d place((cell.column + cell.within.x) / image->width, (cell.row + cell.within.y) / image->height);
  const Vec3d towards = shared::gobo_direction_from_slide(e, place);
  const double r = glm::length(towards);
  const Vec3d direction = towards / r;
  const double cell_area = 4 * e.tan_half_angle * e.tan_half_angle / (double(image->width) * image->height);
  const double intensity = shared::cone_profile(e, direction) / (4 * kPi);
  return {Vec3d(0), Vec3f(direction),
          bands_from<Power3>(colour * slide_at({place, 1}) * (intensity * cell_area / (r * r * r * cell.probability)))};
}

EmittedPhoton ReadyLuminaire::emit_sky(Vec2d u, Vec2d v, const SceneSphere& scene) const {
  if (cells.empty()) return {scene.centre, luminaire.axis, {}};
  const auto [sky_place, pdf] = sky_direction(v);
  const Vec3d direction = -sky_place;
  return {shared::distant_origin(direction, u, scene.centre, scene.radius), Vec3f(direction),
          bands_from<Power3>(colour * sky_at(sky_place) * (kPi * scene.radius * scene.radius / pdf))};
}

// ---- the interface ----

bool gives_light(const Luminaire& l) {
  return l.enabled && (l.power.max() > 0 || l.irradiance.max() > 0 || l.radiance.max() > 0);
}

LuminaireSampler::LuminaireSampler(std::unique_ptr<const State> state) : state_(std::move(state)) {}
LuminaireSampler::LuminaireSampler(LuminaireSampler&&) noexcept = default;
LuminaireSampler& LuminaireSampler::operator=(LuminaireSampler&&) noexcept = default;
LuminaireSampler::~LuminaireSampler() = default;

Result<LuminaireSampler> LuminaireSampler::make(const Luminaire& luminaire) {
  auto state = std::make_unique<State>();
  state->luminaire = luminaire;
  TRY_STATUS(state->build());
  return LuminaireSampler(std::move(state));
}

LuminaireSample LuminaireSampler::sample(const Vec3d& receiver, Vec2f random) const {
  const State& s = *state_;
  Vec2d u(random);
  if (s.sky) return s.sample_sky(u);
  const State::Choice choice = s.choose(u);
  const EmitterSample e = s.member->sample(choice.part, receiver, u);
  Vec3d biradiance = s.colour * e.biradiance;
  if (s.slide) {
    const Vec3d place = shared::gobo_slide_from_direction(choice.part, -e.direction);
    biradiance = place.z > 0 ? biradiance * s.slide_at(place) : Vec3d(0);
  }
  return {Vec3f(e.direction), e.distance, bands_from<Irradiance3>(biradiance), bounded(e.pdf * choice.share)};
}

std::optional<LuminaireHit> LuminaireSampler::meet(const Vec3d& origin, const Vec3f& towards) const {
  const State& s = *state_;
  const Vec3d direction = safe_normalize(Vec3d(towards));
  EmitterHit hit = shared::no_emitter_hit();
  double share = 1;
  if (s.parts.size() == 1) {
    hit = s.member->meet(s.parts[0], origin, direction);
  } else {
    const int nearest = s.tree.nearest(origin, direction, [&](int i) {
      return s.member->meet(s.parts[static_cast<size_t>(i)], origin, direction).distance;
    });
    if (nearest < 0) return std::nullopt;
    const auto part = static_cast<size_t>(nearest);
    hit = s.member->meet(s.parts[part], origin, direction), share = s.share_of(part);
  }
  if (!(hit.distance >= 0)) return std::nullopt;
  if (s.sky)
    return LuminaireHit{hit.distance, bands_from<Radiance3>(s.colour * s.sky_at(direction)),
                        s.cells.empty() ? 0.0f : bounded(s.sky_pdf(direction))};
  return LuminaireHit{hit.distance, bands_from<Radiance3>(s.colour * (hit.radiance * share)), bounded(hit.pdf * share)};
}

EmittedPhoton LuminaireSampler::emit(Vec2f position, Vec2f direction, const SceneSphere& scene) const {
  const State& s = *state_;
  Vec2d u(position);
  const Vec2d v(direction);
  if (s.slide) return s.emit_slide(v);
  if (s.sky) return s.emit_sky(u, v, scene);
  const State::Choice choice = s.choose(u);
  const EmitterPhoton p = s.member->emit(choice.part, u, v, scene.centre, scene.radius);
  return {p.origin, Vec3f(p.direction), bands_from<Power3>(s.colour * p.power)};
}

Power3 LuminaireSampler::total_power() const {
  const Vec3d& p = state_->power;
  return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
}
float LuminaireSampler::surface_area() const { return static_cast<float>(state_->area); }
bool LuminaireSampler::impulse() const {
  // A sky has directions, though no place.
  return !(state_->member->keys & (shared::kKeyRadiance));
}
const Luminaire& LuminaireSampler::luminaire() const { return state_->luminaire; }

Result<LuminaireTables> luminaire_tables(const Luminaire& luminaire) {
  ReadyLuminaire ready;
  ready.luminaire = luminaire;
  TRY_STATUS(ready.build());
  LuminaireTables tables;
  tables.number = static_cast<uint32_t>(ready.member - kMembers);
  tables.keys = ready.member->keys;
  tables.colour = ready.colour;
  tables.parts = std::move(ready.parts), tables.areas = std::move(ready.areas), tables.area = ready.area;
  tables.slide = ready.slide && ready.image, tables.sky = ready.sky;
  if (tables.sky) tables.cells = ready.cells, tables.row_cosines = std::move(ready.row_cosines);
  return tables;
}

}  // namespace world
