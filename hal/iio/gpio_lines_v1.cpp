// SPDX-License-Identifier: Apache-2.0
// Implementation on libgpiod 1.
#include <fmt/format.h>
#include <gpiod.h>

#include <cerrno>
#include <charconv>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include "hal/iio/gpio_lines.hpp"

namespace loopwarden::hal::iio {
namespace {

constexpr const char* kConsumer = "loopwarden";

[[noreturn]] void fail(const LineSettings& line, const std::string& what, int error) {
  const std::string chip = line.chip.empty() ? "" : fmt::format(" of chip '{}'", line.chip);
  throw std::runtime_error(
      fmt::format("GPIO line '{}'{}: {}{}", line.line, chip, what,
                  error == 0 ? "" : ": " + std::generic_category().message(error)));
}

struct CloseChip {
  void operator()(gpiod_chip* chip) const noexcept { gpiod_chip_close(chip); }
};
using Chip = std::unique_ptr<gpiod_chip, CloseChip>;

struct Found {
  Chip chip;
  gpiod_line* line;  // the chip's
};

Found find(const LineSettings& line) {
  if (line.chip.empty()) {
    gpiod_line* found = gpiod_line_find(line.line.c_str());
    if (found == nullptr) {
      // libgpiod ends its search at the first chip that can't be opened.
      const int error = errno;
      if (error == ENOENT) fail(line, "no chip has a line of this name", 0);
      fail(line, "the chips can't be searched", error);
    }
    return {Chip(gpiod_line_get_chip(found)), found};
  }
  Chip chip(gpiod_chip_open_lookup(line.chip.c_str()));
  if (!chip) fail(line, "the chip can't be opened", errno);
  gpiod_line* found = gpiod_chip_find_line(chip.get(), line.line.c_str());
  if (found == nullptr) {
    unsigned number = 0;
    const char* end = line.line.data() + line.line.size();
    const auto [stop, error] = std::from_chars(line.line.data(), end, number);
    const bool exists =
        error == std::errc{} && stop == end && number < gpiod_chip_num_lines(chip.get());
    if (!exists) fail(line, "the chip has no line of this name or number", 0);
    found = gpiod_chip_get_line(chip.get(), number);
    if (found == nullptr) fail(line, "can't be opened", errno);
  }
  return {std::move(chip), found};
}

class Line final : public GpioLine {
 public:
  explicit Line(Found found) noexcept : found_(std::move(found)) {}
  ~Line() override { gpiod_line_release(found_.line); }

  std::optional<bool> read() noexcept override {
    const int value = gpiod_line_get_value(found_.line);
    return value < 0 ? std::nullopt : std::optional(value != 0);
  }
  bool write(bool active) noexcept override {
    return gpiod_line_set_value(found_.line, active ? 1 : 0) == 0;
  }

 private:
  Found found_;
};

int flags_of(const LineSettings& line) {
  return line.active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0;
}

class Chips final : public GpioChips {
 public:
  std::unique_ptr<GpioLine> request_input(const LineSettings& line) override {
    Found found = find(line);
    if (gpiod_line_request_input_flags(found.line, kConsumer, flags_of(line)) != 0) {
      fail(line, "can't be requested as input", errno);
    }
    return std::make_unique<Line>(std::move(found));
  }

  std::unique_ptr<GpioLine> request_output(const LineSettings& line, bool active) override {
    Found found = find(line);
    if (gpiod_line_request_output_flags(found.line, kConsumer, flags_of(line), active ? 1 : 0) !=
        0) {
      fail(line, "can't be requested as output", errno);
    }
    return std::make_unique<Line>(std::move(found));
  }
};

}  // namespace

std::unique_ptr<GpioChips> system_gpio_chips() { return std::make_unique<Chips>(); }

}  // namespace loopwarden::hal::iio
