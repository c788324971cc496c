// SPDX-License-Identifier: Apache-2.0
// What the recorder of a running daemon holds of a loop, for commands that otherwise take records from files.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace loopwarden::workbench {

// A time such as 4h, 90min, 2d or 45s, in s; nullopt: it is none, or not above 0.
std::optional<double> seconds_of(const std::string& text);

// The last `last_s` s of `loop`, as records in `target`, the longest first: a restart of the daemon or a long gap begins
// another. Those below kShortest_s are left out, unless there are no others. Throws CommandError where the daemon does not
// know the loop or has recorded nothing of it, RecordError, std::runtime_error where no daemon answers.
std::vector<std::string> recorded(const std::string& socket, const std::string& loop, double last_s,
                                  const std::filesystem::path& target);
inline constexpr double kShortest_s = 300.0;

}  // namespace loopwarden::workbench
