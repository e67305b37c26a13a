#include "render/extract/marching_cells.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <optional>
#include <utility>

namespace render {

namespace {

using Loop = std::vector<uint8_t>;

constexpr bool is_inside(uint32_t inside, int corner) { return inside >> corner & 1; }

int cube_edge_between(int a, int b) {
  const int step = a ^ b, from = a & b, axis = std::countr_zero(static_cast<unsigned>(step));
  return 4 * axis + (from >> (axis + 1) << axis | (from & ((1 << axis) - 1)));
}

/// Corners of the six faces, counter-clockwise seen from outside; numbered as world::Face.
std::array<std::array<int, 4>, 6> faces_of_cube() {
  std::array<std::array<int, 4>, 6> faces{};
  for (int face = 0; face < 6; ++face) {
    const int axis = face >> 1, u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3, base = (face & 1) << axis;
    std::array<int, 4> ring{base, base + u, base + u + v, base + v};
    if (!(face & 1)) std::swap(ring[1], ring[3]);
    faces[static_cast<size_t>(face)] = ring;
  }
  return faces;
}
const std::array<std::array<int, 4>, 6> kFacesOfCube = faces_of_cube();

bool is_ambiguous(uint32_t inside, const std::array<int, 4>& ring) {
  return is_inside(inside, ring[0]) == is_inside(inside, ring[2]) &&
         is_inside(inside, ring[1]) == is_inside(inside, ring[3]) &&
         is_inside(inside, ring[0]) != is_inside(inside, ring[1]);
}

/// Where the surface crosses the cube's edges, in loops: counter-clockwise seen from outside the solid.
std::vector<Loop> loops_of(uint32_t inside, uint32_t joined) {
  // Round each face, crossed edges enter the solid or leave it by turns; a segment runs from an entry to an exit. An
  // edge lies on two faces, once as an entry and once as an exit, so that the segments of all faces form loops.
  std::array<int, 12> next;
  next.fill(-1);
  for (size_t face = 0; face < 6; ++face) {
    const auto& ring = kFacesOfCube[face];
    const bool separate_inside = !(is_ambiguous(inside, ring) && (joined >> face & 1));
    for (size_t k = 0; k < 4; ++k) {
      // An entry: from outside to inside.
      if (is_inside(inside, ring[k]) || !is_inside(inside, ring[(k + 1) % 4])) continue;
      // Take the next exit, which cuts off the inside corners between; where these are joined, the one before.
      size_t exit = k;
      do exit = (exit + (separate_inside ? 1 : 3)) % 4;
      while (!(is_inside(inside, ring[exit]) && !is_inside(inside, ring[(exit + 1) % 4])));
      next[static_cast<size_t>(cube_edge_between(ring[k], ring[(k + 1) % 4]))] =
          cube_edge_between(ring[exit], ring[(exit + 1) % 4]);
    }
  }
  std::vector<Loop> loops;
  for (int start = 0; start < 12; ++start) {
    Loop loop;
    for (int at = start; next[static_cast<size_t>(at)] >= 0;) {
      loop.push_back(static_cast<uint8_t>(at));
      at = std::exchange(next[static_cast<size_t>(at)], -1);
    }
    if (!loop.empty()) loops.push_back(std::move(loop));
  }
  return loops;
}

/// Whether two edges lie on one face of the cube: a diagonal between them could be another cell's too.
bool share_a_face(int a, int b) {
  const CellEdge &e = cube_edges()[static_cast<size_t>(a)], &f = cube_edges()[static_cast<size_t>(b)];
  for (int axis = 0; axis < 3; ++axis) {
    const int bit = 1 << axis;
    if (!(e.step & bit) && !(f.step & bit) && (e.from & bit) == (f.from & bit)) return true;
  }
  return false;
}

/// Squared distance of the middles of two edges, in quarters.
int apart(int a, int b) {
  const CellEdge &e = cube_edges()[static_cast<size_t>(a)], &f = cube_edges()[static_cast<size_t>(b)];
  int sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto twice = [&](const CellEdge& edge) { return 2 * (edge.from >> axis & 1) + (edge.step >> axis & 1); };
    const int d = twice(e) - twice(f);
    sum += d * d;
  }
  return sum;
}

/// The triangles of a loop with the shortest diagonals, none of them on a face; nothing where there are none such.
/// By the best way to fill each run of the loop.
std::optional<std::vector<uint8_t>> fill_loop(const Loop& loop) {
  constexpr int kNever = 1 << 20;
  const size_t n = loop.size();
  std::vector<std::vector<int>> cost(n, std::vector<int>(n, 0)), middle(n, std::vector<int>(n, -1));
  for (size_t length = 2; length < n; ++length)
    for (size_t i = 0; i + length < n; ++i) {
      const size_t j = i + length;
      const bool whole = i == 0 && j == n - 1;
      const int own = whole ? 0 : share_a_face(loop[i], loop[j]) ? kNever : apart(loop[i], loop[j]);
      cost[i][j] = std::numeric_limits<int>::max();
      for (size_t k = i + 1; k < j; ++k) {
        const int sum = std::min(kNever, cost[i][k] + cost[k][j] + own);
        if (sum < cost[i][j]) cost[i][j] = sum, middle[i][j] = static_cast<int>(k);
      }
    }
  if (cost[0][n - 1] >= kNever) return std::nullopt;
  std::vector<uint8_t> triangles;
  std::vector<std::pair<size_t, size_t>> left = {{0, n - 1}};
  while (!left.empty()) {
    const auto [i, j] = left.back();
    left.pop_back();
    if (j < i + 2) continue;
    const auto k = static_cast<size_t>(middle[i][j]);
    triangles.insert(triangles.end(), {loop[i], loop[k], loop[j]});
    left.emplace_back(i, k), left.emplace_back(k, j);
  }
  return triangles;
}

CubeCase make_cube_case(uint32_t inside, uint32_t joined) {
  CubeCase made;
  for (const Loop& loop : loops_of(inside, joined)) {
    if (const auto filled = fill_loop(loop)) {
      made.triangles.insert(made.triangles.end(), filled->begin(), filled->end());
      continue;
    }
    const auto centre = static_cast<uint8_t>(kCubeCentre + made.centres.size());
    for (size_t i = 0; i < loop.size(); ++i)
      made.triangles.insert(made.triangles.end(), {loop[i], loop[(i + 1) % loop.size()], centre});
    made.centres.push_back(loop);
  }
  return made;
}

uint32_t ambiguous_faces(uint32_t inside) {
  uint32_t faces = 0;
  for (size_t face = 0; face < 6; ++face)
    if (is_ambiguous(inside, kFacesOfCube[face])) faces |= 1u << face;
  return faces;
}

/// All cases; those that differ in faces which aren't ambiguous are one.
struct CubeCases {
  std::vector<CubeCase> cases;
  std::array<uint16_t, 256 * 64> place{};
  CubeCases() {
    for (uint32_t inside = 0; inside < 256; ++inside) {
      const uint32_t open = ambiguous_faces(inside);
      for (uint32_t joined = 0; joined < 64; ++joined) {
        const size_t at = inside * 64 + joined;
        if ((joined & ~open) != 0) {
          place[at] = place[inside * 64 + (joined & open)];
          continue;
        }
        place[at] = static_cast<uint16_t>(cases.size());
        cases.push_back(make_cube_case(inside, joined));
      }
    }
  }
};

// ---- tetrahedra ----

/// The tetrahedra are the six ways from corner 0 to corner 7 along the axes: 0, a, a + b, a + b + c.
std::vector<CellEdge> make_tetrahedra_case(uint32_t inside) {
  std::vector<CellEdge> triangles;
  for (int first = 0; first < 3; ++first)
    for (int turn = 1; turn < 3; ++turn) {
      const int a = 1 << first, b = 1 << (first + turn) % 3;
      std::array<int, 4> corner{0, a, a + b, 7};
      // Corners 1, 2, 3 seen from 0 run counter-clockwise where the axes follow each other cyclically, else clockwise.
      if (turn == 2) std::swap(corner[2], corner[3]);
      std::array<int, 4> in{}, out{};
      size_t ins = 0, outs = 0;
      for (size_t i = 0; i < 4; ++i) (is_inside(inside, corner[i]) ? in[ins++] : out[outs++]) = static_cast<int>(i);
      if (ins == 0 || outs == 0) continue;
      const auto edge = [&](int i, int j) {
        const int p = corner[static_cast<size_t>(i)], q = corner[static_cast<size_t>(j)];
        return CellEdge{static_cast<uint8_t>(p & q), static_cast<uint8_t>(p ^ q)};
      };
      // An even order of the four, the inside ones first, has the same hand as the tetrahedron.
      std::array<int, 4> order{};
      for (size_t i = 0; i < 4; ++i) order[i] = i < ins ? in[i] : out[i - ins];
      int swaps = 0;
      for (size_t i = 0; i < 4; ++i)
        for (size_t j = i + 1; j < 4; ++j) swaps += order[i] > order[j];
      if (swaps % 2 == 1) std::swap(order[ins >= 2 ? 0 : 2], order[ins >= 2 ? 1 : 3]);
      const auto [p, q, r, s] = order;
      if (ins == 1) {
        triangles.insert(triangles.end(), {edge(p, q), edge(p, r), edge(p, s)});
      } else if (ins == 3) {
        triangles.insert(triangles.end(), {edge(p, s), edge(q, s), edge(r, s)});
      } else {
        triangles.insert(triangles.end(), {edge(p, r), edge(p, s), edge(q, s)});
        triangles.insert(triangles.end(), {edge(p, r), edge(q, s), edge(q, r)});
      }
    }
  return triangles;
}

}  // namespace

