#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <random>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfTiledOutputFile.h>
#include <gtest/gtest.h>

#include "render/image/png_exr.h"
#include "tests/support.h"
#include "world/formats/format.h"

namespace render {
namespace {

using Bytes = std::vector<uint8_t>;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

Image noise_picture(int width, int height) {
  Image image(width, height);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> value(-1.0f, 5.0f);
  for (Rgb& p : image.pixels) p = {value(random), value(random), value(random)};
  return image;
}

void write_bytes(const std::filesystem::path& path, const Bytes& bytes) {
  std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
}

/// Writes with OpenEXR itself: any channels, each pixel of channel c = 1000 c + 10 y + x.
void write_channels(const std::filesystem::path& path, int width, int height, const std::vector<std::string>& names,
                    Imf::PixelType type, Imf::Compression compression, Imath::V2i origin = Imath::V2i(0, 0),
                    bool tiled = false) {
  Imf::Header header(Imath::Box2i(Imath::V2i(0, 0), Imath::V2i(width - 1, height - 1)),
                     Imath::Box2i(origin, origin + Imath::V2i(width - 1, height - 1)));
  header.compression() = compression;
  std::vector<std::vector<float>> floats(names.size());
  std::vector<std::vector<half>> halves(names.size());
  std::vector<std::vector<unsigned>> ints(names.size());
  Imf::FrameBuffer frame;
  for (size_t c = 0; c < names.size(); ++c) {
    header.channels().insert(names[c], Imf::Channel(type));
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const unsigned v = static_cast<unsigned>(1000 * c) + static_cast<unsigned>(10 * y + x);
        floats[c].push_back(static_cast<float>(v));
        halves[c].push_back(half(static_cast<float>(v)));
        ints[c].push_back(v);
      }
    }
    const void* data = type == Imf::FLOAT  ? static_cast<void*>(floats[c].data())
                       : type == Imf::HALF ? static_cast<void*>(halves[c].data())
                                           : static_cast<void*>(ints[c].data());
    const size_t size = type == Imf::HALF ? 2 : 4;
    frame.insert(names[c],
                 Imf::Slice::Make(type, data, origin, width, height, size, size * static_cast<size_t>(width)));
  }
  if (tiled) {
    header.setTileDescription(Imf::TileDescription(4, 4));
    Imf::TiledOutputFile out(path.c_str(), header);
    out.setFrameBuffer(frame);
    out.writeTiles(0, out.numXTiles() - 1, 0, out.numYTiles() - 1);
  } else {
    Imf::OutputFile out(path.c_str(), header);
    out.setFrameBuffer(frame);
    out.writePixels(height);
  }
}

TEST(Exr, FloatsAndAttributesComeBackBitForBit) {
  const world::TemporaryFolder folder;
  Image image = noise_picture(37, 21);
  image.pixels[0] = {-1e30f, 3.4e38f, 1e-40f};
  image.pixels[1] = {kInfinity, -kInfinity, kNan};
  image.pixels[2] = {0.0f, -0.0f, 1.0f};
  const PictureText text = {
      {"scene", "valley"}, {"camera", "lake"}, {"knobs", "shadows=1\nlod=2"},
      {"commit", "abc"},   {"world_hash", ""}, {"a_name_that_is_longer_than_the_31_bytes_of_old", "Pyrénées"}};
  ASSERT_TRUE(write_exr(folder / "a.exr", image, text).ok());
  const auto file = read_exr(folder / "a.exr");
  ASSERT_TRUE(file.ok()) << file.error().message;
  ASSERT_EQ(file->image.width, 37);
  ASSERT_EQ(file->image.height, 21);
  EXPECT_EQ(std::memcmp(file->image.pixels.data(), image.pixels.data(), image.pixels.size() * sizeof(Rgb)), 0);
  EXPECT_EQ(file->text, text);
}

