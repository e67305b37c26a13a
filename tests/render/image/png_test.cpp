#include <csignal>
#include <fstream>
#include <random>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <zlib.h>

#include "render/image/png_exr.h"
#include "tests/support.h"
#include "world/formats/format.h"

namespace render {
namespace {

using Bytes = std::vector<uint8_t>;

Image8 noise_picture(int width, int height) {
  Image8 image{width, height, std::vector<unsigned char>(static_cast<size_t>(width) * height * 3)};
  std::mt19937 random(1);
  for (unsigned char& c : image.pixels) c = static_cast<unsigned char>(random());
  return image;
}

void write_bytes(const std::filesystem::path& path, const Bytes& bytes) {
  std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
}

void put_u32(Bytes& out, uint32_t v) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<uint8_t>(v >> shift));
}

void put_chunk(Bytes& out, const std::string& type, const Bytes& data) {
  put_u32(out, static_cast<uint32_t>(data.size()));
  const size_t start = out.size();
  out.insert(out.end(), type.begin(), type.end());
  out.insert(out.end(), data.begin(), data.end());
  put_u32(out, static_cast<uint32_t>(crc32(0, out.data() + start, static_cast<uInt>(out.size() - start))));
}

/// A PNG by the specification, not by libpng: rows without filters, `rows` as stored.
Bytes hand_made_png(uint32_t width, uint32_t height, int bits, int colour_type, const Bytes& rows,
                    const Bytes& palette = {}, const Bytes& transparency = {}) {
  Bytes png = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  Bytes header;
  put_u32(header, width), put_u32(header, height);
  header.insert(header.end(), {static_cast<uint8_t>(bits), static_cast<uint8_t>(colour_type), 0, 0, 0});
  put_chunk(png, "IHDR", header);
  if (!palette.empty()) put_chunk(png, "PLTE", palette);
  if (!transparency.empty()) put_chunk(png, "tRNS", transparency);
  Bytes filtered;
  const size_t row = height ? rows.size() / height : 0;
  for (size_t i = 0; i < rows.size(); ++i) {
    if (i % row == 0) filtered.push_back(0);
    filtered.push_back(rows[i]);
  }
  uLongf size = compressBound(filtered.size());
  Bytes packed(size);
  compress(packed.data(), &size, filtered.data(), filtered.size());
  packed.resize(size);
  put_chunk(png, "IDAT", packed);
  put_chunk(png, "IEND", {});
  return png;
}

TEST(Png, PictureAndTextComeBackAsTheyWere) {
  const world::TemporaryFolder folder;
  const PictureText text = {{"scene", "valley"},
                            {"camera", "lake, looking north\nsecond line"},
                            {"knobs", std::string(5000, 'k')},
                            {"commit", "0123456789abcdef"},
                            {"world_hash", ""},
                            {"note", "Pyrénées 山"}};
  for (const auto& [w, h] : {std::pair{1, 1}, {3, 5}, {257, 130}}) {
    const Image8 image = noise_picture(w, h);
    ASSERT_TRUE(write_png(folder / "a.png", image, text).ok());
    const auto file = read_png(folder / "a.png");
    ASSERT_TRUE(file.ok()) << file.error().message;
    EXPECT_EQ(file->channels, 3);
    EXPECT_EQ(file->bits, 8);
    EXPECT_EQ(file->text, text);
    const Image8 back = image8_from_png(*file);
    EXPECT_EQ(back.width, w);
    EXPECT_EQ(back.height, h);
    EXPECT_EQ(back.pixels, image.pixels);
  }
}

TEST(Png, SamePictureGivesTheSameBytes) {
  const world::TemporaryFolder folder;
  const Image8 image = noise_picture(40, 30);
  ASSERT_TRUE(write_png(folder / "a.png", image, {{"scene", "x"}}).ok());
  ASSERT_TRUE(write_png(folder / "b.png", image, {{"scene", "x"}}).ok());
  EXPECT_EQ(*world::read_file(folder / "a.png"), *world::read_file(folder / "b.png"));
}

