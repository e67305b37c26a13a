#include "render/raycast/raycast.h"

#include <chrono>
#include <cmath>
#include <mutex>
#include <optional>

#include <fmt/format.h>

#include "render/raycast/tile_beam.h"
#include "render/shading.h"
#include "render/bsdf/bsdf.h"
#include "world/base/jobs.h"
#include "world/store/mask_walk.h"

namespace render {

namespace {

using world::BlockId;
using world::GridAxes;
using world::GridRay;
using world::MaskKind;
using world::MaskWalker;
using world::VoxelPos;
using world::WalkPlace;

constexpr int kTile = 16, kQuad = 8;
constexpr int kLargestPicture = 16384;  // pixels a side, as the rasterizer's

using Clock = std::chrono::steady_clock;
double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// What a thread spent and cast.
struct Spent {
  double primary_ms = 0, shadow_ms = 0, shade_ms = 0;
  uint64_t shadow_rays = 0;
  void add(const Spent& o) {
    primary_ms += o.primary_ms, shadow_ms += o.shadow_ms, shade_ms += o.shade_ms, shadow_rays += o.shadow_rays;
  }
};

struct PixelHit {
  VoxelPos voxel;
  int face = world::kNoFace;  // kNoFace: sky
  double t = 0;
  Vec3d direction;
};

/// One picture: what all threads read.
class Picture {
 public:
  Picture(const world::WorldView& view, const Camera& camera, const RenderKnobs& knobs, int width, int height,
          Image& image)
      : view_(view),
        camera_(camera.position),
        rays_(camera, width, height),
        knobs_(knobs),
        occupied_(view.masks(MaskKind::occupied)),
        opaque_(view.masks(MaskKind::opaque)),
        shading_(view.environment(), view.palette()),
        sun_(GridRay(camera.position, view.environment().sun_direction)),
        in_bounds_(occupied_.in_bounds(camera.position.voxel)),
        inside_(occupied_.volume().test(camera.position.voxel)),
        image_(image) {}

  /// Renders rows of tiles; threads write disjoint pixels.
  Spent render_tile_rows(size_t begin, size_t end) const {
    world::StoreReader reader(view_.store());
    Spent spent;
    for (size_t row = begin; row < end; ++row)
      for (int x = 0; x < image_.width; x += kTile) render_tile(reader, x, static_cast<int>(row) * kTile, spent);
    return spent;
  }

 private:
  struct LeafCache {
    world::StoreReader& reader;
    world::LeafPos pos{INT32_MAX, 0, 0};
    world::LeafBlocks blocks{};
    BlockId get(VoxelPos v) {
      const world::LeafPos leaf = leaf_from_voxel(v);
      if (leaf != pos) pos = leaf, blocks = reader.leaf(leaf);
      return blocks[index_in_leaf(v)];
    }
  };

  void render_tile(world::StoreReader& reader, int x0, int y0, Spent& spent) const {
    const int x1 = std::min(x0 + kTile, image_.width), y1 = std::min(y0 + kTile, image_.height);
    PixelHit hits[kTile * kTile];
    bool sunlit[kTile * kTile];
    LeafCache blocks{reader};

    auto start = Clock::now();
    const TileBeam tile = beam(x0, y0, x1, y1, {});
    for (int qy = y0; qy < y1; qy += kQuad)
      for (int qx = x0; qx < x1; qx += kQuad) {
        const int ex = std::min(qx + kQuad, x1), ey = std::min(qy + kQuad, y1);
        const TileBeam quad = tile.nothing ? tile : beam(qx, qy, ex, ey, tile);
        for (int y = qy; y < ey; ++y)
          for (int x = qx; x < ex; ++x) cast(quad, x, y, blocks, hits[(y - y0) * kTile + x - x0]);
      }
    spent.primary_ms += ms_since(start);

    start = Clock::now();
    std::fill(std::begin(sunlit), std::end(sunlit), true);
    if (knobs_.sun_shadow == SunShadow::ray)
      for (int qy = y0; qy < y1; qy += kQuad)
        for (int qx = x0; qx < x1; qx += kQuad)
          cast_shadows(x0, y0, qx, qy, std::min(qx + kQuad, x1), std::min(qy + kQuad, y1), hits, sunlit, spent);
    spent.shadow_ms += ms_since(start);

    start = Clock::now();
    for (int y = y0; y < y1; ++y)
      for (int x = x0; x < x1; ++x) {
        const int i = (y - y0) * kTile + x - x0;
        const PixelHit& hit = hits[i];
        image_.at(x, y) = hit.face == world::kNoFace
                              ? sky_radiance(view_.environment(), hit.direction.y / glm::length(hit.direction))
                              : shading_.face_radiance(blocks.get(hit.voxel), hit.face, sunlit[i]);
      }
    spent.shade_ms += ms_since(start);
  }

