// Hard cases G1..G5 and G11: spheres, triangles, the start of the next ray, refraction where nothing refracts.
// G7 and G8 (faces) are in tests/render/extract/faces_test.cpp. Each case also runs the naive way, which must fail:
// else it would not be a hard case.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "render/bsdf/directions.shared.h"
#include "world/base/random.h"
#include "world/space/ray_shapes.h"

namespace world {
namespace {

constexpr double kPi = 3.14159265358979323846;

class Random {
 public:
  explicit Random(uint64_t seed) : seed_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * uniform01_double(random_bits(seed_, static_cast<int64_t>(++n_), 0, 0));
  }
  int below(int n) { return static_cast<int>(uniform(0, n)); }
  Vec3<double> direction() {
    const double z = uniform(-1, 1), phi = uniform(0, 2 * kPi), r = std::sqrt(1 - z * z);
    return {r * std::cos(phi), r * std::sin(phi), z};
  }
  /// Of either sign, 10^-most .. 10^most, evenly in the exponent.
  double magnitude(double most) { return std::pow(10, uniform(-most, most)) * (uniform(0, 1) < 0.5 ? -1 : 1); }
  Vec3<double> magnitudes(double most) { return {magnitude(most), magnitude(most), magnitude(most)}; }

 private:
  uint64_t seed_, n_ = 0;
};

/// Rounds to T, in fact: g++ 12 at -O2 drops the rounding from double to float and back where two coordinates are
/// converted side by side (its SLP vectorizer), so that the test would believe in other rays than it sent.
template <class T>
Vec3<T> rounded(const Vec3<double>& v) {
  volatile T x = static_cast<T>(v.x), y = static_cast<T>(v.y), z = static_cast<T>(v.z);
  return {x, y, z};
}

template <class T>
bool finite(const Vec3<T>& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// From outside the sphere, which lies ahead, in long double; the rays' own numbers taken as exact.
SphereHits<double> exact_hits(const Vec3<double>& o, const Vec3<double>& d, long double r) {
  const glm::vec<3, long double> origin(o), direction(d);
  const long double a = dot(direction, direction), k = -dot(origin, direction) / a;
  const glm::vec<3, long double> nearest = origin + k * direction;
  const long double distance = std::sqrt(dot(nearest, nearest));
  const long double c = (std::sqrt(dot(origin, origin)) - r) * (std::sqrt(dot(origin, origin)) + r);
  const long double q = k * a + std::sqrt(a * (r - distance) * (r + distance));
  return {static_cast<double>(c / q), static_cast<double>(q / a)};
}

TEST(HardCaseG1, FarSpheresAreNeverMissedAndTheErrorIsAtMost6UlpOfTheDistance) {
  Random random(1);
  for (int power = 1; power <= 7; ++power) {
    const double distance = std::pow(10, power);
    const double ulp = std::nextafter(static_cast<float>(distance), INFINITY) - static_cast<float>(distance);
    int misses = 0, naive_misses = 0;
    double worst = 0;
    const int rays = 30000;
    for (int i = 0; i < rays;) {
      const Vec3<float> o = rounded<float>(distance * random.direction());
      const Vec3<double> across = normalize(cross(Vec3<double>(o), random.direction()));
      const Vec3<float> d = rounded<float>(normalize(random.uniform(0, 0.99) * across - Vec3<double>(o)));
      // As rounded, the ray may pass elsewhere: only those count that do pass within 0.99 of the centre.
      const double passes = length(cross(Vec3<double>(o), Vec3<double>(d))) / length(Vec3<double>(d));
      if (passes > 0.99) continue;
      ++i;
      const auto hits = intersect_sphere(o, d, 1.0f);
      if (!hits) {
        ++misses;
      } else {
        const auto exact = exact_hits(Vec3<double>(o), Vec3<double>(d), 1);
        worst = std::max({worst, std::abs(hits->t0 - exact.t0) / ulp, std::abs(hits->t1 - exact.t1) / ulp});
      }
      const float a = dot(d, d), b = 2 * dot(o, d), c = dot(o, o) - 1;
      naive_misses += !(b * b - 4 * a * c >= 0);
    }
    printf("  G1 D=1e%d: worst error %.2f ulp, missed %d; naively missed %.1f %%\n", power, worst, misses,
           100.0 * naive_misses / rays);
    EXPECT_EQ(misses, 0) << distance;
    EXPECT_LE(worst, 6) << distance;
    if (power >= 4) {
      EXPECT_GT(naive_misses, rays / 20) << "the control found nothing";
    }
  }
}

TEST(HardCaseG2, JustAboveAHugeSphereTheErrorIsAtMost1e6thOfTheHeight) {
  const float radius = 1e4f, height = 9.765625e-3f;  // ten ulp of the radius
  const auto error_of = [&](float t, const Vec3<float>& o, const Vec3<float>& d) {
    const double exact = exact_hits(Vec3<double>(o), Vec3<double>(d), radius).t0;
    return std::abs(t - exact) / exact;
  };
  // Citardauq's root with c = o.o - R^2, and with c = (|o| - R)(|o| + R).
  const auto citardauq = [&](const Vec3<float>& o, const Vec3<float>& d, float c) {
    const float a = dot(d, d), b = -dot(o, d);
    const Vec3<float> nearest = o + b / a * d;
    return c / (b + std::sqrt(a * (radius * radius - dot(nearest, nearest))));
  };
  const auto factored = [&](const Vec3<float>& o) { return (length(o) - radius) * (length(o) + radius); };

  const Vec3<float> above(0, radius + height, 0), down(0, -1, 0);
  ASSERT_TRUE(intersect_sphere(above, down, radius));
  EXPECT_LE(error_of(intersect_sphere(above, down, radius)->t0, above, down), 1e-6);
  EXPECT_LE(error_of(citardauq(above, down, factored(above)), above, down), 1e-6);
  EXPECT_GT(error_of(citardauq(above, down, dot(above, above) - radius * radius), above, down), 0.01);

  // Anywhere else on the sphere |o| itself rounds, and factoring is not enough.
  Random random(2);
  double worst = 0, worst_factored = 0;
  int rays = 0;
  while (rays < 20000) {
    const Vec3<double> up = random.direction(), to = random.direction();
    if (dot(up, to) > -0.5) continue;
    const Vec3<float> o = rounded<float>((double{radius} + height) * up), d = rounded<float>(to);
    if (length(Vec3<double>(o)) < radius + 0.5 * height) continue;  // the point rounds too
    ++rays;
    const auto hits = intersect_sphere(o, d, radius);
    ASSERT_TRUE(hits);
    worst = std::max(worst, error_of(hits->t0, o, d));
    worst_factored = std::max(worst_factored, error_of(citardauq(o, d, factored(o)), o, d));
  }
  printf("  G2 anywhere: worst error %.2g of the height; factored c only %.2g\n", worst, worst_factored);
  EXPECT_LE(worst, 1e-6);
  EXPECT_GT(worst_factored, 0.01) << "the control found nothing";
}

struct Mesh {
  std::vector<Vec3<double>> corners;
  std::vector<std::array<int, 3>> triangles;
};

/// A closed surface around the ball of radius 0.5: an icosahedron split `splits` times, each corner pulled to a random
/// distance of 1 .. 3.
Mesh random_star(Random& random, int splits) {
  Mesh mesh;
  const double g = (1 + std::sqrt(5.0)) / 2;
  for (const double s : {-1.0, 1.0})
    for (const double t : {-g, g}) {
      mesh.corners.push_back(normalize(Vec3<double>(0, s, t)));
      mesh.corners.push_back(normalize(Vec3<double>(s, t, 0)));
      mesh.corners.push_back(normalize(Vec3<double>(t, 0, s)));
    }
  // The faces are the triples of corners one edge length apart.
  const auto joined = [&](int i, int j) {
    return std::abs(dot(mesh.corners[i], mesh.corners[j]) - 1 / std::sqrt(5.0)) < 1e-6;
  };
  for (int i = 0; i < 12; ++i)
    for (int j = i + 1; j < 12; ++j)
      for (int k = j + 1; k < 12; ++k)
        if (joined(i, j) && joined(j, k) && joined(i, k)) mesh.triangles.push_back({i, j, k});
  for (; splits > 0; --splits) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int i, int j) {
      const auto [at, added] = middles.try_emplace(std::minmax(i, j), static_cast<int>(mesh.corners.size()));
      if (added) mesh.corners.push_back(normalize(mesh.corners[i] + mesh.corners[j]));
      return at->second;
    };
    std::vector<std::array<int, 3>> split;
    for (const auto& [i, j, k] : mesh.triangles) {
      const int ij = middle(i, j), jk = middle(j, k), ki = middle(k, i);
      split.insert(split.end(), {{i, ij, ki}, {j, jk, ij}, {k, ki, jk}, {ij, jk, ki}});
    }
    mesh.triangles = split;
  }
  for (Vec3<double>& corner : mesh.corners) corner *= random.uniform(1, 3);
  return mesh;
}

