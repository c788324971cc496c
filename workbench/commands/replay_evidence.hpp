// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace loopwarden::workbench {

// Judges the window of an alarm's evidence once more, by the specialists that are kept with it, and prints
// what was found then and what is found now. Returns the exit code: kExitData if the two differ.
int replay_evidence(const std::filesystem::path& folder, bool json);

}  // namespace loopwarden::workbench
