#include "render/raycast/raycast.h"

#include <chrono>
#include <cmath>
#include <mutex>
#include <optional>

#include <fmt/format.h>

#include "render/effects/samples.h"
#include "render/knob_ranges.h"
#include "render/shading.h"
#include "render/light/shadow_voxels.h"
#include "render/light/sun_maps.h"
#include "render/light/surface_light.h"
#include "render/light/voxel_light.h"
#include "render/bsdf/bsdf.h"
#include "render/textures/texture_set.h"
#include "render/inhabitants.h"
#include "render/raycast/light_through.h"
#include "render/raycast/straight_walk.h"
#include "render/trace/layers.h"
#include "render/trace/picture.h"
#include "render/trace/proxies.h"
#include "world/base/jobs.h"
#include "world/proxies/proxy.h"
#include "world/store/contour_walk.h"
#include "world/store/parallel_rays.h"
#include "world/store/ray_stream.h"

namespace render {

namespace {

using world::BlockId;
using world::GridAxes;
using world::GridHit;
using world::GridRay;
using world::MaskKind;
using world::MaskWalker;
using world::RayStream;
using world::VoxelPos;
using world::WalkEnd;
using world::WalkPlace;

constexpr int kTile = 8;  // 64 pixels: a packet of rays, each 16 of which are a block of 4x4
/// Pixel of a full tile by the order of its rays: bits of column and row in turn.
constexpr int column_of(int i) { return (i & 1) | (i >> 1 & 2) | (i >> 2 & 4); }
constexpr int row_of(int i) { return column_of(i >> 1); }
/// Cast at once: what packets and lanes share is set up once for them.
constexpr int kTilesAtOnce = 8;
constexpr int kLargestPicture = 16384;  // pixels a side, as the rasterizer's

using Clock = std::chrono::steady_clock;
double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// What a thread spent and cast.
struct Spent {
  double primary_ms = 0, shadow_ms = 0, shade_ms = 0;
  uint64_t shadow_rays = 0, light_walks = 0;
  void add(const Spent& o) {
    primary_ms += o.primary_ms, shadow_ms += o.shadow_ms, shade_ms += o.shade_ms, shadow_rays += o.shadow_rays;
    light_walks += o.light_walks;
  }
};

/// One picture: what all threads read.
class Picture {
 public:
  Picture(const world::WorldView& view, const SkyView& sky, const RayStream& occupied,
          const world::ParallelRays& sun_rays, const MaskWalker& opaque, const MaskWalker& shadows,
          const world::StoreContours::Followed* contours, const world::BlockShapes* shapes,
          const SeeThroughKinds* kinds, const SurfaceLight& light, const WorldLight& of_world,
          const LiquidLevels* levels, const SunMaps& sun_maps, const LightBlockers* blockers,
          const TextureSet& textures, std::span<const shared::DrawnBox> boxes, const Camera& camera,
          const RenderKnobs& knobs, int width, int height, Image& image)
      : view_(view),
        sky_(sky),
        camera_(camera.position),
        rays_(camera, width, height),
        knobs_(knobs),
        occupied_rays_(occupied),
        sun_rays_(sun_rays),
        occupied_(occupied.walker()),
        opaque_(opaque),
        shadows_(shadows),
        shading_(sky, view.palette()),
        light_(light),
        voxels_(view, of_world, light.kind()),
        levels_(levels),
        sun_maps_(sun_maps),
        textures_(textures.empty() ? nullptr : &textures),
        boxes_(boxes),
        box_rectangles_(rectangles_of(boxes, camera, width, height)),
        decoder_(light.kind(), shading_),
        lit_by_cells_(light.kind() != SurfaceLight::Kind::none || knobs.corner_occlusion),
        contours_(contours),
        shapes_(shapes),
        blockers_(blockers),
        kinds_(kinds),
        in_bounds_(occupied_.in_bounds(camera.position.voxel)),
        // In a contour's voxel the eye is in front of the surface.
        inside_(contours ? contours->contours.cells().test(camera.position.voxel) &&
                               contours->contours.plane(camera.position.voxel) == world::kNoContour
                         : occupied_.volume().test(camera.position.voxel)),
        image_(image) {}

  /// Renders rows of tiles; threads write disjoint pixels.
  Spent render_tile_rows(size_t begin, size_t end) const {
    world::StoreReader reader(view_.store());
    Spent spent;
    for (size_t row = begin; row < end; ++row)
      for (int x = 0; x < image_.width; x += kTilesAtOnce * kTile)
        render_tiles(reader, x, static_cast<int>(row) * kTile, spent);
    return spent;
  }

 private:
  /// What the rays of some pixels go straight on through; empty where nothing is.
  struct Layers {
    struct OfPixel {
      int pixel;
      uint32_t begin, end;
      uint16_t eye, last;  // kinds that the ray starts and ends in
    };
    std::vector<StraightLayer> all;
    std::vector<OfPixel> of_pixels;
    void clear() { all.clear(), of_pixels.clear(); }
  };

