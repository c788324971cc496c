// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "hal/contract/sample.hpp"
#include "hal/iio/analog_settings.hpp"
#include "hal/iio/event_sink.hpp"
#include "hal/iio/iio_channel.hpp"
#include "hal/iio/ne43.hpp"

namespace loopwarden::hal::iio {

struct ChannelCounters {
  std::uint64_t transactions = 0;
  std::uint64_t device_errors = 0;
  std::uint64_t garbage = 0;
  std::uint64_t reconnects = 0;
};

// A 4-20 mA input: converts the channel's current to a sample with quality. It looks for an absent
// device once a second, without limit. Used by one thread.
class AnalogInput {
 public:
  // `name` identifies the input in events.
  AnalogInput(std::filesystem::path root, const AnalogInputSettings& settings, std::string name,
              EventSink sink);

  // Reads the channel.
  void poll(std::int64_t now_ns);
  // Returns the newest sample. If no measurement arrives, it keeps its value, time and sequence.
  const Sample& sample() const noexcept { return sample_; }

  bool connected() const noexcept { return channel_.has_value() && !trouble_; }
  const ChannelCounters& counters() const noexcept { return counters_; }

 private:
  void connect();
  void judge(double current_ma, std::int64_t now_ns) noexcept;
  void lost(const ChannelError& error, std::int64_t now_ns);

  const std::filesystem::path root_;
  const AnalogInputSettings settings_;
  const std::string name_;
  const EventSink sink_;
  std::optional<IioChannel> channel_;
  Ne43 ne43_;
  Sample sample_;
  std::int64_t retry_ns_ = 0;
  bool connected_before_ = false;
  bool trouble_ = false;  // reported, and not yet absent for a second
  std::int64_t failed_ns_ = 0;
  ChannelCounters counters_;
};

}  // namespace loopwarden::hal::iio
