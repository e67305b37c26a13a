#include "render/raster/heightfields.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <tuple>

#include "heightfields.frag.spv.h"
#include "heightfields.vert.spv.h"
#include "world/base/jobs.h"
#include "world/base/random.h"

namespace render::raster {

namespace {

static_assert(kHeightColumns == kChunkSize);

/// Surfaces that are made in a picture, 1 ms each.
constexpr size_t kMostMade = 16;
/// Pictures that a surface is kept for without being seen.
constexpr uint64_t kKeptPictures = 600;
/// With fewer than this part of a cell allowed no step passes but on flat land, which is few faces.
constexpr double kLeastCells = 0.25;

constexpr int squares(int number) { return HeightSurface::side(number) - 1; }
constexpr uint32_t triangles_of(int number) {
  const auto n = static_cast<uint32_t>(squares(number));
  return 2 * n * n + 8 * n;
}
constexpr uint32_t first_index(int number) {
  uint32_t first = 0;
  for (int n = 0; n < number; ++n) first += 3 * triangles_of(n);
  return first;
}

/// Of a level: the y of its lowest and highest chunk.
struct Reach {
  int32_t low = 0, high = -1;
  explicit Reach(std::span<const ExtractedChunk* const> chunks) {
    for (const ExtractedChunk* c : chunks) {
      if (high < low) low = high = c->pos.y;
      low = std::min(low, c->pos.y), high = std::max(high, c->pos.y);
    }
  }
};

std::vector<const ExtractedChunk*> chunks_at(std::span<const ExtractedChunk* const> chunks, Reach reach, int32_t x,
                                             int32_t z) {
  std::vector<const ExtractedChunk*> found;
  for (int32_t y = reach.low; y <= reach.high; ++y) {
    const ChunkPos pos{x, y, z};
    const auto at = std::lower_bound(chunks.begin(), chunks.end(), pos,
                                     [](const ExtractedChunk* chunk, ChunkPos p) { return chunk->pos < p; });
    if (at != chunks.end() && (*at)->pos == pos) found.push_back(*at);
  }
  return found;
}

}  // namespace

struct Heightfields::Fresh {
  Surface* surface;
  std::vector<const ExtractedChunk*> chunks;
  std::optional<HeightSurface> made{};
};

void Heightfields::drop(const Surface& surface) {
  if (surface.is_one) free_slots_.push_back(surface.slot);
}

void Heightfields::drop_old() {
  std::erase_if(surfaces_, [&](const auto& entry) {
    if (entry.second.asked + kKeptPictures >= pictures_) return false;
    drop(entry.second);
    return true;
  });
}

/// Puts what was made into slots. Where there is no room it counts as no surface.
world::Status Heightfields::keep(PassContext& context, std::span<Fresh> made) {
  constexpr uint64_t kBytes = kHeightWords * sizeof(uint32_t);
  const uint32_t most = context.device.limits().maxTexelBufferElements / kHeightWords;
  for (Fresh& fresh : made) {
    Surface& surface = *fresh.surface;
    drop(surface);
    surface.is_one = false;
    if (!fresh.made) continue;
    if (free_slots_.empty() && slots_ < most) {
      const uint32_t more = std::min(most, std::max(64u, slots_ + slots_ / 2));
      TRY(gpu::Buffer larger,
          gpu::make_texel_buffer(context.device, more * kBytes, VK_FORMAT_R32_UINT, 0, gpu::MemoryUse::upload));
      if (slots_ > 0) std::memcpy(larger.mapped(), words_.mapped(), slots_ * kBytes);
      words_ = std::move(larger);
      for (uint32_t slot = more; slot-- > slots_;) free_slots_.push_back(slot);
      slots_ = more;
    }
    if (free_slots_.empty()) continue;
    surface.is_one = true;
    surface.slot = free_slots_.back();
    free_slots_.pop_back();
    surface.base = fresh.made->base;
    surface.floor = fresh.made->floor;
    surface.error = fresh.made->error;
    std::memcpy(words_.mapped() + surface.slot * kBytes, fresh.made->words.data(), kBytes);
  }
  made_ += made.size();
  return {};
}

/// False where its faces are better.
bool Heightfields::draw_stack(const Drawing& drawing, Stack& stack, const Surface& surface) {
  const SeenChunk& nearest = *stack.chunks.front();
  if (drawing.camera.position.voxel.y < int64_t{surface.floor} * (1 << nearest.level)) return false;
  const double cells = drawing.knobs.heightfield_error_px * nearest.distance /
                       (pixels_at_one_metre(drawing.rays, drawing.height) * std::ldexp(1.0, nearest.level));
  int number = HeightSurface::kSteps - 1;
  while (number >= 0 && surface.error[static_cast<size_t>(number)] > cells) --number;
  uint64_t records = 0;
  for (const SeenChunk* s : stack.chunks) records += s->chunk->count;
  // Of the faces half look away, and some of the others are hidden.
  if (number < 0 || triangles_of(number) > records) return false;
  Drawn drawn{number, false, {}};
  const world::VoxelPos low{stack.key.x * kChunkSize, surface.base, stack.key.z * kChunkSize};
  for (int a = 0; a < 3; ++a)
    drawn.draw.corner[a] = static_cast<int>((int64_t{low[a]} << nearest.level) - drawing.camera.position.voxel[a]);
  drawn.draw.corner.w = static_cast<int>(nearest.detail);
  const uint32_t first = surface.slot * kHeightWords;
  drawn.draw.words =
      uvec4(first, first + HeightSurface::first_vertex(number), HeightSurface::step(number), squares(number));
  for (SeenChunk* s : stack.chunks) {
    s->taken = true;
    drawn.straddles |= s->straddles;
  }
  drawn_.push_back(drawn);
  faces_ += records;
  triangles_ += triangles_of(number);
  return true;
}

world::Status Heightfields::choose(PassContext& context, const Drawing& drawing, std::span<SeenChunk> seen) {
  drawn_.clear();
  faces_ = triangles_ = made_ = 0;
  ++pictures_;
  std::vector<Stack> stacks;
  std::unordered_map<world::VoxelPos, size_t, world::PosHash> places;
  for (SeenChunk& s : seen) {
    if (s.taken || s.pool->pool != drawing.faces[static_cast<size_t>(s.level)]) continue;
    const world::VoxelPos key{s.chunk->origin.x >> kChunkLog2, s.level, s.chunk->origin.z >> kChunkLog2};
    const auto [at, added] = places.try_emplace(key, stacks.size());
    if (added) stacks.push_back({key, {}});
    stacks[at->second].chunks.push_back(&s);
  }
  // Some of them may be drawn in this level and others in the next.
  std::erase_if(stacks, [&](const Stack& stack) {
    const SeenChunk& first = *stack.chunks.front();
    const double cells = drawing.knobs.heightfield_error_px * first.distance /
                         (pixels_at_one_metre(drawing.rays, drawing.height) * std::ldexp(1.0, first.level));
    return cells < kLeastCells || std::any_of(stack.chunks.begin(), stack.chunks.end(),
                                              [&](const SeenChunk* s) { return s->detail != first.detail; });
  });
  std::vector<Reach> reach;
  for (const auto chunks : drawing.extracted) reach.emplace_back(chunks);
  std::vector<Fresh> fresh;
  for (const Stack& stack : stacks) {
    const auto level = static_cast<size_t>(stack.key.y);
    std::vector<const ExtractedChunk*> chunks =
        chunks_at(drawing.extracted[level], reach[level], stack.key.x, stack.key.z);
    uint64_t version = 0;
    for (const ExtractedChunk* c : chunks) version = world::mix64(version ^ c->version) + 1;
    Surface& surface = surfaces_[stack.key];
    surface.asked = pictures_;
    if (surface.version == version) continue;
    if (fresh.size() < kMostMade) {
      surface.version = version;
      fresh.push_back({&surface, std::move(chunks)});
    } else {
      drop(surface);
      surface = {.asked = pictures_};
    }
  }
  world::parallel_ranges(fresh.size(), 1, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) fresh[i].made = height_surface(fresh[i].chunks);
  });
  TRY_STATUS(keep(context, fresh));
  for (Stack& stack : stacks) {
    const Surface& surface = surfaces_.at(stack.key);
    if (surface.is_one) draw_stack(drawing, stack, surface);
  }
  drop_old();
  return {};
}

