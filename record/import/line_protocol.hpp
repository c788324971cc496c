// SPDX-License-Identifier: Apache-2.0
// Converts InfluxDB line protocol to a table: one row per field, with the columns time, series and
// value.
//
//   plant,unit=1 FIC101.PV=36.8,FIC101.OP=35i 1793599200000000000
//
// A series is called MEASUREMENT.TAGS.FIELD. A field `value` is left out, as in annotated CSV. Tags
// with the same value in all of the first lines are left out of the name. Numbers may end in i or
// u, true and false become 1 and 0, and strings are kept.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "record/import/text_source.hpp"

namespace loopwarden::record {

inline constexpr const char* kLineProtocol = "InfluxDB line protocol";

struct ProtocolLine {
  std::string measurement;
  std::vector<std::pair<std::string, std::string>> tags;
  std::vector<std::pair<std::string, std::string>> fields;  // values in the form of table cells
  std::string time;                                         // empty: no time
};
// Returns false if `text` is no line of the protocol. Clears `line` first.
bool parse_protocol_line(std::string_view text, ProtocolLine& line);

// Returns whether the first lines are line protocol; comments and empty lines do not count.
bool is_line_protocol(std::string_view head);

// Returns the table as text with tabs between cells. Throws RecordError for a line of another
// format or without a time.
std::unique_ptr<TextSource> protocol_table(std::unique_ptr<TextSource> text);

}  // namespace loopwarden::record
