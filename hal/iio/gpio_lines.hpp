// SPDX-License-Identifier: Apache-2.0
// Single lines of GPIO chips, on libgpiod 1 or 2, whichever the system has. Tests supply their own
// implementation.
#pragma once

#include <memory>
#include <optional>

#include "hal/iio/analog_settings.hpp"

namespace loopwarden::hal::iio {

// A line requested for this process. Its destructor releases the line. The board determines the
// level afterwards; most boards keep the last one.
class GpioLine {
 public:
  GpioLine() = default;
  GpioLine(const GpioLine&) = delete;
  GpioLine& operator=(const GpioLine&) = delete;
  virtual ~GpioLine() = default;

  // Returns whether the line is active; nullopt if the chip refuses.
  virtual std::optional<bool> read() noexcept = 0;
  virtual bool write(bool active) noexcept = 0;
};

class GpioChips {
 public:
  GpioChips() = default;
  GpioChips(const GpioChips&) = delete;
  GpioChips& operator=(const GpioChips&) = delete;
  virtual ~GpioChips() = default;

  // Throw std::runtime_error if the line does not exist or is taken.
  virtual std::unique_ptr<GpioLine> request_input(const LineSettings& line) = 0;
  virtual std::unique_ptr<GpioLine> request_output(const LineSettings& line, bool active) = 0;
};

// The chips of this machine.
std::unique_ptr<GpioChips> system_gpio_chips();

}  // namespace loopwarden::hal::iio
