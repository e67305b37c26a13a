#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <fmt/format.h>

#include "render/image/rows.h"
#include "world/base/file.h"

namespace render {

world::Status write_exr_rows(const std::filesystem::path& path, int width, int height, const PictureText& text,
                             const NextRows& next) {
  const auto failed = [&](const std::string& why) {
    return world::input_error(fmt::format("{}: cannot write: {}", path.string(), why));
  };
  if (width < 1 || height < 1 || int64_t{width} * height > int64_t{1} << 30) return failed("its size");
  return world::write_file_atomically(path, [&](const std::filesystem::path& temporary) -> world::Status {
    try {
      Imf::Header header(width, height);
      header.compression() = Imf::ZIP_COMPRESSION;
      for (const char* name : {"R", "G", "B"}) header.channels().insert(name, Imf::Channel(Imf::FLOAT));
      for (const auto& [key, value] : text)
        if (!key.empty() && header.find(key) == header.end()) header.insert(key, Imf::StringAttribute(value));
      Imf::OutputFile output(temporary.c_str(), header, 1);
      for (int y = 0; y < height;) {
        TRY(const Image rows, next());
        if (rows.width != width || rows.height < 1 || rows.height > height - y)
          return failed("rows of another size came");
        Imf::FrameBuffer frame;
        const auto window = Imath::V2i(0, y);
        const auto* floats = reinterpret_cast<const char*>(&rows.pixels[0].r);
        int band = 0;
        for (const char* name : {"R", "G", "B"})
          frame.insert(name,
                       Imf::Slice::Make(Imf::FLOAT, floats + sizeof(float) * static_cast<size_t>(band++), window, width,
                                        rows.height, sizeof(Rgb), sizeof(Rgb) * static_cast<size_t>(width)));
        output.setFrameBuffer(frame);
        output.writePixels(rows.height);
        y += rows.height;
      }
      return {};
    } catch (const std::exception& e) {
      return failed(e.what());
    }
  });
}

world::Status write_exr_layers(const std::filesystem::path& path, const Image& image, const Framebuffer& layers,
                               const PictureText& text) {
  const auto pixels = image.pixels.size();
  std::vector<float> depth, normal;
  std::vector<uint32_t> id;
  const PixelBuffer *z = layers[BufferKind::depth], *n = layers[BufferKind::normal], *m = layers[BufferKind::material];
  if (z) depth.reserve(pixels);
  if (n) normal.reserve(3 * pixels);
  if (m) id.reserve(pixels);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      if (z) depth.push_back(z->depth(x, y));
      if (n)
        for (int axis = 0; axis < 3; ++axis) normal.push_back(n->normal(x, y)[axis]);
      if (m) id.push_back(m->id(x, y));
    }
  return world::write_file_atomically(path, [&](const std::filesystem::path& temporary) -> world::Status {
    try {
      Imf::Header header(image.width, image.height);
      header.compression() = Imf::ZIP_COMPRESSION;
      Imf::FrameBuffer frame;
      const auto add = [&](const char* name, Imf::PixelType type, const void* first, size_t stride) {
        header.channels().insert(name, Imf::Channel(type));
        frame.insert(name, Imf::Slice::Make(type, first, Imath::V2i(0, 0), image.width, image.height, stride,
                                            stride * static_cast<size_t>(image.width)));
      };
      const float* radiance = &image.pixels[0].r;
      add("R", Imf::FLOAT, radiance, sizeof(Rgb)), add("G", Imf::FLOAT, radiance + 1, sizeof(Rgb));
      add("B", Imf::FLOAT, radiance + 2, sizeof(Rgb));
      if (z) add("Z", Imf::FLOAT, depth.data(), sizeof(float));
      if (n) {
        add("N.X", Imf::FLOAT, normal.data(), 3 * sizeof(float));
        add("N.Y", Imf::FLOAT, normal.data() + 1, 3 * sizeof(float));
        add("N.Z", Imf::FLOAT, normal.data() + 2, 3 * sizeof(float));
      }
      if (m) add("id", Imf::UINT, id.data(), sizeof(uint32_t));
      for (const auto& [key, value] : text)
        if (!key.empty() && header.find(key) == header.end()) header.insert(key, Imf::StringAttribute(value));
      Imf::OutputFile output(temporary.c_str(), header, 1);
      output.setFrameBuffer(frame);
      output.writePixels(image.height);
      return {};
    } catch (const std::exception& e) {
      return world::input_error(fmt::format("{}: cannot write: {}", path.string(), e.what()));
    }
  });
}

}  // namespace render
