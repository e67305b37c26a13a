/// Draws a subject's error over time, over work, or over its methods' knob, as an SVG of its own: both axes
/// logarithmic, to the bottom left is better.
///
/// The front of each problem is a bold line, with the problem's name at its cheap end where there are several; what
/// ships is ringed; a point that failed is a cross on the top edge, an exact one (error 0) a triangle on the bottom
/// edge, one below three noise floors is hollow; the floor is a grey band, and budgets of 1, 4, 16 and 64 ms are
/// dashed.
#pragma once

#include <string>

#include "tools/bench/runner.h"

namespace tools {

/// With what XML reads otherwise escaped, and control characters as spaces.
std::string xml_text(const std::string& text);
std::string pareto_svg(const SubjectResult& subject);
/// Over the deterministic work in the place of time; without a front.
std::string work_svg(const SubjectResult& subject);
/// Over the knob, with a dashed line of the slope that a method must show through its middle: for subjects that state
/// slopes.
std::string slopes_svg(const SubjectResult& subject);

}  // namespace tools
