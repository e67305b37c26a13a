#include <cstdlib>
#include <system_error>

#include "tools/bench/benchmark.h"
#include "tools/picture.h"
#include "world/scenes/scene.h"

namespace tools {

BenchContext::BenchContext(bool quick, uint64_t seed) : quick_(quick), seed_(seed) {}

BenchContext::~BenchContext() {
  std::error_code ignored;
  if (!scratch_.empty()) std::filesystem::remove_all(scratch_, ignored);
}

Result<const world::World*> BenchContext::world(const std::string& scene) {
  auto& slot = worlds_[scene];
  if (!slot) {
    TRY(const world::Scene description, world::load_scene(scene));
    world::ImportReport report;
    TRY(world::World made, build_picture_world(description, report));
    slot = std::make_unique<world::World>(std::move(made));
  }
  return static_cast<const world::World*>(slot.get());
}

Result<std::filesystem::path> BenchContext::scratch() {
  if (!scratch_.empty()) return scratch_;
  std::error_code failed;
  std::string name = (std::filesystem::temp_directory_path(failed) / "loam-bench-XXXXXX").string();
  if (failed || !mkdtemp(name.data()))
    return world::input_error("cannot make a temporary folder like " + name + "; set TMPDIR to a writable folder");
  scratch_ = name;
  return scratch_;
}

}  // namespace tools
