/// References that took long, kept between runs: in the user's cache folder, by a hash of what they depend on. A file
/// that is damaged, or of another version, is as if it weren't there.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace tools {

/// The numbers kept under `key`, or those that make() gives, which are then kept; where there is no place to keep them,
/// only that. `key` is a hash of everything that they depend on, the code that makes them included.
std::vector<double> cached_reference(uint64_t key, size_t count, const std::function<std::vector<double>()>& make);

}  // namespace tools
