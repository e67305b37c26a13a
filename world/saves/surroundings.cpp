#include "world/saves/surroundings.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "world/base/text.h"
#include "world/base/toml_reader.h"
#include "world/luminaires/kinds.h"
#include "world/store/density_field.h"

namespace world {

namespace {

constexpr size_t kRecordsPerRow = 256;
const std::string kStateKey = "scene.state.";

constexpr NumberRange kNotNegative{.min = 0};
constexpr NumberRange kPart{.min = 0, .max = 1, .open_max = true};
constexpr NumberRange kBorder{-(kWorldBorder - 1.0), kWorldBorder - 1.0};

// ---- values ----------------------------------------------------------------------------------------------------

/// Of a float or double. TOML's whole number -0 would be 0, its float isn't.
template <class Number>
std::string exact_text(Number v) {
  return v == 0 && std::signbit(v) ? "-0.0" : number_text(v);
}

template <class... Numbers>
std::string array_text(Numbers... numbers) {
  std::string text;
  ((text += (text.empty() ? "[" : ", ") + exact_text(numbers)), ...);
  return text + "]";
}

std::string text_of(const std::string& v) { return toml_text(v); }
std::string text_of(bool v) { return v ? "true" : "false"; }
std::string text_of(float v) { return exact_text(v); }
std::string text_of(double v) { return exact_text(v); }
std::string text_of(uint64_t v) { return std::to_string(v); }
std::string text_of(FieldSampling v) { return std::to_string(static_cast<int>(v)); }
std::string text_of(const glm::vec2& v) { return array_text(v.x, v.y); }
std::string text_of(const Vec3f& v) { return array_text(v.x, v.y, v.z); }
std::string text_of(const Vec3d& v) { return array_text(v.x, v.y, v.z); }
template <class U>
std::string text_of(const Bands3<U>& v) {
  return array_text(v.r, v.g, v.b);
}
/// The voxel, then the fraction: exact wherever it lies.
std::string text_of(const WorldPoint& p) {
  return array_text(double(p.voxel.x), double(p.voxel.y), double(p.voxel.z), p.fraction.x, p.fraction.y, p.fraction.z);
}
std::string text_of(const VoxelBox& b) {
  return fmt::format("[{}, {}, {}, {}, {}, {}]", b.min.x, b.min.y, b.min.z, b.max.x, b.max.y, b.max.z);
}
std::string text_of(const glm::dmat3& m) {
  return array_text(m[0].x, m[0].y, m[0].z, m[1].x, m[1].y, m[1].z, m[2].x, m[2].y, m[2].z);
}

bool read_value(TomlTable& t, const char* key, std::string& v, NumberRange) { return t.read(key, v); }
bool read_value(TomlTable& t, const char* key, bool& v, NumberRange) { return t.read(key, v); }
bool read_value(TomlTable& t, const char* key, float& v, NumberRange range) { return t.read(key, v, range); }
bool read_value(TomlTable& t, const char* key, double& v, NumberRange range) { return t.read(key, v, range); }
bool read_value(TomlTable& t, const char* key, uint64_t& v, NumberRange) { return t.read(key, v); }
bool read_value(TomlTable& t, const char* key, FieldSampling& v, NumberRange) {
  int32_t number = 0;
  if (!t.read(key, number, {.min = 0, .max = 1})) return false;
  v = static_cast<FieldSampling>(number);
  return true;
}
template <class Number, int n, class Set>
bool read_numbers(TomlTable& t, const char* key, NumberRange range, Set set) {
  Number v[n];
  if (!t.read(key, std::span<Number>(v), range)) return false;
  set(v);
  return true;
}
bool read_value(TomlTable& t, const char* key, glm::vec2& v, NumberRange range) {
  return read_numbers<float, 2>(t, key, range, [&](const float* n) { v = {n[0], n[1]}; });
}
bool read_value(TomlTable& t, const char* key, Vec3f& v, NumberRange range) {
  return read_numbers<float, 3>(t, key, range, [&](const float* n) { v = {n[0], n[1], n[2]}; });
}
bool read_value(TomlTable& t, const char* key, Vec3d& v, NumberRange range) {
  return read_numbers<double, 3>(t, key, range, [&](const double* n) { v = {n[0], n[1], n[2]}; });
}
template <class U>
bool read_value(TomlTable& t, const char* key, Bands3<U>& v, NumberRange range) {
  return read_numbers<float, 3>(t, key, range, [&](const float* n) { v = {n[0], n[1], n[2]}; });
}
bool read_value(TomlTable& t, const char* key, WorldPoint& p, NumberRange) {
  return read_numbers<double, 6>(t, key, kBorder, [&](const double* n) {
    for (int axis = 0; axis < 3; ++axis) {
      if (n[axis] != std::floor(n[axis]) || !kPart.contains(n[3 + axis]))
        t.fail(key, "a place is a voxel, three whole numbers, and a fraction of it, three numbers in [0, 1)");
      p.voxel[axis] = static_cast<int32_t>(n[axis]);
      p.fraction[axis] = n[3 + axis];
    }
  });
}
bool read_value(TomlTable& t, const char* key, VoxelBox& b, NumberRange) {
  return read_numbers<int32_t, 6>(t, key, kBorder, [&](const int32_t* n) {
    b = {{n[0], n[1], n[2]}, {n[3], n[4], n[5]}};
    if (b.empty()) t.fail(key, "a box is its lowest voxel and its highest");
  });
}
bool read_value(TomlTable& t, const char* key, glm::dmat3& m, NumberRange range) {
  return read_numbers<double, 9>(t, key, range, [&](const double* n) {
    for (int c = 0; c < 3; ++c) m[c] = {n[3 * c], n[3 * c + 1], n[3 * c + 2]};
  });
}

// ---- records: what each holds, once for writing and reading ------------------------------------------------------

#define FIELD(name, ...) v.field(#name, r.name, usual.name __VA_OPT__(, ) __VA_ARGS__)

template <class Visitor>
void visit_record(Visitor& v, Luminaire& r) {
  const Luminaire usual;
  FIELD(name), FIELD(kind), FIELD(position), FIELD(axis), FIELD(up);
  FIELD(power), FIELD(irradiance), FIELD(radiance), FIELD(extent), FIELD(radius);
  FIELD(half_angle), FIELD(inner_half_angle), FIELD(attenuation);
  FIELD(at_infinity), FIELD(whole_sphere), FIELD(uniform_area);
  FIELD(image), FIELD(mesh_file);
  FIELD(lambertian), FIELD(glossy), FIELD(global_illumination), FIELD(shadows), FIELD(enabled), FIELD(visible);
  v.asset("light_image", r.light_image);
  v.asset("triangles", r.triangles);
}

template <class Visitor>
void visit_record(Visitor& v, Medium& r) {
  const Medium usual;
  FIELD(name), FIELD(kind), FIELD(position);
  FIELD(absorption, kNotNegative), FIELD(scattering, kNotNegative), FIELD(emission, kNotNegative);
  FIELD(anisotropy, {.min = -1, .max = 1, .open_min = true, .open_max = true});
  FIELD(half_extent, {.min = 0, .open_min = true}), FIELD(normal), FIELD(scale_height, kNotNegative);
  FIELD(voxel_size, {.min = 1e-6, .max = 1e6}), FIELD(sampling);
  v.asset("field", r.field, r.sampling);
  v.own_layer(r);
}

template <class Visitor>
void visit_record(Visitor& v, MeshInstance& r) {
  const MeshInstance usual;
  FIELD(name), FIELD(file), FIELD(position), FIELD(transform), FIELD(block), FIELD(null_surface);
  FIELD(interior_medium), FIELD(radiance, kNotNegative), FIELD(smooth);
  FIELD(checker_block), FIELD(checkers, kNotNegative), FIELD(degenerate);
  v.asset("mesh", r.mesh);
}

template <class Visitor>
void visit_record(Visitor& v, CameraPlacement& r) {
  const CameraPlacement usual;
  FIELD(name), FIELD(position), FIELD(forward);
  FIELD(vertical_fov_deg, {.min = 0, .max = 180, .open_min = true, .open_max = true});
  FIELD(lens_radius_m, kNotNegative), FIELD(focus_distance_m, {.min = 0, .open_min = true});
}

template <class Visitor>
void visit_record(Visitor& v, BodyRequest& r) {
  const BodyRequest usual;
  FIELD(name), FIELD(position);
  FIELD(size, {.min = 1.0 / 256, .max = 64}), FIELD(velocity, {.min = -1000, .max = 1000});
  FIELD(density_kg_per_m3, {.min = 1, .max = 1e5});
  FIELD(restitution, {.min = 0, .max = 1}), FIELD(friction, {.min = 0, .max = 10});
}

template <class Visitor>
void visit_record(Visitor& v, ParticleSource& r) {
  const ParticleSource usual;
  FIELD(kind), FIELD(box), FIELD(per_s, {.min = 0, .max = 1e8});
  FIELD(velocity, {.min = -1000, .max = 1000}), FIELD(spread_mps, {.min = 0, .max = 1000});
  FIELD(brings), FIELD(mm_per_h, {.min = 0, .max = 1e6});
}

#undef FIELD

// ---- writing -----------------------------------------------------------------------------------------------------

struct Writer {
  std::string& text;
  std::map<std::vector<int64_t>, Asset>& assets;
  std::map<const void*, std::vector<int64_t>>& known;  // what several records share is looked through once

