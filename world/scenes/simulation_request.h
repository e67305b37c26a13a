/// What a scene or a world says of how it is simulated. The names are those of the simulation, which resolves them.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace world {

struct SimulationRequest {
  uint64_t seed = 1;                         // of all that is random
  std::vector<std::string> effects;          // asked for beyond what the content calls for
  std::map<std::string, std::string> knobs;  // name -> value, below those of the command line

  friend bool operator==(const SimulationRequest&, const SimulationRequest&) = default;
};

}  // namespace world
