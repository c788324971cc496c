// SPDX-License-Identifier: Apache-2.0
// The quality of a measured value. Records and the register map store the numbers of the
// enumerators: they never change.
#pragma once

#include <cstdint>

namespace loopwarden::base {

// Major quality, with the numbers of the OPC quality byte (192 = good).
enum class Quality : std::uint8_t { bad = 0x00, uncertain = 0x40, good = 0xC0 };

// The reason for a quality that is not good, and `held`.
enum class Reason : std::uint8_t {
  none,
  never_received,  // no value since start-up
  stale,           // older than the configured age
  not_finite,      // NaN or infinity
  out_of_range,    // outside the transmitter's range and its margin
  sensor_failure,  // NAMUR NE 43 failure current, or reported by the device
  device_error,    // the device answered with an error
  link_lost,       // no connection to the device
  frozen,          // no change although the output moves
  end_of_record,   // a replayed record has ended
  held,            // good: unchanged, and its source, which sends on change only, is alive
  source,          // bad or uncertain according to its source
  source_silent,   // no message of its source within the timeout
  source_dead,     // the death of its source was reported
  out_of_service   // the loop does not run: its files have errors
};

// The value is at a limit of the device's range. The true value may be beyond it. The quality is
// still good.
enum class Limit : std::uint8_t { none, low, high };

constexpr const char* to_text(Quality quality) noexcept {
  switch (quality) {
    case Quality::good: return "good";
    case Quality::uncertain: return "uncertain";
    case Quality::bad: break;
  }
  return "bad";
}

constexpr const char* to_text(Reason reason) noexcept {
  switch (reason) {
    case Reason::none: return "none";
    case Reason::never_received: return "never received";
    case Reason::stale: return "stale";
    case Reason::not_finite: return "not finite";
    case Reason::out_of_range: return "out of range";
    case Reason::sensor_failure: return "sensor failure";
    case Reason::device_error: return "device error";
    case Reason::link_lost: return "link lost";
    case Reason::frozen: return "frozen";
    case Reason::end_of_record: return "end of record";
    case Reason::held: return "held";
    case Reason::source: return "said by the source";
    case Reason::source_silent: return "timeout of the source";
    case Reason::source_dead: return "death of the source";
    case Reason::out_of_service: return "out of service";
  }
  return "?";
}

constexpr const char* to_text(Limit limit) noexcept {
  switch (limit) {
    case Limit::low: return "low";
    case Limit::high: return "high";
    case Limit::none: break;
  }
  return "none";
}

}  // namespace loopwarden::base
