// SPDX-License-Identifier: Apache-2.0
// Finds the unit of a column of times: from its name ("t[ms]", "timestamp_us"), from the size of
// the numbers, and from the steps between them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "record/import/time_text.hpp"

namespace loopwarden::record {

// seconds, milliseconds, microseconds, nanoseconds, minutes or hours by the name of a column of
// times; automatic: the name does not say.
TimeForm time_unit_of(std::string_view name);

// Returns whether a column is named as times are: time, Zeitstempel, t[ms], millis, ...
bool is_time_name(std::string_view name);

struct CountedTime {
  TimeForm form = TimeForm::seconds;
  std::string hint;      // what else the times may be, for people
  std::string question;  // not empty: the steps fit two units, so the user has to choose
};
// `name`: of the column, with its unit. `times`: numbers, in the order of the rows.
CountedTime count_times(std::string_view name, const std::vector<double>& times);

// Another unit that times in seconds with this step may have, as a sentence; empty: none.
std::string other_time_units(double step_s);

}  // namespace loopwarden::record
