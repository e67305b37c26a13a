/// The knobs of pictures, each declared once in render/knobs.def. Passed to what needs them, never global.
#pragma once

#include <array>
#include <string_view>

#include "world/base/knobs.h"
#include "world/store/light_volume.h"

namespace render {

enum class SunShadow { none, sky_light, map, ray };
enum class LightInterpolation { face, vertex, linear };  // in the order of shared::kLight...
using world::LightModel;
enum class ProxyShapes { cube, billboard, mesh };
enum class LiquidSurface { full, level };
constexpr auto knob_choices(LiquidSurface) { return std::array<std::string_view, 2>{"full", "level"}; }
enum class FaceEdges { hardware, exact };
enum class ContourShape { off, planes, field };  // in the order of world::ContourShape
enum class DepthFormat { d16, d24, d32 };
constexpr auto knob_choices(DepthFormat) { return std::array<std::string_view, 3>{"d16", "d24", "d32"}; }
enum class ContourMesh { blocks, surface_nets, marching_cubes, marching_tetrahedra, openvdb };  // as SurfaceMethod
enum class LightTransport { direct, ambient_occlusion, whitted, path, photons };
enum class SampleSequence { random, sobol };
enum class DensityTracking { delta, exact };
enum class FogLight { none, unhidden };
enum class GlossLobe { exact, published, fresnel };  // in the order of shared::kGloss...
enum class LuminaireShadow { none, map, ray };       // in the order of raster::kLuminaireShadow...
enum class DirectGloss { matte, lobe };
enum class TextureFilter { off, point, mip, exact };  // in the order of shared::kTexture...
constexpr auto knob_choices(LuminaireShadow) { return std::array<std::string_view, 3>{"none", "map", "ray"}; }
constexpr auto knob_choices(DirectGloss) { return std::array<std::string_view, 2>{"matte", "lobe"}; }
constexpr auto knob_choices(TextureFilter) { return std::array<std::string_view, 4>{"off", "point", "mip", "exact"}; }
enum class Transparency { opaque, sorted, weighted, lists };
enum class CoveragePattern { exact, hashed, correlated };  // in the order of shared::kCoverage...
constexpr auto knob_choices(SunShadow) { return std::array<std::string_view, 4>{"none", "sky_light", "map", "ray"}; }
constexpr auto knob_choices(LightInterpolation) { return std::array<std::string_view, 3>{"face", "vertex", "linear"}; }
constexpr auto knob_choices(FaceEdges) { return std::array<std::string_view, 2>{"hardware", "exact"}; }
constexpr auto knob_choices(ProxyShapes) { return std::array<std::string_view, 3>{"cube", "billboard", "mesh"}; }
constexpr auto knob_choices(LightTransport) {
  return std::array<std::string_view, 5>{"direct", "ambient_occlusion", "whitted", "path", "photons"};
}
constexpr auto knob_choices(SampleSequence) { return std::array<std::string_view, 2>{"random", "sobol"}; }
constexpr auto knob_choices(DensityTracking) { return std::array<std::string_view, 2>{"delta", "exact"}; }
constexpr auto knob_choices(FogLight) { return std::array<std::string_view, 2>{"none", "unhidden"}; }
constexpr auto knob_choices(GlossLobe) { return std::array<std::string_view, 3>{"exact", "published", "fresnel"}; }
enum class Refraction { none, screen, traced };          // in the order of kRefraction...
enum class Reflection { none, screen, planar, traced };  // in the order of kReflection...
constexpr auto knob_choices(Refraction) { return std::array<std::string_view, 3>{"none", "screen", "traced"}; }
constexpr auto knob_choices(Reflection) {
  return std::array<std::string_view, 4>{"none", "screen", "planar", "traced"};
}
constexpr auto knob_choices(Transparency) {
  return std::array<std::string_view, 4>{"opaque", "sorted", "weighted", "lists"};
}
constexpr auto knob_choices(CoveragePattern) {
  return std::array<std::string_view, 3>{"exact", "hashed", "correlated"};
}
constexpr auto knob_choices(ContourMesh) {
  return std::array<std::string_view, 5>{"blocks", "surface_nets", "marching_cubes", "marching_tetrahedra", "openvdb"};
}
constexpr auto knob_choices(ContourShape) { return std::array<std::string_view, 3>{"off", "planes", "field"}; }

enum class ExposureMode { fixed, log_mean, histogram };
enum class ToneMap { clamp, reinhard, filmic };  // in the order of shared::kTone...
constexpr auto knob_choices(ExposureMode) { return std::array<std::string_view, 3>{"fixed", "log_mean", "histogram"}; }
constexpr auto knob_choices(ToneMap) { return std::array<std::string_view, 3>{"clamp", "reinhard", "filmic"}; }

enum class ColourFormat { float32, half, r11g11b10, float7e3, rgb9e5, rgba8, rgb565 };  // as shared::kFormat...
enum class AntiAliasing { none, x2, x4, x8, temporal };
constexpr auto knob_choices(ColourFormat) {
  return std::array<std::string_view, 7>{"float32", "half", "r11g11b10", "float7e3", "rgb9e5", "rgba8", "rgb565"};
}
constexpr auto knob_choices(AntiAliasing) {
  return std::array<std::string_view, 5>{"none", "x2", "x4", "x8", "temporal"};
}

struct RenderKnobs {
#define KNOB(name, type, fast, usual, exact, unit, what) type name = usual;
#include "render/knobs.def"
#undef KNOB
};

/// One row for each knob, in order of declaration.
const world::KnobTable<RenderKnobs>& render_knobs();

}  // namespace render
