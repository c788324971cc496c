// SPDX-License-Identifier: Apache-2.0
#include "workbench/survey/join.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <array>

#include "model/diagnosis/group.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/survey/neighbours.hpp"
#include "workbench/text/csv_text.hpp"

namespace loopwarden::workbench {
namespace {

using nlohmann::json;

double number(const json& loop, const char* key, double otherwise = 0.0) {
  const auto at = loop.find(key);
  return at == loop.end() || !at->is_number() ? otherwise : at->get<double>();
}

bool is(const json& loop, const char* key, const char* word) {
  const auto at = loop.find(key);
  return at != loop.end() && at->is_string() && at->get<std::string>() == word;
}

double valve_probability(const json& loop) {
  return is(loop, "verdict", "valve_effect") ? number(loop, "probability") : 0.0;
}

double score_of(const json& loop) {
  const bool swings = loop.at("oscillating").get<bool>() && !is(loop, "verdict", "valve_effect");
  const double valve = loop.at("held_back").get<bool>() ? 0.0 : 60.0 * valve_probability(loop);
  return valve + (swings ? 20.0 : 0.0) + 15.0 * number(loop, "variability") +
         10.0 * number(loop, "saturated") + 10.0 * (1.0 - number(loop, "share_automatic", 1.0));
}

// Returns the rank in the list: seen 2, likely 1, all others 0. A finding that is suppressed has
// rank 0.
int step_of(const json& loop) {
  if (!is(loop, "verdict", "valve_effect") || loop.at("held_back").get<bool>()) return 0;
  return is(loop, "grade", "seen") ? 2 : 1;
}

std::string cell_of(const json& value) {
  if (value.is_null()) return {};
  if (value.is_boolean()) return value.get<bool>() ? "1" : "0";
  if (value.is_array())
    return csv_cell(fmt::format("{}", fmt::join(value.get<std::vector<std::string>>(), " ")));
  return value.is_string() ? csv_cell(value.get<std::string>()) : value.dump();
}

// Returns the day of an answer, such as "2026-11-20".
std::string day_of(const json& outcome) {
  return outcome.at("answered").get<std::string>().substr(0, 10);
}

}  // namespace

NextStep next_step(const json& loop) {
  if (loop.at("held_back").get<bool>()) {
    return {"nothing",
            fmt::format("a technician found no fault on {} at {:.2g} %: suppressed until the size "
                        "has grown by half",
                        day_of(loop["outcome"]), loop["outcome"]["percent_of_span"].get<double>())};
  }
  if (is(loop, "verdict", "valve_effect") && is(loop, "grade", "likely")) {
    const json test = loop.value("next_test", json());  // null: no response of PV was found
    return {"test the valve", test.is_object() ? test.at("text").get<std::string>()
                                               : "PV hardly answers to CO: stroke the valve"};
  }
  if (is(loop, "verdict", "valve_effect")) {
    return {"repair",
            "look at packing, actuator and positioner of the valve; until then a compensator or a "
            "wider dead band reduces the cycling"};
  }
  const bool follows = loop.contains("likely_source") && loop["likely_source"].is_string() &&
                       loop["likely_source"] != loop.at("tag");
  if (is(loop, "verdict", "other_cause")) {
    if (is(loop, "cause", "tuning")) {
      return {
          "tune",
          "the loop oscillates by itself and the valve follows: identify it, then tune it slower"};
    }
    if (is(loop, "cause", "saturation")) {
      return {
          "look closer",
          "CO is at its limit, or is constant while PV is far from SP: look for a valve too "
          "small, a set point out of reach, a closed hand valve, or a controller that is stopped "
          "or in manual"};
    }
    if (is(loop, "cause", "sensor")) {
      return {"look closer", "PV is constant while CO moves: look at the transmitter"};
    }
    if (is(loop, "cause", "no_flow")) {
      return {"look closer",
              "no flow while CO moves: look for a closed hand valve or a stopped pump"};
    }
    if (is(loop, "cause", "neighbour")) {
      return {"look upstream",
              loop["pushed_by"].at(0).get<std::string>() + " pushes it: look there first"};
    }
    if (is(loop, "cause", "master_loop")) {
      return {"look upstream", "it follows its set point: look at the loop that writes it"};
    }
    return {"look upstream",
            follows ? "it oscillates with " + loop["likely_source"].get<std::string>() +
                          ": look there first"
                    : "an external oscillation drives it: look for a loop with the same period"};
  }
  if (is(loop, "verdict", "healthy")) return {"nothing", "valve and loop are healthy"};
  return {"look closer", loop.at("settle").is_string() ? loop["settle"].get<std::string>()
                                                       : "more data of the loop in automatic"};
}

json join_survey(std::vector<json> loops, json failed, const std::vector<FitterAnswer>& outcomes) {
  std::sort(loops.begin(), loops.end(),
            [](const json& a, const json& b) { return a.at("tag") < b.at("tag"); });
  name_neighbours(loops, threads(0));
  tell_outcomes(loops, outcomes);
  std::vector<diagnosis::Swinging> swinging;
  for (std::size_t k = 0; k < loops.size(); ++k) {
    const json& loop = loops[k];
    if (!loop.at("oscillating").get<bool>() || !(number(loop, "period_s") > 0.0)) continue;
    swinging.push_back({.loop = k,
                        .tag = loop.at("tag").get<std::string>(),
                        .period_s = number(loop, "period_s"),
                        .valve_probability = valve_probability(loop),
                        .nonlinearity = number(loop, "nonlinearity")});
  }
  json groups = json::array();
  for (json& loop : loops) {
    loop["group"] = nullptr;
    loop["likely_source"] = nullptr;
  }
  for (const diagnosis::Group& group : diagnosis::find_groups(swinging)) {
    json members = json::array();
    const std::string& source = loops[group.loops.front()].at("tag").get_ref<const std::string&>();
    for (const std::size_t k : group.loops) {
      loops[k]["group"] = groups.size() + 1;
      loops[k]["likely_source"] = source;
      members.push_back(loops[k].at("tag"));
    }
    groups.push_back(
        {{"group", groups.size() + 1}, {"period_s", group.period_s}, {"loops", members}});
  }
  std::stable_sort(loops.begin(), loops.end(), [](const json& a, const json& b) {
    return std::pair(step_of(a), score_of(a)) > std::pair(step_of(b), score_of(b));
  });
  for (std::size_t k = 0; k < loops.size(); ++k) {
    loops[k]["rank"] = k + 1;
    loops[k]["score"] = std::nearbyint(score_of(loops[k]) * 10.0) / 10.0;
    const NextStep next = next_step(loops[k]);
    loops[k]["next"] = {{"what", next.what}, {"why", next.why}};
  }
  std::sort(failed.begin(), failed.end(),
            [](const json& a, const json& b) { return a.dump() < b.dump(); });
  failed.erase(std::unique(failed.begin(), failed.end()), failed.end());
  return {{"loops", loops},
          {"groups", groups},
          {"failed", failed},
          {"outcomes", precision_json(outcomes)}};
}

std::string survey_csv(const json& survey) {
  constexpr std::array kColumns{"rank",
                                "tag",
                                "score",
                                "verdict",
                                "cause",
                                "probability",
                                "oscillating",
                                "period_s",
                                "group",
                                "likely_source",
                                "pushed_by",
                                "share_automatic",
                                "saturated",
                                "variability",
                                "dead_time_s",
                                "error_rms",
                                "crossings_per_hour",
                                "travel_per_hour",
                                "reversals_per_hour",
                                "noise",
                                "nonlinearity",
                                "since",
                                "reason"};
  std::string text;
  for (const char* column : kColumns) text += std::string(column) + ",";
  text += "effect,percent_of_span,next,found,held_back\n";
  for (const json& loop : survey.at("loops")) {
    for (const char* column : kColumns) text += cell_of(loop.value(column, json(nullptr))) + ",";
    const json& effects = loop.at("effects");
    text += effects.empty()
                ? ","
                : cell_of(effects[0].at("name")) + "," + cell_of(effects[0].at("percent_of_span"));
    const json& outcome = loop.at("outcome");
    text += "," + cell_of(loop.at("next").at("what")) + "," +
            cell_of(outcome.is_null() ? outcome : outcome.at("found")) + "," +
            cell_of(loop.at("held_back")) + "\n";
  }
  return text;
}

}  // namespace loopwarden::workbench
