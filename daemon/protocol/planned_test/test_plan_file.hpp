// SPDX-License-Identifier: Apache-2.0
// next_test.yaml: a test that tells explanations of a loop apart. `gap` writes it, and `valve-test
// --plan` carries it out. docs/reference/next-test.md lists the keys.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/diagnostic.hpp"
#include "config/key_reference.hpp"
#include "model/estimator/plan.hpp"

namespace loopwarden::protocol {

// Time for a person to make the move of a slip, s after the planning. By hand: three shifts.
inline constexpr std::int64_t kSlipValid_s = 86'400;

struct PlannedExplanation {
  std::vector<std::string> effects;  // empty: nothing is missing
  double probability = 0.0;          // before the test
  // s of the test, and 90 % of its simulated tests: lowest and highest PV, PV units
  std::vector<std::array<double, 3>> pv;
};

struct TestPlanFile {
  std::string loop;                            // tag; empty: not known
  std::optional<std::uint32_t> configuration;  // CRC-32 of the loop's file
  std::int64_t planned_at = 0;                 // s since 1970, UTC
  std::string model;                           // file of the loop model
  std::string record;                          // record of the planning, next to this file
  std::vector<std::string> without;            // names that the planning left out
  bool level_of_record = false;                // the model's level of PV is not valid
  std::vector<PlannedExplanation> explanations;
  estimator::Move move;
  double from = 0.0;                               // PV units, or in manual CO units
  std::array<double, 2> pv_limits{}, co_limits{};  // outside of them the test ends
  double probability_right = 0.0, probability_wrong = 0.0;
  double pv_swing = 0.0, output_swing = 0.0;  // PV units; CO units
};

config::Loaded<TestPlanFile> read_test_plan_text(const std::string& file, std::string_view text);
config::Loaded<TestPlanFile> read_test_plan(const std::filesystem::path& path);
// `heading` is put first, as a comment.
std::string write_test_plan(const TestPlanFile& plan, const std::string& heading = "");
config::KeyReference describe_test_plan();

// "stiction + gain change"; "nothing missing" without effects.
std::string title_of(const std::vector<std::string>& effects);
// "stiction or backlash"
std::string names_of(const TestPlanFile& plan);
// "2026-11-29T00:21:24Z"
std::string utc_time_text(std::int64_t seconds);

}  // namespace loopwarden::protocol
