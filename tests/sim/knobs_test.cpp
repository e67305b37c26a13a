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

}  // namespace
}  // namespace sim