const std::array<CellEdge, 12>& cube_edges() {
  static const std::array<CellEdge, 12> edges = [] {
    std::array<CellEdge, 12> all{};
    for (int axis = 0; axis < 3; ++axis)
      for (int corner = 0; corner < 8; ++corner) {
        if (corner >> axis & 1) continue;
        const int other = corner | 1 << axis;
        all[static_cast<size_t>(cube_edge_between(corner, other))] = {static_cast<uint8_t>(corner),
                                                                      static_cast<uint8_t>(1 << axis)};
      }
    return all;
  }();
  return edges;
}

uint32_t joined_faces(const std::array<float, 8>& values, uint32_t inside) {
  static const std::array<uint8_t, 256> ambiguous = [] {
    std::array<uint8_t, 256> all{};
    for (uint32_t i = 0; i < 256; ++i) all[i] = static_cast<uint8_t>(ambiguous_faces(i));
    return all;
  }();
  uint32_t joined = 0;
  for (uint32_t left = ambiguous[inside]; left != 0; left &= left - 1) {
    const auto face = static_cast<size_t>(std::countr_zero(left));
    const auto& ring = kFacesOfCube[face];
    // The saddle of the bilinear values has the sign of the difference of these products, which are exact: both cells
    // of the face decide alike.
    const auto value = [&](size_t i) { return double{values[static_cast<size_t>(ring[i])]}; };
    const double even = value(0) * value(2), odd = value(1) * value(3);
    if (is_inside(inside, ring[0]) ? even >= odd : odd >= even) joined |= 1u << face;
  }
  return joined;
}

const CubeCase& cube_case(uint32_t inside, uint32_t joined) {
  static const CubeCases all;
  return all.cases[all.place[inside * 64 + joined]];
}

std::span<const CellEdge> tetrahedra_case(uint32_t inside) {
  static const std::vector<std::vector<CellEdge>> all = [] {
    std::vector<std::vector<CellEdge>> cases;
    for (uint32_t i = 0; i < 256; ++i) cases.push_back(make_tetrahedra_case(i));
    return cases;
  }();
  return all[inside];
}

}  // namespace render
