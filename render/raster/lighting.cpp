#include "render/raster/lighting.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>

#include <fmt/format.h>

#include "render/bsdf/bsdf.h"
#include "render/image/display.h"
#include "render/light/fog_light.h"
#include "render/light/spot_map.h"
#include "render/raster/lighting.shared.h"
#include "render/see_through.h"
#include "render/trace/geometry.h"
#include "world/base/random.h"
#include "world/luminaires/kinds.h"

namespace render::raster {

using world::Luminaire;
using world::Medium;
using world::Vec3d;
using world::Vec3f;

namespace {

constexpr double kPi = 3.14159265358979323846;

bool has_strength(const Medium& m) { return m.absorption.max() > 0 || m.scattering.max() > 0; }
/// Whether it only fills meshes, whose insides the rasterizer doesn't follow.
bool fills_meshes(const world::World& world, const Medium& m) {
  return !m.name.empty() && std::any_of(world.meshes.begin(), world.meshes.end(), [&](const world::MeshInstance& mesh) {
    return mesh.interior_medium == m.name;
  });
}

uint32_t medium_number(const std::string& kind) {
  static const char* const kNames[] = {
#define MEDIUM(name) #name,
#include "world_media.list.h"
#undef MEDIUM
  };
  for (uint32_t i = 0; i < std::size(kNames); ++i)
    if (kind == kNames[i]) return i;
  static_assert(std::size(kNames) <= kMediumDensityGrid);
  return kMediumDensityGrid;
}

uint32_t bits(double v) { return std::bit_cast<uint32_t>(static_cast<float>(v)); }
void put(uint32_t* at, const Vec3d& v) {
  for (int a = 0; a < 3; ++a) at[a] = bits(v[a]);
}
void put(uint32_t* at, const world::WorldPoint& p) {
  for (int a = 0; a < 3; ++a) at[a] = static_cast<uint32_t>(p.voxel[a]);
  put(at + 3, p.fraction);
}
template <class Bands>
Vec3d vector_of(const Bands& b) {
  return {b.r, b.g, b.b};
}

class Signature {
 public:
  template <class... T>
  void add(const T&... values) {
    (add_one(values), ...);
  }
  uint64_t value() const { return hash_; }

