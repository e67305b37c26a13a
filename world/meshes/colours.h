/// What files of meshes say of colours, beside the mesh itself.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "world/units/quantity.h"

namespace world {

struct MeshColours {
  std::vector<uint32_t> of_vertices;   // 0xRRGGBB, sRGB, by position of the mesh; empty: none
  std::vector<uint32_t> of_triangles;  // by triangle: its entry in materials; empty: none
  struct Material {
    std::string name;
    Ratio3 diffuse{0.8f, 0.8f, 0.8f};  // linear
    std::string texture;               // a picture's file, by texture coordinates; empty: none
    bool found = false;                // in a library, or said by the file itself
  };
  std::vector<Material> materials;
  std::vector<std::string> libraries;  // files of materials that the file names
  bool any() const { return !of_vertices.empty() || !of_triangles.empty(); }
};

}  // namespace world
