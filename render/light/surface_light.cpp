#include "render/light/surface_light.h"

#include <algorithm>
#include <cmath>

#include "render/extract/faces.h"
#include "world/base/jobs.h"
#include "world/numbers/shared_exponent.h"

namespace render {

using world::LeafPos;
using world::VoxelPos;

namespace {

constexpr float kPi = 3.14159265f;

/// Transparent voxels behind which a wall is looked for, where a face has no irradiance of its own.
constexpr int kMostDepth = 16;

/// What one chunk adds.
struct ChunkLight {
  std::vector<uint16_t> leaf;  // index_in_chunk
  std::vector<SurfaceLightLeaf> leaves;
  std::vector<uint32_t> codes;
};

/// A leaf and its six neighbours: what sees into it.
void add_seeing(LeafPos l, std::vector<LeafPos>& leaves) {
  leaves.push_back(l);
  for (int face = 0; face < world::kFaces; ++face) {
    const VoxelPos step = world::face_step(face);
    leaves.push_back(l + LeafPos{step.x, step.y, step.z});
  }
}

template <class Code>
void add_leaf(const LeafFaces& faces, LeafPos l, ChunkLight& chunk, Code code) {
  SurfaceLightLeaf& leaf = chunk.leaves.emplace_back();
  leaf.first = static_cast<uint32_t>(chunk.codes.size());
  leaf.room = static_cast<uint32_t>(faces.count());
  const VoxelPos corner = world::voxel_from_leaf(l);
  for (int face = 0; face < world::kFaces; ++face)
    for (int x = 0; x < 8; ++x) {
      const uint64_t bits = faces.face[face].word[x];
      leaf.faces[face][2 * x] = static_cast<uint32_t>(bits);
      leaf.faces[face][2 * x + 1] = static_cast<uint32_t>(bits >> 32);
      leaf.before[face][x] = static_cast<uint16_t>(chunk.codes.size() - leaf.first);
      for (uint64_t left = bits; left; left &= left - 1)
        chunk.codes.push_back(code(corner + world::offset_in_leaf(x * 64 + std::countr_zero(left)), face));
    }
}

}  // namespace

uint32_t light_code(const world::LightSample& s) {
  uint32_t code = 0;
  for (int b = 0; b < 3; ++b)
    code |= uint32_t{s.sky[static_cast<size_t>(b)]} << (4 * b) | uint32_t{s.block[static_cast<size_t>(b)]}
                                                                     << (12 + 4 * b);
  return code;
}

uint32_t wall_code(const world::SurfaceIrradiance& irradiance, VoxelPos before, int face, int most) {
  const int towards = world::opposite_face(face);
  const VoxelPos inward = world::face_step(towards);
  for (int depth = 0; depth < most; ++depth, before = before + inward)
    if (const world::Irradiance3* e = irradiance.find(before, towards))
      return world::Rgb9e5::from({e->r, e->g, e->b}).code;
  return SurfaceLight::kUnknown;
}

bool SurfaceLight::follow(const world::WorldView& view, const WorldLight& w, LightModel model) {
  const Kind kind = model == LightModel::none                   ? Kind::none
                    : model == LightModel::flux && w.irradiance ? Kind::irradiance
                    : model != LightModel::flux && w.levels     ? Kind::levels
                                                                : Kind::none;
  patched_.clear();
  const uint64_t light = kind == Kind::none ? 0 : w.version;
  const bool same_store = view.store().identity() == store_;
  std::vector<LeafPos> dirty;
  if (same_store) dirty = view.store().take_dirty(block_subscriber_);
  if (kind == kind_ && (kind == Kind::none || (same_store && light == light_ && dirty.empty()))) return false;
  if (!same_store) store_ = view.store().identity(), block_subscriber_ = view.store().subscribe();

  world::LightChange changed;
  changed.all = kind != Kind::levels || kind != kind_ || !same_store;
  if (kind == Kind::levels && w.changes) {
    if (w.changes->identity() != changes_) changes_ = w.changes->identity(), light_subscriber_ = w.changes->subscribe();
    changed.add(w.changes->take(light_subscriber_));
  } else if (light != light_) {
    changed.all = true;
  }
  kind_ = kind, light_ = light;
  ++version_;
  if (!changed.all && patch(view, w, dirty, changed)) return true;
  patched_.clear(), free_leaves_.clear();
  unused_codes_ = 0;
  places_.clear(), leaf_of_.clear(), leaves_.clear(), codes_.clear();
  if (kind != Kind::none) rebuild(view, w);
  return true;
}

/// What one leaf shows now.
struct SurfaceLight::LeafCodes {
  ChunkLight of_leaf;  // of at most one leaf
};

bool SurfaceLight::patch(const world::WorldView& view, const WorldLight& w, const std::vector<LeafPos>& blocks,
                         const world::LightChange& changed) {
  const FaceSource source{&view.store(), &view.masks(world::MaskKind::occupied), &view.masks(world::MaskKind::opaque)};
  std::vector<LeafPos> leaves;
  for (const auto* list : {&blocks, &changed.leaves})
    for (const LeafPos& l : *list) add_seeing(l, leaves);
  for (const world::RegionPos& r : changed.regions) {
    // All that it holds, and what looks into it from the regions beside.
    for (int i = 0; i < world::kLeavesPerRegion; ++i) {
      const LeafPos offset = world::leaf_offset_in_region(i), l = world::leaf_from_region(r) + offset;
      leaves.push_back(l);
      for (int face = 0; face < world::kFaces; ++face) {
        const int at = offset[world::face_axis(face)];
        if (at != (world::face_sign(face) < 0 ? 0 : world::kRegionLeaves - 1)) continue;
        const VoxelPos step = world::face_step(face);
        leaves.push_back(l + LeafPos{step.x, step.y, step.z});
      }
    }
  }
  std::sort(leaves.begin(), leaves.end());
  leaves.erase(std::unique(leaves.begin(), leaves.end()), leaves.end());
  // Each alone costs more than in a chunk.
  if (leaves.size() > leaves_.size() / 4 + 64) return false;

  world::StoreReader reader(view.store());
  LeafCodes made;
  for (const LeafPos& l : leaves) {
    made.of_leaf.leaves.clear(), made.of_leaf.codes.clear();
    const world::MaskRegion* region = source.occupied->region(world::region_from_leaf(l));
    if (region && region->leaf_any(l))
      if (const LeafFaces faces = extract_leaf_faces(source, &reader, l); !faces.is_none())
        add_leaf(faces, l, made.of_leaf,
                 [&](VoxelPos v, int face) { return light_code(w.levels->sample(v + world::face_step(face))); });
    set_leaf(l, made);
  }
  return unused_codes_ <= codes_.size() / 2 + 4096;
}

void SurfaceLight::set_leaf(LeafPos l, const LeafCodes& made) {
  const world::RegionPos r = world::region_from_leaf(l);
  auto place = places_.find(r);
  if (place == places_.end()) {
    if (made.of_leaf.leaves.empty()) return;
    place = places_.try_emplace(r, static_cast<uint32_t>(places_.size())).first;
    leaf_of_.resize(leaf_of_.size() + world::kLeavesPerRegion, 0);
  }
  const size_t index = size_t{place->second} * world::kLeavesPerRegion + static_cast<size_t>(world::index_in_region(l));
  uint32_t& at = leaf_of_[index];
  if (at == 0 && made.of_leaf.leaves.empty()) return;
  patched_.push_back(static_cast<uint32_t>(index));
  if (made.of_leaf.leaves.empty()) {
    unused_codes_ += leaves_[at - 1].room;
    free_leaves_.push_back(at);
    at = 0;
    return;
  }
  const std::vector<uint32_t>& codes = made.of_leaf.codes;
  uint32_t first = static_cast<uint32_t>(codes_.size()), room = static_cast<uint32_t>(codes.size());
  if (at != 0 && leaves_[at - 1].room >= room) {
    first = leaves_[at - 1].first, room = leaves_[at - 1].room;
  } else {
    if (at != 0) unused_codes_ += leaves_[at - 1].room;
    codes_.resize(codes_.size() + codes.size());
  }
  if (at == 0 && !free_leaves_.empty()) {
    at = free_leaves_.back();
    free_leaves_.pop_back();
  } else if (at == 0) {
    leaves_.emplace_back();
    at = static_cast<uint32_t>(leaves_.size());
  }
  SurfaceLightLeaf& leaf = leaves_[at - 1];
  leaf = made.of_leaf.leaves.front();
  leaf.first = first, leaf.room = room;
  std::copy(codes.begin(), codes.end(), codes_.begin() + first);
}

void SurfaceLight::rebuild(const world::WorldView& view, const WorldLight& w) {
  const FaceSource source{&view.store(), &view.masks(world::MaskKind::occupied), &view.masks(world::MaskKind::opaque)};
  const std::vector<ChunkPos> chunks = occupied_chunks(*source.occupied);
  std::vector<ChunkLight> made(chunks.size());
  world::parallel_ranges(chunks.size(), 1, [&](size_t begin, size_t end) {
    ChunkFaces faces;
    world::StoreReader reader(view.store());
    for (size_t c = begin; c < end; ++c) {
      faces.clear();
      extract_chunk_faces(source, &reader, chunks[c], faces);
      made[c].leaf = faces.leaf;
      for (size_t i = 0; i < faces.leaf.size(); ++i) {
        const LeafPos l = leaf_in_chunk(chunks[c], faces.leaf[i]);
        if (kind_ == Kind::levels) {
          add_leaf(faces.faces[i], l, made[c],
                   [&](VoxelPos v, int face) { return light_code(w.levels->sample(v + world::face_step(face))); });
        } else {
          // A face of glass or water has what the wall behind it has.
          add_leaf(faces.faces[i], l, made[c], [&](VoxelPos v, int face) {
            return wall_code(*w.irradiance, v + world::face_step(face), face, kMostDepth);
          });
        }
      }
    }
  });
  size_t leaves = 0, codes = 0;
  for (const ChunkLight& m : made) leaves += m.leaves.size(), codes += m.codes.size();
  leaves_.reserve(leaves), codes_.reserve(codes);
  for (size_t c = 0; c < chunks.size(); ++c) {
    for (size_t i = 0; i < made[c].leaf.size(); ++i) {
      const LeafPos l = leaf_in_chunk(chunks[c], made[c].leaf[i]);
      const auto [place, fresh] =
          places_.try_emplace(world::region_from_leaf(l), static_cast<uint32_t>(places_.size()));
      if (fresh) leaf_of_.resize(leaf_of_.size() + world::kLeavesPerRegion, 0);
      SurfaceLightLeaf& leaf = leaves_.emplace_back(made[c].leaves[i]);
      leaf.first += static_cast<uint32_t>(codes_.size());
      leaf_of_[size_t{place->second} * world::kLeavesPerRegion + static_cast<size_t>(world::index_in_region(l))] =
          static_cast<uint32_t>(leaves_.size());
    }
    codes_.insert(codes_.end(), made[c].codes.begin(), made[c].codes.end());
    made[c] = {};
  }
}

world::Status check_light(const WorldLight& w, const RenderKnobs& knobs) {
  const bool levels = knobs.light_model == LightModel::flood4 || knobs.light_model == LightModel::flood_rgb;
  if ((levels && !w.levels) || (knobs.light_model == LightModel::flux && !w.irradiance))
    return world::usage_error(
        "light_model: the world has no light of this model; whoever draws it must simulate it first");
  if (knobs.sun_shadow == SunShadow::sky_light && !levels)
    return world::usage_error("sun_shadow=sky_light reads levels of light: set light_model to flood4 or flood_rgb");
  return {};
}

size_t SurfaceLight::bytes() const {
  return leaf_of_.capacity() * 4 + codes_.capacity() * 4 + leaves_.capacity() * sizeof(SurfaceLightLeaf) +
         places_.size() * 32;
}

SurfaceLightDecoder::SurfaceLightDecoder(SurfaceLight::Kind of, const Shading& shading) : kind(of) {
  const double next_to_lamp = world::kFullLampWatts / (4 * double(kPi)) / 2 / double(kPi);
  for (int level = 1; level <= world::kMaxLight; ++level) {
    const auto part = [&](int whole) {
      const double none = std::pow(world::kLevelRatio, whole);
      return (std::pow(world::kLevelRatio, whole - level) - none) / (1 - none);
    };
    sky[static_cast<size_t>(level)] = static_cast<float>(part(world::kMaxLight));
    block[static_cast<size_t>(level)] = static_cast<float>(next_to_lamp * part(world::kMaxLight - 1));
  }
  for (size_t face = 0; face < 6; ++face) sky_lit[face] = shading.sky_lit[face];
}

Rgb SurfaceLightDecoder::under(uint32_t code, const Rgb& whole) const {
  if (kind == SurfaceLight::Kind::none || code == SurfaceLight::kUnknown) return whole;
  if (kind == SurfaceLight::Kind::irradiance) {
    const glm::vec3 e = world::Rgb9e5{code}.value() / kPi;
    return {e.x, e.y, e.z};
  }
  const auto band = [&](float of_sky, int b) {
    return of_sky * sky[code >> (4 * b) & 15] + block[code >> (12 + 4 * b) & 15];
  };
  return {band(whole.r, 0), band(whole.g, 1), band(whole.b, 2)};
}

Rgb light_on_face(const SurfaceLightDecoder& decoder, const RenderKnobs& knobs, int face, glm::vec2 at,
                  world::FunctionRef<uint32_t(int, int)> cell, world::FunctionRef<bool(int, int)> open) {
  shared::LightCells cells;
  const Rgb own = decoder(cell(0, 0), face);
  glm::vec3 light(own.r, own.g, own.b);
  if (decoder.kind != SurfaceLight::Kind::none && knobs.light_interpolation != LightInterpolation::face) {
    uint32_t known = 1u << 4;
    cells.value[4] = light;
    for (int i = 0; i < 9; ++i) {
      const uint32_t code = i == 4 ? SurfaceLight::kUnknown : cell(i % 3 - 1, i / 3 - 1);
      if (code == SurfaceLight::kUnknown) continue;
      const Rgb c = decoder(code, face);
      cells.value[i] = {c.r, c.g, c.b};
      known |= 1u << i;
    }
    light = knobs.light_interpolation == LightInterpolation::vertex ? shared::vertex_light(cells, known, at)
                                                                    : shared::linear_light(cells, known, at);
  }
  if (knobs.corner_occlusion && decoder.kind != SurfaceLight::Kind::irradiance) {
    uint32_t bits = 0;
    for (int i = 0; i < 9; ++i)
      if (i == 4 || open(i % 3 - 1, i / 3 - 1)) bits |= 1u << i;
    light *= shared::corner_occlusion(bits, at);
  }
  return {light.x, light.y, light.z};
}

}  // namespace render
