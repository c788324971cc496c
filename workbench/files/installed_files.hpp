// SPDX-License-Identifier: Apache-2.0
// Documents and help name files of the source tree: examples/gap-example/record.csv,
// examples/models/plant1.yaml. On a machine that has the package instead they are found where
// it put them.
#pragma once

#include <string>

namespace loopwarden::workbench {

inline constexpr const char* kShare = "/usr/share";

// `path` itself if it is there, or if the package has nothing for it either.
std::string installed(const std::string& path, const std::string& share = kShare);

}  // namespace loopwarden::workbench
