// SPDX-License-Identifier: Apache-2.0
#include "workbench/survey/test_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/file.hpp"
#include "base/text.hpp"
#include "record/import/number_text.hpp"
#include "workbench/files/csv_log.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/survey/changes.hpp"
#include "workbench/text/csv_text.hpp"

namespace loopwarden::workbench {
namespace {

using nlohmann::json;

constexpr std::size_t kLargestLog = 64UL * 1024UL * 1024UL;
constexpr std::array kTestColumns{"ended",     "loop",    "explanations",
                                  "predicted", "decided", "probability"};
struct TestColumn {
  enum Place : std::size_t { ended, loop, explanations, predicted, decided, probability };
};

json test_json(const KeptTest& t) {
  return {{"ended", t.ended},
          {"loop", t.loop},
          {"explanations", t.explanations},
          {"predicted", t.predicted},
          {"decided", t.decided.empty() ? json() : json(t.decided)},
          {"probability", t.decided.empty() ? json() : json(t.probability)}};
}

}  // namespace

std::vector<KeptTest> read_tests(const std::filesystem::path& path) {
  const std::optional<std::string> text = base::read_file(path, kLargestLog);
  if (!text) {
    if (errno == ENOENT) return {};
    fail_csv(path, "can't be read", errno);
  }
  std::vector<CsvColumn> columns;
  for (const char* name : kTestColumns) columns.push_back({name, true});
  const CsvTable table = read_csv(path.string(), *text, columns);
  std::vector<KeptTest> tests;
  for (const CsvRow& row : table.rows) {
    const auto number = [&](TestColumn::Place place) {
      const auto value = record::parse_number(row.cells[place], table.decimal);
      if (!value || !(*value >= 0.0 && *value <= 1.0)) {
        table.fail_at(row, place, base::in_quotes(row.cells[place]) + " is no probability");
      }
      return *value;
    };
    tests.push_back({.ended = row.cells[TestColumn::ended],
                     .loop = row.cells[TestColumn::loop],
                     .explanations = row.cells[TestColumn::explanations],
                     .predicted = number(TestColumn::predicted),
                     .decided = row.cells[TestColumn::decided],
                     .probability = number(TestColumn::probability)});
  }
  return tests;
}

void keep_test(const std::filesystem::path& path, const KeptTest& test) {
  append_csv_line(path, fmt::format("{}", fmt::join(kTestColumns, ",")),
                  fmt::format("{},{},{},{:.4f},{},{:.4f}", csv_cell(test.ended),
                              csv_cell(test.loop), csv_cell(test.explanations), test.predicted,
                              csv_cell(test.decided), test.probability));
}

void tell_tests(json& survey, const std::vector<KeptTest>& tests) {
  for (json& loop : survey.at("loops")) {
    json& told = loop["tests"] = json::array();
    for (const KeptTest& test : tests) {
      if (loop.at("tag") == test.loop) told.push_back(test_json(test));
    }
  }
}

void keep_test_of_survey(const std::filesystem::path& folder, const KeptTest& test) {
  keep_test(folder / kTestsFile, test);
  const std::filesystem::path survey_file = folder / "survey.json";
  if (!std::filesystem::exists(survey_file)) return;
  json told = read_survey(survey_file);
  tell_tests(told, read_tests(folder / kTestsFile));
  OutputFiles files;
  files.add(survey_file, told.dump(1) + "\n");
  files.commit();
}

std::vector<ScoreOfTenth> score_of(const std::vector<KeptTest>& tests) {
  constexpr std::size_t kParts = 10;
  std::vector<ScoreOfTenth> score(kParts);
  for (std::size_t i = 0; i < kParts; ++i) {
    score[i].low = static_cast<double>(i) / kParts;
    score[i].high = static_cast<double>(i + 1) / kParts;
  }
  for (const KeptTest& test : tests) {
    const auto i = std::min(static_cast<std::size_t>(test.predicted * kParts), kParts - 1);
    ++score[i].tests;
    if (!test.decided.empty()) ++score[i].decided;
    score[i].predicted += test.predicted;
  }
  std::erase_if(score, [](const ScoreOfTenth& t) { return t.tests == 0; });
  for (ScoreOfTenth& t : score) t.predicted /= static_cast<double>(t.tests);
  return score;
}

json score_json(const std::vector<KeptTest>& tests) {
  json told = {{"tests", json::array()}, {"score", json::array()}};
  for (const KeptTest& t : tests) told["tests"].push_back(test_json(t));
  for (const ScoreOfTenth& t : score_of(tests)) {
    told["score"].push_back({{"from", t.low},
                             {"to", t.high},
                             {"predicted", t.predicted},
                             {"tests", t.tests},
                             {"decided", t.decided}});
  }
  return told;
}

std::string tests_text(const std::vector<KeptTest>& tests) {
  if (tests.empty()) return "no tests yet\n";
  std::string text = fmt::format("{:<20}  {:<16} {:<32} {:>9}  {}\n", "ended", "loop",
                                 "explanations", "predicted", "decided");
  for (const KeptTest& t : tests) {
    text += fmt::format(
        "{:<20}  {:<16} {:<32} {:>9.2f}  {}\n", t.ended, t.loop, t.explanations, t.predicted,
        t.decided.empty() ? "undecided" : fmt::format("{} ({:.2f})", t.decided, t.probability));
  }
  for (const ScoreOfTenth& t : score_of(tests)) {
    text += fmt::format("predicted {:.1f} to {:.1f} (mean {:.2f}): {} of {} tests decided\n", t.low,
                        t.high, t.predicted, t.decided, t.tests);
  }
  return text;
}

}  // namespace loopwarden::workbench
