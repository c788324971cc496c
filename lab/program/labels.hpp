// SPDX-License-Identifier: Apache-2.0
// labels.csv of a folder of records: what is known of each.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace loopwarden::studies {

struct Label {
  std::string file;
  std::string loop;
  std::string
      plant;         // without a column: the letters that the file's name begins with, or all of it
  std::string kind;  // of loop, empty without a column
  bool sticky = false;
};

// The columns file, loop, sticky and, where they are there, plant and kind, in any order; others are ignored. Throws
// record::RecordError.
std::vector<Label> read_labels(const std::filesystem::path& path);

}  // namespace loopwarden::studies