// N7: 65504 stays, 65520 would be infinity and is clamped, 2049 -> 2048, 1e-8 -> 0.
TEST(HardCaseN7, HalfPicturesClampWhatDoesNotFit) {
  const world::TemporaryFolder folder;
  Image image(3, 1);
  image.pixels[0] = {65504.0f, 65520.0f, -1e9f};
  image.pixels[1] = {2049.0f, 1e-8f, kNan};
  image.pixels[2] = {kInfinity, -kInfinity, -0.25f};
  ASSERT_TRUE(write_exr(folder / "h.exr", image, {}, ExrPrecision::half).ok());
  const auto file = read_exr(folder / "h.exr");
  ASSERT_TRUE(file.ok()) << file.error().message;
  const auto& p = file->image.pixels;
  EXPECT_EQ(p[0], (Rgb{65504.0f, 65504.0f, -65504.0f}));
  EXPECT_EQ(p[1].r, 2048.0f);
  EXPECT_EQ(p[1].g, 0.0f);
  EXPECT_TRUE(std::isnan(p[1].b));
  EXPECT_EQ(p[2], (Rgb{kInfinity, -kInfinity, -0.25f}));
}

TEST(Exr, HalfErrorIsWithinTheStatedBound) {
  const world::TemporaryFolder folder;
  Image image(4096, 1);
  std::mt19937 random(3);
  for (Rgb& p : image.pixels) {
    const auto any = [&] {
      return std::ldexp(static_cast<float>(random()), -32 - 28 + static_cast<int>(random() % 44));
    };
    p = {any(), -any(), any()};
  }
  ASSERT_TRUE(write_exr(folder / "h.exr", image, {}, ExrPrecision::half).ok());
  const auto file = read_exr(folder / "h.exr");
  ASSERT_TRUE(file.ok());
  for (size_t i = 0; i < image.pixels.size(); ++i) {
    const Rgb a = image.pixels[i], b = file->image.pixels[i];
    for (const auto& [x, y] : {std::pair{a.r, b.r}, {a.g, b.g}, {a.b, b.b}}) {
      const float bound = std::max(std::abs(x) * 0x1p-11f, 0x1p-25f);
      if (std::abs(x) <= 65504) {
        ASSERT_LE(std::abs(x - y), bound) << x;
      }
    }
  }
}

TEST(Exr, EveryCommonLayoutIsRead) {
  const world::TemporaryFolder folder;
  const std::filesystem::path path = folder / "x.exr";
  const auto expect_rgb = [&](const char* what, int r, int g, int b) {
    const auto file = read_exr(path);
    ASSERT_TRUE(file.ok()) << what << ": " << file.error().message;
    ASSERT_EQ(file->image.width, 9) << what;
    ASSERT_EQ(file->image.height, 7) << what;
    EXPECT_EQ(file->image.at(0, 0), (Rgb{float(r), float(g), float(b)})) << what;
    EXPECT_EQ(file->image.at(8, 6), (Rgb{float(r + 68), float(g + 68), float(b + 68)})) << what;
  };
  for (const auto compression : {Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION, Imf::ZIPS_COMPRESSION, Imf::ZIP_COMPRESSION,
                                 Imf::PIZ_COMPRESSION, Imf::PXR24_COMPRESSION}) {
    write_channels(path, 9, 7, {"R", "G", "B"}, Imf::HALF, compression);
    expect_rgb("compressed", 0, 1000, 2000);
  }
  write_channels(path, 9, 7, {"A", "B", "G", "R", "Z"}, Imf::FLOAT, Imf::ZIP_COMPRESSION);
  expect_rgb("with alpha and depth", 3000, 2000, 1000);
  write_channels(path, 9, 7, {"Y"}, Imf::FLOAT, Imf::PIZ_COMPRESSION);
  expect_rgb("gray", 0, 0, 0);
  write_channels(path, 9, 7, {"R", "G", "B"}, Imf::UINT, Imf::ZIP_COMPRESSION);
  expect_rgb("integers", 0, 1000, 2000);
  write_channels(path, 9, 7, {"R", "G", "B"}, Imf::FLOAT, Imf::ZIP_COMPRESSION, Imath::V2i(-5, 1000));
  expect_rgb("data window elsewhere", 0, 1000, 2000);
  write_channels(path, 9, 7, {"R", "G", "B"}, Imf::FLOAT, Imf::ZIP_COMPRESSION, Imath::V2i(0, 0), true);
  expect_rgb("tiles", 0, 1000, 2000);
  for (const auto lossy : {Imf::B44_COMPRESSION, Imf::B44A_COMPRESSION, Imf::DWAA_COMPRESSION, Imf::DWAB_COMPRESSION}) {
    write_channels(path, 9, 7, {"R", "G", "B"}, Imf::HALF, lossy);
    const auto file = read_exr(path);
    ASSERT_TRUE(file.ok()) << file.error().message;
    EXPECT_NEAR(file->image.at(4, 3).b, 2034, 20);
  }
}

