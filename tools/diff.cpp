#include "tools/diff.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>

#include <fmt/format.h>

#include "render/image/display.h"
#include "render/image/png_exr.h"
#include "world/base/jobs.h"

namespace tools {
namespace {

enum class FileKind { png, exr, other };

FileKind kind_by_content(const std::filesystem::path& path) {
  std::array<char, 4> head{};
  std::ifstream(path, std::ios::binary).read(head.data(), head.size());
  const std::string_view bytes(head.data(), head.size());
  if (bytes == "\x89PNG") return FileKind::png;
  if (bytes == "\x76\x2f\x31\x01") return FileKind::exr;
  return FileKind::other;
}

/// The number that stands for b's block in comparisons: a's id of the same name, or one that a does not have.
std::vector<uint32_t> numbers_of_b(const world::BlockPalette& a, const world::BlockPalette& b) {
  std::vector<uint32_t> numbers(b.size());
  for (size_t id = 0; id < b.size(); ++id) {
    const auto in_a = a.find(b[static_cast<world::BlockId>(id)].name);
    numbers[id] = in_a ? *in_a : static_cast<uint32_t>(world::kMaxBlocks + id);
  }
  return numbers;
}

/// Adds the differences of one leaf.
void compare_leaves(const world::LeafBlocks& a, const world::LeafBlocks& b, const std::vector<uint32_t>& numbers,
                    const world::BlockPalette& names_a, const world::BlockPalette& names_b, world::LeafPos pos,
                    size_t list_at_most, WorldDifference& out) {
  if (!a.values && !b.values && a.uniform == numbers[b.uniform]) return;
  for (int i = 0; i < world::kLeafVoxels; ++i) {
    const world::BlockId in_a = a[i], in_b = b[i];
    if (in_a == numbers[in_b]) continue;
    ++out.differing;
    out.only_a += in_b == world::kAir ? 1 : 0;
    out.only_b += in_a == world::kAir ? 1 : 0;
    if (out.first.size() < list_at_most) {
      out.first.push_back(
          {world::voxel_from_leaf(pos) + world::offset_in_leaf(i), names_a[in_a].name, names_b[in_b].name});
    }
  }
}

/// A world without the layer has no values in it.
template <class Grid>
void compare_layer(const Grid* a, const Grid* b, std::string_view name, std::vector<LayerDifference>& out) {
  std::vector<world::LeafPos> leaves = a ? a->leaves() : std::vector<world::LeafPos>{};
  if (b) {
    const std::vector<world::LeafPos> more = b->leaves();
    leaves.insert(leaves.end(), more.begin(), more.end());
  }
  std::sort(leaves.begin(), leaves.end());
  leaves.erase(std::unique(leaves.begin(), leaves.end()), leaves.end());
  using Values = std::array<std::decay_t<decltype(a->get({}))>, world::kLeafVoxels>;
  LayerDifference found{.layer = std::string(name), .differing = 0, .pos = {}, .a = {}, .b = {}};
  Values in_a, in_b;
  for (const world::LeafPos& l : leaves) {
    world::LeafMask active_a, active_b;
    if (!a || !a->read_leaf(l, in_a, active_a)) in_a = {}, active_a = {};
    if (!b || !b->read_leaf(l, in_b, active_b)) in_b = {}, active_b = {};
    for (int i = 0; i < world::kLeafVoxels; ++i) {
      const auto n = static_cast<size_t>(i);
      if (active_a.test(i) == active_b.test(i) && in_a[n] == in_b[n]) continue;
      if (found.differing++ > 0) continue;
      found.pos = world::voxel_from_leaf(l) + world::offset_in_leaf(i);
      if (active_a.test(i)) found.a = static_cast<double>(in_a[n]);
      if (active_b.test(i)) found.b = static_cast<double>(in_b[n]);
    }
  }
  if (found.differing > 0) out.push_back(std::move(found));
}

void compare_layers(const world::Store& a, const world::Store& b, std::vector<LayerDifference>& out) {
  for (const world::LayerRow& row : world::layer_rows()) {
    const world::Layer layer = *world::layer_from_name(row.name);
    if (layer == world::Layer::block) continue;
    if (row.is_integer)
      compare_layer(a.find_int_layer(layer), b.find_int_layer(layer), row.name, out);
    else
      compare_layer(a.find_layer(layer), b.find_layer(layer), row.name, out);
  }
}

double value_of(const render::ErrorMetrics& metrics, const std::string& name) {
  const nlohmann::json value = metrics_json(metrics)[name];
  return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

bool is_picture_file(const std::filesystem::path& path) { return kind_by_content(path) != FileKind::other; }

world::Result<PictureFile> read_picture(const std::filesystem::path& path) {
  PictureFile picture;
  if (kind_by_content(path) == FileKind::exr) {
    TRY(render::ExrFile file, render::read_exr(path));
    picture.radiance = std::move(file.image);
  } else {
    TRY(const render::PngFile file, render::read_png(path));
    picture.shown = render::image8_from_png(file);
  }
  return picture;
}

world::Result<render::ImageComparison> compare_picture_files(const std::filesystem::path& a,
                                                             const std::filesystem::path& b) {
  TRY(PictureFile in_a, read_picture(a));
  TRY(PictureFile in_b, read_picture(b));
  if (in_a.width() != in_b.width() || in_a.height() != in_b.height()) {
    return world::input_error(fmt::format("{} has {} x {} pixels and {} has {} x {}: only pictures of one size compare",
                                          a.string(), in_a.width(), in_a.height(), b.string(), in_b.width(),
                                          in_b.height()));
  }
  if (in_a.linear() && in_b.linear()) return render::compare_images(in_a.radiance, in_b.radiance);
  for (PictureFile* p : {&in_a, &in_b}) {
    if (p->linear()) p->shown = render::display_image(p->radiance, 0);
  }
  return render::compare_images(in_a.shown, in_b.shown);
}

nlohmann::json metrics_json(const render::ErrorMetrics& m) {
  // nlohmann writes NaN and infinity as null.
  const auto number = [](double v) { return std::isfinite(v) ? nlohmann::json(v) : nlohmann::json(nullptr); };
  const auto channels = [&](const std::array<float, 3>& v) {
    return nlohmann::json::array({number(v[0]), number(v[1]), number(v[2])});
  };
  return {{"mse", number(m.mse)},
          {"rel_mse", number(m.rel_mse)},
          {"trimmed_rel_mse", number(m.trimmed_rel_mse)},
          {"smape", number(m.smape)},
          {"bias", number(m.bias)},
          {"psnr", number(m.psnr)},
          {"ssim", number(m.ssim)},
          {"flip", number(m.flip)},
          {"worst",
           {{"x", m.worst.x},
            {"y", m.worst.y},
            {"a", channels(m.worst.a)},
            {"b", channels(m.worst.b)},
            {"difference", number(m.worst.difference)}}},
          {"fraction_within_1", m.fraction_within_1},
          {"not_finite", m.not_finite},
          {"equal", m.equal}};
}

WorldDifference compare_worlds(const world::World& a, const world::World& b, size_t list_at_most) {
  const std::vector<uint32_t> numbers = numbers_of_b(*a.palette, *b.palette);
  std::vector<world::RegionPos> regions = a.store.regions(), more = b.store.regions();
  regions.insert(regions.end(), more.begin(), more.end());
  std::sort(regions.begin(), regions.end());
  regions.erase(std::unique(regions.begin(), regions.end()), regions.end());

  std::vector<WorldDifference> parts(regions.size());
  world::parallel_for(regions.size(), [&](size_t r) {
    world::StoreReader in_a(a.store), in_b(b.store);
    for (int l = 0; l < world::kLeavesPerRegion; ++l) {
      const world::LeafPos pos = world::leaf_from_region(regions[r]) + world::leaf_offset_in_region(l);
      compare_leaves(in_a.leaf(pos), in_b.leaf(pos), numbers, *a.palette, *b.palette, pos, list_at_most, parts[r]);
    }
  });
  WorldDifference total;
  for (WorldDifference& part : parts) {
    total.differing += part.differing, total.only_a += part.only_a, total.only_b += part.only_b;
    for (VoxelDifference& d : part.first) {
      if (total.first.size() < list_at_most) total.first.push_back(std::move(d));
    }
  }
  compare_layers(a.store, b.store, total.layers);
  return total;
}

nlohmann::json difference_json(const WorldDifference& difference) {
  nlohmann::json first = nlohmann::json::array();
  for (const VoxelDifference& d : difference.first) {
    first.push_back({{"position", {d.pos.x, d.pos.y, d.pos.z}}, {"a", d.a}, {"b", d.b}});
  }
  nlohmann::json layers = nlohmann::json::array();
  for (const LayerDifference& d : difference.layers) {
    const auto value = [](const std::optional<double>& v) { return v ? nlohmann::json(*v) : nlohmann::json(nullptr); };
    layers.push_back({{"layer", d.layer},
                      {"differing", d.differing},
                      {"position", {d.pos.x, d.pos.y, d.pos.z}},
                      {"a", value(d.a)},
                      {"b", value(d.b)}});
  }
  return {{"equal", difference.equal()},
          {"differing", difference.differing},
          {"only_a", difference.only_a},
          {"only_b", difference.only_b},
          {"first", first},
          {"layers", layers}};
}

std::vector<std::string> failed_thresholds(const render::ErrorMetrics& metrics, const std::vector<Threshold>& asked) {
  std::vector<std::string> failed;
  if (metrics.equal) return failed;
  for (const Threshold& t : asked) {
    const double value = t.name == "psnr" ? metrics.psnr : value_of(metrics, t.name);
    // The means of values leave out what is not finite; a threshold on them must not.
    const bool hidden = std::isinf(metrics.worst.difference) && (t.name == "mse" || t.name == "rel_mse");
    if (!hidden && (t.at_most ? value <= t.limit : value >= t.limit)) continue;
    failed.push_back(fmt::format("{} is {:.6g}{}, but {} asks for at {} {:.6g}", t.name, value,
                                 hidden ? " without the pixels that are not finite" : "", t.option,
                                 t.at_most ? "most" : "least", t.limit));
  }
  return failed;
}

}  // namespace tools
