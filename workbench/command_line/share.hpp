// SPDX-License-Identifier: Apache-2.0
// Divides work among several machines that don't communicate. Each machine does its own share.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace loopwarden::workbench {

// Returns the FNV-1a hash of 64 bits with one more mixing step. It is equal on every machine.
std::uint64_t stable_hash(const std::string& text) noexcept;

// Share k of N. A name's share depends only on the name and N, so other names don't change it.
struct Share {
  std::size_t share = 1;  // from 1
  std::size_t of = 1;

  bool has(const std::string& name) const noexcept { return stable_hash(name) % of == share - 1; }
};

// Parses "k/N". An empty text means all of the work. Throws CommandError.
Share share_from(const std::string& text);

}  // namespace loopwarden::workbench
