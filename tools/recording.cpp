#include "tools/recording.h"

#include <array>
#include <charconv>
#include <fstream>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "world/base/random.h"

namespace tools {

namespace {

constexpr int kVersion = 3;  // 1: without regions and saved; 2: regions in the place of leaves
constexpr size_t kMostMarks = 10'000'000;

world::Error at_line(const std::filesystem::path& path, size_t line, const std::string& what) {
  return world::input_error(fmt::format("{}:{}: {}", path.string(), line, what));
}

/// A whole number of the line's object, or an error that says so.
world::Result<uint64_t> number_of(const nlohmann::json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number_unsigned())
    return world::input_error(fmt::format("expected a whole number \"{}\"", key));
  return found->get<uint64_t>();
}

std::optional<uint64_t> hash_from(const nlohmann::json& value) {
  uint64_t hash = 0;
  if (!value.is_string()) return {};
  const auto& text = value.get_ref<const std::string&>();
  const auto end = std::from_chars(text.data(), text.data() + text.size(), hash, 16);
  if (text.size() != 16 || end.ec != std::errc{} || end.ptr != text.data() + text.size()) return {};
  return hash;
}
std::string hash_text(uint64_t hash) { return fmt::format("{:016x}", hash); }

world::Result<uint64_t> hash_of(const nlohmann::json& object) {
  if (const auto found = object.find("hash"); found != object.end())
    if (const auto hash = hash_from(*found)) return *hash;
  return world::input_error("expected \"hash\" of 16 hexadecimal digits");
}

/// "1 -2 3": three whole numbers.
template <class Pos>
std::optional<Pos> position_from(const std::string& text) {
  Pos p;
  const char *at = text.data(), *const end = text.data() + text.size();
  for (int axis = 0; axis < 3; ++axis) {
    if (axis > 0 && (at == end || *at++ != ' ')) return {};
    const auto parsed = std::from_chars(at, end, p[axis]);
    if (parsed.ec != std::errc{}) return {};
    at = parsed.ptr;
  }
  if (at != end) return {};
  return p;
}

/// Hashes by position, under `key`; none where it isn't there.
template <class Pos>
world::Status read_hashes(const nlohmann::json& object, const char* key, std::map<Pos, uint64_t>& into) {
  const auto found = object.find(key);
  if (found == object.end()) return {};
  const world::Error wrong = world::input_error(
      fmt::format("expected an object \"{}\" of three whole numbers, as text, and 16 hexadecimal digits each", key));
  if (!found->is_object()) return wrong;
  for (const auto& [name, value] : found->items()) {
    const auto at = position_from<Pos>(name);
    const auto hash = hash_from(value);
    if (!at || !hash) return wrong;
    into[*at] = *hash;
  }
  return {};
}

template <class Pos>
void write_hashes(const std::map<Pos, uint64_t>& hashes, const char* key, nlohmann::json& line) {
  for (const auto& [at, hash] : hashes) line[key][fmt::format("{} {} {}", at.x, at.y, at.z)] = hash_text(hash);
}

}  // namespace

const std::map<world::LeafPos, uint64_t>& LeafHashes::update() {
  world::StoreReader reader(store_);
  for (const world::LeafPos& l : store_.take_dirty(subscriber_)) {
    const world::LeafBlocks leaf = reader.leaf(l);
    uint64_t hash = world::hash_combine(static_cast<uint64_t>(l.x), static_cast<uint64_t>(l.y));
    hash = world::hash_combine(hash, static_cast<uint64_t>(l.z));
    for (int i = 0; i < world::kLeafVoxels; ++i) hash = world::hash_combine(hash, leaf[i]);
    blocks_[l] = hash;
  }
  leaves_ = blocks_;
  std::array<int32_t, world::kLeafVoxels> value;
  world::LeafMask active;
  for (const world::LayerRow& row : world::layer_rows()) {
    if (!row.is_integer) continue;
    const world::Layer layer = *world::layer_from_name(row.name);
    const world::IntLayer* values = store_.find_int_layer(layer);
    if (!values) continue;
    for (const world::LeafPos& l : values->leaves()) {
      if (!values->read_leaf(l, value, active)) continue;
      const world::VoxelPos corner = world::voxel_from_leaf(l);
      uint64_t hash = 0;
      for (int i = 0; i < world::kLeafVoxels; ++i)
        if (active.test(i))
          hash += world::random_bits(static_cast<uint64_t>(int64_t{value[static_cast<size_t>(i)]}), corner.x, corner.y,
                                     corner.z,
                                     static_cast<uint64_t>(layer) * world::kLeafVoxels + static_cast<uint64_t>(i));
      if (!active.is_none()) leaves_[l] += hash;
    }
  }
  return leaves_;
}

