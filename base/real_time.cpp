// SPDX-License-Identifier: Apache-2.0
#include "base/real_time.hpp"

#include <malloc.h>
#include <sys/mman.h>

#include <cerrno>
#include <cstddef>
#include <cstring>

namespace loopwarden::base {

std::string lock_memory() {
  // Freed memory stays with the process, so that a later use causes no page fault.
  mallopt(M_TRIM_THRESHOLD, -1);
  mallopt(M_MMAP_MAX, 0);
  // Loads all present pages, including code, into memory: a disk that hangs then can't stop a
  // thread. Later memory, such as the threads' stacks, has no file on a disk. It is locked when it
  // is first used.
  if (mlockall(MCL_CURRENT) == 0 && mlockall(MCL_FUTURE | MCL_ONFAULT) == 0) return {};
  const int error = errno;
  munlockall();
  return std::string("memory could not be locked (") + std::strerror(error) +
         "): a cycle may be late after memory was swapped out; raise LimitMEMLOCK";
}

void prefault_stack() noexcept {
  constexpr std::size_t kBytes = 64UL * 1024UL;
  constexpr std::size_t kPage = 4096;
  [[maybe_unused]] volatile std::byte stack[kBytes];
  for (std::size_t i = 0; i < kBytes; i += kPage) stack[i] = std::byte{0};
}

}  // namespace loopwarden::base
