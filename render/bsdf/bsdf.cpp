#include "render/bsdf/bsdf.h"

#include <algorithm>
#include <iterator>
#include <string>

#include "render/bsdf/every_bsdf.shared.h"
#include "world/base/text.h"

namespace render {

using namespace shared;

namespace {

constexpr Bsdf kBsdfs[] = {
#define BSDF(name)           \
  {#name,                    \
   name##_finite_density,    \
   name##_incoming_impulses, \
   name##_outgoing_impulses, \
   name##_scatter_in,        \
   name##_scatter_out,       \
   name##_pdf,               \
   name##_probability_in,    \
   name##_probability_out},
#include "render_bsdf.list.h"
#undef BSDF
};

Vec3f bands(const auto& b) { return {b.r, b.g, b.b}; }

}  // namespace

std::span<const Bsdf> bsdfs() { return kBsdfs; }

const Bsdf* find_bsdf(std::string_view name) {
  const auto found = std::lower_bound(std::begin(kBsdfs), std::end(kBsdfs), name,
                                      [](const Bsdf& bsdf, std::string_view sought) { return bsdf.name < sought; });
  return found != std::end(kBsdfs) && found->name == name ? found : nullptr;
}

const Bsdf* bsdf_of(const world::Block& block) {
  return find_bsdf(block.bsdf == "blinn_phong" && block.glossy.max() == 0 ? "lambert" : block.bsdf);
}

world::Status check_bsdfs(const world::BlockPalette& palette) {
  for (size_t id = 0; id < palette.size(); ++id) {
    const world::Block& block = palette[static_cast<world::BlockId>(id)];
    if (find_bsdf(block.bsdf)) continue;
    const Bsdf* nearest = std::min_element(std::begin(kBsdfs), std::end(kBsdfs), [&](const Bsdf& a, const Bsdf& b) {
      return world::edit_distance(block.bsdf, a.name) < world::edit_distance(block.bsdf, b.name);
    });
    return world::input_error((block.where_bsdf.empty() ? "" : block.where_bsdf + ": 'bsdf' of ") + "block '" +
                              block.name + "': there is no bsdf '" + block.bsdf + "'; the nearest is '" +
                              std::string(nearest->name) + "'");
  }
  return {};
}

BsdfParameters bsdf_parameters(const world::Block& block, float index_outside, bool inside, uint32_t gloss) {
  BsdfParameters p;
  p.lambertian = bands(block.albedo);
  // A mirror has no matte part, and loses nothing to it.
  p.glossy = bands(block.bsdf == "mirror" ? block.albedo + block.glossy : block.glossy);
  p.smoothness = smoothness_from_shininess(block.shininess);
  p.transmission = bands(block.transmission);
  p.coverage = block.coverage;
  p.gloss = gloss;
  p.eta = inside ? index_outside / block.index_of_refraction : block.index_of_refraction / index_outside;
  // A sheet has the same medium on both sides; one without an index, a leaf, has no smooth surface that mirrors.
  if (block.bsdf == "thin") p.eta = block.index_of_refraction > 1 ? block.index_of_refraction / index_outside : 1;
  // A Lambertian emitter of six faces of A = 1 m^2 radiates P = 6 pi A L; the same as in render/shading.h.
  p.emission = bands(block.emission) * (1.0f / (6 * kBsdfPi));
  return p;
}

}  // namespace render
