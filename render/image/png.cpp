// PNG through libpng. Errors of libpng are longjmps: each function that calls setjmp holds no object with a destructor,
// and everything that owns memory lives in its caller.
#include "render/image/png_exr.h"

#include <algorithm>
#include <csetjmp>
#include <cstdio>
#include <cstring>

#include <fmt/format.h>
#include <png.h>

#include "world/base/png_chunks.h"
#include "world/formats/format.h"

namespace render {
namespace {

using world::Error;
using world::input_error;
using world::Result;
using world::Status;

// Deflate makes at most 1032 bytes out of one.
constexpr uint64_t kDeflateExpansion = 1032;
constexpr uint32_t kMaxTextChunks = 128, kMaxTextBytes = 1 << 20;

/// The message of libpng, kept across the longjmp.
struct PngFailure {
  char message[200] = "";
};

[[noreturn]] void on_png_error(png_structp png, png_const_charp message) {
  auto* failure = static_cast<PngFailure*>(png_get_error_ptr(png));
  std::snprintf(failure->message, sizeof failure->message, "%s", message);
  png_longjmp(png, 1);
}
void on_png_warning(png_structp, png_const_charp) {}

struct Reader {
  const std::vector<uint8_t>& bytes;
  size_t position = 0;
  size_t stored_row_bytes = 0;  // before palettes and few bits are expanded
  PngFailure failure;
  png_structp png = nullptr;
  png_infop info = nullptr;

  explicit Reader(const std::vector<uint8_t>& b) : bytes(b) {
    png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &failure, on_png_error, on_png_warning);
    if (png) info = png_create_info_struct(png);
  }
  ~Reader() { png_destroy_read_struct(&png, &info, nullptr); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
};

void read_bytes(png_structp png, png_bytep out, size_t count) {
  auto* reader = static_cast<Reader*>(png_get_io_ptr(png));
  if (count > reader->bytes.size() - reader->position) {
    reader->position = reader->bytes.size();
    png_error(png, "the file ends too early");
  }
  std::memcpy(out, reader->bytes.data() + reader->position, count);
  reader->position += count;
}

/// Reads up to the first pixels and asks for whole bytes or 16 bits.
bool read_header(Reader& reader) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_set_read_fn(reader.png, &reader, read_bytes);
  png_set_user_limits(reader.png, static_cast<png_uint_32>(kMaxPicturePixels),
                      static_cast<png_uint_32>(kMaxPicturePixels));
  png_set_chunk_cache_max(reader.png, kMaxTextChunks);
  png_set_chunk_malloc_max(reader.png, kMaxTextBytes);
  png_read_info(reader.png, reader.info);
  reader.stored_row_bytes = png_get_rowbytes(reader.png, reader.info);
  png_set_expand(reader.png);
  png_set_interlace_handling(reader.png);
  png_read_update_info(reader.png, reader.info);
  return true;
}

bool read_rows(Reader& reader, png_bytepp rows) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_read_image(reader.png, rows);
  png_read_end(reader.png, reader.info);
  return true;
}

std::string utf8_from_latin1(const char* text) {
  std::string out;
  for (; *text; ++text) {
    const auto c = static_cast<unsigned char>(*text);
    if (c < 0x80) {
      out += *text;
    } else {
      out += static_cast<char>(0xc0 | c >> 6);
      out += static_cast<char>(0x80 | (c & 0x3f));
    }
  }
  return out;
}

PictureText text_of(Reader& reader) {
  PictureText text;
  png_textp entries = nullptr;
  int count = 0;
  png_get_text(reader.png, reader.info, &entries, &count);
  for (int i = 0; i < count; ++i) {
    if (!entries[i].key || !entries[i].text) continue;
    const bool utf8 = entries[i].compression >= PNG_ITXT_COMPRESSION_NONE;
    text[utf8_from_latin1(entries[i].key)] = utf8 ? std::string(entries[i].text) : utf8_from_latin1(entries[i].text);
  }
  return text;
}

