#include "render/image/hdr.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include <gtest/gtest.h>

#include "tests/support.h"
#include "world/base/random.h"
#include "world/formats/format.h"

namespace render {
namespace {

std::vector<uint8_t> bytes_of(const std::string& text) { return {text.begin(), text.end()}; }

constexpr const char* kHead = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n";

std::string picture(const std::string& size, const std::string& data) { return kHead + size + "\n" + data; }
/// Mantissas 64, 128, 32 with the exponent of 1/256 of 2^1: 0.5, 1, 0.25.
const std::string kPixel = "\x40\x80\x20\x81";

void expect_pixel(const Rgb& p) {
  EXPECT_EQ(p.r, 0.5f);
  EXPECT_EQ(p.g, 1.0f);
  EXPECT_EQ(p.b, 0.25f);
}

std::string error_of(const std::string& text) {
  const auto image = decode_hdr("a.hdr", bytes_of(text));
  return image.ok() ? "" : image.error().message;
}

TEST(Hdr, ValuesAreMantissaTimesTwoToTheExponentLess136) {
  const auto image = decode_hdr("a.hdr", bytes_of(picture("-Y 1 +X 2", kPixel + std::string("\xff\xff\xff\0", 4))));
  ASSERT_TRUE(image.ok()) << image.error().message;
  ASSERT_EQ(image->width, 2);
  expect_pixel(image->at(0, 0));
  EXPECT_EQ(image->at(1, 0).r, 0);  // exponent 0
}

TEST(Hdr, RunsOfBothKindsAndAllFlipsAreRead) {
  // Old: a pixel, repeated 2 times, and 1 * 256 times more.
  const auto old = decode_hdr("a.hdr", bytes_of(picture("-Y 1 +X 259", kPixel + "\x01\x01\x01\x02\x01\x01\x01\x01")));
  ASSERT_TRUE(old.ok()) << old.error().message;
  expect_pixel(old->at(258, 0));
  // New: by channel; 7 equal and 3 told.
  std::string rows = std::string("\x02\x02\x00\x0a", 4);
  for (const char value : kPixel) rows += std::string("\x87", 1) + value + "\x03" + std::string(2, value) + "\x01";
  for (const auto& [size, x, y] : {std::tuple{"-Y 1 +X 10", 9, 0}, {"-Y 1 -X 10", 0, 0}, {"+Y 1 +X 10", 9, 0}}) {
    const auto image = decode_hdr("a.hdr", bytes_of(picture(size, rows)));
    ASSERT_TRUE(image.ok()) << image.error().message;
    for (int i = 0; i < 10; ++i)
      if (i != x) expect_pixel(image->at(i, 0));
    EXPECT_EQ(image->at(x, y).g, std::ldexp(1.0f, 1 - 136));
  }
  const auto flipped = decode_hdr("a.hdr", bytes_of(picture("+Y 2 +X 1", kPixel + std::string(4, '\0'))));
  ASSERT_TRUE(flipped.ok());
  expect_pixel(flipped->at(0, 1));
}

TEST(Hdr, ExposuresAreTakenBack) {
  const auto image =
      decode_hdr("a.hdr", bytes_of("#?RGBE\nEXPOSURE=4\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=0.5\n\n-Y 1 +X 1\n" + kPixel));
  ASSERT_TRUE(image.ok()) << image.error().message;
  EXPECT_EQ(image->at(0, 0).g, 0.5f);
}

TEST(Hdr, DamageIsNamedWithItsByte) {
  EXPECT_NE(error_of("P6\n").find("is not a Radiance picture"), std::string::npos);
  EXPECT_NE(error_of("#?RADIANCE\n").find("header ends too early"), std::string::npos);
  EXPECT_NE(error_of("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n").find("32-bit_rle_xyze"), std::string::npos);
  EXPECT_NE(error_of("#?RADIANCE\nEXPOSURE=0\n\n").find("exposure"), std::string::npos);
  EXPECT_NE(error_of(picture("+X 1 -Y 1", kPixel)).find("expected a resolution"), std::string::npos);
  EXPECT_NE(error_of(picture("-Y 0 +X 1", kPixel)).find("claims 1 x 0"), std::string::npos);
  EXPECT_NE(error_of(picture("-Y 99999 +X 99999", kPixel)).find("claims 99999 x 99999"), std::string::npos);
  EXPECT_NE(error_of(picture("-Y 1 +X 2", kPixel)).find("ends too early"), std::string::npos);
  EXPECT_NE(error_of(picture("-Y 1 +X 2", "\x01\x01\x01\x01")).find("run of 1 leaves its row"), std::string::npos);
  EXPECT_NE(error_of(picture("-Y 1 +X 2", kPixel + "\x01\x01\x01\x02")).find("run of 2 leaves"), std::string::npos);
  EXPECT_NE(error_of(picture("-Y 1 +X 10", std::string("\x02\x02\x00\x0b", 4))).find("claims 11"), std::string::npos);
  EXPECT_NE(error_of(picture("-Y 1 +X 10", std::string("\x02\x02\x00\x0a\x8b\x01", 6))).find("run of 11"),
            std::string::npos);
  EXPECT_NE(error_of(picture("-Y 1 +X 10", std::string("\x02\x02\x00\x0a\x00\x01", 6))).find("run of 0"),
            std::string::npos);
}

/// The numbers of FACTS.md, which a reader of its own made.
TEST(Hdr, ARealSkyHasItsKnownValues) {
  const auto path = world::shared_data("hdri/kiara_1_dawn_1k.hdr");
  if (!path) return;
  const auto image = read_hdr(*path);
  ASSERT_TRUE(image.ok()) << image.error().message;
  ASSERT_EQ(image->width, 1024);
  ASSERT_EQ(image->height, 512);
  double sum[3] = {}, integral[3] = {};
  Rgb most;
  double brightest = 0;
  int brightest_at = 0;
  for (int y = 0; y < 512; ++y) {
    const double sine = std::sin(3.14159265358979 * (y + 0.5) / 512),
                 weight = sine * 2 * 3.14159265358979 / 1024 * 3.14159265358979 / 512;
    for (int x = 0; x < 1024; ++x) {
      const Rgb& p = image->at(x, y);
      sum[0] += p.r, sum[1] += p.g, sum[2] += p.b;
      integral[0] += p.r * weight, integral[1] += p.g * weight, integral[2] += p.b * weight;
      const double luminance = 0.2126 * p.r + 0.7152 * p.g + 0.0722 * p.b;
      if (luminance > brightest) brightest = luminance, brightest_at = y * 1024 + x;
      most = {std::max(most.r, p.r), std::max(most.g, p.g), std::max(most.b, p.b)};
    }
  }
  EXPECT_NEAR(sum[0] / (1024 * 512), 0.867711, 1e-6);
  EXPECT_NEAR(sum[1] / (1024 * 512), 0.614499, 1e-6);
  EXPECT_NEAR(sum[2] / (1024 * 512), 1.016479, 1e-6);
  EXPECT_EQ(most, (Rgb{102.5f, 40, 22.5f}));
  EXPECT_EQ(brightest_at, 245 * 1024 + 646);
  EXPECT_NEAR(integral[0], 13.818961, 1e-3);
  EXPECT_NEAR(integral[1], 9.20769, 1e-3);
  EXPECT_NEAR(integral[2], 14.136335, 1e-3);
}

/// Any damage gives an error or a picture, and never more memory than the file is worth; run under the sanitizers too.
TEST(Hdr, AnyDamageIsSurvived) {
  const auto path = world::shared_data("hdri/kiara_1_dawn_1k.hdr");
  if (!path) return;
  auto whole = world::read_file(*path);
  ASSERT_TRUE(whole.ok());
  whole->resize(60000);
  // So that what is left is a whole picture of fewer rows.
  std::string text(whole->begin(), whole->end());
  text.replace(text.find("-Y 512"), 6, "-Y 016");
  ASSERT_TRUE(decode_hdr("a.hdr", bytes_of(text)).ok());
  int refused = 0;
  for (int i = 0; i < 300; ++i) {
    std::vector<uint8_t> damaged = bytes_of(text);
    const uint64_t bits = world::random_bits(3, i, 0, 0);
    if (i % 3 == 0)
      damaged.resize(bits % damaged.size());
    else
      damaged[bits % (i % 3 == 1 ? 200 : damaged.size())] ^= static_cast<uint8_t>(1u << (bits >> 60));
    const auto image = decode_hdr("a.hdr", damaged);
    refused += !image.ok();
    EXPECT_TRUE(!image.ok() || image->pixels.size() <= size_t{1} << 20);
  }
  EXPECT_GT(refused, 30);  // most cuts; what lies behind the last row is not looked at
}

}  // namespace
}  // namespace render
