// SPDX-License-Identifier: Apache-2.0
// Draws measured loops, with the observation of an engineer and the verdict of `loopwarden
// diagnose`.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace loopwarden::lab {

struct MeasuredLoop {
  std::string file;     // of the picture, without its ending
  std::string title;    // loop and its controlled variable
  std::string seen;     // observation of an engineer
  std::string said;     // verdict of `diagnose`
  std::string picture;  // SVG
};

// `data`: folder with routine, isdb and measured; `program`: loopwarden. Throws RecordError if a
// record can't be read, std::runtime_error if the program fails.
std::vector<MeasuredLoop> measured_loops(const std::filesystem::path& data,
                                         const std::filesystem::path& program);

}  // namespace loopwarden::lab
