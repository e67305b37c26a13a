// glTF 2.0, binary (.glb): one mesh, a primitive and a material a block: base colour (linear, the albedo), emission,
// and blending where light passes. Faces are flat: each quad has its own four vertices with a normal.
//
//   "glTF", 2, length      chunk "JSON", padded with spaces      chunk "BIN": for each block positions, normals,
//   indices
//
// source Khronos Group. glTF 2.0 Specification. 2021
#include <cmath>

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

world::Result<std::string> encode(const SurfaceMesh& surface) {
  json gltf = {{"asset", {{"version", "2.0"}, {"generator", "Loam"}}},
               {"scene", 0},
               {"scenes", {{{"nodes", {0}}}}},
               {"nodes", {{{"mesh", 0}}}}};
  json &views = gltf["bufferViews"] = json::array(), &accessors = gltf["accessors"] = json::array(),
       &materials = gltf["materials"] = json::array(), primitives = json::array();
  std::string bytes;
  const auto view = [&](size_t from, int target) {
    views.push_back({{"buffer", 0}, {"byteOffset", from}, {"byteLength", bytes.size() - from}, {"target", target}});
    return views.size() - 1;
  };
  for (const BlockSurface& block : surface.blocks) {
    const size_t vertices = 4 * block.quads.size();
    std::array<float, 3> low{INFINITY, INFINITY, INFINITY}, high{-INFINITY, -INFINITY, -INFINITY};
    size_t from = bytes.size();
    for (const auto& quad : block.quads) {
      for (const uint32_t v : quad) {
        for (int axis = 0; axis < 3; ++axis) {
          const auto i = static_cast<size_t>(axis);
          const float at = static_cast<float>(surface.vertices[v][axis] * surface.voxel_size_m);
          low[i] = std::min(low[i], at), high[i] = std::max(high[i], at);
          put(bytes, at);
        }
      }
    }
    accessors.push_back({{"bufferView", view(from, kVertices)},
                         {"componentType", kFloat},
                         {"count", vertices},
                         {"type", "VEC3"},
                         {"min", low},
                         {"max", high}});
    from = bytes.size();
    for (const uint8_t face : block.faces) {
      for (int corner = 0; corner < 4; ++corner)
        for (int axis = 0; axis < 3; ++axis)
          put(bytes, axis == world::face_axis(face) ? static_cast<float>(world::face_sign(face)) : 0.0f);
    }
    accessors.push_back(
        {{"bufferView", view(from, kVertices)}, {"componentType", kFloat}, {"count", vertices}, {"type", "VEC3"}});
    from = bytes.size();
    for (uint32_t q = 0; q < block.quads.size(); ++q)
      for (const uint32_t corner : {0u, 1u, 2u, 0u, 2u, 3u}) put(bytes, 4 * q + corner);
    accessors.push_back({{"bufferView", view(from, kIndices)},
                         {"componentType", kUnsignedInt},
                         {"count", 6 * block.quads.size()},
                         {"type", "SCALAR"}});
    primitives.push_back({{"attributes", {{"POSITION", accessors.size() - 3}, {"NORMAL", accessors.size() - 2}}},
                          {"indices", accessors.size() - 1},
                          {"material", materials.size()}});
    materials.push_back(material_of((*surface.palette)[block.block]));
  }
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

}  // namespace

SurfaceFormat glb_surface_format() {
  return {.name = "glb",
          .extension = ".glb",
          .what = "faces with materials, binary glTF",
          .encode = encode,
          .materials = true};
}

}  // namespace render
