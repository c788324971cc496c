// SPDX-License-Identifier: Apache-2.0
// A plant's tags as a server or a spreadsheet lists them.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "record/import/tags.hpp"

namespace loopwarden::workbench::discover {

struct ListedTag {
  std::string name;  // what loops are found by, and what its feeder calls it
  std::string node;  // where a server has it; may be empty
  std::string unit, description;
  std::optional<record::SignalRange> range;
};

struct TagList {
  std::vector<ListedTag> tags;     // each name once
  std::vector<std::string> notes;  // FILE:LINE and what was passed over
};

// Columns in any order: tag or name, address, node or node_id, data_type, unit, low, high, description; others are passed
// over. The name is the first of tag, name, address and node that tells a loop and a signal, else the first that is filled
// in. What is no number by its data type (text, times) is left out. A range that has one end only, or no span, counts as not known. Throws
// CommandError with FILE:LINE:COLUMN: no tag in it, an end that is no number, a quote that is not closed.
TagList read_tag_list(const std::string& file, std::string_view text);
// Of a file that may be packed or encoded as exports are, or BOOK.xlsx/SHEET. Throws record::RecordError, too.
TagList read_tag_list(const std::filesystem::path& path);

}  // namespace loopwarden::workbench::discover
