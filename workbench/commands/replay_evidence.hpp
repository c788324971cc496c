// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace loopwarden::workbench {

// Judges the window of an alarm's evidence again with the specialists that are stored with it.
// Prints the earlier and the present result. Returns the exit code, kExitData if they differ.
int replay_evidence(const std::filesystem::path& folder, bool json);

}  // namespace loopwarden::workbench
