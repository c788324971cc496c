// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>

#include "model/control/planned_moves_settings.hpp"

namespace loopwarden::daemon::rt {

// Publishes the state of planned moves to any number of readers. Single numbers may be one cycle
// older than the state.
class PlannedMovesStatus {
 public:
  void publish(const control::MovesState& state) noexcept {
    expected_offset_.store(state.expected_offset, std::memory_order_relaxed);
    action_threshold_.store(state.action_threshold, std::memory_order_relaxed);
    output_.store(state.output, std::memory_order_relaxed);
    gain_.store(state.gain, std::memory_order_relaxed);
    // Values that decide something are one word: they always belong together.
    state_.store({.run = true,
                  .shadow = state.shadow,
                  .latched = state.latched,
                  .waits = state.waits,
                  .cycles_watched = state.cycles_watched,
                  .phase = state.phase,
                  .reason = state.reason},
                 std::memory_order_release);
  }
  void clear() noexcept { state_.store({}, std::memory_order_relaxed); }
  // Returns no state if no planned moves run.
  std::optional<control::MovesState> read() const noexcept {
    const Word word = state_.load(std::memory_order_acquire);
    if (!word.run) return std::nullopt;
    control::MovesState state;
    state.shadow = word.shadow;
    state.latched = word.latched;
    state.waits = word.waits;
    state.cycles_watched = word.cycles_watched;
    state.phase = word.phase;
    state.reason = word.reason;
    state.expected_offset = expected_offset_.load(std::memory_order_relaxed);
    state.action_threshold = action_threshold_.load(std::memory_order_relaxed);
    state.output = output_.load(std::memory_order_relaxed);
    state.gain = gain_.load(std::memory_order_relaxed);
    return state;
  }

 private:
  struct alignas(8) Word {
    bool run = false;
    bool shadow = false;
    bool latched = false;
    bool waits = false;
    std::uint8_t cycles_watched = 0;
    control::MovePhase phase = control::MovePhase::watching;
    control::DisengageReason reason = control::DisengageReason::none;
    std::uint8_t unused = 0;  // an atomic compares every bit
  };
  static_assert(std::atomic<Word>::is_always_lock_free);
  std::atomic<Word> state_{Word{}};
  std::atomic<double> expected_offset_{0.0};
  std::atomic<double> action_threshold_{0.0};
  std::atomic<double> output_{0.0};
  std::atomic<double> gain_{0.0};
};

}  // namespace loopwarden::daemon::rt
