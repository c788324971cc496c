// SPDX-License-Identifier: Apache-2.0
#include "tests/services/page/support/failing_memory.hpp"

#include <cstdlib>
#include <new>

namespace loopwarden::tests {

thread_local int fail_allocation_after = -1;
std::atomic<int> allocations_failed{0};

}  // namespace loopwarden::tests

namespace {

void* allocated(std::size_t bytes) {
  using namespace loopwarden::tests;
  if (fail_allocation_after >= 0 && --fail_allocation_after < 0) {
    ++allocations_failed;
    throw std::bad_alloc();
  }
  void* memory = std::malloc(bytes > 0 ? bytes : 1);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

void* operator new(std::size_t bytes) { return allocated(bytes); }
void* operator new[](std::size_t bytes) { return allocated(bytes); }
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
  return std::malloc(bytes > 0 ? bytes : 1);
}
void* operator new[](std::size_t bytes, const std::nothrow_t&) noexcept {
  return std::malloc(bytes > 0 ? bytes : 1);
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
