// SPDX-License-Identifier: Apache-2.0
// Simulated loops with a known process, for the study of `loopwarden identify`.
//
// A PI loop (or CO stepped by an operator) on a process of random gain, lags and dead time, tuned
// by SIMC with a random factor. CO and PV range from 0 to 100 and are rounded to 12 bits.
// Disturbances are white measurement noise and a load. The load is a first-order Gauss-Markov
// signal. In half of the cases it is added to PV, in the others to CO's side, so that it passes
// through the process's lags.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "model/plant/process.hpp"

namespace loopwarden::lab {

enum class CaseKind : std::uint8_t {
  open_steps,        // CO stepped by an operator
  open_steps_load,   // the same under a load
  set_point,         // closed, SP moves, noise only
  set_point_load,    // closed, SP moves, load
  set_point_small,   // closed, small SP moves, load
  set_point_hidden,  // as set_point_load, without the column sp
  load_only,         // closed, SP constant, load
  load_only_hidden,  // the same, without the column sp
  still,             // closed, SP constant, noise only
  integrating,       // closed, SP moves, load; an integrating process
  backlash,          // as set_point_load, with play of 1 % in the valve
  stiction           // as set_point_load, with stiction of 1 % in the valve
};
inline constexpr std::array kCaseKinds{
    CaseKind::open_steps,     CaseKind::open_steps_load,  CaseKind::set_point,
    CaseKind::set_point_load, CaseKind::set_point_small,  CaseKind::set_point_hidden,
    CaseKind::load_only,      CaseKind::load_only_hidden, CaseKind::still,
    CaseKind::integrating,    CaseKind::backlash,         CaseKind::stiction};
const char* to_text(CaseKind kind) noexcept;

struct IdentificationCase {
  plant::ProcessParameters truth;
  double period_s = 1.0;
  std::vector<double> sp, pv, co;
};

IdentificationCase draw_case(CaseKind kind, std::uint64_t seed);

}  // namespace loopwarden::lab