  TileBeam beam(int x0, int y0, int x1, int y1, const TileBeam& parent) const {
    return inside_ ? TileBeam{} : tile_beam(occupied_, camera_, rays_, x0, y0, x1, y1, parent);
  }

  void cast(const TileBeam& beam, int x, int y, LeafCache& blocks, PixelHit& hit) const {
    hit.direction = rays_.direction(x + 0.5, y + 0.5);
    if (beam.nothing) return;
    // The limit in t: the camera's rays have unit depth, not unit length.
    double t_limit = std::min(knobs_.view_distance / glm::length(hit.direction), std::numeric_limits<double>::max());
    const GridAxes axes(GridRay(camera_, hit.direction));
    WalkPlace place{camera_.voxel, 0, -1};
    if (!in_bounds_ && !occupied_.clip(axes, place, t_limit)) return;
    if (beam.axis >= 0) {
      const double t = axes.t_at(beam.axis, beam.plane);
      if (!(t <= t_limit)) return;
      if (t > place.t) world::mask_walk::cross(axes, place, beam.axis, t, beam.plane);
    }
    if (inside_ ? !leave_block(axes, place, t_limit, blocks) : !occupied_.find(axes, place, t_limit)) return;
    hit.voxel = place.voxel;
    hit.t = place.t;
    hit.face = world::entered_face(place.axis, axes.upwards[place.axis] != 0);
  }

  /// From a start inside a block to the first visible face. Full leaves of opaque blocks are left in one step.
  bool leave_block(const GridAxes& axes, WalkPlace& place, double t_limit, LeafCache& blocks) const {
    for (;;) {
      const world::LeafPos leaf = leaf_from_voxel(place.voxel);
      const world::MaskRegion* region = opaque_.volume().region(region_from_leaf(leaf));
      const bool solid_leaf = region && region->leaf_full(leaf);
      const bool from_opaque = solid_leaf || (region && region->leaf(leaf).test(place.voxel));
      const BlockId from = from_opaque ? world::kAir : blocks.get(place.voxel);
      if (!world::mask_walk::leave_cube(axes, place, solid_leaf ? 7 : 0, t_limit)) return false;
      if (!occupied_.volume().test(place.voxel)) return occupied_.find(axes, place, t_limit);
      if (from_opaque) continue;
      if (opaque_.volume().test(place.voxel) || blocks.get(place.voxel) > from) return true;
    }
  }

  /// Shadow rays of the pixels [qx, ex) x [qy, ey) of the tile at (x0, y0).
  void cast_shadows(int x0, int y0, int qx, int qy, int ex, int ey, const PixelHit* hits, bool* sunlit,
                    Spent& spent) const {
    int todo[kQuad * kQuad], count = 0;
    world::VoxelBox starts;
    for (int y = qy; y < ey; ++y)
      for (int x = qx; x < ex; ++x) {
        const int i = (y - y0) * kTile + x - x0;
        if (hits[i].face == world::kNoFace || !shading_.sun_faces[hits[i].face]) continue;
        todo[count++] = i;
        starts.include(hits[i].voxel + world::face_step(hits[i].face));
      }
    if (count == 0) return;
    spent.shadow_rays += static_cast<uint64_t>(count);
    const FreePlane free = free_plane(opaque_, starts, view_.environment().sun_direction);
    for (int k = 0; k < count; ++k) sunlit[todo[k]] = sun_visible(hits[todo[k]], free);
  }

