// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace loopwarden::daemon {

// Returns true if the kernel reports that `path` is on flash memory: an SD card, eMMC, an SSD or a
// removable disk. Returns false for other disks, and if it is not known, for example on a network
// or overlay file system. `devices`: the kernel's folder of block devices.
bool is_on_flash(const std::filesystem::path& path,
                 const std::filesystem::path& devices = "/sys/dev/block");

}  // namespace loopwarden::daemon
