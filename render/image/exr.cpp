// EXR through OpenEXR. Before OpenEXR sees a byte, a short walk over the headers refuses sizes that the file cannot
// hold, because OpenEXR allocates by what headers claim.
#include "render/image/png_exr.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <string_view>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <fmt/format.h>

#include "world/formats/format.h"

namespace render {
namespace {

using world::Error;
using world::input_error;
using world::Result;
using world::Status;
using Bytes = std::vector<uint8_t>;

// ---- the walk over the headers ----

constexpr uint32_t kTiled = 0x200, kDeep = 0x800, kMultiPart = 0x1000;
/// Of each compression method, by its number: rows in a block, and most bytes that come out of one.
struct Method {
  int64_t rows;
  uint64_t expansion;
};
constexpr std::array<Method, 10> kMethods = {{{1, 1},          // none
                                              {1, 128},        // RLE
                                              {1, 1032},       // ZIPS (deflate)
                                              {16, 1032},      // ZIP
                                              {32, 1032},      // PIZ: runs of 255 in some 10 bits
                                              {16, 1032},      // PXR24
                                              {32, 32},        // B44
                                              {32, 32},        // B44A
                                              {32, 65536},     // DWAA: deflated twice
                                              {256, 65536}}};  // DWAB
constexpr uint64_t kSmallBytes = uint64_t{16} << 20;           // never refused

struct PartHeader {
  int64_t width = 0, height = 0;
  int64_t bytes_per_pixel = 0;
  int64_t tile_width = 0, tile_height = 0;
  Method method = kMethods[0];
};

class HeaderWalk {
 public:
  HeaderWalk(const std::string& name, const Bytes& bytes) : name_(name), bytes_(bytes) {}

  Status check() {
    constexpr std::array<uint8_t, 4> kMagic = {0x76, 0x2f, 0x31, 0x01};
    if (bytes_.size() < 8 || !std::equal(kMagic.begin(), kMagic.end(), bytes_.begin())) {
      return input_error(fmt::format("{}: is not an EXR picture: expected the bytes 76 2f 31 01 at the start of {}",
                                     name_, bytes_.size()));
    }
    const uint32_t flags = u32(4);
    if (flags & kDeep) return fail(4, "holds deep data; expected a flat picture");
    position_ = 8;
    do {
      PartHeader part;
      TRY_STATUS(read_part(part));
      TRY_STATUS(check_sizes(part, (flags & kTiled) != 0));
      // Several parts end with an empty header.
    } while ((flags & kMultiPart) && position_ < bytes_.size() && bytes_[position_] != 0);
    return {};
  }

 private:
  Error fail(size_t offset, std::string_view what) const {
    return input_error(fmt::format("{}: byte {} of {}: {}", name_, offset, bytes_.size(), what));
  }
  uint32_t u32(size_t at) const {
    uint32_t v;
    std::memcpy(&v, bytes_.data() + at, 4);
    return v;
  }
  int64_t i32(size_t at) const { return static_cast<int32_t>(u32(at)); }

  std::optional<std::string_view> text() {
    const auto* begin = reinterpret_cast<const char*>(bytes_.data()) + position_;
    const size_t left = bytes_.size() - position_;
    const size_t length = strnlen(begin, left);
    if (length == left) return std::nullopt;
    position_ += length + 1;
    return std::string_view(begin, length);
  }

  Status read_part(PartHeader& part) {
    bool window = false, channels = false;
    for (;;) {
      const size_t start = position_;
      const auto name = text();
      if (name && name->empty()) break;
      const auto type = name ? text() : std::nullopt;
      if (!type || bytes_.size() - position_ < 4) return fail(start, "the header ends too early");
      const size_t size = u32(position_), at = position_ + 4;
      if (size > bytes_.size() - at) {
        return fail(at, fmt::format("attribute '{}' claims {} bytes, {} are left", name->substr(0, 40), size,
                                    bytes_.size() - at));
      }
      position_ = at + size;
      if (*name == "dataWindow" && size == 16) {
        window = true;
        part.width = i32(at + 8) - i32(at) + 1;
        part.height = i32(at + 12) - i32(at + 4) + 1;
      } else if (*name == "compression" && size == 1) {
        if (bytes_[at] >= kMethods.size()) return fail(at, fmt::format("unknown compression {}", bytes_[at]));
        part.method = kMethods[bytes_[at]];
      } else if (*name == "tiles" && size == 9) {
        part.tile_width = u32(at), part.tile_height = u32(at + 4);
      } else if (*name == "channels") {
        channels = true;
        TRY_STATUS(read_channels(at, at + size, part));
      }
    }
    if (!window || !channels) return fail(position_, "the header lacks its dataWindow or its channels");
    return {};
  }

