#include "render/inhabitants.h"

#include <algorithm>
#include <cmath>

#include "world/base/jobs.h"
#include "world/store/mask_walk.h"

namespace render {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr float kMostOpacity = 0.999f;  // optical depth 6.9
constexpr float kUnderCover = 0.2f;     // of the sky's light, where something is above
constexpr double kPixelRadius = 0.75;   // pixels: no ball is drawn smaller

Vec3d offset_of(const Inhabitants& inhabitants, const Camera& camera, double x, double y, double z) {
  const world::VoxelPos from = inhabitants.origin - camera.position.voxel;
  return Vec3d(from.x, from.y, from.z) + (Vec3d(x, y, z) - camera.position.fraction);
}

/// What light arrives at a place.
struct Light {
  float sun, sky;  // 0..1
};

Light light_at(const world::MaskWalker& opaque, const world::WorldPoint& at, const SkyView& seen, bool shadows) {
  const world::Environment& environment = seen.environment;
  Light light{1, 1};
  if (shadows && environment.sun_irradiance.max() > 0)
    light.sun = opaque.first_set(world::GridRay(at, environment.sun_direction)).hit() ? 0.0f : 1.0f;
  light.sun *= seen.sun_through(at);
  light.sky = opaque.first_set(world::GridRay(at, Vec3d(0, 1, 0))).hit() ? kUnderCover : 1.0f;
  return light;
}

glm::vec4 vec4_of(const Rgb& c, float w = 0) { return {c.r, c.g, c.b, w}; }

Rgb times(const world::Ratio3& a, const Rgb& b) { return {a.r * b.r, a.g * b.g, a.b * b.b}; }

/// Rows and columns that a ball may reach.
class Reach {
 public:
  Reach(const Camera& camera, int width, int height)
      : rays(camera, width, height),
        width_(width),
        height_(height),
        right_(rays.window_right),
        up_(rays.window_up),
        forward_(rays.forward) {}
  PixelRectangle of(const glm::vec3& middle, float radius) const {
    const float depth = glm::dot(middle, forward_);
    const float wide = 2 * radius * static_cast<float>(rays.longest);
    if (depth <= 1.01f * radius) return {0, width_, 0, height_};
    const auto range = [&](float offset, double half_window, int pixels, int& first, int& last) {
      const float near = depth - radius, half = static_cast<float>(half_window);
      const float low = std::min((offset - wide) / near, (offset - wide) / (depth + radius)) / half;
      const float high = std::max((offset + wide) / near, (offset + wide) / (depth + radius)) / half;
      first = static_cast<int>(std::clamp(std::floor((low + 1) * 0.5f * float(pixels)), 0.0f, float(pixels)));
      last = static_cast<int>(std::clamp(std::ceil((high + 1) * 0.5f * float(pixels)), 0.0f, float(pixels)));
    };
    PixelRectangle r{};
    range(glm::dot(middle, right_), rays.window_half_x, width_, r.x0, r.x1);
    range(-glm::dot(middle, up_), rays.window_half_y, height_, r.y0, r.y1);
    return r;
  }
  PixelRectangle of(const shared::DrawnBox& b) const {
    return of(glm::vec3(b.low + b.high) * 0.5f, glm::length(glm::vec3(b.high - b.low)) * 0.5f);
  }
  const PixelRays rays;

 private:
  int width_, height_;
  glm::vec3 right_, up_, forward_;
};

}  // namespace

