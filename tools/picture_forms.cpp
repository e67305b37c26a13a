#include "tools/picture_forms.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include "render/effects/chain.h"
#include "render/image/framebuffer.h"
#include "render/image/rows.h"
#include "render/trace/layers.h"
#include "world/base/random.h"

namespace tools {

using render::Image;
using world::Vec3d;

std::optional<CameraPath> CameraPath::of(const world::World& world, const std::string& name) {
  CameraPath path;
  for (const world::CameraPlacement& camera : world.cameras) {
    if (!camera.name.starts_with(name + "@")) continue;
    const char *first = camera.name.data() + name.size() + 1, *last = camera.name.data() + camera.name.size();
    int frame = 0;
    if (const auto [end, error] = std::from_chars(first, last, frame); error == std::errc{} && end == last)
      path.keys_.push_back({frame, camera});
  }
  std::stable_sort(path.keys_.begin(), path.keys_.end(), [](const Key& a, const Key& b) { return a.frame < b.frame; });
  path.keys_.erase(
      std::unique(path.keys_.begin(), path.keys_.end(), [](const Key& a, const Key& b) { return a.frame == b.frame; }),
      path.keys_.end());
  if (path.keys_.size() < 2) return std::nullopt;
  return path;
}

render::Camera CameraPath::at(double frame) const {
  frame = std::clamp<double>(frame, first_frame(), last_frame());
  size_t i = 0;
  while (i + 2 < keys_.size() && keys_[i + 1].frame <= frame) ++i;
  const world::WorldPoint base = keys_[i].camera.position;
  // Hermite's cubic between keys i and i + 1.
  const double span = keys_[i + 1].frame - keys_[i].frame, t = (frame - keys_[i].frame) / span;
  const double h01 = t * t * (3 - 2 * t), h10 = t * (1 - t) * (1 - t), h11 = t * t * (t - 1);
  const auto smooth = [&](auto value) {
    const auto slope = [&](size_t k) {
      const size_t before = k == 0 ? 0 : k - 1, after = std::min(k + 1, keys_.size() - 1);
      return (value(keys_[after]) - value(keys_[before])) / double(keys_[after].frame - keys_[before].frame);
    };
    return (1 - h01) * value(keys_[i]) + h01 * value(keys_[i + 1]) + span * (h10 * slope(i) + h11 * slope(i + 1));
  };
  render::Camera camera = render::Camera::from(keys_[i].camera);
  camera.position = base + smooth([&](const Key& k) { return k.camera.position - base; });
  const Vec3d forward = smooth([](const Key& k) { return k.camera.forward; });
  if (glm::length(forward) > 1e-6) camera.forward = glm::normalize(forward);
  const double fov = smooth([](const Key& k) { return k.camera.vertical_fov_deg; });
  camera.vertical_fov = std::clamp(fov, 1.0, 179.0) * 3.14159265358979323846 / 180;
  return camera;
}

namespace {

constexpr int kWholeAtMost = 2048;  // pixels a side of the picture that stands for the whole

bool looks_far(const render::RenderKnobs& knobs) {
  return knobs.bloom > 0 || knobs.exposure_mode != render::ExposureMode::fixed;
}

void add_to(render::FrameReport& all, const render::FrameReport& one) {
  if (all.device.empty()) all.device = one.device;
  all.ms += one.ms;
  all.samples = std::max(all.samples, one.samples), all.nan_samples += one.nan_samples;
  all.add_passes(one);
}

}  // namespace

world::Result<render::FrameReport> write_in_strips(const std::string& path, render::Backend& backend,
                                                   const world::WorldView& view, const render::Camera& camera,
                                                   const render::RenderKnobs& knobs, int width, int height,
                                                   int strip_rows, const render::PictureText& text) {
  if (strip_rows <= 0) strip_rows = static_cast<int>(std::clamp<int64_t>(kPixelsAtOnce / width, 16, height));
  render::FrameReport report;
  const render::RenderKnobs bare = render::without_effects(knobs);

  // What spreads over the whole picture, from a smaller one.
  render::WholePicture whole;
  if (looks_far(knobs)) {
    const double scale = std::min(1.0, double{kWholeAtMost} / std::max(width, height));
    whole.width = std::max(1, static_cast<int>(std::lround(width * scale)));
    whole.height = std::max(1, static_cast<int>(std::lround(height * scale)));
    TRY(render::Frame small, backend.render(view, camera, bare, whole.width, whole.height));
    TRY(whole.plan, render::plan_effects(view, camera, knobs, whole.width, whole.height));
    whole.outcome = render::apply_effects(whole.plan, small.image);
    add_to(report, small.report);
    report.metered_ev = whole.outcome.metered_ev;
  }
  std::vector<render::FlareSpot> spots;
  if (knobs.lens_flare > 0) spots = render::flare_spots(view, camera, knobs, width, height);
  // Chromatic aberration looks so many rows beyond a strip.
  const int margin =
      knobs.chromatic_aberration > 0 ? 2 + static_cast<int>(std::ceil(knobs.chromatic_aberration * 0.5 * height)) : 0;

  int next_row = 0;
  const render::NextRows next = [&]() -> world::Result<Image> {
    const int rows = std::min(strip_rows, height - next_row);
    const int above = std::min(margin, next_row), below = std::min(margin, height - next_row - rows);
    render::Camera part = camera;
    part.window = {0, double(next_row - above), width, height};
    TRY(render::Frame frame, backend.render(view, part, bare, width, above + rows + below));
    add_to(report, frame.report);
    TRY(const render::EffectPlan plan, render::plan_effects(part, knobs, width, frame.image.height, spots));
    render::apply_effects(plan, whole, frame.image);
    if (above + below > 0) {
      const auto first = frame.image.pixels.begin() + static_cast<ptrdiff_t>(above) * width;
      Image inner(width, rows);
      std::copy_n(first, inner.pixels.size(), inner.pixels.begin());
      frame.image = std::move(inner);
    }
    next_row += rows;
    return std::move(frame.image);
  };
  const bool exr = std::filesystem::path(path).extension() == ".exr";
  TRY_STATUS(exr ? render::write_exr_rows(path, width, height, text, next)
                 : render::write_png_rows(path, width, height, knobs.exposure, text, next));
  return report;
}

Image contact_sheet(const std::vector<Image>& pictures, int columns) {
  constexpr int kGap = 2;
  if (pictures.empty()) return {};
  columns = std::clamp(columns, 1, static_cast<int>(pictures.size()));
  const int rows = (static_cast<int>(pictures.size()) + columns - 1) / columns;
  const int width = pictures[0].width, height = pictures[0].height;
  Image sheet(columns * (width + kGap) - kGap, rows * (height + kGap) - kGap);
  for (size_t i = 0; i < pictures.size(); ++i) {
    const int x0 = static_cast<int>(i) % columns * (width + kGap), y0 = static_cast<int>(i) / columns * (height + kGap);
    for (int y = 0; y < height; ++y) std::copy_n(&pictures[i].at(0, y), width, &sheet.at(x0, y0 + y));
  }
  return sheet;
}

world::Result<std::vector<std::string>> parse_layers(const std::string& text) {
  std::vector<std::string> layers;
  for (size_t at = 0; at < text.size();) {
    const size_t comma = std::min(text.find(',', at), text.size());
    const std::string layer = text.substr(at, comma - at);
    if (layer != "depth" && layer != "normal" && layer != "id")
      return world::usage_error("--outputs takes depth, normal and id, separated by commas, not \"" + layer + "\"");
    if (std::find(layers.begin(), layers.end(), layer) == layers.end()) layers.push_back(layer);
    at = comma + 1;
  }
  return layers;
}

world::Status write_layers(const std::string& path, const std::vector<std::string>& layers,
                           const world::WorldView& view, const render::Camera& camera, const render::RenderKnobs& knobs,
                           const Image& image, const render::PictureText& text) {
  using render::BufferKind, render::PixelFormat;
  const auto wanted = [&](const char* layer) { return std::find(layers.begin(), layers.end(), layer) != layers.end(); };
  const int width = image.width, height = image.height;
  render::PixelBuffer depth(PixelFormat::d32, width, height), normal(PixelFormat::float32, width, height),
      id(PixelFormat::id, width, height);
  render::Framebuffer buffers;
  if (wanted("depth")) TRY_STATUS(buffers.attach(BufferKind::depth, depth));
  if (wanted("normal")) TRY_STATUS(buffers.attach(BufferKind::normal, normal));
  if (wanted("id")) TRY_STATUS(buffers.attach(BufferKind::material, id));
  TRY_STATUS(render::draw_layers(view, camera, knobs, buffers));

  const std::filesystem::path p(path);
  if (p.extension() == ".exr") return render::write_exr_layers(path, image, buffers, text);
  const auto write = [&](const char* layer, const char* shows, auto colour_at) -> world::Status {
    render::Image8 shown{width, height, std::vector<unsigned char>(image.pixels.size() * 3)};
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const auto c = glm::clamp(colour_at(x, y), 0.0f, 1.0f);
        for (int b = 0; b < 3; ++b)
          shown.pixels[3 * (static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)) +
                       static_cast<size_t>(b)] = static_cast<unsigned char>(c[b] * 255 + 0.5f);
      }
    render::PictureText with = text;
    with["layer"] = std::string(layer) + ": " + shows;
    const std::string name = p.stem().string() + "." + layer + p.extension().string();
    return render::write_png((p.parent_path() / name).string(), shown, with);
  };
  if (wanted("depth"))
    TRY_STATUS(write("depth", "1 - log2(1 + metres) / 16, black where there is none",
                     [&](int x, int y) { return glm::vec3(1 - std::log2(1 + depth.depth(x, y)) / 16); }));
  if (wanted("normal"))
    TRY_STATUS(write("normal", "(1 + component) / 2, black where there is none", [&](int x, int y) {
      const glm::vec3 n = normal.normal(x, y);
      return n == glm::vec3(0) ? n : 0.5f * (n + 1.0f);
    }));
  if (wanted("id"))
    TRY_STATUS(write("id", "a colour an id, by a hash; black where there is none", [&](int x, int y) {
      const uint32_t value = id.id(x, y);
      const uint64_t h = world::mix64(value);
      return value == 0 ? glm::vec3(0)
                        : glm::vec3(float(h & 255), float(h >> 8 & 255), float(h >> 16 & 255)) * (0.75f / 255) + 0.25f;
    }));
  return {};
}

}  // namespace tools