  /// Up to kTilesAtOnce tiles of a row, side by side.
  void render_tiles(world::StoreReader& reader, int x0, int y0, Spent& spent) const {
    constexpr int kMost = kTilesAtOnce * kTile * kTile;
    const int x1 = std::min(x0 + kTilesAtOnce * kTile, image_.width), y1 = std::min(y0 + kTile, image_.height);
    int pixel_x[kMost], pixel_y[kMost], count = 0;
    for (int tile = x0; tile < x1; tile += kTile)
      for (int i = 0; i < kTile * kTile; ++i)
        if (const int x = tile + column_of(i), y = y0 + row_of(i); x < x1 && y < y1)
          pixel_x[count] = x, pixel_y[count++] = y;
    GridRay rays[kMost];
    GridHit hits[kMost];
    Vec3d normals[kMost];          // of contours, where there are any; 0 on faces
    PointLight on_contour[kMost];  // where a model lights them
    ProxyHit on_shape[kMost];      // where there are shapes; part kNoPart: not on one
    bool sunlit[kMost];
    float sun[kMost];  // the part of its light that arrives on faces
    Rgb tint[kMost];   // where there are blockers: of that, by what it came through
    LeafCache blocks(reader, levels_);
    thread_local Layers layers;
    layers.clear();

    auto start = Clock::now();
    for (int i = 0; i < count; ++i) {
      GridRay& ray = rays[i];
      ray = {camera_, rays_.direction(pixel_x[i] + 0.5, pixel_y[i] + 0.5)};
      // The limit in t: the camera's rays have unit depth, not unit length.
      if (std::isfinite(knobs_.view_distance)) ray.t_max = knobs_.view_distance / glm::length(ray.direction);
    }
    if (inside_)
      for (int i = 0; i < count; ++i) hits[i] = cast_from_inside(rays[i], blocks);
    else
      (contours_ ? contours_->cells : occupied_rays_).first_set_coherent({rays, size_t(count)}, {hits, size_t(count)});
    if (contours_) std::fill_n(normals, count, Vec3d(0.0));
    if (contours_ && !inside_)
      for (int i = 0; i < count; ++i) {
        const world::ContourHit hit = contours_->walker.first_hit_from(rays[i], hits[i]);
        hits[i] = hit.grid;
        if (hit.smooth) normals[i] = hit.normal;
      }
    if (shapes_)
      for (int i = 0; i < count; ++i) hits[i] = pass_shapes(rays[i], hits[i], blocks, on_shape[i]);
    if (kinds_) go_straight(rays, hits, on_shape, count, blocks, layers);
    BoxSeen on_box[kMost];
    const bool any_box = !boxes_.empty() && meet_boxes(x0, y0, x1, y1, rays, hits, pixel_x, pixel_y, count, on_box);
    spent.primary_ms += ms_since(start);

    start = Clock::now();
    const bool contours_lit = contours_ && light_.kind() != SurfaceLight::Kind::none;
    for (int i = 0; contours_lit && i < count; ++i)
      if (normals[i] != Vec3d(0.0)) on_contour[i] = light_on_contour(rays[i], hits[i], normals[i]);
    std::fill_n(sunlit, count, true);
    if (knobs_.sun_shadow == SunShadow::ray) cast_shadows(rays, hits, normals, on_shape, count, sunlit, spent);
    if (knobs_.sun_shadow == SunShadow::sky_light)
      for (int i = 0; i < count; ++i)
        if (hits[i].hit())
          sunlit[i] = contours_lit && normals[i] != Vec3d(0.0) ? on_contour[i].whole_sky
                                                               : sees_whole_sky(code_at(hits[i], on_shape[i]));
    for (int i = 0; i < count; ++i) sun[i] = sunlit[i] ? 1.0f : 0.0f;
    if (knobs_.sun_shadow == SunShadow::map)
      for (int i = 0; i < count; ++i)
        if (hits[i].hit() && (on_shape[i].part != kNoPart || shading_.sun_faces[hits[i].face]))
          sun[i] = sun_map_at(rays[i], hits[i], on_shape[i]);
    if (sky_.clouds.shadows)
      for (int i = 0; i < count; ++i)
        if (hits[i].hit() && sun[i] > 0) sun[i] *= sky_.sun_through(camera_ + hits[i].t * rays[i].direction);
    if (blockers_)
      for (int i = 0; i < count; ++i) tint[i] = tint_at(rays[i], hits[i], on_shape[i], sun[i], blocks, spent);
    spent.shadow_ms += ms_since(start);

    start = Clock::now();
    for (int i = 0; i < count; ++i) {
      const Vec3d& direction = rays[i].direction;
      Rgb& pixel = image_.at(pixel_x[i], pixel_y[i]);
      if (any_box && on_box[i].box >= 0)
        pixel = on_box[i].radiance;
      else if (!hits[i].hit())
        pixel = sky_.seen(direction / glm::length(direction));
      else if (on_shape[i].part != kNoPart)
        pixel = shape_radiance(hits[i], on_shape[i], direction, blocks.get(hits[i].voxel),
                               blockers_ ? tint[i] * sun[i] : Rgb{sun[i], sun[i], sun[i]});
      else if (contours_ && normals[i] != Vec3d(0.0))
        pixel =
            normal_radiance(shading_, sky_, blocks.get(contours_->walker.matter_voxel(hits[i].voxel, normals[i])),
                            normals[i], sunlit[i] ? sky_.sun_through(camera_ + hits[i].t * rays[i].direction) : 0.0f,
                            contours_lit ? &on_contour[i].lit : nullptr);
      else {
        const BlockId block = blocks.get(hits[i].voxel);
        const Textured texture = textures_ ? texture_at(rays[i], hits[i], block) : Textured{};
        pixel =
            face_radiance(block, hits[i].face, sun[i] * texture.sun, blockers_ ? &tint[i] : nullptr,
                          lit_by_cells_ ? light_at(rays[i], hits[i]) : shading_.sky_lit[hits[i].face], texture.albedo);
      }
      // Of bodies it is known already.
      const double length = glm::length(direction);
      if (!(any_box && on_box[i].box >= 0))
        pixel = sky_.behind_clouds(pixel, camera_, direction / length,
                                   hits[i].hit() ? hits[i].t * length : world::kInfinity);
    }
    for (Layers::OfPixel p : layers.of_pixels) {
      const size_t i = static_cast<size_t>(p.pixel);
      GridHit end = hits[i];
      if (any_box && on_box[i].box >= 0) {
        // The body ends the ray: what lies behind it is no more.
        end = {WalkEnd::hit, {}, world::kNoFace, on_box[i].t};
        while (p.end > p.begin && layers.all[p.end - 1].at.t >= end.t) p.last = layers.all[--p.end].near;
      }
      add_layers(rays[i], end, pixel_x[i], pixel_y[i], p, {layers.all.data() + p.begin, p.end - p.begin}, blocks,
                 spent);
    }
    spent.shade_ms += ms_since(start);
  }

