/// What a picture gathers: of each pixel and band the mean of its samples and the sum of their squared distances from
/// it, in double, added one by one.
///
/// A sample that is not finite is counted and left out: a pixel's mean is that of its other samples, 0 where it has
/// none. Samples of one pixel are added in the order of their numbers, so that a film that was saved and goes on later
/// holds the same bits as one that never stopped.
/// memory  56 bytes a pixel
/// error   of a mean of 1e7 samples: 1e-13 (Welford's update), for the sum of ones: none up to 2^32
/// source  Brian Welford. Note on a Method for Calculating Corrected Sums of Squares and Products. 1962
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "render/image/image.h"
#include "world/base/errors.h"
#include "world/space/world_point.h"

namespace render {

struct PixelSamples {
  double mean[3] = {0, 0, 0};
  double squares[3] = {0, 0, 0};  // sum of (sample - mean)^2
  uint32_t count = 0, rejected = 0;

  void add(const world::Vec3d& sample);
};
static_assert(sizeof(PixelSamples) == 56);

class Film {
 public:
  Film() = default;
  Film(int width, int height);

  int width() const { return width_; }
  int height() const { return height_; }
  PixelSamples& at(int x, int y) { return pixels_[index(x, y)]; }
  const PixelSamples& at(int x, int y) const { return pixels_[index(x, y)]; }
  /// Samples that each pixel was given, the rejected ones too; set by who adds them.
  uint32_t samples = 0;

  Image mean() const;
  /// Of one sample, unbiased; 0 where a pixel has fewer than two.
  Image variance() const;
  /// The root mean square, over pixels and bands, of the standard errors of their means, over the mean of all means:
  ///   sqrt(mean_p,b(variance / count)) / mean_p,b(mean)
  /// Infinity below two samples a pixel; 0 where the picture is black.
  double relative_error() const;
  /// Samples left out because they were not finite.
  uint64_t rejected() const;

  /// `picture` names everything that its samples depend on, in keys and values.
  /// The file: "LOAMFILM", version, width, height, samples (32 bits each), size of the text, the text ("key=value"
  /// lines), the pixels, XXH3 of all before it; little-endian.
  world::Status save(const std::filesystem::path& path, const std::map<std::string, std::string>& picture) const;
  /// Fails where the file is damaged, or holds samples of another picture.
  static world::Result<Film> load(const std::filesystem::path& path, int width, int height,
                                  const std::map<std::string, std::string>& picture);

 private:
  size_t index(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x);
  }
  int width_ = 0, height_ = 0;
  std::vector<PixelSamples> pixels_;
};

}  // namespace render
