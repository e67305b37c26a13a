/// Reads [[luminaire]] of a scene. Of the keys each kind takes those that its file documents:
///
///   kind = "rectangle"             required; a file world/luminaires/<kind>.shared.h
///   name = "lamp"                  the kind where missing
///   position = [0.5, 2.5, 0.5]     m; centre of the emitter. Required but of directional and hemisphere, and of
///                                  unified_point at infinity
///   direction = [0, -1, 0]         where it emits to; of directional where its light goes; of hemisphere the pole.
///                                  Required of directional; else down, and up for hemisphere
///   look_at = [1, 0, 3]            instead of direction, of kinds with a position
///   up = [0, 0, 1]                 upwards in its image or of its second edge; +y where missing, or +z where the
///                                  direction is vertical
///   power_w = [60, 60, 60]         W, >= 0, in three bands
///   irradiance = [800, 760, 700]   W/m^2 on a plane that faces it: directional
///   radiance = [1, 1, 1]           W/(m^2 sr): hemisphere; of rectangle, disk, sphere and mesh instead of power_w
///   size = [2, 1]                  m, [1e-6, 1e6]: rectangle, across up and along it
///   radius_m = 0.5                 m, [1e-6, 1e6]: disk, sphere. Of omni, spot, gobo and unified_point the distance
///   below
///                                  which its light grows no further: 0.01 where missing
///   half_angle_deg = 30            between axis and edge of the cone, [0, 180]: spot; gobo, in (0, 90); unified_point,
///                                  180 where missing
///   inner_half_angle_deg = 25      where a soft edge begins; a hard edge where missing or not smaller
///   attenuation = [0, 0, 1]        >= 0, of 1, r and r^2: unified_point
///   at_infinity = false            unified_point with w = 0: comes along its direction, attenuated by the first number
///   image = "window.png"           gobo: the slide; hemisphere: equirectangular, as hemisphere.shared.h says; .png,
///                                  .exr or .hdr, beside the scene. Its values scale the luminaire's
///   pattern = """                  gobo, instead of an image: rows of '#' (lets all light through), '.' (none), and
///   the
///   .##.                           digits 0 to 9 (so many tenths)
///   """
///   whole_sphere = false           hemisphere: from below its horizon too
///   sampling = "solid_angle"       or "area": rectangle, disk
///   file = "lamp.obj"              mesh: .obj or .ply, beside the scene
///   lambertian, glossy, global_illumination, shadows, enabled, visible = true
///                                  false takes it from matte reflection, from highlights, from indirect light, from
///                                  what casts shadows, altogether, from the camera's view
#include "world/luminaires/luminaire.h"

#include <cmath>
#include <numbers>
#include <sstream>

#include <fmt/format.h>

#include "world/luminaires/emitter.shared.h"
#include "world/luminaires/kinds.h"
#include "world/numbers/robust.h"

namespace world {

namespace {

using namespace shared;

constexpr double kBorder = kWorldBorder - 1;
constexpr double kRadians = std::numbers::pi / 180;
constexpr NumberRange kHalfAngleRange{.min = 0, .max = 180};
constexpr NumberRange kSlideAngleRange{.min = 0, .max = 90, .open_min = true, .open_max = true};
constexpr NumberRange kDirectionRange{.min = -1e30, .max = 1e30};
constexpr NumberRange kAttenuationRange{.min = 0, .max = 1e12};

/// Which keys of the table belong to which of emitter.shared.h.
struct KeyRow {
  const char* name;
  uint32_t keys;  // any of them
};
constexpr KeyRow kKeyRows[] = {
    {"position", kKeyPlace},
    {"direction", kKeyAxis},
    {"look_at", kKeyAxis},
    {"up", kKeyUp},
    {"power_w", kKeyPower},
    {"irradiance", kKeyIrradiance},
    {"radiance", kKeyRadiance},
    {"size", kKeyExtent},
    {"radius_m", kKeyRadius | kKeyClamp},
    {"half_angle_deg", kKeyCone},
    {"inner_half_angle_deg", kKeySoftEdge},
    {"attenuation", kKeyAttenuation},
    {"at_infinity", kKeyAttenuation},
    {"image", kKeySlide | kKeySky},
    {"pattern", kKeySlide},
    {"whole_sphere", kKeySky},
    {"sampling", kKeySampling},
    {"file", kKeyFile},
};

struct Reader {
  TomlTable& table;
  Luminaire& l;
  uint32_t keys;

