// SPDX-License-Identifier: Apache-2.0
// Simulated loops whose process is known, for the study of `loopwarden identify`.
//
// A PI loop (or a CO stepped by hand) on a process of random gain, lags and dead time, tuned by SIMC with a random
// factor. CO and PV run from 0 to 100 and are rounded to 12 bits. What disturbs: measurement noise (white) and a
// load, a first-order Gauss-Markov signal, half of the time added to PV and half of the time to CO's side, where it
// comes through the process's lags.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "model/plant/process.hpp"

namespace loopwarden::studies {

enum class CaseKind : std::uint8_t {
  open_steps,        // CO stepped by hand
  open_steps_load,   // the same under a load
  set_point,         // closed, SP moves, noise only
  set_point_load,    // closed, SP moves, load
  set_point_small,   // closed, SP moves little, load
  set_point_hidden,  // as set_point_load, without the column sp
  load_only,         // closed, SP stands still, load
  load_only_hidden,  // the same, without the column sp
  still,             // closed, SP stands still, noise only
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

}  // namespace loopwarden::studies
