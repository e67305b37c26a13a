// Point Cloud Library .pcd -> points: the fields x, y and z, and rgb or rgba, whose bits are
// 0xRRGGBB also where they are called a float; others are passed over. DATA ascii, binary (little-endian,
// point by point) and binary_compressed (LZF, field by field).
//
//   VERSION .7
//   FIELDS x y z rgb
//   SIZE 4 4 4 4          bytes of one value
//   TYPE F F F F          F, I (signed) or U (unsigned)
//   COUNT 1 1 1 1         values of the field; 1 each where missing
//   WIDTH 640, HEIGHT 480, POINTS 307200, VIEWPOINT 0 0 0 1 0 0 0
//   DATA binary
//
// source Point Cloud Library. The PCD (Point Cloud Data) file format, version 0.7; Marc Lehmann. LibLZF (the format of
// its compressed data).
#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <string>

#include <fmt/format.h>

#include "world/base/file.h"
#include "world/meshes/points.h"

namespace world {
namespace {

constexpr uint64_t kMostBytes = uint64_t{1} << 32;

struct Field {
  std::string name;
  uint64_t size = 4, count = 1, offset = 0;  // bytes; values; bytes from the start of a point
  char type = 'F';
};

/// LZF: literals and copies of what came before. False where that is not exactly out.size() bytes.
bool unpack_lzf(std::span<const uint8_t> in, std::span<uint8_t> out) {
  size_t from = 0, to = 0;
  while (from < in.size()) {
    const unsigned control = in[from++];
    if (control < 32) {
      const size_t length = control + 1;
      if (length > in.size() - from || length > out.size() - to) return false;
      std::memcpy(out.data() + to, in.data() + from, length);
      from += length, to += length;
      continue;
    }
    size_t length = control >> 5;
    if (length == 7) {
      if (from >= in.size()) return false;
      length += in[from++];
    }
    length += 2;
    if (from >= in.size()) return false;
    const size_t back = ((control & 31) << 8 | in[from++]) + size_t{1};
    if (back > to || length > out.size() - to) return false;
    for (size_t i = 0; i < length; ++i, ++to) out[to] = out[to - back];  // they may overlap: a run
  }
  return to == out.size();
}

class PcdReader {
 public:
  PcdReader(std::span<const uint8_t> bytes, std::string_view file)
      : text_(reinterpret_cast<const char*>(bytes.data()), bytes.size()), file_(file) {}

  Result<PointSet> read() {
    TRY(const std::string data, read_header());
    Status status;
    if (data == "ascii")
      status = read_ascii();
    else if (data == "binary")
      status = read_binary(rest(), /*by_field=*/false);
    else
      status = read_compressed();
    if (!status) return status.error();
    if (points_.positions.empty())
      return input_error(fmt::format("{}: holds no points with finite coordinates", file_));
    return std::move(points_);
  }

 private:
  Error error(const std::string& what) const { return input_error(fmt::format("{}: byte {}: {}", file_, at_, what)); }
  std::span<const uint8_t> rest() const {
    return {reinterpret_cast<const uint8_t*>(text_.data()) + at_, text_.size() - at_};
  }
  std::string_view take_line() {
    const size_t end = std::min(text_.find('\n', at_), text_.size());
    std::string_view line = text_.substr(at_, end - at_);
    at_ = std::min(end + 1, text_.size());
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
  }
  static std::string_view take_word(std::string_view& line) {
    const size_t first = std::min(line.find_first_not_of(" \t"), line.size());
    const size_t last = std::min(line.find_first_of(" \t", first), line.size());
    const std::string_view word = line.substr(first, last - first);
    line.remove_prefix(last);
    return word;
  }
  template <class Number>
  static bool parse(std::string_view word, Number& out) {
    if (word.starts_with('+')) word.remove_prefix(1);
    const auto [end, bad] = std::from_chars(word.data(), word.data() + word.size(), out);
    return bad == std::errc() && end == word.data() + word.size();
  }

