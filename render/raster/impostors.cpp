#include "render/raster/impostors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <tuple>
#include <utility>

#include "impostor_pack.comp.spv.h"
#include "impostors.frag.spv.h"
#include "impostors.vert.spv.h"

namespace render::raster {

namespace {
/// What of the allowed error texels may take; the rest is the camera's to move.
constexpr double kTexelShare = 0.25;
/// A face costs as much as about this many pixels of an impostor (lavapipe, 2026-11-27).
constexpr double kFacePixels = 100;
/// An impostor is worth making where it serves so many pictures.
constexpr double kLeastPictures = 4;
/// Pictures in which a chunk stayed as it is, before it gets one.
constexpr uint32_t kSettled = 2;
/// Faces that are drawn for impostors in a picture, but for those of one.
constexpr uint64_t kMostFacesMade = 32768;
/// The images in which impostors are made.
constexpr int kImageTexels = 1024;
/// A camera that moves farther from one picture to the next was put somewhere else.
constexpr double kJump = 64;  // m
constexpr size_t kEyes = 8;

/// One for each impostor that is made, at offsets that every device takes.
constexpr VkDeviceSize kViewStride = (sizeof(PictureConstants) + 255) / 256 * 256;

/// Of the picture, that the window of an impostor made here would cover.
double covered_pixels(const ImpostorView& view, const Drawing& drawing) {
  const PixelRays window = view.rays(), &screen = drawing.rays;
  double low[2] = {1, 1}, high[2] = {-1, -1};
  const double whole = double(drawing.width) * drawing.height;
  for (int k = 0; k < 4; ++k) {
    const Vec3d p = window.direction(k & 1 ? view.width : 0, k & 2 ? view.height : 0);
    const double w = glm::dot(p, screen.forward);
    if (!(w > 0)) return whole;
    const double at[2] = {glm::dot(p, screen.window_right) / (w * screen.window_half_x),
                          glm::dot(p, screen.window_up) / (w * screen.window_half_y)};
    for (int a = 0; a < 2; ++a) low[a] = std::min(low[a], at[a]), high[a] = std::max(high[a], at[a]);
  }
  double part = 1;
  for (int a = 0; a < 2; ++a) part *= std::max(0.0, std::min(high[a], 1.0) - std::max(low[a], -1.0)) / 2;
  return part * whole;
}

ivec4 corner_of(const SeenChunk& s, const Camera& camera) {
  ivec4 corner(0, 0, 0, static_cast<int>(s.detail));
  for (int a = 0; a < 3; ++a)
    corner[a] = static_cast<int32_t>((int64_t{s.chunk->origin[a]} << s.level) - camera.position.voxel[a]);
  return corner;
}

/// All of an impostor's window. Strips of it differ in their corners.
ImpostorDraw draw_of(const ImpostorView& view, const PixelRays& window, ivec4 chunk, uint32_t first,
                     const Drawing& drawing) {
  const PixelRays& screen = drawing.rays;
  const Vec3d moved = drawing.camera.position - view.camera.position;
  const double plane = view.plane(), ahead = glm::dot(moved, window.forward);
  ImpostorDraw draw{};
  // A pixel's ray r meets the plane at moved + (plane - ahead) / (r . forward) r.
  const auto row = [&](const Vec3d& step) {
    const double square = glm::dot(step, step);
    const double of_depth = (glm::dot(moved, step) / plane - glm::dot(window.corner, step)) / square;
    const double of_step = (plane - ahead) / (plane * square);
    const auto along = [&](const Vec3d& ray) {
      return static_cast<float>(of_depth * glm::dot(ray, window.forward) + of_step * glm::dot(ray, step));
    };
    return vec4(along(screen.step_x), along(screen.step_y), along(screen.corner), 0);
  };
  draw.row_x = row(window.step_x);
  draw.row_y = row(window.step_y);
  draw.row_w = vec4(glm::dot(screen.step_x, window.forward), glm::dot(screen.step_y, window.forward),
                    glm::dot(screen.corner, window.forward), 0);
  draw.row_x.w = static_cast<float>(view.near);
  draw.depth = vec4(glm::dot(screen.forward, window.corner), glm::dot(screen.forward, window.step_x),
                    glm::dot(screen.forward, window.step_y), glm::dot(screen.forward, moved));
  draw.chunk = chunk;
  draw.texels = uvec4(first, view.width, view.height, 0);
  return draw;
}

/// Of texels [low, high) of it.
void place_corners(ImpostorDraw& draw, const ImpostorView& view, const PixelRays& window, glm::dvec2 low,
                   glm::dvec2 high, const Drawing& drawing) {
  const PixelRays& screen = drawing.rays;
  const Vec3d moved = drawing.camera.position - view.camera.position;
  for (int k = 0; k < 4; ++k) {
    const Vec3d p = view.plane() * window.direction(k & 1 ? high.x : low.x, k & 2 ? high.y : low.y) - moved;
    draw.corners[k] =
        vec4(glm::dot(p, screen.window_right) / screen.window_half_x,
             -glm::dot(p, screen.window_up) / screen.window_half_y, drawing.near, glm::dot(p, screen.forward));
  }
}

uint32_t strips_of(const ImpostorView& view) {
  return (static_cast<uint32_t>(view.width) + kStripTexels - 1) / kStripTexels;
}

}  // namespace

struct Impostors::Candidate {
  SeenChunk* seen;
  ImpostorView view;
  double pictures;
  uint64_t seen_faces = 0, faces = 0;
  std::vector<std::pair<uint32_t, uint32_t>> runs;