TEST(Png, EveryColourTypeAndDepthOfTheStandardIsRead) {
  const world::TemporaryFolder folder;
  struct Case {
    std::string name;
    Bytes png;
    int channels, bits;
    std::vector<uint16_t> samples;
    Bytes rgb;
  };
  const Case cases[] = {
      {"gray 1", hand_made_png(3, 1, 1, 0, {0b10100000}), 1, 8, {255, 0, 255}, {255, 255, 255, 0, 0, 0, 255, 255, 255}},
      {"gray 2", hand_made_png(2, 1, 2, 0, {0b01100000}), 1, 8, {85, 170}, {85, 85, 85, 170, 170, 170}},
      {"gray 8", hand_made_png(1, 2, 8, 0, {7, 200}), 1, 8, {7, 200}, {7, 7, 7, 200, 200, 200}},
      // 0x1234 / 257 = 18.13, 0xff7f / 257 = 254.502
      {"gray 16",
       hand_made_png(2, 1, 16, 0, {0x12, 0x34, 0xff, 0x7f}),
       1,
       16,
       {0x1234, 0xff7f},
       {18, 18, 18, 255, 255, 255}},
      {"gray alpha", hand_made_png(1, 1, 8, 4, {9, 128}), 2, 8, {9, 128}, {9, 9, 9}},
      {"rgb 8", hand_made_png(1, 1, 8, 2, {1, 2, 3}), 3, 8, {1, 2, 3}, {1, 2, 3}},
      {"rgb 16", hand_made_png(1, 1, 16, 2, {0, 128, 0, 129, 255, 255}), 3, 16, {128, 129, 65535}, {0, 1, 255}},
      {"rgba 8", hand_made_png(1, 1, 8, 6, {1, 2, 3, 0}), 4, 8, {1, 2, 3, 0}, {1, 2, 3}},
      {"rgba 16", hand_made_png(1, 1, 16, 6, {1, 1, 2, 2, 3, 3, 4, 4}), 4, 16, {257, 514, 771, 1028}, {1, 2, 3}},
      {"palette 4",
       hand_made_png(2, 1, 4, 3, {0x10}, {5, 6, 7, 8, 9, 10}),
       3,
       8,
       {8, 9, 10, 5, 6, 7},
       {8, 9, 10, 5, 6, 7}},
      {"palette 8 with transparency",
       hand_made_png(1, 1, 8, 3, {1}, {5, 6, 7, 8, 9, 10}, {255, 40}),
       4,
       8,
       {8, 9, 10, 40},
       {8, 9, 10}},
  };
  for (const Case& c : cases) {
    const auto file = decode_png("c.png", c.png);
    ASSERT_TRUE(file.ok()) << c.name << ": " << file.error().message;
    EXPECT_EQ(file->channels, c.channels) << c.name;
    EXPECT_EQ(file->bits, c.bits) << c.name;
    EXPECT_EQ(file->samples, c.samples) << c.name;
    EXPECT_EQ(image8_from_png(*file).pixels, c.rgb) << c.name;
  }
}

TEST(Png, CompressedAndLatin1TextIsRead) {
  const world::TemporaryFolder folder;
  Bytes png = hand_made_png(1, 1, 8, 0, {3});
  Bytes end(png.end() - 12, png.end());
  png.erase(png.end() - 12, png.end());
  put_chunk(png, "tEXt", {'A', 'u', 't', 'h', 'o', 'r', 0, 'R', 0xe9, 'm', 'i'});
  Bytes packed = {'L', 'o', 'n', 'g', 0, 0};
  const std::string value(3000, 'z');
  uLongf size = compressBound(value.size());
  Bytes z(size);
  compress(z.data(), &size, reinterpret_cast<const Bytef*>(value.data()), value.size());
  packed.insert(packed.end(), z.begin(), z.begin() + static_cast<long>(size));
  put_chunk(png, "zTXt", packed);
  png.insert(png.end(), end.begin(), end.end());
  write_bytes(folder / "t.png", png);
  const auto file = read_png(folder / "t.png");
  ASSERT_TRUE(file.ok()) << file.error().message;
  EXPECT_EQ(file->text, (PictureText{{"Author", "R\xc3\xa9mi"}, {"Long", value}}));
}

TEST(Png, TruncatedAnywhereIsOneSentenceWithThePath) {
  const world::TemporaryFolder folder;
  ASSERT_TRUE(write_png(folder / "whole.png", noise_picture(20, 20), {{"scene", "s"}}).ok());
  const Bytes whole = *world::read_file(folder / "whole.png");
  for (size_t length = 0; length < whole.size(); ++length) {
    const auto file = decode_png("cut.png", Bytes(whole.begin(), whole.begin() + static_cast<long>(length)));
    ASSERT_FALSE(file.ok()) << length;
    ASSERT_EQ(file.error().kind, world::ErrorKind::input_output);
    ASSERT_NE(file.error().message.find("cut.png"), std::string::npos);
    ASSERT_NE(file.error().message.find("expected"), std::string::npos);
    ASSERT_EQ(file.error().message.find('\n'), std::string::npos);
  }
}

