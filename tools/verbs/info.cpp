/// loam info FILE: bounds, census, layers, bytes in memory and on disk, and the effects that the content calls for.
#include <cstdio>
#include <filesystem>
#include <iostream>

#include <nlohmann/json.hpp>

#include "sim/matter/matter.h"
#include "tools/json_text.h"
#include "tools/verb.h"
#include "world/base/text.h"
#include "world/scenes/effects.h"
#include "world/scenes/scene.h"

namespace tools {

namespace {

// A voxel as a cube of a triangle list (chapter 14.7.2): 12 triangles of three vertices of three floats.
constexpr double kTriangleListBytesPerVoxel = 12 * 3 * 3 * 4;

struct InfoOptions {
  std::string file;
  bool effects = false, json = false;
};

nlohmann::json materials_json(const world::World& world) {
  nlohmann::json all = nlohmann::json::object();
  for (const auto& [id, count] : world.store.census()) {
    const world::Block& block = (*world.palette)[id];
    nlohmann::json& m = all[block.name];
    m = {{"phase", world::phase_name(block.phase)}, {"bsdf", block.bsdf}, {"opaque", block.opaque}};
    if (block.emission.r > 0 || block.emission.g > 0 || block.emission.b > 0)
      m["emission_w"] = {block.emission.r, block.emission.g, block.emission.b};
    if (!block.proxy.empty()) m["proxy"] = block.proxy;
  }
  return all;
}

/// `bytes_open`: what the world took before its regions were packed.
nlohmann::json info_json(const world::World& world, const world::ImportReport& report, uint64_t bytes_disk,
                         size_t bytes_open) {
  nlohmann::json j;
  j["voxels"] = world.store.voxel_count();
  j["census"] = nlohmann::json::object();
  for (const auto& [id, count] : world.store.census()) j["census"][(*world.palette)[id].name] = count;
  j["unmapped"] = report.unmapped;
  const world::VoxelBox box = world.store.bounds();
  if (box.empty())
    j["bounds"] = nullptr;
  else
    j["bounds"] = {{"min", {box.min.x, box.min.y, box.min.z}}, {"max", {box.max.x, box.max.y, box.max.z}}};
  const size_t memory = world.store.bytes_memory();
  const double volume = static_cast<double>(box.volume());
  const auto per_m3 = [&](double bytes) { return box.empty() ? 0.0 : bytes / volume; };
  j["materials"] = materials_json(world);
  j["bytes_memory"] = memory;
  j["bytes_memory_open"] = bytes_open;
  j["bytes_disk"] = bytes_disk;
  j["bytes_per_m3_memory"] = per_m3(static_cast<double>(memory));
  j["bytes_per_m3_memory_open"] = per_m3(static_cast<double>(bytes_open));
  j["bytes_per_m3_disk"] = per_m3(static_cast<double>(bytes_disk));
  j["bytes_if_a_byte_per_m3"] = volume;
  j["bytes_if_triangle_list"] = kTriangleListBytesPerVoxel * static_cast<double>(world.store.voxel_count());
  j["layers"] = nlohmann::json::array();
  for (const world::LayerInfo& layer : world.store.layers())
    j["layers"].push_back({{"name", layer.name}, {"bytes", layer.bytes}, {"active_voxels", layer.active_voxels}});
  j["effects"] = nlohmann::json::array();
  for (const world::EffectCall& effect : world::called_effects(world))
    j["effects"].push_back({{"name", effect.name}, {"called_for", effect.called_for}, {"why", effect.why}});
  j["rules"] = nlohmann::json::array();
  const std::vector<sim::EffectReport> rules = sim::called_rules(world);
  for (size_t r = 0; r < rules.size(); ++r) {
    const sim::RuleInfo& info = sim::rule_rows()[r].info;
    j["rules"].push_back({{"name", info.name},
                          {"called_for", rules[r].called_for},
                          {"why", rules[r].why},
                          {"what", info.what},
                          {"layers", info.layers},
                          {"conserves", info.conserves}});
  }
  char hash[20];
  std::snprintf(hash, sizeof hash, "%016llx", static_cast<unsigned long long>(world.store.content_hash()));
  j["hash"] = hash;
  j["metadata"] = world.metadata;
  for (const auto& [name, value] : report.facts) j["facts"][name] = value;
  return j;
}

void print_info(const nlohmann::json& j, bool effects) {
  const auto number = [&](const char* key) { return world::with_thousands(j[key].get<uint64_t>()); };
  std::printf("voxels        %s (not air)\n", number("voxels").c_str());
  if (j["bounds"].is_null())
    std::printf("bounds        none: the world is empty\n");
  else
    std::printf("bounds        (%d, %d, %d) .. (%d, %d, %d), inclusive\n", j["bounds"]["min"][0].get<int>(),
                j["bounds"]["min"][1].get<int>(), j["bounds"]["min"][2].get<int>(), j["bounds"]["max"][0].get<int>(),
                j["bounds"]["max"][1].get<int>(), j["bounds"]["max"][2].get<int>());
  const auto bytes = [&](const char* key) { return world::bytes_text(j[key].get<double>()); };
  std::printf("in memory     %s, %.3f byte/m3, packed by palette; open to edits %s, %.3f byte/m3\n",
              bytes("bytes_memory").c_str(), j["bytes_per_m3_memory"].get<double>(), bytes("bytes_memory_open").c_str(),
              j["bytes_per_m3_memory_open"].get<double>());
  if (j["bytes_disk"].get<uint64_t>() > 0)
    std::printf("on disk       %s, %.3f byte/m3\n", bytes("bytes_disk").c_str(), j["bytes_per_m3_disk"].get<double>());
  std::printf("beside it     %s at a byte/m3; %s as a triangle list of cubes, 432 bytes a voxel\n",
              bytes("bytes_if_a_byte_per_m3").c_str(), bytes("bytes_if_triangle_list").c_str());
  std::printf("hash          %s\n", j["hash"].get<std::string>().c_str());
  for (const auto& [name, value] : j["metadata"].items())
    std::printf("%-13s %s\n", name.c_str(), value.get<std::string>().c_str());
  if (j.contains("facts"))
    for (const auto& [name, value] : j["facts"].items())
      std::printf("%-24s %s\n", name.c_str(), value.get<std::string>().c_str());
  std::printf("\nlayers\n");
  for (const auto& layer : j["layers"])
    std::printf("  %-20s %12s   %s voxels\n", layer["name"].get<std::string>().c_str(),
                world::bytes_text(layer["bytes"].get<double>()).c_str(),
                world::with_thousands(layer["active_voxels"].get<uint64_t>()).c_str());
  std::printf("\ncensus\n");
  std::vector<std::pair<uint64_t, std::string>> rows;
  for (const auto& [name, count] : j["census"].items()) rows.emplace_back(count.get<uint64_t>(), name);
  std::sort(rows.rbegin(), rows.rend());
  for (const auto& [count, name] : rows) {
    const nlohmann::json& m = j["materials"][name];
    std::printf("  %-24s %15s   %s, %s%s%s\n", name.c_str(), world::with_thousands(count).c_str(),
                m["phase"].get<std::string>().c_str(), m["bsdf"].get<std::string>().c_str(),
                m["opaque"].get<bool>() ? "" : ", lets light pass", m.contains("emission_w") ? ", shines" : "");
  }
  for (const auto& [name, count] : j["unmapped"].items())
    std::printf("  no block for %-24s %15s\n", name.c_str(), world::with_thousands(count.get<uint64_t>()).c_str());
  if (!effects) return;
  std::printf("\neffects\n");
  for (const auto& effect : j["effects"])
    std::printf("  %-16s %-4s %s\n", effect["name"].get<std::string>().c_str(),
                effect["called_for"].get<bool>() ? "yes" : "no", effect["why"].get<std::string>().c_str());
  std::printf("\nrules of matter (what rules make may call for more)\n");
  for (const auto& rule : j["rules"]) {
    std::printf("  %-16s %-4s %s\n", rule["name"].get<std::string>().c_str(),
                rule["called_for"].get<bool>() ? "yes" : "no", rule["why"].get<std::string>().c_str());
    std::printf("  %-16s      %s\n", "", rule["what"].get<std::string>().c_str());
    std::printf("  %-16s      layers: %s; keeps: %s\n", "", rule["layers"].get<std::string>().c_str(),
                rule["conserves"].get<std::string>().c_str());
  }
}

/// Of a file, or of all files of a folder; 0 for a scene that is compiled in.
uint64_t bytes_on_disk(const std::filesystem::path& path) {
  std::error_code error;
  uint64_t bytes = 0;
  if (std::filesystem::is_directory(path, error)) {
    for (std::filesystem::recursive_directory_iterator at(path, error), end; !error && at != end; at.increment(error))
      if (at->is_regular_file(error)) bytes += at->file_size(error);
    return bytes;
  }
  const auto size = std::filesystem::file_size(path, error);
  return error ? 0 : size;
}

world::Result<int> run_info(const InfoOptions& options) {
  TRY(const world::Scene scene, world::load_scene(options.file));
  world::ImportReport report;
  TRY(world::World world, world::build_world(scene, report));
  const size_t bytes_open = world.store.bytes_memory();
  world.store.pack();
  const nlohmann::json j = info_json(world, report, bytes_on_disk(options.file), bytes_open);
  if (options.json)
    std::cout << json_text(j) << '\n';
  else
    print_info(j, options.effects);
  return 0;
}

}  // namespace

void add_info_verb(CommandLine& command) {
  auto options = std::make_shared<InfoOptions>();
  CLI::App* verb = command.verb("info", "what a world holds and costs");
  verb->add_option("FILE", options->file, "a world, an importable file, or a scene")->required();
  verb->add_flag("--effects", options->effects, "which effects and rules of matter it calls for, and why");
  verb->add_flag("--json", options->json, "one JSON object on stdout");
  command.action(verb, [options] { return run_info(*options); });
}

}  // namespace tools
