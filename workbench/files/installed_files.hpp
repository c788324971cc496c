// SPDX-License-Identifier: Apache-2.0
// Finds files of the source tree that documents and help name, such as
// examples/gap-example/record.csv or examples/models/plant1.yaml. On a machine with the package,
// they are in the package's folders.
#pragma once

#include <string>

namespace loopwarden::workbench {

inline constexpr const char* kShare = "/usr/share";

// Returns `path` if it exists or if the package has no file for it. Otherwise returns the path of
// the package's file.
std::string installed(const std::string& path, const std::string& share = kShare);

}  // namespace loopwarden::workbench
