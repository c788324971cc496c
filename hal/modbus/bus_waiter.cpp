// SPDX-License-Identifier: Apache-2.0
#include "hal/modbus/bus_waiter.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <ctime>
#include <system_error>

#include "base/clock.hpp"

namespace loopwarden::hal::modbus {
namespace {

using base::kNanosecondsPerSecond;
constexpr std::int64_t kSliceNs = 200'000'000;
}  // namespace

BusWaiter::BusWaiter() : event_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (event_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
}

BusWaiter::~BusWaiter() { ::close(event_); }

void BusWaiter::interrupt() noexcept {
  // Fails only if the counter is full, and then an interruption is pending anyway.
  (void)eventfd_write(event_, 1);
}

void BusWaiter::stop() noexcept {
  stopping_.store(true, std::memory_order_release);
  interrupt();
}

std::int64_t BusWaiter::now_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kNanosecondsPerSecond + now.tv_nsec;
}

bool BusWaiter::sleep_until(std::int64_t deadline_ns) noexcept {
  while (!stopping()) {
    if (wait_until(deadline_ns) == Result::deadline) return !stopping();
  }
  return false;
}

BusWaiter::Result BusWaiter::wait_ready(int file, short events, std::int64_t deadline_ns) noexcept {
  while (!stopping()) {
    const Result result = wait_for_file(file, events, deadline_ns);
    if (result != Result::interrupted) return result;
  }
  return Result::interrupted;
}

BusWaiter::Result BusWaiter::wait_for_file(int file, short events,
                                           std::int64_t deadline_ns) noexcept {
  for (;;) {
    tick();
    if (stopping()) return Result::interrupted;
    const std::int64_t left = std::max<std::int64_t>(deadline_ns - now_ns(), 0);
    const std::int64_t slice = std::min(left, kSliceNs);
    const timespec timeout{slice / kNanosecondsPerSecond, slice % kNanosecondsPerSecond};
    std::array<pollfd, 2> files{{{event_, POLLIN, 0}, {file, events, 0}}};
    const int ready = ppoll(files.data(), file < 0 ? 1 : 2, &timeout, nullptr);
    if (ready > 0) {
      if (files[0].revents != 0) {
        eventfd_t count = 0;
        (void)eventfd_read(event_, &count);
        return Result::interrupted;
      }
      return Result::ready;
    }
    if (left <= slice && ready == 0) return Result::deadline;
  }
}

}  // namespace loopwarden::hal::modbus