DrawnInhabitants drawn_inhabitants(const world::WorldView& view, const Inhabitants& inhabitants, const Camera& camera,
                                   const RenderKnobs& knobs, int width, int height) {
  DrawnInhabitants drawn;
  if (inhabitants.empty()) return drawn;
  const PixelRays rays(camera, width, height);
  SkyView seen(view.environment());
  seen.set_clouds(knobs, camera.position.voxel);
  const world::Environment& environment = seen.environment;
  const Shading shading(seen, view.palette());
  const world::MaskWalker opaque(view.masks(world::MaskKind::opaque));
  const bool shadows = knobs.sun_shadow != SunShadow::none;
  Rgb sky{};
  for (int face = 0; face < world::kFaces; ++face) sky = sky + shading.sky_lit[face] * (1.0f / world::kFaces);
  // A matte ball in the sun sends E / (4 pi) of its albedo to each side, in the mean over sides.
  const world::Irradiance3& e = environment.sun_irradiance;
  const auto to_sides = static_cast<float>(1 / (4 * kPi));
  const Rgb sun{e.r * to_sides, e.g * to_sides, e.b * to_sides};
  const auto behind_clouds = [&](const Rgb& radiance, const Vec3d& middle, double distance) {
    return distance > 0 ? seen.behind_clouds(radiance, camera.position, middle / distance, distance) : radiance;
  };
  const double pixel = glm::length(rays.step_x);
  const double shutter_s = std::max(knobs.shutter, 0.0f);

  std::vector<shared::DrawnBall> balls(inhabitants.particles.size());
  world::parallel_ranges(balls.size(), 1024, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const ParticleRecord& p = inhabitants.particles[i];
      const Vec3d middle = offset_of(inhabitants, camera, double{p.x}, double{p.y}, double{p.z});
      const double depth = glm::dot(middle, rays.forward), distance = glm::length(middle);
      balls[i].middle.w = 0;
      if (!(depth > -double{p.radius}) || !(distance <= knobs.view_distance) || !(p.opacity > 0) || !(p.radius > 0))
        continue;
      const double least = kPixelRadius * pixel * std::max(depth, 0.0), radius = std::max(double{p.radius}, least);
      const Vec3d way = shutter_s * Vec3d(p.velocity_x, p.velocity_y, p.velocity_z);
      const double length = glm::length(way), around = radius + length / 2;
      if (!std::isfinite(length)) continue;
      if (std::abs(glm::dot(middle, rays.window_right)) > rays.window_half_x * depth + 2 * around * rays.longest ||
          std::abs(glm::dot(middle, rays.window_up)) > rays.window_half_y * depth + 2 * around * rays.longest)
        continue;
      const Light light = light_at(opaque, camera.position + middle, seen, shadows);
      const Rgb radiance =
          behind_clouds(times(p.albedo, sky * light.sky + sun * light.sun) + p.emitted, middle, distance);
      const double thinner = p.radius / radius;
      const double optical_depth = -std::log1p(-double{std::min(p.opacity, kMostOpacity)}) * thinner * thinner;
      // A way of less than a pixel shows nothing.
      const bool moves = length > pixel * std::max(depth, 0.0);
      balls[i] = {glm::vec4(glm::vec3(middle), static_cast<float>(radius)),
                  vec4_of(radiance, static_cast<float>(optical_depth)),
                  moves ? glm::vec4(glm::vec3(way), 1) : glm::vec4(0)};
    }
  });
  std::erase_if(balls, [](const shared::DrawnBall& b) { return !(b.middle.w > 0); });
  // Ties keep their order, so that a picture repeats.
  std::stable_sort(balls.begin(), balls.end(), [](const shared::DrawnBall& a, const shared::DrawnBall& b) {
    const glm::vec3 x(a.middle), y(b.middle);
    return glm::dot(x, x) > glm::dot(y, y);
  });
  drawn.balls = std::move(balls);

  for (const BodyRecord& b : inhabitants.bodies) {
    const Vec3d middle = offset_of(inhabitants, camera, double{b.x}, double{b.y}, double{b.z});
    const Vec3d half(b.half_x, b.half_y, b.half_z);
    if (glm::length(middle) - glm::length(half) > knobs.view_distance) continue;
    shared::DrawnBox box;
    box.low = glm::vec4(glm::vec3(middle - half), 0), box.high = glm::vec4(glm::vec3(middle + half), 0);
    // From above its middle, since it may stand in water or touch a wall.
    const Vec3d top = middle + Vec3d(0, half.y + 0.01, 0);
    const Light light = light_at(opaque, camera.position + top, seen, shadows);
    for (int face = 0; face < world::kFaces; ++face)
      box.radiance[face] =
          vec4_of(behind_clouds(times(b.albedo, shading.sky_lit[face] * light.sky + shading.sun_lit[face] * light.sun),
                                middle, glm::length(middle)));
    drawn.boxes.push_back(box);
  }
  return drawn;
}

