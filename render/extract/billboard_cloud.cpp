#include "render/extract/billboard_cloud.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "world/base/errors.h"

namespace render {

namespace {

using glm::dvec3;
using glm::ivec3;

constexpr double kPi = 3.14159265358979323846;
/// Steps of a quarter circle in which directions lie.
constexpr int kDirectionSteps = 4;
/// Cosine of the angle by which a face and its plane may be tilted, less what rounding takes.
constexpr double kLeastCosine = 0.5 - 1e-9;
/// Areas are summed as integers, so that what was added can be taken away.
constexpr double kAreaUnits = 4096;

/// Of half a sphere; the six of the grid's axes among them.
const std::vector<dvec3>& directions() {
  static const std::vector<dvec3> all = [] {
    std::vector<dvec3> made{dvec3(0, 1, 0)};
    for (int theta = 1; theta <= kDirectionSteps; ++theta) {
      const int around = theta == kDirectionSteps ? 2 * kDirectionSteps : 4 * kDirectionSteps;
      const double t = theta * kPi / 2 / kDirectionSteps;
      for (int phi = 0; phi < around; ++phi) {
        const double p = phi * kPi / 2 / kDirectionSteps;
        dvec3 n(std::sin(t) * std::cos(p), std::cos(t), std::sin(t) * std::sin(p));
        for (int a = 0; a < 3; ++a)
          if (std::abs(n[a]) < 1e-12) n[a] = 0;
        made.push_back(glm::normalize(n));
      }
    }
    return made;
  }();
  return all;
}

dvec3 normal_of(int direction) {
  dvec3 n(0);
  n[direction >> 1] = direction & 1 ? 1 : -1;
  return n;
}

/// The four corners are corner, + u, + v, + u + v.
struct Square {
  dvec3 corner, u{0}, v{0}, normal;

  explicit Square(const UnitFace& face) : corner(face.voxel), normal(normal_of(face.direction)) {
    const int axis = face.direction >> 1;
    corner[axis] += face.direction & 1;
    u[(axis + 1) % 3] = 1, v[(axis + 2) % 3] = 1;
  }
  std::pair<double, double> range(const dvec3& n) const {
    double low = glm::dot(corner, n), high = low;
    for (const double along : {glm::dot(u, n), glm::dot(v, n)}) (along < 0 ? low : high) += along;
    return {low, high};
  }
};

/// What of the plane space is worth what: a row of offsets for each direction.
class PlaneSpace {
 public:
  PlaneSpace(std::span<const UnitFace> faces, double error) : error_(error), step_(error / 2) {
    dvec3 low(std::numeric_limits<double>::infinity()), high(-low);
    for (const UnitFace& f : faces) low = glm::min(low, dvec3(f.voxel)), high = glm::max(high, dvec3(f.voxel) + 1.0);
    for (const dvec3& n : directions()) {
      double least = 0, most = 0;
      for (int a = 0; a < 3; ++a)
        least += n[a] * (n[a] < 0 ? high[a] : low[a]), most += n[a] * (n[a] < 0 ? low[a] : high[a]);
      const int first = static_cast<int>(std::floor((least - error) / step_)) - 1;
      rows_.push_back(
          {first, std::vector<int64_t>(static_cast<size_t>(std::ceil((most + error) / step_) + 2 - first))});
    }
    for (const UnitFace& f : faces) add(f, 1);
  }

  void add(const UnitFace& face, int sign) {
    const Square square(face);
    for (size_t d = 0; d < rows_.size(); ++d) {
      const double shown = std::abs(glm::dot(directions()[d], square.normal));
      if (shown < kLeastCosine) continue;
      const auto [first, last] = places(square, d);
      for (int k = first; k <= last; ++k)
        rows_[d].worth[static_cast<size_t>(k - rows_[d].first)] += sign * std::llround(kAreaUnits * shown);
    }
  }

  std::pair<size_t, int> best() const {
    std::pair<size_t, int> at{0, 0};
    int64_t most = -1;
    for (size_t d = 0; d < rows_.size(); ++d)
      for (size_t k = 0; k < rows_[d].worth.size(); ++k)
        if (rows_[d].worth[k] > most) most = rows_[d].worth[k], at = {d, static_cast<int>(k) + rows_[d].first};
    return at;
  }