/// Triangles of the squares of each step, then of its skirt's.
world::Status Heightfields::fit_indices(PassContext& context) {
  if (indices_.handle) return {};
  std::vector<uint32_t> indices;
  indices.reserve(first_index(HeightSurface::kSteps));
  const auto quad = [&](uint32_t low, uint32_t beside, uint32_t above, uint32_t high) {
    indices.insert(indices.end(), {low, beside, high, low, high, above});
  };
  for (int number = 0; number < HeightSurface::kSteps; ++number) {
    const int n = squares(number), side = n + 1;
    const auto vertex = [&](ivec2 at) { return static_cast<uint32_t>(at.x * side + at.y); };
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) quad(vertex({i, j}), vertex({i + 1, j}), vertex({i, j + 1}), vertex({i + 1, j + 1}));
    const auto below = static_cast<uint32_t>(side * side);
    for (int k = 0; k < 4 * n; ++k) {
      const int next = (k + 1) % (4 * n);
      quad(vertex(above_skirt(k, n)), vertex(above_skirt(next, n)), below + static_cast<uint32_t>(k),
           below + static_cast<uint32_t>(next));
    }
  }
  return context.fill(indices_, indices.data(), indices.size() * sizeof indices[0], VK_BUFFER_USAGE_INDEX_BUFFER_BIT);
}

