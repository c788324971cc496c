// SPDX-License-Identifier: Apache-2.0
// Settings and reported state of planned moves (planned_moves.hpp).
#pragma once

#include <cstdint>
#include <limits>

#include "model/numeric/enum_name.hpp"

namespace loopwarden::control {

struct PlannedMovesSettings {
  double gain = 0.0;                                          // PV units / CO unit, not 0
  double time_constant_s = 0.0;                               // s, >= 0
  double dead_time_s = 0.0;                                   // s, >= 0
  double actuator_lag_s = 0.0;                                // s, >= 0
  double load = 0.0;                                          // PV units / sqrt(s), >= 0
  double s = 0.0;                                             // CO units, > 0
  double j = 0.0;                                             // CO units, 0 < j <= s
  double s_low = 0.0;                                         // CO units, interval of s; 0: s
  double s_high = 0.0;                                        // CO units; 0: s
  double j_low = 0.0;                                         // CO units, interval of j; 0: j
  double j_high = 0.0;                                        // CO units; 0: j
  double max_move = std::numeric_limits<double>::infinity();  // CO units
  double max_moves_per_hour = std::numeric_limits<double>::infinity();  // 1/h
  bool read_back = true;

  friend bool operator==(const PlannedMovesSettings&, const PlannedMovesSettings&) = default;
};

// Returns whether the interval of s is narrow enough for planned moves to act on hardware.
constexpr bool within_factor_two(double s_low, double s_high) noexcept {
  return s_low > 0.0 && s_high <= 2.0 * s_low;
}

enum class MovePhase : std::uint8_t { watching, probing, resting, backing_off, moving, disengaged };
enum class DisengageReason : std::uint8_t {
  none,
  valve_follows,
  read_back_lost,
  contradiction,
  stem_stuck,
  no_gain,
  error_too_large,
  moved_late,
  interrupted
};

constexpr const char* to_text(MovePhase phase) noexcept {
  return numeric::enum_name<MovePhase::disengaged>(
      phase, {"watching", "probing", "resting", "backing off", "moving", "given back"});
}
constexpr const char* to_text(DisengageReason reason) noexcept {
  return numeric::enum_name<DisengageReason::interrupted>(
      reason, {"no", "the stem follows a probe", "the read-back is lost",
               "PV and read-back contradict each other", "the stem does not move",
               "RMS of SP - PV does not fall", "SP - PV is too large",
               "the stem is read to move after its move was given up",
               "the controller ended the hold: PV jumped, or the monitor was late"});
}

// State of planned moves, with the reason for the last disengagement.
struct MovesState {
  MovePhase phase = MovePhase::watching;
  DisengageReason reason = DisengageReason::none;
  double expected_offset = 0.0;     // PV units, SP minus the PV that the present stem leads to
  double action_threshold = 0.0;    // PV units, size of the expected offset from which a move pays
  double output = 0.0;              // CO units, held while planned moves act
  double gain = 0.0;                // RMS of SP - PV over that without; 0: not known yet
  double s = 0.0;                   // CO units, estimate
  double j = 0.0;                   // CO units, estimate
  std::uint32_t moves = 0;          // since the last engagement
  std::uint8_t cycles_watched = 0;  // while watching: of kLeastCyclesWatched to kMostCyclesWatched
  bool waits = false;               // watching has ended; engages when PV is to settle near SP
  bool latched = false;             // disengaged until the next reset
  bool shadow = false;
};

}  // namespace loopwarden::control
