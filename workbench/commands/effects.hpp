// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace loopwarden::workbench {

// docs/effects.md: the catalogue, how to recognise each effect, and its pictures beside it in
// pictures/effects/.
std::string effects_markdown();

}  // namespace loopwarden::workbench