world::Status Heightfields::prepare(PassContext& context, bool blends) {
  Pipeline& drawn_by = pipelines_[blends];
  if (!drawn_by) {
    const Constant constants[] = {{kSpecBlends, blends}};
    TRY(drawn_by, make_graphics(context.device, heightfields_vert_spv, heightfields_frag_spv,
                                {.colour = {kSeenFormat}, .depth = kDepthFormat}, constants));
  }
  by_ = &drawn_by;
  TRY_STATUS(fit_indices(context));
  // Front to back. Those that the frustum cuts are calls of their own: one clipped triangle makes lavapipe slow for all
  // of its call.
  calls_.clear();
  std::vector<HeightDraw> draws;
  for (size_t i = 0; i < drawn_.size(); ++i) {
    const Drawn& d = drawn_[i];
    if (i == 0 || std::tie(drawn_[i - 1].straddles, drawn_[i - 1].number) != std::tie(d.straddles, d.number))
      calls_.push_back({d.number, static_cast<uint32_t>(i), 0});
    ++calls_.back().count;
    draws.push_back(d.draw);
  }
  TRY_STATUS(context.fill(draws_, draws.data(), draws.size() * sizeof draws[0], VK_BUFFER_USAGE_STORAGE_BUFFER_BIT));
  context.bindings.bind(kBindHeightWords, words_);
  context.bindings.bind(kBindHeightDraws, draws_);
  return {};
}

void Heightfields::record(VkCommandBuffer commands, PassContext& context) {
  context.times.mark(commands, "heightfields");
  const Targets& targets = context.targets;
  image_barrier(commands, targets.seen.handle, VK_IMAGE_ASPECT_COLOR_BIT, kColourReadWrite, kColourReadWrite);
  image_barrier(commands, targets.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT, kDepthReadWrite, kDepthReadWrite);
  const VkImageView seen = targets.seen.view;
  begin_rendering(commands, targets, {&seen, 1}, targets.depth.view, false);
  vkCmdBindIndexBuffer(commands, indices_.handle, 0, VK_INDEX_TYPE_UINT32);
  context.bindings.use(commands, *by_);
  for (const Call& call : calls_)
    vkCmdDrawIndexed(commands, 3 * triangles_of(call.number), call.count, first_index(call.number), 0, call.first);
  vkCmdEndRendering(commands);
}

uint64_t Heightfields::bytes() const { return words_.size + draws_.size + indices_.size; }

void Heightfields::finish(FrameReport& report) {
  PassReport& row = row_of(report, "heightfields");
  row.draws = calls_.size();
  row.bytes = bytes();
  report.work.insert(
      report.work.end(),
      {{"heightfields", drawn_.size()}, {"heightfield_triangles", triangles_}, {"heightfields_made", made_}});
}

void Heightfields::rest() {
  if (surfaces_.empty()) return;
  surfaces_.clear();
  free_slots_.clear();
  slots_ = 0;
  drawn_.clear();
  faces_ = triangles_ = made_ = 0;
  words_ = {}, draws_ = {}, indices_ = {};
}

}  // namespace render::raster
