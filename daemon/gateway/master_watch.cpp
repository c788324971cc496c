// SPDX-License-Identifier: Apache-2.0
#include "daemon/gateway/master_watch.hpp"

#include <algorithm>
#include <utility>

namespace loopwarden::daemon::gateway {

MasterWatch::Event MasterWatch::step(std::int64_t read_ns, bool written,
                                     std::uint16_t value) noexcept {
  if (settings_.timeout_s <= 0.0) return Event::none;
  const std::int64_t round_ns = read_ns - last_read_ns_;
  last_read_ns_ = read_ns;
  const bool was_late = std::exchange(late_, round_ns > kLongestRound);
  if (written && (!armed_ || value != last_value_)) {
    armed_ = true;
    last_value_ = value;
    silent_ns_ = 0;
    return std::exchange(lost_, false) ? Event::back : Event::none;
  }
  silent_ns_ += std::min(round_ns, kLongestRound);
  const bool silent = static_cast<double>(silent_ns_) * 1e-9 >= settings_.timeout_s;
  if (!armed_ || lost_ || !silent || (late_ && !was_late)) return Event::none;
  lost_ = true;
  return Event::lost;
}

}  // namespace loopwarden::daemon::gateway
