#include "tools/verb.h"

#include <exception>
#include <iostream>
#include <new>

#include "commit.h"

namespace tools {

#define VERB(name) void add_##name##_verb(CommandLine& command);
#include "tools_verbs.list.h"
#undef VERB

namespace {

int report(const world::Error& error) {
  std::cerr << "loam: " << error.message << '\n';
  return static_cast<int>(error.kind);
}

int dispatch(CommandLine& command) {
  for (auto& [verb, run] : command.actions)
    if (verb->parsed()) {
      const world::Result<int> result = run();
      std::cout.flush();
      return result.ok() ? *result : report(result.error());
    }
  std::cout << command.app.help();
  return static_cast<int>(world::ErrorKind::usage);
}

}  // namespace

int run_command(int argc, const char* const* argv) {
  CLI::App app{"Loam: a voxel world simulator and renderer"};
  app.name("loam");
  app.set_version_flag("--version", "loam " LOAM_COMMIT);
  app.require_subcommand(0, 1);
  app.footer(
      "Examples:\n  loam render valley -o valley.png\n  loam convert N42E001.hgt andorra.loam\n"
      "  loam info andorra.loam --json\n  loam diff a.png b.png\n"
      "Exit: 0 fine, 1 a comparison failed, 2 usage, 3 input or output, 4 no device, 5 unstable.");
  CommandLine command{app, {}};
#define VERB(name) add_##name##_verb(command);
#include "tools_verbs.list.h"
#undef VERB
  try {
    app.parse(argc, argv);
    return dispatch(command);
  } catch (const CLI::ParseError& e) {
    const int code = app.exit(e);
    return code == 0 ? 0 : static_cast<int>(world::ErrorKind::usage);
  } catch (const std::bad_alloc&) {
    return report(world::input_error("memory ran out: use a smaller world, window or picture"));
  } catch (const std::exception& e) {
    return report(world::input_error(std::string("unexpected failure: ") + e.what()));
  }
}

}  // namespace tools
