// SPDX-License-Identifier: Apache-2.0
#include "tests/support/rt_guard.hpp"

#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <unistd.h>

#include <cstdarg>
#include <cstddef>

// g++ reports it by a macro, clang by a feature.
#if !defined(__has_feature)
#define __has_feature(feature) 0
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || \
    __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define LOOPWARDEN_SANITIZED 1
#else
#define LOOPWARDEN_SANITIZED 0
#endif

#if LOOPWARDEN_SANITIZED
// Declared as in <sanitizer/allocator_interface.h>, which g++ does not provide.
extern "C" int __sanitizer_install_malloc_and_free_hooks(  // NOLINT
    void (*on_malloc)(const volatile void*, std::size_t), void (*on_free)(const volatile void*));
#endif

namespace loopwarden::tests {
namespace {

thread_local int depth = 0;
thread_local std::uint64_t count = 0;
thread_local const char* last = "";

void note(const char* what) noexcept {
  if (depth == 0) return;
  ++count;
  last = what;
}

#if LOOPWARDEN_SANITIZED
const int hooked = __sanitizer_install_malloc_and_free_hooks(
    [](const volatile void*, std::size_t) { note("malloc"); },
    [](const volatile void* p) {
      if (p != nullptr) note("free");
    });
#else
// Returns the library's function that this program replaces.
template <class F>
F* original(const char* name) noexcept {
  return reinterpret_cast<F*>(dlsym(RTLD_NEXT, name));
}
#endif

}  // namespace

RealTimeSection::RealTimeSection() noexcept { ++depth; }
RealTimeSection::~RealTimeSection() { --depth; }
std::uint64_t RealTimeSection::offences() noexcept { return count; }
const char* RealTimeSection::last_offence() noexcept { return last; }
void RealTimeSection::reset() noexcept {
  count = 0;
  last = "";
}
bool RealTimeSection::sees_locks_and_io() noexcept { return LOOPWARDEN_SANITIZED == 0; }

}  // namespace loopwarden::tests

#if !LOOPWARDEN_SANITIZED

extern "C" {

void* __libc_malloc(std::size_t);               // NOLINT
void* __libc_calloc(std::size_t, std::size_t);  // NOLINT
void* __libc_realloc(void*, std::size_t);       // NOLINT
void __libc_free(void*);                        // NOLINT

void* malloc(std::size_t size) {
  loopwarden::tests::note("malloc");
  return __libc_malloc(size);
}
void* calloc(std::size_t n, std::size_t size) {
  loopwarden::tests::note("calloc");
  return __libc_calloc(n, size);
}
void* realloc(void* p, std::size_t size) {
  loopwarden::tests::note("realloc");
  return __libc_realloc(p, size);
}
void free(void* p) {
  if (p != nullptr) loopwarden::tests::note("free");
  __libc_free(p);
}
int pthread_mutex_lock(pthread_mutex_t* mutex) {
  loopwarden::tests::note("pthread_mutex_lock");
  static auto* const real =
      loopwarden::tests::original<int(pthread_mutex_t*)>("pthread_mutex_lock");
  return real(mutex);
}
ssize_t write(int fd, const void* data, std::size_t size) {
  loopwarden::tests::note("write");
  static auto* const real =
      loopwarden::tests::original<ssize_t(int, const void*, std::size_t)>("write");
  return real(fd, data, size);
}
ssize_t read(int fd, void* data, std::size_t size) {
  loopwarden::tests::note("read");
  static auto* const real = loopwarden::tests::original<ssize_t(int, void*, std::size_t)>("read");
  return real(fd, data, size);
}

}  // extern "C"

#endif
