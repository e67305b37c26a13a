#include "render/see_through.h"

#include <algorithm>

#include "render/bsdf/bsdf.h"

namespace render {

namespace {

bool is_see_through(const world::Block& b) {
  if (b.opaque || !b.proxy.empty()) return false;
  if (b.bsdf == "dielectric") return true;
  if (b.bsdf == "thin") return b.transmission.max() > 0;
  return b.bsdf == "coverage" && b.coverage < 1;
}

shared::SeeThroughBlock describe(const world::Block& b, size_t id, float index_air) {
  shared::SeeThroughBlock s;
  const uint32_t kind = b.bsdf == "dielectric" ? shared::kSeeThroughDielectric
                        : b.bsdf == "thin"     ? shared::kSeeThroughThin
                                               : shared::kSeeThroughCoverage;
  const bool solid = kind == shared::kSeeThroughDielectric;
  const float eta = bsdf_parameters(b, index_air, false).eta;
  s.absorption = {b.absorption.r, b.absorption.g, b.absorption.b, solid ? eta : 1.0f};
  s.matte = {b.albedo.r, b.albedo.g, b.albedo.b, static_cast<float>(kind)};
  s.transmission = {b.transmission.r, b.transmission.g, b.transmission.b, eta};
  // As render/shading.h: six faces of 1 m^2 radiate P = 6 pi A L.
  const float emit = 1.0f / (6 * 3.14159265358979f);
  s.emitted = {b.emission.r * emit, b.emission.g * emit, b.emission.b * emit, b.coverage};
  s.block.x = static_cast<int>(id);
  return s;
}

}  // namespace

SeeThroughKinds::SeeThroughKinds(const world::BlockPalette& palette) {
  kind_.assign(palette.size(), 0);
  flags_.assign(palette.size(), 0);
  blocks_.emplace_back();
  for (size_t id = 0; id < palette.size() && blocks_.size() <= kMost; ++id) {
    const world::Block& block = palette[static_cast<world::BlockId>(id)];
    if (id == world::kAir || !is_see_through(block)) continue;
    kind_[id] = static_cast<uint16_t>(blocks_.size());
    flags_[id] = 1;
    blocks_.push_back(describe(block, id, palette[world::kAir].index_of_refraction));
  }
}

SeeThroughKinds SeeThroughKinds::none(const world::BlockPalette& palette) {
  SeeThroughKinds kinds;
  kinds.kind_.assign(palette.size(), 0);
  kinds.flags_.assign(palette.size(), 0);
  kinds.blocks_.emplace_back();
  return kinds;
}

bool SeeThroughKinds::called_for(const world::Census& census) const {
  return std::any_of(census.begin(), census.end(), [&](const auto& row) { return contains(row.first); });
}

bool SeeThroughKinds::calls_for_matte(const world::Census& census) const {
  return std::any_of(census.begin(), census.end(), [&](const auto& row) {
    return contains(row.first) && of(row.first).matte.w != static_cast<float>(shared::kSeeThroughDielectric);
  });
}

std::vector<uint8_t> hiding_cubes(const world::BlockPalette& palette, const SeeThroughKinds& kinds,
                                  const world::BlockShapes* drawn) {
  std::vector<uint8_t> hides(palette.size());
  for (size_t i = 0; i < hides.size(); ++i) {
    const auto id = static_cast<world::BlockId>(i);
    hides[i] = id != world::kAir && !palette[id].opaque && !kinds.contains(id) && !(drawn && drawn->shape[id]);
  }
  return hides;
}

bool tints_sun(const RenderKnobs& knobs) {
  return knobs.tinted_shadows && (knobs.sun_shadow == SunShadow::ray || knobs.sun_shadow == SunShadow::map);
}

bool holds_not_opaque(const world::WorldView& view) {
  for (const auto& [id, count] : view.store().census())
    if (id != world::kAir && !view.palette()[id].opaque) return true;
  return false;
}

bool calls_for_mirrors(const world::WorldView& view) {
  const world::Census census = view.store().census();
  return std::any_of(census.begin(), census.end(),
                     [&](const auto& row) { return is_mirror(view.palette()[row.first]); });
}

bool calls_for_see_through(const world::WorldView& view) {
  return SeeThroughKinds(view.palette()).called_for(view.store().census());
}

}  // namespace render
