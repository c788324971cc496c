// SPDX-License-Identifier: Apache-2.0
// How far a source's own time stamps of one value can be used.
//
//   delay    = arrival by this clock - stamp by the source's; both s since 1970
//   base     = the least delay of the last 30 to 60 s: how far the clocks differ, and the shortest way
//   lateness = delay - base, s: so long the value has waited more than the quickest ones
//
// A value of the newest stamp that says the same again is doubled; one with an older stamp is out of order.
// Both are left out. Stamps that go back and stay there are a clock that was set back: after kStep_s without a
// value that fits, the next one counts and the base begins anew.
//
// Errors: a stamp that is no finite number counts as none.
// What it can't do: tell a clock that differs from a way that is always as long, nor the first minute after
// either has changed from values that come late.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

namespace loopwarden::hal::feed {

class StampWatch {
 public:
  static constexpr double kStep_s = 10.0;
  static constexpr double kBucket_s = 30.0;

  enum class Order : std::uint8_t { newer, same, older };
  // `now_s`: this clock, monotonic.
  Order order(double stamp_s, double now_s) const noexcept {
    if (!known_ || !std::isfinite(stamp_s) || stamp_s > newest_s_) return Order::newer;
    if (stamp_s == newest_s_) return Order::same;
    return now_s - taken_s_ > kStep_s ? Order::newer : Order::older;
  }

  // Of a value that counts: its lateness, s. `utc_s`: this clock, since 1970.
  double take(double stamp_s, double now_s, double utc_s) noexcept {
    if (!std::isfinite(stamp_s)) return 0.0;
    if (known_ && stamp_s < newest_s_) base_s_ = before_s_ = kNone;
    const double delay_s = utc_s - stamp_s;
    if (!known_ || now_s - bucket_since_s_ > kBucket_s) {
      before_s_ = known_ && now_s - bucket_since_s_ <= 2.0 * kBucket_s ? base_s_ : kNone;
      base_s_ = kNone;
      bucket_since_s_ = now_s;
    }
    base_s_ = std::fmin(base_s_, delay_s);
    known_ = true;
    newest_s_ = stamp_s;
    taken_s_ = now_s;
    return delay_s - base();
  }

  // By how much the source's clock is behind this one, s; nullopt: no stamps yet.
  std::optional<double> clock_behind_s() const noexcept {
    return known_ ? std::optional(base()) : std::nullopt;
  }

 private:
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  double base() const noexcept { return std::fmin(base_s_, before_s_); }

  bool known_ = false;
  double newest_s_ = 0.0;        // stamp
  double taken_s_ = 0.0;         // monotonic
  double bucket_since_s_ = 0.0;  // monotonic
  double base_s_ = kNone;        // least delay of this bucket
  double before_s_ = kNone;      // and of the one before
};

}  // namespace loopwarden::hal::feed
