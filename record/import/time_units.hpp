// SPDX-License-Identifier: Apache-2.0
// Finds the unit of a column of times: from its name ("t[ms]", "timestamp_us"), from the size of
// the numbers, and from the steps between them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "record/import/time_text.hpp"

namespace loopwarden::record {

// Returns seconds, milliseconds, microseconds, nanoseconds, minutes or hours by the name of a
// column of times. automatic: the name has no unit.
TimeForm time_unit_of(std::string_view name);

// Returns whether a column has a name for times: time, Zeitstempel, t[ms], millis, ...
bool is_time_name(std::string_view name);

struct CountedTime {
  TimeForm form = TimeForm::seconds;
  std::string hint;      // other possible meaning of the times, for people
  std::string question;  // not empty: the steps fit two units, so the user must choose
};
// `name`: of the column, with its unit. `times`: numbers, in the order of the rows.
CountedTime count_times(std::string_view name, const std::vector<double>& times);

// Returns a sentence about another possible unit of times with this step in seconds; empty: no
// other unit.
std::string other_time_units(double step_s);

}  // namespace loopwarden::record