  /// Off the contour by as much as may lie before it, as the rasterizer's triangles.
  PointLight light_on_contour(const GridRay& ray, const GridHit& hit, const Vec3d& normal) const {
    const world::Irradiance3 e = sky_irradiance(sky_, normal);
    constexpr float kPi = 3.14159265f;
    return light_at_point(decoder_, knobs_.light_interpolation, voxels_,
                          camera_ + (hit.t * ray.direction + world::kCrack * normal), normal,
                          {e.r / kPi, e.g / kPi, e.b / kPi});
  }

  /// A body that a pixel's ray meets before anything that it can't see through.
  struct BoxSeen {
    int box = -1;
    double t = 0;  // of the ray
    Rgb radiance;
  };
  bool meet_boxes(int x0, int y0, int x1, int y1, const GridRay* rays, const GridHit* hits, const int* pixel_x,
                  const int* pixel_y, int count, BoxSeen* seen) const {
    bool any = false;
    for (size_t k = 0; k < boxes_.size(); ++k) {
      const PixelRectangle& r = box_rectangles_[k];
      if (r.x0 >= x1 || r.x1 <= x0 || r.y0 >= y1 || r.y1 <= y0) continue;
      const shared::DrawnBox& box = boxes_[k];
      for (int i = 0; i < count; ++i) {
        if (pixel_x[i] < r.x0 || pixel_x[i] >= r.x1 || pixel_y[i] < r.y0 || pixel_y[i] >= r.y1) continue;
        const double length = glm::length(rays[i].direction);
        const shared::BoxHit met =
            shared::meet_box(glm::vec3(box.low), glm::vec3(box.high), glm::vec3(rays[i].direction / length));
        const double end = seen[i].box >= 0 ? seen[i].t : hits[i].hit() ? hits[i].t : rays[i].t_max;
        if (!(met.distance > 0 && met.distance < end * length)) continue;
        const glm::vec4& radiance = box.radiance[met.face];
        seen[i] = {static_cast<int>(k), met.distance / length, {radiance.x, radiance.y, radiance.z}};
        any = true;
      }
    }
    return any;
  }