  /// Directions of which no face looks towards the camera are left out.
  void count_faces() {
    const auto& clusters = seen->chunk->clusters;
    const double scale = std::ldexp(1.0, seen->level);
    const auto at = [&](const std::array<uint8_t, 3>& p) { return seen->corner + scale * Vec3d(p[0], p[1], p[2]); };
    for (size_t begin = 0, end = 0; begin < clusters.size(); begin = end) {
      bool any = false;
      uint32_t records = 0;
      for (; end < clusters.size() && clusters[end].direction == clusters[begin].direction; ++end) {
        records += clusters[end].count;
        if (looks_away(clusters[end], at(clusters[end].box.min), at(clusters[end].box.max))) continue;
        any = true;
        seen_faces += clusters[end].among(clusters[end].seen);
      }
      if (!any) continue;
      faces += records;
      if (!runs.empty() && runs.back().first + runs.back().second == clusters[begin].first)
        runs.back().second += records;
      else
        runs.emplace_back(clusters[begin].first, records);
    }
  }
};

double Impostors::metres_a_picture(const Camera& camera) {
  double most = 0;
  if (!eyes_.empty() && glm::length(camera.position - eyes_.back()) > kJump) eyes_.clear();
  eyes_.push_back(camera.position);
  if (eyes_.size() > kEyes) eyes_.pop_front();
  for (size_t i = 1; i < eyes_.size(); ++i) most = std::max(most, glm::length(eyes_[i] - eyes_[i - 1]));
  return most;
}

std::optional<std::pair<int, int>> Impostors::place_in_images(int width, int height) {
  if (shelf_x_ + width > kImageTexels) shelf_x_ = 0, shelf_y_ += std::exchange(shelf_height_, 0);
  if (shelf_y_ + height > kImageTexels) return std::nullopt;
  shelf_height_ = std::max(shelf_height_, height);
  return std::pair{std::exchange(shelf_x_, shelf_x_ + width), shelf_y_};
}

/// The id of a new impostor; 0 where there is no room.
world::Result<uint64_t> Impostors::make_room(PassContext& context, const ImpostorView& view, uint64_t most_bytes) {
  const auto texels = static_cast<uint32_t>(view.width * view.height);
  for (;;) {
    for (size_t p = 0; p < pages_.size(); ++p)
      if (const auto first = pages_[p].free.take(texels)) {
        impostors_[next_id_] = {view, p, *first, texels, pictures_};
        return next_id_++;
      }
    if (bytes() + kPageTexels * sizeof(uvec2) <= most_bytes) {
      Page page;
      TRY(page.texels, gpu::make_texel_buffer(context.device, kPageTexels * sizeof(uvec2), VK_FORMAT_R32G32_UINT,
                                              VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, gpu::MemoryUse::device));
      page.free = FreeRanges(kPageTexels);
      pages_.push_back(std::move(page));
      continue;
    }
    // The one that was drawn longest ago goes, but for those of this picture and the last.
    auto oldest = impostors_.end();
    for (auto it = impostors_.begin(); it != impostors_.end(); ++it)
      if (it->second.drawn + 1 < pictures_ && (oldest == impostors_.end() || it->second.drawn < oldest->second.drawn))
        oldest = it;
    if (oldest == impostors_.end()) return uint64_t{0};
    pages_[oldest->second.page].free.give_back(oldest->second.first, oldest->second.texels);
    impostors_.erase(oldest);
  }
}

world::Status Impostors::choose(PassContext& context, const Drawing& drawing, std::span<SeenChunk> seen) {
  ++pictures_;
  drawn_.clear();
  made_.clear();
  shelf_x_ = shelf_y_ = shelf_height_ = 0;
  const double allowed = drawing.knobs.impostor_error_px / pixels_at_one_metre(drawing.rays, drawing.height);
  const double pitch = std::sqrt(2.0) * kTexelShare * allowed;
  const double step = metres_a_picture(drawing.camera);

  // What has one that is good enough, and what may get one.
  std::vector<Candidate> candidates;
  for (SeenChunk& s : seen) {
    if (s.pool->points || s.pool->pool == &drawing.shapes) continue;
    ++s.chunk->looks;
    const auto found = impostors_.find(s.chunk->impostor);
    if (found != impostors_.end()) {
      const double moved = glm::length(drawing.camera.position - found->second.view.camera.position);
      if (found->second.view.error(moved) <= allowed) {
        found->second.drawn = pictures_;
        drawn_.push_back({found->first, corner_of(s, drawing.camera)});
        s.taken = true;
        continue;
      }
    }
    if (s.chunk->looks <= kSettled) continue;
    const auto view = impostor_view(drawing.camera, s.low, s.high, pitch, kImageTexels);
    if (!view) continue;
    Candidate c{&s, *view, 1e9, 0, 0, {}};
    if (step > 0) c.pictures = std::min(view->reach(allowed) / step, c.pictures);
    if (c.pictures < kLeastPictures) continue;
    c.count_faces();
    if (static_cast<double>(c.seen_faces) * kFacePixels >= covered_pixels(*view, drawing)) candidates.push_back(c);
  }

  // Those that last longest first.
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return std::tie(b.pictures, b.seen_faces, a.seen->chunk->origin) <
           std::tie(a.pictures, a.seen_faces, b.seen->chunk->origin);
  });
  uint64_t faces = 0;
  for (Candidate& c : candidates) {
    if (faces && faces + c.faces > kMostFacesMade) continue;
    const auto at = place_in_images(c.view.width, c.view.height);
    if (!at) break;
    TRY(const uint64_t id, make_room(context, c.view, drawing.impostor_bytes));
    if (!id) break;
    const auto before = impostors_.find(c.seen->chunk->impostor);
    if (before != impostors_.end()) {
      pages_[before->second.page].free.give_back(before->second.first, before->second.texels);
      impostors_.erase(before);
    }
    c.seen->chunk->impostor = id;
    c.seen->taken = true;
    faces += c.faces;
    const ivec4 corner = corner_of(*c.seen, drawing.camera);
    drawn_.push_back({id, corner});
    made_.push_back({id, &c.seen->pool->pool->page(c.seen->chunk->page), corner, at->first, at->second, 0, c.runs});
  }
  return {};
}

