// SPDX-License-Identifier: Apache-2.0
// Stores the tests that were carried out, with their predictions, as lines of tests.csv next to
// survey.json, and scores the predictions.
#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace loopwarden::workbench {

struct KeptTest {
  std::string ended{};         // UTC, ISO 8601
  std::string loop{};          // tag, or the model's file
  std::string explanations{};  // "stiction or backlash"
  double predicted = 0.0;      // probability of a right decision
  std::string decided{};       // empty: undecided
  double probability = 0.0;    // of the decision
};

inline constexpr const char* kTestsFile = "tests.csv";

// Returns the tests in the order of their lines. Empty if the file does not exist. Throws
// CommandError.
std::vector<KeptTest> read_tests(const std::filesystem::path& path);
void keep_test(const std::filesystem::path& path, const KeptTest& test);

// Sets `tests` of each loop of a survey.
void tell_tests(nlohmann::json& survey, const std::vector<KeptTest>& tests);
// Stores the test in tests.csv of a survey's folder, and lists it in survey.json if there is one.
// Throws CommandError.
void keep_test_of_survey(const std::filesystem::path& folder, const KeptTest& test);

// Tests of one tenth of predicted probability.
struct ScoreOfTenth {
  double low = 0.0, high = 0.0;  // of the predicted probability
  std::size_t tests = 0, decided = 0;
  double predicted = 0.0;  // mean
};
// The tenths that have tests.
std::vector<ScoreOfTenth> score_of(const std::vector<KeptTest>& tests);
nlohmann::json score_json(const std::vector<KeptTest>& tests);
// Lines for a terminal: every test, then the score.
std::string tests_text(const std::vector<KeptTest>& tests);

}  // namespace loopwarden::workbench
