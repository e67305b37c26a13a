#include "sim/knobs.h"

#include <gtest/gtest.h>

namespace sim {
namespace {

TEST(SimKnobs, AreSetByNameAndHaveThreeLevels) {
  SimKnobs knobs;
  ASSERT_TRUE(sim_knobs().set(knobs, "body_integrator", "runge_kutta_4").ok());
  EXPECT_EQ(knobs.body_integrator, Integrator::runge_kutta_4);
  EXPECT_FALSE(sim_knobs().set(knobs, "body_integrator", "euler").ok());
  EXPECT_FALSE(sim_knobs().set(knobs, "body_substep", "2").ok());
  EXPECT_EQ(sim_knobs().preset(world::Accuracy::exact).body_substeps, 4);
  EXPECT_EQ(sim_knobs().preset(world::Accuracy::fast).particle_limit, 65536);
}

TEST(SimKnobs, RefuseWhatIsOutOfTheirRangeAndNameIt) {
  const auto error_of = [](std::string_view name, std::string_view value) {
    SimKnobs knobs;
    const world::Status set = sim_knobs().set(knobs, name, value);
    return set.ok() ? "" : set.error().message;
  };
  EXPECT_EQ(error_of("liquid_passes", "-1"), "knob liquid_passes: -1 is outside [1, 16]");
  EXPECT_EQ(error_of("liquid_passes", "17"), "knob liquid_passes: 17 is outside [1, 16]");
  EXPECT_EQ(error_of("liquid_passes", "16"), "");
  EXPECT_EQ(error_of("heat_speed", "1e30"), "knob heat_speed: 1e30 is outside [0, 1e+11]");
  EXPECT_EQ(error_of("heat_speed", "-5"), "knob heat_speed: -5 is outside [0, 1e+11]");
  EXPECT_EQ(error_of("heat_interval", "0"), "knob heat_interval: 0 is outside [1, 64]");
  EXPECT_EQ(error_of("heat_substeps", "5000"), "knob heat_substeps: 5000 is outside [0, 4096]");
  EXPECT_EQ(error_of("body_substeps", "65"), "knob body_substeps: 65 is outside [1, 64]");
  EXPECT_EQ(error_of("particle_limit", "0"), "knob particle_limit: 0 is outside [1, 16777216]");
  EXPECT_EQ(error_of("support_reach", "0"), "knob support_reach: 0 is outside [1, 1073741824]");
}

}  // namespace
}  // namespace sim