  /// Through the voxels of shapes to the first surface: the hit names the voxel and, where that has a shape that the
  /// ray meets, `on_shape` says where.
  GridHit pass_shapes(const GridRay& ray, const GridHit& first, LeafCache& blocks, ProxyHit& on_shape) const {
    const bool starts_in_shape = first.t == 0 && shapes_->shape[blocks.get(camera_.voxel)];
    if (!starts_in_shape && (!first.hit() || !shapes_->shape[blocks.get(first.voxel)])) return first;
    const GridAxes axes(ray);
    double t_limit = std::min(ray.t_max, std::numeric_limits<double>::max());
    WalkPlace place{camera_.voxel, 0, -1};
    if (!starts_in_shape) place = {first.voxel, first.t, first.face >= 0 ? world::face_axis(first.face) : -1};
    for (;;) {
      const BlockId id = blocks.get(place.voxel);
      const world::Proxy* shape = shapes_->shape[id];
      if (!shape)
        return {WalkEnd::hit, place.voxel, world::entered_face(place.axis, axes.upwards[place.axis] != 0), place.t};
      GridHit met;
      if (meets_shape(ray, place.voxel, id, t_limit, blocks, on_shape, met)) return met;
      if (!world::mask_walk::leave_cube(axes, place, 0, t_limit)) return {WalkEnd::t_max, {}, world::kNoFace, t_limit};
      if (!occupied_.volume().test(place.voxel) && !occupied_.find(axes, place, t_limit))
        return {WalkEnd::t_max, {}, world::kNoFace, t_limit};
    }
  }

  /// Whether a ray meets the shape of a voxel's block within t_limit; where it doesn't, on_shape has no part.
  bool meets_shape(const GridRay& ray, VoxelPos voxel, BlockId id, double t_limit, LeafCache& blocks,
                   ProxyHit& on_shape, GridHit& hit) const {
    const world::Proxy& shape = *shapes_->shape[id];
    const uint8_t joins = shapes_->joins_at(shape, voxel, [&](VoxelPos v) { return blocks.get(v); });
    if (intersect_proxy(shape, joins, ray, voxel, t_limit, on_shape) && !on_shape.inside) {
      hit = {WalkEnd::hit, voxel, nearest_face(side_seen(on_shape, ray.direction)), on_shape.t};
      return true;
    }
    on_shape.part = kNoPart;
    return false;
  }

  /// The normal on the side that the ray comes from.
  static Vec3d side_seen(const ProxyHit& hit, const Vec3d& direction) {
    const Vec3d normal(hit.normal);
    return dot(normal, direction) > 0 ? -normal : normal;
  }
  static int nearest_face(const Vec3d& normal) {
    const Vec3d size = abs(normal);
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    return axis * 2 + (normal[axis] > 0);
  }
  /// Of a face; of a shape that of its cell, which all the faces of its voxel have.
  uint32_t code_at(const GridHit& hit, const ProxyHit& on_shape) const {
    return on_shape.part == kNoPart ? light_.code(hit.voxel, hit.face) : light_.code_in_cell(hit.voxel, hit.face);
  }

  Rgb face_radiance(BlockId block, int face, float sun, const Rgb* tint, Rgb lit, float texture) const {
    if (!tint) return shading_.face_radiance(block, face, sun, lit, texture);
    return shading_.face_radiance(block, face, 0, lit + by_band(shading_.sun_lit[face], *tint * sun), texture);
  }
  static Rgb by_band(const Rgb& a, const Rgb& b) { return {a.r * b.r, a.g * b.g, a.b * b.b}; }

  /// What the sun's light has come through, where any arrives.
  Rgb tint_at(const GridRay& ray, const GridHit& hit, const ProxyHit& on_shape, float sun, LeafCache& blocks,
              Spent& spent) const {
    if (!hit.hit() || !(sun > 0) || (on_shape.part == kNoPart && !shading_.sun_faces[hit.face])) return {1, 1, 1};
    ++spent.light_walks;
    return light_through(*blockers_, ray_to_sun(ray, hit, on_shape), on_shape.part, blocks);
  }

  Rgb shape_radiance(const GridHit& hit, const ProxyHit& on_shape, const Vec3d& direction, BlockId block,
                     const Rgb& sun) const {
    const world::Environment& e = sky_.environment;
    const Vec3d normal = side_seen(on_shape, direction);
    constexpr float kPi = 3.14159265f;
    const world::Irradiance3 sky = sky_irradiance(sky_, normal);
    Rgb lit{sky.r / kPi, sky.g / kPi, sky.b / kPi};
    if (light_.kind() != SurfaceLight::Kind::none)
      if (const uint32_t code = code_at(hit, on_shape); code != SurfaceLight::kUnknown) lit = decoder_(code, hit.face);
    const Rgb arrives = sun * (static_cast<float>(std::max(0.0, dot(e.sun_direction, normal))) / kPi);
    lit = lit + by_band({e.sun_irradiance.r, e.sun_irradiance.g, e.sun_irradiance.b}, arrives);
    const Shading::Material& m = shading_.materials[block];
    const float glow = static_cast<float>(6 / world::shown_area(*shapes_->shape[block]));
    return {m.albedo[0] * lit.r + m.emitted[0] * glow, m.albedo[1] * lit.g + m.emitted[1] * glow,
            m.albedo[2] * lit.b + m.emitted[2] * glow};
  }