world::Status Impostors::prepare(PassContext& context, const Drawing& drawing, bool blends) {
  if (drawn_.empty()) return {};
  Pipeline& drawn_by = pipelines_[blends];
  if (!drawn_by) {
    const Constant constants[] = {{kSpecBlends, blends}};
    TRY(drawn_by, make_graphics(context.device, impostors_vert_spv, impostors_frag_spv,
                                {.colour = {kSeenFormat}, .depth = kDepthFormat}, constants));
  }
  by_ = &drawn_by;

  // Page by page.
  std::stable_sort(drawn_.begin(), drawn_.end(),
                   [&](const Drawn& a, const Drawn& b) { return impostors_.at(a.id).page < impostors_.at(b.id).page; });
  std::vector<ImpostorDraw> draws;
  page_end_.assign(pages_.size(), 0);
  for (const Drawn& d : drawn_) {
    const Impostor& i = impostors_.at(d.id);
    const PixelRays window = i.view.rays();
    ImpostorDraw draw = draw_of(i.view, window, d.chunk, i.first, drawing);
    const auto add = [&](double low_x, double high_x, double low_y, double high_y) {
      place_corners(draw, i.view, window, {low_x, low_y}, {high_x, high_y}, drawing);
      draws.push_back(draw);
    };
    if (i.strips.empty()) add(0, i.view.width, 0, i.view.height);
    for (uint32_t k = 0; k < i.strips.size(); ++k)
      if (i.strips[k].first <= i.strips[k].last)
        add(k * kStripTexels, std::min<double>((k + 1) * kStripTexels, i.view.width), i.strips[k].first,
            i.strips[k].last + 1.0);
    page_end_[i.page] = static_cast<uint32_t>(draws.size());
  }
  for (size_t p = 1; p < page_end_.size(); ++p) page_end_[p] = std::max(page_end_[p], page_end_[p - 1]);
  TRY_STATUS(context.fill(draws_, draws.data(), draws.size() * sizeof draws[0], VK_BUFFER_USAGE_STORAGE_BUFFER_BIT));
  context.bindings.bind(kBindImpostors, draws_);
  if (made_.empty()) return {};

  // What is to be made.
  if (!pack_) {
    TRY(pack_, make_compute(context.device, impostor_pack_comp_spv));
  }
  if (!seen_.handle) {
    constexpr VkExtent2D extent{kImageTexels, kImageTexels};
    TRY(seen_,
        gpu::make_image(context.device, extent, kSeenFormat,
                        VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_SAMPLED_BIT, VK_IMAGE_ASPECT_COLOR_BIT));
    TRY(depth_, gpu::make_image(context.device, extent, kDepthFormat,
                                VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT | VK_IMAGE_USAGE_SAMPLED_BIT,
                                VK_IMAGE_ASPECT_DEPTH_BIT));
  }
  std::vector<Strip> rows;
  std::vector<std::byte> views(made_.size() * kViewStride);
  std::vector<ivec4> chunks;
  for (size_t i = 0; i < made_.size(); ++i) {
    const ImpostorView& view = impostors_.at(made_[i].id).view;
    PixelRays rays = view.rays();
    PictureConstants constants{};
    // The shaders' pixels are those of the image.
    rays.corner -= double(made_[i].x) * rays.step_x + double(made_[i].y) * rays.step_y;
    set_view(constants, view.camera, rays, view.near, view.width, view.height);
    std::memcpy(views.data() + i * kViewStride, &constants, sizeof constants);
    chunks.push_back(made_[i].corner);
    made_[i].strips = static_cast<uint32_t>(rows.size());
    rows.resize(rows.size() + strips_of(view), {~0u, 0});
  }
  TRY_STATUS(context.fill(rows_, rows.data(), rows.size() * sizeof rows[0], VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                          gpu::MemoryUse::readback));
  context.bindings.bind(kBindImpostorRows, rows_);
  TRY_STATUS(context.fill(views_, views.data(), views.size(), VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT));
  return context.fill_texels(chunks_, VK_FORMAT_R32G32B32A32_SINT, chunks.data(), chunks.size() * sizeof chunks[0]);
}

