/// What a save's bytes cost in time: the valley's regions packed for disk by each codec and level.
///
///   stream      OpenVDB's own stream with Blosc inside, as saves of version 1 were; one setting
///   zstd@LEVEL  a Zstandard frame around the stream without Blosc; 3 is what an open world is saved with
///   context     each voxel coded by the three beside it; what a file is converted to
/// All are lossless, so the axis of errors is what is left to lose: bytes. Each setting reads its payloads back once
/// and must find the same blocks; time is that of encoding on one thread, serialising by OpenVDB included.
#include <algorithm>
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "tools/bench/benchmark.h"
#include "world/saves/row.h"
#include "world/store/snapshot.h"

namespace tools {

namespace {

using world::PackedRegion;
using world::PayloadOptions;
using world::RegionPos;

struct Regions {
  std::vector<RegionPos> pos;
  std::vector<std::shared_ptr<const PackedRegion>> blocks;
  size_t palette_size = 0;
  double volume() const { return static_cast<double>(pos.size()) * std::pow(world::kRegionSize, 3); }
};

/// True where the payload holds the blocks of the region.
bool reads_back(const Regions& regions, size_t i, const PayloadOptions& options, const std::string& bytes) {
  world::RegionRow row;
  row.pos = regions.pos[i], row.codec = options.codec, row.bytes = bytes;
  const auto builder = world::decode_blocks(row, regions.palette_size);
  if (!builder.ok()) return false;
  for (int l = 0; l < world::kLeavesPerRegion; ++l) {
    const world::LeafBlocks leaf = builder->leaf(l);
    for (int v = 0; v < world::kLeafVoxels; ++v)
      if (leaf[v] != regions.blocks[i]->get(l, v)) return false;
  }
  return true;
}

ErrorSample size_of(const Regions& regions, const PayloadOptions& options) {
  double total = 0, largest = 0;
  for (size_t i = 0; i < regions.pos.size(); ++i) {
    const auto bytes = world::encode_payload(*regions.blocks[i], regions.pos[i], options);
    if (!bytes.ok() || !reads_back(regions, i, options, *bytes)) return {{std::nan(""), std::nan("")}, 0};
    total += static_cast<double>(bytes->size()), largest = std::max(largest, static_cast<double>(bytes->size()));
  }
  return {{total / regions.volume(), largest * static_cast<double>(regions.pos.size()) / regions.volume()}, 0};
}

}  // namespace

void add_subject_save_compression(Registry& registry) {
  Subject subject{.question = "how many bytes does a save cost, and how long does it take to make them so few?",
                  .reference = "no bytes at all; every setting is lossless, which is checked",
                  .metrics = {"size on disk (B/m^3)", "of the largest region (B/m^3)"},
                  .work_unit = "m^3"};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    TRY(const world::World* valley, context.world("valley"));
    const bool quick = context.quick();
    const auto regions = context.shared<Regions>("save_compression", [&] {
      auto all = std::make_shared<Regions>();
      all->pos = valley->store.regions();
      if (quick) all->pos.resize(std::min<size_t>(all->pos.size(), 8));
      all->palette_size = valley->palette->size();
      const world::StoreSnapshot snapshot = valley->store.snapshot(all->pos);
      for (size_t i = 0; i < snapshot.size(); ++i) all->blocks.push_back(snapshot.packed(i));
      return all;
    });
    std::vector<Setting> settings;
    const auto add = [&](const std::string& method, const PayloadOptions& options, double knob) {
      Setting s{.method = method, .setting = fmt::format("{}@{}", method, knob)};
      s.knob = knob;
      s.is_default = options.codec == PayloadOptions{}.codec && options.level == PayloadOptions{}.level;
      s.measure = [=](uint64_t) { return size_of(*regions, options); };
      s.run = [=] {
        for (size_t i = 0; i < regions->pos.size(); ++i)
          keep(world::encode_payload(*regions->blocks[i], regions->pos[i], options));
        return regions->volume();
      };
      settings.push_back(std::move(s));
    };
    add("stream", {world::Codec::stream, 0}, 0);
    add("context", world::kSmallPayload, 0);
    for (const int level : quick ? std::vector{-1, 1, 3, 6} : std::vector{-5, -1, 1, 2, 3, 5, 6, 9, 12, 15})
      add("zstd", {world::Codec::zstd, level}, level);
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