std::vector<shared::DrawnBox> drawn_bodies(const world::WorldView& view, const Inhabitants& inhabitants,
                                           const Camera& camera, const RenderKnobs& knobs, int width, int height) {
  return drawn_inhabitants(view, {inhabitants.origin, {}, inhabitants.bodies}, camera, knobs, width, height).boxes;
}

std::vector<PixelRectangle> rectangles_of(std::span<const shared::DrawnBox> boxes, const Camera& camera, int width,
                                          int height) {
  const Reach reach(camera, width, height);
  std::vector<PixelRectangle> all;
  for (const shared::DrawnBox& b : boxes) all.push_back(reach.of(b));
  return all;
}

void draw_over(const DrawnInhabitants& drawn, const Camera& camera, PixelDistances& distances, Image& image,
               bool boxes_drawn) {
  const Reach reach(camera, image.width, image.height);
  const PixelRays& rays = reach.rays;
  const std::vector<PixelRectangle> of_boxes = rectangles_of(drawn.boxes, camera, image.width, image.height);
  std::vector<PixelRectangle> of_balls;
  for (const shared::DrawnBall& b : drawn.balls) {
    const glm::vec3 middle(b.middle), half_way = 0.5f * glm::vec3(b.way);
    const PixelRectangle from = reach.of(middle - half_way, b.middle.w), to = reach.of(middle + half_way, b.middle.w);
    of_balls.push_back(
        {std::min(from.x0, to.x0), std::max(from.x1, to.x1), std::min(from.y0, to.y0), std::max(from.y1, to.y1)});
  }

  constexpr size_t kRows = 8;
  world::parallel_ranges((static_cast<size_t>(image.height) + kRows - 1) / kRows, 1, [&](size_t begin, size_t end) {
    const int first = static_cast<int>(begin * kRows), last = std::min(static_cast<int>(end * kRows), image.height);
    const auto each_pixel = [&](const PixelRectangle& r, auto draw) {
      for (int y = std::max(first, r.y0); y < std::min(last, r.y1); ++y)
        for (int x = r.x0; x < r.x1; ++x) {
          const glm::vec3 direction(glm::normalize(rays.direction(x + 0.5, y + 0.5)));
          const size_t at = static_cast<size_t>(y) * static_cast<size_t>(image.width) + static_cast<size_t>(x);
          draw(direction, distances.first[at], distances.opaque[at], image.pixels[at]);
        }
    };
    for (size_t i = 0; i < drawn.boxes.size(); ++i) {
      const shared::DrawnBox& b = drawn.boxes[i];
      each_pixel(of_boxes[i], [&](const glm::vec3& direction, float& surface, float& opaque, Rgb& pixel) {
        const shared::BoxHit hit = shared::meet_box(glm::vec3(b.low), glm::vec3(b.high), direction);
        if (!(hit.distance > 0 && hit.distance < opaque)) return;
        opaque = hit.distance;
        if (boxes_drawn || !(hit.distance < surface)) return;
        surface = hit.distance;
        const glm::vec4& radiance = b.radiance[hit.face];
        pixel = {radiance.x, radiance.y, radiance.z};
      });
    }
    for (size_t i = 0; i < drawn.balls.size(); ++i) {
      const shared::DrawnBall& b = drawn.balls[i];
      each_pixel(of_balls[i], [&](const glm::vec3& direction, float, float opaque, Rgb& pixel) {
        const float opacity = shared::ball_opacity(b, direction, opaque);
        if (!(opacity > 0)) return;
        const Rgb radiance{b.radiance.x, b.radiance.y, b.radiance.z};
        pixel = pixel * (1 - opacity) + radiance * opacity;
      });
    }
  });
}

}  // namespace render
