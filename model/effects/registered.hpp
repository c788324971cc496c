// SPDX-License-Identifier: Apache-2.0
// Returns the descriptors of this folder with their texts, unsorted. CMakeLists.txt generates the
// function from the files of the folder: model/effects/<name>.cpp defines
// loopwarden::effects::<name>::describe(), and words.txt has a section [<name>].
#pragma once

#include <vector>

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects {

std::vector<Descriptor> registered_effects();

}  // namespace loopwarden::effects
