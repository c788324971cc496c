// SPDX-License-Identifier: Apache-2.0
// Assigns the tags of a plant to loops and signals, and derives the units, ranges and modes.
//
//   by rule, or by the end of a name   FIC205.PV, Area1/FIC205/PID1/OUT.CV       sure
//                                      (record/import/tag_rules.hpp)
//   in the folder above a PID block    FIC205/PID1/PV with FIC205/MODE           guessed
//   the same letter and number         FT205 and FV205, with FIC205.SP if there  guessed
//                                      (record::instrument_name)
//
// Units and ranges are taken from a rule, otherwise from the list. If both lack them, they are
// guessed: PV has those of SP, a CO in % runs from 0 to 100, and a CO from 0 to 100 is in %. The
// values of a mode are those of the rules. Otherwise they are guessed: of a number 1 and 0, as the
// import reads them; of a text the words of common controllers, in the case of its present value.
//
// Limit: if two tags of one loop have the same ending, the first one is taken as a guess.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "record/import/tag_rules.hpp"
#include "workbench/discover/tag_list.hpp"

namespace loopwarden::workbench::discover {

// A value with the reason why it is a guess. An empty `guess` means that the value is sure.
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
  Found<std::vector<std::string>> automatic, manual;  // values of the mode: numbers or words

  const std::optional<LoopSignal>& signal(record::Role role) const {
    return signals[record::index_of(role)];
  }
};

struct FoundLoops {
  std::vector<FoundLoop> loops;
  // "FIC207: no CO": loops with a set point, a mode or CO, but without PV or without CO.
  std::vector<std::string> incomplete;
  std::vector<std::string> other_names;  // names that belong to no loop
  std::vector<std::string> idle_rules;   // rules without effect, each with the reason
};

// Throws CommandError if rules assign two names to one signal of one loop.
FoundLoops find_loops(const std::vector<ListedTag>& tags,
                      const std::vector<record::TagRule>& rules);

}  // namespace loopwarden::workbench::discover
