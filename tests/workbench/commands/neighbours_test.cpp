// SPDX-License-Identifier: Apache-2.0
// `diagnose --neighbours` and `survey` on loops that disturb each other: four measured flow loops
// on one header.
#include <algorithm>
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "model/numeric/random.hpp"
#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"
#include "workbench/survey/neighbours.hpp"

namespace loopwarden::tests::neighbours_test {
namespace {

using nlohmann::json;

const std::string kMeasured = LOOPWARDEN_SOURCE_DIR "/examples/measured/";
const std::vector<std::string> kHeader{"rse_0412_fcv701", "rse_0412_fcv711", "rse_0412_fcv721",
                                       "rse_0412_fcv731"};

json diagnosed(const std::string& arguments) {
  const ShellOutcome outcome = run(LOOPWARDEN_CLI " diagnose " + arguments + " --json 2>/dev/null");
  INFO(arguments << ": " << outcome.text);
  REQUIRE(outcome.exit_code == 0);
  return json::parse(outcome.text);
}

std::string others(const std::string& tag, const std::string& folder = kMeasured) {
  std::string files;
  for (const std::string& other : kHeader) {
    if (other != tag) files += " " + folder + other + ".csv";
  }
  return files;
}

bool holds(const json& tags, const std::string& tag) {
  return std::find(tags.begin(), tags.end(), tag) != tags.end();
}

// Each jump of loop 701, of 0.2 m3/h, moves the three others by 0.03 m3/h the other way within a
// second. All four valves stick.
TEST_CASE("neighbours: all four measured loops on one header keep their valve findings",
          "[neighbour]") {
  for (const std::string& tag : kHeader) {
    const json alone = diagnosed(kMeasured + tag + ".csv");
    const json pushed = diagnosed(kMeasured + tag + ".csv --neighbours" + others(tag));
    INFO(tag << " " << pushed.at("pushed_by"));
    CHECK_FALSE(alone.contains("pushed_by"));
    CHECK(pushed.at("verdict") == alone.at("verdict"));
    CHECK((pushed.at("verdict") == "valve_effect" || pushed.at("verdict") == "cant_tell"));
    CHECK(holds(pushed.at("pushed_by"), "rse_0412_fcv701") == (tag != "rse_0412_fcv701"));
  }
}

TEST_CASE("neighbours: the survey gives the same result for the loops of a folder", "[neighbour]") {
  const TemporaryFolder folder;
  const ShellOutcome made = run(LOOPWARDEN_CLI " survey " + kMeasured +
                                "rse_0412_fcv7?1.csv --out " + (folder / "s").string() + " 2>&1");
  INFO(made.text);
  REQUIRE(made.exit_code == 0);
  const json survey = json::parse(read_file(folder / "s/survey.json"));
  REQUIRE(survey.at("loops").size() == 4);
  for (const json& loop : survey.at("loops")) {
    INFO(loop.at("tag") << " " << loop.at("pushed_by"));
    CHECK(loop.at("verdict") != "other_cause");
    CHECK(loop.at("verdict") != "healthy");
    CHECK(holds(loop.at("pushed_by"), "rse_0412_fcv701") == (loop.at("tag") != "rse_0412_fcv701"));
    CHECK_FALSE(loop.contains("moves"));
  }
  CHECK(read_file(folder / "s/survey.csv").find("pushed_by") != std::string::npos);
}

TEST_CASE("neighbours: loops with another time base are not compared", "[neighbour]") {
  const TemporaryFolder folder;
  // The same values a minute later, and only every second value.
  const auto rewrite = [&](const std::string& name, double later_s, std::size_t step) {
    const std::string text = read_file(kMeasured + "rse_0412_fcv701.csv");
    std::string out = "time,pv,co\n";
    std::size_t row = 0;
    for (std::size_t at = text.find('\n') + 1; at < text.size(); ++row) {
      const std::size_t end = std::min(text.find('\n', at), text.size());
      const std::size_t comma = text.find(',', at);
      if (row % step == 0) {
        out += std::to_string(std::stod(text.substr(at, comma - at)) + later_s) +
               text.substr(comma, end - comma) + "\n";
      }
      at = end + 1;
    }
    write_file(folder / name, out);
  };
  rewrite("later.csv", 60.0, 1);
  rewrite("half.csv", 0.0, 2);
  for (const char* name : {"later.csv", "half.csv"}) {
    const std::string arguments =
        kMeasured + "rse_0412_fcv711.csv --neighbours " + (folder / name).string();
    CHECK_FALSE(diagnosed(arguments).contains("pushed_by"));
    const ShellOutcome said = run(LOOPWARDEN_CLI " diagnose " + arguments + " 2>&1");
    CHECK(said.text.find("no neighbour has the time base") != std::string::npos);
  }
  CHECK(run(LOOPWARDEN_CLI " diagnose " + kMeasured +
            "rse_0412_fcv711.csv --neighbours /nonexistent.csv 2>&1")
            .exit_code == 74);
}

// A survey result with the fields that the comparison of neighbours uses.
json result(const std::string& tag, const std::string& verdict, const json& cause,
            const std::vector<double>& pv, double starts_s) {
  record::Record record;
  record.period_s = 10.0;
  record.pv = pv;
  for (std::size_t k = 0; k < pv.size(); ++k) {
    record.time_s.push_back(10.0 * static_cast<double>(k));
    record.co.push_back(50.0);
  }
  record::ImportNotes notes;
  notes.start = record::TimePoint{1764000000 + static_cast<std::int64_t>(starts_s), 0.0, true};
  return {{"tag", tag},           {"verdict", verdict},
          {"cause", cause},       {"period_s", nullptr},
          {"evidence", "before"}, {"moves", workbench::moves_json(record, notes)}};
}

TEST_CASE("neighbours: an unknown disturbance becomes the neighbour's, and cant_tell stays",
          "[neighbour]") {
  numeric::Random random(5);
  std::vector<double> source(3000);
  std::vector<double> victim(source.size());
  double level = 1.0;
  double pushed = 0.0;
  for (std::size_t k = 0; k < source.size(); ++k) {
    if (random.uniform() < 0.02) {
      level = -level;
      pushed -= 0.5 * level;
    }
    pushed *= 0.9;
    source[k] = level + 0.02 * random.normal();
    victim[k] = pushed + 0.02 * random.normal();
  }
  // Each transmitter has a noise of its own.
  const auto pushed_loop = [&] {
    std::vector<double> pv = victim;
    for (double& value : pv) value += 0.02 * random.normal();
    return pv;
  };
  std::vector<json> loops{result("A", "valve_effect", nullptr, source, 0.0),
                          result("B", "other_cause", "disturbance", pushed_loop(), 0.0),
                          result("C", "cant_tell", nullptr, pushed_loop(), 0.0),
                          result("D", "valve_effect", nullptr, pushed_loop(), 0.0),
                          result("E", "healthy", nullptr, pushed_loop(), 0.0),
                          result("F", "other_cause", "saturation", pushed_loop(), 0.0),
                          result("G", "other_cause", "disturbance", pushed_loop(), 1e6)};
  workbench::name_neighbours(loops, 2);
  CHECK(loops[0].at("verdict") == "valve_effect");
  for (const std::size_t k : {1U, 2U, 3U, 4U, 5U}) {
    INFO(loops[k]);
    CHECK(holds(loops[k].at("pushed_by"), "A"));
    CHECK_FALSE(loops[k].contains("moves"));
  }
  CHECK(loops[1].at("cause") == "neighbour");
  CHECK(loops[1].at("evidence").get<std::string>().starts_with("PV follows the moves of "));
  CHECK(loops[2].at("verdict") == "cant_tell");
  CHECK(loops[3].at("verdict") == "valve_effect");
  CHECK(loops[3].at("evidence") == "before");
  CHECK(loops[4].at("verdict") == "other_cause");
  CHECK(loops[4].at("cause") == "neighbour");
  CHECK(loops[5].at("cause") == "saturation");
  // Recorded at another time, so there is no record to compare it with.
  CHECK(loops[6].at("pushed_by").is_null());
  CHECK(loops[6].at("cause") == "disturbance");
}

}  // namespace
}  // namespace loopwarden::tests::neighbours_test
