/// Choices of the knob liquid_model.
#pragma once

#include <array>
#include <string_view>

namespace sim {

enum class LiquidModel { levels, finite, waves };
constexpr auto knob_choices(LiquidModel) { return std::array<std::string_view, 3>{"levels", "finite", "waves"}; }

/// Of the knob liquid_passes.
inline constexpr int kMostLiquidPasses = 16;

}  // namespace sim
