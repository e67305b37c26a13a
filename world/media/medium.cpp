#include "world/media/medium.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "world/base/text.h"
#include "world/media/brick_field.h"
#include "world/media/every_medium.shared.h"
#include "world/numbers/robust.h"
#include "world/space/grid_walk.h"

namespace world {

namespace {

using shared::MediumShape;

constexpr double kBorder = kWorldBorder - 1;

MediumShape shape_of(const Medium& m) { return {Vec3d(m.half_extent), Vec3d(m.normal), double{m.scale_height}}; }

/// What the functions of medium.h need of a member. t0 <= t1 within the span.
struct Kind {
  std::string_view name;
  uint32_t keys;
  glm::dvec2 (*span)(const Medium&, const Vec3d& origin, const Vec3d& direction);
  double (*density)(const Medium&, const Vec3d& point);
  double (*depth)(const Medium&, const Vec3d& origin, const Vec3d& direction, double t0, double t1);
  double (*largest)(const Medium&, const Vec3d& origin, const Vec3d& direction, double t0, double t1);
  double (*reach)(const Medium&, const Vec3d& origin, const Vec3d& direction, double t0, double t1, double depth);
};

// --- the one member without closed form: a table -------------------------------------------------------------------

glm::dvec2 grid_span(const Medium& m, const Vec3d& origin, const Vec3d& direction) {
  if (!m.field || m.field->max() == 0) return shared::medium_nowhere();
  Vec3d low, high;
  m.field->bounds(low, high);
  low *= m.voxel_size, high *= m.voxel_size;
  // The same slabs as a box of fog, around another middle.
  const Vec3d middle = 0.5 * (low + high);
  return shared::box_fog_span({0.5 * (high - low), Vec3d(0, 1, 0), 1}, origin - middle, direction);
}
double grid_density(const Medium& m, const Vec3d& point) {
  return m.field ? m.field->density(point / double{m.voxel_size}) : 0;
}
double grid_depth(const Medium& m, const Vec3d& origin, const Vec3d& direction, double t0, double t1) {
  return m.field->depth(origin / double{m.voxel_size}, direction / double{m.voxel_size}, t0, t1);
}
double grid_largest(const Medium& m, const Vec3d& origin, const Vec3d& direction, double t0, double t1) {
  double largest = 0;
  m.field->pieces(origin / double{m.voxel_size}, direction / double{m.voxel_size}, t0, t1, [&](double, double here) {
    largest = std::max(largest, here);
    return true;
  });
  return largest;
}
double grid_reach(const Medium& m, const Vec3d& origin, const Vec3d& direction, double t0, double t1, double depth) {
  return m.field->reach(origin / double{m.voxel_size}, direction / double{m.voxel_size}, t0, t1, depth);
}

// --- the table of members -------------------------------------------------------------------------------------------

const std::vector<Kind>& kinds() {
  static const std::vector<Kind> table = [] {
    std::vector<Kind> t = {
#define MEDIUM(name)                                                                                       \
  {#name,                                                                                                  \
   shared::name##_keys,                                                                                    \
   [](const Medium& m, const Vec3d& o, const Vec3d& d) { return shared::name##_span(shape_of(m), o, d); }, \
   [](const Medium& m, const Vec3d& p) { return shared::name##_density(shape_of(m), p); },                 \
   [](const Medium& m, const Vec3d& o, const Vec3d& d, double t0, double t1) {                             \
     return shared::name##_depth(shape_of(m), o, d, t0, t1);                                               \
   },                                                                                                      \
   [](const Medium& m, const Vec3d& o, const Vec3d& d, double t0, double t1) {                             \
     return shared::name##_largest(shape_of(m), o, d, t0, t1);                                             \
   },                                                                                                      \
   [](const Medium& m, const Vec3d& o, const Vec3d& d, double t0, double, double depth) {                  \
     return shared::name##_reach(shape_of(m), o, d, t0, depth);                                            \
   }},
#include "world_media.list.h"
#undef MEDIUM
        {"density_grid", shared::kMediumPosition | shared::kMediumGrid, grid_span, grid_density, grid_depth,
         grid_largest, grid_reach}};
    std::sort(t.begin(), t.end(), [](const Kind& a, const Kind& b) { return a.name < b.name; });
    return t;
  }();
  return table;
}

const Kind& kind_of(const Medium& medium) {
  if (medium.kind_number >= 0) return kinds()[static_cast<size_t>(medium.kind_number)];
  for (const Kind& kind : kinds())
    if (kind.name == medium.kind) return kind;
  CHECK_EQ(medium.kind, "one of medium_kinds()");
  std::abort();
}

bool finite(const Vec3d& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

/// [t0, t1] within the medium.
MediumInterval inside(const Kind& kind, const Medium& m, const Vec3d& origin, const Vec3d& direction, double t0,
                      double t1) {
  if (!finite(origin) || !finite(direction)) return {};
  const glm::dvec2 span = kind.span(m, origin, direction);
  const MediumInterval in{std::max(t0, span.x), std::min(t1, span.y)};
  return in.empty() ? MediumInterval{} : in;
}

// --- reading --------------------------------------------------------------------------------------------------------

/// Three numbers, or one that stands for three.
bool read_bands(TomlTable& table, const char* key, auto& bands, NumberRange range) {
  float v[3];
  if (table.has_array(key)) {
    if (!table.read(key, std::span<float>(v), range)) return false;
  } else {
    if (!table.read(key, v[0], range)) return false;
    v[1] = v[2] = v[0];
  }
  bands = {v[0], v[1], v[2]};
  return true;
}

void read_grid(TomlTable& table, Medium& medium, const std::filesystem::path& folder) {
  std::string file, layer;
  table.read("voxel_size_m", medium.voxel_size, {.min = 1e-6, .max = 1e6});
  constexpr std::string_view samplings[] = {"nearest", "trilinear"};
  int sampling = static_cast<int>(medium.sampling), extend = 0;
  if (table.read_choice("sampling", sampling, samplings)) medium.sampling = static_cast<FieldSampling>(sampling);
  const bool from_file = table.read("file", file), from_layer = table.read("layer", layer);
  table.read("extend_voxels", extend, {.min = 0, .max = 256});
  if (from_file == from_layer)
    return table.fail({}, "a density_grid needs either file = \"...\" or layer = \"density\"");
  if (from_layer) {
    if (layer != "density") table.fail("layer", "'layer' is '" + layer + "', but must be 'density'");
    if (extend > 0) table.fail("extend_voxels", "'extend_voxels' is for grids of files");
    return;
  }
  std::filesystem::path path = file;
  if (path.is_relative()) path = folder / path;
  auto field = read_vol_file(path, medium.sampling, extend);
  if (field.ok())
    medium.field = *field;
  else
    table.fail("file", field.error().message);
}

}  // namespace

std::vector<std::string> medium_kinds() {
  std::vector<std::string> names;
  for (const Kind& kind : kinds()) names.emplace_back(kind.name);
  return names;
}

Medium read_medium(TomlTable& table, VoxelPos offset, const std::filesystem::path& folder) {
  Medium medium;
  medium.where = table.where();
  table.require("name", medium.name);
  const std::vector<std::string> names = medium_kinds();
  bool known = false;
  if (table.require("kind", medium.kind)) {
    const auto found = std::find(names.begin(), names.end(), medium.kind);
    known = found != names.end();
    if (known)
      medium.kind_number = static_cast<int>(found - names.begin());
    else
      table.fail("kind", fmt::format("'kind' is '{}', but must be one of {} (did you mean '{}'?)", medium.kind,
                                     fmt::join(names, ", "), nearest_text(medium.kind, names)));
  }
  const uint32_t keys = known ? kinds()[static_cast<size_t>(medium.kind_number)].keys : 0;
  const NumberRange extinction{.min = 0, .max = 1e9};
  read_bands(table, "absorption_per_m", medium.absorption, extinction);
  read_bands(table, "scattering_per_m", medium.scattering, extinction);
  read_bands(table, "emission", medium.emission, {.min = 0, .max = 1e9});
  table.read("anisotropy", medium.anisotropy, {-1, 1, true, true});

  // Of a kind that nobody knows all keys are taken, so that the kind's own problem is the one that is told.
  const auto takes = [&](uint32_t key) { return !known || (keys & key) != 0; };
  double position[3] = {0, 0, 0}, normal[3];
  if (takes(shared::kMediumPosition)) table.read("position", std::span<double>(position), {-kBorder, kBorder});
  medium.position = WorldPoint::from(position[0], position[1], position[2]);
  medium.position.voxel = medium.position.voxel + offset;
  float half[3];
  if ((keys & shared::kMediumHalfExtent) != 0 &&
      table.require("half_extent", std::span<float>(half), NumberRange{.min = 1e-6, .max = 1e9}))
    medium.half_extent = {half[0], half[1], half[2]};
  if (takes(shared::kMediumNormal) && table.read("normal", std::span<double>(normal), {-1e6, 1e6})) {
    const Vec3d n(normal[0], normal[1], normal[2]);
    if (n == Vec3d(0)) table.fail("normal", "'normal' must not be 0");
    medium.normal = Vec3f(safe_normalize(n));
  }
  if ((keys & shared::kMediumScaleHeight) != 0)
    table.require("scale_height_m", medium.scale_height, NumberRange{.min = 1e-3, .max = 1e9});
  if ((keys & shared::kMediumGrid) != 0) read_grid(table, medium, folder);
  return medium;
}

// --- along a ray ----------------------------------------------------------------------------------------------------

MediumInterval medium_interval(const Medium& medium, const Vec3d& origin, const Vec3d& direction, double t_max) {
  return inside(kind_of(medium), medium, origin, direction, 0, t_max);
}

double medium_density(const Medium& medium, const Vec3d& point) {
  return finite(point) ? kind_of(medium).density(medium, point) : 0;
}

double medium_density_max(const Medium& medium, const Vec3d& origin, const Vec3d& direction, double t0, double t1) {
  const Kind& kind = kind_of(medium);
  const MediumInterval in = inside(kind, medium, origin, direction, t0, t1);
  return in.empty() ? 0 : kind.largest(medium, origin, direction, in.t0, in.t1);
}

double medium_depth(const Medium& medium, const Vec3d& origin, const Vec3d& direction, double t0, double t1) {
  const Kind& kind = kind_of(medium);
  const MediumInterval in = inside(kind, medium, origin, direction, t0, t1);
  return in.empty() ? 0 : kind.depth(medium, origin, direction, in.t0, in.t1);
}

double medium_reach(const Medium& medium, const Vec3d& origin, const Vec3d& direction, double t0, double t1,
                    double depth) {
  if (!(depth > 0)) return t0;
  const Kind& kind = kind_of(medium);
  const MediumInterval in = inside(kind, medium, origin, direction, t0, t1);
  if (in.empty()) return kInfinity;
  const double t = kind.reach(medium, origin, direction, in.t0, in.t1, depth);
  return t < in.t1 ? t : kInfinity;
}

void medium_pieces(const Medium& medium, const Vec3d& origin, const Vec3d& direction, double t0, double t1,
                   FunctionRef<bool(double end, double largest)> visit) {
  const Kind& kind = kind_of(medium);
  const MediumInterval in = inside(kind, medium, origin, direction, t0, t1);
  if (in.empty()) {
    visit(t1, 0);
    return;
  }
  if (in.t0 > t0 && !visit(in.t0, 0)) return;
  if (medium.field) {
    bool going = true;
    const double scale = medium.voxel_size;
    medium.field->pieces(origin / scale, direction / scale, in.t0, in.t1,
                         [&](double end, double largest) { return going = visit(end, largest); });
    if (!going) return;
  } else {
    // Where the density changes along the ray, pieces over which it changes e-fold; but one for all that is above 40
    // scale heights on the way down, and one for what is left after kMostPieces.
    constexpr int kMostPieces = 1024;
    const bool changes = (kind.keys & shared::kMediumScaleHeight) != 0 && direction.y != 0;
    const double fold = changes ? medium.scale_height / std::abs(direction.y) : kInfinity;
    double at = in.t0;
    if (changes && direction.y < 0) {
      const double end = std::min((origin.y - 40.0 * medium.scale_height) / -direction.y, in.t1);
      if (end > at) {
        if (!visit(end, kind.largest(medium, origin, direction, at, end))) return;
        at = end;
      }
    }
    for (int i = 1; at < in.t1; ++i) {
      const double end = i >= kMostPieces ? in.t1 : std::min(at + fold, in.t1);
      if (!visit(end, kind.largest(medium, origin, direction, at, end))) return;
      at = end;
    }
  }
  if (in.t1 < t1) visit(t1, 0);
}

}  // namespace world
