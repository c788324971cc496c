// SPDX-License-Identifier: Apache-2.0
// The descriptors of this folder with their words, in no order. CMakeLists.txt writes the function from the folder's
// files: model/effects/<name>.cpp defines loopwarden::effects::<name>::describe(), words.txt has a section [<name>].
#pragma once

#include <vector>

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects {

std::vector<Descriptor> registered_effects();

}  // namespace loopwarden::effects
