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
  bool sticky = false;
};

// The columns file, loop and sticky, in any order; others are ignored. Throws record::RecordError.
std::vector<Label> read_labels(const std::filesystem::path& path);

}  // namespace loopwarden::studies
