// SPDX-License-Identifier: Apache-2.0
// Reads the tags of a plant from a list of a server or a spreadsheet.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "record/import/tags.hpp"

namespace loopwarden::workbench::discover {

struct ListedTag {
  std::string name;  // the feeder's name for the tag; loops are found by it
  std::string node;  // node id on the server; may be empty
  std::string unit, description;
  std::optional<record::SignalRange> range;
  bool is_text = false;  // a mode whose values are words
  std::string value{};   // present value of a text; empty: not in the list
};

struct TagList {
  std::vector<ListedTag> tags;     // each name occurs once
  std::vector<std::string> notes;  // FILE:LINE with each skipped entry
};

// Reads columns in any order: tag or name, address, node or node_id, data_type, unit, low, high,
// description, value. Other columns are ignored.
// The name is the first of tag, name, address and node that contains a loop and a signal.
// Otherwise it is the first of them that is filled in.
// Tags whose data type is not a number (text, times) are left out, except modes that are text. A
// range with only one end, or without a span, counts as missing.
// Throws CommandError with FILE:LINE:COLUMN if the list has no tag, an end is not a number, or a
// quote is not closed.
TagList read_tag_list(const std::string& file, std::string_view text);
// Reads a file, which may be packed or encoded like an export, or BOOK.xlsx/SHEET. `name`: for
// notes and errors. Also throws record::RecordError.
TagList read_tag_file(const std::filesystem::path& path, const std::string& name);

}  // namespace loopwarden::workbench::discover