struct Writer {
  std::string bytes;
  PngFailure failure;
  png_structp png = nullptr;
  png_infop info = nullptr;

  Writer() {
    png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &failure, on_png_error, on_png_warning);
    if (png) info = png_create_info_struct(png);
  }
  ~Writer() { png_destroy_write_struct(&png, &info); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
};

void write_bytes(png_structp png, png_bytep data, size_t count) {
  auto* writer = static_cast<Writer*>(png_get_io_ptr(png));
  bool full = false;
  try {
    writer->bytes.append(reinterpret_cast<const char*>(data), count);
  } catch (...) {
    full = true;
  }
  if (full) png_error(png, "out of memory");
}
void flush_nothing(png_structp) {}

bool write_picture(Writer& writer, const Image8& image, png_bytepp rows, png_textp text, int text_count) {
  if (setjmp(png_jmpbuf(writer.png))) return false;
  png_set_write_fn(writer.png, &writer, write_bytes, flush_nothing);
  png_set_user_limits(writer.png, static_cast<png_uint_32>(kMaxPicturePixels),
                      static_cast<png_uint_32>(kMaxPicturePixels));
  png_set_IHDR(writer.png, writer.info, static_cast<png_uint_32>(image.width), static_cast<png_uint_32>(image.height),
               8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_sRGB_gAMA_and_cHRM(writer.png, writer.info, PNG_sRGB_INTENT_PERCEPTUAL);
  // Measured on 1280x720 of flat cells and gradients: 85 ms against 330 with the default level and filters, and 15 %
  // more bytes.
  png_set_compression_level(writer.png, 3);
  png_set_filter(writer.png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB | PNG_FILTER_UP);
  png_set_text(writer.png, writer.info, text, text_count);
  png_write_info(writer.png, writer.info);
  png_write_image(writer.png, rows);
  png_write_end(writer.png, writer.info);
  return true;
}

Status check_keys(const std::filesystem::path& path, const PictureText& text) {
  for (const auto& [key, value] : text) {
    const bool printable = std::all_of(key.begin(), key.end(), [](char c) { return c > ' ' && c <= '~'; });
    if (key.empty() || key.size() > 79 || !printable) {
      return input_error(
          fmt::format("{}: cannot write: the text key '{}' must have 1 to 79 printable ASCII characters without spaces",
                      path.string(), key));
    }
    if (value.find('\0') != std::string::npos) {
      return input_error(fmt::format("{}: cannot write: the text of '{}' holds a zero byte", path.string(), key));
    }
  }
  return {};
}

Result<PngFile> decode(const std::string& name, const std::vector<uint8_t>& bytes) {
  const auto broken = [&](const Reader& reader) {
    return input_error(fmt::format("{}: byte {} of {}: {}; expected a whole PNG picture", name, reader.position,
                                   bytes.size(), reader.failure.message));
  };
  if (bytes.size() < 8 || png_sig_cmp(bytes.data(), 0, 8) != 0) {
    return input_error(
        fmt::format("{}: is not a PNG picture: expected its signature in the first 8 bytes of {}", name, bytes.size()));
  }
  TRY_STATUS(world::check_png_chunks(bytes, name));
  Reader reader(bytes);
  if (!reader.png || !reader.info) return input_error(name + ": cannot read: libpng did not start");
  if (!read_header(reader)) return broken(reader);

  // Believe the size only where so many bytes can come out of this file.
  PngFile file;
  const uint64_t width = png_get_image_width(reader.png, reader.info);
  const uint64_t height = png_get_image_height(reader.png, reader.info);
  const uint64_t row_bytes = png_get_rowbytes(reader.png, reader.info);
  file.channels = png_get_channels(reader.png, reader.info);
  file.bits = png_get_bit_depth(reader.png, reader.info);
  if (width * height > static_cast<uint64_t>(kMaxPicturePixels) ||
      reader.stored_row_bytes * height > kDeflateExpansion * bytes.size()) {
    return input_error(
        fmt::format("{}: byte 16: claims {} x {} pixels, which {} bytes cannot hold or which is more than {} pixels",
                    name, width, height, bytes.size(), kMaxPicturePixels));
  }
  file.width = static_cast<int>(width), file.height = static_cast<int>(height);

  std::vector<uint8_t> raw(row_bytes * height);
  std::vector<png_bytep> rows(height);
  for (size_t y = 0; y < height; ++y) rows[y] = raw.data() + y * row_bytes;
  if (!read_rows(reader, rows.data())) return broken(reader);

  file.samples.resize(width * height * static_cast<uint64_t>(file.channels));
  for (size_t i = 0; i < file.samples.size(); ++i) {
    file.samples[i] = file.bits == 16 ? static_cast<uint16_t>(raw[2 * i] << 8 | raw[2 * i + 1]) : raw[i];
  }
  file.text = text_of(reader);
  return file;
}

Status encode(const std::filesystem::path& path, const Image8& image, const PictureText& text, Writer& writer) {
  if (!writer.png || !writer.info) return input_error(path.string() + ": cannot write: libpng did not start");
  std::vector<png_text> entries;
  for (const auto& [key, value] : text) {
    const bool ascii = std::all_of(value.begin(), value.end(), [](char c) { return static_cast<signed char>(c) > 0; });
    png_text entry{};
    entry.compression = ascii ? PNG_TEXT_COMPRESSION_NONE : PNG_ITXT_COMPRESSION_NONE;
    entry.key = const_cast<char*>(key.c_str());
    entry.text = const_cast<char*>(value.c_str());
    entry.text_length = value.size();
    entries.push_back(entry);
  }
  std::vector<png_bytep> rows(static_cast<size_t>(image.height));
  for (size_t y = 0; y < rows.size(); ++y) {
    rows[y] = const_cast<png_bytep>(image.pixels.data()) + y * static_cast<size_t>(image.width) * 3;
  }
  if (!write_picture(writer, image, rows.data(), entries.data(), static_cast<int>(entries.size()))) {
    return input_error(fmt::format("{}: cannot write: {}", path.string(), writer.failure.message));
  }
  return {};
}

}  // namespace

