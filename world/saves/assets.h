/// What of a world is too large for a row of text: the triangles of meshes, the values of images, densities. Each is a
/// row of bytes that says its own sizes, cut into parts of at most kAssetPartBytes; a part is a row of the table
/// `asset` under the hash of its bytes and its number. So what several records share is there once, a save writes only
/// what is new, and each part vouches for itself. Internal to world/saves.
///
///   mesh       counts of positions, triangles, normals, texture coordinates [4] u64, then those, float and u32
///   image      width, height [2] u64, then radiances [height][width][3] float
///   density    sampling, leaves [2] u64, then of each leaf its position [3] i32 and [512] float
///   triangles  count u64, then corners [count][3] float: of a luminaire
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "world/base/function_ref.h"
#include "world/luminaires/luminaire.h"
#include "world/media/medium.h"
#include "world/meshes/mesh.h"

namespace world {

constexpr size_t kAssetPartBytes = 16 << 20;

using ByteSink = FunctionRef<void(std::string_view bytes)>;

struct Asset {
  std::vector<int64_t> parts;           // keys of its rows
  std::function<void(ByteSink)> write;  // all its bytes, in pieces of any size; keeps alive what it reads
};

Asset asset_of(std::shared_ptr<const TriangleMesh> mesh);
Asset asset_of(std::shared_ptr<const LightImage> image);
Asset asset_of(std::shared_ptr<const DensityField> field, FieldSampling sampling);
Asset asset_of(const std::vector<Vec3f>& triangles);

/// Calls visit(key, bytes) for each part, until it fails.
Status for_each_part(const Asset& asset, FunctionRef<Status(int64_t key, const std::string& bytes)> visit);
/// The key of part number `number`.
int64_t asset_key(std::string_view bytes, size_t number);

/// How a row holds a part: as it is, or in a Zstandard frame where that is smaller, but not by more than 16 times; so
/// that no file makes its reader take more memory than 16 times its size.
struct PackedAsset {
  std::string codec;  // "raw" or "zstd"
  std::string bytes;
};
Result<PackedAsset> pack_asset(const std::string& bytes);
Result<std::string> unpack_asset(std::string_view codec, std::string_view bytes);

/// Gives the bytes of a part, checked against its key.
using ReadAssetPart = std::function<Result<std::string>(int64_t key, size_t number)>;

/// Makes what assets hold anew, each once.
class AssetReader {
 public:
  /// `most_bytes`: of all that is read; more is an error.
  AssetReader(ReadAssetPart read, uint64_t most_bytes) : read_(std::move(read)), left_(most_bytes) {}
  Result<std::shared_ptr<const TriangleMesh>> mesh(const std::vector<int64_t>& parts);
  Result<std::shared_ptr<const LightImage>> image(const std::vector<int64_t>& parts);
  Result<std::shared_ptr<const DensityField>> density(const std::vector<int64_t>& parts, const std::string& name);
  Result<std::vector<Vec3f>> triangles(const std::vector<int64_t>& parts);

 private:
  Result<std::string> bytes(const std::vector<int64_t>& parts);
  ReadAssetPart read_;
  uint64_t left_;
  std::map<std::vector<int64_t>, std::shared_ptr<const TriangleMesh>> meshes_;
  std::map<std::vector<int64_t>, std::shared_ptr<const LightImage>> images_;
  std::map<std::vector<int64_t>, std::shared_ptr<const DensityField>> densities_;
};

}  // namespace world
