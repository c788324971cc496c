// SPDX-License-Identifier: Apache-2.0
// Finds rows whose times do not continue those of the row before. Causes are a clock that was not
// yet set, was set back, or wrote a few wrong stamps.
//
//   far away      stretches more than a year apart: the one with four fifths of the rows is kept.
//                 Without such a one, those before 1990 and after 2100 are left out if one
//                 stretch is between
//   wrong stamps  at most 1 % of the rows, each more than two hours off its neighbours: left out
//   set back      two stretches with the same times: refused. Rows of two stretches are never mixed
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace loopwarden::record {

struct TimeFinding {
  std::vector<bool> left_out;        // by row; empty: no row is left out
  std::vector<std::string> remarks;  // description of the rows left out, for people
  std::string problem;               // not empty: the rows can't be used, with cause and remedy
  std::size_t row = 0;               // of the problem, from 0
};

struct TimeContext {
  // Returns a time for people: 2026-11-02T06:00:00, or "12 s".
  std::function<std::string(double)> text;
  double epoch_s = 0.0;        // at time 0, s since 1970
  bool is_absolute = false;    // `epoch_s` is known
  bool local = false;          // times without a zone: summer time may end
  bool may_be_sorted = false;  // rows in any order are no problem, as long as no stretches overlap
  // Returns whether two rows have the same values. Rows that were exported twice are no problem.
  std::function<bool(std::size_t, std::size_t)> same_value;
};

// `time_s`: in the order of the rows. If the newest row is first, the rows must be reversed before.
TimeFinding find_time_jumps(const std::vector<double>& time_s, const TimeContext& context);

}  // namespace loopwarden::record
