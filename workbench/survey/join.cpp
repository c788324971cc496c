// SPDX-License-Identifier: Apache-2.0
#include "workbench/survey/join.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <array>

#include "model/diagnosis/group.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/survey/neighbours.hpp"
#include "workbench/survey/site_names.hpp"
#include "workbench/survey/survey_page.hpp"
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

bool is_copy(const json& loop) { return loop.at("duplicate_of").is_string(); }

double score_of(const json& loop) {
  const bool swings = loop.at("oscillating").get<bool>() && !is(loop, "verdict", "valve_effect");
  const double valve = loop.at("held_back").get<bool>() ? 0.0 : 60.0 * valve_probability(loop);
  return valve + (swings ? 20.0 : 0.0) + 15.0 * number(loop, "variability") +
         10.0 * number(loop, "saturated") + 10.0 * (1.0 - number(loop, "share_automatic", 1.0));
}

// Returns the rank in the list: seen 2, likely 1, healthy -1, a copy -2, all others 0. A finding
// that is suppressed has rank 0.
int step_of(const json& loop) {
  if (is_copy(loop)) return -2;
  if (is(loop, "verdict", "healthy")) return -1;
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

using ShownByTag = std::map<std::string, std::string>;

// Returns the shown tag of the loop that a key of `loop` names, or the first one of several.
std::string shown_of(const json& loop, const char* key, const ShownByTag& shown) {
  const json& value = loop.at(key);
  const std::string tag = (value.is_array() ? value.at(0) : value).get<std::string>();
  const auto at = shown.find(tag);
  return at == shown.end() ? tag : at->second;
}

// Returns the first loop of the group that shares a unit with loop `k`; null if there is none.
json likely_source(const std::vector<json>& loops, const std::vector<std::size_t>& group,
                   std::size_t k) {
  bool shared = false;
  json source;
  for (const std::size_t other : group) {
    if (other != k && !share_a_unit(loops[k], loops[other])) continue;
    if (source.is_null()) source = loops[other].at("tag");
    shared = shared || other != k;
  }
  return shared ? source : json(nullptr);
}

// Replaces the text of `master` by the loop's tag, and marks the masters whose slave has a valve
// fault: they are not tuned, because the slave's valve makes them oscillate.
void name_cascades(std::vector<json>& loops) {
  for (json& slave : loops) {
    if (!slave.at("master").is_string()) continue;
    const auto master = std::find_if(loops.begin(), loops.end(), [&](const json& loop) {
      return loop.at("tag") == slave.at("master") || loop.at("shown") == slave.at("master");
    });
    if (master == loops.end()) continue;
    slave["master"] = master->at("tag");
    const bool troubled =
        is(*master, "verdict", "other_cause") ||
        (is(*master, "verdict", "cant_tell") && master->at("oscillating").get<bool>());
    if (troubled && is(slave, "verdict", "valve_effect") && !slave.at("held_back").get<bool>())
      (*master)["slave_at_fault"] = slave.at("tag");
  }
}

// Returns the day of an answer, such as "2026-11-20".
std::string day_of(const json& outcome) {
  return outcome.at("answered").get<std::string>().substr(0, 10);
}

struct FirstChecks {
  const char* effect;
  const char* parts;
};
// The effects that a verdict names. docs/explanation/valve-faults.md has the same checks.
constexpr std::array kFirstChecks{FirstChecks{"stiction", "packing and actuator size"},
                                  FirstChecks{"backlash", "linkage and stem connection"}};

std::string repair_text(const json& loop) {
  const json& effect = loop.at("effects").at(0).at("name");
  const auto* checks = std::find_if(kFirstChecks.begin(), kFirstChecks.end(),
                                    [&](const FirstChecks& one) { return effect == one.effect; });
  return fmt::format(
      "check {} first; until the repair a compensator or a wider dead band reduces the cycling",
      checks == kFirstChecks.end() ? "the valve" : checks->parts);
}

// The next step with an explanation.
struct NextStep {
  std::string what;
  std::string why;
};

NextStep next_step(const json& loop, const ShownByTag& shown) {
  const auto named = [&](const char* key) { return shown_of(loop, key, shown); };
  if (is_copy(loop)) return {"nothing", "the same record as " + named("duplicate_of")};
  if (loop.at("held_back").get<bool>()) {
    return {"nothing",
            fmt::format("a technician found no fault on {} at {:.2g} %: suppressed until the size "
                        "has grown by half",
                        day_of(loop["outcome"]), loop["outcome"]["percent_of_span"].get<double>())};
  }
  if (is(loop, "verdict", "valve_effect") && is(loop, "grade", "likely")) {
    const json test = loop.value("next_test", json());  // null: no response of PV was found
    if (!test.is_object()) return {"test the valve", "PV hardly answers to CO: stroke the valve"};
    return {test.at("move").is_null() ? "look closer" : "test the valve",
            test.at("text").get<std::string>()};
  }
  if (is(loop, "verdict", "valve_effect")) {
    return {"repair", repair_text(loop)};
  }
  if (loop.value("slave_at_fault", json(nullptr)).is_string()) {
    return {"look upstream", "its slave " + named("slave_at_fault") +
                                 " has a valve fault: repair that valve before you tune this loop"};
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
      return {"check the transmitter", "PV is constant while CO moves: look at the transmitter"};
    }
    if (is(loop, "cause", "no_flow")) {
      return {"look closer",
              "no flow while CO moves: look for a closed hand valve or a stopped pump"};
    }
    if (is(loop, "cause", "neighbour")) {
      return {"look upstream", named("pushed_by") + " pushes it: look there first"};
    }
    if (is(loop, "cause", "master_loop")) {
      return {"look upstream",
              loop["master"].is_string()
                  ? "it follows its set point: look at its master " + named("master")
                  : "it follows its set point: look at the loop that writes it"};
    }
    return {"look upstream",
            follows
                ? "it oscillates with " + named("likely_source") + ": look there first"
                : "an external oscillation drives it: look for a loop with the same period" +
                      (number(loop, "period_s") > 0.0 ? ", " + period_text(number(loop, "period_s"))
                                                      : std::string())};
  }
  if (is(loop, "verdict", "healthy")) return {"nothing", "valve and loop are healthy"};
  return {"look closer", loop.at("settle").is_string() ? loop["settle"].get<std::string>()
                                                       : "more data of the loop in automatic"};
}

}  // namespace

