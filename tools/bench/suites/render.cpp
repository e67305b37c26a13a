/// `loam render valley` from nothing to a PNG: a process of its own that generates, derives, draws and writes.
#include <cmath>
#include <cstdlib>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tools/bench/benchmark.h"

namespace tools {

namespace {

/// Runs this program with the arguments, its output thrown away; the exit code, or -1.
int run_loam(const std::filesystem::path& loam, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), loam.string());
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t quiet;
  posix_spawn_file_actions_init(&quiet);
  posix_spawn_file_actions_addopen(&quiet, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&quiet, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  pid_t child = 0;
  const int spawned = posix_spawn(&child, loam.c_str(), &quiet, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&quiet);
  int status = 0;
  if (spawned != 0 || waitpid(child, &status, 0) != child || !WIFEXITED(status)) return -1;
  return WEXITSTATUS(status);
}

Result<Prepared> prepare(BenchContext& context, const std::string& ours, const std::string& rival) {
  std::error_code failed;
  const std::filesystem::path loam = std::filesystem::read_symlink("/proc/self/exe", failed);
  if (failed || loam.filename() != "loam")
    return world::input_error("this row starts the program `loam` anew, so it runs only within it");
  TRY(const std::filesystem::path folder, context.scratch());
  const auto render = [=](const std::string& backend) {
    return [=] {
      const int code = run_loam(loam, {"render", "valley", "--backend", backend, "--size", "1280x720", "-o",
                                       (folder / (backend + ".png")).string()});
      return code == 0 ? 0.0 : std::nan("");
    };
  };
  const int code =
      run_loam(loam, {"render", "valley", "--backend", ours, "--size", "32x18", "-o", (folder / "first.png").string()});
  if (code == static_cast<int>(world::ErrorKind::no_device))
    return world::Error{world::ErrorKind::no_device, "`loam render --backend " + ours + "` found no device"};
  return Prepared{.ours = {ours, render(ours)}, .rivals = {{rival, render(rival)}}};
}

}  // namespace

void add_suite_render(Registry& registry) {
  for (const auto& [ours, rival] : {std::pair{"raster", "raycast"}, std::pair{"raycast", "raster"}})
    registry.add({.name = std::string("valley_") + ours,
                  .what = std::string("loam render valley --backend ") + ours + " at 1280x720, from start to PNG",
                  .unit = "ms",
                  .better = Better::lower,
                  .timing = Timing::milliseconds,
                  .clock = Clock::wall,
                  .repetitions = 3,
                  .reach = Reach{10'000, "the first milestone: 10 s from nothing to PNG"},
                  .prepare = [ours = std::string(ours), rival = std::string(rival)](BenchContext& c) {
                    return prepare(c, ours, rival);
                  }});
}

}  // namespace tools
