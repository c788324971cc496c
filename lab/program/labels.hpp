// SPDX-License-Identifier: Apache-2.0
// Reads labels.csv of a folder of records, with the known facts about each record.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace loopwarden::lab {

struct Label {
  std::string file;
  std::string loop;
  std::string plant;  // without the column: the leading letters of the file's name, or all of it
  std::string kind;   // of loop, empty without the column
  bool sticky = false;
};

// Columns in any order: file, loop, sticky and optionally plant and kind; others are ignored.
// Throws record::RecordError.
std::vector<Label> read_labels(const std::filesystem::path& path);

}  // namespace loopwarden::lab
