#include "render/trace/world_lit.h"

#include "render/shading.h"

namespace render {

namespace {

int nearest_face(const Vec3f& normal) {
  const Vec3f size = abs(normal);
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  return axis * 2 + (normal[axis] > 0);
}

Vec3d vector_of(const Rgb& c) { return {c.r, c.g, c.b}; }

}  // namespace

WorldLit::WorldLit(const WorldLitSource& source, const world::WorldView& view, const SkyView& sky,
                   const RenderKnobs& knobs)
    : source_(source),
      knobs_(knobs),
      decoder_(source.faces.kind(), Shading(sky, view.palette())),
      voxels_(view, source.light, source.faces.kind()) {}

uint32_t WorldLit::code(const Surface& s) const {
  return s.kind == SurfaceKind::shape ? source_.faces.code_in_cell(s.behind, nearest_face(s.normal))
                                      : source_.faces.code(s.behind, s.face);
}

WorldLit::Light WorldLit::at_mesh(const Surface& s, const Vec3d& sky) const {
  // As the ray that leaves it: off the triangle.
  const TraceRay off = s.spawn(s.normal);
  const PointLight light =
      light_at_point(decoder_, knobs_.light_interpolation, voxels_, off.start(), Vec3d(s.shading_normal),
                     {static_cast<float>(sky.x), static_cast<float>(sky.y), static_cast<float>(sky.z)});
  return {vector_of(light.lit), knobs_.sun_shadow != SunShadow::sky_light || light.whole_sky};
}

WorldLit::Light WorldLit::at(const Surface& s, const Vec3d& sky) const {
  const bool by_model = source_.faces.kind() != SurfaceLight::Kind::none;
  if (s.kind == SurfaceKind::mesh) return by_model ? at_mesh(s, sky) : Light{sky};
  const bool by_sky = knobs_.sun_shadow == SunShadow::sky_light;
  if (s.kind == SurfaceKind::shape) {
    const uint32_t own = by_model ? code(s) : SurfaceLight::kUnknown;
    return {own == SurfaceLight::kUnknown ? sky : vector_of(decoder_(own, nearest_face(s.normal))),
            !by_sky || sees_whole_sky(own)};
  }
  const glm::ivec2 axes = shared::light_axes(world::face_axis(s.face));
  const auto beside = [&](int u, int v) {
    world::VoxelPos voxel = s.behind;
    voxel[axes.x] += u, voxel[axes.y] += v;
    return voxel;
  };
  const Rgb lit = light_on_face(
      decoder_, knobs_, s.face, {static_cast<float>(s.point[axes.x]), static_cast<float>(s.point[axes.y])},
      [&](int u, int v) { return source_.faces.code(beside(u, v), s.face); },
      [&](int u, int v) { return !source_.shadows.test(beside(u, v) + world::face_step(s.face)); });
  return {vector_of(lit), !by_sky || sees_whole_sky(code(s))};
}

}  // namespace render