  GridRay ray_to_sun(const GridRay& ray, const GridHit& hit, const ProxyHit& on_shape) const {
    if (on_shape.part == kNoPart) {
      GridRay to_sun = world::ray_from_surface(ray, hit, sky_.environment.sun_direction);
      if (!levels_ || hit.face != world::kFacePosY) return to_sun;
      if (const int level = levels_->at(hit.voxel); level < kFullLevel) {
        to_sun.voxel.y = hit.voxel.y;
        to_sun.fraction.y = double(level) / kFullLevel;
      }
      return to_sun;
    }
    GridRay to_sun;
    to_sun.voxel = hit.voxel;
    to_sun.fraction = clamp(on_shape.point, Vec3d(0), Vec3d(1));
    to_sun.direction = sky_.environment.sun_direction;
    return to_sun;
  }

  /// Follows the rays that meet a see-through block, or start in one, to what lies behind.
  void go_straight(const GridRay* rays, GridHit* hits, ProxyHit* on_shape, int count, LeafCache& blocks,
                   Layers& layers) const {
    const BlockId eye = inside_ ? blocks.get(camera_.voxel) : world::kAir;
    // In a liquid's voxel the eye may be in the air above it.
    const bool by_surface = blocks.level(camera_.voxel) < kFullLevel;
    const bool in_air = by_surface && levels_->above_surface(camera_);
    for (int i = 0; i < count; ++i) {
      BlockId medium = kinds_->contains(eye) && !in_air ? eye : world::kAir;
      WalkPlace place{camera_.voxel, 0, -1};
      if (medium == world::kAir && !by_surface) {
        if (!hits[i].hit() || on_shape[i].part != kNoPart) continue;
        if (!kinds_->contains(blocks.get(hits[i].voxel)) && blocks.level(hits[i].voxel) == kFullLevel) continue;
        place = {hits[i].voxel, hits[i].t, world::face_axis(hits[i].face)};
      }
      double t_limit = rays[i].t_max;
      WalkPlace start{camera_.voxel, 0, -1};
      if (!occupied_.clip(GridAxes(rays[i]), start, t_limit)) continue;
      const uint32_t begin = static_cast<uint32_t>(layers.all.size());
      const uint16_t from = kinds_->kind(medium);
      on_shape[i].part = kNoPart;
      const auto meet = [&](const WalkPlace& at, BlockId id, GridHit& hit) {
        if (!shapes_ || !shapes_->shape[id]) return ShapeMeeting::none;
        return meets_shape(rays[i], at.voxel, id, t_limit, blocks, on_shape[i], hit) ? ShapeMeeting::met
                                                                                     : ShapeMeeting::missed;
      };
      hits[i] = walk_straight(rays[i], occupied_, *kinds_, blocks, place, t_limit, medium, layers.all, meet);
      layers.of_pixels.push_back({i, begin, static_cast<uint32_t>(layers.all.size()), from, kinds_->kind(medium)});
    }
  }

  void add_layers(const GridRay& ray, const GridHit& end, int x, int y, const Layers::OfPixel& of,
                  std::span<const StraightLayer> layers, LeafCache& blocks, Spent& spent) const {
    const double length = glm::length(ray.direction);
    Rgb& seen = image_.at(x, y);
    StraightPixel pixel;
    pixel.x = static_cast<uint32_t>(x), pixel.y = static_cast<uint32_t>(y);
    pixel.metres_per_t = static_cast<float>(length);
    pixel.eye = of.eye, pixel.end = of.last;
    pixel.t_end = static_cast<float>((end.hit() ? end.t : ray.t_max) * length);
    pixel.behind = seen;
    const auto surface = [&](const StraightLayer& layer) {
      float sun = shading_.sun_faces[layer.at.face] ? 1.0f : 0.0f;
      if (knobs_.sun_shadow == SunShadow::map && sun > 0) sun = sun_map_at(ray, layer.at, {});
      if (knobs_.sun_shadow == SunShadow::sky_light && !sees_whole_sky(light_.code(layer.at.voxel, layer.at.face)))
        sun = 0;
      if (knobs_.sun_shadow == SunShadow::ray && sun > 0) {
        ++spent.shadow_rays;
        if (shadows_.any_set(ray_to_sun(ray, layer.at, {}))) sun = 0;
      }
      if (sun > 0) sun *= sky_.sun_through(camera_ + layer.at.t * ray.direction);
      Rgb tint{1, 1, 1};
      if (blockers_) tint = tint_at(ray, layer.at, {}, sun, blocks, spent);
      const Rgb lit = lit_by_cells_ ? light_at(ray, layer.at) : shading_.sky_lit[layer.at.face];
      const BlockId owner = static_cast<BlockId>(kinds_->blocks()[layer.owner()].block.x);
      const Textured texture = textures_ && layer.outside ? texture_at(ray, layer.at, owner) : Textured{};
      return face_radiance(owner, layer.at.face, sun * texture.sun, blockers_ ? &tint : nullptr, lit, texture.albedo);
    };
    const auto mirrored = [&](const StraightLayer& layer) {
      Vec3d direction = ray.direction / length;
      const int axis = world::face_axis(layer.at.face);
      direction[axis] = -direction[axis];
      return sky_.mirrored(camera_ + layer.at.t * ray.direction, direction);
    };
    const auto clouds = [&](float t) { return sky_.clouds_along(camera_, ray.direction / length, double{t}); };
    seen = straight_radiance(pixel, ray.direction, *kinds_, layers, knobs_.coverage_pattern,
                             knobs_.transparency == Transparency::sorted, surface, mirrored, clouds);
  }