 private:
  template <class T>
  requires std::is_arithmetic_v<T> || std::is_enum_v<T>
  void add_one(T v) {
    if constexpr (std::is_same_v<T, double>)
      mix(std::bit_cast<uint64_t>(v));
    else if constexpr (std::is_same_v<T, float>)
      mix(std::bit_cast<uint32_t>(v));
    else
      mix(static_cast<uint64_t>(v));
  }
  void add_one(const Vec3d& v) { add(v.x, v.y, v.z); }
  void add_one(const Vec3f& v) { add(v.x, v.y, v.z); }
  void add_one(const glm::vec2& v) { add(v.x, v.y); }
  template <class U>
  void add_one(const world::Bands3<U>& b) {
    add(b.r, b.g, b.b);
  }
  void add_one(const world::WorldPoint& p) { add(p.voxel.x, p.voxel.y, p.voxel.z, p.fraction); }
  void add_one(const std::string& s) {
    for (const char c : s) mix(static_cast<uint64_t>(c));
  }
  void mix(uint64_t v) { hash_ = (hash_ ^ v) * 0x9e3779b97f4a7c15ull, hash_ ^= hash_ >> 29; }
  uint64_t hash_ = 1;
};

uint64_t signature_of(const world::World& world, const SkyView& sky, const RenderKnobs& knobs) {
  Signature s;
  s.add(world.palette->size(), knobs.luminaire_cutoff, knobs.exposure, knobs.gloss_lobe, world.meshes.size());
  for (const Luminaire& l : world.luminaires) {
    s.add(l.kind.size(), l.kind[0], l.position, l.axis, l.up, l.power, l.irradiance, l.radiance, l.extent, l.radius,
          l.half_angle, l.inner_half_angle, l.attenuation, l.at_infinity, l.whole_sphere, l.uniform_area);
    s.add(l.lambertian, l.glossy, l.global_illumination, l.shadows, l.enabled, l.visible,
          reinterpret_cast<uintptr_t>(l.light_image.get()), reinterpret_cast<uintptr_t>(l.triangles.data()));
  }
  for (const Medium& m : world.media)
    s.add(m.kind, m.absorption, m.scattering, m.emission, m.position, m.half_extent, m.normal, m.scale_height,
          m.voxel_size, m.anisotropy, reinterpret_cast<uintptr_t>(m.field.get()));
  if (!world.media.empty()) {
    const world::Environment& e = sky.environment;
    s.add(knobs.fog_light, e.sky_zenith, e.sky_horizon, e.sky_ground, e.sun_direction, e.sun_irradiance);
    if (sky.light) s.add(sky.light->irradiance({0, 1, 0}), sky.light->irradiance({0, -1, 0}));
  }
  return s.value();
}

}  // namespace

world::Status Lighting::add_luminaires(const world::World& world, const RenderKnobs& knobs,
                                       std::vector<uint32_t>& words) {
  std::vector<world::LuminaireTables> tables;
  std::vector<const Luminaire*> shining;
  for (const Luminaire& l : world.luminaires) {
    if (!gives_light(l)) continue;
    TRY(world::LuminaireTables t, world::luminaire_tables(l));
    tables.push_back(std::move(t)), shining.push_back(&l);
  }
  variant_.luminaire_kinds = 0;
  luminaires_at_ = static_cast<uint32_t>(words.size());
  words.resize(words.size() + shining.size() * kLuminaireWords);
  std::map<const world::LightImage*, uint32_t> images;
  for (uint32_t i = 0; i < shining.size(); ++i) {
    const Luminaire& l = *shining[i];
    const world::LuminaireTables& t = tables[i];
    const world::shared::Emitter& e = t.parts[0];
    const bool finite = std::isfinite(t.area);
    const bool impulse = !(t.keys & world::shared::kKeyRadiance), mesh = t.keys & world::shared::kKeyFile;

    // Its tables first: a record that names them is written after they have their places.
    uint32_t image = 0, sums = 0, parts = 0;
    if (t.slide || t.sky) {
      const uint64_t more = l.light_image->pixels.size() * 4 * 4;
      if (words.size() * 4 + more > limit_) {
        dropped_.push_back(fmt::format("the image of luminaire '{}' ({} MiB)", l.name, more >> 20));
      } else {
        const auto [known, added] = images.try_emplace(l.light_image.get(), static_cast<uint32_t>(words.size()));
        image = known->second;
        if (added)
          for (const world::Radiance3& p : l.light_image->pixels) {
            const float v[3] = {p.r, p.g, p.b};
            for (const float band : v) words.push_back(bits(band));
          }
        if (t.sky) {
          sums = static_cast<uint32_t>(words.size());
          for (const double v : t.cells.row_sums()) words.push_back(bits(v));
          for (const double v : t.cells.column_sums()) words.push_back(bits(v));
          for (const double v : t.row_cosines) words.push_back(bits(v));
        }
      }
    }
    if (mesh) {
      parts = static_cast<uint32_t>(words.size());
      words.resize(words.size() + t.parts.size() * kPartWords);
      for (size_t k = 0; k < t.parts.size(); ++k) {
        uint32_t* part = words.data() + parts + k * kPartWords;
        put(part, t.parts[k].corner), put(part + 3, t.parts[k].edge1), put(part + 6, t.parts[k].edge2);
        part[9] = bits(t.parts.size() > 1 ? t.areas[k] : t.area);
      }
    }

    uint32_t* at = words.data() + luminaires_at_ + i * kLuminaireWords;
    const auto flag = [](bool set, uint32_t bit) { return set ? bit : 0; };
    CHECK_LT(t.number, 30u);
    variant_.luminaire_kinds |=
        1u << t.number | flag(t.slide && image, kLuminaireSlides) | flag(t.sky && image, kLuminaireSkies);
    at[kLumKind] = t.number | flag(impulse, kLumImpulse) | flag(finite, kLumFinite) |
                   flag(t.slide && image, kLumSlide) | flag(t.sky && image, kLumSky) | flag(l.whole_sphere, kLumWhole) |
                   flag(l.uniform_area, kLumUniform) | flag(l.at_infinity, kLumAtInfinity) | flag(mesh, kLumMesh) |
                   flag(!l.lambertian, kLumNoMatte) | flag(!l.glossy, kLumNoGloss) | flag(!l.shadows, kLumNoShadow);
    put(at + kLumVoxel, l.position);
    put(at + kLumAxis, e.axis), put(at + kLumUp, e.up), put(at + kLumColour, t.colour);
    at[kLumExtent] = bits(e.extent.x), at[kLumExtent + 1] = bits(e.extent.y);
    at[kLumRadius] = bits(e.radius);
    at[kLumCone] = bits(e.cone), at[kLumCone + 1] = bits(e.inner_cone);
    at[kLumTangent] = bits(e.tan_half_angle);
    put(at + kLumAttenuation, e.attenuation);
    at[kLumImage] = image;
    if (image)
      at[kLumImageSize] = static_cast<uint32_t>(l.light_image->width) | static_cast<uint32_t>(l.light_image->height)
                                                                            << 16;
    at[kLumTables] = sums;
    at[kLumParts] = parts, at[kLumPartCount] = static_cast<uint32_t>(t.parts.size());
    at[kLumArea] = bits(finite ? t.area : 0);

    // How far it reaches, and what of it is seen.
    const LightCells::Light light = LightCells::light_of(l, t);
    lights_.push_back(light);
    if (!l.visible || impulse) continue;
    if (!finite) {
      far_.push_back(i);
    } else if (mesh) {
      for (uint32_t k = 0; k < t.parts.size(); ++k) {
        const Vec3d a = t.parts[k].corner, b = a + t.parts[k].edge1, c = a + t.parts[k].edge2,
                    centre = (a + b + c) / 3.0;
        const double radius = std::max({glm::length(a - centre), glm::length(b - centre), glm::length(c - centre)});
        seen_parts_.push_back({i, k, l.position, centre, radius});
      }
    } else {
      seen_parts_.push_back({i, 0, l.position, Vec3d(0), light.radius});
    }
  }
  cells_ = LightCells::make(lights_, LightCells::cutoff_of(knobs.luminaire_cutoff, knobs.exposure));
  for (uint32_t i = 0; i < lights_.size(); ++i)
    words[luminaires_at_ + i * kLuminaireWords + kLumReach] =
        bits(std::min(lights_[i].finite ? cells_.reaches()[i] : 1e18, 1e18));
  add_cells(words);
  return {};
}

void Lighting::add_cells(std::vector<uint32_t>& words) {
  everywhere_at_ = static_cast<uint32_t>(words.size());
  words.insert(words.end(), cells_.everywhere().begin(), cells_.everywhere().end());
  far_at_ = static_cast<uint32_t>(words.size());
  words.insert(words.end(), far_.begin(), far_.end());
  cells_at_ = cell_slots_ = 0;
  if (cells_.cells().empty()) return;
  const auto lists = static_cast<uint32_t>(words.size());
  words.insert(words.end(), cells_.numbers().begin(), cells_.numbers().end());
  cells_at_ = static_cast<uint32_t>(words.size());
  cell_slots_ = std::bit_ceil(static_cast<uint32_t>(2 * cells_.cells().size()));
  words.resize(words.size() + size_t{cell_slots_} * kCellWords);
  for (const LightCells::Cell& c : cells_.cells()) {
    uint32_t slot = region_hash(c.place.x, c.place.y, c.place.z) & (cell_slots_ - 1);
    while (words[cells_at_ + slot * kCellWords + 3]) slot = (slot + 1) & (cell_slots_ - 1);
    uint32_t* at = words.data() + cells_at_ + slot * kCellWords;
    for (int a = 0; a < 3; ++a) at[a] = static_cast<uint32_t>(c.place[a]);
    at[3] = lists + c.first, at[4] = c.count;
  }
}

std::vector<uvec4> Lighting::add_media(const world::World& world, const SkyView& sky, FogLight fog,
                                       std::vector<uint32_t>& words) {
  std::vector<const Medium*> media;
  for (const Medium& m : world.media)
    if (has_strength(m) && !fills_meshes(world, m)) media.push_back(&m);
  media_count_ = 0;
  variant_.medium_kinds = 0;
  std::vector<uvec4> records;
  const FogSource source = media.empty() ? FogSource{} : fog_source(sky, fog);
  for (const Medium* m : media) {
    uint32_t table = 0;
    Vec3d low(0), high(0);
    if (m->field) {
      m->field->bounds(low, high);
      Vec3d low_leaf = glm::floor((low - 1.0) / 8.0), size = glm::floor((high + 1.0) / 8.0) - low_leaf + 1.0;
      uint64_t bricks = 0;
      m->field->for_each_leaf([&](const world::FieldLeaf&) { ++bricks; });
      const double bytes = 4.0 * (size.x * size.y * size.z + 512.0 * static_cast<double>(bricks));
      if (!(static_cast<double>(words.size()) * 4 + bytes <= static_cast<double>(limit_))) {
        dropped_.push_back(fmt::format("the density grid of medium '{}' ({:.0f} MiB)", m->name, bytes / (1 << 20)));
        continue;
      }
      table = static_cast<uint32_t>(words.size());
      for (const Vec3d& v : {low_leaf, size})
        for (int a = 0; a < 3; ++a) words.push_back(static_cast<uint32_t>(static_cast<int32_t>(v[a])));
      words.resize(words.size() + static_cast<size_t>(size.x * size.y * size.z));
      m->field->for_each_leaf([&](const world::FieldLeaf& leaf) {
        const Vec3d place = Vec3d(leaf.leaf.x, leaf.leaf.y, leaf.leaf.z) - low_leaf;
        if (place.x < 0 || place.y < 0 || place.z < 0 || place.x >= size.x || place.y >= size.y || place.z >= size.z)
          return;
        const auto index = static_cast<size_t>((place.x * size.y + place.y) * size.z + place.z);
        words[table + kMediumLeavesHead + index] = static_cast<uint32_t>(words.size());
        for (const float v : leaf.values) words.push_back(std::bit_cast<uint32_t>(v));
      });
    }
    const uint32_t kind = medium_number(m->kind);
    variant_.medium_kinds |= 1u << kind;
    ++media_count_;
    const ScatteredIn in = scattered_in(*m, source);
    std::array<uvec4, kMediumTexels> record{};
    const auto set = [&](uint32_t texel, const Vec3d& v, uint32_t last) {
      record[texel] = uvec4(bits(v.x), bits(v.y), bits(v.z), last);
    };
    const world::VoxelPos& voxel = m->position.voxel;
    record[kMedVoxel] =
        uvec4(static_cast<uint32_t>(voxel.x), static_cast<uint32_t>(voxel.y), static_cast<uint32_t>(voxel.z), kind);
    set(kMedFraction, m->position.fraction, bits(m->field ? double{m->voxel_size} : double{m->scale_height}));
    set(kMedExtinction, vector_of(m->absorption) + vector_of(m->scattering), bits(double{m->anisotropy}));
    set(kMedEmission, vector_of(m->emission) + in.sky, table);
    set(kMedInSun, in.sun, m->sampling == world::FieldSampling::trilinear);
    set(kMedHalfExtent, m->field ? low : Vec3d(m->half_extent), 0);
    set(kMedNormal, m->field ? high : Vec3d(m->normal), 0);
    records.insert(records.end(), record.begin(), record.end());
  }
  return records;
}

void Lighting::add_blocks(const world::World& world, const RenderKnobs& knobs, std::vector<uint32_t>& words) {
  const world::BlockPalette& palette = *world.palette;
  const float air = palette[world::kAir].index_of_refraction;
  blocks_at_ = static_cast<uint32_t>(words.size());
  words.resize(words.size() + palette.size() * kBlockWords);
  for (size_t id = 0; id < palette.size(); ++id) {
    const world::Block& block = palette[static_cast<world::BlockId>(id)];
    const Bsdf* bsdf = bsdf_of(block);
    const BsdfParameters p = bsdf_parameters(block, air, false, static_cast<uint32_t>(knobs.gloss_lobe));
    const Vec3f up(0, 1, 0);
    uint32_t* at = words.data() + blocks_at_ + id * kBlockWords;
    const bool finite = bsdf->finite_density(p, up, up, up) != Vec3f(0);
    at[kBlockBsdf] = static_cast<uint32_t>(bsdf - bsdfs().data()) | (finite ? kBlockFinite : 0);
    put(at + kBlockLambertian, vector_of(finite ? block.albedo : block.albedo + block.glossy));
    at[kBlockSmoothness] = bits(p.smoothness);
    put(at + kBlockGlossy, Vec3d(p.glossy));
    at[kBlockEta] = bits(p.eta);
    put(at + kBlockTransmission, Vec3d(p.transmission));
    at[kBlockCoverage] = bits(p.coverage);
    at[kBlockGloss] = p.gloss;
  }
}

void Lighting::add_spot_maps(const world::World& world, const world::RayStream& opaque, int texels,
                             std::vector<uint32_t>& words) {
  size_t i = 0;
  for (const Luminaire& l : world.luminaires) {
    if (!gives_light(l)) continue;
    uint32_t* at = words.data() + luminaires_at_ + i++ * kLuminaireWords;
    const uint64_t bytes = uint64_t{4} * static_cast<uint64_t>(texels) * static_cast<uint64_t>(texels);
    // Where they no longer fit, spots ask rays.
    if (!has_spot_map(l) || words.size() * 4 + bytes > limit_) continue;
    at[kLumMap] = static_cast<uint32_t>(words.size()) + 1;
    at[kLumMapSize] = static_cast<uint32_t>(texels);
    for (const float depth : spot_map(l, opaque, texels)) words.push_back(std::bit_cast<uint32_t>(depth));
  }
}

world::Result<uint64_t> Lighting::follow(gpu::Device& device, const world::WorldView& view, const SkyView& sky,
                                         const world::RayStream* opaque, const RenderKnobs& knobs) {
  const world::World& world = view.world();
  const bool calls = calls_for_trace_scene(world);
  const bool lobes = calls || knobs.direct_gloss == DirectGloss::lobe;
  if (!lobes) {
    if (variant_ == LightingVariant{} && !words_.handle) return uint64_t{0};
    const uint64_t kept_limit = binding_limit;
    *this = {};
    binding_limit = kept_limit;
    return uint64_t{0};
  }
  variant_.luminaire_shadow = static_cast<uint32_t>(knobs.luminaire_shadow);
  variant_.fog_shafts = fog_shafts(world.media, sky, knobs);
  uint64_t signature = signature_of(world, sky, knobs);
  if (opaque) {
    signature = world::hash_combine(world::hash_combine(signature, opaque->walker().volume().version()),
                                    static_cast<uint64_t>(knobs.spot_map_texels));
  }
  const uint64_t limit = std::min(binding_limit, uint64_t{4} * device.limits().maxTexelBufferElements);
  if (words_.handle && signature == signature_ && limit == limit_) return uint64_t{0};
  limit_ = limit;
  lights_.clear(), seen_parts_.clear(), far_.clear(), dropped_.clear();
  std::vector<uint32_t> words(1);  // 0 is no offset
  add_blocks(world, knobs, words);
  TRY_STATUS(add_luminaires(world, knobs, words));
  const std::vector<uvec4> records = add_media(world, sky, knobs.fog_light, words);
  if (opaque) add_spot_maps(world, *opaque, knobs.spot_map_texels, words);
  if (words.size() * 4 > limit)
    return world::Error{world::ErrorKind::usage,
                        fmt::format("{} luminaires need {} MiB, more than the {} MiB of this device's texel buffers; "
                                    "raise luminaire_cutoff or use the raycast backend",
                                    lights_.size(), words.size() >> 18, limit >> 20)};
  variant_.luminaires = !lights_.empty();
  variant_.media = media_count_ > 0;
  variant_.bsdf = true;
  const uint64_t size = words.size() * sizeof words[0];
  if (words_.size < size || words_.size > 4 * size + 65536) {
    TRY(words_, gpu::make_texel_buffer(device, size, VK_FORMAT_R32_UINT, 0, gpu::MemoryUse::upload));
  }
  std::memcpy(words_.mapped(), words.data(), size);
  const uint64_t media_size = records.size() * sizeof records[0];
  if (records.empty()) {
    media_ = {};
  } else {
    TRY_STATUS(gpu::fill_texels(device, media_, VK_FORMAT_R32G32B32A32_UINT, records.data(), media_size));
  }
  if (seen_parts_.empty() && far_.empty()) seen_ = {};
  signature_ = signature;
  return size + media_size;
}

world::Result<uint64_t> Lighting::see(gpu::Device& device, const Camera& camera, int width, int height) {
  if (seen_parts_.empty()) return uint64_t{0};
  const PixelRays rays(camera, width, height);
  const auto tiles = [](int pixels) { return (static_cast<uint32_t>(pixels) + kSeenTile - 1) / kSeenTile; };
  tiles_across_ = tiles(width);
  const uint32_t down = tiles(height);
  // The box on the screen of a sphere around each part: by the angles that it fills beside the axis of view.
  struct Box {
    uint32_t x0 = 0, x1 = 0, y0 = 0, y1 = 0;  // in tiles, ends included
    bool none = true;
  };
  std::vector<Box> boxes(seen_parts_.size());
  std::vector<uint32_t> counts(size_t{tiles_across_} * down, 0);
  const auto span = [](double along, double depth, double radius, double tan_half, double whole, double begins,
                       double pixels, uint32_t across, uint32_t& low, uint32_t& high) {
    // Tangents of the two planes through the eye that touch the circle (along, depth).
    const double d2 = along * along + depth * depth, r2 = radius * radius;
    low = 0, high = across - 1;
    if (d2 <= r2 * 1.0001 || depth <= radius) return true;  // around or beside the eye: everything
    const double root = std::sqrt(d2 - r2);
    const double t0 = (along * root - radius * depth) / (depth * root + radius * along),
                 t1 = (along * root + radius * depth) / (depth * root - radius * along);
    // In pixels of the whole picture, less where the window begins.
    const double p0 = (t0 / tan_half + 1) * 0.5 * whole - begins - 1,
                 p1 = (t1 / tan_half + 1) * 0.5 * whole - begins + 1;
    if (p1 < 0 || p0 > pixels) return false;
    low = static_cast<uint32_t>(std::clamp(p0, 0.0, pixels - 1)) / kSeenTile;
    high = static_cast<uint32_t>(std::clamp(p1, 0.0, pixels - 1)) / kSeenTile;
    return true;
  };
  const PictureWindow& window = camera.window;
  const double whole_width = window.whole_width > 0 ? window.whole_width : width,
               whole_height = window.whole_height > 0 ? window.whole_height : height;
  uint64_t total = 0;
  for (size_t i = 0; i < seen_parts_.size(); ++i) {
    const SeenPart& part = seen_parts_[i];
    const Vec3d from_eye = (part.position - camera.position) + part.centre;
    const double depth = glm::dot(from_eye, rays.forward), radius = part.radius * 1.001 + 1e-6;
    if (depth < -radius) continue;
    Box box;
    if (!span(glm::dot(from_eye, rays.right), depth, radius, rays.tan_half_x, whole_width, window.x, width,
              tiles_across_, box.x0, box.x1) ||
        !span(-glm::dot(from_eye, rays.up), depth, radius, rays.tan_half_y, whole_height, window.y, height, down,
              box.y0, box.y1))
      continue;
    box.none = false;
    boxes[i] = box;
    for (uint32_t y = box.y0; y <= box.y1; ++y)
      for (uint32_t x = box.x0; x <= box.x1; ++x) ++counts[y * tiles_across_ + x], ++total;
  }
  std::vector<uint32_t> words(counts.size() * 2 + total * 2);
  uint32_t at = static_cast<uint32_t>(counts.size() * 2);
  for (size_t t = 0; t < counts.size(); ++t) {
    words[2 * t] = at;
    at += 2 * counts[t];
  }
  for (size_t i = 0; i < boxes.size(); ++i) {
    if (boxes[i].none) continue;
    for (uint32_t y = boxes[i].y0; y <= boxes[i].y1; ++y)
      for (uint32_t x = boxes[i].x0; x <= boxes[i].x1; ++x) {
        const size_t t = y * tiles_across_ + x;
        const uint32_t slot = words[2 * t] + 2 * words[2 * t + 1]++;
        words[slot] = seen_parts_[i].luminaire, words[slot + 1] = seen_parts_[i].part;
      }
  }
  const uint64_t size = words.size() * sizeof words[0];
  if (seen_.size < size) {
    TRY(seen_, gpu::make_texel_buffer(device, size + size / 2, VK_FORMAT_R32_UINT, 0, gpu::MemoryUse::upload));
  }
  std::memcpy(seen_.mapped(), words.data(), size);
  return size;
}

void Lighting::describe(const world::WorldView& view, const Camera& camera, const RenderKnobs& knobs, uint64_t seed,
                        PictureConstants& p) const {
  const auto count = [](size_t n) { return static_cast<uint32_t>(n); };
  p.luminaires = uvec4(luminaires_at_, everywhere_at_, count(cells_.everywhere().size()), blocks_at_);
  p.luminaires_seen = uvec4(seen_parts_.empty() ? 0 : 1, tiles_across_, far_at_, count(far_.size()));
  p.light_cells = uvec4(cells_at_, cell_slots_ - 1, count(static_cast<size_t>(cells_.shift())), 0);
  p.media = uvec4(count(media_count_), static_cast<uint32_t>(std::max(knobs.fog_steps, 1)),
                  static_cast<uint32_t>(knobs.fog_sun_rays), 0);
  p.light_samples =
      uvec4(static_cast<uint32_t>(std::max(knobs.light_samples, 1)), knobs.sample_sequence == SampleSequence::sobol,
            static_cast<uint32_t>(seed), static_cast<uint32_t>(seed >> 32));
  // As Tracer::absorption() of what lets light through.
  p.eye_absorption = vec4(0);
  if (!variant_.bsdf || eye_above_liquid) return;
  world::StoreReader reader(view.store());
  const world::VoxelPos eye = camera.position.voxel;
  const world::Block& block = view.palette()[reader.leaf(leaf_from_voxel(eye))[index_in_leaf(eye)]];
  if (block.opaque || !block.proxy.empty() || !(block.absorption.max() > 0)) return;
  // Layers have it in themselves.
  if (knobs.transparency != Transparency::opaque &&
      SeeThroughKinds(view.palette()).contains(reader.leaf(leaf_from_voxel(eye))[index_in_leaf(eye)]))
    return;
  p.eye_absorption = vec4(block.absorption.r, block.absorption.g, block.absorption.b, 1);
}

}  // namespace render::raster
