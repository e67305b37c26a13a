#include "render/raster/billboards.h"

#include <algorithm>
#include <bit>
#include <iterator>

#include "billboards.frag.spv.h"
#include "billboards.vert.spv.h"
#include "world/base/jobs.h"
#include "world/base/random.h"

namespace render::raster {

namespace {

static_assert(kBillboardTexel == kCloudTexel);

/// Errors that clouds are made for, m, ascending.
constexpr double kErrors[] = {0.5, 1, 2};
/// Clouds that are made in a picture, but for those of one chunk.
constexpr uint64_t kMostMade = 64;
/// Of all clouds.
constexpr size_t kMostTexels = 16u << 20;

}  // namespace

void Billboards::drop(Chunk& chunk) {
  for (const Tree& tree : chunk.trees) {
    const auto found = clouds_.find(tree.cloud);
    if (--found->second.trees > 0) continue;
    texels_held_ -= found->second.cloud.texels.size();
    clouds_.erase(found);
    stale_ = true;
  }
  chunk = {};
}

/// Chunks that are no longer there, or not as they were.
void Billboards::drop_gone(const TreePool& trees) {
  if (trees_version_ == trees.version()) return;
  trees_version_ = trees.version();
  full_ = false;
  for (auto it = chunks_.begin(); it != chunks_.end();) {
    const TreePool::Records* records = trees.find(it->first);
    if (records && records->version == it->second.version) {
      ++it;
      continue;
    }
    drop(it->second);
    it = chunks_.erase(it);
  }
}

/// False where there is no room for them.
bool Billboards::make(Chunk& chunk, const TreePool::Records& records, size_t error, size_t most_texels) {
  std::vector<TreeFaces> trees = trees_of(records.records);
  Chunk made{records.version, error, {}};
  std::vector<std::pair<Cloud*, const TreeFaces*>> fresh;
  for (const TreeFaces& tree : trees) {
    Key key{1, 2, error};
    for (const UnitFace& f : tree.faces) {
      const uint64_t word = static_cast<uint64_t>(f.voxel.x) | static_cast<uint64_t>(f.voxel.y) << 8 |
                            static_cast<uint64_t>(f.voxel.z) << 16 | uint64_t{f.direction} << 24 |
                            uint64_t{f.block} << 32;
      key[0] = world::mix64(key[0] ^ word), key[1] = world::mix64(key[1] + word * 0x9e3779b97f4a7c15ull);
    }
    const auto [at, added] = clouds_.try_emplace(key);
    ++at->second.trees;
    if (added) fresh.emplace_back(&at->second, &tree);
    made.trees.push_back({tree.low, key});
  }
  world::parallel_ranges(fresh.size(), 1, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i)
      fresh[i].first->cloud = billboard_cloud(fresh[i].second->faces, kErrors[error]);
  });
  for (const auto& [cloud, tree] : fresh) texels_held_ += cloud->cloud.texels.size();
  made_ += fresh.size();
  stale_ |= !fresh.empty();
  drop(chunk);  // once the new ones are counted: what both have stays
  chunk = std::move(made);
  if (texels_held_ <= most_texels) return true;
  full_ = true;
  drop(chunk);
  return false;
}

void Billboards::choose(PassContext& context, const Drawing& drawing, std::span<SeenChunk> seen) {
  drawn_.clear();
  draws_.clear();
  faces_ = trees_ = made_ = 0;
  drop_gone(drawing.trees);
  const double allowed_at_1m = drawing.knobs.billboard_error_px / pixels_at_one_metre(drawing.rays, drawing.height);
  const size_t most_texels = std::min<size_t>(kMostTexels, context.device.limits().maxTexelBufferElements);
  for (SeenChunk& s : seen) {
    if (s.taken || s.pool->pool != &drawing.trees.pool()) continue;
    const auto coarsest = std::partition_point(std::begin(kErrors), std::end(kErrors), [&](double error) {
      return cloud_error(error) <= allowed_at_1m * s.distance;
    });
    if (coarsest == std::begin(kErrors)) continue;
    const auto error = static_cast<size_t>(coarsest - std::begin(kErrors)) - 1;
    const TreePool::Records* records = drawing.trees.find(s.chunk->origin);
    if (!records) continue;
    auto held = chunks_.find(s.chunk->origin);
    // A cloud that is a step better than it must be stays.
    const bool fits = held != chunks_.end() && held->second.error <= error && held->second.error + 1 >= error;
    if (!fits) {
      if (made_ >= kMostMade || full_) continue;
      if (held == chunks_.end()) held = chunks_.try_emplace(s.chunk->origin).first;
      if (!make(held->second, *records, error, most_texels)) {
        chunks_.erase(held);
        continue;
      }
    }
    ivec4 corner(0, 0, 0, static_cast<int>(s.detail));
    for (int a = 0; a < 3; ++a) corner[a] = s.chunk->origin[a] - drawing.camera.position.voxel[a];
    drawn_.push_back({&held->second, corner});
    s.taken = true;
    faces_ += s.chunk->count;
    trees_ += held->second.trees.size();
  }
}