  float sun_map_at(const GridRay& ray, const GridHit& hit, const ProxyHit& on_shape) const {
    const world::GridRay to_sun = ray_to_sun(ray, hit, on_shape);
    const float cosine = static_cast<float>(std::abs(sky_.environment.sun_direction[world::face_axis(hit.face)]));
    return sun_maps_.lit({to_sun.voxel, to_sun.fraction}, cosine, std::clamp(knobs_.sun_map_filter, 1, 15));
  }

  /// What the texture multiplies the albedo by, and, through the normal that it tilts, the sun's light.
  struct Textured {
    float albedo = 1, sun = 1;
  };
  Textured texture_at(const GridRay& ray, const GridHit& hit, BlockId block) const {
    const int axis = world::face_axis(hit.face);
    glm::vec3 fraction;
    for (int a = 0; a < 3; ++a)
      fraction[a] = static_cast<float>(std::clamp(
          double(camera_.voxel[a] - hit.voxel[a]) + camera_.fraction[a] + hit.t * ray.direction[a], 0.0, 1.0));
    const glm::vec3 direction(ray.direction), at = direction * static_cast<float>(hit.t);
    const glm::vec3 step_x = shared::texture_step(at, direction, glm::vec3(rays_.step_x), axis),
                    step_y = shared::texture_step(at, direction, glm::vec3(rays_.step_y), axis);
    Textured t;
    t.albedo = textures_->factor(knobs_, block, hit.voxel, hit.face, fraction, step_x, step_y);
    if (knobs_.normal_detail != 0) {
      const glm::vec3 normal = textures_->normal(knobs_, block, hit.voxel, hit.face, fraction, step_x, step_y);
      const glm::vec3 sun(sky_.environment.sun_direction);
      t.sun = std::max(glm::dot(normal, sun), 0.0f) / std::max(std::abs(sun[axis]), 1e-6f);
    }
    return t;
  }

  Rgb light_at(const GridRay& ray, const GridHit& hit) const {
    const glm::ivec2 axes = shared::light_axes(world::face_axis(hit.face));
    const auto along = [&](int axis) {
      const double from_voxel =
          double(camera_.voxel[axis] - hit.voxel[axis]) + camera_.fraction[axis] + hit.t * ray.direction[axis];
      return static_cast<float>(std::clamp(from_voxel, 0.0, 1.0));
    };
    const auto beside = [&](int u, int v) {
      VoxelPos voxel = hit.voxel;
      voxel[axes.x] += u, voxel[axes.y] += v;
      return voxel;
    };
    return light_on_face(
        decoder_, knobs_, hit.face, {along(axes.x), along(axes.y)},
        [&](int u, int v) { return light_.code(beside(u, v), hit.face); },
        [&](int u, int v) { return !shadows_.volume().test(beside(u, v) + world::face_step(hit.face)); });
  }

