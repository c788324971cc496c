// SPDX-License-Identifier: Apache-2.0
// While a RealTimeSection exists on a thread, this thread must not allocate, free, lock, or call
// the kernel for I/O. Each offence is counted and named. The wrapped functions are replaced in the
// whole test program (rt_guard.cpp). A sanitizer replaces them itself. Then its hooks report
// memory, and locks and I/O are not checked.
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
  // False if a sanitizer prevents the check. Memory is checked all the same.
  static bool sees_locks_and_io() noexcept;
};

}  // namespace loopwarden::tests
