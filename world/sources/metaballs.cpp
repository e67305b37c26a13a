// Blobs: where a sum of Gaussians, sign * exp(blobbiness * (1 - r^2 / radius^2)), is at least a threshold.
//
//   kind = "metaballs"
//   threshold = 1
//   [[source.ball]]
//   position = [x, y, z]       in the source's space, m
//   radius                     m: at threshold 1, that of the ball where it is alone
//   blobbiness = 2             the lower, the further it reaches out to others
//   sign = 1                   -1 dents
//
// The bounds of each term over a box are exact, from the least and greatest distance to its centre.
// source James Blinn. A Generalization of Algebraic Surface Drawing. 1982
#include <algorithm>
#include <cmath>

#include "world/numbers/interval.h"
#include "world/sources/source.h"

namespace world {
namespace {

struct Ball {
  Vec3d centre;
  double factor = 1;   // of the threshold; negative in dents
  double falloff = 1;  // 1/m^2
};

class Metaballs final : public Shape {
 public:
  std::vector<Ball> balls;

  /// Sum over the threshold: at least 1 inside.
  bool contains(const Vec3d& p) const override {
    double sum = 0;
    for (const Ball& b : balls) {
      const Vec3d d = p - b.centre;
      sum += b.factor * std::exp(-b.falloff * glm::dot(d, d));
    }
    return sum >= 1;
  }
  Cover classify(const ShapeBox& box) const override {
    Interval sum(0);
    for (const Ball& b : balls) {
      const Interval d2 = square(Interval(box.min.x, box.max.x) - b.centre.x) +
                          square(Interval(box.min.y, box.max.y) - b.centre.y) +
                          square(Interval(box.min.z, box.max.z) - b.centre.z);
      sum = sum + b.factor * exponential(-(b.falloff * d2));
    }
    return sum.hi < 1 ? Cover::outside : sum.lo >= 1 ? Cover::inside : Cover::mixed;
  }
  ShapeBox bounds() const override {
    // Where the sum reaches 1, one of n terms reaches 1/n.
    const double n = static_cast<double>(balls.size());
    ShapeBox box;
    for (const Ball& b : balls) {
      if (!(b.factor * n >= 1)) continue;
      const double reach = std::sqrt(std::log(b.factor * n) / b.falloff) * (1 + 1e-12);
      box.include(b.centre - reach), box.include(b.centre + reach);
    }
    return box;
  }
};

std::shared_ptr<const Shape> read_metaballs(TomlTable& table, const SourceContext&) {
  const auto blobs = std::make_shared<Metaballs>();
  double threshold = 1;
  table.read("threshold", threshold, {.min = 0, .max = 1e6, .open_min = true});
  for (TomlTable row : table.array_of_tables("ball")) {
    double position[3] = {0, 0, 0}, radius = 1, blobbiness = 2;
    int32_t sign = 1;
    row.require("position", std::span<double>(position), NumberRange{-1e9, 1e9});
    row.require("radius", radius, NumberRange{.min = 0, .max = 1e9, .open_min = true});
    row.read("blobbiness", blobbiness, {.min = 0, .max = 100, .open_min = true});
    row.read("sign", sign, {-1, 1});
    if (sign == 0) row.fail("sign", "'sign' must be 1 or -1");
    blobs->balls.push_back({{position[0], position[1], position[2]},
                            sign * std::exp(blobbiness) / threshold,
                            blobbiness / (radius * radius)});
  }
  if (blobs->balls.empty()) table.fail({}, "metaballs need at least one [[source.ball]]");
  return blobs;
}

}  // namespace

SourceKind metaballs_source() {
  return {.name = "metaballs", .what = "where a sum of Gaussians is large", .read = read_metaballs};
}

}  // namespace world
