// SPDX-License-Identifier: Apache-2.0
// Cause of an alarm, found by the gap workflow in the newest minutes with the loop's twin.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "model/twin/planned_moves_of.hpp"
#include "model/alarm/alarm_kind.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::daemon {

// Slip of a watched loop: the test that the operator of the other controller is asked to make.
struct TestSlip {
  enum class State : std::uint8_t { open, done, expired };
  State state = State::open;
  std::string another_move;  // newest move that differs from the plan, a sentence; empty: none
  // Of a test that is done.
  std::string competing;     // "stiction or backlash"
  std::string decided;       // empty: not decided
  double predicted = 0.0;    // probability of a decision
  double probability = 0.0;  // of the decision
};
std::string to_text(const TestSlip& slip);

struct Explanation {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  alarm::AlarmKind alarm = alarm::AlarmKind::stiction;  // as raised
  std::optional<alarm::AlarmKind> final_name;           // another one than `alarm`
  std::int64_t raised_ms = 0;                           // UTC, ms since 1970
  std::int64_t ended_ms = 0;
  std::string verdict;                    // of gap, or not_explained
  std::string effect;                     // empty: none has a name
  std::optional<effects::Block> block{};  // of the effect
  std::uint16_t effect_number = 0;        // of the catalogue; 0: none
  double size_percent = kNone;            // % of the CO span; NaN: it has no size
  double low_percent = kNone;             // interval of the size
  double high_percent = kNone;
  std::optional<twin::Stick> stick{};  // agrees, and has the effect stiction
  double confidence = kNone;
  double gap_closed = kNone;  // share; NaN: too close to the noise
  bool agrees = false;
  double since_s = kNone;  // s before the alarm
  std::vector<std::string> alternatives;
  std::string sentence;
  std::string remedy;              // recommended action; may be empty
  std::string next_test;           // that decides between the likely explanations; may be empty
  std::optional<TestSlip> slip{};  // of `next_test`
  std::filesystem::path folder;    // of the evidence
};

}  // namespace loopwarden::daemon