  bool takes(uint32_t key) const { return keys & key; }

  /// Keys that only other kinds have.
  void refuse_others() {
    std::string own;
    for (const KeyRow& row : kKeyRows)
      if (takes(row.keys)) own += (own.empty() ? "" : ", ") + std::string(row.name);
    for (const KeyRow& row : kKeyRows) {
      if (takes(row.keys) || !table.has(row.name)) continue;
      table.fail(row.name,
                 fmt::format("a luminaire of kind '{}' has no '{}'; of such keys it has {}", l.kind, row.name, own));
      bool known;  // the message above comes first
      table.read(row.name, known);
    }
  }

  template <class Bands>
  bool bands(const char* key, Bands& out, NumberRange range) {
    float v[3];
    if (!table.read(key, std::span<float>(v), range)) return false;
    out = {v[0], v[1], v[2]};
    return true;
  }

  std::optional<Vec3d> vector(const char* key, NumberRange range) {
    double v[3];
    if (!table.read(key, std::span<double>(v), range)) return std::nullopt;
    return Vec3d(v[0], v[1], v[2]);
  }

  void place(VoxelPos offset, std::optional<Vec3d>& position) {
    if (!takes(kKeyPlace)) return;
    if (takes(kKeyAttenuation)) table.read("at_infinity", l.at_infinity);
    double v[3];
    const std::span<double> out(v);
    const NumberRange inside{-kBorder, kBorder};
    if (!(l.at_infinity ? table.read("position", out, inside) : table.require("position", out, inside))) return;
    position = Vec3d(v[0], v[1], v[2]);
    l.position = WorldPoint::from(v[0], v[1], v[2]);
    l.position.voxel = l.position.voxel + offset;
  }

  void axis(const std::optional<Vec3d>& position) {
    if (takes(kKeySky)) l.axis = {0, 1, 0};
    if (!takes(kKeyAxis)) return;
    std::optional<Vec3d> to = vector("direction", kDirectionRange);
    if (takes(kKeyPlace) && table.has("look_at")) {
      if (table.has("direction")) table.fail("look_at", "'look_at' and 'direction' exclude each other");
      const auto target = vector("look_at", {-kBorder, kBorder});
      if (target && position) to = *target - *position;
    } else if (table.has("look_at")) {
      table.fail("look_at", fmt::format("'look_at' needs a position, which '{}' has not; say 'direction'", l.kind));
      bool known;
      table.read("look_at", known);
    } else if (takes(kKeyIrradiance) && !table.has("direction")) {
      table.require("direction", std::span<double>());
    }
    if (!to) return;
    if (*to == Vec3d(0))
      table.fail(table.has("direction") ? "direction" : "look_at",
                 table.has("direction") ? "'direction' must not be zero" : "'look_at' must differ from 'position'");
    l.axis = Vec3f(safe_normalize(*to, Vec3d(l.axis)));
  }

  void up() {
    const Vec3d axis(l.axis);
    Vec3d wanted = std::abs(axis.y) < 0.999 ? Vec3d(0, 1, 0) : Vec3d(0, 0, 1);
    if (takes(kKeyUp))
      if (const auto given = vector("up", kDirectionRange)) {
        const Vec3d direction = safe_normalize(*given, Vec3d(0));
        if (glm::length(glm::cross(direction, axis)) < 1e-6)
          table.fail("up", "'up' must not be zero, and not parallel to the direction");
        else
          wanted = direction;
      }
    l.up = Vec3f(safe_normalize(wanted - glm::dot(wanted, axis) * axis));
  }

