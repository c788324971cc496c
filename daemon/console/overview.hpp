// SPDX-License-Identifier: Apache-2.0
// All loops at a glance: the answer to `overview`, a line of JSON.
//
// One column for each quantity, in the order of the loops, numbers in at most six digits. It is asked for several times
// a second, of a thousand loops: no document is built on the way to the text.
#pragma once

#include <string>

#include "daemon/console/parts.hpp"

namespace loopwarden::daemon::console {

std::string overview(const Parts& parts);

}  // namespace loopwarden::daemon::console