  /// Returns the kind of data.
  Result<std::string> read_header() {
    uint64_t width = 0, height = 1;
    bool has_points = false;
    while (true) {
      if (at_ >= text_.size())
        return error("the file ends inside its header, before its DATA line; it is damaged, or no .pcd file");
      std::string_view line = take_line();
      const std::string_view key = take_word(line);
      if (key.empty() || key.starts_with('#') || key == "VERSION" || key == "VIEWPOINT") continue;
      if (key == "FIELDS" || key == "COLUMNS") {
        for (std::string_view word = take_word(line); !word.empty(); word = take_word(line))
          fields_.push_back({.name = std::string(word)});
      } else if (key == "SIZE" || key == "COUNT" || key == "TYPE") {
        for (Field& field : fields_) {
          const std::string_view word = take_word(line);
          if (key == "TYPE") {
            if (word != "F" && word != "I" && word != "U")
              return error(fmt::format("TYPE has \"{}\", but each field needs F, I or U", word));
            field.type = word[0];
          } else if (!parse(word, key == "SIZE" ? field.size : field.count) || field.count > 65536) {
            return error(fmt::format("{} has \"{}\", but each field needs a whole number", key, word));
          }
        }
      } else if (key == "WIDTH" || key == "HEIGHT" || key == "POINTS") {
        has_points |= key == "POINTS";
        if (!parse(take_word(line), key == "WIDTH" ? width : key == "HEIGHT" ? height : count_))
          return error(fmt::format("{} needs a whole number", key));
      } else if (key == "DATA") {
        const std::string data(take_word(line));
        if (data != "ascii" && data != "binary" && data != "binary_compressed")
          return error(fmt::format("DATA is \"{}\", but must be ascii, binary or binary_compressed", data));
        if (!has_points) {
          if (height > 0 && width > UINT64_MAX / height) return error("WIDTH times HEIGHT is too large");
          count_ = width * height;
        }
        TRY_STATUS(lay_out());
        return data;
      } else {
        return error(fmt::format("the header has a line of \"{}\" that .pcd does not know", key.substr(0, 32)));
      }
    }
  }

  Status lay_out() {
    for (int a = 0; a < 3; ++a) axis_[a] = nullptr;
    for (Field& field : fields_) {
      field.offset = point_bytes_;
      const bool known = field.type == 'F' ? field.size == 4 || field.size == 8
                                           : field.size == 1 || field.size == 2 || field.size == 4 || field.size == 8;
      if (!known)
        return error(
            fmt::format("the field {} has values of {} bytes, which its type can't have", field.name, field.size));
      point_bytes_ += field.size * field.count;
    }
    for (const Field& field : fields_)
      for (int a = 0; a < 3; ++a)
        if (field.name.size() == 1 && field.name[0] == "xyz"[a] && field.count == 1) axis_[a] = &field;
    for (const Field& field : fields_)
      if ((field.name == "rgb" || field.name == "rgba") && field.count == 1 && field.size == 4) colour_ = &field;
    if (!axis_[0] || !axis_[1] || !axis_[2]) return error("the points need the fields x, y and z");
    return {};
  }

  void add(const Vec3d& p, uint32_t colour) {
    if (std::isfinite(p.x + p.y + p.z)) {
      points_.positions.push_back(p);
      if (colour_) points_.colours.push_back(colour & 0xffffff);
    } else {
      ++points_.not_finite;
    }
  }

  Status read_ascii() {
    for (uint64_t i = 0; i < count_; ++i) {
      if (at_ >= text_.size())
        return error(fmt::format("the file ends after {} of its {} points; it is damaged or cut off", i, count_));
      std::string_view line = take_line();
      Vec3d p(std::nan(""));
      uint32_t colour = 0;
      for (size_t f = 0; f < fields_.size(); ++f) {
        for (uint64_t k = 0; k < fields_[f].count; ++k) {
          const std::string_view word = take_word(line);
          for (int a = 0; a < 3; ++a) {
            if (&fields_[f] != axis_[a]) continue;
            if (!parse(word, p[a]))
              return error(
                  fmt::format("point {} has \"{}\" for {}, but needs a number", i, word.substr(0, 32), "xyz"[a]));
          }
          if (&fields_[f] == colour_ && !parse_colour(word, colour))
            return error(fmt::format("point {} has \"{}\" for its colour, but needs a number", i, word.substr(0, 32)));
        }
      }
      add(p, colour);
    }
    return {};
  }

