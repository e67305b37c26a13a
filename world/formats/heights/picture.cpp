// PNG through libpng. Its errors are longjmps: functions that call setjmp hold no object with a destructor, and all
// that owns memory lives in their callers.
#include "world/formats/heights/picture.h"

#include <csetjmp>
#include <cstdio>
#include <cstring>

#include <fmt/format.h>
#include <png.h>

#include "world/base/png_chunks.h"
#include "world/formats/bytes.h"

namespace world {
namespace {

constexpr uint32_t kMostTexts = 64, kMostTextBytes = 1 << 16;

/// Posts that a picture may have: a file may take 16 bytes for each of its own and 256 MiB, and a post takes some 60
/// until it is land. Pictures of real land are hardly smaller than a byte a post.
constexpr uint64_t most_posts(uint64_t file_bytes) { return 3'000'000 + file_bytes; }

/// Pixels of colour, of which each takes 7 bytes while it is read.
constexpr uint64_t most_pixels(uint64_t file_bytes) { return 16'000'000 + 2 * file_bytes; }

struct Failure {
  char message[200] = "";
};
[[noreturn]] void on_error(png_structp png, png_const_charp message) {
  auto* failure = static_cast<Failure*>(png_get_error_ptr(png));
  std::snprintf(failure->message, sizeof failure->message, "%s", message);
  png_longjmp(png, 1);
}
void on_warning(png_structp, png_const_charp) {}

struct Reader {
  std::span<const uint8_t> bytes;
  size_t at = 0;
  Failure failure;
  png_structp png = nullptr;
  png_infop info = nullptr;

  explicit Reader(std::span<const uint8_t> b) : bytes(b) {
    png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &failure, on_error, on_warning);
    if (png) info = png_create_info_struct(png);
  }
  ~Reader() { png_destroy_read_struct(&png, &info, nullptr); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
};

void take_bytes(png_structp png, png_bytep out, size_t count) {
  auto* reader = static_cast<Reader*>(png_get_io_ptr(png));
  if (count > reader->bytes.size() - reader->at) {
    reader->at = reader->bytes.size();
    png_error(png, "the file ends too early");
  }
  std::memcpy(out, reader->bytes.data() + reader->at, count);
  reader->at += count;
}

bool read_head(Reader& reader, bool colours) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_set_read_fn(reader.png, &reader, take_bytes);
  png_set_user_limits(reader.png, 1 << 20, 1 << 20);
  png_set_chunk_cache_max(reader.png, kMostTexts);
  png_set_chunk_malloc_max(reader.png, kMostTextBytes);
  png_read_info(reader.png, reader.info);
  png_set_interlace_handling(reader.png);
  if (colours) {
    png_set_expand(reader.png);
    png_set_strip_16(reader.png);
    png_set_strip_alpha(reader.png);
    png_set_gray_to_rgb(reader.png);
  } else {
    png_set_swap(reader.png);  // 16-bit samples become little-endian
  }
  png_read_update_info(reader.png, reader.info);
  return true;
}

bool read_rows(Reader& reader, png_bytep* rows) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_read_image(reader.png, rows);
  png_read_end(reader.png, reader.info);
  return true;
}

struct Writer {
  std::string out;
  Failure failure;
  png_structp png = nullptr;
  png_infop info = nullptr;

  Writer() {
    png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &failure, on_error, on_warning);
    if (png) info = png_create_info_struct(png);
  }
  ~Writer() { png_destroy_write_struct(&png, &info); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
};

void put_bytes(png_structp png, png_bytep bytes, size_t count) {
  static_cast<Writer*>(png_get_io_ptr(png))->out.append(reinterpret_cast<const char*>(bytes), count);
}

bool write_all(Writer& writer, const HeightPicture& picture, png_text* texts, int text_count, png_bytep* rows) {
  if (setjmp(png_jmpbuf(writer.png))) return false;
  png_set_write_fn(writer.png, &writer, put_bytes, nullptr);
  png_set_IHDR(writer.png, writer.info, picture.width, picture.height, 16, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (text_count > 0) png_set_text(writer.png, writer.info, texts, text_count);
  png_write_info(writer.png, writer.info);
  png_set_swap(writer.png);
  png_write_image(writer.png, rows);
  png_write_end(writer.png, writer.info);
  return true;
}

}  // namespace