/// Moeller and Trumbore's test, as often seen: borders decided by barycentrics that round differently on each side.
template <class T>
bool naive_hit(const Vec3<T>& o, const Vec3<T>& d, const Vec3<T>& a, const Vec3<T>& b, const Vec3<T>& c) {
  const Vec3<T> e = b - a, f = c - a, p = cross(d, f), s = o - a, q = cross(s, e);
  const T inverse = 1 / dot(e, p), u = dot(s, p) * inverse, v = dot(d, q) * inverse;
  return u >= 0 && v >= 0 && u + v <= 1 && dot(f, q) * inverse > 0;
}

/// Rays that leave a closed mesh without a hit, and without one by the naive test.
template <class T>
std::pair<int, int> leaks(uint64_t seed, int meshes, int rays_each) {
  Random random(seed);
  int leaked = 0, naively = 0;
  for (int m = 0; m < meshes; ++m) {
    const Mesh mesh = random_star(random, 1);
    std::vector<Vec3<T>> corners;
    for (const Vec3<double>& corner : mesh.corners) corners.push_back(rounded<T>(corner));
    for (int i = 0; i < rays_each; ++i) {
      const Vec3<T> origin = rounded<T>(random.uniform(0, 0.5) * random.direction());
      const auto& [j, k, unused] = mesh.triangles[random.below(static_cast<int>(mesh.triangles.size()))];
      Vec3<T> direction = rounded<T>(random.direction());
      if (i % 3 == 1) direction = corners[j] - origin;
      if (i % 3 == 2) direction = (corners[j] + corners[k]) / T{2} - origin;
      int hits = 0, naive_hits = 0;
      for (const auto& [a, b, c] : mesh.triangles) {
        hits += intersect_triangle(origin, direction, corners[a], corners[b], corners[c]).has_value();
        naive_hits += naive_hit(origin, direction, corners[a], corners[b], corners[c]);
      }
      leaked += hits == 0;
      naively += naive_hits == 0;
    }
  }
  return {leaked, naively};
}

