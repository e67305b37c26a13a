#include "render/textures/texture_set.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "render_textures.members.h"
#include "world/base/jobs.h"
#include "world/base/text.h"
#include "world/blocks/block_texture.h"
#include "world/space/coords.h"

namespace render {

namespace {

struct Kind {
  const char* name;
  float (*value)(glm::vec2, uint32_t);
};
const Kind kKinds[] = {
#define TEXTURE(name) {#name, shared::name##_texture},
#include "render_textures.list.h"
#undef TEXTURE
};

uint32_t seed_of(const std::string& name) {
  uint32_t h = 2166136261u;  // FNV-1a
  for (const char c : name) h = (h ^ static_cast<unsigned char>(c)) * 16777619u;
  return h;
}

constexpr size_t kBlockTexels = size_t{shared::kTextureTiles} * shared::kTextureTileTexels;

/// Bytes of `size` x `size` texels. What a texel is rounded by goes on to the next, so that their mean stays.
void round_level(const float* from, int size, std::array<int8_t, shared::kTextureSize * shared::kTextureSize>& to) {
  float carried = 0;
  for (int i = 0; i < size * size; ++i) {
    const float wanted = 127 * from[i] + carried;
    to[static_cast<size_t>(i)] = static_cast<int8_t>(std::clamp(std::lround(wanted), -127l, 127l));
    carried = wanted - to[static_cast<size_t>(i)];
  }
}

/// The tiles of one block, kBlockTexels: finest levels first, made to have a mean of 0 and a largest of 1, then the
/// means.
void make_tiles(const Kind& kind, uint32_t seed, uint32_t* words) {
  constexpr int kSize = shared::kTextureSize;
  std::vector<float> texels(kBlockTexels);
  const auto tile = [&](uint32_t t) { return texels.data() + t * shared::kTextureTileTexels; };
  double mean = 0;
  for (uint32_t t = 0; t < shared::kTextureTiles; ++t)
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x) {
        const glm::vec2 p((static_cast<float>(x) + 0.5f) / kSize, (static_cast<float>(y) + 0.5f) / kSize);
        mean += tile(t)[y * kSize + x] = kind.value(p, seed + t * 977u);
      }
  mean /= kSize * kSize * shared::kTextureTiles;
  float largest = 1e-6f;
  for (uint32_t t = 0; t < shared::kTextureTiles; ++t)
    for (int i = 0; i < kSize * kSize; ++i) {
      tile(t)[i] -= static_cast<float>(mean);
      largest = std::max(largest, std::abs(tile(t)[i]));
    }
  for (uint32_t t = 0; t < shared::kTextureTiles; ++t) {
    for (int i = 0; i < kSize * kSize; ++i) tile(t)[i] /= largest;
    float *from = tile(t), *to = from + kSize * kSize;
    for (int size = kSize / 2; size >= 1; size /= 2) {
      for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
          const float* at = from + 2 * y * 2 * size + 2 * x;
          to[y * size + x] = 0.25f * (at[0] + at[1] + at[2 * size] + at[2 * size + 1]);
        }
      from = to, to += size * size;
    }
  }
  const float* from = texels.data();
  std::array<int8_t, kSize * kSize> rounded;
  for (uint32_t t = 0; t < shared::kTextureTiles; ++t)
    for (int size = kSize; size >= 1; from += size * size, size /= 2) {
      round_level(from, size, rounded);
      const auto byte = [&](int x, int y) -> uint32_t {
        return static_cast<uint8_t>(rounded[static_cast<size_t>((y & (size - 1)) * size + (x & (size - 1)))]);
      };
      for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x)
          *words++ = byte(x, y) | byte(x + 1, y) << 8 | byte(x, y + 1) << 16 | byte(x + 1, y + 1) << 24;
    }
}

}  // namespace

std::vector<std::string> texture_kinds() {
  std::vector<std::string> names;
  for (const Kind& kind : kKinds) names.push_back(kind.name);
  return names;
}

world::Status TextureSet::follow(const world::BlockPalette& palette, const RenderKnobs& knobs) {
  const size_t wanted = knobs.textures == TextureFilter::off ? 0 : palette.size();
  if (wanted == palette_) return {};
  palette_ = wanted;
  ++version_;
  blocks_ = {}, texels_ = {};
  blocks_.resize(wanted);
  struct Job {
    const Kind* kind;
    uint32_t seed;
  };
  std::vector<Job> jobs;
  for (size_t id = 0; id < wanted; ++id) {
    const world::Block& block = palette[static_cast<world::BlockId>(id)];
    const world::BlockTexture* texture = world::block_texture(block.name);
    if (!texture) continue;
    const auto kind =
        std::find_if(std::begin(kKinds), std::end(kKinds), [&](const Kind& k) { return texture->kind == k.name; });
    if (kind == std::end(kKinds))
      return world::input_error(fmt::format(
          "{}: there is no texture \"{}\" (did you mean \"{}\"?); they are: {}", texture->where, texture->kind,
          world::nearest_text(texture->kind, texture_kinds()), fmt::join(texture_kinds(), ", ")));
    // No albedo reaches 1.
    const float most = block.albedo.max() + block.glossy.max();
    blocks_[id] = {static_cast<uint32_t>(1 + jobs.size() * kBlockTexels),  // 0 is no place
                   std::min(texture->contrast, most > 0 ? std::max(0.999f / most - 1, 0.0f) : 0.0f)};
    jobs.push_back({kind, seed_of(block.name)});
  }
  if (jobs.empty()) return {};
  texels_.resize(1 + jobs.size() * kBlockTexels);
  world::parallel_ranges(jobs.size(), 1, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) make_tiles(*jobs[i].kind, jobs[i].seed, texels_.data() + 1 + i * kBlockTexels);
  });
  return {};
}

float TextureSet::factor(const RenderKnobs& knobs, world::BlockId block, world::VoxelPos voxel, int face,
                         const glm::vec3& fraction, const glm::vec3& step_x, const glm::vec3& step_y) const {
  const auto [first, contrast] = of(block);
  if (!first) return 1;
  const int axis = face >> 1;
  const auto place = [axis](const glm::vec3& v) { return shared::texture_place(axis, v); };
  return 1 + contrast * shared::texture_value(texels_.data(), first, static_cast<uint32_t>(knobs.textures),
                                              static_cast<uint32_t>(std::max(knobs.texture_anisotropy, 1)),
                                              {voxel.x, voxel.y, voxel.z}, static_cast<uint32_t>(face), place(fraction),
                                              place(step_x), place(step_y));
}

glm::vec3 TextureSet::normal(const RenderKnobs& knobs, world::BlockId block, world::VoxelPos voxel, int face,
                             const glm::vec3& fraction, const glm::vec3& step_x, const glm::vec3& step_y) const {
  const auto [first, contrast] = of(block);
  const int axis = face >> 1;
  if (!first || knobs.normal_detail == 0) {
    glm::vec3 n(0);
    n[axis] = static_cast<float>(world::face_sign(face));
    return n;
  }
  const auto place = [axis](const glm::vec3& v) { return shared::texture_place(axis, v); };
  return shared::texture_normal(texels_.data(), first, static_cast<uint32_t>(knobs.textures),
                                static_cast<uint32_t>(std::max(knobs.texture_anisotropy, 1)),
                                {voxel.x, voxel.y, voxel.z}, static_cast<uint32_t>(face), place(fraction),
                                place(step_x), place(step_y), knobs.normal_detail * contrast);
}

}  // namespace render
