#include "render/trace/film.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <sstream>

#include <fmt/format.h>
#include <xxhash.h>

#include "world/formats/format.h"

namespace render {

namespace {

static_assert(std::endian::native == std::endian::little, "the film's file is little-endian");

constexpr char kMagic[] = {'L', 'O', 'A', 'M', 'F', 'I', 'L', 'M'};
constexpr uint32_t kVersion = 1;

struct Header {
  char magic[8];
  uint32_t version, width, height, samples;
  uint64_t text_bytes;
};
static_assert(sizeof(Header) == 32);

std::string lines_of(const std::map<std::string, std::string>& picture) {
  std::string text;
  for (const auto& [key, value] : picture) text += key + "=" + value + "\n";
  return text;
}

/// The first line of `have` that `want` lacks, or the other way round.
std::string first_difference(const std::string& have, const std::string& want) {
  std::istringstream a(have), b(want);
  std::string x, y;
  for (;;) {
    const bool more_a = static_cast<bool>(std::getline(a, x)), more_b = static_cast<bool>(std::getline(b, y));
    if (!more_a && !more_b) return "";
    if (!more_a) x.clear();
    if (!more_b) y.clear();
    if (x != y) return fmt::format("\"{}\" instead of \"{}\"", x.substr(0, 200), y.substr(0, 200));
  }
}

}  // namespace

void PixelSamples::add(const world::Vec3d& sample) {
  if (!std::isfinite(sample.x) || !std::isfinite(sample.y) || !std::isfinite(sample.z)) {
    ++rejected;
    return;
  }
  ++count;
  for (int b = 0; b < 3; ++b) {
    const double from_old = sample[b] - mean[b];
    mean[b] += from_old / count;
    squares[b] += from_old * (sample[b] - mean[b]);
  }
}

Film::Film(int width, int height)
    : width_(width), height_(height), pixels_(static_cast<size_t>(width) * static_cast<size_t>(height)) {}

Image Film::mean() const {
  Image image(width_, height_);
  for (size_t i = 0; i < pixels_.size(); ++i) {
    const double* m = pixels_[i].mean;
    image.pixels[i] = {static_cast<float>(m[0]), static_cast<float>(m[1]), static_cast<float>(m[2])};
  }
  return image;
}

Image Film::variance() const {
  Image image(width_, height_);
  for (size_t i = 0; i < pixels_.size(); ++i) {
    const PixelSamples& p = pixels_[i];
    if (p.count < 2) continue;
    const auto of = [&](int b) { return static_cast<float>(p.squares[b] / (p.count - 1)); };
    image.pixels[i] = {of(0), of(1), of(2)};
  }
  return image;
}

double Film::relative_error() const {
  double variances = 0, means = 0;
  for (const PixelSamples& p : pixels_) {
    if (p.count < 2) return std::numeric_limits<double>::infinity();
    for (int b = 0; b < 3; ++b) {
      variances += p.squares[b] / (p.count - 1) / p.count;
      means += p.mean[b];
    }
  }
  const double n = 3.0 * static_cast<double>(pixels_.size());
  return variances > 0 ? std::sqrt(variances / n) / std::abs(means / n) : 0;
}

uint64_t Film::rejected() const {
  uint64_t sum = 0;
  for (const PixelSamples& p : pixels_) sum += p.rejected;
  return sum;
}

world::Status Film::save(const std::filesystem::path& path, const std::map<std::string, std::string>& picture) const {
  const std::string text = lines_of(picture);
  Header header{{}, kVersion, static_cast<uint32_t>(width_), static_cast<uint32_t>(height_), samples, text.size()};
  std::memcpy(header.magic, kMagic, sizeof kMagic);
  std::string bytes(reinterpret_cast<const char*>(&header), sizeof header);
  bytes += text;
  bytes.append(reinterpret_cast<const char*>(pixels_.data()), pixels_.size() * sizeof(PixelSamples));
  const uint64_t hash = XXH3_64bits(bytes.data(), bytes.size());
  bytes.append(reinterpret_cast<const char*>(&hash), sizeof hash);
  return world::write_bytes_atomically(path, bytes);
}

world::Result<Film> Film::load(const std::filesystem::path& path, int width, int height,
                               const std::map<std::string, std::string>& picture) {
  TRY(const std::vector<uint8_t> bytes, world::read_file(path));
  const auto refuse = [&](const std::string& why) { return world::input_error(path.string() + ": " + why); };
  Header header;
  if (bytes.size() < sizeof header + 8 || std::memcmp(bytes.data(), kMagic, sizeof kMagic) != 0)
    return refuse("is no film of samples; expected a file that loam render --resume wrote");
  std::memcpy(&header, bytes.data(), sizeof header);
  if (header.version != kVersion)
    return refuse(fmt::format("has version {}, but this program reads version {}", header.version, kVersion));
  const uint64_t pixels = uint64_t{header.width} * header.height;
  if (header.text_bytes > bytes.size() || pixels > bytes.size() ||
      sizeof header + header.text_bytes + pixels * sizeof(PixelSamples) + 8 != bytes.size())
    return refuse(fmt::format("claims {} x {} pixels, which {} bytes can't hold; the file is cut off or damaged",
                              header.width, header.height, bytes.size()));
  uint64_t hash;
  std::memcpy(&hash, bytes.data() + bytes.size() - 8, 8);
  if (hash != XXH3_64bits(bytes.data(), bytes.size() - 8)) return refuse("is damaged: its checksum differs");
  if (header.width != static_cast<uint32_t>(width) || header.height != static_cast<uint32_t>(height))
    return refuse(fmt::format("holds a picture of {}x{}, not of {}x{}", header.width, header.height, width, height));
  const std::string text(reinterpret_cast<const char*>(bytes.data()) + sizeof header, header.text_bytes);
  if (const std::string wanted = lines_of(picture); text != wanted)
    return refuse("holds samples of another picture: " + first_difference(text, wanted));
  Film film(width, height);
  film.samples = header.samples;
  std::memcpy(static_cast<void*>(film.pixels_.data()), bytes.data() + sizeof header + header.text_bytes,
              pixels * sizeof(PixelSamples));
  return film;
}

}  // namespace render
