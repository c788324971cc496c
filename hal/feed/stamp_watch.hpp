// SPDX-License-Identifier: Apache-2.0
// Estimates how late the values of a source arrive, from the source's own time stamps.
//
//   delay    = arrival by this clock - stamp by the source's clock; both s since 1970
//   base     = least delay of the last 30 to 60 s: clock difference plus shortest transit
//   lateness = delay - base, s: wait in addition to that of the quickest values
//
// A value with the newest stamp again and the same content is a duplicate. A value with an older
// stamp is out of order. Both are left out. If stamps stay older, the source's clock was set back.
// After kStep_s without a newer stamp, the next value is accepted and the base starts again.
//
// Errors: a stamp that is not finite counts as missing.
// Limits: it can't distinguish a clock difference from a constant transit time. For the first
// minute after a change of either, it can't distinguish that change from late values.
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
  // Compares a stamp with the newest one. `now_s`: this clock, monotonic.
  Order order(double stamp_s, double now_s) const noexcept {
    if (!known_ || !std::isfinite(stamp_s) || stamp_s > newest_s_) return Order::newer;
    if (stamp_s == newest_s_) return Order::same;
    return now_s - taken_s_ > kStep_s ? Order::newer : Order::older;
  }

  // Takes the stamp of an accepted value and returns its lateness, s. `utc_s`: this clock, since
  // 1970.
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

  // Returns how much the source's clock is behind this one, s; nullopt: no stamps yet.
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
  double base_s_ = kNone;        // least delay of the present bucket
  double before_s_ = kNone;      // least delay of the previous one
};

}  // namespace loopwarden::hal::feed
