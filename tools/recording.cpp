#include "tools/recording.h"

#include <charconv>
#include <fstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace tools {

namespace {

constexpr int kVersion = 1;
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

world::Result<uint64_t> hash_of(const nlohmann::json& object) {
  const auto found = object.find("hash");
  uint64_t hash = 0;
  if (found != object.end() && found->is_string()) {
    const auto& text = found->get_ref<const std::string&>();
    const auto end = std::from_chars(text.data(), text.data() + text.size(), hash, 16);
    if (text.size() == 16 && end.ec == std::errc{} && end.ptr == text.data() + text.size()) return hash;
  }
  return world::input_error("expected \"hash\" of 16 hexadecimal digits");
}

}  // namespace

world::Status write_recording(const Recording& recording, const std::filesystem::path& path) {
  const std::filesystem::path part = path.string() + ".part";
  {
    std::ofstream out(part);
    out << nlohmann::json{{"loam_recording", kVersion}, {"scene", recording.scene}, {"seed", recording.seed},
                          {"start", recording.start},   {"every", recording.every}, {"commit", recording.commit},
                          {"knobs", recording.knobs}}
        << '\n';
    for (const Recording::Mark& mark : recording.marks)
      out << nlohmann::json{{"tick", mark.tick}, {"hash", fmt::format("{:016x}", mark.hash)}} << '\n';
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
      if (version != kVersion)
        return at_line(path, line, fmt::format("version {} of recordings; this program reads {}", version, kVersion));
      TRY_STATUS(value(number_of(object, "seed"), recording.seed));
      TRY_STATUS(value(number_of(object, "start"), recording.start));
      TRY_STATUS(value(number_of(object, "every"), recording.every));
      if (recording.every == 0) return at_line(path, line, "expected \"every\" above 0");
      const auto scene = object.find("scene");
      if (scene == object.end() || !scene->is_string()) return at_line(path, line, "expected a text \"scene\"");
      recording.scene = scene->get<std::string>();
      if (const auto commit = object.find("commit"); commit != object.end() && commit->is_string())
        recording.commit = commit->get<std::string>();
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
    const uint64_t before = recording.marks.empty() ? recording.start : recording.marks.back().tick;
    if (mark.tick <= before || mark.tick - before > recording.every)
      return at_line(path, line, fmt::format("expected a tick in ({}, {}]", before, before + recording.every));
    if (recording.marks.size() == kMostMarks) return at_line(path, line, fmt::format("more than {} marks", kMostMarks));
    recording.marks.push_back(mark);
  }
  if (recording.scene.empty()) return at_line(path, 1, "the file is empty");
  return recording;
}

}  // namespace tools
