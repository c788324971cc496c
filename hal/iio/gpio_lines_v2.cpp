// SPDX-License-Identifier: Apache-2.0
// Implementation on libgpiod 2.
#include <fmt/format.h>
#include <gpiod.h>

#include <cerrno>
#include <charconv>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include "hal/iio/gpio_lines.hpp"

namespace loopwarden::hal::iio {
namespace {

namespace fs = std::filesystem;

constexpr const char* kConsumer = "loopwarden";

template <auto Free>
struct FreeWith {
  template <class T>
  void operator()(T* object) const noexcept {
    Free(object);
  }
};
using Chip = std::unique_ptr<gpiod_chip, FreeWith<gpiod_chip_close>>;
using ChipInfo = std::unique_ptr<gpiod_chip_info, FreeWith<gpiod_chip_info_free>>;
using LineSettingsHandle = std::unique_ptr<gpiod_line_settings, FreeWith<gpiod_line_settings_free>>;
using LineConfig = std::unique_ptr<gpiod_line_config, FreeWith<gpiod_line_config_free>>;
using RequestConfig = std::unique_ptr<gpiod_request_config, FreeWith<gpiod_request_config_free>>;
using Request = std::unique_ptr<gpiod_line_request, FreeWith<gpiod_line_request_release>>;

[[noreturn]] void fail(const LineSettings& line, const std::string& what, int error) {
  const std::string chip = line.chip.empty() ? "" : fmt::format(" of chip '{}'", line.chip);
  throw std::runtime_error(
      fmt::format("GPIO line '{}'{}: {}{}", line.line, chip, what,
                  error == 0 ? "" : ": " + std::generic_category().message(error)));
}

struct Found {
  Chip chip;
  unsigned offset = 0;
};

std::size_t lines_of(gpiod_chip* chip) {
  const ChipInfo info(gpiod_chip_get_info(chip));
  return info ? gpiod_chip_info_get_num_lines(info.get()) : 0;
}

bool is_called(gpiod_chip* chip, const std::string& wanted) {
  const ChipInfo info(gpiod_chip_get_info(chip));
  return info && (wanted == gpiod_chip_info_get_name(info.get()) ||
                  wanted == gpiod_chip_info_get_label(info.get()));
}

// Returns the number of the line with this name. On a named chip, the text may also be the number
// itself. Returns -1 if the chip has no such line.
int offset_of(gpiod_chip* chip, const LineSettings& line) {
  const int named = gpiod_chip_get_line_offset_from_name(chip, line.line.c_str());
  if (named >= 0 || line.chip.empty()) return named;
  int number = 0;
  const char* end = line.line.data() + line.line.size();
  const auto [stop, error] = std::from_chars(line.line.data(), end, number);
  const bool exists = error == std::errc{} && stop == end && number >= 0 &&
                      static_cast<std::size_t>(number) < lines_of(chip);
  return exists ? number : -1;
}

Found find(const LineSettings& line) {
  const bool by_path = line.chip.find('/') != std::string::npos;
  bool chip_seen = false;
  int refusal = 0;
  const auto look_at = [&](const fs::path& path) -> Found {
    Chip chip(gpiod_chip_open(path.c_str()));
    if (!chip) {
      refusal = errno;
      return {};
    }
    if (!by_path && !line.chip.empty() && !is_called(chip.get(), line.chip)) return {};
    chip_seen = true;
    const int offset = offset_of(chip.get(), line);
    if (offset < 0) return {};
    return {std::move(chip), static_cast<unsigned>(offset)};
  };

  if (by_path) {
    if (Found found = look_at(line.chip); found.chip) return found;
  } else {
    std::error_code error;
    for (fs::directory_iterator entry("/dev", error); !error && entry != fs::directory_iterator();
         entry.increment(error)) {
      if (!gpiod_is_gpiochip_device(entry->path().c_str())) continue;
      if (Found found = look_at(entry->path()); found.chip) return found;
    }
  }
  if (line.chip.empty()) fail(line, "no chip has a line of this name", 0);
  if (!chip_seen) fail(line, "the chip can't be opened", refusal == 0 ? ENOENT : refusal);
  fail(line, "the chip has no line of this name or number", 0);
}

class Line final : public GpioLine {
 public:
  Line(Request request, unsigned offset) noexcept : request_(std::move(request)), offset_(offset) {}

  std::optional<bool> read() noexcept override {
    const gpiod_line_value value = gpiod_line_request_get_value(request_.get(), offset_);
    if (value == GPIOD_LINE_VALUE_ERROR) return std::nullopt;
    return value == GPIOD_LINE_VALUE_ACTIVE;
  }
  bool write(bool active) noexcept override {
    return gpiod_line_request_set_value(
               request_.get(), offset_,
               active ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE) == 0;
  }

 private:
  Request request_;  // keeps the line requested after the chip is closed
  unsigned offset_;
};

std::unique_ptr<GpioLine> request(const LineSettings& line, gpiod_line_direction direction,
                                  bool active) {
  const Found found = find(line);
  const LineSettingsHandle settings(gpiod_line_settings_new());
  const LineConfig lines(gpiod_line_config_new());
  const RequestConfig config(gpiod_request_config_new());
  if (!settings || !lines || !config) fail(line, "can't be requested", ENOMEM);
  gpiod_line_settings_set_active_low(settings.get(), line.active_low);
  gpiod_request_config_set_consumer(config.get(), kConsumer);
  const bool prepared =
      gpiod_line_settings_set_direction(settings.get(), direction) == 0 &&
      gpiod_line_settings_set_output_value(
          settings.get(), active ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE) == 0 &&
      gpiod_line_config_add_line_settings(lines.get(), &found.offset, 1, settings.get()) == 0;
  if (!prepared) fail(line, "can't be requested", errno);
  Request request(gpiod_chip_request_lines(found.chip.get(), config.get(), lines.get()));
  if (!request) {
    fail(line,
         direction == GPIOD_LINE_DIRECTION_INPUT ? "can't be requested as input"
                                                 : "can't be requested as output",
         errno);
  }
  return std::make_unique<Line>(std::move(request), found.offset);
}

class Chips final : public GpioChips {
 public:
  std::unique_ptr<GpioLine> request_input(const LineSettings& line) override {
    return request(line, GPIOD_LINE_DIRECTION_INPUT, false);
  }
  std::unique_ptr<GpioLine> request_output(const LineSettings& line, bool active) override {
    return request(line, GPIOD_LINE_DIRECTION_OUTPUT, active);
  }
};

}  // namespace

std::unique_ptr<GpioChips> system_gpio_chips() { return std::make_unique<Chips>(); }

}  // namespace loopwarden::hal::iio
