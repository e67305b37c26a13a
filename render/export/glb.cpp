// glTF 2.0, binary (.glb): one mesh, a primitive and a material a block: base colour (linear, the albedo), emission,
// and blending where light passes. Faces are flat: each quad has its own four vertices with a normal.
//
//   "glTF", 2, length      chunk "JSON", padded with spaces      chunk "BIN": for each block positions, normals,
//   indices
//
// source Khronos Group. glTF 2.0 Specification. 2021
#include <cmath>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "render/export/export.h"

namespace render {
namespace {

using nlohmann::json;

constexpr int kFloat = 5126, kUnsignedInt = 5125, kVertices = 34962, kIndices = 34963;

json material_of(const world::Block& block) {
  const float alpha = block.opaque ? 1.0f : 0.4f;
  json material = {{"name", block.name},
                   {"pbrMetallicRoughness",
                    {{"baseColorFactor", {block.albedo.r, block.albedo.g, block.albedo.b, alpha}},
                     {"metallicFactor", 0},
                     {"roughnessFactor", 1 - block.shininess}}}};
  if (!block.opaque) material["alphaMode"] = "BLEND";
  // Watts have no place in a material of glTF; the colour of the light has.
  const float brightest = std::max({block.emission.r, block.emission.g, block.emission.b});
  if (brightest > 0)
    material["emissiveFactor"] = {block.emission.r / brightest, block.emission.g / brightest,
                                  block.emission.b / brightest};
  return material;
}

/// A file in the making.
struct Glb {
  std::string bytes;
  json views = json::array(), accessors = json::array(), materials = json::array(), primitives = json::array();

  /// What was put from `from` on, as one attribute or list of indices; gives its number.
  size_t add(size_t from, int target, int component, size_t count, const char* type) {
    views.push_back({{"buffer", 0}, {"byteOffset", from}, {"byteLength", bytes.size() - from}, {"target", target}});
    accessors.push_back(
        {{"bufferView", views.size() - 1}, {"componentType", component}, {"count", count}, {"type", type}});
    return accessors.size() - 1;
  }
  void add_primitive(size_t positions, std::optional<size_t> normals, size_t indices, const world::Block& block) {
    json attributes = {{"POSITION", positions}};
    if (normals) attributes["NORMAL"] = *normals;
    primitives.push_back({{"attributes", attributes}, {"indices", indices}, {"material", materials.size()}});
    materials.push_back(material_of(block));
  }
  world::Result<std::string> finish() const;
};

world::Result<std::string> Glb::finish() const {
  json gltf = {{"asset", {{"version", "2.0"}, {"generator", "Loam"}}},
               {"scene", 0},
               {"scenes", {{{"nodes", {0}}}}},
               {"nodes", {{{"mesh", 0}}}},
               {"bufferViews", views},
               {"accessors", accessors},
               {"materials", materials}};
  gltf["meshes"] = {{{"name", "world"}, {"primitives", primitives}}};
  gltf["buffers"] = {{{"byteLength", bytes.size()}}};
  std::string text = gltf.dump();
  text.append((4 - text.size() % 4) % 4, ' ');
  const uint64_t length = 12 + 8 + uint64_t{text.size()} + 8 + bytes.size();
  if (length > UINT32_MAX)
    return world::input_error(fmt::format("the faces take {} bytes, and a .glb holds at most 4 GiB", length));
  std::string out = "glTF";
  put(out, uint32_t{2});
  put(out, static_cast<uint32_t>(length));
  put(out, static_cast<uint32_t>(text.size()));
  out += "JSON" + text;
  put(out, static_cast<uint32_t>(bytes.size()));
  out += std::string("BIN\0", 4) + bytes;
  return out;
}

world::Result<std::string> encode(const SurfaceMesh& surface) {
  Glb file;
  for (const BlockSurface& block : surface.blocks) {
    const size_t vertices = 4 * block.quads.size();
    std::array<float, 3> low{INFINITY, INFINITY, INFINITY}, high{-INFINITY, -INFINITY, -INFINITY};
    size_t from = file.bytes.size();
    for (const auto& quad : block.quads) {
      for (const uint32_t v : quad) {
        for (int axis = 0; axis < 3; ++axis) {
          const auto i = static_cast<size_t>(axis);
          const float at = static_cast<float>(surface.vertices[v][axis] * surface.voxel_size_m);
          low[i] = std::min(low[i], at), high[i] = std::max(high[i], at);
          put(file.bytes, at);
        }
      }
    }
    const size_t positions = file.add(from, kVertices, kFloat, vertices, "VEC3");
    file.accessors.back()["min"] = low, file.accessors.back()["max"] = high;
    from = file.bytes.size();
    for (const uint8_t face : block.faces) {
      for (int corner = 0; corner < 4; ++corner)
        for (int axis = 0; axis < 3; ++axis)
          put(file.bytes, axis == world::face_axis(face) ? static_cast<float>(world::face_sign(face)) : 0.0f);
    }
    const size_t normals = file.add(from, kVertices, kFloat, vertices, "VEC3");
    from = file.bytes.size();
    for (uint32_t q = 0; q < block.quads.size(); ++q)
      for (const uint32_t corner : {0u, 1u, 2u, 0u, 2u, 3u}) put(file.bytes, 4 * q + corner);
    const size_t indices = file.add(from, kIndices, kUnsignedInt, 6 * block.quads.size(), "SCALAR");
    file.add_primitive(positions, normals, indices, (*surface.palette)[block.block]);
  }
  return file.finish();
}

world::Result<std::string> encode_smooth(const SmoothSurface& surface) {
  Glb file;
  const size_t vertices = surface.mesh.vertices.size();
  std::array<float, 3> low{INFINITY, INFINITY, INFINITY}, high{-INFINITY, -INFINITY, -INFINITY};
  for (const world::Vec3d& v : surface.mesh.vertices)
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<size_t>(axis);
      const float at = static_cast<float>(v[axis] * surface.voxel_size_m);
      low[i] = std::min(low[i], at), high[i] = std::max(high[i], at);
      put(file.bytes, at);
    }
  const size_t positions = file.add(0, kVertices, kFloat, vertices, "VEC3");
  file.accessors.back()["min"] = low, file.accessors.back()["max"] = high;
  std::optional<size_t> normals;
  if (!surface.normals.empty()) {
    const size_t from = file.bytes.size();
    for (const world::Vec3f& n : surface.normals) {
      // The specification asks for unit length: where triangles without area meet, any will do.
      const bool none = n == world::Vec3f(0.0f);
      for (int axis = 0; axis < 3; ++axis) put(file.bytes, none && axis == 1 ? 1.0f : n[axis]);
    }
    normals = file.add(from, kVertices, kFloat, vertices, "VEC3");
  }
  for (const auto& [block, triangles] : triangles_by_block(surface)) {
    const size_t from = file.bytes.size();
    for (const glm::uvec3& t : triangles)
      for (int k = 0; k < 3; ++k) put(file.bytes, t[k]);
    const size_t indices = file.add(from, kIndices, kUnsignedInt, 3 * triangles.size(), "SCALAR");
    file.add_primitive(positions, normals, indices, (*surface.palette)[block]);
  }
  return file.finish();
}

}  // namespace

SurfaceFormat glb_surface_format() {
  return {.name = "glb",
          .extension = ".glb",
          .what = "faces with materials, binary glTF",
          .encode = encode,
          .encode_smooth = encode_smooth,
          .materials = true};
}

}  // namespace render
