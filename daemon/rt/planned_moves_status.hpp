// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mutex>
#include <optional>

#include "model/control/planned_moves_settings.hpp"

namespace loopwarden::daemon::rt {

// State of planned moves, for any threads except the real-time one.
class PlannedMovesStatus {
 public:
  void publish(const control::MovesState& state) noexcept {
    const std::lock_guard lock(mutex_);
    state_ = state;
  }
  void clear() noexcept {
    const std::lock_guard lock(mutex_);
    state_.reset();
  }
  // Returns no state if no planned moves run.
  std::optional<control::MovesState> read() const noexcept {
    const std::lock_guard lock(mutex_);
    return state_;
  }

 private:
  mutable std::mutex mutex_;
  std::optional<control::MovesState> state_;
};

}  // namespace loopwarden::daemon::rt
