// SPDX-License-Identifier: Apache-2.0
// Writes what links and analog channels report to the log, at most one line per subject, state and
// minute (base/line_limiter.hpp). Any thread.
#pragma once

#include <mutex>

#include "base/line_limiter.hpp"
#include "hal/iio/event_sink.hpp"
#include "hal/modbus/modbus_link.hpp"

namespace loopwarden::daemon {

class LinkLog {
 public:
  void take(const hal::modbus::LinkEvent& event);
  void take(const hal::iio::AnalogEvent& event);
  // Writes the lines that were withheld and may be written now. At least every few seconds.
  void look();

 private:
  void take(const std::string& subject, const std::string& state, base::LimitedLine line);

  std::mutex mutex_;
  base::LineLimiter limiter_;
};

}  // namespace loopwarden::daemon
