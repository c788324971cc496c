// SPDX-License-Identifier: Apache-2.0
// Was CO moved by a controller, and what moved it from outside?
//
//   u(k) = a1 u(k-1) + a2 u(k-2) + a3 u(k-3) + b0 y(k) + b1 y(k-1) + b2 y(k-2) + c0 sp(k) + ... + c2 sp(k-2) + m + n(k)
//
// by least squares over the samples in automatic. Closed: the record's mode says so, or the terms in y explain
// a good part (0.3) of what u's own past and SP leave. In open loop they explain next to nothing: y(k) follows
// from u, not u from y. Rows in which CO only rests explain nothing, however exact the log is. If
// PV moves before CO's steps the way it goes on after them, CO is logged too late, and no
// controller acts against PV.
//
// A controller with rests has no such law. switching_law() recognises three by when CO moves:
//   two levels  CO switches at the first row at which PV has passed a level, and not by the clock
//   pulses      CO is switched on at equal times; PV sets the share of the cycle that it is on
//   gap action  CO moves up only where PV is low and down only where it is high (or SP - PV)
//
// What comes from outside, in closed loop, is what SP brings in through c (and CO moved by hand); without a column
// sp, the jumps in n: beyond eight of its robust standard deviations. outside_output() runs the loop of this
// law and a process under nothing else: the part of CO that tells something of the process whatever the load is.
//
// Rows are those in which the controller acts: of a record that is faster, every n-th (identification.cpp).
//
// Errors: no exceptions. Limits: other controllers that are far from linear; slow hands on a
// manual valve that follow PV; a switching controller whose record repeats exactly is taken for a
// clock, as nothing moved it from outside.
//
// Source: Söderström, Gustavsson and Ljung, Int. J. Control 21 (1975) (identifiability in closed loop); Van den Hof and
// Schrama, Automatica 29 (1993) (two stages: CO as the set point alone would have it).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "model/plant/process.hpp"

namespace loopwarden::analysis {

// Columns of one length, without gaps; `sp` and `automatic` may be empty.
struct LoopColumns {
  std::span<const double> co, pv, sp;
  std::span<const double> automatic;  // 1 where a controller moved CO, 0 by hand
};

struct Feedback {
  bool closed = false;
  bool by_mode = false;    // the record's mode says that it is closed
  double explained = 0.0;  // by PV, of what CO's own past and SP leave, 0 to 1
  bool set_point_moves = false;
  std::array<double, 3> own{};    // a
  std::array<double, 3> of_pv{};  // b
  std::array<double, 3> of_sp{};  // c
  std::vector<double> jumps;      // n where it jumps, CO units; empty where SP is known
};

Feedback find_feedback(const LoopColumns& columns);

enum class SwitchingLaw : std::uint8_t { none, two_levels, pulses, gap_action };
const char* to_text(SwitchingLaw law) noexcept;
SwitchingLaw switching_law(const LoopColumns& columns);

// CO as what comes from outside alone would have moved it, from 0. Empty where that loop runs away: the law found
// is none that could have controlled this process.
std::vector<double> outside_output(const LoopColumns& columns, const Feedback& feedback,
                                   const plant::ProcessParameters& process, double period_s);

// Gains of u = kp e + ki integral(e), e = SP - PV, by least squares on the differences of CO; their sign is that
// of the controller's action. Without SP a constant one is found with them.
struct PiGains {
  double kp = 0.0;         // CO units/PV unit
  double ki = 0.0;         // CO units/(PV unit s)
  double explained = 0.0;  // share of the moves of CO, 0 to 1
  double set_point = 0.0;  // PV units, where SP was not given
};
PiGains find_pi_gains(const LoopColumns& columns, double period_s);

}  // namespace loopwarden::analysis
