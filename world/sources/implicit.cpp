// Solids given by a function f(p) that is at most 0 inside. Each is written once, for numbers and for intervals, so the
// descent knows of a whole box whether f changes its sign in it.
//
//   kind = "implicit"
//   surface = "plane"                              y <= 0; no end: needs min and max
//             "sphere"    radius
//             "box"       size = [x, y, z]         around the origin
//             "cylinder"  radius, height           around the y axis, from y = 0
//             "cone"      radius, height, top_radius = 0      a frustum where top_radius > 0; from y = 0
//             "torus"     radius, tube_radius      around the y axis
//             "quadric"   coefficients = [a, b, c, d, e, f, g, h, i, j]
//                         a x^2 + b y^2 + c z^2 + d xy + e yz + f zx + g x + h y + i z + j <= 0; needs min and max
//
// source John Snyder. Interval Analysis for Computer Graphics. 1992
#include <array>

#include "world/numbers/interval.h"
#include "world/sources/source.h"

namespace world {
namespace {

/// F is a generic function of (x, y, z), called with doubles and with Intervals.
template <class F>
class ImplicitShape final : public Shape {
 public:
  ImplicitShape(F f, const ShapeBox& bounds) : f_(f), bounds_(bounds) {}
  ShapeBox bounds() const override { return bounds_; }
  Cover classify(const ShapeBox& box) const override {
    const Interval v =
        f_(Interval(box.min.x, box.max.x), Interval(box.min.y, box.max.y), Interval(box.min.z, box.max.z));
    return v.lo > 0 ? Cover::outside : v.hi <= 0 ? Cover::inside : Cover::mixed;
  }
  bool contains(const Vec3d& p) const override { return f_(p.x, p.y, p.z) <= 0; }

 private:
  F f_;
  ShapeBox bounds_;
};

template <class F>
std::shared_ptr<const Shape> implicit(F f, Vec3d min, Vec3d max) {
  return std::make_shared<ImplicitShape<F>>(f, ShapeBox{min, max});
}
template <class F>
std::shared_ptr<const Shape> endless(F f) {
  return std::make_shared<ImplicitShape<F>>(f, ShapeBox::everything());
}

constexpr NumberRange kLength{.min = 0, .max = 1e9, .open_min = true};

std::shared_ptr<const Shape> read_plane(TomlTable&) {
  return endless([](auto, auto y, auto) { return y; });
}

std::shared_ptr<const Shape> read_sphere(TomlTable& table) {
  double r = 1;
  table.require("radius", r, kLength);
  return implicit([r](auto x, auto y, auto z) { return square(x) + square(y) + square(z) - square(r); }, Vec3d(-r),
                  Vec3d(r));
}

std::shared_ptr<const Shape> read_box(TomlTable& table) {
  std::array<double, 3> size{1, 1, 1};
  table.require("size", std::span<double>(size), kLength);
  const Vec3d h = 0.5 * Vec3d(size[0], size[1], size[2]);
  return implicit(
      [h](auto x, auto y, auto z) { return maximum(absolute(x) - h.x, maximum(absolute(y) - h.y, absolute(z) - h.z)); },
      -h, h);
}

std::shared_ptr<const Shape> read_cylinder(TomlTable& table) {
  double r = 1, height = 1;
  table.require("radius", r, kLength);
  table.require("height", height, kLength);
  return implicit(
      [r, height](auto x, auto y, auto z) {
        return maximum(square_root(square(x) + square(z)) - r, maximum(-y, y - height));
      },
      {-r, 0, -r}, {r, height, r});
}

std::shared_ptr<const Shape> read_cone(TomlTable& table) {
  double r = 1, height = 1, top = 0;
  table.require("radius", r, kLength);
  table.require("height", height, kLength);
  table.read("top_radius", top, {.min = 0, .max = 1e9});
  const double slope = (r - top) / height, widest = std::max(r, top);
  return implicit(
      [r, height, slope](auto x, auto y, auto z) {
        return maximum(square_root(square(x) + square(z)) + y * slope - r, maximum(-y, y - height));
      },
      {-widest, 0, -widest}, {widest, height, widest});
}

std::shared_ptr<const Shape> read_torus(TomlTable& table) {
  double r = 2, tube = 1;
  table.require("radius", r, kLength);
  table.require("tube_radius", tube, kLength);
  return implicit(
      [r, tube](auto x, auto y, auto z) {
        return square(square_root(square(x) + square(z)) - r) + square(y) - square(tube);
      },
      {-r - tube, -tube, -r - tube}, {r + tube, tube, r + tube});
}

std::shared_ptr<const Shape> read_quadric(TomlTable& table) {
  std::array<double, 10> k{};
  table.require("coefficients", std::span<double>(k), NumberRange{-1e12, 1e12});
  return endless([k](auto x, auto y, auto z) {
    return k[0] * square(x) + k[1] * square(y) + k[2] * square(z) + k[3] * x * y + k[4] * y * z + k[5] * z * x +
           k[6] * x + k[7] * y + k[8] * z + k[9];
  });
}

}  // namespace

SourceKind implicit_source() {
  return {.name = "implicit",
          .what = "plane, sphere, box, cylinder, cone, torus, quadric",
          .read = [](TomlTable& table, const SourceContext&) -> std::shared_ptr<const Shape> {
            constexpr std::array<std::string_view, 7> kSurfaces{"plane", "sphere", "box",    "cylinder",
                                                                "cone",  "torus",  "quadric"};
            constexpr std::shared_ptr<const Shape> (*kReaders[])(TomlTable&) = {
                read_plane, read_sphere, read_box, read_cylinder, read_cone, read_torus, read_quadric};
            int surface = 0;
            if (!table.has("surface")) table.fail({}, "an implicit source needs surface = \"sphere\" or another one");
            return table.read_choice("surface", surface, kSurfaces) ? kReaders[surface](table) : nullptr;
          }};
}

}  // namespace world
