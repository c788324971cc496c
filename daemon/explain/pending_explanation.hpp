// SPDX-License-Identifier: Apache-2.0
// pending.json in the folder of an alarm's evidence: it is still to be explained, and how much of its minutes is on the
// disk beside it. Gone once the alarm is explained, or can't be.
#pragma once

#include <filesystem>
#include <optional>

namespace loopwarden::daemon {

struct PendingExplanation {
  double enough_s = 0.0;  // after the alarm, what is waited for
  double there_s = 0.0;   // after the alarm, what minutes.csv has
};

// Throws std::runtime_error where it can't be written.
void write_pending(const PendingExplanation& pending, const std::filesystem::path& folder);
// Nothing: there is none. One that can't be read tells no more than that it is there.
std::optional<PendingExplanation> read_pending(const std::filesystem::path& folder);
void end_pending(const std::filesystem::path& folder) noexcept;

}  // namespace loopwarden::daemon
