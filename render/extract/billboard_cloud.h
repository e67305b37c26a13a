/// Billboard clouds: the faces of a tree as a few planes with pictures on them, which stand for the faces where those
/// are seen from afar.
///
/// A tree is what of a chunk's leaves and logs hangs together, corners included; what is larger than kTreeCells is cut.
/// Planes are taken greedily from all those of kCloudDirections normals at multiples of half the error: the one next
/// that shows the largest area, projected, of faces that have none. A plane shows a face where all of the face lies
/// within the error of it and the two are tilted by at most 60 degrees, so that a face keeps half of its area. Every
/// face has such a plane: its own.
///
/// error  a point of a face lies at most `error` from its plane, along the normal; its texel half a texel's diagonal
/// source Xavier Decoret, Fredo Durand, Francois Sillion, Julie Dorsey. Billboard Clouds for Extreme Model
///        Simplification. 2003 (the greedy choice; without its search for a better plane within a cell)
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "render/extract/face_record.shared.h"

namespace render {

constexpr int kTreeCells = 16;
constexpr double kCloudTexel = 0.25;  // m

/// One side of a voxel.
struct UnitFace {
  glm::ivec3 voxel;
  uint8_t direction = 0;
  uint16_t block = 0;
  friend bool operator==(const UnitFace&, const UnitFace&) = default;
};

/// Faces relative to the tree's lowest voxel, which is relative to the chunk.
struct TreeFaces {
  glm::ivec3 low{0};
  std::vector<UnitFace> faces;
};
/// The trees of a chunk, from the records of its leaves and logs.
std::vector<TreeFaces> trees_of(std::span<const FaceRecord> records);

/// What a texel shows: bits 0..15 block, 16..18 face, 19..25 plane of the face, voxels from the tree's lowest; 0:
/// nothing. As a texel of an impostor.
constexpr uint32_t cloud_texel(const UnitFace& face, int plane) {
  return uint32_t{face.block} | uint32_t{face.direction} << 16 | static_cast<uint32_t>(plane) << 19;
}

/// A rectangle of texels: those seen from the normal's side, row by row, then those seen from behind.
struct CloudPlane {
  glm::dvec3 normal, u, v;  // unit, at right angles
  double offset;            // of the points p . normal
  double low_u, low_v;      // of the first texel's corner
  int width, height;        // texels
  uint32_t first;           // of the cloud's texels
};

struct BillboardCloud {
  std::vector<CloudPlane> planes;
  std::vector<uint32_t> texels;
  std::vector<uint32_t> plane_of;  // of each face of the tree
};
BillboardCloud billboard_cloud(std::span<const UnitFace> faces, double error);

/// How far a cloud shows a point from where it is, m.
double cloud_error(double error);

}  // namespace render
