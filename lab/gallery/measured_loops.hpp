// SPDX-License-Identifier: Apache-2.0
// Measured loops drawn: what an engineer sees in the picture, and what `loopwarden diagnose` says of the record.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace loopwarden::studies {

struct MeasuredLoop {
  std::string file;     // of the picture, without its ending
  std::string title;    // loop and what it controls
  std::string seen;     // by an engineer
  std::string said;     // by `diagnose`
  std::string picture;  // SVG
};

// `data`: folder with routine, isdb and measured; `program`: loopwarden. Throws RecordError where a record can't be read,
// std::runtime_error where the program fails.
std::vector<MeasuredLoop> measured_loops(const std::filesystem::path& data,
                                         const std::filesystem::path& program);

}  // namespace loopwarden::studies