TEST(Exr, ALargeFlatPictureIsReadWhateverItsCompression) {
  const world::TemporaryFolder folder;
  for (int method = 0; method < Imf::NUM_COMPRESSION_METHODS; ++method) {
    Imf::Header header(1024, 1024);
    header.compression() = static_cast<Imf::Compression>(method);
    const std::vector<half> black(size_t{1024} * 1024);
    Imf::FrameBuffer frame;
    for (const char* name : {"R", "G", "B"}) {
      header.channels().insert(name, Imf::Channel(Imf::HALF));
      frame.insert(name, Imf::Slice::Make(Imf::HALF, black.data(), Imath::V2i(0, 0), int64_t{1024}, int64_t{1024},
                                          size_t{2}, size_t{2048}));
    }
    {
      Imf::OutputFile out((folder / "flat.exr").c_str(), header);
      out.setFrameBuffer(frame);
      out.writePixels(1024);
    }
    const auto file = read_exr(folder / "flat.exr");
    ASSERT_TRUE(file.ok()) << method << ": " << file.error().message;
  }
}

TEST(Exr, ChannelsThatAreNotColourAreNamed) {
  const world::TemporaryFolder folder;
  write_channels(folder / "uv.exr", 4, 4, {"U", "V"}, Imf::FLOAT, Imf::ZIP_COMPRESSION);
  const auto file = read_exr(folder / "uv.exr");
  ASSERT_FALSE(file.ok());
  EXPECT_NE(file.error().message.find("channels U V"), std::string::npos) << file.error().message;
  EXPECT_NE(file.error().message.find("uv.exr"), std::string::npos);
}

TEST(Exr, TruncatedAnywhereIsOneSentenceWithThePath) {
  const world::TemporaryFolder folder;
  ASSERT_TRUE(write_exr(folder / "whole.exr", noise_picture(12, 20), {{"scene", "s"}}).ok());
  const Bytes whole = *world::read_file(folder / "whole.exr");
  // Every byte of the header, then every 17th: OpenEXR takes 3 ms to give up on missing blocks.
  for (size_t length = 0; length < whole.size(); length += length < 500 ? 1 : 17) {
    const auto file = decode_exr("cut.exr", Bytes(whole.begin(), whole.begin() + static_cast<long>(length)));
    ASSERT_FALSE(file.ok()) << length;
    ASSERT_EQ(file.error().kind, world::ErrorKind::input_output);
    ASSERT_NE(file.error().message.find("cut.exr"), std::string::npos);
    ASSERT_EQ(file.error().message.find('\n'), std::string::npos) << file.error().message;
  }
}

TEST(Exr, EveryChangedByteGivesAnErrorOrAPicture) {
  const world::TemporaryFolder folder;
  ASSERT_TRUE(write_exr(folder / "whole.exr", noise_picture(6, 4), {{"scene", "s"}}).ok());
  const Bytes whole = *world::read_file(folder / "whole.exr");
  int errors = 0;
  for (size_t i = 0; i < whole.size(); ++i) {
    for (const uint8_t flip : {0x01, 0x80, 0xff}) {
      Bytes changed = whole;
      changed[i] ^= flip;
      const auto file = decode_exr("flip.exr", changed);
      errors += file.ok() ? 0 : 1;
      if (file.ok()) {
        ASSERT_LE(file->image.pixels.size(), size_t{1} << 24) << i;
      }
    }
  }
  EXPECT_GT(errors, 300);
}

