// Errors of libpng are longjmps: each function that calls setjmp holds no object with a destructor.
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <memory>

#include <fmt/format.h>
#include <png.h>

#include "render/image/display.h"
#include "render/image/rows.h"
#include "world/base/file.h"

namespace render {
namespace {

using world::input_error;

struct PngStream {
  FILE* file = nullptr;
  png_structp png = nullptr;
  png_infop info = nullptr;
  char message[200] = "";

  PngStream() = default;
  PngStream(const PngStream&) = delete;
  PngStream& operator=(const PngStream&) = delete;
  ~PngStream() {
    png_destroy_write_struct(&png, &info);
    if (file) std::fclose(file);
  }
};

[[noreturn]] void on_error(png_structp png, png_const_charp message) {
  auto* stream = static_cast<PngStream*>(png_get_error_ptr(png));
  std::snprintf(stream->message, sizeof stream->message, "%s", message);
  png_longjmp(png, 1);
}
void on_warning(png_structp, png_const_charp) {}

bool begin(PngStream& s, int width, int height, png_textp text, int texts) {
  if (setjmp(png_jmpbuf(s.png))) return false;
  png_init_io(s.png, s.file);
  png_set_user_limits(s.png, 1u << 30, 1u << 30);
  png_set_IHDR(s.png, s.info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), 8, PNG_COLOR_TYPE_RGB,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_sRGB_gAMA_and_cHRM(s.png, s.info, PNG_sRGB_INTENT_PERCEPTUAL);
  png_set_compression_level(s.png, 3);  // as write_png
  png_set_filter(s.png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB | PNG_FILTER_UP);
  png_set_text(s.png, s.info, text, texts);
  png_write_info(s.png, s.info);
  return true;
}

bool put_rows(PngStream& s, const unsigned char* first, size_t row_bytes, int rows) {
  if (setjmp(png_jmpbuf(s.png))) return false;
  for (int y = 0; y < rows; ++y) png_write_row(s.png, first + static_cast<size_t>(y) * row_bytes);
  return true;
}

bool end(PngStream& s) {
  if (setjmp(png_jmpbuf(s.png))) return false;
  png_write_end(s.png, s.info);
  return true;
}

}  // namespace

world::Status write_png_rows(const std::filesystem::path& path, int width, int height, float exposure_ev,
                             const PictureText& text, const NextRows& next) {
  const auto failed = [&](const char* why) {
    return input_error(fmt::format("{}: cannot write: {}", path.string(), why));
  };
  if (width < 1 || height < 1 || int64_t{width} * height > int64_t{1} << 30) return failed("its size");
  return world::write_file_atomically(path, [&](const std::filesystem::path& temporary) -> world::Status {
    PngStream s;
    s.png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &s, on_error, on_warning);
    if (s.png) s.info = png_create_info_struct(s.png);
    s.file = std::fopen(temporary.c_str(), "wb");
    if (!s.info || !s.file) return failed("it can't be opened");
    std::vector<png_text> entries;
    for (const auto& [key, value] : text) {
      png_text entry{};
      entry.compression = PNG_ITXT_COMPRESSION_NONE;
      entry.key = const_cast<char*>(key.c_str());
      entry.text = const_cast<char*>(value.c_str());
      entry.text_length = value.size();
      entries.push_back(entry);
    }
    if (!begin(s, width, height, entries.data(), static_cast<int>(entries.size()))) return failed(s.message);
    for (int y = 0; y < height;) {
      TRY(const Image rows, next());
      if (rows.width != width || rows.height < 1 || rows.height > height - y)
        return failed("rows of another size came");
      const Image8 shown = display_image(rows, exposure_ev);
      if (!put_rows(s, shown.pixels.data(), size_t{3} * static_cast<size_t>(width), rows.height))
        return failed(s.message);
      y += rows.height;
    }
    if (!end(s)) return failed(s.message);
    if (std::fflush(s.file) != 0) return failed("the disk may be full");
    return {};
  });
}

}  // namespace render
