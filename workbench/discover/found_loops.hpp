// SPDX-License-Identifier: Apache-2.0
// Which tags of a plant are the signals of which loop, and what is known of it.
//
//   by rule, or by a name's ending     FIC205.PV, Area1/FIC205/PID1/OUT.CV       sure     record/import/tag_rules.hpp
//   in the folder above a PID block    FIC205/PID1/PV with FIC205/MODE           guessed
//   the same letter and number         FT205 and FV205, with FIC205.SP if there  guessed  record::instrument_name
//
// Units and ranges: by rule, else as listed. Guessed where nothing says them: those of PV are SP's, a CO in % runs from 0 to
// 100 and one from 0 to 100 is in %. The numbers of a mode are the rules', else guessed as the import reads them, 1 and 0.
//
// What it can't do: tell which of two tags with one ending in one loop is the signal (the first is taken, as a guess).
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "record/import/tag_rules.hpp"
#include "workbench/discover/tag_list.hpp"

namespace loopwarden::workbench::discover {

// A value, and why it is a guess; an empty `guess`: it is sure.
template <class T>
struct Found {
  T value{};
  std::string guess{};
};

struct LoopSignal {
  std::string name;  // in the list
  std::string node{};
  std::string guess{};
};

struct FoundLoop {
  Found<std::string> tag;
  std::string description;
  std::array<std::optional<LoopSignal>, record::kRoles> signals;  // pv and co are there
  Found<std::string> pv_unit, co_unit;                            // empty: not known
  Found<std::optional<record::SignalRange>> pv_range, co_range;
  Found<std::vector<double>> automatic, manual;  // numbers of the mode

  const std::optional<LoopSignal>& signal(record::Role role) const {
    return signals[record::index_of(role)];
  }
};

struct FoundLoops {
  std::vector<FoundLoop> loops;
  // "FIC207: no CO": what has a set point, a mode or CO, and not both of PV and CO.
  std::vector<std::string> incomplete;
  std::vector<std::string> other_names;  // no loop's
  std::vector<std::string> idle_rules;   // decide of no name, each with the reason
};

// Throws CommandError where two names are one signal of one loop by rule.
FoundLoops find_loops(const std::vector<ListedTag>& tags,
                      const std::vector<record::TagRule>& rules);

}  // namespace loopwarden::workbench::discover
