/// Light on the visible faces of a world, as a light model found it: what both backends shade with in place of the open
/// sky. Made from a LightVolume or from a SurfaceIrradiance; where a world has neither, or a picture asks for none,
/// there is nothing of this.
///
///   region table -> 4096 places a region -> a record for each leaf with visible faces -> a code a face
/// all in plain arrays, which the rasterizer sends as they are. Levels follow the leaves whose light or faces changed:
/// a leaf that has more faces than before gets its codes at the end, and once half of them are holes all is made anew.
///
/// code    levels: four bits each of sky red, green, blue and block red, green, blue, from bit 0 on
///         irradiance: RGB9E5, W/m^2 (world/numbers/shared_exponent.h)
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "render/backend.h"
#include "render/light/surface_light.shared.h"
#include "render/shading.h"
#include "world/base/function_ref.h"

namespace render {

/// 512 bytes; the shader reads it as words.
struct SurfaceLightLeaf {
  uint32_t faces[6][16];  // visible faces by direction: bit index & 31 of word index >> 5
  uint16_t before[6][8];  // codes of this leaf before the first of faces[direction] in slice x
  uint32_t first, room;   // place of the leaf's first code, and how many fit from there
  uint32_t unused[6];
};
static_assert(sizeof(SurfaceLightLeaf) == 512);

class SurfaceLight {
 public:
  enum class Kind { none, levels, irradiance };
  static constexpr uint32_t kUnknown = 0xffffffffu;  // code of a face outside what a model covers

  /// Follows the world's light; true where anything was made anew. cost   some 20 ns a visible face, on all threads;
  /// where levels say which leaves changed, under 1 us for each of those
  bool follow(const world::WorldView& view, const WorldLight& light, LightModel model);

  Kind kind() const { return kind_; }
  /// The code of a visible face; kUnknown where there is none.
  uint32_t code(world::VoxelPos voxel, int face) const {
    const auto place = places_.find(world::region_from_voxel(voxel));
    if (place == places_.end()) return kUnknown;
    const uint32_t at = leaf_of_[size_t{place->second} * world::kLeavesPerRegion +
                                 static_cast<size_t>(world::index_in_region(world::leaf_from_voxel(voxel)))];
    if (at == 0) return kUnknown;
    const SurfaceLightLeaf& leaf = leaves_[at - 1];
    const int index = world::index_in_leaf(voxel), slice = index >> 6;
    const uint32_t* words = leaf.faces[face] + 2 * slice;
    const uint64_t bits = words[0] | uint64_t{words[1]} << 32;
    if (!(bits >> (index & 63) & 1)) return kUnknown;
    const uint64_t below = bits & ((1ull << (index & 63)) - 1);
    return codes_[leaf.first + leaf.before[face][slice] + static_cast<uint32_t>(std::popcount(below))];
  }

  /// Of a shape in its cell: of the face that looks as it does, or of any, since all have the light of the cell.
  uint32_t code_in_cell(world::VoxelPos cell, int face) const {
    uint32_t found = code(cell, face);
    for (int f = 0; f < world::kFaces && found == kUnknown; ++f) found = code(cell, f);
    return found;
  }

  const std::unordered_map<world::RegionPos, uint32_t, world::PosHash>& places() const { return places_; }
  const std::vector<uint32_t>& leaf_of() const { return leaf_of_; }  // [places][4096] 1 + place in leaves(), 0: none
  const std::vector<SurfaceLightLeaf>& leaves() const { return leaves_; }
  const std::vector<uint32_t>& codes() const { return codes_; }
  /// Raised each time that something is made anew.
  uint64_t version() const { return version_; }
  /// What the last follow() made anew, as places in leaf_of(), where that was some leaves of what version() - 1 had.
  /// Empty where all was.
  const std::vector<uint32_t>& patched() const { return patched_; }
  size_t bytes() const;

 private:
  struct LeafCodes;
  void rebuild(const world::WorldView& view, const WorldLight& light);
  /// False where a rebuild is better.
  bool patch(const world::WorldView& view, const WorldLight& light, const std::vector<world::LeafPos>& blocks,
             const world::LightChange& changed);
  void set_leaf(world::LeafPos l, const LeafCodes& made);
  Kind kind_ = Kind::none;
  uint64_t version_ = 0, store_ = 0, light_ = 0, changes_ = 0;
  int block_subscriber_ = 0, light_subscriber_ = 0;
  std::vector<uint32_t> patched_, free_leaves_;
  size_t unused_codes_ = 0;
  std::unordered_map<world::RegionPos, uint32_t, world::PosHash> places_;
  std::vector<uint32_t> leaf_of_, codes_;
  std::vector<SurfaceLightLeaf> leaves_;
};

/// How codes become the radiance of a face of albedo 1, beside the sun's: the numbers that both backends read.
///
/// A step between levels is kLevelRatio of the one above it, down to nothing at 0: were only the levels in that ratio,
/// a band that ends would leave the others in a strong colour, as blue does around a torch. The sky's 15 is the whole
/// sky as it shines on that side; the block light's 14 is what a face next to a lamp of kFullLampWatts gets, P / (4 pi
/// d^2) at d = 1 m times 1/2, the mean cosine of the faces that look at it.
struct SurfaceLightDecoder {
  SurfaceLight::Kind kind = SurfaceLight::Kind::none;
  std::array<float, 16> sky{}, block{};  // by level: part of the sky's light; W/(m^2 sr)
  std::array<Rgb, 6> sky_lit{};          // by face: under the whole sky

  SurfaceLightDecoder(SurfaceLight::Kind kind, const Shading& shading);
  Rgb operator()(uint32_t code, int face) const { return under(code, sky_lit[static_cast<size_t>(face)]); }
  /// Of a surface that has this under the whole sky.
  Rgb under(uint32_t code, const Rgb& whole) const;
};

/// Of levels.
uint32_t light_code(const world::LightSample& sample);
/// Of the first wall from a voxel on against the direction of `face` whose irradiance is known, within so many voxels.
uint32_t wall_code(const world::SurfaceIrradiance& irradiance, world::VoxelPos before, int face, int most);

/// Fails where a picture asks for light that nothing has made for the world.
world::Status check_light(const WorldLight& light, const RenderKnobs& knobs);

/// Whether the sky's level is the highest in any band: what sun_shadow=sky_light asks.
constexpr bool sees_whole_sky(uint32_t code) {
  return code == SurfaceLight::kUnknown || (code & 15) == 15 || (code >> 4 & 15) == 15 || (code >> 8 & 15) == 15;
}

/// The light of a face at a place on it, as the knobs say: in cells, and with the sky hidden by what stands around.
/// `cell(u, v)` is the code of the face u, v voxels further in its plane; `open(u, v)` says whether the voxel before it
/// is not opaque.
Rgb light_on_face(const SurfaceLightDecoder& decoder, const RenderKnobs& knobs, int face, glm::vec2 at,
                  world::FunctionRef<uint32_t(int u, int v)> cell, world::FunctionRef<bool(int u, int v)> open);

}  // namespace render
