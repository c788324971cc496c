// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <utility>

namespace loopwarden::hal::iio {

// A change worth a line in the log. Repetitions of the same state are not reported.
struct AnalogEvent {
  bool good = false;  // something works (again)
  std::string text;
};

// Called on the I/O thread. Must not throw, nor block for long.
using EventSink = std::function<void(const AnalogEvent&)>;

inline void report(const EventSink& sink, bool good, std::string text) {
  if (sink) sink({good, std::move(text)});
}

}  // namespace loopwarden::hal::iio