  bool shows(const UnitFace& face, std::pair<size_t, int> plane) const {
    const Square square(face);
    if (std::abs(glm::dot(directions()[plane.first], square.normal)) < kLeastCosine) return false;
    const auto [first, last] = places(square, plane.first);
    return plane.second >= first && plane.second <= last;
  }
  double offset(int place) const { return place * step_; }

 private:
  struct Row {
    int first;
    std::vector<int64_t> worth;
  };
  /// Of the planes that all of a face lies near to.
  std::pair<int, int> places(const Square& square, size_t direction) const {
    const auto [low, high] = square.range(directions()[direction]);
    return {static_cast<int>(std::ceil((high - error_) / step_)), static_cast<int>(std::floor((low + error_) / step_))};
  }
  double error_, step_;
  std::vector<Row> rows_;
};

/// Draws faces onto a plane, each side what is in front.
void draw_plane(std::span<const UnitFace> faces, std::span<const uint32_t> shown, CloudPlane& plane,
                std::vector<uint32_t>& texels) {
  const auto count = static_cast<size_t>(plane.width) * static_cast<size_t>(plane.height);
  std::vector<uint32_t> sides[2];
  std::vector<double> heights[2];
  for (int s = 0; s < 2; ++s)
    sides[s].resize(count), heights[s].assign(count, -std::numeric_limits<double>::infinity());
  for (const uint32_t i : shown) {
    const Square square(faces[i]);
    const dvec3 &n = plane.normal, c = square.corner;
    const double ax = glm::dot(square.u, plane.u), ay = glm::dot(square.u, plane.v), bx = glm::dot(square.v, plane.u),
                 by = glm::dot(square.v, plane.v), area = ax * by - ay * bx, cx = glm::dot(c, plane.u) - plane.low_u,
                 cy = glm::dot(c, plane.v) - plane.low_v;
    const int side = glm::dot(square.normal, n) > 0 ? 0 : 1, axis = faces[i].direction >> 1;
    const uint32_t texel = cloud_texel(faces[i], faces[i].voxel[axis] + (faces[i].direction & 1));
    const auto texel_range = [&](double at, double a, double b, int size) {
      const double low = at + std::min(a, 0.0) + std::min(b, 0.0), high = at + std::max(a, 0.0) + std::max(b, 0.0);
      return std::pair{std::clamp(static_cast<int>(std::floor(low / kCloudTexel)), 0, size),
                       std::clamp(static_cast<int>(std::ceil(high / kCloudTexel)), 0, size)};
    };
    const auto [x0, x1] = texel_range(cx, ax, bx, plane.width);
    const auto [y0, y1] = texel_range(cy, ay, by, plane.height);
    for (int y = y0; y < y1; ++y)
      for (int x = x0; x < x1; ++x) {
        const double px = (x + 0.5) * kCloudTexel - cx, py = (y + 0.5) * kCloudTexel - cy;
        const double s = (px * by - py * bx) / area, t = (py * ax - px * ay) / area;
        constexpr double kEdge = 1e-9;
        if (s < -kEdge || t < -kEdge || s > 1 + kEdge || t > 1 + kEdge) continue;
        const double height = (side ? -1 : 1) * glm::dot(c + s * square.u + t * square.v, n);
        const size_t at = static_cast<size_t>(y) * static_cast<size_t>(plane.width) + static_cast<size_t>(x);
        if (height > heights[side][at]) heights[side][at] = height, sides[side][at] = texel;
      }
  }
  // What one side alone shows, the other shows too: else one would look through it.
  plane.first = static_cast<uint32_t>(texels.size());
  for (int s = 0; s < 2; ++s)
    for (size_t i = 0; i < count; ++i) texels.push_back(sides[s][i] ? sides[s][i] : sides[1 - s][i]);
}

}  // namespace

double cloud_error(double error) { return std::hypot(error, kCloudTexel / std::sqrt(2.0)); }

BillboardCloud billboard_cloud(std::span<const UnitFace> faces, double error) {
  BillboardCloud cloud;
  constexpr uint32_t kNone = ~0u;
  cloud.plane_of.assign(faces.size(), kNone);
  PlaneSpace space(faces, error);
  for (size_t left = faces.size(); left > 0;) {
    const std::pair<size_t, int> best = space.best();
    CloudPlane plane{};
    plane.normal = directions()[best.first], plane.offset = space.offset(best.second);
    plane.u = glm::normalize(std::abs(plane.normal.y) < 0.9 ? glm::cross(dvec3(0, 1, 0), plane.normal)
                                                            : glm::cross(dvec3(0, 0, 1), plane.normal));
    plane.v = glm::cross(plane.normal, plane.u);

    // Take the faces that have none; draw those too that have another.
    double low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9};
    std::vector<uint32_t> shown;
    const size_t before = left;
    for (uint32_t i = 0; i < faces.size(); ++i) {
      if (!space.shows(faces[i], best)) continue;
      shown.push_back(i);
      if (cloud.plane_of[i] != kNone) continue;
      cloud.plane_of[i] = static_cast<uint32_t>(cloud.planes.size());
      space.add(faces[i], -1);
      --left;
      const Square square(faces[i]);
      const dvec3 axes[2] = {plane.u, plane.v};
      for (int a = 0; a < 2; ++a) {
        const auto [from, to] = square.range(axes[a]);
        low[a] = std::min(low[a], from), high[a] = std::max(high[a], to);
      }
    }
    CHECK(left < before);
    plane.low_u = low[0], plane.low_v = low[1];
    plane.width = std::max(1, static_cast<int>(std::ceil((high[0] - low[0]) / kCloudTexel - 1e-9)));
    plane.height = std::max(1, static_cast<int>(std::ceil((high[1] - low[1]) / kCloudTexel - 1e-9)));
    draw_plane(faces, shown, plane, cloud.texels);
    cloud.planes.push_back(plane);
  }
  return cloud;
}

