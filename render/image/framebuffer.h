/// A framebuffer: buffers of one size that hold what a picture knows of each pixel, each in a format of its own. A
/// buffer may belong to several framebuffers, for instance two pictures of one view that share their depth;
/// framebuffers own none of them.
///
///   format     bytes  what
///   rgb565 .. float32   colour, see render/image/formats.shared.h (as display values: 1 is white)
///   d16          2    depth, Unorm<16> of [0, 1]
///   d24s8        4    depth, 24 bits of [0, 1], and 8 bits of stencil: may be attached as both
///   d32          4    depth, a float
///   s8           1    stencil
///   normal       4    a unit vector in two Snorm<16>, by the octahedron: at most 7e-5 rad off
///   id           4    a number
///   motion       4    pixels since the last picture, two binary16
///
/// fails  usage, where a buffer of another size or of an unfit format is attached
/// source McGuire, Hughes et al. Computer Graphics: Principles and Practice, 3rd edition. 2013, section 14.4; Zina
///        Cigolle and others. A Survey of Efficient Representations for Independent Unit Vectors. 2014 (octahedron)
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include <glm/vec3.hpp>

#include "world/base/errors.h"

namespace render {

enum class PixelFormat : uint8_t {
  float32,
  half,
  r11g11b10,
  float7e3,
  rgb9e5,
  rgba8,
  rgb565,  // in the order of shared::kFormat...
  d16,
  d24s8,
  d32,
  s8,
  normal,
  id,
  motion
};
enum class BufferKind : uint8_t { colour, depth, stencil, normal, material, motion };
constexpr size_t kBufferKinds = 6;

struct PixelFormatInfo {
  std::string_view name;
  size_t bytes;    // a pixel
  uint32_t kinds;  // 1 << BufferKind, as which it may be attached
};
std::span<const PixelFormatInfo> pixel_formats();
inline const PixelFormatInfo& info_of(PixelFormat format) { return pixel_formats()[static_cast<size_t>(format)]; }

class PixelBuffer {
 public:
  /// All bytes 0.
  PixelBuffer(PixelFormat format, int width, int height);
  PixelFormat format() const { return format_; }
  int width() const { return width_; }
  int height() const { return height_; }
  size_t bytes() const { return bytes_.size(); }

  // Each for its own formats; colours are clamped as their format says.
  void set_colour(int x, int y, const glm::vec3& display);
  glm::vec3 colour(int x, int y) const;
  void set_depth(int x, int y, float depth);  // keeps the stencil
  float depth(int x, int y) const;
  void set_stencil(int x, int y, uint8_t stencil);  // keeps the depth
  uint8_t stencil(int x, int y) const;
  void set_normal(int x, int y, const glm::vec3& unit);
  glm::vec3 normal(int x, int y) const;
  void set_id(int x, int y, uint32_t id);
  uint32_t id(int x, int y) const;
  void set_motion(int x, int y, float right, float down);
  glm::vec3 motion(int x, int y) const;  // z is 0

 private:
  template <class Word>
  Word word(int x, int y, size_t offset = 0) const;
  template <class Word>
  void put(int x, int y, Word value, size_t offset = 0);

  PixelFormat format_;
  int width_, height_;
  std::vector<std::byte> bytes_;
};

class Framebuffer {
 public:
  /// The buffer must outlive the framebuffer.
  world::Status attach(BufferKind kind, PixelBuffer& buffer);
  void detach(BufferKind kind) { buffers_[static_cast<size_t>(kind)] = nullptr; }
  /// Null where there is none.
  PixelBuffer* operator[](BufferKind kind) const { return buffers_[static_cast<size_t>(kind)]; }
  int width() const { return width_; }
  int height() const { return height_; }

 private:
  int width_ = 0, height_ = 0;
  std::array<PixelBuffer*, kBufferKinds> buffers_{};
};

}  // namespace render
