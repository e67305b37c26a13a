// A landscape to walk in: mountains with caves, overhangs and ores, a valley with a river and a lake, woods, meadows,
// reeds on the shore, and here and there a lamp-lit cabin behind its fence. It is at rest as it is made, but for lava.
#include <atomic>

#include "world/gen/generator.h"
#include "world/gen/landscape/canvas.h"
#include "world/gen/landscape/columns.h"
#include "world/gen/landscape/homestead.h"
#include "world/gen/landscape/plants.h"
#include "world/gen/landscape/rest.h"
#include "world/gen/landscape/terrain.h"

namespace world {
namespace {

using namespace landscape;

struct Settings {
  int32_t mountains_m;
  double trees;
  bool caves, lava, homesteads;
};

/// What a thread keeps from region to region: half a megabyte of columns, a few of leaves.
struct Workspace {
  Columns columns;
  uint64_t columns_of = 0;  // the generator that filled them; regions above each other share theirs
  Canvas canvas;
};

uint64_t next_identity() {
  static std::atomic<uint64_t> last{0};
  return ++last;
}

class Valley : public Generator {
 public:
  Valley(uint64_t seed, const Settings& settings, const Materials& materials)
      : settings_(settings),
        materials_(materials),
        relief_(seed, settings.mountains_m),
        terrain_(relief_, materials_, settings.caves, settings.lava) {}

  void generate(RegionBuilder& region) const override {
    const int32_t y0 = voxel_from_region(region.pos()).y;
    if (y0 > kHighestGround + kRegionSize) return;  // nothing grows that high
    thread_local Workspace workspace;
    Columns& columns = workspace.columns;
    Canvas& canvas = workspace.canvas;
    canvas.reset(region.pos());
    if (y0 >= 0) {
      const bool there =
          workspace.columns_of == identity_ && columns.x0 == canvas.origin.x && columns.z0 == canvas.origin.z;
      if (!there) relief_.columns(region.pos(), materials_, columns);
      workspace.columns_of = identity_;
    }
    terrain_.fill(columns, canvas);
    if (y0 >= 0) {
      std::vector<Homestead> homesteads;
      if (settings_.homesteads) homesteads = homesteads_near(relief_, region.pos());
      draw_trees(relief_.seed(), settings_.trees, columns, terrain_, homesteads, materials_, canvas);
      for (const Homestead& home : homesteads) draw_homestead(home, columns, materials_, canvas);
      draw_undergrowth(relief_.seed(), columns, materials_, canvas);
      hold_grains(columns, terrain_, homesteads, materials_, canvas);
    }
    canvas.write_to(region);
  }
  /// Glass before lakes and rivers.
  BlockId at_side(BlockId block) const override {
    return block == materials_.water || block == materials_.lava ? materials_.glass
                                                                 : held(block, materials_, materials_.rocks[0]);
  }

 private:
  uint64_t identity_ = next_identity();
  Settings settings_;
  Materials materials_;
  Relief relief_;
  Terrain terrain_;
};

}  // namespace

GeneratorInfo valley_generator() {
  GeneratorInfo info{"valley",
                     "mountains with caves and ores, a river, a lake, woods, and lamp-lit cabins",
                     {{"mountains_m", 135}, {"trees", 1}, {"caves", 1}, {"lava", 0}, {"homesteads", 1}},
                     {}};
  info.make = [](uint64_t seed, const std::map<std::string, double>& parameters,
                 const BlockPalette& palette) -> Result<std::unique_ptr<Generator>> {
    TRY(const Materials materials, Materials::from(palette));
    const double mountains = parameters.at("mountains_m"), trees = parameters.at("trees");
    if (!(mountains >= 0 && mountains <= 150))
      return input_error("generator 'valley': mountains_m must be in [0, 150]");
    if (!(trees >= 0 && trees <= 1)) return input_error("generator 'valley': trees must be in [0, 1]");
    const Settings settings{static_cast<int32_t>(mountains), trees, parameters.at("caves") != 0,
                            parameters.at("lava") != 0, parameters.at("homesteads") != 0};
    return std::unique_ptr<Generator>(std::make_unique<Valley>(seed, settings, materials));
  };
  return info;
}

}  // namespace world
