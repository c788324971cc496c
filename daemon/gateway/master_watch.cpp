// SPDX-License-Identifier: Apache-2.0
#include "daemon/gateway/master_watch.hpp"

namespace loopwarden::daemon::gateway {

MasterWatch::Event MasterWatch::step(std::int64_t now_ns, bool written,
                                     std::uint16_t value) noexcept {
  if (settings_.timeout_s <= 0.0) return Event::none;
  if (written && (!armed_ || value != last_value_)) {
    armed_ = true;
    last_value_ = value;
    last_change_ns_ = now_ns;
    if (!lost_) return Event::none;
    lost_ = false;
    return Event::back;
  }
  const double silent_s = static_cast<double>(now_ns - last_change_ns_) * 1e-9;
  if (!armed_ || lost_ || silent_s < settings_.timeout_s) return Event::none;
  lost_ = true;
  return Event::lost;
}

}  // namespace loopwarden::daemon::gateway
