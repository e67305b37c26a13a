#include "render/trace/layers.h"

#include <chrono>
#include <cmath>

#include "render/effects/chain.h"
#include "render/inhabitants.h"
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
    PixelBuffer depth(PixelFormat::d32, width, height);
    Framebuffer buffers;
    TRY_STATUS(buffers.attach(BufferKind::depth, depth));
    TRY_STATUS(draw_layers(view, camera, knobs, buffers));
    const PixelRays rays(camera, width, height);
    std::vector<float> distances(frame.image.pixels.size());
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        distances[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)] =
            depth.depth(x, y) * static_cast<float>(glm::length(rays.direction(x + 0.5, y + 0.5)));
    const DrawnInhabitants drawn = drawn_inhabitants(view, inhabitants, camera, knobs, width, height);
    draw_over(drawn, camera, distances, frame.image, bodies_drawn);
    const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    frame.report.passes.push_back({"inhabitants", ms, drawn.boxes.size() + drawn.balls.size(), 0});
    frame.report.ms += ms;
  }
  return finish_picture(view, camera, knobs, frame);
}

}  // namespace render
