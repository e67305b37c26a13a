#include "render/trace/film.h"

#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>

#include <gtest/gtest.h>

#include "tests/support.h"
#include "world/base/random.h"

namespace render {
namespace {

using world::Vec3d;

const std::map<std::string, std::string> kPicture = {{"scene", "a"}, {"seed", "1"}};

Film noise(uint32_t begin, uint32_t end, Film film) {
  for (uint32_t s = begin; s < end; ++s)
    for (int y = 0; y < film.height(); ++y)
      for (int x = 0; x < film.width(); ++x) {
        const uint64_t bits = world::random_bits(1, x, y, s);
        film.at(x, y).add(Vec3d(world::uniform01_double(bits), world::uniform01_double(bits * 3), 2));
      }
  film.samples = end;
  return film;
}

bool same_bits(const Film& a, const Film& b) {
  for (int y = 0; y < a.height(); ++y)
    for (int x = 0; x < a.width(); ++x)
      if (std::memcmp(&a.at(x, y), &b.at(x, y), sizeof(PixelSamples)) != 0) return false;
  return a.width() == b.width() && a.height() == b.height() && a.samples == b.samples;
}

// Hard case N10: 1e7 samples, one in a thousand of them 1000 times as large.
TEST(Film, TheMeanOfTenMillionSamplesWithOutliersIsRightToOneInAMillion) {
  PixelSamples pixel;
  long double sum = 0;
  for (uint32_t i = 0; i < 10000000; ++i) {
    const uint64_t bits = world::mix64(i);
    const double v = world::uniform01_double(bits) * (bits % 1000 == 0 ? 1000 : 1);
    sum += v;
    pixel.add(Vec3d(v, 1, 0));
  }
  const double mean = static_cast<double>(sum / 10000000);
  EXPECT_NEAR(pixel.mean[0] / mean, 1, 1e-12);
  EXPECT_EQ(pixel.mean[1], 1);
  EXPECT_EQ(pixel.mean[2], 0);
}

TEST(Film, VarianceIsThatOfASampleAndStaysRightBesideALargeMean) {
  PixelSamples pixel;
  for (int i = 0; i < 1000; ++i) pixel.add(Vec3d(1e8 + (i & 1), i & 1, 5));
  // 500 zeros and 500 ones: sum of squared distances 250.
  EXPECT_NEAR(pixel.squares[0], 250, 1e-6);
  EXPECT_NEAR(pixel.squares[1], 250, 1e-10);
  EXPECT_EQ(pixel.squares[2], 0);
}

TEST(Film, RelativeErrorIsTheStandardErrorOverTheMean) {
  const Film film = noise(0, 64, Film(16, 16));
  // Two bands uniform on [0, 1] with variance 1/12, one constant 2: mean 1.
  EXPECT_NEAR(film.relative_error(), std::sqrt(2.0 / 3 / 12 / 64), 0.002);
  EXPECT_EQ(noise(0, 1, Film(2, 2)).relative_error(), std::numeric_limits<double>::infinity());
  Film black(1, 1);
  black.at(0, 0).add(Vec3d(0)), black.at(0, 0).add(Vec3d(0));
  EXPECT_EQ(black.relative_error(), 0);
}

TEST(Film, AFilmThatWasSavedGoesOnAsIfItHadNeverStopped) {
  const world::TemporaryFolder folder;
  const Film whole = noise(0, 100, Film(7, 5));
  const Film half = noise(0, 37, Film(7, 5));
  ASSERT_TRUE(half.save(folder / "film", kPicture).ok());
  const auto loaded = Film::load(folder / "film", 7, 5, kPicture);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  EXPECT_TRUE(same_bits(*loaded, half));
  EXPECT_TRUE(same_bits(noise(37, 100, *loaded), whole));
}

TEST(Film, AFileOfAnotherPictureOrADamagedOneIsRefused) {
  const world::TemporaryFolder folder;
  ASSERT_TRUE(noise(0, 3, Film(4, 4)).save(folder / "film", kPicture).ok());
  const auto refusal = [&](int width, const std::map<std::string, std::string>& picture) {
    const auto film = Film::load(folder / "film", width, 4, picture);
    return film.ok() ? std::string() : film.error().message;
  };
  EXPECT_EQ(refusal(4, kPicture), "");
  EXPECT_NE(refusal(5, kPicture).find("holds a picture of 4x4, not of 5x4"), std::string::npos);
  EXPECT_NE(refusal(4, {{"scene", "a"}, {"seed", "2"}}).find("\"seed=1\" instead of \"seed=2\""), std::string::npos);
  std::ifstream in(folder / "film", std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  for (size_t i = 0; i < bytes.size(); i += 7) {
    std::string damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ 16);
    std::ofstream(folder / "film", std::ios::binary) << damaged;
    EXPECT_NE(refusal(4, kPicture), "") << "byte " << i;
  }
  for (const size_t size : {size_t{0}, size_t{7}, size_t{31}, size_t{39}, bytes.size() - 1}) {
    std::ofstream(folder / "film", std::ios::binary) << bytes.substr(0, size);
    EXPECT_NE(refusal(4, kPicture), "") << size << " bytes";
  }
}

}  // namespace
}  // namespace render