TEST(HardCaseG3, NoRayLeavesAClosedMeshAtFacesCornersOrEdges) {
  const auto [leaked, naively] = leaks<float>(3, 100, 1000);
  const auto [leaked_double, naively_double] = leaks<double>(4, 20, 1000);
  printf("  G3 leaks: float %d, double %d; naively %d, %d\n", leaked, leaked_double, naively, naively_double);
  EXPECT_EQ(leaked, 0);
  EXPECT_EQ(leaked_double, 0);
  EXPECT_GT(naively, 0) << "the control found nothing";
  EXPECT_GT(naively_double, 0) << "the control found nothing";
}

/// Two triangles that share an edge which passes the ray at about epsilon^2, less than the products' rounding.
template <class T>
void expect_one_neighbour_is_hit() {
  const T epsilon = std::numeric_limits<T>::epsilon();
  const Vec3<T> from(1 + epsilon, 1, 1), to(-(1 + 2 * epsilon), -(1 + epsilon), 1), origin(0), direction(0, 0, 1);
  ASSERT_EQ(from.x * to.y - from.y * to.x, 0) << "the control: rounded products see no side";
  // from x to is -epsilon^2: seen along the edge, towards (-1, -1), the ray passes on the right, where (-1, 1) is.
  EXPECT_TRUE(intersect_triangle<T>(origin, direction, from, to, {-1, 1, 1}));
  EXPECT_FALSE(intersect_triangle<T>(origin, direction, from, to, {1, -1, 1}));
}

TEST(RayShapes, WhereRoundedProductsSeeNoSideOfAnEdgeOnlyTheTrianglePassedIsHit) {
  expect_one_neighbour_is_hit<float>();
  expect_one_neighbour_is_hit<double>();
}