world::Status Billboards::lay_out(PassContext& context) {
  std::vector<BillboardPlane> planes;
  std::vector<uint32_t> texels;
  texels.reserve(texels_held_);
  for (auto& [key, held] : clouds_) {
    held.first_plane = static_cast<uint32_t>(planes.size());
    const auto first = static_cast<uint32_t>(texels.size());
    const float error = static_cast<float>(kErrors[key[2]]);
    for (const CloudPlane& p : held.cloud.planes)
      planes.push_back({to_vec4(p.normal, p.offset), to_vec4(p.u, p.low_u), to_vec4(p.v, p.low_v),
                        uvec4(first + p.first, p.width, p.height, std::bit_cast<uint32_t>(error))});
    texels.insert(texels.end(), held.cloud.texels.begin(), held.cloud.texels.end());
  }
  stale_ = false;
  TRY_STATUS(
      context.fill(plane_buffer_, planes.data(), planes.size() * sizeof planes[0], VK_BUFFER_USAGE_STORAGE_BUFFER_BIT));
  return context.fill_texels(texel_buffer_, VK_FORMAT_R32_UINT, texels.data(), texels.size() * sizeof texels[0]);
}

world::Status Billboards::prepare(PassContext& context, bool blends) {
  if (drawn_.empty()) return {};
  Pipeline& drawn_by = pipelines_[blends];
  if (!drawn_by) {
    const Constant constants[] = {{kSpecBlends, blends}};
    TRY(drawn_by, make_graphics(context.device, billboards_vert_spv, billboards_frag_spv,
                                {.colour = {kSeenFormat}, .depth = kDepthFormat}, constants));
  }
  by_ = &drawn_by;
  if (stale_) TRY_STATUS(lay_out(context));
  for (const Drawn& d : drawn_)
    for (const Tree& tree : d.chunk->trees) {
      const Cloud& held = clouds_.at(tree.cloud);
      const ivec4 low = d.corner + ivec4(tree.low.x, tree.low.y, tree.low.z, 0);
      for (uint32_t p = 0; p < held.cloud.planes.size(); ++p)
        draws_.push_back({low, uvec4(held.first_plane + p, 0, 0, 0)});
    }
  TRY_STATUS(
      context.fill(draw_buffer_, draws_.data(), draws_.size() * sizeof draws_[0], VK_BUFFER_USAGE_STORAGE_BUFFER_BIT));
  context.bindings.bind(kBindBillboardPlanes, plane_buffer_);
  context.bindings.bind(kBindBillboardTexels, texel_buffer_);
  context.bindings.bind(kBindBillboardDraws, draw_buffer_);
  return {};
}

void Billboards::record(VkCommandBuffer commands, PassContext& context, const gpu::Buffer& indices,
                        uint32_t rectangles) {
  if (draws_.empty()) return;
  context.times.mark(commands, "billboards");
  const Targets& targets = context.targets;
  image_barrier(commands, targets.seen.handle, VK_IMAGE_ASPECT_COLOR_BIT, kColourReadWrite, kColourReadWrite);
  image_barrier(commands, targets.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT, kDepthReadWrite, kDepthReadWrite);
  const VkImageView seen = targets.seen.view;
  begin_rendering(commands, targets, {&seen, 1}, targets.depth.view, false);
  vkCmdBindIndexBuffer(commands, indices.handle, 0, VK_INDEX_TYPE_UINT32);
  context.bindings.use(commands, *by_);
  const auto count = static_cast<uint32_t>(draws_.size());
  for (uint32_t begin = 0; begin < count; begin += rectangles)
    vkCmdDrawIndexed(commands, 6 * std::min(rectangles, count - begin), 1, 0, static_cast<int32_t>(4 * begin), 0);
  vkCmdEndRendering(commands);
}

uint64_t Billboards::bytes() const { return plane_buffer_.size + texel_buffer_.size + draw_buffer_.size; }

void Billboards::finish(FrameReport& report) {
  if (draws_.empty()) return;
  PassReport& row = row_of(report, "billboards");
  row.draws = draws_.size();
  row.bytes = bytes();
  report.work.insert(report.work.end(), {{"billboard_trees", trees_},
                                         {"billboard_planes", draws_.size()},
                                         {"billboard_clouds", clouds_.size()},
                                         {"billboard_texels", texels_held_},
                                         {"billboards_made", made_}});
}

void Billboards::rest() {
  if (chunks_.empty() && drawn_.empty()) return;
  clouds_.clear();
  chunks_.clear();
  trees_version_ = texels_held_ = 0;
  drawn_.clear();
  draws_.clear();
  faces_ = trees_ = made_ = 0;
  stale_ = true, full_ = false;
  plane_buffer_ = {}, texel_buffer_ = {}, draw_buffer_ = {};
}

}  // namespace render::raster