TEST(Exr, HugeClaimedSizesAreRefusedBeforeMemoryIsTaken) {
  const world::TemporaryFolder folder;
  ASSERT_TRUE(write_exr(folder / "small.exr", Image(4, 4)).ok());
  const Bytes small = *world::read_file(folder / "small.exr");
  const std::string needle("dataWindow\0box2i\0\x10\0\0\0", 21);
  const auto found = std::search(small.begin(), small.end(), needle.begin(), needle.end());
  ASSERT_NE(found, small.end());
  const size_t at = static_cast<size_t>(found - small.begin()) + needle.size();
  const int32_t limit = std::numeric_limits<int32_t>::max();
  for (const auto& [w, h] : {std::pair{limit, limit},
                             {limit, 0},
                             {0, limit},
                             {65535, 65535},
                             {3, 100000},
                             {9999, 9999},
                             {-1, 3},
                             {3, -1},
                             {-limit, -limit}}) {
    Bytes changed = small;
    std::memcpy(changed.data() + at + 8, &w, 4);
    std::memcpy(changed.data() + at + 12, &h, 4);
    const auto file = decode_exr("huge.exr", changed);
    ASSERT_FALSE(file.ok()) << w << " x " << h;
    EXPECT_NE(file.error().message.find("huge.exr: byte"), std::string::npos) << file.error().message;
    EXPECT_NE(file.error().message.find("claims"), std::string::npos) << file.error().message;
  }
}

TEST(Exr, WrongKindsOfFileAreNamedAsSuch) {
  const world::TemporaryFolder folder;
  write_bytes(folder / "empty.exr", {});
  write_bytes(folder / "png.exr", {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'});
  for (const char* name : {"empty.exr", "png.exr"}) {
    const auto file = read_exr(folder / name);
    ASSERT_FALSE(file.ok());
    EXPECT_NE(file.error().message.find("is not an EXR picture"), std::string::npos) << file.error().message;
  }
  EXPECT_FALSE(read_exr(folder / "missing.exr").ok());
}

TEST(Exr, FailedWritesLeaveNothingBehind) {
  const world::TemporaryFolder folder;
  EXPECT_FALSE(write_exr(folder / "a.exr", Image{}).ok());
  EXPECT_FALSE(write_exr(folder / "a.exr", Image(2, 2), {{"compression", "x"}}).ok());
  EXPECT_FALSE(write_exr(folder / "a.exr", Image(2, 2), {{"", "x"}}).ok());
  EXPECT_FALSE(write_exr(folder / "none/a.exr", Image(2, 2)).ok());
  EXPECT_TRUE(std::filesystem::is_empty(folder / ""));
}

/// Means and extremes that an independent program (libOpenEXR through another reader) found; 8 and 6 digits given.
struct Reference {
  const char* name;
  int width, height;
  double mean[3], min[3], max[3];  // R, G, B
};
constexpr Reference kReferences[] = {
#include "tests/render/image/exr_references.inc"
};

class ExrReference : public testing::TestWithParam<Reference> {};

TEST_P(ExrReference, HasTheKnownMeansAndExtremes) {
  const Reference& known = GetParam();
  const auto path = world::shared_data(known.name);
  if (!path) GTEST_SKIP();
  const auto file = read_exr(*path);
  ASSERT_TRUE(file.ok()) << file.error().message;
  ASSERT_EQ(file->image.width, known.width);
  ASSERT_EQ(file->image.height, known.height);
  for (int c = 0; c < 3; ++c) {
    double sum = 0, least = 1e300, most = -1e300;
    for (const Rgb& p : file->image.pixels) {
      const double v = c == 0 ? p.r : c == 1 ? p.g : p.b;
      sum += v, least = std::min(least, v), most = std::max(most, v);
    }
    const double mean = sum / static_cast<double>(file->image.pixels.size());
    // Half a unit of the last digit printed.
    EXPECT_NEAR(mean, known.mean[c], std::abs(known.mean[c]) * 6e-8) << "RGB"[c];
    EXPECT_NEAR(least, known.min[c], std::abs(known.min[c]) * 6e-6) << "RGB"[c];
    EXPECT_NEAR(most, known.max[c], std::abs(known.max[c]) * 6e-6) << "RGB"[c];
  }
}

std::string reference_name(const testing::TestParamInfo<Reference>& reference) {
  std::string name = reference.param.name;
  for (char& c : name) {
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  }
  return name;
}
INSTANTIATE_TEST_SUITE_P(SharedFiles, ExrReference, testing::ValuesIn(kReferences), reference_name);

}  // namespace
}  // namespace render