  template <class T>
  void field(const char* key, const T& value, const T& usual, NumberRange = {}) {
    std::string all = text_of(value);
    if (all != text_of(usual)) text += fmt::format("{} = {}\n", key, all);
  }
  void keep(const char* key, Asset&& asset) {
    std::string keys;
    for (const int64_t part : asset.parts)
      keys += fmt::format("{}\"{:016x}\"", keys.empty() ? "" : ", ", static_cast<uint64_t>(part));
    text += fmt::format("{} = [{}]\n", key, keys);
    std::vector<int64_t> parts = asset.parts;
    assets.try_emplace(std::move(parts), std::move(asset));
  }
  template <class T, class... More>
  void asset(const char* key, const std::shared_ptr<const T>& shared, More... more) {
    if (!shared) return;
    const auto found = known.find(shared.get());
    Asset made = found == known.end() ? asset_of(shared, more...) : assets.at(found->second);
    known.try_emplace(shared.get(), made.parts);
    keep(key, std::move(made));
  }
  void asset(const char* key, const std::vector<Vec3f>& triangles) {
    if (!triangles.empty()) keep(key, asset_of(triangles));
  }
  void own_layer(const Medium& medium) {
    if (medium.kind == "density_grid" && !medium.field) text += "layer = \"density\"\n";
  }
};

template <class Record>
void put_records(const char* kind, std::vector<Record> records, std::map<std::string, std::string>& rows,
                 std::map<std::vector<int64_t>, Asset>& assets, std::map<const void*, std::vector<int64_t>>& known) {
  for (size_t i = 0; i < records.size(); ++i) {
    std::string& text = rows[fmt::format("scene.{}.{:06}", kind, i / kRecordsPerRow)];
    text += fmt::format("[[{}]]\n", kind);
    Writer writer{text, assets, known};
    visit_record(writer, records[i]);
  }
}

/// Without the fields that say what the world's own layer says: that is saved by its regions.
std::vector<Medium> without_copies(std::vector<Medium> media, const FloatLayer* layer) {
  if (!layer) return media;
  std::map<const void*, bool> is_copy;
  for (Medium& medium : media) {
    if (medium.kind != "density_grid" || !medium.field) continue;
    const auto [found, is_new] = is_copy.try_emplace(medium.field.get(), false);
    if (is_new) found->second = is_copy_of(*medium.field, *layer);
    if (found->second) medium.field.reset();
  }
  return media;
}

// ---- reading -----------------------------------------------------------------------------------------------------

struct Reader {
  TomlTable& table;
  AssetReader& assets;

