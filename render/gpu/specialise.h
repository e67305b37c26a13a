/// SPIR-V with its specialisation constants fixed, and without what they rule out.
///
/// A driver reads a module, inlines its calls, and only then finds what can't run: a shader of many effects of which a
/// picture asks for two takes it seconds. Here the branches go first: Mesa's lavapipe takes 0.1 s for what took 5.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace render::gpu {

struct SpecialConstant {
  uint32_t id = 0, value = 0;  // a bool is 0 or 1; a float its bits
};

/// The module itself where it can't be read: then the driver says what is wrong. Constants of ids that it lacks are
/// left out.
std::vector<uint32_t> specialise(std::span<const uint32_t> code, std::span<const SpecialConstant> constants);

}  // namespace render::gpu
