#include "world/saves/assets.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include <fmt/format.h>
#include <xxhash.h>

#include "world/media/brick_field.h"
#include "world/saves/frame.h"

namespace world {

namespace {

static_assert(std::endian::native == std::endian::little);  // as all bytes of saves are
static_assert(sizeof(FieldLeaf) == 12 + 4 * kLeafVoxels && sizeof(Vec3f) == 12 && sizeof(Radiance3) == 12);

constexpr size_t kMostPacked = 16;  // times that a frame may be smaller than what it holds
constexpr int kLevel = 3;

template <class T>
std::string_view bytes_of(const T* values, size_t count) {
  return {reinterpret_cast<const char*>(values), count * sizeof(T)};
}

template <size_t n>
void put_counts(ByteSink sink, const uint64_t (&counts)[n]) {
  sink(bytes_of(counts, n));
}

/// Cuts what is written into parts.
template <class Visit>
void cut(const std::function<void(ByteSink)>& write, Visit visit) {
  std::string part;
  size_t number = 0;
  const auto sink = [&](std::string_view bytes) {
    while (!bytes.empty()) {
      const size_t n = std::min(bytes.size(), kAssetPartBytes - part.size());
      part.append(bytes.substr(0, n));
      bytes.remove_prefix(n);
      if (part.size() < kAssetPartBytes) continue;
      visit(number++, part);
      part.clear();
    }
  };
  write(sink);
  if (!part.empty()) visit(number, part);
}

Asset made(std::function<void(ByteSink)> write) {
  Asset asset{{}, std::move(write)};
  cut(asset.write, [&](size_t number, const std::string& part) { asset.parts.push_back(asset_key(part, number)); });
  return asset;
}

/// Takes arrays off the front of an asset's bytes.
class Arrays {
 public:
  explicit Arrays(std::string_view bytes) : left_(bytes) {}
  template <size_t n>
  bool counts(uint64_t (&out)[n]) {
    if (left_.size() < sizeof out) return false;
    std::memcpy(out, left_.data(), sizeof out);
    left_.remove_prefix(sizeof out);
    return true;
  }
  template <class T>
  bool take(std::vector<T>& out, uint64_t count) {
    if (count > left_.size() / sizeof(T)) return false;
    out.resize(count);
    if (count > 0) std::memcpy(static_cast<void*>(out.data()), left_.data(), count * sizeof(T));
    left_.remove_prefix(count * sizeof(T));
    return true;
  }
  bool at_end() const { return left_.empty(); }

 private:
  std::string_view left_;
};

bool finite(const std::vector<Vec3f>& all) {
  for (const Vec3f& v : all)
    if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z)) return false;
  return true;
}

Error of_wrong_size(const char* what) {
  return input_error(fmt::format("the bytes of {} are not what their counts say", what));
}

}  // namespace

// ---- what is written -------------------------------------------------------------------------------------------

Asset asset_of(std::shared_ptr<const TriangleMesh> mesh) {
  return made([mesh = std::move(mesh)](ByteSink sink) {
    const TriangleMesh& m = *mesh;
    put_counts(sink, {m.positions.size(), m.triangles.size(), m.normals.size(), m.texture_coordinates.size()});
    sink(bytes_of(m.positions.data(), m.positions.size()));
    sink(bytes_of(m.triangles.data(), m.triangles.size()));
    sink(bytes_of(m.normals.data(), m.normals.size()));
    sink(bytes_of(m.texture_coordinates.data(), m.texture_coordinates.size()));
  });
}

Asset asset_of(std::shared_ptr<const LightImage> image) {
  return made([image = std::move(image)](ByteSink sink) {
    put_counts(sink, {static_cast<uint64_t>(image->width), static_cast<uint64_t>(image->height)});
    sink(bytes_of(image->pixels.data(), image->pixels.size()));
  });
}

Asset asset_of(std::shared_ptr<const DensityField> field, FieldSampling sampling) {
  return made([field = std::move(field), sampling](ByteSink sink) {
    uint64_t leaves = 0;
    field->for_each_leaf([&](const FieldLeaf&) { ++leaves; });
    put_counts(sink, {static_cast<uint64_t>(sampling), leaves});
    field->for_each_leaf([&](const FieldLeaf& leaf) { sink(bytes_of(&leaf, 1)); });
  });
}

Asset asset_of(const std::vector<Vec3f>& triangles) {
  const auto copy = std::make_shared<const std::vector<Vec3f>>(triangles);
  return made([copy](ByteSink sink) {
    put_counts(sink, {copy->size()});
    sink(bytes_of(copy->data(), copy->size()));
  });
}

Status for_each_part(const Asset& asset, FunctionRef<Status(int64_t key, const std::string& bytes)> visit) {
  Status status;
  cut(asset.write, [&](size_t number, const std::string& part) {
    if (status.ok()) status = visit(asset.parts[number], part);
  });
  return status;
}

