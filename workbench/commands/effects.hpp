// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace loopwarden::workbench {

// Returns docs/reference/effects.md: the catalogue, the signs of each effect, and links to its
// pictures in pictures/effects/.
std::string effects_markdown();

}  // namespace loopwarden::workbench