  void strength() {
    const bool power = takes(kKeyPower) && table.has("power_w"),
               radiance = takes(kKeyRadiance) && table.has("radiance");
    if (takes(kKeyPower)) bands("power_w", l.power, kPowerRange);
    if (takes(kKeyRadiance)) bands("radiance", l.radiance, kRadianceRange);
    if (takes(kKeyPower) && takes(kKeyRadiance)) {
      if (power && radiance) table.fail("radiance", "'radiance' and 'power_w' exclude each other");
      if (!power && !radiance) table.fail({}, "the luminaire needs 'power_w' or 'radiance'");
    } else if (takes(kKeyPower) && !power) {
      table.require("power_w", std::span<float>());
    } else if (takes(kKeyRadiance) && !radiance) {
      if (takes(kKeySky) && table.has("image"))
        l.radiance = {1, 1, 1};
      else
        table.require("radiance", std::span<float>());
    }
    if (takes(kKeyIrradiance) && !bands("irradiance", l.irradiance, kRadianceRange) && !table.has("irradiance"))
      table.require("irradiance", std::span<float>());
  }

  void shape() {
    if (takes(kKeyExtent)) {
      float v[2];
      if (table.require("size", std::span<float>(v), kSizeRange)) l.extent = {v[0], v[1]};
    }
    if (takes(kKeyRadius)) table.require("radius_m", l.radius, kSizeRange);
    if (takes(kKeyClamp)) {
      l.radius = static_cast<float>(kUsualClamp);
      table.read("radius_m", l.radius, kSizeRange);
    }
    if (takes(kKeyCone)) {
      double degrees = 180;
      const NumberRange range = takes(kKeySlide) ? kSlideAngleRange : kHalfAngleRange;
      if (takes(kKeySoftEdge))
        table.require("half_angle_deg", degrees, range);
      else
        table.read("half_angle_deg", degrees, range);
      l.half_angle = static_cast<float>(degrees * kRadians);
      l.inner_half_angle = l.half_angle;
      if (takes(kKeySoftEdge) && table.read("inner_half_angle_deg", degrees, kHalfAngleRange))
        l.inner_half_angle = std::min(l.half_angle, static_cast<float>(degrees * kRadians));
    }
    if (takes(kKeyAttenuation)) {
      float v[3];
      if (table.read("attenuation", std::span<float>(v), kAttenuationRange)) l.attenuation = {v[0], v[1], v[2]};
      if (l.at_infinity && !(l.attenuation.x > 0))
        table.fail("attenuation", "at infinity 'attenuation' must begin with a number above 0");
      else if (l.attenuation == Vec3f(0))
        table.fail("attenuation", "'attenuation' must have a number above 0");
    }
  }

  /// A slide drawn in the scene itself.
  void pattern() {
    std::string text, row;
    if (!table.read("pattern", text)) return;
    auto image = std::make_shared<LightImage>();
    std::istringstream rows(text);
    while (std::getline(rows, row)) {
      if (row.empty()) continue;
      if (image->height == 0) image->width = static_cast<int>(row.size());
      const bool known = row.find_first_not_of("0123456789.#") == std::string::npos;
      if (!known || row.size() != static_cast<size_t>(image->width)) {
        table.fail("pattern", "'pattern' must have rows of one length, of '#', '.' and the digits 0 to 9");
        return;
      }
      for (const char c : row) {
        const float share = c == '#' ? 1.0f : c == '.' ? 0.0f : static_cast<float>(c - '0') / 10;
        image->pixels.push_back({share, share, share});
      }
      ++image->height;
    }
    if (image->height == 0) table.fail("pattern", "'pattern' must have a row");
    l.light_image = std::move(image);
  }