  /// A float's number stands for its bits.
  bool parse_colour(std::string_view word, uint32_t& colour) const {
    if (colour_->type != 'F') {
      int64_t whole = 0;
      if (!parse(word, whole)) return false;
      colour = static_cast<uint32_t>(whole);
      return true;
    }
    float number = 0;
    if (!parse(word, number)) return false;
    colour = std::bit_cast<uint32_t>(number);
    return true;
  }

  double value(const uint8_t* at, const Field& field) const {
    const auto as = [at](auto number) {
      std::memcpy(&number, at, sizeof number);
      return static_cast<double>(number);
    };
    if (field.type == 'F') return field.size == 4 ? as(float{}) : as(double{});
    const bool is_signed = field.type == 'I';
    switch (field.size) {
      case 1:
        return is_signed ? as(int8_t{}) : as(uint8_t{});
      case 2:
        return is_signed ? as(int16_t{}) : as(uint16_t{});
      case 4:
        return is_signed ? as(int32_t{}) : as(uint32_t{});
      default:
        return is_signed ? as(int64_t{}) : as(uint64_t{});
    }
  }

  /// Point by point, or all values of the first field, then all of the second, ...
  Status read_binary(std::span<const uint8_t> data, bool by_field) {
    if (count_ > data.size() / std::max<uint64_t>(point_bytes_, 1))
      return error(
          fmt::format("{} points of {} bytes don't fit in the {} bytes that follow; the file is damaged or cut off",
                      count_, point_bytes_, data.size()));
    for (uint64_t i = 0; i < count_; ++i) {
      Vec3d p;
      for (int a = 0; a < 3; ++a) {
        const Field& field = *axis_[a];
        const uint64_t at = by_field ? field.offset * count_ + i * field.size : i * point_bytes_ + field.offset;
        p[a] = value(data.data() + at, field);
      }
      uint32_t colour = 0;
      if (colour_) {
        const uint64_t at =
            by_field ? colour_->offset * count_ + i * colour_->size : i * point_bytes_ + colour_->offset;
        std::memcpy(&colour, data.data() + at, sizeof colour);
      }
      add(p, colour);
    }
    return {};
  }

  Status read_compressed() {
    const auto data = rest();
    uint32_t packed = 0, size = 0;
    if (data.size() < 8) return error("the file ends before its compressed data; it is damaged or cut off");
    std::memcpy(&packed, data.data(), 4);
    std::memcpy(&size, data.data() + 4, 4);
    if (packed > data.size() - 8)
      return error(
          fmt::format("{} bytes of compressed data are announced, and {} follow; the file is damaged or cut off",
                      packed, data.size() - 8));
    // Three bytes can stand for at most 264.
    if (size / 88 > packed || count_ > size / std::max<uint64_t>(point_bytes_, 1))
      return error(fmt::format("{} bytes can't be unpacked to {} points of {} bytes; the file is damaged", packed,
                               count_, point_bytes_));
    if (size > (uint64_t{1} << 27) && size / 8 > data.size())
      return error(
          fmt::format("the data claim to unpack to {} bytes, more than 8 times the file; it is damaged", size));
    std::vector<uint8_t> unpacked(size);
    if (!unpack_lzf(data.subspan(8, packed), unpacked)) return error("the compressed data are damaged");
    return read_binary(unpacked, /*by_field=*/true);
  }

  std::string_view text_, file_;
  size_t at_ = 0;
  std::vector<Field> fields_;
  const Field* axis_[3] = {};
  const Field* colour_ = nullptr;  // where there is one
  uint64_t point_bytes_ = 0, count_ = 0;
  PointSet points_;
};

}  // namespace

Result<PointSet> read_pcd(std::span<const uint8_t> bytes, std::string_view file) {
  return PcdReader(bytes, file).read();
}

Result<PointSet> read_point_file(const std::filesystem::path& path) {
  TRY(const std::vector<uint8_t> bytes, read_file(path, kMostBytes));
  const bool ply = bytes.size() >= 3 && bytes[0] == 'p' && bytes[1] == 'l' && bytes[2] == 'y';
  return ply ? read_ply_points(bytes, path.string()) : read_pcd(bytes, path.string());
}

}  // namespace world