  template <class T>
  void field(const char* key, T& value, const T&, NumberRange range = {}) {
    read_value(table, key, value, range);
  }
  bool parts(const char* key, std::vector<int64_t>& out) {
    std::vector<std::string> texts;
    if (!table.read(key, texts)) return false;
    for (const std::string& text : texts) {
      uint64_t number = 0;
      const char* const end = text.data() + text.size();
      const auto parsed = std::from_chars(text.data(), end, number, 16);
      if (parsed.ec != std::errc() || parsed.ptr != end) {
        table.fail(key, "a part is named by a hexadecimal number");
        return false;
      }
      out.push_back(static_cast<int64_t>(number));
    }
    return true;
  }
  template <class T, class Read>
  void take(const char* key, T& out, Read read) {
    std::vector<int64_t> all;
    if (!parts(key, all)) return;
    auto made = read(all);
    if (made.ok())
      out = std::move(*made);
    else
      table.fail(key, made.error().message);
  }
  void asset(const char* key, std::shared_ptr<const TriangleMesh>& out) {
    take(key, out, [&](const auto& p) { return assets.mesh(p); });
  }
  void asset(const char* key, std::shared_ptr<const LightImage>& out) {
    take(key, out, [&](const auto& p) { return assets.image(p); });
  }
  void asset(const char* key, std::shared_ptr<const DensityField>& out, FieldSampling) {
    take(key, out, [&](const auto& p) { return assets.density(p, table.where(key)); });
  }
  void asset(const char* key, std::vector<Vec3f>& out) {
    take(key, out, [&](const auto& p) { return assets.triangles(p); });
  }
  void own_layer(const Medium& medium) {
    std::string layer;
    const bool own = table.read("layer", layer);
    if (own && (layer != "density" || medium.field)) table.fail("layer", "only the layer \"density\" is sampled");
    if (!own && medium.kind == "density_grid" && !medium.field) table.fail("field", "the densities are missing");
  }
};

// What the fields' own ranges don't say.

Status finish_record(const World&, Luminaire& l, TomlTable& table) {
  l.where = table.where();
  const std::vector<std::string> kinds = luminaire_kinds();
  if (std::find(kinds.begin(), kinds.end(), l.kind) == kinds.end())
    return input_error(fmt::format("{}: there is no luminaire of kind \"{}\"", l.where, l.kind));
  return check_luminaire(l);
}

Status finish_record(const World&, Medium& m, TomlTable& table) {
  m.where = table.where();
  const std::vector<std::string> kinds = medium_kinds();
  const auto kind = std::find(kinds.begin(), kinds.end(), m.kind);
  if (kind == kinds.end()) return input_error(fmt::format("{}: there is no medium of kind \"{}\"", m.where, m.kind));
  m.kind_number = static_cast<int>(kind - kinds.begin());
  if (m.kind == "height_fog" && !(m.scale_height > 0))
    return input_error(m.where + ": the scale height must be above 0");
  if (!(std::abs(glm::length(m.normal) - 1) < 1e-3f)) return input_error(m.where + ": the normal must have length 1");
  return {};
}

Status finish_record(const World& world, MeshInstance& m, TomlTable& table) {
  m.where = table.where();
  if (!m.mesh) return input_error(m.where + ": the triangles are missing");
  for (const auto& [name, id] : {std::pair{&m.block, &m.block_id}, {&m.checker_block, &m.checker_id}}) {
    if (name->empty()) continue;
    const auto block = world.palette->find(*name);
    if (!block) return input_error(fmt::format("{}: the palette has no block \"{}\"", m.where, *name));
    *id = *block;
  }
  const bool named =
      m.interior_medium.empty() || std::any_of(world.media.begin(), world.media.end(),
                                               [&](const Medium& medium) { return medium.name == m.interior_medium; });
  if (!named) return input_error(fmt::format("{}: there is no medium \"{}\"", m.where, m.interior_medium));
  return {};
}

Status finish_record(const World&, CameraPlacement& camera, TomlTable& table) {
  if (std::abs(glm::length(camera.forward) - 1) < 1e-6) return {};
  return input_error(table.where() + ": the direction of the camera must have length 1");
}

Status finish_record(const World&, BodyRequest&, TomlTable&) { return {}; }

Status finish_record(const World&, ParticleSource& source, TomlTable& table) {
  if (!source.kind.empty() && !source.box.empty()) return {};
  return input_error(table.where() + ": a source of particles has a kind and a box");
}

template <class Record>
Status read_records(const World& world, const char* kind, TomlDocument& document, AssetReader& assets,
                    std::vector<Record>& out) {
  std::vector<Record> records;
  std::vector<TomlTable> tables = document.root().array_of_tables(kind);
  for (TomlTable& table : tables) {
    Reader reader{table, assets};
    visit_record(reader, records.emplace_back());
  }
  TRY_STATUS(document.finish());
  for (size_t i = 0; i < records.size(); ++i) TRY_STATUS(finish_record(world, records[i], tables[i]));
  out.insert(out.end(), std::make_move_iterator(records.begin()), std::make_move_iterator(records.end()));
  return {};
}

// ---- knobs and the simulation --------------------------------------------------------------------------------------

std::string text_of_knobs(const std::map<std::string, std::string>& knobs) {
  std::string text;
  for (const auto& [name, value] : knobs) text += fmt::format("{} = {}\n", toml_text(name), toml_text(value));
  return text;
}

void read_knobs(TomlTable table, std::map<std::string, std::string>& knobs) {
  for (const std::string& name : table.keys()) table.read(name, knobs[name]);
}

/// The seed as text: TOML's whole numbers end at 2^63.
std::string text_of_simulation(const SimulationRequest& r) {
  std::string text = fmt::format("seed = \"{}\"\n", r.seed), effects;
  for (const std::string& effect : r.effects) effects += (effects.empty() ? "" : ", ") + toml_text(effect);
  if (!effects.empty()) text += fmt::format("effects = [{}]\n", effects);
  return r.knobs.empty() ? text : text + "[knobs]\n" + text_of_knobs(r.knobs);
}

void read_simulation(TomlTable table, SimulationRequest& r) {
  std::string seed;
  if (table.read("seed", seed)) {
    const char* const end = seed.data() + seed.size();
    const auto parsed = std::from_chars(seed.data(), end, r.seed);
    if (parsed.ec != std::errc() || parsed.ptr != end)
      table.fail("seed", "a seed is a whole number from 0 to 2^64 - 1, as text");
  }
  table.read("effects", r.effects);
  for (const TomlTable& knobs : table.table("knobs")) read_knobs(knobs, r.knobs);
}

}  // namespace

void put_surroundings(const World& world, std::map<std::string, std::string>& rows,
                      std::map<std::vector<int64_t>, Asset>& assets) {
  std::map<const void*, std::vector<int64_t>> known;
  put_records("camera", world.cameras, rows, assets, known);
  put_records("luminaire", world.luminaires, rows, assets, known);
  put_records("medium", without_copies(world.media, world.store.find_layer(Layer::density)), rows, assets, known);
  put_records("mesh", world.meshes, rows, assets, known);
  put_records("body", world.simulation.bodies, rows, assets, known);
  put_records("particles", world.simulation.particles, rows, assets, known);
  for (const auto& [part, state] : world.simulation.state) rows[kStateKey + part] = state;
  if (!world.knobs.empty()) rows["scene.knobs"] = text_of_knobs(world.knobs);
  if (!(world.simulation == SimulationRequest{})) rows["scene.simulation"] = text_of_simulation(world.simulation);
}

Status read_surroundings(World& world, const std::string& key, const std::string& text, const std::string& where,
                         AssetReader& assets) {
  if (key.starts_with(kStateKey)) {
    world.simulation.state[key.substr(kStateKey.size())] = text;
    return {};
  }
  TRY(TomlDocument document, TomlDocument::parse(text, fmt::format("{}: {}", where, key)));
  if (key == "scene.knobs") {
    read_knobs(document.root(), world.knobs);
    return document.finish();
  }
  if (key == "scene.simulation") {
    read_simulation(document.root(), world.simulation);
    return document.finish();
  }
  const std::string kind = key.substr(0, key.rfind('.'));
  if (kind == "scene.camera") return read_records(world, "camera", document, assets, world.cameras);
  if (kind == "scene.luminaire") return read_records(world, "luminaire", document, assets, world.luminaires);
  if (kind == "scene.medium") return read_records(world, "medium", document, assets, world.media);
  if (kind == "scene.body") return read_records(world, "body", document, assets, world.simulation.bodies);
  if (kind == "scene.particles") return read_records(world, "particles", document, assets, world.simulation.particles);
  if (kind == "scene.mesh") return read_records(world, "mesh", document, assets, world.meshes);
  return input_error(fmt::format("{}: holds \"{}\", which this program does not know", where, key.substr(0, 60)));
}

}  // namespace world
