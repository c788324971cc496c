// SPDX-License-Identifier: Apache-2.0
// Finds the loops that disturb others on the same time base (model/diagnosis/neighbour.hpp). Loops
// share a time base if they have the same sample period and both exports have a clock. Without
// clocks, their first and last times must be equal.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "model/diagnosis/neighbour.hpp"
#include "record/import/constant_period.hpp"

namespace loopwarden::workbench {

// The last samples of a loop without those in manual.
struct TimedLoop {
  std::string tag;
  double step_s = 1.0;
  double first_s = 0.0;  // first kept sample; since 1970 if the export has a clock
  bool clock = false;
  bool zone_known = false;
  double from_s = 0.0;  // start of the whole record, in its own time
  double to_s = 0.0;
  std::vector<float> pv{}, co{};  // NaN: missing
  bool valve_effect = false;
  double period_s = 0.0;  // 0: does not oscillate
};
TimedLoop timed_loop(const record::Record& record, const record::ImportNotes& notes,
                     std::size_t most);

struct PushedBy {
  std::size_t source = 0;
  diagnosis::Push push;
};
struct Neighbours {
  bool compared = false;            // with at least one other loop
  std::vector<PushedBy> pushed_by;  // strongest first
};
// Returns one entry per loop. The result does not depend on `threads`.
std::vector<Neighbours> find_neighbours(std::span<const TimedLoop> loops, unsigned threads);

// Returns "PV follows the moves of FIC101, FIC102".
std::string follows_text(const std::vector<std::string>& tags);

// Number of samples in a loop's result: 12 bits per value, 16 kB per loop.
inline constexpr std::size_t kMovesKept = 4096;  // samples
nlohmann::json moves_json(const record::Record& record, const record::ImportNotes& notes);
// Returns for each loop the loop with the same record, or itself. PV and CO are the same if they
// differ by less than kSameRecord of their deviation from the mean, and if four fifths of PV's
// moves, noise included, are the same. The copy is the shorter or coarser record, of equals the one
// with the longer tag.
inline constexpr double kSameRecord = 0.05;
std::vector<std::size_t> find_duplicates(std::span<const TimedLoop> loops);

// Removes the moves from the results and adds
// - `pushed_by`: tags, or null if no other loop was comparable. Adjusts verdict, cause and evidence
//   if a neighbour is the cause.
// - `duplicate_of`: tag of the loop with the same record, or null.
// Texts use the key `shown` of the loops.
void name_neighbours(std::vector<nlohmann::json>& loops, unsigned threads);

}  // namespace loopwarden::workbench