  bool sun_visible(const PixelHit& hit, const FreePlane& free) const {
    GridRay primary(camera_, hit.direction);
    const GridRay ray = world::ray_from_surface(primary, {world::WalkEnd::hit, hit.voxel, hit.face, hit.t},
                                                view_.environment().sun_direction);
    GridAxes axes = sun_;
    for (int a = 0; a < 3; ++a) axes.origin[a] = ray.voxel[a], axes.fraction[a] = ray.fraction[a];
    axes.settle_fractions();
    WalkPlace place{ray.voxel, 0, -1};
    double t_limit = std::min(std::numeric_limits<double>::max(), axes.t_at(free.axis, free.plane));
    return (!opaque_.in_bounds(ray.voxel) && !opaque_.clip(axes, place, t_limit)) ||
           !opaque_.find(axes, place, t_limit);
  }

  const world::WorldView& view_;
  world::WorldPoint camera_;
  PixelRays rays_;
  const RenderKnobs& knobs_;
  MaskWalker occupied_, opaque_;
  Shading shading_;
  GridAxes sun_;    // direction only
  bool in_bounds_;  // the camera is within the regions that hold anything
  bool inside_;     // the camera is in a block
  Image& image_;
};

world::Status check(const Camera& camera, const RenderKnobs& knobs, int width, int height) {
  if (width < 1 || height < 1 || width > kLargestPicture || height > kLargestPicture)
    return world::usage_error(fmt::format("a picture of {}x{} pixels can't be drawn; each side must be 1 to {}", width,
                                          height, kLargestPicture));
  const double length = glm::length(camera.forward);
  if (!(length > 0.999 && length < 1.001) || !(camera.vertical_fov > 0 && camera.vertical_fov < 3.14159))
    return world::usage_error(
        "the camera's direction must have unit length and its field of view lie between 0 and 180 degrees");
  if (!GridRay(camera.position, camera.forward).valid())
    return world::usage_error(
        fmt::format("the camera lies outside the world, whose border is at {} m on each axis", world::kWorldBorder));
  if (!(knobs.view_distance >= 0)) return world::usage_error("view_distance must be 0 or more metres");
  return {};
}

class RaycastBackend : public Backend {
 public:
  world::Result<Frame> render(const world::WorldView& view, const Camera& camera, const RenderKnobs& knobs, int width,
                              int height) override {
    TRY_STATUS(check(camera, knobs, width, height));
    TRY_STATUS(check_bsdfs(view.palette()));
    const auto start = Clock::now();
    Frame frame{Image(width, height), {}};
    const Picture picture(view, camera, knobs, width, height, frame.image);
    const double prepare_ms = ms_since(start);
    Spent total;
    std::mutex adding;
    world::parallel_ranges(static_cast<size_t>((height + kTile - 1) / kTile), 1, [&](size_t begin, size_t end) {
      const Spent spent = picture.render_tile_rows(begin, end);
      const std::lock_guard lock(adding);
      total.add(spent);
    });
    FrameReport& report = frame.report;
    report.ms = ms_since(start);
    const uint64_t pixels = static_cast<uint64_t>(width) * static_cast<uint64_t>(height);
    report.rays = pixels + total.shadow_rays;
    // Threads' times, scaled to their share of the picture's.
    const double sum = total.primary_ms + total.shadow_ms + total.shade_ms;
    const double share = sum > 0 ? (report.ms - prepare_ms) / sum : 0;
    report.passes = {{"prepare", prepare_ms}, {"primary", total.primary_ms * share}};
    if (knobs.sun_shadow == SunShadow::ray) report.passes.push_back({"sun_shadow", total.shadow_ms * share});
    report.passes.push_back({"shade", total.shade_ms * share});
    report.device = fmt::format("CPU, {} thread{}", world::thread_count(), world::thread_count() == 1 ? "" : "s");
    return frame;
  }
};

}  // namespace

world::Result<std::unique_ptr<Backend>> make_raycast_backend() { return std::unique_ptr<Backend>(new RaycastBackend); }

}  // namespace render
