// SPDX-License-Identifier: Apache-2.0
// The answer to `registers`: the fields of the register map by name, a line of JSON. Values are in the order of the
// names: those of area "box" under "box", those of area "loop" under each loop's "values".
#pragma once

#include <string>

#include "daemon/console/parts.hpp"

namespace loopwarden::daemon::console {

// `values_only`: without the names, which are always the same.
std::string registers(const Parts& parts, bool values_only);

}  // namespace loopwarden::daemon::console
