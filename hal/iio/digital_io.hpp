// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "hal/contract/loop_io.hpp"
#include "hal/iio/analog_settings.hpp"
#include "hal/iio/event_sink.hpp"
#include "hal/iio/gpio_lines.hpp"

namespace loopwarden::hal::iio {

// The digital lines of a loop: contact that permits control, alarm relay, square wave that shows
// that the loop is alive. It requests a missing line once a second, without limit. Used by one
// thread.
class DigitalIo {
 public:
  // `chips` must outlive this object. `name` identifies the loop in events.
  DigitalIo(const AnalogSettings& settings, const std::string& name, GpioChips& chips,
            EventSink sink);

  // Requests the lines and takes over the contact's state. The relay is de-energised.
  void open(std::int64_t now_ns);
  // De-energises the relay and releases the lines.
  void close() noexcept;

  // Runs one turn. `loop_alive`: the loop's commands are fresh. `alarm`: alarm state of the newest
  // command.
  void step(std::int64_t now_ns, bool loop_alive, bool alarm);

  // Returns open also while the line can't be read, because permission can't be confirmed then.
  Enable enable() const noexcept;

 private:
  struct Line {
    std::string name;
    std::unique_ptr<GpioLine> line;
    std::int64_t retry_ns = 0;
    bool trouble = false;  // reported, and still present
  };

  bool request(Line& line, const LineSettings& settings, bool output, std::int64_t now_ns);
  void lost(Line& line, const std::string& why, std::int64_t now_ns);
  void set(Line& line, bool active, std::int64_t now_ns);
  void watch_contact(std::int64_t now_ns);
  void drive_relay(bool energised, std::int64_t now_ns);
  void show_life(std::int64_t now_ns, bool loop_alive);

  const std::optional<EnableSettings> enable_settings_;
  const std::optional<LineSettings> relay_settings_;
  const std::optional<AliveSettings> alive_settings_;
  GpioChips& chips_;
  const EventSink sink_;

  Line contact_;
  bool closed_ = false;          // debounced
  bool last_seen_ = false;       // not debounced
  bool known_ = false;           // the line was read since it was requested
  std::int64_t changed_ns_ = 0;  // when last_seen_ changed

  Line relay_;
  bool energised_ = false;

  Line alive_;
  bool high_ = false;
  std::int64_t next_edge_ns_ = 0;
};

}  // namespace loopwarden::hal::iio