TEST(RayShapes, TinyAndFarTrianglesAreHitWithinTheErrorOfTheirDistance) {
  // Across a ten-millionth of the distance; a bound on t's error alone would refuse such a hit.
  const Vec3<float> a(-1e-6f, -1e-6f, 0), b(1e-6f, -1e-6f, 1e-6f), c(0, 1e-6f, -1e-6f);
  const Vec3<float> origin(3, 2, 10);
  const auto hit = intersect_triangle<float>(origin, -origin, a, b, c);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->t, 1, 4 * 0x1p-24);
  EXPECT_FALSE(intersect_triangle<float>(origin, origin, a, b, c)) << "behind";
  EXPECT_FALSE(intersect_triangle<float>(origin, -origin, a, b, c, 0.99f)) << "beyond t_max";
}

/// The normal in long double, by the two shorter edges, and the sine between those.
struct ExactNormal {
  glm::vec<3, long double> normal;
  double sine;
};
template <class T>
ExactNormal exact_normal(const Vec3<T>& a, const Vec3<T>& b, const Vec3<T>& c) {
  using Wide = glm::vec<3, long double>;
  Wide edges[3] = {Wide(b) - Wide(a), Wide(c) - Wide(b), Wide(a) - Wide(c)};
  while (length(edges[2]) < std::max(length(edges[0]), length(edges[1]))) std::rotate(edges, edges + 1, edges + 3);
  const Wide n = cross(edges[0], edges[1]);
  return {n / length(n), static_cast<double>(length(n) / length(edges[0]) / length(edges[1]))};
}

struct SelfHits {
  int rays = 0, offset = 0, not_offset = 0, other_side = 0;
};

/// Rays that leave a point of a triangle and hit that triangle again.
template <class T>
SelfHits triangle_self_hits(uint64_t seed, int triangles, int rays_each) {
  Random random(seed);
  SelfHits count;
  for (int i = 0; i < triangles;) {
    // By turns: corners of unlike sizes, and a small triangle far away.
    Vec3<T> corners[3];
    const Vec3<double> base = i % 2 ? random.magnitudes(8) : Vec3<double>(0);
    const double size = i % 2 ? length(base) * std::pow(10, random.uniform(-5, 0)) : 0;
    for (Vec3<T>& corner : corners)
      corner = rounded<T>(i % 2 ? base + size * random.direction() : random.magnitudes(8));
    const auto& [a, b, c] = corners;
    const auto normal = triangle_normal(a, b, c);
    if (!normal) continue;
    // A ray through a point of the triangle from somewhere; it must hit as often as rounding lets it.
    const T share_b(random.uniform(0, 1)), share_c(random.uniform(0, 1 - share_b));
    const Vec3<T> target = a + share_b * (b - a) + share_c * (c - a);
    const Vec3<T> origin = target + rounded<T>(random.magnitudes(8));
    const auto hit = intersect_triangle<T>(origin, target - origin, a, b, c);
    if (!hit) continue;
    ++i;
    // The bounds the header states: of the normal, and of the point's distance from the plane.
    const auto [exact, sine] = exact_normal(a, b, c);
    const double u = std::numeric_limits<T>::epsilon() / 2, most = u + 0x1p-49 / sine;
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_LE(std::abs(static_cast<double>((*normal)[axis] - exact[axis])), most) << "sine " << sine;
    if (sine > 1e-4) {  // long double knows the plane of others no better
      using Wide = glm::vec<3, long double>;
      const long double off = dot(exact, Wide(hit->on_surface.point) - Wide(a));
      EXPECT_LE(std::abs(off), dot(abs(exact), Wide(hit->on_surface.error)));
    }
    for (int r = 0; r < rays_each; ++r) {
      const Vec3<T> out = rounded<T>(random.direction());
      const Vec3<T> moved = offset_ray_origin(hit->on_surface, *normal, out);
      ++count.rays;
      count.offset += intersect_triangle(moved, out, a, b, c).has_value();
      count.not_offset += intersect_triangle(hit->on_surface.point, out, a, b, c).has_value();
    }
  }
  return count;
}