  GridHit cast_from_inside(const GridRay& ray, LeafCache& blocks) const {
    double t_limit = ray.t_max;
    const GridAxes axes(ray);
    WalkPlace place{camera_.voxel, 0, -1};
    if (!in_bounds_ && !occupied_.clip(axes, place, t_limit)) return {WalkEnd::t_max, {}, world::kNoFace, t_limit};
    if (!leave_block(axes, place, t_limit, blocks)) return {WalkEnd::t_max, {}, world::kNoFace, t_limit};
    return {WalkEnd::hit, place.voxel, world::entered_face(place.axis, axes.upwards[place.axis] != 0), place.t};
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

  void cast_shadows(const GridRay* rays, const GridHit* hits, const Vec3d* normals, const ProxyHit* on_shape, int count,
                    bool* sunlit, Spent& spent) const {
    if (contours_ && !inside_) return cast_contour_shadows(rays, hits, normals, count, sunlit, spent);
    GridRay to_sun[kTilesAtOnce * kTile * kTile];
    uint8_t blocked[kTilesAtOnce * kTile * kTile];
    int pixel[kTilesAtOnce * kTile * kTile];
    size_t sent = 0;
    for (int i = 0; i < count; ++i) {
      if (!hits[i].hit() || (on_shape[i].part == kNoPart && !shading_.sun_faces[hits[i].face])) continue;
      pixel[sent] = i;
      to_sun[sent++] = ray_to_sun(rays[i], hits[i], on_shape[i]);
    }
    sun_rays_.any_set({to_sun, sent}, {blocked, sent});
    for (size_t k = 0; k < sent; ++k) sunlit[pixel[k]] = !blocked[k];
    spent.shadow_rays += sent;
  }

  void cast_contour_shadows(const GridRay* rays, const GridHit* hits, const Vec3d* normals, int count, bool* sunlit,
                            Spent& spent) const {
    const Vec3d& to_sun = sky_.environment.sun_direction;
    for (int i = 0; i < count; ++i) {
      if (!hits[i].hit()) continue;
      const bool smooth = normals[i] != Vec3d(0.0);
      const bool faces_sun = smooth ? glm::dot(normals[i], to_sun) > 0 : shading_.sun_faces[hits[i].face];
      sunlit[i] =
          faces_sun && !contours_->walker.blocked(rays[i], {hits[i], normals[i], smooth}, to_sun, opaque_.volume());
      spent.shadow_rays += faces_sun;
    }
  }

  const world::WorldView& view_;
  const SkyView& sky_;
  world::WorldPoint camera_;
  PixelRays rays_;
  const RenderKnobs& knobs_;
  const RayStream& occupied_rays_;
  const world::ParallelRays& sun_rays_;
  const MaskWalker &occupied_, &opaque_, &shadows_;  // shadows_: of what throws them, as sun_rays_
  Shading shading_;
  const SurfaceLight& light_;
  VoxelCodes voxels_;           // of contours
  const LiquidLevels* levels_;  // null: all liquids are full
  const SunMaps& sun_maps_;
  const TextureSet* textures_;  // null: all blocks are even
  std::span<const shared::DrawnBox> boxes_;
  std::vector<PixelRectangle> box_rectangles_;
  SurfaceLightDecoder decoder_;
  bool lit_by_cells_;                               // not by the open sky alone
  const world::StoreContours::Followed* contours_;  // null: all voxels are cubes
  const world::BlockShapes* shapes_;                // null: the world has none, or all voxels are cubes
  const LightBlockers* blockers_;                   // null: none, or the knobs don't ask for them
  const SeeThroughKinds* kinds_;                    // null: nothing is seen through
  bool in_bounds_;                                  // the camera is within the regions that hold anything
  bool inside_;                                     // the camera is in a block
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
  return check_ranges(knobs);
}

class RaycastBackend : public Backend {
 public:
  /// Other integrators follow light themselves.
  bool reads_light(const world::World&, const RenderKnobs& knobs) const override {
    return knobs.light_transport == LightTransport::direct;
  }
  world::Result<Frame> render(const world::WorldView& view, const Camera& camera, const RenderKnobs& knobs, int width,
                              int height) override {
    TRY_STATUS(check(camera, knobs, width, height));
    if (knobs.spp == 1 && sample_shifts(knobs.anti_aliasing).size() > 1)
      return average_samples(*this, view, camera, knobs, width, height);
    TRY_STATUS(check_bsdfs(view.palette()));
    TRY_STATUS(world::check_proxies(view.palette()));
    const bool reads = reads_light(view.world(), knobs);
    if (reads) TRY_STATUS(check_light(light, knobs));
    if (!reads || knobs.spp > 1 || calls_for_trace_scene(view.world()) || knobs.direct_gloss == DirectGloss::lobe) {
      const bool meets_bodies = knobs.light_transport == LightTransport::direct ||
                                knobs.light_transport == LightTransport::ambient_occlusion ||
                                knobs.light_transport == LightTransport::whitted;
      std::vector<shared::DrawnBox> boxes;
      if (meets_bodies) boxes = drawn_bodies(view, inhabitants, camera, knobs, width, height);
      TRY(Frame traced, trace(view, camera, knobs, width, height, reads, boxes));
      TRY_STATUS(finish_traced(view, inhabitants, camera, knobs, traced, meets_bodies));
      return traced;
    }
    const auto start = Clock::now();
    Frame frame{Image(width, height), {}};
    TRY(const SkyView sky, sky_view(view, knobs, sky_light_, camera.position));
    const RayStream& occupied = rays_.stream(view.store(), MaskKind::occupied);
    const RayStream& opaque = rays_.stream(view.store(), MaskKind::opaque);
    const world::StoreContours::Followed* contours =
        contours_.follow(view.store(), static_cast<world::ContourShape>(knobs.contours), knobs.contour_iso);
    TRY(const world::BlockShapes shapes, world::block_shapes(view.palette()));
    bool any_shape = false;
    if (knobs.proxy_shapes != ProxyShapes::cube)
      for (const auto& [id, count] : view.store().census()) any_shape |= shapes.shape[id] != nullptr;
    // Contours and cubes of one picture can't both be seen through.
    std::optional<SeeThroughKinds> kinds;
    if (knobs.transparency != Transparency::opaque && !contours) {
      kinds.emplace(view.palette());
      if (!kinds->called_for(view.store().census())) kinds.reset();
    }
    const bool tinted = tints_sun(knobs) && !contours && holds_not_opaque(view);
    std::optional<SeeThroughKinds> light_kinds;
    std::vector<uint8_t> cubes;
    std::optional<LightBlockers> blockers;
    if (tinted) {
      const world::BlockShapes* const drawn = any_shape ? &shapes : nullptr;
      light_kinds.emplace(view.palette());
      cubes = hiding_cubes(view.palette(), *light_kinds, drawn);
      blockers.emplace(LightBlockers{occupied.walker(), *light_kinds, cubes, drawn});
    }
    const std::vector<world::LeafPos> moved =
        levels_.follow(view, knobs.liquid_surface != LiquidSurface::full && !contours);
    const ShadowVoxels::Change change = shadows_.follow(view, levels_, moved, rays_);
    const world::ParallelRays& sun_rays = shadows_.parallel(sky.environment.sun_direction);
    if (levels_.any() && !kinds) kinds.emplace(SeeThroughKinds::none(view.palette()));
    TRY_STATUS(textures_.follow(view.palette(), knobs));
    light_.follow(view, light, knobs.light_model);
    TRY_STATUS(sun_maps_.follow(view, shadows_, change, camera.position, knobs, sky.environment.sun_direction));
    const std::vector<shared::DrawnBox> boxes = drawn_bodies(view, inhabitants, camera, knobs, width, height);
    const Picture picture(view, sky, occupied, sun_rays, opaque.walker(), shadows_.stream().walker(), contours,
                          any_shape && !contours ? &shapes : nullptr, kinds ? &*kinds : nullptr, light_, light,
                          levels_.any() ? &levels_ : nullptr, sun_maps_, blockers ? &*blockers : nullptr, textures_,
                          boxes, camera, knobs, width, height, frame.image);
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
    report.passes = {{"prepare", prepare_ms, 0,
                      rays_.bytes() + shadows_.bytes() + contours_.bytes() + light_.bytes() + sun_maps_.bytes()},
                     {"primary", total.primary_ms * share}};
    if (total.light_walks) report.work.push_back({"tinted_shadows", total.light_walks});
    if (levels_.any()) report.work.push_back({"liquid_levels", levels_.leaves().size()});
    if (knobs.sun_shadow == SunShadow::map) report.work.push_back({"sun_map", sun_maps_.cast()});
    if (knobs.sun_shadow == SunShadow::ray) report.passes.push_back({"sun_shadow", total.shadow_ms * share});
    report.passes.push_back({"shade", total.shade_ms * share});
    report.device = fmt::format("CPU, {} thread{}", world::thread_count(), world::thread_count() == 1 ? "" : "s");
    TRY_STATUS(finish_traced(view, inhabitants, camera, knobs, frame, /*bodies_drawn=*/true));
    return frame;
  }

