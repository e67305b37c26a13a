/// How a verb of the command is added: one file tools/verbs/<name>.cpp that defines
///   void add_<name>_verb(CommandLine& command)
/// CMake lists the folder in generated/tools_verbs.list.h, so no other file changes.
///
/// Data goes to stdout, logs and progress to stderr. An action returns the exit code (0 fine, 1 a comparison failed),
/// or an error, whose kind is the exit code.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "world/base/errors.h"

namespace tools {

using VerbAction = std::function<world::Result<int>()>;

struct CommandLine {
  CLI::App& app;
  std::vector<std::pair<CLI::App*, VerbAction>> actions;

  /// Adds a verb; set its options on what is returned, then give its action.
  CLI::App* verb(const std::string& name, const std::string& what) { return app.add_subcommand(name, what); }
  void action(CLI::App* verb, VerbAction run) { actions.emplace_back(verb, std::move(run)); }
};

/// Runs the command line; never throws.
int run_command(int argc, const char* const* argv);

}  // namespace tools
