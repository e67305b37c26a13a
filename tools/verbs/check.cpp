/// loam check WORLD: verifies a save, and with --repair keeps all of it that is whole.
#include <cstdio>
#include <iostream>

#include <nlohmann/json.hpp>

#include "tools/json_text.h"
#include "tools/verb.h"
#include "world/base/text.h"
#include "world/saves/check.h"

namespace tools {

namespace {

struct CheckOptions {
  std::string file;
  bool repair = false, json = false;
};

void print_json(const world::CheckReport& report, const CheckOptions& options) {
  nlohmann::json j{{"file", options.file},        {"clean", report.clean()},   {"version", report.version},
                   {"saves", report.saves},       {"regions", report.regions}, {"voxels", report.voxels},
                   {"problems", report.problems}, {"lost", report.lost}};
  if (!report.repaired.empty()) j["repaired"] = report.repaired.string(), j["backup"] = report.backup.string();
  std::cout << json_text(j) << '\n';
}

void print_text(const world::CheckReport& report, const CheckOptions& options) {
  std::printf("%s: %s\n", options.file.c_str(), report.clean() ? "whole" : "damaged");
  std::printf("  version %d, %lld saves, %s whole regions, %s voxels\n", report.version,
              static_cast<long long>(report.saves), world::with_thousands(report.regions).c_str(),
              world::with_thousands(report.voxels).c_str());
  for (const std::string& problem : report.problems) std::printf("  problem: %s\n", problem.c_str());
  for (const std::string& lost : report.lost) std::printf("  lost: %s\n", lost.c_str());
  if (!report.repaired.empty())
    std::printf("  repaired; the damaged file is kept as %s\n", report.backup.c_str());
  else if (!report.clean())
    std::printf("  `loam check --repair %s` keeps what is whole\n", options.file.c_str());
}

world::Result<int> run_check(const CheckOptions& options) {
  TRY(const world::CheckReport report,
      options.repair ? world::repair_save(options.file) : world::check_save(options.file));
  if (options.json)
    print_json(report, options);
  else
    print_text(report, options);
  const bool fine = report.clean() || (options.repair && report.lost.empty());
  return fine ? 0 : static_cast<int>(world::ErrorKind::comparison);
}

}  // namespace

void add_check_verb(CommandLine& command) {
  auto options = std::make_shared<CheckOptions>();
  CLI::App* verb = command.verb("check", "verify a saved world, and repair what can be");
  verb->add_option("WORLD", options->file, "a .loam file")->required();
  verb->add_flag("--repair", options->repair,
                 "put what is whole into a new file; the damaged one is kept beside it under another name");
  verb->add_flag("--json", options->json, "one JSON object on stdout");
  verb->footer("Exit: 0 whole, or repaired without a loss; 1 damaged, or something was lost; 3 no Loam save.");
  command.action(verb, [options] { return run_check(*options); });
}

}  // namespace tools
