#include "render/trace/layers.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "render/effects/chain.h"
#include "render/inhabitants.h"
#include "render/see_through.h"
#include "render/trace/geometry.h"
#include "world/base/jobs.h"

namespace render {

namespace {

uint32_t id_of(const Surface& s) {
  switch (s.kind) {
    case SurfaceKind::none:
      return 0;
    case SurfaceKind::mesh:
      return kMeshIds + s.index;
    case SurfaceKind::luminaire:
      return kLuminaireIds + s.index;
    default:
      return s.block;
  }
}

/// Of an integrator that follows light through water and glass these hide what lies behind them, as all surfaces do.
world::Result<PixelDistances> distances_of(const world::WorldView& view, const Camera& camera, const RenderKnobs& knobs,
                                           int width, int height) {
  TRY(const TraceScene scene, TraceScene::build(view, shared::kGlossFresnel, view.environment(), knobs));
  const SeeThroughKinds kinds(view.palette());
  const bool straight =
      knobs.transparency != Transparency::opaque &&
      (knobs.light_transport == LightTransport::direct || knobs.light_transport == LightTransport::ambient_occlusion);
  const PixelRays rays(camera, width, height);
  const MeshesAround around = Tracer(scene).around(camera.position);
  const auto pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  PixelDistances distances{std::vector<float>(pixels, HUGE_VALF), std::vector<float>(pixels, HUGE_VALF)};
  world::parallel_ranges(static_cast<size_t>(height), 8, [&](size_t begin, size_t end) {
    Tracer tracer(scene);
    std::vector<Crossing> crossings;
    for (size_t at = begin * static_cast<size_t>(width); at < end * static_cast<size_t>(width); ++at) {
      const Vec3d through = rays.direction(static_cast<int>(at) % width + 0.5, static_cast<int>(at) / width + 0.5),
                  direction = through / glm::length(through);
      TraceRay ray;
      ray.ray = world::GridRay(camera.position, direction);
      ray.around = around;
      double passed = 0;
      for (bool layer = true; layer;) {
        ray.ray.t_max = knobs.view_distance - passed;
        const Surface s = tracer.intersect(ray, crossings);
        if (!s.hit()) break;
        passed += s.t;
        distances.first[at] = std::min(distances.first[at], static_cast<float>(passed));
        layer = straight && s.kind == SurfaceKind::voxel && kinds.contains(s.block);
        if (!layer) {
          distances.opaque[at] = static_cast<float>(passed);
        } else {
          ray = s.spawn(Vec3f(direction));
          ray.ray.direction = direction;
        }
      }
    }
  });
  return distances;
}

}  // namespace

world::Status draw_layers(const world::WorldView& view, const Camera& camera, const RenderKnobs& knobs,
                          const Framebuffer& out) {
  TRY(const TraceScene scene, TraceScene::build(view, shared::kGlossFresnel, view.environment(), knobs));
  const PixelRays rays(camera, out.width(), out.height());
  const MeshesAround around = Tracer(scene).around(camera.position);
  PixelBuffer *depth = out[BufferKind::depth], *normal = out[BufferKind::normal], *id = out[BufferKind::material];
  world::parallel_ranges(static_cast<size_t>(out.height()), 8, [&](size_t begin, size_t end) {
    Tracer tracer(scene);
    std::vector<Crossing> crossings;
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y)
      for (int x = 0; x < out.width(); ++x) {
        const Vec3d direction = rays.direction(x + 0.5, y + 0.5);
        const double length = glm::length(direction);
        TraceRay ray;
        ray.ray = world::GridRay(camera.position, direction / length);
        ray.ray.t_max = knobs.view_distance;
        ray.around = around;
        const Surface s = tracer.intersect(ray, crossings);
        // Per unit of depth a ray is `length` long.
        if (depth) depth->set_depth(x, y, s.hit() ? static_cast<float>(s.t / length) : HUGE_VALF);
        if (normal) normal->set_normal(x, y, s.hit() ? glm::vec3(s.normal.x, s.normal.y, s.normal.z) : glm::vec3(0));
        if (id) id->set_id(x, y, id_of(s));
      }
  });
  return {};
}

world::Status finish_traced(const world::WorldView& view, const Inhabitants& inhabitants, const Camera& camera,
                            const RenderKnobs& knobs, Frame& frame, bool bodies_drawn) {
  if (!inhabitants.empty()) {
    const auto start = std::chrono::steady_clock::now();
    const int width = frame.image.width, height = frame.image.height;
    TRY(PixelDistances distances, distances_of(view, camera, knobs, width, height));
    const DrawnInhabitants drawn = drawn_inhabitants(view, inhabitants, camera, knobs, width, height);
    draw_over(drawn, camera, distances, frame.image, bodies_drawn);
    const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    frame.report.passes.push_back({"inhabitants", ms, drawn.boxes.size() + drawn.balls.size(), 0});
    frame.report.ms += ms;
  }
  return finish_picture(view, camera, knobs, frame);
}

}  // namespace render
