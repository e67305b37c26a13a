/// How a surface scatters light: the interface that every BSDF answers, and the table of the members, a file each
/// (render/bsdf/<name>.shared.h, written once for C++ and GLSL), listed by the folder.
///
/// All directions point away from the surface and have length 1. n has length 1 and lies on the side of the direction
/// that is given (wo where light is sought, wi where it is sent out); eta is the index of refraction beyond the surface
/// over that on this side. Impulses (mirror, refraction, passing through) are never part of the finite density.
/// source  McGuire, Hughes et al. Computer Graphics: Principles and Practice, 3rd edition. 2013, section 14.9.1
#pragma once

#include <span>
#include <string_view>

#include "render/bsdf/parameters.shared.h"
#include "world/blocks/block.h"
#include "world/space/world_point.h"

namespace render {

using shared::BsdfParameters;
using shared::BsdfSample;
using shared::Impulse;
using shared::Impulses;
using world::Vec3f;

struct Bsdf {
  std::string_view name;
  /// f(wi, wo), 1/sr. 0 where the two lie on the wrong sides.
  Vec3f (*finite_density)(const BsdfParameters&, Vec3f wi, Vec3f wo, Vec3f n);
  /// Given wo, all directions that light comes from as an impulse; radiance scales by 1 / eta^2 where it refracts.
  Impulses (*incoming_impulses)(const BsdfParameters&, Vec3f wo, Vec3f n);
  /// Given wi, all directions that light leaves to as an impulse; power doesn't scale.
  Impulses (*outgoing_impulses)(const BsdfParameters&, Vec3f wi, Vec3f n);
  /// Given wo, picks wi by u in [0, 1)^3.
  BsdfSample (*scatter_in)(const BsdfParameters&, Vec3f wo, Vec3f n, Vec3f u);
  /// Given wi, picks wo: for photons.
  BsdfSample (*scatter_out)(const BsdfParameters&, Vec3f wi, Vec3f n, Vec3f u);
  /// With which scatter_in(wo) picks wi from the finite part, 1/sr (its share against the impulses included).
  float (*pdf)(const BsdfParameters&, Vec3f wi, Vec3f wo, Vec3f n);
  /// Scattered, not absorbed, by band: the albedo seen from this direction, impulses included; of power, so that
  /// 1 / eta^2 is no part of it.
  Vec3f (*probability_in)(const BsdfParameters&, Vec3f wo, Vec3f n);
  Vec3f (*probability_out)(const BsdfParameters&, Vec3f wi, Vec3f n);
};

/// Sorted by name; a shader knows each by its place (render/bsdf/every_bsdf.shared.h).
std::span<const Bsdf> bsdfs();
/// Null where there is none of that name.
const Bsdf* find_bsdf(std::string_view name);
/// The member that a block's strengths call for: a lobe of strength 0 is none, and is not sampled. Null as above.
const Bsdf* bsdf_of(const world::Block& block);

/// Fails where a block names a BSDF that there is none of; the message names both, where that stands, and the nearest
/// name there is.
world::Status check_bsdfs(const world::BlockPalette& palette);

/// What a block's surface looks like from a medium of the given index of refraction outside. `inside`: seen from within
/// the block. `gloss`: which lobe blinn_phong and coverage have, shared::kGloss... (render/bsdf/blinn_phong.shared.h).
BsdfParameters bsdf_parameters(const world::Block& block, float index_outside, bool inside,
                               uint32_t gloss = shared::kGlossFresnel);

}  // namespace render
