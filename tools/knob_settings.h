/// Settings of knobs as they are told on the command line, KNOB=VALUE, for any table of knobs.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "world/base/knobs.h"

namespace tools {

/// Sets them in order; `also` gets what was set, where it isn't null. Fails at the first that isn't KNOB=VALUE, names
/// no knob of the table, or has a value that the knob doesn't take.
template <class Knobs>
world::Status set_knobs(const world::KnobTable<Knobs>& table, Knobs& knobs, const std::vector<std::string>& settings,
                        std::map<std::string, std::string>* also = nullptr) {
  for (const std::string& setting : settings) {
    const size_t equals = setting.find('=');
    if (equals == std::string::npos)
      return world::usage_error("--set takes KNOB=VALUE, for instance " + table.rows().front().name + "=" +
                                table.rows().front().usual + ", not \"" + setting + "\"");
    const std::string name = setting.substr(0, equals), value = setting.substr(equals + 1);
    TRY_STATUS(table.set(knobs, name, value));
    if (also) (*also)[name] = value;
  }
  return {};
}

}  // namespace tools
