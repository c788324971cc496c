// SPDX-License-Identifier: Apache-2.0
// Turns a routine record into series with the same meaning at any sample time and in any unit.
//
//  1. Short gaps are filled by straight lines. Of a record with a long gap, or a stretch in manual
//     (CO doesn't move for a fifth of the record), the longest part is used. A moving set point is
//     no reason to cut. If CO reaches its limits, the longest part between is used.
//  2. Gates, below.
//  3. The time scale of the loop, its period, is found (oscillation.hpp), from PV and CO.
//  4. Samples are averaged to at most kSamplesPerPeriod per period, slow movement is removed with a
//     moving mean of kWindowPeriods periods, upsets are cut back to 2.5 times the range from 5 to
//     95 %, and both signals are scaled to a standard deviation of 1.
//
// The likelihood of a band (estimator/band.hpp) uses `raw_pv` and `raw_co` without these changes.
//
// Gates, each with its reason: too few samples, CO does not move (manual), and these, which name a
// cause directly:
//   sensor      PV is frozen while CO moves
//   no flow     PV is at zero while CO travels
//   saturation  CO is at its limits in more than a third of the samples, or no part of a quarter of
//               the record is between them
// CO that doesn't move for a fifth of the record counts as at a limit if PV is off SP meanwhile. At
// an end of its span, PV must be off by more than 0.5 % of the largest PV or SP and three times the
// noise of PV. Elsewhere it must be off by ten times and twice as much. Without SP, a rest at an
// end of the span counts. A rest doesn't count while PV is at zero: the valve is shut, or there is
// no flow.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "model/diagnosis/oscillation.hpp"
#include "model/diagnosis/series_ops.hpp"
#include "model/numeric/loop_record.hpp"

namespace loopwarden::diagnosis {

// The result of a gate, without the weighing of evidence.
enum class Gate : std::uint8_t { open, too_little, sensor, no_flow, saturation };

struct Prepared {
  Gate gate = Gate::open;
  std::string refusal;  // why the valve can't be judged; otherwise empty
  std::string settle;   // the remedy

  Series raw_pv;  // the part used, gaps filled, PV units
  Series raw_co;  // CO units
  Series raw_sp;  // PV units, empty without SP

  std::size_t from = 0;    // first sample of the record that is used
  std::size_t used = 0;    // samples of the record that are used
  std::size_t factor = 1;  // samples averaged into one
  double period = 0.0;     // time scale, samples of the series below
  double period_s = 0.0;
  double cycles = 0.0;  // length of the series over the period
  Oscillation pv_oscillation;
  Oscillation co_oscillation;

  Series pv;       // averaged, PV units
  Series co;       // averaged, CO units
  Series error;    // PV - SP if SP is the active set point, otherwise PV; high-passed, scaled
  Series output;   // CO, high-passed, scaled
  Series pv_fast;  // PV, high-passed, scaled
  std::size_t window = 0;         // of the moving mean, samples
  double co_scale = 1.0;          // CO units, standard deviation of CO after the high-pass
  bool set_point_active = false;  // an SP that moves and that PV follows
  double share_at_limit = 0.0;    // of the samples before the cut, CO held by a limit
  std::size_t complete = 0;       // samples of the record with PV and CO
  std::size_t limited = 0;        // of these: CO at a limit, or at rest while PV is far from SP
  double fast_share = 0.0;        // of PV's variance that is noise between neighbours, 0 to 1
  double held_share = 0.0;        // of the samples, PV exactly as before, 0 to 1
};

Prepared prepare(const numeric::LoopView& record);

// Returns whether so many of the complete samples are limited that the loop is saturated.
bool mostly_limited(std::size_t limited, std::size_t complete) noexcept;

}  // namespace loopwarden::diagnosis
