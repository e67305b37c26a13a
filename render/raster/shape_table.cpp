#include "render/raster/shape_table.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include <glm/geometric.hpp>

namespace render::raster {

world::Status ShapeTable::prepare(PassContext& context, const Drawing& drawing) {
  // Six faces of boxes, then two sides of each normal that sheets have.
  std::vector<world::Vec3f> normals;
  for (int f = 0; f < world::kFaces; ++f) {
    world::Vec3f n(0);
    n[world::face_axis(f)] = static_cast<float>(world::face_sign(f));
    normals.push_back(n);
  }
  const std::vector<ShapeQuad>& of_shapes = drawing.block_shapes->quads();
  std::vector<vec4> quads;
  quads.reserve(of_shapes.size() * kQuadVectors);
  for (const ShapeQuad& q : of_shapes) {
    size_t lit = static_cast<size_t>(q.direction);
    if (q.direction == kBothSides) {
      lit = world::kFaces;
      while (lit < normals.size() && normals[lit] != q.normal) lit += 2;
      if (lit == normals.size()) normals.push_back(q.normal), normals.push_back(-q.normal);
    }
    const world::Vec3d u(q.u), v(q.v), n = glm::cross(u, v);
    const double square = glm::dot(n, n);
    quads.emplace_back(q.corner, std::bit_cast<float>(static_cast<uint32_t>(lit)));
    quads.emplace_back(q.u, std::bit_cast<float>(uint32_t{q.block}));
    quads.emplace_back(q.v, q.emission);
    quads.emplace_back(q.normal, std::bit_cast<float>(q.direction));
    const world::Vec3d along_u = glm::cross(v, n) / square, along_v = glm::cross(n, u) / square, corner(q.corner);
    quads.emplace_back(world::Vec3f(along_u), static_cast<float>(glm::dot(along_u, corner)));
    quads.emplace_back(world::Vec3f(along_v), static_cast<float>(glm::dot(along_v, corner)));
    quads.emplace_back(q.normal, glm::dot(q.normal, q.corner));
    world::Vec3f low(INFINITY), high(-INFINITY);
    for (uint32_t i = 0; i < q.faces; ++i) {
      const ShapeQuad& face = (&q)[i];
      for (const world::Vec3f& p :
           {face.corner, face.corner + face.u, face.corner + face.v, face.corner + face.u + face.v})
        low = glm::min(low, p), high = glm::max(high, p);
    }
    quads.emplace_back(low, std::bit_cast<float>(q.faces));
    quads.emplace_back(high, 0);
  }
  std::vector<vec4> lit;
  for (const world::Vec3f& n : normals) {
    constexpr float kPi = 3.14159265f;
    const world::Irradiance3 sky = sky_irradiance(drawing.sky, world::Vec3d(n));
    const float cosine = static_cast<float>(glm::dot(drawing.environment.sun_direction, world::Vec3d(n)));
    const world::Irradiance3 sun = drawing.environment.sun_irradiance;
    const float factor = std::max(cosine, 0.0f) / kPi;
    lit.emplace_back(sky.r / kPi, sky.g / kPi, sky.b / kPi, 0);
    lit.emplace_back(sun.r * factor, sun.g * factor, sun.b * factor, cosine > 0 ? 1.0f : 0.0f);
  }
  constexpr VkFormat kFormat = VK_FORMAT_R32G32B32A32_SFLOAT;
  TRY_STATUS(context.fill_texels(quads_, kFormat, quads.data(), quads.size() * sizeof(vec4)));
  TRY_STATUS(context.fill_texels(lit_, kFormat, lit.data(), lit.size() * sizeof(vec4)));
  context.bindings.bind(kBindShapeQuads, quads_);
  context.bindings.bind(kBindShapeLit, lit_);
  return {};
}

}  // namespace render::raster