json join_survey(std::vector<json> loops, json failed, const std::vector<FitterAnswer>& outcomes,
                 const SiteSettings& site) {
  std::sort(loops.begin(), loops.end(),
            [](const json& a, const json& b) { return a.at("tag") < b.at("tag"); });
  name_loops(loops, site.tags, site.area);
  name_neighbours(loops, threads(0));
  tell_outcomes(loops, outcomes);
  name_cascades(loops);
  std::vector<diagnosis::Swinging> swinging;
  for (std::size_t k = 0; k < loops.size(); ++k) {
    const json& loop = loops[k];
    if (is_copy(loop) || !loop.at("oscillating").get<bool>() || !(number(loop, "period_s") > 0.0))
      continue;
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
    bool ordered = true;
    for (const std::size_t k : group.loops) {
      loops[k]["group"] = groups.size() + 1;
      loops[k]["likely_source"] = likely_source(loops, group.loops, k);
      ordered = ordered && loops[k]["likely_source"] == loops[group.loops.front()]["tag"];
      members.push_back(loops[k].at("tag"));
    }
    groups.push_back({{"group", groups.size() + 1},
                      {"period_s", group.period_s},
                      {"loops", members},
                      {"ordered", ordered}});
  }
  ShownByTag shown;
  for (const json& loop : loops)
    shown[loop.at("tag").get<std::string>()] = loop.at("shown").get<std::string>();
  std::stable_sort(loops.begin(), loops.end(), [](const json& a, const json& b) {
    return std::pair(step_of(a), score_of(a)) > std::pair(step_of(b), score_of(b));
  });
  for (std::size_t k = 0; k < loops.size(); ++k) {
    loops[k]["rank"] = k + 1;
    loops[k]["score"] = std::nearbyint(score_of(loops[k]) * 10.0) / 10.0;
    const NextStep next = next_step(loops[k], shown);
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
                                "shown",
                                "area",
                                "score",
                                "verdict",
                                "cause",
                                "probability",
                                "oscillating",
                                "period_s",
                                "group",
                                "likely_source",
                                "duplicate_of",
                                "pushed_by",
                                "share_automatic",
                                "saturated",
                                "variability",
                                "dead_time_s",
                                "error_rms",
                                "crossings_per_hour",
                                "travel_per_hour",
                                "reversals_per_hour",
                                "swing_percent",
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
