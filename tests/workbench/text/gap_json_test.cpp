// SPDX-License-Identifier: Apache-2.0
#include "workbench/text/gap_json.hpp"

#include <catch2/catch.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/workbench/report/gap_result_support.hpp"

namespace loopwarden::tests::gap_json_test {
namespace {

using nlohmann::json;
using workbench::gap_json;

TEST_CASE("gap.json contains the fields of its contract", "[gap][json]") {
  const json j = gap_json(complete_gap_result());
  CHECK(j.at("verdict") == "missing_effect");
  CHECK(j.at("corrected_model") == "model.corrected.yaml");
  CHECK(j.at("effects") ==
        json::array(
            {{{"name", "stiction"},
              {"block", "valve"},
              {"parameters", {{"s", 0.9}, {"j", 0.3}}},
              {"confidence", 0.97},
              {"lead_nats", 31.5},
              {"alternatives", {"backlash"}},
              {"interval", {{"s", json::array({0.88, 0.95})}, {"j", json::array({0.25, 0.36})}}},
              {"evidence", "The stem rests after each of 41 reversals."}}}));
  const json& gap = j.at("gap");
  CHECK(gap.at("noise_floor_rmse") == Approx(0.013));
  CHECK(gap.at("floor").at("transmitter_rmse") == 0.012);
  CHECK(gap.at("floor").at("load_rmse") == 0.005);
  CHECK(gap.at("floor").at("load_tested") == true);
  CHECK(gap.at("before").at("rmse") == 0.31);
  CHECK(gap.at("before").at("fit_percent") == 61.0);
  CHECK(gap.at("before").at("holdout_rmse") == 0.33);
  CHECK(gap.at("before").at("holdout_fit_percent") == 58.0);
  CHECK(gap.at("after").at("holdout_rmse") == 0.021);
  CHECK(gap.at("controller_before_rmse") == 0.01);
  CHECK(gap.at("controller_after_rmse") == 0.009);
  CHECK(gap.at("steps").at(1) ==
        json({{"added", "stiction"}, {"rmse", 0.018}, {"holdout_rmse", 0.021}}));
  CHECK(j.at("posterior").at(1) ==
        json({{"effects", json::array({"backlash"})}, {"probability", 0.02}}));
  CHECK(j.at("next_test").is_null());
  CHECK(j.at("remainder") == json({{"rmse", 0.021},
                                   {"share", 0.03},
                                   {"looks_like", "the valve"},
                                   {"depends_on", {"sp", "co"}}}));
  CHECK(j.at("located").at(2) == json({{"by", "time"},
                                       {"block", "valve"},
                                       {"what", "20 to 30 s"},
                                       {"from_s", 20.0},
                                       {"to_s", 30.0},
                                       {"share_of_gap", 0.4}}));
  CHECK(j.at("candidates").at(0).at("name") == "backlash");
  CHECK(j.at("candidates").at(0).at("rmse") == 0.05);
  CHECK(j.at("candidates").at(0).at("why_not") == "leaves the jumps");
  CHECK(j.at("record").at("notes").at(0).at("from_s") == 7.0);
  CHECK(j.at("gap").at("load_intensity") == 0.004);
  CHECK(gap.at("rest") == json({{"is_noise", false}, {"closed", 0.98}, {"quiet_rmse", 0.014}}));
}

TEST_CASE("shares add up as in the result", "[gap][json]") {
  const json j = gap_json(complete_gap_result());
  std::map<std::string, double> sums;
  for (const json& located : j.at("located")) {
    sums[located.at("by")] += located.at("share_of_gap").get<double>();
  }
  CHECK(sums.size() == 3);
  for (const auto& [by, sum] : sums) CHECK(sum == Approx(1.0));
}

TEST_CASE("a value that is not finite is null", "[gap][json]") {
  gap::Result result = complete_gap_result();
  result.before.fit_percent = gap::kNone;
  result.after.holdout_rmse = std::numeric_limits<double>::infinity();
  result.effects[0].interval["s"] = {gap::kNone, 1.0};
  const json j = gap_json(result);
  CHECK(j.at("gap").at("before").at("fit_percent").is_null());
  CHECK(j.at("gap").at("after").at("holdout_rmse").is_null());
  CHECK(j.at("effects").at(0).at("interval").at("s").at(0).is_null());
  CHECK(j.at("candidates").at(2).at("rmse").is_null());
  CHECK(j.at("record").at("notes").at(1).at("from_s").is_null());
  CHECK(json::parse(j.dump()) == j);
}

TEST_CASE("an empty result keeps every list", "[gap][json]") {
  const json j = gap_json(gap::Result{});
  CHECK(j.at("verdict") == "no_gap");
  CHECK(j.at("effects") == json::array());
  CHECK(j.at("posterior") == json::array());
  CHECK(j.at("located") == json::array());
  CHECK(j.at("candidates") == json::array());
  CHECK(j.at("remainder").is_null());
  CHECK(j.at("gap").at("steps") == json::array());
  CHECK(j.at("gap").at("controller_before_rmse").is_null());
}

TEST_CASE("a characteristic is one parameter, as in a model file", "[gap][json]") {
  gap::Result result = complete_gap_result();
  effects::EffectSpec& spec = result.effects[0].spec;
  spec = {.name = "valve_characteristic",
          .parameters = {{"rangeability", 30.0}},
          .options = {{"curve", "equal_percentage"}}};
  CHECK(gap_json(result).at("effects").at(0).at("parameters") ==
        json({{"curve", {{"name", "equal_percentage"}, {"rangeability", 30.0}}}}));
  spec = {.name = "valve_characteristic",
          .options = {{"curve", "table"}},
          .table = {{0.0, 0.0}, {10.0, 8.0}}};
  CHECK(gap_json(result).at("effects").at(0).at("parameters") ==
        json({{"table", json::array({json::array({0.0, 0.0}), json::array({10.0, 8.0})})}}));
}

}  // namespace
}  // namespace loopwarden::tests::gap_json_test
