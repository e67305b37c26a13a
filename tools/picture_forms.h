/// Pictures in other forms than one from one camera in memory: camera paths, pictures of any size in strips, contact
/// sheets, and what a picture knows of each pixel beside its light.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "render/backend.h"
#include "render/image/png_exr.h"
#include "world/base/errors.h"

namespace tools {

/// A path of key frames: the cameras of a world that are called NAME@FRAME, in order of their frames.
///
/// Position, direction and field of view pass each key smoothly: cubic between two keys, with the slope at each of the
/// line from the one before to the one after, by their frames. Before the first and after the last key it stands still.
/// source  Edwin Catmull, Raphael Rom. A Class of Local Interpolating Splines. 1974; for keys at uneven times Charles
///         Kruger's and others' form of Hermite's cubic with finite differences
class CameraPath {
 public:
  /// None where fewer than two cameras are keys of that name.
  static std::optional<CameraPath> of(const world::World& world, const std::string& name);
  render::Camera at(double frame) const;
  int first_frame() const { return keys_.front().frame; }
  int last_frame() const { return keys_.back().frame; }

 private:
  struct Key {
    int frame;
    world::CameraPlacement camera;
  };
  std::vector<Key> keys_;
};

/// From this many pixels on a picture is drawn in strips, so that memory stays below a bound whatever its size.
constexpr int64_t kPixelsAtOnce = int64_t{1} << 24;

/// Draws a picture in strips of `strip_rows` rows (0: as many as kPixelsAtOnce has) and writes each as it comes.
/// Effects that look far, bloom and automatic exposure, take that from a picture of the whole of at most 2048 pixels a
/// side: tests/tools/render_test.cpp says how near that comes. The report is that of the strips together.
world::Result<render::FrameReport> write_in_strips(const std::string& path, render::Backend& backend,
                                                   const world::WorldView& view, const render::Camera& camera,
                                                   const render::RenderKnobs& knobs, int width, int height,
                                                   int strip_rows, const render::PictureText& text);

/// Pictures of one size in rows of `columns`, two pixels apart.
render::Image contact_sheet(const std::vector<render::Image>& pictures, int columns);

/// Names of layers: depth, normal, id; separated by commas. An unknown one is a usage error that says which there are.
world::Result<std::vector<std::string>> parse_layers(const std::string& text);
/// Beside the picture's path: NAME.depth.png and so on, each scaled to be looked at, which its text says; or, of an
/// EXR, channels of the picture's own file: Z, N.X N.Y N.Z, id.
world::Status write_layers(const std::string& path, const std::vector<std::string>& layers,
                           const world::WorldView& view, const render::Camera& camera, const render::RenderKnobs& knobs,
                           const render::Image& image, const render::PictureText& text);

}  // namespace tools