std::map<world::RegionPos, uint64_t> region_hashes(const std::map<world::LeafPos, uint64_t>& leaves) {
  std::map<world::RegionPos, uint64_t> regions;
  for (const auto& [l, hash] : leaves) regions[world::region_from_leaf(l)] += hash;
  return regions;
}

world::Status write_recording(const Recording& recording, const std::filesystem::path& path) {
  const std::filesystem::path part = path.string() + ".part";
  {
    std::ofstream out(part);
    out << nlohmann::json{{"loam_recording", kVersion}, {"scene", recording.scene}, {"seed", recording.seed},
                          {"start", recording.start},   {"every", recording.every}, {"commit", recording.commit},
                          {"knobs", recording.knobs},   {"saved", recording.saved}, {"threads", recording.threads}}
        << '\n';
    for (const Recording::Mark& mark : recording.marks) {
      nlohmann::json line{{"tick", mark.tick}, {"hash", hash_text(mark.hash)}};
      write_hashes(mark.leaves, "leaves", line);
      write_hashes(mark.regions, "regions", line);
      out << line << '\n';
    }
    out.flush();
    if (!out) {
      std::error_code ignored;
      std::filesystem::remove(part, ignored);
      return world::input_error(
          fmt::format("{}: can't be written; is the folder there, and is there room?", path.string()));
    }
  }
  std::error_code failed;
  std::filesystem::rename(part, path, failed);
  if (failed) return world::input_error(fmt::format("{}: {}", path.string(), failed.message()));
  return {};
}

world::Result<Recording> read_recording(const std::filesystem::path& path) {
  std::ifstream in(path);
  if (!in) return world::input_error(fmt::format("{}: can't be opened", path.string()));
  Recording recording;
  std::string text;
  for (size_t line = 1; std::getline(in, text); ++line) {
    const nlohmann::json object = nlohmann::json::parse(text, nullptr, false);
    if (!object.is_object()) return at_line(path, line, "expected one JSON object, as `loam sim --record` writes it");
    const auto value = [&](world::Result<uint64_t> number, uint64_t& into) -> world::Status {
      if (!number.ok()) return at_line(path, line, number.error().message);
      into = *number;
      return {};
    };
    if (line == 1) {
      uint64_t version = 0;
      TRY_STATUS(value(number_of(object, "loam_recording"), version));
      if (version < 1 || version > kVersion)
        return at_line(path, line,
                       fmt::format("version {} of recordings; this program reads 1 to {}", version, kVersion));
      TRY_STATUS(value(number_of(object, "seed"), recording.seed));
      TRY_STATUS(value(number_of(object, "start"), recording.start));
      TRY_STATUS(value(number_of(object, "every"), recording.every));
      if (recording.every == 0) return at_line(path, line, "expected \"every\" above 0");
      const auto scene = object.find("scene");
      if (scene == object.end() || !scene->is_string()) return at_line(path, line, "expected a text \"scene\"");
      recording.scene = scene->get<std::string>();
      if (const auto commit = object.find("commit"); commit != object.end() && commit->is_string())
        recording.commit = commit->get<std::string>();
      if (const auto saved = object.find("saved"); saved != object.end() && saved->is_string())
        recording.saved = saved->get<std::string>();
      constexpr uint64_t kMostThreads = 1u << 16;
      if (object.contains("threads")) {
        uint64_t threads = 0;
        TRY_STATUS(value(number_of(object, "threads"), threads));
        if (threads > kMostThreads) return at_line(path, line, fmt::format("more than {} threads", kMostThreads));
        recording.threads = static_cast<int>(threads);
      }
      if (const auto knobs = object.find("knobs"); knobs != object.end()) {
        if (!knobs->is_object()) return at_line(path, line, "expected an object \"knobs\" of texts");
        for (const auto& [name, text_of] : knobs->items()) {
          if (!text_of.is_string()) return at_line(path, line, "expected a text for the knob \"" + name + "\"");
          recording.knobs[name] = text_of.get<std::string>();
        }
      }
      continue;
    }
    Recording::Mark mark;
    TRY_STATUS(value(number_of(object, "tick"), mark.tick));
    TRY_STATUS(value(hash_of(object), mark.hash));
    for (const world::Status& hashes :
         {read_hashes(object, "leaves", mark.leaves), read_hashes(object, "regions", mark.regions)})
      if (!hashes.ok()) return at_line(path, line, hashes.error().message);
    const uint64_t before = recording.marks.empty() ? recording.start : recording.marks.back().tick;
    if (mark.tick <= before || mark.tick - before > recording.every)
      return at_line(path, line, fmt::format("expected a tick in ({}, {}]", before, before + recording.every));
    if (recording.marks.size() == kMostMarks) return at_line(path, line, fmt::format("more than {} marks", kMostMarks));
    recording.marks.push_back(std::move(mark));
  }
  if (recording.scene.empty()) return at_line(path, 1, "the file is empty");
  return recording;
}

}  // namespace tools
