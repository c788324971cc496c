// SPDX-License-Identifier: Apache-2.0
#include "hal/iio/digital_io.hpp"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "hal/iio/retry.hpp"

namespace loopwarden::hal::iio {
namespace {

std::int64_t nanoseconds(double seconds) noexcept { return std::llround(seconds * 1e9); }

}  // namespace

DigitalIo::DigitalIo(const AnalogSettings& settings, const std::string& name, GpioChips& chips,
                     EventSink sink)
    : enable_settings_(settings.enable),
      relay_settings_(settings.alarm_relay),
      alive_settings_(settings.alive),
      chips_(chips),
      sink_(std::move(sink)) {
  contact_.name = name + " enable contact";
  relay_.name = name + " alarm relay";
  alive_.name = name + " alive line";
}

void DigitalIo::open(std::int64_t now_ns) { step(now_ns, false, true); }

void DigitalIo::close() noexcept {
  if (relay_.line) relay_.line->write(false);
  contact_.line.reset();
  relay_.line.reset();
  alive_.line.reset();
  known_ = false;
  energised_ = false;
}

void DigitalIo::step(std::int64_t now_ns, bool loop_alive, bool alarm) {
  if (enable_settings_) watch_contact(now_ns);
  if (relay_settings_) drive_relay(loop_alive && !alarm, now_ns);
  if (alive_settings_) show_life(now_ns, loop_alive);
}

Enable DigitalIo::enable() const noexcept {
  if (!enable_settings_) return Enable::not_fitted;
  return known_ && closed_ ? Enable::closed : Enable::open;
}

bool DigitalIo::request(Line& line, const LineSettings& settings, bool output,
                        std::int64_t now_ns) {
  if (line.line) return true;
  if (now_ns < line.retry_ns) return false;
  try {
    line.line = output ? chips_.request_output(settings, false) : chips_.request_input(settings);
  } catch (const std::runtime_error& error) {
    lost(line, error.what(), now_ns);
    return false;
  }
  if (std::exchange(line.trouble, false)) report(sink_, true, line.name + ": works");
  return true;
}

void DigitalIo::lost(Line& line, const std::string& why, std::int64_t now_ns) {
  line.line.reset();
  line.retry_ns = now_ns + kRetryNs;
  if (!std::exchange(line.trouble, true)) report(sink_, false, line.name + ": " + why);
}

void DigitalIo::set(Line& line, bool active, std::int64_t now_ns) {
  if (!line.line->write(active)) lost(line, "the chip refuses the output", now_ns);
}

void DigitalIo::watch_contact(std::int64_t now_ns) {
  if (!request(contact_, enable_settings_->line, false, now_ns)) return;
  const std::optional<bool> seen = contact_.line->read();
  if (!seen) {
    known_ = false;
    lost(contact_, "the chip refuses to read the input", now_ns);
    return;
  }
  if (!known_) {
    // The first reading is accepted as it is: a start with a closed contact does not count as an
    // opening.
    known_ = true;
    closed_ = last_seen_ = *seen;
    return;
  }
  if (*seen != last_seen_) changed_ns_ = now_ns;
  last_seen_ = *seen;
  if (now_ns - changed_ns_ >= nanoseconds(enable_settings_->debounce_s)) closed_ = last_seen_;
}

void DigitalIo::drive_relay(bool energised, std::int64_t now_ns) {
  if (!relay_.line) energised_ = false;
  if (!request(relay_, *relay_settings_, true, now_ns) || energised == energised_) return;
  energised_ = energised;
  set(relay_, energised, now_ns);
}

void DigitalIo::show_life(std::int64_t now_ns, bool loop_alive) {
  const std::int64_t half_period_ns = nanoseconds(alive_settings_->half_period_s);
  if (!alive_.line) {
    // Requesting the line may cause an edge. The request therefore waits until the loop is alive,
    // and the next edge waits a while.
    if (!loop_alive || !request(alive_, alive_settings_->line, true, now_ns)) return;
    high_ = false;
    next_edge_ns_ = now_ns + half_period_ns;
  }
  if (!loop_alive || now_ns < next_edge_ns_) return;
  high_ = !high_;
  next_edge_ns_ = now_ns + half_period_ns;
  set(alive_, high_, now_ns);
}

}  // namespace loopwarden::hal::iio