TEST(Png, EveryFlippedByteGivesAnErrorOrAPictureOfBoundedSize) {
  const world::TemporaryFolder folder;
  ASSERT_TRUE(write_png(folder / "whole.png", noise_picture(6, 4), {{"scene", "s"}}).ok());
  const Bytes whole = *world::read_file(folder / "whole.png");
  int errors = 0;
  for (size_t i = 0; i < whole.size(); ++i) {
    Bytes changed = whole;
    changed[i] ^= 0x55;
    const auto file = decode_png("flip.png", changed);
    errors += file.ok() ? 0 : 1;
    if (file.ok()) {
      ASSERT_EQ(file->samples.size(), 6u * 4 * 3) << i;
    }
  }
  EXPECT_GT(errors, 90);  // signature, header and pixel data are all checked; text and colour chunks may be dropped
}

TEST(Png, HugeClaimedSizesAreRefusedBeforeMemoryIsTaken) {
  const world::TemporaryFolder folder;
  for (const auto& [w, h] :
       {std::pair{0x7fffffffu, 0x7fffffffu}, {65536u, 65536u}, {10000u, 10000u}, {1u, 100000000u}}) {
    const auto file = decode_png("huge.png", hand_made_png(w, h, 8, 2, {}));
    ASSERT_FALSE(file.ok()) << w << " x " << h;
    EXPECT_NE(file.error().message.find("huge.png"), std::string::npos);
  }
}

TEST(Png, AChunkThatClaimsMoreThanTheFileHasIsRefusedAtItsOffset) {
  Bytes png = hand_made_png(1, 1, 8, 0, {3});
  const size_t data_chunk = 8 + 12 + 13;
  png[data_chunk] = 0x70;  // the highest byte of the length of IDAT
  const auto file = decode_png("long.png", png);
  ASSERT_FALSE(file.ok());
  EXPECT_NE(file.error().message.find("long.png: byte 33: a chunk claims 1879048"), std::string::npos)
      << file.error().message;
}

TEST(Png, WrongKindsOfFileAreNamedAsSuch) {
  const world::TemporaryFolder folder;
  write_bytes(folder / "empty.png", {});
  write_bytes(folder / "text.png", {'h', 'e', 'l', 'l', 'o', ' ', 'y', 'o', 'u', '\n'});
  for (const char* name : {"empty.png", "text.png"}) {
    const auto file = read_png(folder / name);
    ASSERT_FALSE(file.ok());
    EXPECT_NE(file.error().message.find("is not a PNG picture"), std::string::npos) << file.error().message;
  }
  EXPECT_FALSE(read_png(folder / "missing.png").ok());
  EXPECT_FALSE(read_png(folder / "").ok());
}

TEST(Png, FailedWritesLeaveNothingBehind) {
  const world::TemporaryFolder folder;
  const Image8 image = noise_picture(4, 4);
  EXPECT_FALSE(write_png(folder / "no_such_folder/a.png", image).ok());
  EXPECT_FALSE(write_png(folder / "a.png", image, {{"two words", "x"}}).ok());
  EXPECT_FALSE(write_png(folder / "a.png", image, {{std::string(80, 'k'), "x"}}).ok());
  EXPECT_FALSE(write_png(folder / "a.png", image, {{"zero", std::string("a\0b", 3)}}).ok());
  EXPECT_FALSE(write_png(folder / "a.png", Image8{4, 4, {}}).ok());
  EXPECT_FALSE(write_png(folder / "a.png", Image8{}).ok());
  EXPECT_TRUE(std::filesystem::is_empty(folder / ""));
}

// A limit on file sizes stands for a full disk: the system refuses a write halfway.
TEST(Png, AWriteRefusedHalfwayKeepsTheOldFileAndLeavesNoOther) {
  const world::TemporaryFolder folder;
  ASSERT_TRUE(write_png(folder / "a.png", noise_picture(2, 2)).ok());
  const Bytes before = *world::read_file(folder / "a.png");
  rlimit old{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &old), 0);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = old;
  small.rlim_cur = 8192;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const auto status = write_png(folder / "a.png", noise_picture(200, 200));
  setrlimit(RLIMIT_FSIZE, &old);
  std::signal(SIGXFSZ, old_handler);
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("a.png"), std::string::npos);
  EXPECT_NE(status.error().message.find("File too large"), std::string::npos) << status.error().message;
  EXPECT_EQ(*world::read_file(folder / "a.png"), before);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder / ""), {}), 1);
}

}  // namespace
}  // namespace render