  /// Each: name, zero, pixel type (0 uint, 1 half, 2 float), linear flag and 3 reserved, x and y sampling.
  Status read_channels(size_t at, size_t end, PartHeader& part) const {
    while (at < end && bytes_[at] != 0) {
      at += strnlen(reinterpret_cast<const char*>(bytes_.data()) + at, end - at) + 1;
      if (end < 16 || at > end - 16) return fail(at, "the list of channels ends too early");
      part.bytes_per_pixel += u32(at) == 1 ? 2 : 4;
      at += 16;
    }
    return {};
  }

  Status check_sizes(const PartHeader& part, bool tiled) const {
    const uint64_t size = bytes_.size();
    const auto refuse = [&](std::string_view why) {
      return fail(8, fmt::format("the header claims {} x {} pixels of {} bytes, {}", part.width, part.height,
                                 part.bytes_per_pixel, why));
    };
    if (part.width < 1 || part.height < 1) return refuse("expected at least one");
    if (part.bytes_per_pixel < 1 || part.bytes_per_pixel > 4096) return refuse("expected 1 to 4096 bytes a pixel");
    if (part.width > kMaxPicturePixels || part.height > kMaxPicturePixels ||
        part.width * part.height > kMaxPicturePixels) {
      return refuse(fmt::format("more than {} pixels", kMaxPicturePixels));
    }
    // The offset table has 8 bytes a block; OpenEXR holds the pixels and one row of blocks.
    const uint64_t allowed = std::max(kSmallBytes, part.method.expansion * size);
    const auto bytes = [&](int64_t w, int64_t h) { return static_cast<uint64_t>(w * h * part.bytes_per_pixel); };
    uint64_t blocks = static_cast<uint64_t>((part.height + part.method.rows - 1) / part.method.rows);
    bool too_much = bytes(part.width, part.height) > allowed || bytes(part.width, part.method.rows) > allowed;
    if (tiled || part.tile_width || part.tile_height) {
      constexpr int64_t kMaxTile = 1 << 14;
      if (part.tile_width < 1 || part.tile_height < 1 || part.tile_width > kMaxTile || part.tile_height > kMaxTile) {
        return refuse(
            fmt::format("in tiles of {} x {}; expected sides of 1 to {}", part.tile_width, part.tile_height, kMaxTile));
      }
      blocks = static_cast<uint64_t>((part.width + part.tile_width - 1) / part.tile_width *
                                     ((part.height + part.tile_height - 1) / part.tile_height));
      too_much |= bytes(part.width + part.tile_width, part.tile_height) > allowed;
    }
    if (too_much || blocks * 8 > size) return refuse("which this file cannot hold");
    return {};
  }

  const std::string& name_;
  const Bytes& bytes_;
  size_t position_ = 0;
};

// ---- OpenEXR on memory ----

class MemoryInput : public Imf::IStream {
 public:
  MemoryInput(const std::string& name, const Bytes& bytes) : IStream(name.c_str()), bytes_(bytes) {}
  bool read(char out[], int count) override {
    if (count < 0 || static_cast<uint64_t>(count) > bytes_.size() - position_) {
      throw std::runtime_error("the file ends too early");
    }
    std::memcpy(out, bytes_.data() + position_, static_cast<size_t>(count));
    position_ += static_cast<uint64_t>(count);
    return position_ < bytes_.size();
  }
  uint64_t tellg() override { return position_; }
  void seekg(uint64_t position) override {
    if (position > bytes_.size()) throw std::runtime_error("a block lies beyond the end of the file");
    position_ = position;
  }

 private:
  const Bytes& bytes_;
  uint64_t position_ = 0;
};

class MemoryOutput : public Imf::OStream {
 public:
  explicit MemoryOutput(const std::string& name) : OStream(name.c_str()) {}
  void write(const char data[], int count) override {
    const size_t end = position_ + static_cast<size_t>(count);
    if (end > bytes.size()) bytes.resize(end);
    std::memcpy(bytes.data() + position_, data, static_cast<size_t>(count));
    position_ = end;
  }
  uint64_t tellp() override { return position_; }
  void seekp(uint64_t position) override { position_ = position; }
  std::string bytes;