std::vector<TreeFaces> trees_of(std::span<const FaceRecord> records) {
  std::map<std::tuple<int, int, int>, std::vector<UnitFace>> voxels;
  for (const FaceRecord& r : records) {
    const int direction = static_cast<int>(face_direction(r.word1)), axis = direction >> 1;
    const int u = axis == 2 ? 1 : 2, v = axis == 0 ? 1 : 0;
    for (int i = 0; i < static_cast<int>(face_width(r.word0)); ++i)
      for (int j = 0; j < static_cast<int>(face_height(r.word0)); ++j) {
        ivec3 at(face_voxel(r.word0));
        at[u] += i, at[v] += j;
        voxels[{at.x, at.y, at.z}].push_back(
            {at, static_cast<uint8_t>(direction), static_cast<uint16_t>(face_block(r.word1))});
      }
  }
  std::vector<TreeFaces> trees;
  while (!voxels.empty()) {
    // Follow the neighbours within the cell of kTreeCells that the tree begins at.
    TreeFaces tree;
    const auto begin = voxels.begin()->first;
    const ivec3 start(std::get<0>(begin), std::get<1>(begin), std::get<2>(begin));
    std::vector<ivec3> open{start};
    ivec3 low = start, high = start;
    const auto visit = [&](const ivec3& at) {
      const ivec3 new_low = glm::min(low, at), new_high = glm::max(high, at);
      for (int a = 0; a < 3; ++a)
        if (new_high[a] - new_low[a] >= kTreeCells) return;
      const auto found = voxels.find({at.x, at.y, at.z});
      if (found == voxels.end()) return;
      low = new_low, high = new_high;
      tree.faces.insert(tree.faces.end(), found->second.begin(), found->second.end());
      voxels.erase(found);
      open.push_back(at);
    };
    visit(start);
    for (size_t next = 0; next < open.size(); ++next)
      for (int k = 0; k < 27; ++k) {
        const ivec3 at = open[next];  // visit() may move it
        visit(at + ivec3(k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1));
      }
    tree.low = low;
    for (UnitFace& f : tree.faces) f.voxel -= low;
    std::sort(tree.faces.begin(), tree.faces.end(), [](const UnitFace& a, const UnitFace& b) {
      return std::tie(a.voxel.x, a.voxel.y, a.voxel.z, a.direction) <
             std::tie(b.voxel.x, b.voxel.y, b.voxel.z, b.direction);
    });
    trees.push_back(std::move(tree));
  }
  return trees;
}

}  // namespace render
