#include "render/image/hdr.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <string_view>

#include <fmt/format.h>

#include "render/image/png_exr.h"
#include "world/formats/format.h"

namespace render {

namespace {

using world::Error;
using world::input_error;
using world::Result;
using world::Status;

constexpr int64_t kSmallPixels = 1 << 20;              // never refused
constexpr int64_t kMostPixelsPerByte = 16;             // runs of at most 127 in four channels: 8 bytes give 127 pixels
constexpr int kLeastRunRow = 8, kMostRunRow = 0x7fff;  // widths that rows with runs by channel may have

class Decoder {
 public:
  Decoder(const std::string& name, const std::vector<uint8_t>& bytes) : name_(name), bytes_(bytes) {}

  Result<Image> decode() {
    TRY_STATUS(read_header());
    Image image(width_, height_);
    std::vector<uint8_t> row(static_cast<size_t>(width_) * 4);
    for (int y = 0; y < height_; ++y) {
      TRY_STATUS(read_row(row));
      for (int x = 0; x < width_; ++x) {
        const uint8_t* p = &row[static_cast<size_t>(x) * 4];
        const float scale = p[3] ? static_cast<float>(std::ldexp(1.0, p[3] - 136) / exposure_) : 0.0f;
        image.at(right_to_left_ ? width_ - 1 - x : x, bottom_up_ ? height_ - 1 - y : y) = {
            static_cast<float>(p[0]) * scale, static_cast<float>(p[1]) * scale, static_cast<float>(p[2]) * scale};
      }
    }
    return image;
  }

 private:
  Error fail(const std::string& what) const {
    return input_error(fmt::format("{}: byte {} of {}: {}", name_, at_, bytes_.size(), what));
  }
  size_t left() const { return bytes_.size() - at_; }

  /// Without its end; false where the file ends before.
  bool line(std::string& text) {
    const auto from = bytes_.begin() + static_cast<ptrdiff_t>(at_), end = std::find(from, bytes_.end(), '\n');
    if (end == bytes_.end()) return false;
    text.assign(from, end);
    at_ = static_cast<size_t>(end - bytes_.begin()) + 1;
    return true;
  }

  Status read_header() {
    std::string text;
    if (!line(text) || (text != "#?RADIANCE" && text != "#?RGBE"))
      return input_error(fmt::format("{}: is not a Radiance picture: expected #?RADIANCE at its start", name_));
    while (true) {
      if (!line(text)) return fail("the header ends too early");
      if (text.empty()) break;
      const std::string_view view = text;
      if (view.starts_with("FORMAT=") && view != "FORMAT=32-bit_rle_rgbe")
        return fail(fmt::format("the format is {}, expected 32-bit_rle_rgbe", view.substr(7, 40)));
      double exposure;
      if (std::sscanf(text.c_str(), "EXPOSURE=%lf", &exposure) == 1) exposure_ *= exposure;
      if (!(exposure_ >= 1e-12 && exposure_ <= 1e12)) return fail("the exposure must be in [1e-12, 1e12]");
    }
    char x_axis = 0, y_axis = 0, x_sign = 0, y_sign = 0, rest = 0;
    if (!line(text) ||
        std::sscanf(text.c_str(), "%c%c %d %c%c %d%c", &y_sign, &y_axis, &height_, &x_sign, &x_axis, &width_, &rest) !=
            6 ||
        y_axis != 'Y' || x_axis != 'X' || (y_sign != '-' && y_sign != '+') || (x_sign != '-' && x_sign != '+'))
      return fail("expected a resolution such as -Y 512 +X 1024");
    bottom_up_ = y_sign == '+', right_to_left_ = x_sign == '-';
    const int64_t pixels = int64_t{width_} * height_;
    if (width_ < 1 || height_ < 1 || pixels > kMaxPicturePixels ||
        pixels > std::max(kSmallPixels, kMostPixelsPerByte * static_cast<int64_t>(left())))
      return fail(
          fmt::format("the header claims {} x {} pixels, which the {} bytes left cannot hold or which is more "
                      "than {} pixels",
                      width_, height_, left(), kMaxPicturePixels));
    return {};
  }

  Status read_row(std::vector<uint8_t>& row) {
    if (left() < 4) return fail("the picture ends too early");
    const uint8_t* p = &bytes_[at_];
    if (width_ < kLeastRunRow || width_ > kMostRunRow || p[0] != 2 || p[1] != 2 || p[2] & 0x80)
      return read_old_row(row);
    if ((p[2] << 8 | p[3]) != width_)
      return fail(fmt::format("a row claims {} pixels, expected {}", p[2] << 8 | p[3], width_));
    at_ += 4;
    for (size_t channel = 0; channel < 4; ++channel)
      for (int x = 0; x < width_;) {
        if (left() < 2) return fail("the picture ends too early");
        const int code = bytes_[at_++], count = code > 128 ? code - 128 : code;
        if (count == 0 || count > width_ - x) return fail(fmt::format("a run of {} leaves its row", count));
        if (code <= 128 && left() < static_cast<size_t>(count)) return fail("the picture ends too early");
        for (int i = 0; i < count; ++i)
          row[static_cast<size_t>(x + i) * 4 + channel] = bytes_[code > 128 ? at_ : at_ + static_cast<size_t>(i)];
        at_ += code > 128 ? 1 : static_cast<size_t>(count);
        x += count;
      }
    return {};
  }

  /// Pixels of 4 bytes; 1, 1, 1, n repeats the one before n times, and a second such in a row 256 n times, and so on.
  Status read_old_row(std::vector<uint8_t>& row) {
    int shift = 0;
    for (int x = 0; x < width_;) {
      if (left() < 4) return fail("the picture ends too early");
      const uint8_t* p = &bytes_[at_];
      at_ += 4;
      uint8_t* out = &row[static_cast<size_t>(x) * 4];
      if (p[0] != 1 || p[1] != 1 || p[2] != 1) {
        std::copy(p, p + 4, out);
        ++x, shift = 0;
        continue;
      }
      const int64_t count = shift > 24 ? int64_t{width_} + 1 : int64_t{p[3]} << shift;
      if (x == 0 || count > width_ - x) return fail(fmt::format("a run of {} leaves its row", count));
      for (int64_t i = 0; i < count; ++i) std::copy(out - 4, out, out + 4 * i);
      x += static_cast<int>(count), shift += 8;
    }
    return {};
  }

  const std::string& name_;
  const std::vector<uint8_t>& bytes_;
  size_t at_ = 0;
  int width_ = 0, height_ = 0;
  bool bottom_up_ = false, right_to_left_ = false;
  double exposure_ = 1;
};

}  // namespace

Result<Image> decode_hdr(const std::string& name, const std::vector<uint8_t>& bytes) {
  try {
    return Decoder(name, bytes).decode();
  } catch (const std::exception& e) {
    return input_error(fmt::format("{}: cannot read: {}", name, e.what()));
  }
}

Result<Image> read_hdr(const std::filesystem::path& path) {
  TRY(const std::vector<uint8_t> bytes, world::read_file(path));
  return decode_hdr(path.string(), bytes);
}

}  // namespace render
