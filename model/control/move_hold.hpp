// SPDX-License-Identifier: Apache-2.0
// Holds CO of a loop for planned moves. This is their only part on the real-time path.
//
// MovesAdvisor (moves_advisor.hpp) steps planned moves on another thread. It gets a sample of each
// period and answers with a request to the following periods.
//
// A hold begins at the present CO: its begin moves no valve. It ends when
//   - the request is released, not finite, or older than its `valid_until`
//   - the law was restarted or its settings changed after the request: another mode, a fault, an
//     output of the operator, a reload, from shadow to acting
//   - PV leaves the band of the request
// At its end the integral takes over the correction: CO stays. If the set point changed after the
// sample of the request, CO makes the law's step for it. No call allocates or throws.
#pragma once

#include <cstdint>
#include <limits>

#include "model/control/compensator_contract.hpp"
#include "model/control/planned_moves_settings.hpp"

namespace loopwarden::control {

// One period of a loop, for planned moves.
struct MovesSample {
  std::uint64_t number = 0;  // of the period, counted from 1
  std::uint32_t run = 0;     // of the law, counted from 1
  bool shadow = false;
  bool holding = false;  // in shadow: would hold
  double held = 0.0;     // CO units
  PlannedMovesSettings settings{};
  CompensatorInputs in{};
};

enum class HoldAction : std::uint8_t {
  release,
  hold_here,  // begins at the present CO; keeps a hold that has begun
  hold_at     // moves a hold that has begun
};

struct MovesRequest {
  std::uint32_t run = 0;          // of the sample that the request answers
  bool shadow = false;            // of that sample
  std::uint64_t number = 0;       // of that sample
  std::uint64_t valid_until = 0;  // number of the last period in which it counts
  HoldAction action = HoldAction::release;
  double output = 0.0;                                       // CO units, of hold_at
  double pv_low = -std::numeric_limits<double>::infinity();  // PV units, band
  double pv_high = std::numeric_limits<double>::infinity();
  DisengageReason disengaged = DisengageReason::none;
};

class MoveHold {
 public:
  // The law is restarted: requests of before do not count.
  void restart() noexcept {
    ++sample_.run;
    sample_.holding = false;
    disengaged_ = DisengageReason::none;
  }
  // Steps one period. Returns what is to be added to the controller's output.
  Correction step(const CompensatorInputs& in, const MovesRequest& request,
                  const CompensatorSettings& settings) noexcept;

  const MovesSample& sample() const noexcept { return sample_; }  // of the newest period
  // Why planned moves are disengaged by the newest valid request.
  DisengageReason disengaged() const noexcept { return disengaged_; }

 private:
  bool is_valid(const MovesRequest& request) const noexcept;

  MovesSample sample_;
  double step_ = 0.0;             // CO units, of the law at a new set point, until it is answered
  std::uint64_t stepped_at_ = 0;  // number of that period
  DisengageReason disengaged_ = DisengageReason::none;
};

}  // namespace loopwarden::control