void Impostors::record_making(VkCommandBuffer commands, PassContext& context, const Pipeline& faces,
                              const gpu::Buffer& indices) {
  const auto picture = context.bindings.bound(kBindPicture), chunks = context.bindings.bound(kBindChunks);
  image_discard(commands, seen_.handle, VK_IMAGE_ASPECT_COLOR_BIT, kComputeRead, kColourReadWrite);
  image_discard(commands, depth_.handle, VK_IMAGE_ASPECT_DEPTH_BIT, kComputeRead, kDepthReadWrite);

  // Draw the faces of each chunk into its place of the images.
  auto attachment = gpu::vk_info<VkRenderingAttachmentInfo>(VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO);
  attachment.imageLayout = VK_IMAGE_LAYOUT_GENERAL;
  attachment.loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR;
  attachment.storeOp = VK_ATTACHMENT_STORE_OP_STORE;
  VkRenderingAttachmentInfo depth = attachment;
  attachment.imageView = seen_.view, depth.imageView = depth_.view;
  auto rendering = gpu::vk_info<VkRenderingInfo>(VK_STRUCTURE_TYPE_RENDERING_INFO);
  rendering.renderArea = {{0, 0}, {kImageTexels, static_cast<uint32_t>(shelf_y_ + shelf_height_)}};
  rendering.layerCount = rendering.colorAttachmentCount = 1;
  rendering.pColorAttachments = &attachment;
  rendering.pDepthAttachment = &depth;
  vkCmdBeginRendering(commands, &rendering);
  vkCmdBindIndexBuffer(commands, indices.handle, 0, VK_INDEX_TYPE_UINT32);
  context.bindings.bind(kBindChunks, chunks_);
  for (size_t i = 0; i < made_.size(); ++i) {
    const Made& made = made_[i];
    const ImpostorView& view = impostors_.at(made.id).view;
    const VkViewport viewport{float(made.x), float(made.y), float(view.width), float(view.height), 0, 1};
    const VkRect2D scissor{{made.x, made.y}, {uint32_t(view.width), uint32_t(view.height)}};
    vkCmdSetViewport(commands, 0, 1, &viewport);
    vkCmdSetScissor(commands, 0, 1, &scissor);
    context.bindings.bind(kBindPicture, views_, i * kViewStride, sizeof(PictureConstants));
    context.bindings.bind(kBindFaces, *made.faces);
    context.bindings.use(commands, faces);
    for (const auto& [first, count] : made.runs)
      vkCmdDrawIndexed(commands, 6 * count, 1, 0, static_cast<int32_t>(4 * first), static_cast<uint32_t>(i));
  }
  vkCmdEndRendering(commands);
  context.bindings.bind(kBindPicture, picture);
  context.bindings.bind(kBindChunks, chunks);

  // Keep what they show.
  image_barrier(commands, seen_.handle, VK_IMAGE_ASPECT_COLOR_BIT, kColourReadWrite, kComputeRead);
  image_barrier(commands, depth_.handle, VK_IMAGE_ASPECT_DEPTH_BIT, kDepthReadWrite, kComputeRead);
  context.bindings.bind(kBindImpostorSeen, seen_);
  context.bindings.bind(kBindImpostorDepth, depth_);
  for (const Made& made : made_) {
    const Impostor& impostor = impostors_.at(made.id);
    context.bindings.bind(kBindImpostorTexels, pages_[impostor.page].texels);
    context.bindings.use(commands, pack_);
    const auto width = static_cast<uint32_t>(impostor.view.width), height = static_cast<uint32_t>(impostor.view.height);
    const PixelRays rays = impostor.view.rays();
    ImpostorPack pack{.from = ivec4(made.x, made.y, width, height),
                      .chunk = made.corner,
                      .first = uvec4(impostor.first, made.strips, 0, 0),
                      .corner = to_vec4(rays.corner, impostor.view.near),
                      .step_x = to_vec4(rays.step_x),
                      .step_y = to_vec4(rays.step_y),
                      .low = {}};
    const Vec3d corner(made.corner.x, made.corner.y, made.corner.z);
    pack.low = to_vec4(corner - impostor.view.camera.position.fraction,
                       std::ldexp(kChunkSize, made.corner.w & static_cast<int>(kChunkLevel)));
    pack_.push(commands, pack);
    dispatch_pixels(commands, {width, height});
  }
  memory_barrier(commands, kComputeWrite, kFragmentRead | kHostRead);
}

