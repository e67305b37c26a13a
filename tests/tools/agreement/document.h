/// tools/gallery/agreement.md: the table of agreement as a page, with what was measured.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace tools {

/// The worst of a row's pictures.
struct Measured {
  double share = 1;      // of the pixels: within the bound's levels
  double flip = 0;       // mean
  double elsewhere = 0;  // of the pixels: not within, and on no edge
};

/// By the row's number; of rows that aren't there, what `page` says of the same row.
std::string agreement_document(const std::map<size_t, Measured>& measured, const std::string& page);

/// The parts of a text between others; empty ones are left out.
std::vector<std::string> split(const std::string& text, const std::string& between);

/// A line of the page without what was measured, which stands in the last columns of the table's rows.
std::string without_measured(const std::string& line);

}  // namespace tools