/// The same for spheres. Rays that go inward must hit the far side, once.
template <class T>
SelfHits sphere_self_hits(uint64_t seed, int spheres, int rays_each) {
  Random random(seed);
  SelfHits count;
  for (int i = 0; i < spheres;) {
    const T radius(std::abs(random.magnitude(8)));
    const Vec3<T> origin = rounded<T>(random.magnitudes(8));
    const Vec3<T> direction = radius * rounded<T>(random.direction()) - origin;
    const auto hits = intersect_sphere(origin, direction, radius);
    if (!hits || hits->t1 <= 0) continue;
    ++i;
    const auto on_surface = point_on_sphere(origin, direction, hits->t0 > 0 ? hits->t0 : hits->t1, radius);
    const Vec3<T> normal = normalize(on_surface.point);
    for (int r = 0; r < rays_each; ++r) {
      const Vec3<T> out = rounded<T>(random.direction());
      const bool inward = dot(Vec3<double>(out), Vec3<double>(normal)) < 0;
      const auto again = intersect_sphere(offset_ray_origin(on_surface, normal, out), out, radius);
      const auto naive = intersect_sphere(on_surface.point, out, radius);
      ++count.rays;
      count.offset += again && again->t0 > 0;
      count.not_offset += naive && naive->t0 > 0;
      if (inward) count.other_side += again && again->t1 > 0;
      if (!inward) count.other_side += !(again && again->t1 > 0);
    }
  }
  return count;
}

TEST(HardCaseG4, ASpawnedRayNeverHitsItsOwnSurface) {
  const auto expect_none = [](const char* name, const SelfHits& count) {
    printf("  G4 %s: %d rays, %d self hits; without offset %d\n", name, count.rays, count.offset, count.not_offset);
    EXPECT_EQ(count.offset, 0) << name;
    EXPECT_GT(count.not_offset, 0) << name << ": the control found nothing";
  };
  expect_none("triangles, float", triangle_self_hits<float>(5, 4000, 100));
  expect_none("triangles, double", triangle_self_hits<double>(6, 1000, 100));
  const SelfHits spheres = sphere_self_hits<float>(7, 4000, 100), wide = sphere_self_hits<double>(8, 1000, 100);
  expect_none("spheres, float", spheres);
  expect_none("spheres, double", wide);
  EXPECT_EQ(spheres.other_side, spheres.rays) << "inward rays hit the far side, outward ones nothing";
  EXPECT_EQ(wide.other_side, wide.rays);
}

template <class T>
void expect_degenerate_triangles_are_skipped(uint64_t seed) {
  Random random(seed);
  const T bad_numbers[] = {std::numeric_limits<T>::quiet_NaN(), std::numeric_limits<T>::infinity(),
                           -std::numeric_limits<T>::infinity()};
  int skipped = 0, made = 0, nearly_hit = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3<T> whole(random.below(1000), random.below(1000), random.below(1000));
    const Vec3<T> step(random.below(100) - 50, random.below(100) - 50, random.below(100) - 50);
    const Vec3<T> aside = rounded<T>(random.magnitudes(3));
    std::array<Vec3<T>, 3> corners{whole, whole, whole};                                     // equal
    if (i % 5 == 1) corners = {whole, aside, whole};                                         // two equal
    if (i % 5 == 2) corners = {whole, whole + step, whole + T(random.below(9) + 2) * step};  // collinear, exactly
    if (i % 5 == 3) corners = {whole, whole + step, aside}, corners[i % 3][i / 5 % 3] = bad_numbers[i % 7 % 3];
    // Collinear but for rounding: has an area, if a wild one.
    if (i % 5 == 4) corners = {aside, aside + T(0.3) * Vec3<T>(step), aside + T(0.7) * Vec3<T>(step)};
    const auto& [a, b, c] = corners;
    const auto normal = triangle_normal(a, b, c);
    if (i % 5 != 4) ++made, skipped += !normal;
    if (normal) {
      EXPECT_TRUE(finite(*normal)) << i;
      EXPECT_NEAR(length(*normal), 1, 1e-6) << i;
    }
    // Whoever did not skip it still gets no NaN.
    for (int r = 0; r < 5; ++r) {
      const Vec3<T> origin = r == 0 ? a : rounded<T>(random.magnitudes(3));
      const Vec3<T> direction = r < 3 ? (a + b) / T{2} - origin : rounded<T>(random.direction());
      const auto hit = intersect_triangle(origin, direction, a, b, c);
      if (!hit) continue;
      EXPECT_TRUE(i % 5 == 4 || i % 5 == 2) << "hit a triangle of kind " << i % 5;
      ++nearly_hit;
      EXPECT_TRUE(std::isfinite(hit->t) && finite(hit->barycentrics) && finite(hit->on_surface.point) &&
                  finite(hit->on_surface.error));
    }
  }
  EXPECT_EQ(skipped, made);
  EXPECT_GT(nearly_hit, 0) << "no ray met a sliver: the test of finite hits says nothing";
}

