// SPDX-License-Identifier: Apache-2.0
#include "lab/hidden_cases/hidden_case.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "lab/hidden_cases/kinds.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hidden_case_test {

using namespace loopwarden::hidden_cases;
using loopwarden::tests::read_file;
using loopwarden::tests::TemporaryFolder;

namespace {

CaseRequest request(Kind kind, const std::string& effect, std::uint64_t seed, bool load = false) {
  return {"x", kind, effect, seed, load, 2100};
}

struct Rows {
  std::vector<double> time_s, sp, pv, co;
};

Rows read_record(const std::filesystem::path& path) {
  std::istringstream stream(read_file(path));
  std::string line;
  std::getline(stream, line);
  REQUIRE(line == "time,sp,pv,co");
  Rows rows;
  while (std::getline(stream, line)) {
    std::istringstream cells(line);
    std::vector<double> values;
    for (std::string cell; std::getline(cells, cell, ',');) values.push_back(std::stod(cell));
    REQUIRE(values.size() == 4);
    rows.time_s.push_back(values[0]);
    rows.sp.push_back(values[1]);
    rows.pv.push_back(values[2]);
    rows.co.push_back(values[3]);
  }
  return rows;
}

// Returns the largest difference between the recorded CO and a PI with the recorded SP and PV.
double replay_error(const Rows& rows, double kp, double ki) {
  double integral =
      rows.co[0] - kp * (rows.sp[0] - rows.pv[0]) - ki * 0.1 * (rows.sp[0] - rows.pv[0]);
  double worst = 0.0;
  for (std::size_t k = 0; k < rows.pv.size(); ++k) {
    const double error = rows.sp[k] - rows.pv[k];
    integral = std::clamp(integral + ki * 0.1 * error, -10.0, 10.0);
    const double co = std::clamp(kp * error + integral, 0.0, 10.0);
    worst = std::max(worst, std::abs(co - rows.co[k]));
  }
  return worst;
}

// Returns the RMSE over the last third of a first-order model with dead time driven by the recorded
// CO.
double believed_rmse(const HiddenCase& one) {
  const LoopRecord& record = one.record;
  const double keep = std::exp(-kPeriod_s / one.believed.time_constant_s);
  const auto delay = static_cast<std::size_t>(std::lround(one.believed.dead_time_s / kPeriod_s));
  const std::size_t from = record.first + (record.pv.size() - record.first) * 2 / 3;
  double pv = record.pv[record.first];
  double sum = 0.0;
  for (std::size_t k = record.first; k < record.pv.size(); ++k) {
    if (k >= from) sum += (record.pv[k] - pv) * (record.pv[k] - pv);
    const double co = record.co[k >= delay ? std::max(k - delay, record.first) : record.first];
    pv = keep * pv + (1.0 - keep) * one.believed.gain * co;
  }
  return std::sqrt(sum / static_cast<double>(record.pv.size() - from));
}

std::vector<CaseRequest> every_effect() {
  std::vector<CaseRequest> requests;
  for (const Kind kind :
       {Kind::kSingle, Kind::kNone, Kind::kPair, Kind::kOutside, Kind::kFurther}) {
    for (const std::string& effect : effect_names(kind)) {
      requests.push_back(request(kind, effect, 7 + requests.size(), requests.size() % 2 == 1));
    }
  }
  return requests;
}

}  // namespace

TEST_CASE("the same seed gives the same bits, another seed another case", "[hidden_cases]") {
  const auto once = make_case(request(Kind::kSingle, "stiction", 41, true));
  const auto again = make_case(request(Kind::kSingle, "stiction", 41, true));
  const auto other = make_case(request(Kind::kSingle, "stiction", 42, true));
  CHECK(once.record.pv == again.record.pv);
  CHECK(once.record.co == again.record.co);
  CHECK(once.parameters == again.parameters);
  CHECK(once.floor_rmse == again.floor_rmse);
  CHECK(once.record.pv != other.record.pv);
  CHECK(once.parameters != other.parameters);
}

TEST_CASE("every truth gives a record that a 12-bit system could have written", "[hidden_cases]") {
  for (const CaseRequest& wanted : every_effect()) {
    INFO(wanted.effect);
    const HiddenCase one = make_case(wanted);
    const LoopRecord& record = one.record;
    const std::size_t rows = record.pv.size() - record.first;
    CHECK((rows == 2100 || rows == 3000));
    CHECK(record.time_s[record.first] == 0.0);
    CHECK(one.floor_rmse > 0.005);
    CHECK(one.floor_rmse < 0.6);
    for (std::size_t k = record.first; k < record.pv.size(); ++k) {
      REQUIRE(std::isfinite(record.truth_pv[k]));
      for (const double value : {record.pv[k], record.co[k]}) {
        REQUIRE(value >= 0.0);
        REQUIRE(value <= 10.0);
        REQUIRE(std::abs(std::remainder(value, 10.0 / 4096.0)) < 1e-9);
      }
    }
  }
}

TEST_CASE("the believed controller replays the recorded output, a hidden one doesn't",
          "[hidden_cases]") {
  const TemporaryFolder folder;
  const std::string effect = GENERATE("gain_change", "low_air_supply", "controller_mismatch");
  const HiddenCase one = make_case(request(Kind::kSingle, effect, 11));
  write_case(folder.path(), one);
  const Rows rows = read_record(folder / "x/record.csv");
  const double error = replay_error(rows, one.believed.tuning.kp, one.believed.tuning.ki_per_s);
  if (effect == "controller_mismatch") {
    CHECK(error > 0.1);
    CHECK(replay_error(rows, one.parameters.at("kp"), one.parameters.at("ki")) < 0.004);
  } else {
    CHECK(error < 0.004);
  }
}

