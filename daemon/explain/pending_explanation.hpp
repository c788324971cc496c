// SPDX-License-Identifier: Apache-2.0
// pending.json in the folder of an alarm's evidence. The file states that the alarm is still to be
// explained, and how many of its minutes are on the disk. It is removed when the alarm is explained
// or can't be explained.
#pragma once

#include <filesystem>
#include <optional>

namespace loopwarden::daemon {

struct PendingExplanation {
  double enough_s = 0.0;  // required time after the alarm
  double there_s = 0.0;   // time after the alarm in minutes.csv
};

// Throws std::runtime_error if it can't be written.
void write_pending(const PendingExplanation& pending, const std::filesystem::path& folder);
// Returns nullopt if there is no file. An unreadable file gives default values.
std::optional<PendingExplanation> read_pending(const std::filesystem::path& folder);
void end_pending(const std::filesystem::path& folder) noexcept;

}  // namespace loopwarden::daemon
