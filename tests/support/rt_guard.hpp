// SPDX-License-Identifier: Apache-2.0
// While a RealTimeSection exists on a thread, this thread may not allocate, free, lock, or call the
// kernel for I/O: the offence is counted and named. The wrapped functions are replaced in the whole
// test program (rt_guard.cpp). A sanitizer replaces them itself: then its hooks tell of memory, and nothing
// tells of locks and I/O.
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
  // False where a sanitizer is in the way: memory is seen all the same.
  static bool sees_locks_and_io() noexcept;
};

}  // namespace loopwarden::tests
