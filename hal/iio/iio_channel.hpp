// SPDX-License-Identifier: Apache-2.0
// A channel of a Linux IIO device through its files in sysfs: value = (raw + offset) * scale.
#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "hal/iio/analog_settings.hpp"

namespace loopwarden::hal::iio {

// The error if a channel can't be read or written.
class ChannelError : public std::runtime_error {
 public:
  enum class Kind : std::uint8_t {
    absent,   // no such device or channel, or not present now
    refused,  // the device answered with an error
    garbage   // the device delivered a text that is not a number
  };
  ChannelError(Kind kind, const std::string& what) : std::runtime_error(what), kind_(kind) {}
  Kind kind() const noexcept { return kind_; }

 private:
  Kind kind_;
};

// Returns the folder of the device whose `name` or `label` file contains `device`. Throws
// ChannelError, also if two devices match.
std::filesystem::path find_device(const std::filesystem::path& root, const std::string& device);

enum class Direction : std::uint8_t { in, out };

class IioChannel {
 public:
  // Opens the channel's files. Throws ChannelError.
  IioChannel(const std::filesystem::path& root, const ChannelSettings& settings,
             Direction direction);
  IioChannel(IioChannel&& other) noexcept;
  IioChannel& operator=(IioChannel&& other) noexcept;
  ~IioChannel();

  // Throw ChannelError.
  double read_raw() const;
  void write_raw(std::int64_t raw) const;

  bool readable() const noexcept { return readable_; }
  double scale() const noexcept { return scale_; }    // physical units per raw unit, not 0
  double offset() const noexcept { return offset_; }  // raw units
  double physical(double raw) const noexcept { return (raw + offset_) * scale_; }

 private:
  std::filesystem::path value_file_;
  int fd_ = -1;
  bool readable_ = true;
  double scale_ = 1.0;
  double offset_ = 0.0;
};

}  // namespace loopwarden::hal::iio
