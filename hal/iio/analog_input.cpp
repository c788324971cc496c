// SPDX-License-Identifier: Apache-2.0
#include "hal/iio/analog_input.hpp"

#include <utility>

#include "hal/iio/retry.hpp"

namespace loopwarden::hal::iio {

AnalogInput::AnalogInput(std::filesystem::path root, const AnalogInputSettings& settings,
                         std::string name, EventSink sink)
    : root_(std::move(root)),
      settings_(settings),
      name_(std::move(name)),
      sink_(std::move(sink)),
      ne43_(settings.ne43) {}

void AnalogInput::poll(std::int64_t now_ns) {
  if (!channel_ && now_ns < retry_ns_) return;
  try {
    if (!channel_) connect();
    ++counters_.transactions;
    const double raw = channel_->read_raw();
    // An intermittent fault is reported once, not with a log line for each failure.
    if (trouble_ && now_ns - failed_ns_ >= kRetryNs) {
      trouble_ = false;
      report(sink_, true, name_ + ": reads again");
    }
    judge(channel_->physical(raw) / settings_.channel.units_per_ma, now_ns);
  } catch (const ChannelError& error) {
    lost(error, now_ns);
  }
}

void AnalogInput::connect() {
  channel_.emplace(root_, settings_.channel, Direction::in);
  if (std::exchange(connected_before_, true)) ++counters_.reconnects;
}

void AnalogInput::judge(double current_ma, std::int64_t now_ns) noexcept {
  const Ne43::Reading reading = ne43_.step(current_ma, now_ns);
  sample_.quality = reading.quality;
  sample_.reason = reading.reason;
  sample_.limit = reading.limit;
  const bool reversed = settings_.high < settings_.low;
  if (reversed && reading.limit == Limit::low) sample_.limit = Limit::high;
  if (reversed && reading.limit == Limit::high) sample_.limit = Limit::low;
  if (!reading.fresh) return;
  sample_.value = settings_.low + (current_ma - 4.0) / 16.0 * (settings_.high - settings_.low);
  sample_.time_ns = now_ns;
  ++sample_.sequence;
}

void AnalogInput::lost(const ChannelError& error, std::int64_t now_ns) {
  ne43_.interrupted();
  failed_ns_ = now_ns;
  const bool absent = error.kind() == ChannelError::Kind::absent;
  if (error.kind() == ChannelError::Kind::refused) ++counters_.device_errors;
  if (error.kind() == ChannelError::Kind::garbage) ++counters_.garbage;
  sample_.quality = Quality::bad;
  sample_.reason = !absent             ? Reason::device_error
                   : connected_before_ ? Reason::link_lost
                                       : Reason::never_received;
  sample_.limit = Limit::none;
  if (absent) channel_.reset();
  if (!channel_) retry_ns_ = now_ns + kRetryNs;
  if (!std::exchange(trouble_, true)) report(sink_, false, name_ + ": " + error.what());
}

}  // namespace loopwarden::hal::iio
