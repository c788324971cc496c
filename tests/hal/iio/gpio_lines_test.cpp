// SPDX-License-Identifier: Apache-2.0
#include "hal/iio/gpio_lines.hpp"

#include <catch2/catch.hpp>
#include <string>

namespace gpio_lines_test {

using namespace loopwarden::hal::iio;

// Simulated chips need the kernel's gpio-sim. This test needs none: a line that does not exist is
// an error with a clear message, with either libgpiod.
TEST_CASE("a line that does not exist is an error that names it") {
  const auto chips = system_gpio_chips();
  const auto message = [&](const char* chip, const char* line, bool output) -> std::string {
    try {
      const LineSettings settings{.chip = chip, .line = line};
      if (output) {
        chips->request_output(settings, true);
      } else {
        chips->request_input(settings);
      }
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "no failure";
  };
  for (const bool output : {false, true}) {
    CHECK(message("", "loopwarden-test-none", output) ==
          "GPIO line 'loopwarden-test-none': no chip has a line of this name");
    CHECK_THAT(message("/dev/gpiochip99999", "7", output),
               Catch::StartsWith(
                   "GPIO line '7' of chip '/dev/gpiochip99999': the chip can't be opened: "));
    CHECK_THAT(message("no-such-chip", "7", output),
               Catch::StartsWith("GPIO line '7' of chip 'no-such-chip': the chip can't be opened"));
    CHECK_THAT(message("/dev/null", "7", output), Catch::Contains("the chip can't be opened"));
  }
}

}  // namespace gpio_lines_test
