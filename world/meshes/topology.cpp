#include "world/meshes/topology.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <unordered_map>

#include "world/base/random.h"

namespace world {
namespace {

bool has_area(const glm::uvec3& t) { return t.x != t.y && t.y != t.z && t.z != t.x; }

}  // namespace

std::vector<glm::uvec3> triangles_from_list(std::span<const uint32_t> indices) {
  std::vector<glm::uvec3> triangles;
  for (size_t i = 0; i + 2 < indices.size(); i += 3) {
    const glm::uvec3 t(indices[i], indices[i + 1], indices[i + 2]);
    if (has_area(t)) triangles.push_back(t);
  }
  return triangles;
}

std::vector<glm::uvec3> triangles_from_strip(std::span<const uint32_t> indices) {
  std::vector<glm::uvec3> triangles;
  for (size_t i = 0; i + 2 < indices.size(); ++i) {
    const glm::uvec3 t = i % 2 == 0 ? glm::uvec3(indices[i], indices[i + 2], indices[i + 1])
                                    : glm::uvec3(indices[i], indices[i + 1], indices[i + 2]);
    if (has_area(t)) triangles.push_back(t);
  }
  return triangles;
}

std::vector<glm::uvec3> triangles_from_fan(std::span<const uint32_t> indices) {
  std::vector<glm::uvec3> triangles;
  for (size_t i = 1; i + 1 < indices.size(); ++i) {
    const glm::uvec3 t(indices[0], indices[i], indices[i + 1]);
    if (has_area(t)) triangles.push_back(t);
  }
  return triangles;
}

std::vector<std::vector<uint32_t>> strips_from_triangles(std::span<const glm::uvec3> triangles) {
  uint32_t vertices = 0;
  for (const glm::uvec3& t : triangles) vertices = std::max({vertices, t.x + 1, t.y + 1, t.z + 1});
  const HalfEdges edges = half_edges(triangles, vertices);
  std::vector<uint8_t> used(triangles.size());
  std::vector<uint32_t> visited;
  // A strip that enters its first face by half-edge h reads end h, start h, third, ...: triangle 0 is (end h, third,
  // start h), the same face. It goes on over third - start h, then over third - fourth, and so on: in faces that it
  // enters by h at even places the way out is the half-edge before h, at odd ones the one after it.
  const auto run = [&](uint32_t first, std::vector<uint32_t>* out) {
    visited.clear();
    uint32_t h = first;
    if (out) *out = {edges.end(h), edges.start[h]};
    for (bool even = true;; even = !even) {
      const uint32_t face = HalfEdges::face_of(h);
      if (used[face]) break;
      used[face] = 1;
      visited.push_back(face);
      if (out) out->push_back(edges.start[HalfEdges::previous(h)]);
      const uint32_t way = edges.twin[even ? HalfEdges::previous(h) : HalfEdges::next(h)];
      if (way == HalfEdges::kNone) break;
      h = way;
    }
    const size_t length = visited.size();
    if (!out)
      for (const uint32_t face : visited) used[face] = 0;
    return length;
  };
  std::vector<std::vector<uint32_t>> strips;
  for (uint32_t t = 0; t < triangles.size(); ++t) {
    if (used[t]) continue;
    uint32_t best = 3 * t;
    size_t longest = 0;
    for (uint32_t k = 0; k < 3; ++k) {
      const size_t length = run(3 * t + k, nullptr);
      if (length > longest) longest = length, best = 3 * t + k;
    }
    strips.emplace_back();
    run(best, &strips.back());
  }
  return strips;
}

std::vector<uint32_t> joined_strip(std::span<const std::vector<uint32_t>> strips) {
  std::vector<uint32_t> joined;
  for (const std::vector<uint32_t>& strip : strips) {
    if (strip.empty()) continue;
    if (!joined.empty()) {
      joined.push_back(joined.back());
      joined.push_back(strip.front());
      if (joined.size() % 2 != 0) joined.push_back(strip.front());  // each strip must start at an even place
    }
    joined.insert(joined.end(), strip.begin(), strip.end());
  }
  return joined;
}

std::vector<std::vector<uint32_t>> fans_from_triangles(std::span<const glm::uvec3> triangles) {
  uint32_t vertices = 0;
  for (const glm::uvec3& t : triangles) vertices = std::max({vertices, t.x + 1, t.y + 1, t.z + 1});
  const HalfEdges edges = half_edges(triangles, vertices);
  std::vector<uint32_t> left(vertices);  // triangles at each vertex that are in no fan yet
  std::vector<std::vector<uint32_t>> corners(vertices);
  for (uint32_t h = 0; h < edges.start.size(); ++h) ++left[edges.start[h]], corners[edges.start[h]].push_back(h);
  std::vector<uint8_t> used(triangles.size());
  // Vertices by how many triangles they have left; entries that are out of date are moved down.
  std::vector<std::vector<uint32_t>> by_count(1);
  for (uint32_t v = 0; v < vertices; ++v) {
    if (by_count.size() <= left[v]) by_count.resize(left[v] + 1);
    by_count[left[v]].push_back(v);
  }
  std::vector<std::vector<uint32_t>> fans;
  for (size_t count = by_count.size() - 1; count > 0; --count) {
    while (!by_count[count].empty()) {
      const uint32_t v = by_count[count].back();
      by_count[count].pop_back();
      if (left[v] != count) {
        if (left[v] > 0) by_count[left[v]].push_back(v);
        continue;
      }
      for (const uint32_t corner : corners[v]) {
        if (used[HalfEdges::face_of(corner)]) continue;
        // Back to where the run of unused triangles around v begins, then forward along it.
        uint32_t first = corner;
        while (true) {
          const uint32_t before = edges.twin[first];
          if (before == HalfEdges::kNone) break;
          const uint32_t h = HalfEdges::next(before);
          if (h == corner || used[HalfEdges::face_of(h)]) break;
          first = h;
        }
        std::vector<uint32_t> fan{v, edges.end(first)};
        for (uint32_t h = first;;) {
          const uint32_t face = HalfEdges::face_of(h);
          used[face] = 1;
          for (uint32_t k = 0; k < 3; ++k) --left[edges.start[3 * face + k]];
          fan.push_back(edges.start[HalfEdges::previous(h)]);
          const uint32_t way = edges.twin[HalfEdges::previous(h)];
          if (way == HalfEdges::kNone || used[HalfEdges::face_of(way)]) break;
          h = way;
        }
        fans.push_back(std::move(fan));
      }
    }
  }
  return fans;
}

HalfEdges half_edges(std::span<const glm::uvec3> triangles, size_t vertices) {
  HalfEdges edges;
  const size_t count = 3 * triangles.size();
  edges.start.reserve(count);
  for (const glm::uvec3& t : triangles) edges.start.insert(edges.start.end(), {t.x, t.y, t.z});
  edges.twin.assign(count, HalfEdges::kNone);
  edges.outgoing.assign(vertices, HalfEdges::kNone);
  // Half-edges by where they start, and those of one vertex, which are few, by where they end.
  std::vector<uint32_t> first(vertices + 1);
  for (const uint32_t v : edges.start) ++first[v + 1];
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<uint32_t> by_ends(count), last(first.begin(), first.end() - 1);
  for (uint32_t h = 0; h < count; ++h) by_ends[last[edges.start[h]]++] = h;
  const auto at = [&](uint32_t i) { return by_ends.begin() + static_cast<std::ptrdiff_t>(i); };
  // The first of each direction counts; more than one is a conflict, and stays on the border.
  for (size_t v = 0; v < vertices; ++v) {
    std::sort(at(first[v]), at(last[v]), [&](uint32_t a, uint32_t b) {
      return edges.end(a) != edges.end(b) ? edges.end(a) < edges.end(b) : a < b;
    });
    const auto kept =
        std::unique(at(first[v]), at(last[v]), [&](uint32_t a, uint32_t b) { return edges.end(a) == edges.end(b); });
    edges.conflicts += static_cast<uint64_t>(at(last[v]) - kept);
    last[v] = static_cast<uint32_t>(kept - by_ends.begin());
  }
  for (uint32_t v = 0; v < vertices; ++v) {
    for (uint32_t i = first[v]; i < last[v]; ++i) {
      const uint32_t to = edges.end(by_ends[i]);
      const auto other = std::lower_bound(at(first[to]), at(last[to]), v,
                                          [&](uint32_t h, uint32_t vertex) { return edges.end(h) < vertex; });
      if (other != at(last[to]) && edges.end(*other) == v) edges.twin[by_ends[i]] = *other;
    }
  }
  for (uint32_t h = 0; h < count; ++h) {
    uint32_t& outgoing = edges.outgoing[edges.start[h]];
    if (outgoing == HalfEdges::kNone || edges.twin[h] == HalfEdges::kNone) outgoing = h;
    edges.border += edges.twin[h] == HalfEdges::kNone;
  }
  return edges;
}

std::vector<uint32_t> HalfEdges::faces_of_vertex(uint32_t vertex) const {
  std::vector<uint32_t> faces;
  const uint32_t first = outgoing[vertex];
  // Counter-clockwise; from a border edge this meets all faces that hang together.
  for (uint32_t h = first; h != kNone;) {
    faces.push_back(face_of(h));
    h = twin[previous(h)];
    if (h == first) break;
  }
  return faces;
}

std::vector<uint32_t> HalfEdges::neighbours_of_vertex(uint32_t vertex) const {
  std::vector<uint32_t> vertices;
  const uint32_t first = outgoing[vertex];
  for (uint32_t h = first; h != kNone;) {
    vertices.push_back(end(h));
    const uint32_t last = previous(h);
    h = twin[last];
    if (h == kNone) vertices.push_back(start[last]);
    if (h == first) break;
  }
  return vertices;
}

glm::uvec3 HalfEdges::faces_of_face(uint32_t face) const {
  glm::uvec3 across;
  for (uint32_t k = 0; k < 3; ++k)
    across[static_cast<int>(k)] = twin[3 * face + k] == kNone ? kNone : face_of(twin[3 * face + k]);
  return across;
}

uint64_t HalfEdges::edges() const { return (start.size() - border) / 2 + border; }

std::vector<std::vector<uint32_t>> HalfEdges::border_loops() const {
  // A hole's loop runs against the half-edges of its border: from each one's end to its start.
  std::unordered_multimap<uint32_t, uint32_t> by_end;
  std::vector<uint32_t> open;
  for (uint32_t h = 0; h < start.size(); ++h) {
    if (twin[h] != kNone) continue;
    by_end.emplace(end(h), h);
    open.push_back(h);
  }
  std::vector<uint8_t> used(start.size());
  std::unordered_map<uint32_t, size_t> at;  // vertex -> its place in the path
  std::vector<std::vector<uint32_t>> loops;
  std::vector<uint32_t> path;
  for (const uint32_t first : open) {
    if (used[first]) continue;
    at.clear();
    path.assign(1, end(first));
    at[end(first)] = 0;
    for (uint32_t h = first;;) {
      used[h] = 1;
      const uint32_t v = start[h];
      if (const auto before = at.find(v); before != at.end()) {
        const size_t from = before->second;
        if (path.size() - from > 2) loops.emplace_back(path.begin() + static_cast<std::ptrdiff_t>(from), path.end());
        for (size_t i = from + 1; i < path.size(); ++i) at.erase(path[i]);
        path.resize(from + 1);
      } else {
        at[v] = path.size();
        path.push_back(v);
      }
      uint32_t on = kNone;
      for (auto [it, last] = by_end.equal_range(v); it != last; ++it) {
        if (!used[it->second] && (on == kNone || it->second < on)) on = it->second;
      }
      if (on == kNone) break;
      h = on;
    }
  }
  return loops;
}

TriangleMesh welded(const TriangleMesh& mesh) {
  struct PositionHash {
    size_t operator()(const Vec3f& p) const {
      const auto bits = [](float f) { return uint64_t{std::bit_cast<uint32_t>(f + 0.0f)}; };  // -0 is 0
      return hash_combine(hash_combine(bits(p.x), bits(p.y)), bits(p.z));
    }
  };
  TriangleMesh out;
  std::unordered_map<Vec3f, uint32_t, PositionHash> seen;
  std::vector<uint32_t> vertex(mesh.positions.size());
  for (size_t i = 0; i < mesh.positions.size(); ++i) {
    const auto [it, added] = seen.try_emplace(mesh.positions[i], static_cast<uint32_t>(out.positions.size()));
    if (added) out.positions.push_back(mesh.positions[i]);
    vertex[i] = it->second;
  }
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::uvec3 w(vertex[t.x], vertex[t.y], vertex[t.z]);
    if (has_area(w)) out.triangles.push_back(w);
  }
  return out;
}

uint64_t close_holes(TriangleMesh& mesh) {
  const HalfEdges edges = half_edges(mesh.triangles, mesh.positions.size());
  const std::vector<std::vector<uint32_t>> loops = edges.border_loops();
  for (const std::vector<uint32_t>& loop : loops) {
    if (loop.size() == 3) {
      mesh.triangles.emplace_back(loop[0], loop[1], loop[2]);
      continue;
    }
    Vec3d middle(0.0);
    for (const uint32_t v : loop) middle += Vec3d(mesh.positions[v]);
    const uint32_t centre = static_cast<uint32_t>(mesh.positions.size());
    mesh.positions.emplace_back(middle / static_cast<double>(loop.size()));
    for (size_t i = 0; i < loop.size(); ++i) mesh.triangles.emplace_back(centre, loop[i], loop[(i + 1) % loop.size()]);
  }
  return loops.size();
}

}  // namespace world