int64_t asset_key(std::string_view bytes, size_t number) {
  return static_cast<int64_t>(XXH3_64bits_withSeed(bytes.data(), bytes.size(), number));
}

// ---- rows ------------------------------------------------------------------------------------------------------

Result<PackedAsset> pack_asset(const std::string& bytes) {
  TRY(std::string frame, to_frame(bytes, kLevel));
  if (frame.size() >= bytes.size() || bytes.size() > kMostPacked * frame.size()) return PackedAsset{"raw", bytes};
  return PackedAsset{"zstd", std::move(frame)};
}

Result<std::string> unpack_asset(std::string_view codec, std::string_view bytes) {
  if (codec == "raw") return std::string(bytes);
  if (codec != "zstd")
    return input_error(fmt::format("is packed as \"{}\", which this program does not know", codec.substr(0, 40)));
  return from_frame(bytes, std::min(kAssetPartBytes, kMostPacked * bytes.size()));
}

// ---- what is read ----------------------------------------------------------------------------------------------

Result<std::string> AssetReader::bytes(const std::vector<int64_t>& parts) {
  std::string all;
  for (size_t number = 0; number < parts.size(); ++number) {
    TRY(const std::string part, read_(parts[number], number));
    if (part.size() > left_) return input_error("what the records name takes more memory than a file of its size may");
    left_ -= part.size();
    all += part;
  }
  return all;
}

Result<std::shared_ptr<const TriangleMesh>> AssetReader::mesh(const std::vector<int64_t>& parts) {
  std::shared_ptr<const TriangleMesh>& known = meshes_[parts];
  if (known) return known;
  TRY(const std::string all, bytes(parts));
  Arrays in(all);
  uint64_t counts[4];
  auto mesh = std::make_shared<TriangleMesh>();
  if (!in.counts(counts) || !in.take(mesh->positions, counts[0]) || !in.take(mesh->triangles, counts[1]) ||
      !in.take(mesh->normals, counts[2]) || !in.take(mesh->texture_coordinates, counts[3]) || !in.at_end())
    return of_wrong_size("a mesh");
  const size_t vertices = mesh->positions.size();
  if ((!mesh->normals.empty() && mesh->normals.size() != vertices) ||
      (!mesh->texture_coordinates.empty() && mesh->texture_coordinates.size() != vertices))
    return input_error("a mesh has another number of normals or texture coordinates than of positions");
  for (const glm::uvec3& t : mesh->triangles)
    if (t.x >= vertices || t.y >= vertices || t.z >= vertices)
      return input_error("a mesh names a position that it has not");
  if (!finite(mesh->positions) || !finite(mesh->normals))
    return input_error("a mesh has a position or a normal that is not finite");
  return known = std::move(mesh);
}

Result<std::shared_ptr<const LightImage>> AssetReader::image(const std::vector<int64_t>& parts) {
  std::shared_ptr<const LightImage>& known = images_[parts];
  if (known) return known;
  TRY(const std::string all, bytes(parts));
  Arrays in(all);
  uint64_t size[2];
  auto image = std::make_shared<LightImage>();
  if (!in.counts(size) || size[0] == 0 || size[1] == 0 || size[0] > INT32_MAX || size[1] > INT32_MAX ||
      !in.take(image->pixels, size[0] * size[1]) || !in.at_end())
    return of_wrong_size("an image");
  image->width = static_cast<int>(size[0]), image->height = static_cast<int>(size[1]);
  return known = std::move(image);
}

Result<std::shared_ptr<const DensityField>> AssetReader::density(const std::vector<int64_t>& parts,
                                                                 const std::string& name) {
  std::shared_ptr<const DensityField>& known = densities_[parts];
  if (known) return known;
  TRY(const std::string all, bytes(parts));
  Arrays in(all);
  uint64_t head[2];
  std::vector<FieldLeaf> leaves;
  if (!in.counts(head) || head[0] > 1 || !in.take(leaves, head[1]) || !in.at_end()) return of_wrong_size("a density");
  const int32_t border = kWorldBorder / kLeafSize;
  for (const FieldLeaf& leaf : leaves)
    for (int axis = 0; axis < 3; ++axis)
      if (leaf.leaf[axis] < -border || leaf.leaf[axis] >= border)
        return input_error("a density lies outside of the world's border");
  TRY(known, BrickField::make(std::move(leaves), static_cast<FieldSampling>(head[0]), name));
  return known;
}

Result<std::vector<Vec3f>> AssetReader::triangles(const std::vector<int64_t>& parts) {
  TRY(const std::string all, bytes(parts));
  Arrays in(all);
  uint64_t count[1];
  std::vector<Vec3f> corners;
  if (!in.counts(count) || count[0] % 3 != 0 || !in.take(corners, count[0]) || !in.at_end())
    return of_wrong_size("a luminaire's triangles");
  if (!finite(corners)) return input_error("a luminaire's triangle has a corner that is not finite");
  return corners;
}

}  // namespace world
