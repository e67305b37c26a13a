// Nothing: for scenes that are built of what they fill in.
#include "world/gen/generator.h"

namespace world {
namespace {

class Empty : public Generator {
 public:
  void generate(RegionBuilder&) const override {}
};

}  // namespace

GeneratorInfo empty_generator() {
  GeneratorInfo info{"empty", "nothing but air", {}, {}};
  info.make = [](uint64_t, const std::map<std::string, double>&,
                 const BlockPalette&) -> Result<std::unique_ptr<Generator>> {
    return std::unique_ptr<Generator>(std::make_unique<Empty>());
  };
  return info;
}

}  // namespace world
