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

constexpr int kVersion = 2;  // 1: without regions and saved
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
std::optional<world::RegionPos> region_from(const std::string& text) {
  world::RegionPos r;
  const char *at = text.data(), *const end = text.data() + text.size();
  for (int axis = 0; axis < 3; ++axis) {
    if (axis > 0 && (at == end || *at++ != ' ')) return {};
    const auto parsed = std::from_chars(at, end, r[axis]);
    if (parsed.ec != std::errc{}) return {};
    at = parsed.ptr;
  }
  if (at != end) return {};
  return r;
}

world::Status read_regions(const nlohmann::json& object, std::map<world::RegionPos, uint64_t>& into) {
  const auto found = object.find("regions");
  if (found == object.end()) return {};
  const world::Error wrong = world::input_error(
      "expected an object \"regions\" of three whole numbers, as text, and 16 hexadecimal digits each");
  if (!found->is_object()) return wrong;
  for (const auto& [name, value] : found->items()) {
    const auto region = region_from(name);
    const auto hash = hash_from(value);
    if (!region || !hash) return wrong;
    into[*region] = *hash;
  }
  return {};
}

}  // namespace

const std::map<world::RegionPos, uint64_t>& RegionHashes::update() {
  world::StoreReader reader(store_);
  for (const world::LeafPos& l : store_.take_dirty(subscriber_)) {
    const world::LeafBlocks leaf = reader.leaf(l);
    uint64_t hash = world::hash_combine(static_cast<uint64_t>(l.x), static_cast<uint64_t>(l.y));
    hash = world::hash_combine(hash, static_cast<uint64_t>(l.z));
    for (int i = 0; i < world::kLeafVoxels; ++i) hash = world::hash_combine(hash, leaf[i]);
    leaves_[l] = hash;
  }
  regions_.clear();
  for (const auto& [l, hash] : leaves_) regions_[world::region_from_leaf(l)] += hash;
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
      uint64_t& hash = regions_[world::region_from_leaf(l)];
      for (int i = 0; i < world::kLeafVoxels; ++i)
        if (active.test(i))
          hash += world::random_bits(static_cast<uint64_t>(int64_t{value[static_cast<size_t>(i)]}), corner.x, corner.y,
                                     corner.z,
                                     static_cast<uint64_t>(layer) * world::kLeafVoxels + static_cast<uint64_t>(i));
    }
  }
  return regions_;
}

std::map<world::RegionPos, uint64_t> changed_regions(const std::map<world::RegionPos, uint64_t>& before,
                                                     const std::map<world::RegionPos, uint64_t>& now) {
  std::map<world::RegionPos, uint64_t> changed;
  for (const auto& [r, hash] : now)
    if (const auto was = before.find(r); was == before.end() || was->second != hash) changed[r] = hash;
  for (const auto& [r, hash] : before)
    if (!now.contains(r)) changed[r] = 0;  // nothing there differs from the start any more
  return changed;
}

world::Status write_recording(const Recording& recording, const std::filesystem::path& path) {
  const std::filesystem::path part = path.string() + ".part";
  {
    std::ofstream out(part);
    out << nlohmann::json{{"loam_recording", kVersion}, {"scene", recording.scene}, {"seed", recording.seed},
                          {"start", recording.start},   {"every", recording.every}, {"commit", recording.commit},
                          {"knobs", recording.knobs},   {"saved", recording.saved}}
        << '\n';
    for (const Recording::Mark& mark : recording.marks) {
      nlohmann::json line{{"tick", mark.tick}, {"hash", hash_text(mark.hash)}};
      for (const auto& [r, hash] : mark.regions)
        line["regions"][fmt::format("{} {} {}", r.x, r.y, r.z)] = hash_text(hash);
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
    if (const world::Status regions = read_regions(object, mark.regions); !regions.ok())
      return at_line(path, line, regions.error().message);
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
