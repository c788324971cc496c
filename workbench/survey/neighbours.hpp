// SPDX-License-Identifier: Apache-2.0
// Which loops of one time base push which (model/diagnosis/neighbour.hpp). One time base: one period, and a clock in both
// exports, or in neither but one first and last time.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "model/diagnosis/neighbour.hpp"
#include "record/import/constant_period.hpp"

namespace loopwarden::workbench {

// Of a loop the last samples, those in manual left out.
struct TimedLoop {
  std::string tag;
  double step_s = 1.0;
  double first_s = 0.0;  // of the samples kept, since 1970 where the export has a clock
  bool clock = false;
  bool zone_known = false;
  double from_s = 0.0;  // of the whole record, by its own time
  double to_s = 0.0;
  std::vector<float> pv{}, co{};  // NaN: missing
  bool valve_effect = false;
  double period_s = 0.0;  // 0: does not swing
};
TimedLoop timed_loop(const record::Record& record, const record::ImportNotes& notes,
                     std::size_t most);

struct PushedBy {
  std::size_t source = 0;
  diagnosis::Push push;
};
struct Neighbours {
  bool compared = false;            // with at least one other loop
  std::vector<PushedBy> pushed_by;  // the strongest first
};
// One for each loop. The result does not depend on `threads`.
std::vector<Neighbours> find_neighbours(std::span<const TimedLoop> loops, unsigned threads);

// "PV follows the moves of FIC101, FIC102"
std::string follows_text(const std::vector<std::string>& tags);

// As a loop's result keeps it: 12 bits a value, 16 kB a loop.
inline constexpr std::size_t kMovesKept = 4096;  // samples
nlohmann::json moves_json(const record::Record& record, const record::ImportNotes& notes);
// Takes the moves out of the results and puts `pushed_by` in: tags, or null where nothing was to compare with. Verdict, cause
// and evidence change where a neighbour is the cause.
void name_neighbours(std::vector<nlohmann::json>& loops, unsigned threads);

}  // namespace loopwarden::workbench