TEST_CASE("the error of the truth is below the error of the belief", "[hidden_cases]") {
  const std::string effect = GENERATE("stiction", "backlash", "gain_change", "output_bias", "drift",
                                      "step_disturbance", "valve_characteristic");
  INFO(effect);
  const HiddenCase one = make_case(request(Kind::kSingle, effect, 23));
  CHECK(believed_rmse(one) > 2.0 * one.floor_rmse);
}

TEST_CASE("in a case without a hidden effect the belief is nearly right", "[hidden_cases]") {
  const std::string effect = GENERATE("none", "none:sluggish_tuning", "none:constant_set_point");
  const HiddenCase one = make_case(request(Kind::kNone, effect, 5));
  CHECK(one.effect == "none");
  CHECK(one.accept == std::vector<std::string>{"none"});
  CHECK(believed_rmse(one) < 0.12);
}

TEST_CASE("without noise and load the truth's free run equals the measurement", "[hidden_cases]") {
  TruthLoop loop;
  loop.path.push_back(make_lag(0.2));
  loop.path.push_back(make_karnopp_stem({0.6, 0.4, 0.0, 30.0, 0.1, {}}));
  loop.path.push_back(make_dead_time(1.5));
  loop.path.push_back(make_gain([](double) { return 1.1; }));
  loop.path.push_back(make_lag(4.0));
  loop.added.emplace_back([](double t) { return 0.2 * std::sin(0.2 * t); });
  loop.tuning = {1.0, 0.15};
  const SetPointProfile profile{{0.0, 3.0}, {5.0, 5.0}};
  Random random(3);
  const LoopRecord quiet = run(loop, profile, 900, 100, random);
  CHECK(quiet.first == 100);
  CHECK(free_run(loop, 3.0, quiet.co, quiet.first) == quiet.truth_pv);
  CHECK(floor_rmse(quiet) < 0.5 * kResolution);

  loop.noise_rms = 0.02;
  const double noise_floor = floor_rmse(run(loop, profile, 3000, 0, random));
  CHECK(noise_floor == Approx(0.02).epsilon(0.08));
  loop.load_per_root_s = 0.01;
  CHECK(floor_rmse(run(loop, profile, 3000, 0, random)) > 1.5 * noise_floor);
}

TEST_CASE("a plan has the asked kinds in proportion and a seed for every case", "[hidden_cases]") {
  const auto plan = plan_cases(92, 1000, parse_kinds("single,none,pair,outside"), true, 4200);
  REQUIRE(plan.size() == 92);
  std::map<Kind, int> kinds;
  std::map<std::string, int> singles;
  std::set<std::string> ids;
  std::set<std::uint64_t> seeds;
  for (const CaseRequest& one : plan) {
    ++kinds[one.kind];
    if (one.kind == Kind::kSingle) ++singles[one.effect];
    ids.insert(one.id);
    seeds.insert(one.seed);
    CHECK(one.load);
  }
  CHECK(kinds ==
        std::map<Kind, int>{
            {Kind::kSingle, 60}, {Kind::kNone, 8}, {Kind::kPair, 12}, {Kind::kOutside, 12}});
  CHECK(singles.size() == effect_names(Kind::kSingle).size());
  for (const auto& [effect, count] : singles) CHECK((count == 4 || count == 5));
  CHECK(ids.size() == 92);
  CHECK(seeds.size() == 92);
  CHECK(*seeds.begin() == 1000);

  const auto pairs = plan_cases(40, 1, {Kind::kPair}, false, 4200);
  const auto open = std::count_if(pairs.begin(), pairs.end(), [](const CaseRequest& one) {
    return one.effect == "stiction+gain_change" || one.effect == "backlash+oscillating_disturbance";
  });
  CHECK(open == 20);
}

TEST_CASE("truth.json has the hidden effect and model.yaml the believed model", "[hidden_cases]") {
  const TemporaryFolder folder;
  HiddenCase one = make_case(request(Kind::kSingle, "hysteresis", 3));
  write_case(folder.path(), one);
  write_truth(folder.path(), {one});
  const auto truth = nlohmann::json::parse(read_file(folder / "truth.json"));
  REQUIRE(truth.size() == 1);
  CHECK(truth[0].at("id") == "x");
  CHECK(truth[0].at("effect") == "hysteresis");
  CHECK(truth[0].at("accept") == std::vector<std::string>{"hysteresis", "backlash"});
  CHECK(truth[0].at("par").at("width") == one.parameters.at("width"));
  CHECK(truth[0].at("floor_rmse") == one.floor_rmse);
  const std::string model = read_file(folder / "x/model.yaml");
  CHECK(model.find("anti_windup: integral_clamp") != std::string::npos);
  CHECK(model.find("effects: []") != std::string::npos);
}

TEST_CASE("a bad request is refused", "[hidden_cases]") {
  CHECK_THROWS_AS(make_case(request(Kind::kSingle, "rust", 1)), std::invalid_argument);
  CHECK_THROWS_AS(make_case({"x", Kind::kSingle, "drift", 1, false, 100}), std::invalid_argument);
  CHECK_THROWS_AS(parse_kinds("single,both"), std::invalid_argument);
  CHECK_THROWS_AS(parse_kinds(""), std::invalid_argument);
}

}  // namespace hidden_case_test
