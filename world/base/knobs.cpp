#include "world/base/knobs.h"

#include <cmath>

#include "world/base/text.h"

namespace world {

Result<Accuracy> accuracy_from_name(std::string_view name) {
  if (name == "fast") return Accuracy::fast;
  if (name == "usual") return Accuracy::usual;
  if (name == "exact") return Accuracy::exact;
  return usage_error("unknown accuracy \"" + std::string(name) + "\": use fast, usual or exact");
}

Result<bool> parse_knob_bool(std::string_view knob, std::string_view text) {
  if (text == "true" || text == "on" || text == "1") return true;
  if (text == "false" || text == "off" || text == "0") return false;
  return bad_choice(knob, text, {"true", "false"});
}

Result<double> parse_knob_number(std::string_view knob, std::string_view text, bool whole) {
  double number = 0;
  const auto end = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool parsed = end.ec == std::errc() && end.ptr == text.data() + text.size() && std::isfinite(number);
  if (!parsed || (whole && number != std::floor(number)))
    return usage_error("knob " + std::string(knob) + ": \"" + std::string(text) + "\" is not a " +
                       (whole ? "whole " : "finite ") + "number");
  return number;
}

Error knob_out_of_range(std::string_view knob, std::string_view text, const std::string& low, const std::string& high) {
  return usage_error("knob " + std::string(knob) + ": " + std::string(text) + " is outside [" + low + ", " + high +
                     "]");
}

Error unknown_knob(std::string_view name, const std::vector<std::string>& known) {
  std::string message = "unknown knob \"" + std::string(name) + "\"";
  const std::string nearest = nearest_text(name, known);
  if (!nearest.empty()) message += " (did you mean \"" + nearest + "\"?)";
  message += "; the knobs are:";
  for (const std::string& k : known) message += ' ' + k;
  return usage_error(message);
}

Error bad_choice(std::string_view knob, std::string_view text, const std::vector<std::string>& choices) {
  std::string message = "knob " + std::string(knob) + ": \"" + std::string(text) + "\" is none of its settings:";
  for (const std::string& c : choices) message += ' ' + c;
  return usage_error(message);
}

}  // namespace world