world::Status write_png(const std::filesystem::path& path, const Image8& image, const PictureText& text) {
  TRY_STATUS(check_keys(path, text));
  try {
    if (image.width < 1 || image.height < 1 ||
        image.pixels.size() != static_cast<size_t>(image.width) * static_cast<size_t>(image.height) * 3) {
      return input_error(fmt::format("{}: cannot write a picture of {} x {} pixels and {} bytes", path.string(),
                                     image.width, image.height, image.pixels.size()));
    }
    Writer writer;
    TRY_STATUS(encode(path, image, text, writer));
    return world::write_bytes_atomically(path, writer.bytes);
  } catch (const std::exception& e) {
    return input_error(fmt::format("{}: cannot write: {}", path.string(), e.what()));
  }
}

world::Result<PngFile> decode_png(const std::string& name, const std::vector<uint8_t>& bytes) {
  try {
    return decode(name, bytes);
  } catch (const std::exception& e) {
    return input_error(fmt::format("{}: cannot read: {}", name, e.what()));
  }
}

world::Result<PngFile> read_png(const std::filesystem::path& path) {
  TRY(const std::vector<uint8_t> bytes, world::read_file(path));
  return decode_png(path.string(), bytes);
}

Image8 image8_from_png(const PngFile& file) {
  Image8 image{file.width, file.height, {}};
  const size_t pixels = static_cast<size_t>(file.width) * static_cast<size_t>(file.height);
  const auto channels = static_cast<size_t>(file.channels);
  image.pixels.resize(pixels * 3);
  for (size_t i = 0; i < pixels; ++i) {
    for (size_t c = 0; c < 3; ++c) {
      const uint32_t v = file.samples[i * channels + (channels >= 3 ? c : 0)];
      // 65535 = 255 * 257, so this rounds to nearest.
      image.pixels[i * 3 + c] = static_cast<unsigned char>(file.bits == 16 ? (v + 128) / 257 : v);
    }
  }
  return image;
}

}  // namespace render
