#include "render/gpu/shader_cache.h"

#include <algorithm>
#include <cstring>
#include <optional>

#include <fmt/format.h>
#include <spirv-tools/libspirv.h>
#include <xxhash.h>

#include "world/base/file.h"

namespace render::gpu {

namespace {

constexpr char kMagic[8] = {'L', 'O', 'A', 'M', 'S', 'P', 'I', 'R'};
constexpr uint32_t kVersion = 1;  // also of what specialise() does
constexpr uint64_t kMostBytes = uint64_t{1} << 24;

struct Header {
  char magic[8];
  uint32_t version, words;
  uint64_t hash;
};
static_assert(sizeof(Header) == 24);

std::string name_of(std::span<const uint32_t> code, std::span<const SpecialConstant> constants) {
  XXH3_state_t* state = XXH3_createState();
  XXH3_128bits_reset(state);
  const char* optimizer = spvSoftwareVersionString();
  XXH3_128bits_update(state, optimizer, std::strlen(optimizer));
  XXH3_128bits_update(state, &kVersion, sizeof kVersion);
  XXH3_128bits_update(state, code.data(), code.size_bytes());
  XXH3_128bits_update(state, constants.data(), constants.size_bytes());
  const XXH128_hash_t hash = XXH3_128bits_digest(state);
  XXH3_freeState(state);
  return fmt::format("{:016x}{:016x}.spv", hash.high64, hash.low64);
}

/// Nothing where the file isn't whole.
std::optional<std::vector<uint32_t>> read(const std::filesystem::path& path) {
  const auto bytes = world::read_file(path, kMostBytes);
  Header h;
  if (!bytes.ok() || bytes->size() < sizeof h) return std::nullopt;
  std::memcpy(&h, bytes->data(), sizeof h);
  const uint8_t* data = bytes->data() + sizeof h;
  const size_t size = bytes->size() - sizeof h;
  if (std::memcmp(h.magic, kMagic, sizeof kMagic) != 0 || h.version != kVersion || h.words == 0 ||
      size != size_t{h.words} * 4 || XXH64(data, size, 0) != h.hash)
    return std::nullopt;
  std::vector<uint32_t> words(h.words);
  std::memcpy(words.data(), data, size);
  return words;
}

/// Leaves room for a file more.
void forget_oldest(const std::filesystem::path& folder) {
  std::error_code ignored;
  std::vector<std::pair<std::filesystem::file_time_type, std::filesystem::path>> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored))
    if (entry.path().extension() == ".spv") files.emplace_back(entry.last_write_time(ignored), entry.path());
  if (files.size() < ShaderCache::kMostFiles) return;
  std::sort(files.begin(), files.end());
  // A quarter at once, so that not each new one looks at all.
  for (size_t i = 0; i < files.size() - ShaderCache::kMostFiles * 3 / 4; ++i)
    std::filesystem::remove(files[i].second, ignored);
}

}  // namespace

void ShaderCache::open(const std::filesystem::path& folder) {
  folder_ = folder.empty() ? std::filesystem::path() : folder / "shaders";
}

std::vector<uint32_t> ShaderCache::specialised(std::span<const uint32_t> code,
                                               std::span<const SpecialConstant> constants) {
  const std::filesystem::path file = folder_.empty() ? folder_ : folder_ / name_of(code, constants);
  std::error_code ignored;
  if (!file.empty() && std::filesystem::exists(file, ignored)) {
    if (auto words = read(file)) {
      ++found_;
      return std::move(*words);
    }
    if (damaged_++ == 0) first_damaged_ = file;
  }
  ++made_;
  std::vector<uint32_t> words = specialise(code, constants);
  if (!file.empty()) write(file, words);
  return words;
}

std::string ShaderCache::warning() const {
  if (damaged_ == 0) return {};
  if (damaged_ == 1) return fmt::format("the kept shader {} was damaged, and is made anew", first_damaged_.string());
  return fmt::format("{} kept shaders in {} were damaged, and are made anew", damaged_, folder_.string());
}

void ShaderCache::write(const std::filesystem::path& file, const std::vector<uint32_t>& words) const {
  const size_t size = words.size() * 4;
  if (size + sizeof(Header) > kMostBytes) return;
  // A cache that can't be kept is no fault.
  std::error_code ignored;
  std::filesystem::create_directories(folder_, ignored);
  if (ignored) return;
  forget_oldest(folder_);
  Header h{{}, kVersion, static_cast<uint32_t>(words.size()), XXH64(words.data(), size, 0)};
  std::memcpy(h.magic, kMagic, sizeof kMagic);
  std::string bytes(sizeof h + size, '\0');
  std::memcpy(bytes.data(), &h, sizeof h);
  std::memcpy(bytes.data() + sizeof h, words.data(), size);
  (void)world::write_bytes_atomically(file, bytes);
}

}  // namespace render::gpu
