/// Small helpers on text for error messages.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace world {

/// Levenshtein distance: insertions, deletions and substitutions that turn a into b.
size_t edit_distance(std::string_view a, std::string_view b);
/// The candidate nearest to `text`, or empty where even it differs in more than half of the characters.
std::string nearest_text(std::string_view text, const std::vector<std::string>& candidates);
/// A TOML string, in quotes and escaped; bytes that are no UTF-8 become U+FFFD.
std::string toml_text(std::string_view text);
/// Text of a file, to be quoted in a message: its control characters become "\n", "\r", "\t" or "\u0007", so that
/// it stays on one line and no terminal obeys it. All else is kept.
std::string one_line(std::string_view text);
/// 1234567 -> "1,234,567".
std::string with_thousands(unsigned long long n);
/// 1536 -> "1.5 KiB".
std::string bytes_text(double bytes);

}  // namespace world