 private:
  /// By samples of an integrator, each of which finds the light that it needs but what direct light reads of the
  /// world's.
  world::Result<Frame> trace(const world::WorldView& view, const Camera& camera, const RenderKnobs& knobs, int width,
                             int height, bool reads, std::span<const shared::DrawnBox> bodies) {
    if (!reads || (knobs.light_model == LightModel::none && !knobs.corner_occlusion))
      return trace_picture(view, camera, knobs, sampling, width, height, bodies);
    const std::vector<world::LeafPos> moved = levels_.follow(view, knobs.liquid_surface != LiquidSurface::full);
    shadows_.follow(view, levels_, moved, rays_);
    light_.follow(view, light, knobs.light_model);
    const WorldLitSource lit{light_, light, shadows_.volume()};
    return trace_picture(view, camera, knobs, sampling, width, height, bodies, &lit);
  }

  world::StoreRays rays_;
  world::StoreContours contours_;
  SurfaceLight light_;
  LiquidLevels levels_;
  ShadowVoxels shadows_;
  SunMaps sun_maps_;
  std::shared_ptr<const world::SkyLight> sky_light_;
  TextureSet textures_;
};

}  // namespace

world::Result<std::unique_ptr<Backend>> make_raycast_backend() { return std::unique_ptr<Backend>(new RaycastBackend); }

}  // namespace render
