// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "hal/contract/sample.hpp"
#include "hal/iio/analog_input.hpp"
#include "hal/iio/analog_settings.hpp"
#include "hal/iio/event_sink.hpp"
#include "hal/iio/iio_channel.hpp"
#include "hal/iio/output_stage.hpp"

namespace loopwarden::hal::iio {

// A 4-20 mA output: converts CO units to the converter's raw value, and reads it back if the
// converter supports that. It looks for an absent device once a second, without limit. Used by one
// thread.
class AnalogOutput {
 public:
  AnalogOutput(std::filesystem::path root, const AnalogOutputSettings& settings, std::string name,
               EventSink sink);

  // Opens the channel if it is closed and the next attempt is due.
  void connect(std::int64_t now_ns);
  // Writes the value. Returns true if the converter has accepted it.
  bool put(double output, std::int64_t now_ns);
  // Writes the configured safe current. Also returns true if the settings have no safe current.
  bool put_safe(std::int64_t now_ns);

  // Returns the conversion of commands; nullopt until the device was first found.
  const std::optional<OutputStage>& stage() const noexcept { return stage_; }
  bool connected() const noexcept { return channel_.has_value() && !trouble_; }
  // Returns false, with reason never_received, before the first command.
  bool ok() const noexcept { return reason_ == Reason::none; }
  Reason reason() const noexcept { return reason_; }
  const ChannelCounters& counters() const noexcept { return counters_; }
  std::uint64_t writes() const noexcept { return writes_; }
  std::uint64_t write_errors() const noexcept { return write_errors_; }

 private:
  bool reached(std::int64_t now_ns);
  bool put_raw(std::int64_t raw, std::int64_t now_ns);
  void failed(const ChannelError& error, std::int64_t now_ns);

  const std::filesystem::path root_;
  const AnalogOutputSettings settings_;
  const std::string name_;
  const EventSink sink_;
  std::optional<IioChannel> channel_;
  std::optional<OutputStage> stage_;
  Reason reason_ = Reason::never_received;
  std::int64_t retry_ns_ = 0;
  bool connected_before_ = false;
  bool trouble_ = false;  // reported, and not yet absent for a second
  std::int64_t failed_ns_ = 0;
  ChannelCounters counters_;
  std::uint64_t writes_ = 0;
  std::uint64_t write_errors_ = 0;
};

}  // namespace loopwarden::hal::iio