  void files(const std::filesystem::path& folder) {
    const auto beside_the_scene = [&](const char* key, std::string& path, bool required) {
      if (!(required ? table.require(key, path) : table.read(key, path))) return;
      if (path.empty()) table.fail(key, fmt::format("'{}' must name a file", key));
      if (std::filesystem::path(path).is_relative()) path = (folder / path).string();
    };
    if (takes(kKeySlide) && table.has("pattern"))
      pattern();
    else if (takes(kKeySlide | kKeySky))
      beside_the_scene("image", l.image, takes(kKeySlide));
    if (takes(kKeySky)) table.read("whole_sphere", l.whole_sphere);
    if (takes(kKeyFile)) beside_the_scene("file", l.mesh_file, true);
    if (takes(kKeySampling)) {
      constexpr std::string_view kSamplings[] = {"solid_angle", "area"};
      int sampling = 0;
      table.read_choice("sampling", sampling, kSamplings);
      l.uniform_area = sampling == 1;
    }
  }
};

}  // namespace

Luminaire read_luminaire(TomlTable& table, VoxelPos offset, const std::filesystem::path& folder) {
  Luminaire l;
  l.where = table.where();
  std::vector<std::string_view> names;
  for (const LuminaireKind& kind : luminaire_members()) names.push_back(kind.name);
  int index = 0;
  if (!table.has("kind")) table.require("kind", l.kind);
  const bool known = table.read_choice("kind", index, names);
  const LuminaireKind& kind = luminaire_members()[static_cast<size_t>(index)];
  if (known) l.kind = kind.name;
  l.name = l.kind;
  table.read("name", l.name);
  for (const auto& [key, flag] : {std::pair{"lambertian", &l.lambertian},
                                  {"glossy", &l.glossy},
                                  {"global_illumination", &l.global_illumination},
                                  {"shadows", &l.shadows},
                                  {"enabled", &l.enabled},
                                  {"visible", &l.visible}})
    table.read(key, *flag);
  Reader reader{table, l, known ? kind.keys : ~0u};
  if (known) reader.refuse_others();
  std::optional<Vec3d> position;
  reader.place(offset, position);
  reader.axis(position);
  reader.up();
  reader.strength();
  reader.shape();
  reader.files(folder);
  return l;
}

std::vector<std::string> luminaire_kinds() {
  std::vector<std::string> names;
  for (const LuminaireKind& kind : luminaire_members()) names.emplace_back(kind.name);
  return names;
}

Status check_luminaire(const Luminaire& l) {
  uint32_t keys = 0;
  for (const LuminaireKind& kind : luminaire_members())
    if (kind.name == l.kind) keys = kind.keys;
  const auto check = [&](uint32_t key, const char* what, std::initializer_list<float> values,
                         const NumberRange& range) -> Status {
    if (!(keys & key)) return {};
    for (const float v : values)
      if (!range.contains(v))
        return input_error(fmt::format("{}{}luminaire '{}': {} is {}, but must be {}", l.where,
                                       l.where.empty() ? "" : ": ", l.name, what, number_text(v), range.text()));
    return {};
  };
  TRY_STATUS(check(kKeyPower, "power", {l.power.r, l.power.g, l.power.b}, kPowerRange));
  TRY_STATUS(check(kKeyIrradiance, "irradiance", {l.irradiance.r, l.irradiance.g, l.irradiance.b}, kRadianceRange));
  TRY_STATUS(check(kKeyRadiance, "radiance", {l.radiance.r, l.radiance.g, l.radiance.b}, kRadianceRange));
  TRY_STATUS(check(kKeyExtent, "size", {l.extent.x, l.extent.y}, kSizeRange));
  TRY_STATUS(check(kKeyRadius, "radius", {l.radius}, kSizeRange));
  TRY_STATUS(check(kKeyClamp, "radius", {l.radius}, {.min = 0, .max = kSizeRange.max}));
  TRY_STATUS(check(kKeyCone, "half angle in radians", {l.half_angle}, {.min = 0, .max = 3.14159275}));
  TRY_STATUS(
      check(kKeyAttenuation, "attenuation", {l.attenuation.x, l.attenuation.y, l.attenuation.z}, kAttenuationRange));
  for (const auto& [key, what, v] : {std::tuple{kKeyAxis, "axis", l.axis}, {kKeyUp, "up", l.up}})
    if ((keys & key) && !(std::abs(glm::dot(v, v) - 1) < 1e-3f))
      return input_error(fmt::format("{}{}luminaire '{}': {} must have the length 1", l.where,
                                     l.where.empty() ? "" : ": ", l.name, what));
  if ((keys & kKeyAttenuation) && !((l.at_infinity ? l.attenuation.x : glm::dot(l.attenuation, Vec3f(1))) > 0))
    return input_error(fmt::format("{}{}luminaire '{}': attenuation must have a number above 0, at infinity the first",
                                   l.where, l.where.empty() ? "" : ": ", l.name));
  return {};
}

}  // namespace world
