// SPDX-License-Identifier: Apache-2.0
// Work that several machines share out among themselves without talking: each does what falls to it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace loopwarden::workbench {

// FNV-1a, 64 bits, mixed once more: the same on every machine.
std::uint64_t stable_hash(const std::string& text) noexcept;

// Share k of N. What falls to it depends on a name and N alone, so that it stays when others come and go.
struct Share {
  std::size_t share = 1;  // from 1
  std::size_t of = 1;

  bool has(const std::string& name) const noexcept { return stable_hash(name) % of == share - 1; }
};

// From "k/N"; empty: all of it. Throws CommandError.
Share share_from(const std::string& text);

}  // namespace loopwarden::workbench
