#include "world/sources/mesh/subdivide.h"

#include <cmath>

#include <fmt/format.h>
#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/topologyDescriptor.h>

namespace world {
namespace {

namespace Far = OpenSubdiv::Far;

constexpr double kMostQuads = 1 << 23;

/// What OpenSubdiv adds up.
struct Point {
  Vec3f p{0.0f};
  void Clear(void* = nullptr) { p = Vec3f(0.0f); }
  void AddWithWeight(const Point& other, float weight) { p += weight * other.p; }
};

/// Undirected edges with more than two faces, or two faces that run the same way.
bool is_surface(const PolygonMesh& cage) {
  std::map<std::pair<uint32_t, uint32_t>, int> directed;
  size_t first = 0;
  for (const uint32_t size : cage.face_sizes) {
    for (uint32_t k = 0; k < size; ++k) {
      const uint32_t a = cage.face_corners[first + k], b = cage.face_corners[first + (k + 1) % size];
      if (a == b || ++directed[{a, b}] > 1) return false;
    }
    first += size;
  }
  return true;
}

}  // namespace

Result<TriangleMesh> subdivided(const PolygonMesh& cage, int levels, const std::string& name) {
  if (!is_surface(cage))
    return input_error(name +
                       ": the cage is no surface: an edge has more than two faces, or two that disagree on what is "
                       "outside");
  if (static_cast<double>(cage.face_corners.size()) * std::pow(4.0, levels - 1) > kMostQuads)
    return input_error(fmt::format("{}: {} levels make more than {:.0f} quadrilaterals of its {} faces; choose fewer",
                                   name, levels, kMostQuads, cage.face_sizes.size()));
  const std::vector<int> sizes(cage.face_sizes.begin(), cage.face_sizes.end()),
      corners(cage.face_corners.begin(), cage.face_corners.end());
  std::vector<int> crease_vertices;
  std::vector<float> sharpness;
  for (const PolygonMesh::Crease& crease : cage.creases) {
    crease_vertices.insert(crease_vertices.end(), {static_cast<int>(crease.a), static_cast<int>(crease.b)});
    sharpness.push_back(std::min(crease.sharpness, 10.0f));
  }
  Far::TopologyDescriptor descriptor;
  descriptor.numVertices = static_cast<int>(cage.positions.size());
  descriptor.numFaces = static_cast<int>(sizes.size());
  descriptor.numVertsPerFace = sizes.data();
  descriptor.vertIndicesPerFace = corners.data();
  descriptor.numCreases = static_cast<int>(sharpness.size());
  descriptor.creaseVertexIndexPairs = crease_vertices.data();
  descriptor.creaseWeights = sharpness.data();
  using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
  OpenSubdiv::Sdc::Options options;
  options.SetVtxBoundaryInterpolation(OpenSubdiv::Sdc::Options::VTX_BOUNDARY_EDGE_AND_CORNER);
  const std::unique_ptr<Far::TopologyRefiner> refiner(
      Factory::Create(descriptor, Factory::Options(OpenSubdiv::Sdc::SCHEME_CATMARK, options)));
  if (!refiner) return input_error(name + ": OpenSubdiv cannot refine the cage");
  Far::TopologyRefiner::UniformOptions uniform(levels);
  uniform.fullTopologyInLastLevel = true;  // the limit needs it
  refiner->RefineUniform(uniform);

  std::vector<Point> points(static_cast<size_t>(refiner->GetNumVerticesTotal()));
  for (size_t i = 0; i < cage.positions.size(); ++i) points[i].p = cage.positions[i];
  const Far::PrimvarRefiner refine(*refiner);
  Point* from = points.data();
  for (int level = 1; level <= levels; ++level) {
    Point* to = from + refiner->GetLevel(level - 1).GetNumVertices();
    refine.Interpolate(level, from, to);
    from = to;
  }
  const Far::TopologyLevel& last = refiner->GetLevel(levels);
  std::vector<Point> limit(static_cast<size_t>(last.GetNumVertices()));
  refine.Limit(from, limit);

  TriangleMesh mesh;
  for (const Point& point : limit) mesh.positions.push_back(point.p);
  for (int face = 0; face < last.GetNumFaces(); ++face) {
    const Far::ConstIndexArray v = last.GetFaceVertices(face);
    for (int k = 2; k < v.size(); ++k)
      mesh.triangles.emplace_back(static_cast<uint32_t>(v[0]), static_cast<uint32_t>(v[k - 1]),
                                  static_cast<uint32_t>(v[k]));
  }
  return mesh;
}

}  // namespace world