void Impostors::record(VkCommandBuffer commands, PassContext& context, const Pipeline& faces,
                       const gpu::Buffer& indices) {
  if (drawn_.empty()) return;
  if (!made_.empty()) {
    context.times.mark(commands, "impostors_made");
    record_making(commands, context, faces, indices);
  }
  context.times.mark(commands, "impostors");
  const Targets& targets = context.targets;
  image_barrier(commands, targets.seen.handle, VK_IMAGE_ASPECT_COLOR_BIT, kColourReadWrite, kColourReadWrite);
  image_barrier(commands, targets.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT, kDepthReadWrite, kDepthReadWrite);
  const VkImageView seen = targets.seen.view;
  begin_rendering(commands, targets, {&seen, 1}, targets.depth.view, false);
  vkCmdBindIndexBuffer(commands, indices.handle, 0, VK_INDEX_TYPE_UINT32);
  uint32_t begin = 0;
  for (size_t p = 0; p < pages_.size(); ++p) {
    const uint32_t count = page_end_[p] - begin;
    if (!count) continue;
    context.bindings.bind(kBindImpostorTexels, pages_[p].texels);
    context.bindings.use(commands, *by_);
    vkCmdDrawIndexed(commands, 6 * count, 1, 0, static_cast<int32_t>(4 * begin), 0);
    begin = page_end_[p];
  }
  vkCmdEndRendering(commands);
}

uint64_t Impostors::bytes() const {
  uint64_t sum = pages_.size() * kPageTexels * sizeof(uvec2);
  if (seen_.handle) sum += uint64_t{kImageTexels} * kImageTexels * (sizeof(uvec2) + sizeof(float));
  return sum;
}

void Impostors::finish(FrameReport& report) {
  if (drawn_.empty()) return;
  for (const Made& made : made_) {
    Impostor& impostor = impostors_.at(made.id);
    const auto* rows = reinterpret_cast<const Strip*>(rows_.mapped()) + made.strips;
    impostor.strips.assign(rows, rows + strips_of(impostor.view));
  }
  PassReport& row = row_of(report, "impostors");
  row.draws = drawn_.size();
  row.bytes = bytes();
  report.work.push_back({"impostors", drawn_.size()});
  report.work.push_back({"impostors_made", made_.size()});
}

void Impostors::rest() {
  pages_.clear();
  impostors_.clear();
  eyes_.clear();
  drawn_.clear();
  made_.clear();
  seen_ = {}, depth_ = {};
  views_ = {}, chunks_ = {}, draws_ = {}, rows_ = {};
}

}  // namespace render::raster