Result<HeightPicture> read_height_png(std::span<const uint8_t> bytes, std::string_view name) {
  TRY_STATUS(check_png_chunks(bytes, name));
  Reader reader(bytes);
  if (!reader.png || !reader.info) return input_error(fmt::format("{}: no memory for libpng", name));
  const auto failed = [&] {
    return byte_error(name, reader.at, fmt::format("the PNG is damaged or cut off: {}", reader.failure.message));
  };
  if (!read_head(reader, /*colours=*/false)) return failed();
  HeightPicture picture;
  picture.width = png_get_image_width(reader.png, reader.info);
  picture.height = png_get_image_height(reader.png, reader.info);
  picture.channels = png_get_channels(reader.png, reader.info);
  picture.bits = png_get_bit_depth(reader.png, reader.info);
  if (png_get_color_type(reader.png, reader.info) == PNG_COLOR_TYPE_PALETTE || picture.bits < 8)
    return byte_error(name, 16, "the PNG has a palette or fewer than 8 bits a sample; expected 16 bits of grey or RGB");
  const uint64_t count = uint64_t{picture.width} * picture.height * static_cast<uint64_t>(picture.channels);
  if (uint64_t{picture.width} * picture.height > most_posts(bytes.size()))
    return byte_error(name, 16,
                      fmt::format("the PNG claims {} x {} posts, which a file of {} bytes may not unpack to",
                                  picture.width, picture.height, bytes.size()));
  picture.samples.resize(count);
  std::vector<uint8_t> narrow(picture.bits == 8 ? count : 0);
  const size_t row_samples = size_t{picture.width} * static_cast<size_t>(picture.channels);
  std::vector<png_bytep> rows(picture.height);
  for (size_t row = 0; row < rows.size(); ++row)
    rows[row] = picture.bits == 8 ? narrow.data() + row * row_samples
                                  : reinterpret_cast<png_bytep>(picture.samples.data() + row * row_samples);
  if (!read_rows(reader, rows.data())) return failed();
  for (size_t i = 0; i < narrow.size(); ++i) picture.samples[i] = narrow[i];
  png_textp texts = nullptr;
  const int text_count = png_get_text(reader.png, reader.info, &texts, nullptr);
  for (int i = 0; i < text_count; ++i) picture.texts[texts[i].key] = texts[i].text;
  return picture;
}

Result<ColourPicture> read_colour_png(std::span<const uint8_t> bytes, std::string_view name) {
  Reader reader(bytes);
  if (!reader.png || !reader.info) return input_error(fmt::format("{}: no memory for libpng", name));
  const auto failed = [&] {
    return byte_error(name, reader.at, fmt::format("the PNG is damaged or cut off: {}", reader.failure.message));
  };
  if (!read_head(reader, /*colours=*/true)) return failed();
  ColourPicture picture;
  picture.width = png_get_image_width(reader.png, reader.info);
  picture.height = png_get_image_height(reader.png, reader.info);
  if (png_get_rowbytes(reader.png, reader.info) != size_t{3} * picture.width)
    return byte_error(name, 16, "the PNG has samples that don't become red, green and blue");
  const uint64_t count = uint64_t{picture.width} * picture.height;
  if (count > most_pixels(bytes.size()))
    return byte_error(name, 16,
                      fmt::format("the PNG claims {} x {} pixels, which a file of {} bytes may not unpack to",
                                  picture.width, picture.height, bytes.size()));
  std::vector<uint8_t> samples(3 * count);
  std::vector<png_bytep> rows(picture.height);
  for (size_t row = 0; row < rows.size(); ++row) rows[row] = samples.data() + row * 3 * picture.width;
  if (!read_rows(reader, rows.data())) return failed();
  picture.pixels.resize(count);
  for (size_t i = 0; i < count; ++i)
    picture.pixels[i] = uint32_t{samples[3 * i]} << 16 | uint32_t{samples[3 * i + 1]} << 8 | samples[3 * i + 2];
  return picture;
}

Result<std::string> write_height_png(const HeightPicture& picture, std::string_view name) {
  Writer writer;
  if (!writer.png || !writer.info) return input_error(fmt::format("{}: no memory for libpng", name));
  std::vector<png_text> texts;
  for (const auto& [key, text] : picture.texts) {
    png_text entry{};
    entry.compression = PNG_TEXT_COMPRESSION_NONE;
    entry.key = const_cast<png_charp>(key.c_str());
    entry.text = const_cast<png_charp>(text.c_str());
    texts.push_back(entry);
  }
  std::vector<png_bytep> rows(picture.height);
  for (size_t row = 0; row < rows.size(); ++row)
    rows[row] = reinterpret_cast<png_bytep>(const_cast<uint16_t*>(picture.samples.data()) + row * picture.width);
  if (!write_all(writer, picture, texts.data(), static_cast<int>(texts.size()), rows.data()))
    return input_error(fmt::format("{}: libpng cannot write it: {}", name, writer.failure.message));
  return std::move(writer.out);
}

}  // namespace world