TEST(HardCaseG5, DegenerateTrianglesAreSkippedAndNothingIsNan) {
  expect_degenerate_triangles_are_skipped<float>(9);
  expect_degenerate_triangles_are_skipped<double>(10);

  // A quad with two equal corners keeps the triangle that has an area; slim ones count as triangles.
  const Vec3<float> quad[4] = {{0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  EXPECT_FALSE(triangle_normal(quad[0], quad[1], quad[2]));
  EXPECT_EQ(triangle_normal(quad[0], quad[2], quad[3]), Vec3<float>(0, 0, 1));
  EXPECT_EQ(triangle_normal<float>({0, 0, 0}, {1e8f, 0, 0}, {1e8f, 0, -1e-8f}), Vec3<float>(0, 1, 0));
  EXPECT_EQ(triangle_normal<float>({0, 0, 0}, {1e-20f, 0, 0}, {0, 1e-20f, 0}), Vec3<float>(0, 0, 1));

  // Rays that are no rays.
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const Vec3<float>& direction : {Vec3<float>(0), Vec3<float>(nan, 0, 1), Vec3<float>(0, 0, nan)}) {
    EXPECT_FALSE(intersect_triangle<float>({0.1f, 0.1f, -1}, direction, quad[0], quad[1], quad[3]));
    EXPECT_FALSE(intersect_sphere<float>({0, 0, -2}, direction, 1));
  }
  EXPECT_TRUE(intersect_triangle<float>({0.1f, 0.1f, -1}, {0, 0, 1}, quad[0], quad[1], quad[3]));
}

TEST(HardCaseG11, AtEta1TheRefractedDirectionIsTheIncomingOneWithin2Ulp) {
  using glm::vec3;
  const auto ulps = [](float a, float b) {
    return std::abs(static_cast<double>(std::bit_cast<int32_t>(a)) - std::bit_cast<int32_t>(b));
  };
  Random random(11);
  double worst = 0, worst_textbook = 0, worst_length = 0;
  for (int i = 0; i < 100000; ++i) {
    const vec3 wi = rounded<float>(random.direction());
    vec3 n = rounded<float>(random.direction());
    if (i % 2)
      n = rounded<float>(normalize(cross(Vec3<double>(wi), Vec3<double>(n)) +  // grazing
                                   std::pow(10, random.uniform(-8, 0)) * Vec3<double>(wi)));
    if (dot(n, wi) < 0) n = -n;
    const vec3 wo = render::shared::refracted_direction(wi, n, 1);
    const float cos_i = dot(n, wi), cos_t = std::sqrt(std::max(0.0f, 1 - (1 - cos_i * cos_i)));
    const vec3 textbook = (cos_i - cos_t) * n - wi;
    for (int axis = 0; axis < 3; ++axis) {
      worst = std::max(worst, ulps(wo[axis], -wi[axis]));
      worst_textbook = std::max(worst_textbook, ulps(textbook[axis], -wi[axis]));
    }
    // Elsewhere: of length 1, by Snell's law, and back again.
    const float eta = static_cast<float>(random.uniform(0.5, 2));
    const vec3 through = render::shared::refracted_direction(wi, n, eta);
    const double sin_i = length(cross(Vec3<double>(wi), Vec3<double>(n)));
    if (through == vec3(0)) {
      EXPECT_GE(sin_i, eta * (1 - 1e-6));
    } else {
      EXPECT_LT(dot(through, n), 1e-7);
      EXPECT_NEAR(length(cross(Vec3<double>(through), Vec3<double>(n))), sin_i / eta, 0x1p-22 / eta);
      worst_length = std::max(worst_length, std::abs(length(Vec3<double>(through)) - 1));
    }
    const vec3 mirrored = render::shared::reflected_direction(wi, n);
    EXPECT_NEAR(dot(mirrored, n), dot(wi, n), 3e-7);
    worst_length = std::max(worst_length, std::abs(length(Vec3<double>(mirrored)) - 1));
  }
  printf("  G11: worst %.0f ulp, textbook %.2g ulp; length off by %.2g\n", worst, worst_textbook, worst_length);
  EXPECT_LE(worst, 2);
  EXPECT_LE(worst_length, 3 * 0x1p-24);
  EXPECT_GT(worst_textbook, 1000) << "the control found nothing";
}

}  // namespace
}  // namespace world
