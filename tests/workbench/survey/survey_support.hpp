// SPDX-License-Identifier: Apache-2.0
// Loops in the form of survey.json.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

namespace loopwarden::tests {

inline nlohmann::json survey_loop(const std::string& tag, const std::string& verdict) {
  return {{"tag", tag},
          {"verdict", verdict},
          {"grade", nullptr},
          {"effects", nlohmann::json::array()},
          {"cause", nullptr},
          {"reason", nullptr},
          {"settle", nullptr},
          {"probability", nullptr},
          {"oscillating", false},
          {"period_s", nullptr},
          {"variability", 0.1},
          {"saturated", 0.0},
          {"share_automatic", 1.0},
          {"error_rms", 0.5},
          {"kind", "flow"},
          {"co_range", {0.0, 100.0}},
          {"since", nullptr},
          {"rank", 1},
          {"next", {{"what", "nothing"}, {"why", ""}}},
          {"import", {{"start", "2026-10-01T00:00:00Z"}}},
          {"windows", {{{"from_s", 0.0}, {"to_s", 28800.0}}}}};
}

inline nlohmann::json valve_loop(const std::string& tag, double percent,
                                 const std::string& effect = "stiction",
                                 const std::string& grade = "seen") {
  nlohmann::json loop = survey_loop(tag, "valve_effect");
  loop["grade"] = grade;
  loop["probability"] = 0.95;
  loop["oscillating"] = true;
  loop["period_s"] = 60.0;
  loop["effects"] = {
      {{"name", effect}, {"percent_of_span", percent}, {"alternatives", {"resolution"}}}};
  loop["next"] = {{"what", "repair"}, {"why", ""}};
  return loop;
}

inline nlohmann::json caused_loop(const std::string& tag, const std::string& cause, double error) {
  nlohmann::json loop = survey_loop(tag, "other_cause");
  loop["cause"] = cause;
  loop["error_rms"] = error;
  loop["oscillating"] = true;
  loop["next"] = {{"what", "tune"}, {"why", ""}};
  return loop;
}

inline nlohmann::json survey_of(std::vector<nlohmann::json> loops) {
  return {{"loops", std::move(loops)},
          {"groups", nlohmann::json::array()},
          {"failed", nlohmann::json::array()}};
}

}  // namespace loopwarden::tests
