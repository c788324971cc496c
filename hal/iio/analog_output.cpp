// SPDX-License-Identifier: Apache-2.0
#include "hal/iio/analog_output.hpp"

#include <fmt/format.h>

#include <utility>

#include "hal/iio/retry.hpp"

namespace loopwarden::hal::iio {

AnalogOutput::AnalogOutput(std::filesystem::path root, const AnalogOutputSettings& settings,
                           std::string name, EventSink sink)
    : root_(std::move(root)), settings_(settings), name_(std::move(name)), sink_(std::move(sink)) {}

void AnalogOutput::connect(std::int64_t now_ns) {
  if (channel_ || now_ns < retry_ns_) return;
  try {
    IioChannel channel(root_, settings_.channel, Direction::out);
    const OutputStage stage(settings_, channel.scale(), channel.offset());
    if (!stage.usable()) {
      throw ChannelError(
          ChannelError::Kind::garbage,
          fmt::format("no raw number from {} to {} gives {} to {} mA with the scale {} "
                      "and the offset {}",
                      settings_.lowest_raw, settings_.highest_raw, settings_.lowest_ma,
                      settings_.highest_ma, channel.scale(), channel.offset()));
    }
    stage_ = stage;
    channel_.emplace(std::move(channel));
    if (std::exchange(connected_before_, true)) ++counters_.reconnects;
  } catch (const ChannelError& error) {
    failed(error, now_ns);
  }
}

bool AnalogOutput::put(double output, std::int64_t now_ns) {
  return reached(now_ns) && put_raw(stage_->raw_for(output), now_ns);
}

bool AnalogOutput::put_safe(std::int64_t now_ns) {
  if (!settings_.safe_ma) return true;
  return reached(now_ns) && put_raw(stage_->raw_for_ma(*settings_.safe_ma), now_ns);
}

bool AnalogOutput::reached(std::int64_t now_ns) {
  connect(now_ns);
  if (!channel_) reason_ = Reason::link_lost;
  return channel_.has_value();
}

bool AnalogOutput::put_raw(std::int64_t raw, std::int64_t now_ns) {
  try {
    ++counters_.transactions;
    channel_->write_raw(raw);
    if (channel_->readable()) {
      const double held = channel_->read_raw();
      if (held != static_cast<double>(raw)) {
        throw ChannelError(ChannelError::Kind::refused,
                           fmt::format("{} was written, {} is read back", raw, held));
      }
    }
    ++writes_;
    reason_ = Reason::none;
    if (trouble_ && now_ns - failed_ns_ >= kRetryNs) {
      trouble_ = false;
      report(sink_, true, name_ + ": takes commands again");
    }
    return true;
  } catch (const ChannelError& error) {
    ++write_errors_;
    reason_ = error.kind() == ChannelError::Kind::absent ? Reason::link_lost : Reason::device_error;
    failed(error, now_ns);
    return false;
  }
}

void AnalogOutput::failed(const ChannelError& error, std::int64_t now_ns) {
  failed_ns_ = now_ns;
  const bool absent = error.kind() == ChannelError::Kind::absent;
  if (error.kind() == ChannelError::Kind::refused) ++counters_.device_errors;
  if (error.kind() == ChannelError::Kind::garbage) ++counters_.garbage;
  if (absent) channel_.reset();
  if (!channel_) retry_ns_ = now_ns + kRetryNs;
  if (!std::exchange(trouble_, true)) report(sink_, false, name_ + ": " + error.what());
}

}  // namespace loopwarden::hal::iio
