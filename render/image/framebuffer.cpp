#include "render/image/framebuffer.h"

#include <bit>
#include <cmath>
#include <cstring>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "render/image/formats.shared.h"
#include "world/numbers/normalized.shared.h"

namespace render {

namespace {

constexpr uint32_t kind_bit(BufferKind kind) { return 1u << static_cast<unsigned>(kind); }
constexpr uint32_t kColour = kind_bit(BufferKind::colour), kDepth = kind_bit(BufferKind::depth),
                   kStencil = kind_bit(BufferKind::stencil);

constexpr PixelFormatInfo kFormats[] = {
    {"float32", 12, kColour | kind_bit(BufferKind::normal)},
    {"half", 8, kColour},
    {"r11g11b10", 4, kColour},
    {"float7e3", 4, kColour},
    {"rgb9e5", 4, kColour},
    {"rgba8", 4, kColour},
    {"rgb565", 2, kColour},
    {"d16", 2, kDepth},
    {"d24s8", 4, kDepth | kStencil},
    {"d32", 4, kDepth},
    {"s8", 1, kStencil},
    {"normal", 4, kind_bit(BufferKind::normal)},
    {"id", 4, kind_bit(BufferKind::material)},
    {"motion", 4, kind_bit(BufferKind::motion)},
};

constexpr double kTop24 = (1 << 24) - 1;

float sign_of(float x) { return x < 0 ? -1.0f : 1.0f; }

}  // namespace

std::span<const PixelFormatInfo> pixel_formats() { return kFormats; }

PixelBuffer::PixelBuffer(PixelFormat format, int width, int height)
    : format_(format),
      width_(width),
      height_(height),
      bytes_(info_of(format).bytes * static_cast<size_t>(width) * static_cast<size_t>(height)) {}

template <class Word>
Word PixelBuffer::word(int x, int y, size_t offset) const {
  DCHECK(x >= 0 && x < width_ && y >= 0 && y < height_);
  Word value;
  const size_t pixel = static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x);
  std::memcpy(&value, bytes_.data() + pixel * info_of(format_).bytes + offset, sizeof value);
  return value;
}

template <class Word>
void PixelBuffer::put(int x, int y, Word value, size_t offset) {
  DCHECK(x >= 0 && x < width_ && y >= 0 && y < height_);
  const size_t pixel = static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x);
  std::memcpy(bytes_.data() + pixel * info_of(format_).bytes + offset, &value, sizeof value);
}

void PixelBuffer::set_colour(int x, int y, const glm::vec3& display) {
  if (format_ == PixelFormat::float32) return put(x, y, display);
  const glm::uvec2 code = shared::pack_colour(static_cast<uint32_t>(format_), display);
  if (format_ == PixelFormat::half)
    put(x, y, code.x), put(x, y, code.y, 4);
  else if (format_ == PixelFormat::rgb565)
    put(x, y, static_cast<uint16_t>(code.x));
  else
    put(x, y, code.x);
}

glm::vec3 PixelBuffer::colour(int x, int y) const {
  if (format_ == PixelFormat::float32) return word<glm::vec3>(x, y);
  glm::uvec2 code(0u);
  if (format_ == PixelFormat::half)
    code = {word<uint32_t>(x, y), word<uint32_t>(x, y, 4)};
  else if (format_ == PixelFormat::rgb565)
    code.x = word<uint16_t>(x, y);
  else
    code.x = word<uint32_t>(x, y);
  return shared::unpack_colour(static_cast<uint32_t>(format_), code);
}

void PixelBuffer::set_depth(int x, int y, float depth) {
  if (format_ == PixelFormat::d32) return put(x, y, depth);
  const double clamped = depth > 0 ? std::min(double{depth}, 1.0) : 0.0;
  if (format_ == PixelFormat::d16) return put(x, y, static_cast<uint16_t>(std::floor(clamped * 65535 + 0.5)));
  const auto code = static_cast<uint32_t>(std::floor(clamped * kTop24 + 0.5));
  put(x, y, word<uint32_t>(x, y) >> 24 << 24 | code);
}

float PixelBuffer::depth(int x, int y) const {
  if (format_ == PixelFormat::d32) return word<float>(x, y);
  if (format_ == PixelFormat::d16) return static_cast<float>(word<uint16_t>(x, y) / 65535.0);
  return static_cast<float>((word<uint32_t>(x, y) & 0xffffffu) / kTop24);
}

void PixelBuffer::set_stencil(int x, int y, uint8_t stencil) {
  put(x, y, stencil, format_ == PixelFormat::d24s8 ? 3 : 0);
}
uint8_t PixelBuffer::stencil(int x, int y) const { return word<uint8_t>(x, y, format_ == PixelFormat::d24s8 ? 3 : 0); }

void PixelBuffer::set_normal(int x, int y, const glm::vec3& unit) {
  if (format_ == PixelFormat::float32) return put(x, y, unit);
  // The octahedron |x| + |y| + |z| = 1 unfolded: its lower half lies around the upper.
  const glm::vec3 on = unit / (std::abs(unit.x) + std::abs(unit.y) + std::abs(unit.z));
  float u = on.x, v = on.y;
  if (on.z < 0) u = (1 - std::abs(on.y)) * sign_of(on.x), v = (1 - std::abs(on.x)) * sign_of(on.y);
  put(x, y, world::Snorm<16>::from(u).code), put(x, y, world::Snorm<16>::from(v).code, 2);
}

glm::vec3 PixelBuffer::normal(int x, int y) const {
  if (format_ == PixelFormat::float32) return word<glm::vec3>(x, y);
  const float u = world::Snorm<16>{word<int16_t>(x, y)}.value(), v = world::Snorm<16>{word<int16_t>(x, y, 2)}.value();
  glm::vec3 n(u, v, 1 - std::abs(u) - std::abs(v));
  if (n.z < 0) n.x = (1 - std::abs(v)) * sign_of(u), n.y = (1 - std::abs(u)) * sign_of(v);
  return glm::normalize(n);
}

void PixelBuffer::set_id(int x, int y, uint32_t id) { put(x, y, id); }
uint32_t PixelBuffer::id(int x, int y) const { return word<uint32_t>(x, y); }

void PixelBuffer::set_motion(int x, int y, float right, float down) {
  put(x, y, shared::pack_half(right) | shared::pack_half(down) << 16);
}
glm::vec3 PixelBuffer::motion(int x, int y) const {
  const auto both = word<uint32_t>(x, y);
  return {shared::unpack_half(both & 0xffffu), shared::unpack_half(both >> 16), 0};
}

world::Status Framebuffer::attach(BufferKind kind, PixelBuffer& buffer) {
  const PixelFormatInfo& format = info_of(buffer.format());
  constexpr const char* kKinds[kBufferKinds] = {"colour", "depth", "stencil", "normal", "material", "motion"};
  if (!(format.kinds & kind_bit(kind)))
    return world::usage_error(
        fmt::format("a buffer of the format {} can't hold {}", format.name, kKinds[static_cast<size_t>(kind)]));
  bool empty = true;
  for (const PixelBuffer* other : buffers_) empty &= !other;
  if (empty) width_ = buffer.width(), height_ = buffer.height();
  if (buffer.width() != width_ || buffer.height() != height_)
    return world::usage_error(fmt::format("a framebuffer of {}x{} pixels can't hold a buffer of {}x{}", width_, height_,
                                          buffer.width(), buffer.height()));
  buffers_[static_cast<size_t>(kind)] = &buffer;
  return {};
}

}  // namespace render
