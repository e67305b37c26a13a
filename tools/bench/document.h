/// Markdown whose numbers come from kept results, so that none is typed by hand. Marks are comments, which no page
/// shows; the text beside them is written by `loam bench document FILE` and may be typed anyhow before that.
///
///   <!-- bench on intel-r-xeon-r-processor-2-cores -->      the machine of what follows, a folder of the results
///
///   <!-- bench | {value} | {rival} | {reach} -->            over a table: its last columns, here three. The column
///   | what | row | Loam | beside it | aim |                 before them names the row of each line, in backquotes;
///   |---|---|---|---|---|                                   the other columns and the head are left as they are.
///   | a save | `store/save` | 270 ms | SQLite: 16 ms | 600 ms |
///
///   A save takes <!-- bench {value store/save} -->270 ms<!-- -->.        within a line, not at its beginning
///
/// In braces stand [MACHINE: ]FIELD[ ROW]; the text around them is kept. ROW is suite/row or subject/setting; a `*` is
/// what the line of the table names, and without a ROW that is all of it. A line that names several rows has the
/// values of all, between commas; later ones may leave out the suite or subject of the first. A method with a single
/// setting needs no @KNOB.
///
///   of a row    value, spread (the quartiles), rival (the first or best, with its name), rival NAME, rivals (all),
///               ratio (to the first or best), reach (to be met, and whether it is missed), counter NAME
///   of a point  error (by the first metric), error 2, ..., bias, ms (as a time), work
///   of both     machine, date, commit, quick
///
/// A field that the row hasn't, like a rival, leaves the cell empty. In fenced code nothing is a mark.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/bench/kept_results.h"

namespace tools {

struct DocumentChange {
  size_t line = 0;  // from 1
  std::string row;  // what the line names, or the mark within it
  std::string before, after;
};

struct DocumentResult {
  std::string text;
  std::vector<DocumentChange> changes;
  std::vector<std::string> rows;  // all that were looked up: suite/row or subject/setting
  size_t quick = 0;               // of them, from quick runs
};

/// The error names file and line.
Result<DocumentResult> document(const std::string& text, const std::string& file, const KeptResults& results);

}  // namespace tools
