// SPDX-License-Identifier: Apache-2.0
// Runs `loopwarden-study diagnose` as a user does: weights, records judged by weights of other
// plants, gap examples.
#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "lab/hidden_cases/hidden_case.hpp"
#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"

namespace diagnose_study_test {

using loopwarden::tests::bash;
using loopwarden::tests::ShellOutcome;
using loopwarden::tests::TemporaryFolder;

const std::string kStudy = LOOPWARDEN_BIN_DIR "/loopwarden-study diagnose ";
const std::filesystem::path kRecords = LOOPWARDEN_SOURCE_DIR "/examples/routine";
const std::string kOtherPlants = LOOPWARDEN_SOURCE_DIR "/examples/isdb";

std::string text_of(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

// Copies the open records into `folder`, `loop` with a wrong label.
void copy_with_wrong_label(const std::filesystem::path& folder, const std::string& loop) {
  std::filesystem::copy(kRecords, folder);
  std::istringstream lines(text_of(kRecords / "labels.csv"));
  std::ofstream labels(folder / "labels.csv");
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.find("," + loop + ",") != std::string::npos) {
      line.back() = line.back() == '1' ? '0' : '1';
    }
    labels << line << '\n';
  }
}

// Returns the result for each loop of `records`, with its own plant left out and other plants
// added.
std::map<std::string, double> left_out(const std::filesystem::path& records) {
  const ShellOutcome outcome = bash(kStudy + "--records " + records.string() + " " + kOtherPlants +
                                    " --json --refit --cases 60 --seed 5");
  REQUIRE(outcome.exit_code == 0);
  std::map<std::string, double> said;
  const auto result = nlohmann::json::parse(outcome.text);
  for (const nlohmann::json& row : result.at("loops")) {
    said[row.at("loop").get<std::string>()] = row.at("left_out").get<double>();
  }
  return said;
}

TEST_CASE("--refit: the labels of a plant don't affect the verdicts on it, but those on others",
          "[studies][diagnose]") {
  const TemporaryFolder folder;
  copy_with_wrong_label(folder / "B", "B");
  const auto right = left_out(kRecords);
  const auto wrong = left_out(folder / "B");
  for (const std::string loop : {"B", "D"}) {
    CAPTURE(loop);
    CHECK(right.at(loop) == wrong.at(loop));
  }
  CHECK(right.at("CHEM24") != wrong.at("CHEM24"));
}

TEST_CASE("--weights: the same data make the same header; reversed labels make another",
          "[studies][diagnose]") {
  const TemporaryFolder folder;
  copy_with_wrong_label(folder / "wrong", "B");
  const auto weights = [&](const std::filesystem::path& records, const std::string& name) {
    const ShellOutcome outcome = bash(kStudy + "--records " + records.string() +
                                      " --cases 60 --seed 5 --weights " + (folder / name).string());
    REQUIRE(outcome.exit_code == 0);
    return text_of(folder / name);
  };
  const std::string first = weights(kRecords, "first.hpp");
  CHECK(first == weights(kRecords, "second.hpp"));
  CHECK(first != weights(folder / "wrong", "third.hpp"));
  // The compiled-in weights have the same form: all except the numbers.
  const auto form = [](std::string text) {
    text.erase(std::remove_if(text.begin(), text.end(),
                              [](char c) {
                                return std::string("0123456789.-+").find(c) != std::string::npos;
                              }),
               text.end());
    return text;
  };
  const auto declarations = [&](const std::string& text) {
    const std::string bare = form(text);
    return bare.substr(bare.find("namespace"));
  };
  const std::string compiled =
      text_of(LOOPWARDEN_SOURCE_DIR "/model/diagnosis/decision_weights.hpp");
  CHECK(declarations(first) == declarations(compiled));
  CHECK(first.find("--records " + kRecords.string()) != std::string::npos);
}

TEST_CASE("--compare: measured and simulated loops, with and without an ingredient",
          "[studies][diagnose]") {
  const TemporaryFolder folder;
  const std::string data = LOOPWARDEN_SOURCE_DIR "/examples/";
  const std::string compare =
      "--records " + data + "isdb " + data + "routine --cases 100 --seed 3 --compare ";
  const ShellOutcome outcome =
      bash(kStudy + compare + "--evidence " + (folder / "all.csv").string());
  REQUIRE(outcome.exit_code == 0);
  const std::size_t table = outcome.text.find("all evidence together");
  REQUIRE(table != std::string::npos);
  const std::string rows = outcome.text.substr(table);
  CHECK(rows.find("\nflow ") != std::string::npos);
  CHECK(rows.find("\nall ") != std::string::npos);
  CHECK(rows.find("CHEM") != std::string::npos);
  CHECK(rows.find("routine") != std::string::npos);
  const std::string evidence = text_of(folder / "all.csv");
  CHECK(evidence.find("\nsimulated,") != std::string::npos);
  CHECK(evidence.find("\nCHEM,CHEM1,flow,1,") != std::string::npos);

  const ShellOutcome bare = bash(kStudy + compare + "--without all --with steps");
  CHECK(bare.exit_code == 0);
  CHECK(bare.text != outcome.text);
  CHECK(bash(kStudy + compare + "--without nonsense 2>/dev/null").exit_code == 64);
}

TEST_CASE(
    "--gap-examples: a sticking valve is found, a bias is no false alarm, a bad list is reported",
    "[studies][diagnose]") {
  const TemporaryFolder folder;
  std::vector<loopwarden::hidden_cases::CaseRequest> requests{
      {.id = "stuck", .effect = "stiction", .seed = 60031},
      {.id = "bias", .effect = "output_bias", .seed = 60005}};
  loopwarden::hidden_cases::write_cases(folder / "cases", requests);
  const ShellOutcome outcome = bash(kStudy + "--gap-examples " + (folder / "cases").string());
  CHECK(outcome.exit_code == 0);
  CHECK(outcome.text.find("valve effects found 1 of 1; false alarms 0 of 1") != std::string::npos);

  std::ofstream(folder / "cases" / "truth.json") << R"([{"id": "stuck"}])";
  const ShellOutcome bad = bash(kStudy + "--gap-examples " + (folder / "cases").string() + " 2>&1");
  CHECK(bad.exit_code == 65);
  CHECK(bad.text.find("truth.json: not a list of truths") != std::string::npos);
}

}  // namespace diagnose_study_test
