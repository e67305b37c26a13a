/// MagicaVoxel .vox files as they are stored: models, scene graph, palette, materials. No world here; see ../vox.cpp.
///
/// Axes are those of the file, z up. A voxel v of a model of size s, under transforms with rotation R and translation
/// t, fills the cell   floor(R * (v + 0.5 - floor(s / 2)) + t),   parents applied outside; R is a signed permutation.
/// Files without a scene graph: each model in its own coordinates, all models at the origin.
/// Frames: a negative frame is the file as it opens: the first model of each shape and the first place of each
/// transform, but all models of a file without a scene graph (PACK) on top of each other. Frame k >= 0 takes what
/// shows at k; of a PACK file, model k alone.
/// source ephtracy, voxel-model: MagicaVoxel-file-format-vox.txt and -vox-extension.txt
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "world/base/errors.h"

namespace world::vox {

using Dictionary = std::map<std::string, std::string>;

/// As it lies in the file.
struct Voxel {
  uint8_t x, y, z;
  uint8_t colour;  // palette index 1..255; 0 is no voxel in principle, but some writers use it
};
static_assert(sizeof(Voxel) == 4 && alignof(Voxel) == 1);

struct Model {
  std::array<int32_t, 3> size{};  // 0..256 each
  std::span<const Voxel> voxels;  // in the bytes of the file, all inside size; the last one of a position counts
};

/// cell = R * point + t; row i of R has its one non-zero entry, sign[i], in column column[i].
struct Transform {
  std::array<int, 3> column{0, 1, 2};
  std::array<int, 3> sign{1, 1, 1};
  std::array<int64_t, 3> translation{};

  bool rotated() const { return column != std::array<int, 3>{0, 1, 2} || sign != std::array<int, 3>{1, 1, 1}; }
};
/// What first `inner`, then `outer` do.
Transform compose(const Transform& outer, const Transform& inner);
/// The cell of a voxel of a model; see the head of this file.
std::array<int64_t, 3> cell(const Transform& transform, const Model& model, const Voxel& voxel);

struct TransformNode {
  int32_t child = 0, layer = -1;
  Dictionary attributes;
  std::vector<std::pair<int, Transform>> frames;  // frame number, place; at least one
};
struct GroupNode {
  std::vector<int32_t> children;
};
struct ShapeNode {
  std::vector<std::pair<int, int32_t>> models;  // frame number, model; at least one
};
struct Node {
  enum Kind { transform, group, shape } kind = group;
  uint64_t offset = 0;  // of its chunk in the file
  TransformNode trn;
  GroupNode grp;
  ShapeNode shp;
};

struct Colour {
  uint8_t r, g, b, a;
};
using Palette = std::array<Colour, 256>;  // by colour index; 0 is unused
const Palette& default_palette();

struct File {
  int32_t version = 0;
  std::vector<Model> models;
  std::map<int32_t, Node> nodes;                      // empty: no scene graph
  std::map<int32_t, Dictionary> layers;               // LAYR
  std::map<int32_t, Dictionary> materials;            // MATL, and MATT in MATL's words; by colour index
  std::vector<Dictionary> cameras;                    // rCAM
  std::vector<Dictionary> render_settings;            // rOBJ
  std::vector<std::string> notes;                     // NOTE: names of palette rows
  std::optional<std::array<uint8_t, 256>> index_map;  // IMAP: order of the palette on the screen only
  std::optional<int32_t> pack;                        // PACK: number of models it claims
  Palette palette = default_palette();
  bool has_palette = false;                   // RGBA was there
  int old_materials = 0;                      // MATT chunks
  std::map<std::string, int> unknown_chunks;  // name -> count; skipped
  uint64_t trailing_bytes = 0;                // after the main chunk; skipped
};

/// Reads all chunks. Voxels stay where they are: the bytes must outlive the File. Memory is bounded by a small multiple
/// of the bytes. `name` is for errors.
Result<File> parse(std::span<const uint8_t> bytes, std::string_view name);

struct Instance {
  int32_t model = 0;
  Transform transform;
  bool hidden = false;  // itself, a parent, or its layer
  std::string name;     // the innermost name on the way to it; may be empty
};

/// Follows the scene graph. Fails on unknown nodes, cycles, more than kMaxDepth levels, and more than kMaxInstances.
constexpr int kMaxDepth = 256;
constexpr size_t kMaxInstances = 1 << 18;
Result<std::vector<Instance>> instances(const File& file, std::string_view name, int frame);

}  // namespace world::vox
