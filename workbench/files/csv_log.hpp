// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace loopwarden::workbench {

// Adds a line to a CSV file that begins with `header`; both without their line ends. Creates the
// file if it does not exist. The line is added completely, or the file stays as it is. Waits for
// the disk. Throws CommandError.
void append_csv_line(const std::filesystem::path& path, const std::string& header,
                     const std::string& line);

// Throws CommandError with the text of `error`: "PATH: what: ...".
[[noreturn]] void fail_csv(const std::filesystem::path& path, const char* what, int error);

}  // namespace loopwarden::workbench
