// SPDX-License-Identifier: Apache-2.0
// While a RealTimeSection exists on a thread, this thread may not allocate, free, lock, or call the
// kernel for I/O: the offence is counted and named. The wrapped functions are replaced in the whole
// test program (rt_guard.cpp); under a sanitizer, which replaces them itself, nothing is counted.
#pragma once

#include <cstdint>

namespace loopwarden::tests {

class RealTimeSection {
 public:
  RealTimeSection() noexcept;
  RealTimeSection(const RealTimeSection&) = delete;
  RealTimeSection& operator=(const RealTimeSection&) = delete;
  ~RealTimeSection();

  // Offences on this thread since the last call of reset(), and the name of the last.
  static std::uint64_t offences() noexcept;
  static const char* last_offence() noexcept;
  static void reset() noexcept;
  // False where a sanitizer is in the way.
  static bool effective() noexcept;
};

}  // namespace loopwarden::tests
