// SPDX-License-Identifier: Apache-2.0
#include "hal/iio/ne43.hpp"

namespace loopwarden::hal::iio {
namespace {
constexpr double kFullScale = 20.0;  // mA
}  // namespace

Ne43::Reading Ne43::step(double current_ma, std::int64_t time_ns) noexcept {
  const Ne43Limits& limits = settings_.limits;
  const bool measurement = current_ma >= limits.measure_low && current_ma <= limits.measure_high;
  const bool failure = !(current_ma >= limits.failure_low && current_ma <= limits.failure_high);

  Limit limit = Limit::none;
  if (current_ma < kLiveZero) limit = Limit::low;
  if (current_ma > kFullScale) limit = Limit::high;

  if (!measurement) recovering_ = false;
  if (!failure) failures_ = 0;
  if (failure && !bad_) {
    ++failures_;
    // Without an earlier sample to hold, the failure counts at once.
    bad_ = failures_ >= settings_.entry_samples || !measured_;
  }
  if (bad_ && measurement) {
    if (!recovering_) recovering_since_ns_ = time_ns;
    recovering_ = true;
    bad_ = static_cast<double>(time_ns - recovering_since_ns_) * 1e-9 < settings_.recovery_s;
  }

  if (bad_) return {Quality::bad, Reason::sensor_failure, limit, false};
  if (failure) return {Quality::uncertain, Reason::sensor_failure, limit, false};
  if (!measurement) {
    return {measured_ ? Quality::uncertain : Quality::bad, Reason::out_of_range, limit, false};
  }
  measured_ = true;
  recovering_ = false;
  return {Quality::good, Reason::none, limit, true};
}

}  // namespace loopwarden::hal::iio
