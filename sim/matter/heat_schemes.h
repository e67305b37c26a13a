/// Choices of the knobs of heat and fire.
#pragma once

#include <array>
#include <string_view>

namespace sim {

enum class HeatScheme { limited, explicit_steps, implicit };
constexpr auto knob_choices(HeatScheme) { return std::array<std::string_view, 3>{"limited", "explicit", "implicit"}; }
enum class FireModel { chance, heat };
constexpr auto knob_choices(FireModel) { return std::array<std::string_view, 2>{"chance", "heat"}; }

}  // namespace sim