 private:
  size_t position_ = 0;
};

Result<ExrFile> decode(const std::string& name, const Bytes& bytes) {
  MemoryInput stream(name, bytes);
  Imf::InputFile input(stream, 1);
  const Imf::ChannelList& channels = input.header().channels();
  const bool gray = channels.findChannel("Y") && !channels.findChannel("R");
  const std::array<const char*, 3> wanted =
      gray ? std::array<const char*, 3>{"Y", "Y", "Y"} : std::array<const char*, 3>{"R", "G", "B"};
  std::string found;
  for (auto c = channels.begin(); c != channels.end(); ++c) found += fmt::format(" {}", c.name());
  for (const char* wanted_name : wanted) {
    const Imf::Channel* channel = channels.findChannel(wanted_name);
    if (!channel || channel->xSampling != 1 || channel->ySampling != 1 || (gray && channels.findChannel("RY"))) {
      return input_error(fmt::format("{}: has the channels{}; expected R, G and B, or Y alone, at every pixel", name,
                                     found.size() > 120 ? found.substr(0, 120) + " ..." : found));
    }
  }

  const Imath::Box2i window = input.header().dataWindow();
  ExrFile file;
  file.image = Image(window.max.x - window.min.x + 1, window.max.y - window.min.y + 1);
  const size_t row_bytes = static_cast<size_t>(file.image.width) * sizeof(Rgb);
  Imf::FrameBuffer frame;
  for (int c = 0; c < (gray ? 1 : 3); ++c) {
    float* first = &file.image.pixels[0].r + c;
    frame.insert(wanted[static_cast<size_t>(c)], Imf::Slice::Make(Imf::FLOAT, first, window.min, file.image.width,
                                                                  file.image.height, sizeof(Rgb), row_bytes));
  }
  input.setFrameBuffer(frame);
  input.readPixels(window.min.y, window.max.y);
  if (gray) {
    for (Rgb& p : file.image.pixels) p.g = p.b = p.r;
  }

  for (auto a = input.header().begin(); a != input.header().end(); ++a) {
    if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&a.attribute())) {
      file.text[a.name()] = text->value();
    }
  }
  return file;
}

Status encode(const std::filesystem::path& path, const Image& image, const PictureText& text, ExrPrecision precision,
              MemoryOutput& stream) {
  const Imf::PixelType type = precision == ExrPrecision::full ? Imf::FLOAT : Imf::HALF;
  Imf::Header header(image.width, image.height);
  header.compression() = Imf::ZIP_COMPRESSION;
  for (const char* name : {"R", "G", "B"}) header.channels().insert(name, Imf::Channel(type));
  for (const auto& [key, value] : text) {
    if (key.empty() || key.size() > 255 || header.find(key) != header.end() || key.find('\0') != std::string::npos) {
      return input_error(fmt::format(
          "{}: cannot write: '{}' must have 1 to 255 characters and not be the name of a standard attribute",
          path.string(), key));
    }
    header.insert(key, Imf::StringAttribute(value));
  }

  // Clamp by hand: OpenEXR makes infinity of what half cannot hold.
  std::vector<half> halves;
  const auto count = image.pixels.size() * 3;
  const float* floats = &image.pixels[0].r;
  if (type == Imf::HALF) {
    constexpr float kHalfMax = 65504;
    halves.resize(count);
    for (size_t i = 0; i < count; ++i) {
      const float v = floats[i];
      halves[i] = half(std::isinf(v) ? v : std::min(std::max(v, -kHalfMax), kHalfMax));
    }
  }
  const size_t size = type == Imf::HALF ? 2 : 4;
  const char* base = type == Imf::HALF ? reinterpret_cast<const char*>(halves.data())  //
                                       : reinterpret_cast<const char*>(floats);
  Imf::FrameBuffer frame;
  int offset = 0;
  for (const char* name : {"R", "G", "B"}) {
    frame.insert(name,
                 Imf::Slice::Make(type, base + size * static_cast<size_t>(offset++), Imath::V2i(0, 0), image.width,
                                  image.height, 3 * size, 3 * size * static_cast<size_t>(image.width)));
  }
  Imf::OutputFile output(stream, header, 1);
  output.setFrameBuffer(frame);
  output.writePixels(image.height);
  return {};
}

}  // namespace

world::Status write_exr(const std::filesystem::path& path, const Image& image, const PictureText& text,
                        ExrPrecision precision) {
  if (image.width < 1 || image.height < 1 ||
      image.pixels.size() != static_cast<size_t>(image.width) * static_cast<size_t>(image.height)) {
    return input_error(fmt::format("{}: cannot write a picture of {} x {} and {} pixels", path.string(), image.width,
                                   image.height, image.pixels.size()));
  }
  try {
    MemoryOutput stream(path.string());
    TRY_STATUS(encode(path, image, text, precision, stream));
    return world::write_bytes_atomically(path, stream.bytes);
  } catch (const std::exception& e) {
    return input_error(fmt::format("{}: cannot write: {}", path.string(), e.what()));
  }
}

world::Result<ExrFile> decode_exr(const std::string& name, const Bytes& bytes) {
  try {
    TRY_STATUS(HeaderWalk(name, bytes).check());
    return decode(name, bytes);
  } catch (const std::exception& e) {
    return input_error(fmt::format("{}: {}; expected a whole EXR picture", name, e.what()));
  }
}

world::Result<ExrFile> read_exr(const std::filesystem::path& path) {
  TRY(const Bytes bytes, world::read_file(path));
  return decode_exr(path.string(), bytes);
}

}  // namespace render
