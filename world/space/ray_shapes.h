/// Where rays meet spheres and triangles, and where the next ray may start: for luminaires, meshes and imports.
///
/// T is float or double. Points are relative to an origin the caller picks (a camera, a lamp), never to the world's:
/// subtract in WorldPoint first. Directions need no length of 1; t counts in lengths of the direction.
/// A box is in world/space/grid_walk.h (intersect_box), a voxel is the grid walk's own.
/// Error bounds hold while no product leaves T's normal range: for float, sizes and distances in 1e-12 .. 1e12.
/// std::fma is one rounding everywhere, with or without hardware for it, so results are the same bits on each machine.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "world/numbers/robust.h"

namespace world {

template <class T>
using Vec3 = glm::vec<3, T, glm::defaultp>;

/// n roundings, each of relative size at most u, change a value by at most this part of it.
/// source Nicholas Higham. Accuracy and Stability of Numerical Algorithms, 2nd edition. 2002, lemma 3.1
template <class T>
constexpr T rounding_bound(int n) {
  const T nu = static_cast<T>(n) * (std::numeric_limits<T>::epsilon() / 2);
  return nu / (1 - nu);
}

/// |v|^2 - r^2.
/// error  one rounding and 16 u^2 r^2, that is: the distance |v| - r is right to a few u^2 of r
/// source Ogita, Rump, Oishi. Accurate Sum and Dot Product. 2005, algorithm Dot2
template <class T>
T squared_length_minus(const Vec3<T>& v, T r) {
  T sum = v.x * v.x, rest = std::fma(v.x, v.x, -sum);
  const auto add_product = [&](T a, T b) {
    const T product = a * b, total = sum + product, part = total - sum;
    rest += std::fma(a, b, -product) + ((sum - (total - part)) + (product - part));
    sum = total;
  };
  add_product(v.y, v.y), add_product(v.z, v.z), add_product(-r, r);
  return sum + rest;
}

// --- sphere -------------------------------------------------------------------------------------------------------

/// The whole line's two meetings, t0 <= t1; those below zero lie behind the origin.
template <class T>
struct SphereHits {
  T t0, t1;
};

/// `origin` is relative to the sphere's centre. nullopt: the line misses, or a number is not finite.
/// error  t0 and t1: while the line passes within 0.99 radius of the centre, at most 6 ulp of the distance |origin|;
///        no such line is missed at up to 1e7 radii (float). From a height of h = 1e-6 radius above the surface, along
///        lines within 60 degrees of the vertical, t0 is right to 1e-6 of h (float). Near grazing, a few sqrt(u) of
///        the radius.
/// source Haines, Guenther, Akenine-Moeller. Precision Improvements for Ray/Sphere Intersection. 2019: the discriminant
///        from the perpendicular, and the root that does not cancel. Ours: the perpendicular is refined once, and
///        their factored c = (|o| - R)(|o| + R), which rounds |o| itself, is a compensated sum.
template <class T>
std::optional<SphereHits<T>> intersect_sphere(const Vec3<T>& origin, const Vec3<T>& direction, T radius) {
  const T a = dot(direction, direction), b = -dot(origin, direction);
  // The point of the line nearest to the centre. A second step takes back what b's rounding moved it along the line.
  const auto step = [&](const Vec3<T>& from, T k) {
    return Vec3<T>(std::fma(k, direction.x, from.x), std::fma(k, direction.y, from.y),
                   std::fma(k, direction.z, from.z));
  };
  Vec3<T> nearest = step(origin, b / a);
  nearest = step(nearest, -dot(nearest, direction) / a);
  const T nearest_distance = length(nearest);
  const T discriminant = (radius - nearest_distance) * (radius + nearest_distance);
  if (!(discriminant >= 0)) return std::nullopt;
  const T c = squared_length_minus(origin, radius), root = std::sqrt(a * discriminant);
  const T q = b < 0 ? b - root : b + root;
  const T near_or_far[2] = {q == 0 ? T{0} : c / q, q / a};
  const SphereHits<T> hits{std::min(near_or_far[0], near_or_far[1]), std::max(near_or_far[0], near_or_far[1])};
  if (!(std::isfinite(hits.t0) && std::isfinite(hits.t1))) return std::nullopt;
  return hits;
}

/// A point and how far from it, on each axis, the surface may be.
template <class T>
struct SurfacePoint {
  Vec3<T> point, error;
};

/// The meeting at t, put back onto the sphere; relative to its centre.
/// error  5 roundings of each coordinate, as given back
/// source Pharr, Jakob, Humphreys. Physically Based Rendering, 4th edition. 2023, section 6.8.5
template <class T>
SurfacePoint<T> point_on_sphere(const Vec3<T>& origin, const Vec3<T>& direction, T t, T radius) {
  const Vec3<T> on_line = origin + t * direction;
  const Vec3<T> point = on_line * (radius / length(on_line));
  return {point, rounding_bound<T>(5) * abs(point)};
}

// --- triangle -----------------------------------------------------------------------------------------------------

template <class T>
struct TriangleHit {
  T t;
  Vec3<T> barycentrics;        // weights of the corners a, b, c; each >= 0
  SurfacePoint<T> on_surface;  // error: 7 roundings of the weighted sum
};

namespace detail {

/// A bound on the error of t = (sum of edge[i] * z[i]) / determinant, for the sign of t; not on that of a large t.
/// x, y: the corners' largest coordinates across the ray, z: along its main axis.
template <class T>
T triangle_t_error(T x, T y, T z, T edge) {
  const T error_z = rounding_bound<T>(1) * z;
  const T error_x = rounding_bound<T>(5) * (x + 2 * z), error_y = rounding_bound<T>(5) * (y + 2 * z);
  const T error_edge = 2 * (rounding_bound<T>(2) * x * y + error_y * x + error_x * y);
  return 3 * (rounding_bound<T>(3) * edge * z + error_edge * z + error_z * edge);
}

}  // namespace detail

/// Both sides, borders included: a ray at an edge or corner that triangles share hits at least one of them.
/// nullopt: misses, t <= t's own error bound, t > t_max, the triangle has no area as seen, or a number is not finite.
/// error  that the ray passes inside: none in the sheared plane, whose corners all triangles of a mesh share bit by bit
///        (corners move by 5 roundings there). t: a hit behind the origin never comes out as one in front of it. The
///        point: on_surface.error.
/// source Woop, Benthin, Wald. Watertight Ray/Triangle Intersection. 2013; the bounds as Pharr, Jakob, Humphreys.
///        Physically Based Rendering, 4th edition. 2023, section 6.8, do. Ours: where an edge function is zero, an
///        exact sign by difference_of_products, so that double is watertight too.
template <class T>
std::optional<TriangleHit<T>> intersect_triangle(const Vec3<T>& origin, const Vec3<T>& direction, const Vec3<T>& a,
                                                 const Vec3<T>& b, const Vec3<T>& c,
                                                 T t_max = std::numeric_limits<T>::infinity()) {
  // Shear space so that the ray runs from zero along its main axis kz.
  const Vec3<T> size = abs(direction);
  const int kz = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
  const int kx = (kz + 1) % 3, ky = (kz + 2) % 3;
  if (!(size[kz] > 0)) return std::nullopt;
  const T shear_x = direction[kx] / direction[kz], shear_y = direction[ky] / direction[kz];
  const auto sheared = [&](const Vec3<T>& corner) {
    const Vec3<T> v = corner - origin;
    return Vec3<T>(v[kx] - shear_x * v[kz], v[ky] - shear_y * v[kz], v[kz]);
  };
  const Vec3<T> corner[3] = {sheared(a), sheared(b), sheared(c)};

  // Edge functions: their signs say on which side of each edge the ray passes. A difference of rounded products that
  // is not zero has the right sign.
  Vec3<T> edge;
  for (int i = 0; i < 3; ++i) {
    const Vec3<T>&from = corner[(i + 2) % 3], &to = corner[(i + 1) % 3];
    edge[i] = from.x * to.y - from.y * to.x;
  }
  if (edge.x == 0 || edge.y == 0 || edge.z == 0)
    for (int i = 0; i < 3; ++i) {
      const Vec3<T>&from = corner[(i + 2) % 3], &to = corner[(i + 1) % 3];
      edge[i] = difference_of_products(from.x, to.y, from.y, to.x);
    }
  if ((edge.x < 0 || edge.y < 0 || edge.z < 0) && (edge.x > 0 || edge.y > 0 || edge.z > 0)) return std::nullopt;
  const T determinant = edge.x + edge.y + edge.z;
  if (!(std::abs(determinant) > 0)) return std::nullopt;  // edge-on, or NaN

  const Vec3<T> z(corner[0].z, corner[1].z, corner[2].z);
  const T inverse = 1 / determinant;
  const T t = dot(edge, z) * inverse / direction[kz];
  if (!(t > 0 && t <= t_max)) return std::nullopt;
  // A triangle that lies all at about one depth can't hold the origin. Of others, believe only what error can't feign.
  const Vec3<T> depth = abs(z);
  const T farthest = std::max({depth.x, depth.y, depth.z});
  const bool at_one_depth =
      std::min({depth.x, depth.y, depth.z}) > farthest / 2 && (z.x > 0) == (z.y > 0) && (z.y > 0) == (z.z > 0);
  if (!at_one_depth) {
    const Vec3<T> largest = max(max(abs(corner[0]), abs(corner[1])), abs(corner[2])), edges = abs(edge);
    const T bound = detail::triangle_t_error(largest.x, largest.y, farthest, std::max({edges.x, edges.y, edges.z}));
    if (!(t > bound * std::abs(inverse / direction[kz]))) return std::nullopt;
  }

  TriangleHit<T> hit{t, edge * inverse, {}};
  const Vec3<T> parts[3] = {hit.barycentrics.x * a, hit.barycentrics.y * b, hit.barycentrics.z * c};
  hit.on_surface = {parts[0] + parts[1] + parts[2],
                    rounding_bound<T>(7) * (abs(parts[0]) + abs(parts[1]) + abs(parts[2]))};
  return hit;
}

/// The unit normal, counter-clockwise seen from its tip. nullopt: the triangle is degenerate (equal or collinear
/// corners, or one not finite): skip it when a mesh is built, and count it in that report.
/// error  u on each coordinate, and 2^-49 / sine of the angle between the two shorter edges: computed in double
template <class T>
std::optional<Vec3<T>> triangle_normal(const Vec3<T>& a, const Vec3<T>& b, const Vec3<T>& c) {
  using Wide = Vec3<double>;
  const Wide corner[3] = {Wide(a), Wide(b), Wide(c)};
  // The two shorter edges: between corners of very different sizes the longer two are equal but for rounding.
  Wide edge[3];
  double longest = 0;
  int opposite = 0;
  for (int i = 0; i < 3; ++i) {
    edge[i] = corner[(i + 2) % 3] - corner[(i + 1) % 3];
    const double size = std::max({std::abs(edge[i].x), std::abs(edge[i].y), std::abs(edge[i].z)});
    if (!std::isfinite(edge[i].x + edge[i].y + edge[i].z)) return std::nullopt;
    if (size > longest) longest = size, opposite = i;
  }
  if (longest == 0) return std::nullopt;
  int exponent;
  std::frexp(longest, &exponent);
  const auto scaled = [&](const Wide& v) {
    return Wide(std::ldexp(v.x, -exponent), std::ldexp(v.y, -exponent), std::ldexp(v.z, -exponent));
  };
  const Wide e = scaled(edge[(opposite + 1) % 3]), f = scaled(edge[(opposite + 2) % 3]);
  const Wide normal(difference_of_products(e.y, f.z, e.z, f.y), difference_of_products(e.z, f.x, e.x, f.z),
                    difference_of_products(e.x, f.y, e.y, f.x));
  const double largest = std::max({std::abs(normal.x), std::abs(normal.y), std::abs(normal.z)});
  if (!(largest > rounding_bound<double>(8) * length(e) * length(f))) return std::nullopt;
  return Vec3<T>(safe_normalize(normal));
}

// --- the next ray -------------------------------------------------------------------------------------------------

/// Where a ray that leaves a surface starts: moved along the normal until the whole box point +- error lies behind it.
///
/// normal     the surface's, unit length; on a curved surface, at the point
/// direction  of the new ray; picks the side, so it serves reflection, refraction and shadow rays
/// error      moves by |normal| . error and 1 ulp on each axis, no further
/// source     Pharr, Jakob, Humphreys. Physically Based Rendering, 4th edition. 2023, section 6.8.6
template <class T>
Vec3<T> offset_ray_origin(const SurfacePoint<T>& from, const Vec3<T>& normal, const Vec3<T>& direction) {
  constexpr T kInfinity = std::numeric_limits<T>::infinity();
  const T distance = dot(abs(normal), from.error) * (1 + rounding_bound<T>(8));
  const bool inward = dot(Vec3<double>(direction), Vec3<double>(normal)) < 0;
  Vec3<T> moved;
  for (int axis = 0; axis < 3; ++axis) {
    const T offset = (inward ? -distance : distance) * normal[axis];
    moved[axis] = from.point[axis] + offset;
    if (offset != 0) moved[axis] = std::nextafter(moved[axis], offset > 0 ? kInfinity : -kInfinity);
  }
  return moved;
}

}  // namespace world
