// SPDX-License-Identifier: Apache-2.0
#include "workbench/survey/worklist.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <tuple>

#include "base/text.hpp"
#include "workbench/survey/outcomes.hpp"
#include "workbench/survey/survey_page.hpp"
#include "workbench/text/csv_text.hpp"

namespace loopwarden::workbench {
namespace {

using nlohmann::json;

constexpr std::size_t kShortText = 40;  // characters; the limit of common maintenance systems

std::optional<Work> work_of(const json& loop) {
  const json& next = loop.at("next").at("what");
  for (const WorkCost& work : Costs{}.works) {
    if (next != work.action) continue;
    // An undecided loop that does not swing needs more data, not a person.
    const bool undecided = work.work == Work::look && loop.at("verdict") != "other_cause" &&
                           loop.at("verdict") != "valve_effect";
    return undecided && !loop.at("oscillating").get<bool>() ? std::nullopt
                                                            : std::optional(work.work);
  }
  return std::nullopt;
}

// Returns the tag of the loop whose order also serves this loop: its source, or its slave.
std::string served_by(const json& loop) {
  if (loop.value("slave_at_fault", json(nullptr)).is_string())
    return loop.at("slave_at_fault").get<std::string>();
  if (loop.at("next").at("what") != "look upstream") return {};
  const json& pushed = loop.at("pushed_by");
  if (loop.at("cause") == "neighbour" && pushed.is_array() && !pushed.empty())
    return pushed[0].get<std::string>();
  if (loop.at("cause") == "master_loop")
    return loop.at("master").is_string() ? loop.at("master").get<std::string>() : std::string();
  const json& source = loop.at("likely_source");
  return source.is_string() && source != loop.at("tag") ? source.get<std::string>() : std::string();
}

double figure_of(const json& loop, const char* key) {
  const json value = loop.value(key, json(nullptr));
  return value.is_number() ? value.get<double>() : 0.0;
}

Range times(Range a, Range b) { return {a.first * b.first, a.second * b.second}; }
Range plus(Range a, Range b) { return {a.first + b.first, a.second + b.second}; }

// Returns the cost per year of a loop as it is now.
Range cost_of(const json& loop, const Costs& costs, const LoopWeights& weights) {
  const double swing = figure_of(loop, "swing_percent");
  Range cost = times(costs.loss_of(loop.at("kind").get<std::string>()), {swing, swing});
  for (const char* key : {"tag", "shown"}) {
    const auto weight = weights.find(loop.at(key).get<std::string>());
    if (weight == weights.end() || !weight->second.cost_per_hour) continue;
    const double known = *weight->second.cost_per_hour * costs.hours_per_year;
    cost = {known, known};
    break;
  }
  const json& range = loop.at("co_range");
  const double span = range[1].get<double>() - range[0].get<double>();
  const double strokes = figure_of(loop, "travel_per_hour") / span * costs.hours_per_year;
  return plus(cost, {strokes * costs.overhaul / costs.strokes.second,
                     strokes * costs.overhaul / costs.strokes.first});
}

double two_digits(double value) {
  if (!(value > 0.0)) return 0.0;
  const double scale = std::pow(10.0, 1.0 - std::floor(std::log10(value)));
  return std::nearbyint(value * scale) / scale;
}

const char* confidence_of(const json& loop, Work work) {
  switch (work) {
    case Work::repair: return "high";
    case Work::test:
    case Work::tune:
    case Work::transmitter: return "medium";
    case Work::upstream:
      // A loop that pushes it is measured. A common period is a coincidence at worst.
      return loop.at("cause") == "neighbour" || loop.at("cause") == "master_loop" ? "medium"
                                                                                  : "low";
    case Work::look: return loop.at("verdict") == "other_cause" ? "medium" : "low";
  }
  return "low";
}

std::string clipped(std::string text) {
  if (text.size() <= kShortText) return text;
  std::size_t end = kShortText - 3;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
  return text.substr(0, end) + "...";
}

std::string capitalised(std::string text) {
  if (!text.empty() && text[0] >= 'a' && text[0] <= 'z') text[0] = static_cast<char>(text[0] - 32);
  return text;
}

struct Effort {
  std::string who;
  bool shutdown = false;
  double minutes = 0.0;
};

// Returns the effort of an order. The class and the duration of the loop's planned test decide, if
// the order is this test.
Effort effort_of(const json& loop, Work work, const Costs& costs) {
  constexpr double kTestDay = 480.0;   // min
  constexpr double kRecording = 60.0;  // min; the hour that deciding_test_text requests
  const WorkCost& cost = costs.of(work);
  Effort effort{cost.who, cost.shutdown, cost.minutes};
  const json test = loop.value("next_test", json(nullptr));
  if (!test.is_object()) {
    effort.shutdown = effort.shutdown || work == Work::test;  // a stroke over the whole travel
    return effort;
  }
  if (loop.at("next").at("why") != test.at("text")) return effort;
  if (test.at("move").is_null()) {
    effort.minutes += kRecording;
  } else if (const json& by = test.at("allowed_by"); by.is_null() || by == "test day") {
    effort.who = costs.of(Work::tune).who;
    effort.minutes = kTestDay;
  } else {
    effort.who = costs.of(by == "operator" ? Work::look : Work::test).who;
    effort.minutes += std::ceil(test.at("duration_s").get<double>() / 60.0);
  }
  return effort;
}

json order_for(const json& loop, Work work, const Costs& costs) {
  const Effort effort = effort_of(loop, work, costs);
  const std::string shown = loop.at("shown").get<std::string>();
  const std::string finding = surveyed_verdict(loop);
  const json& windows = loop.at("windows");
  const std::string action = costs.of(work).action;
  std::string text = capitalised(loop.at("next").at("why").get<std::string>());
  if (!text.ends_with('.')) text += '.';
  return {
      {"id", shown + " " + action},
      {"action", action},
      {"tag", shown},
      {"source_tag", loop.at("tag")},
      {"area", loop.at("area")},
      {"who", effort.who},
      {"shutdown", effort.shutdown},
      {"minutes", effort.minutes},
      {"currency", costs.currency},
      {"confidence", confidence_of(loop, work)},
      {"probability",
       work == Work::repair || work == Work::test ? loop.at("probability") : json(nullptr)},
      {"finding", finding},
      {"short_text", clipped(capitalised(action) + ": " + shown + ", " + finding)},
      {"text", text},
      {"also_steadies", json::array()},
      {"from", windows.empty() ? "" : moment_of(loop, windows.front().at("from_s").get<double>())},
      {"to", windows.empty() ? "" : moment_of(loop, windows.back().at("to_s").get<double>())},
      {"rank", loop.at("rank")}};
}

// Makes the order to look upstream of `loop` one at its source.
void move_to(const json& source, const json& loop, json& order) {
  const auto shown = source.at("shown").get<std::string>();
  order["tag"] = shown;
  order["source_tag"] = source.at("tag");
  order["area"] = source.at("area");
  order["id"] = shown + " " + order.at("action").get<std::string>();
  order["short_text"] = clipped("Look at " + shown + " for " + loop.at("shown").get<std::string>());
  order["also_steadies"].push_back(loop.at("shown"));
}

struct Order {
  json told;
  Range cost;  // per year of all loops that it serves
  Work work;
};

int order_of(const json& confidence) {
  return confidence == "high" ? 0 : confidence == "medium" ? 1 : 2;
}

}  // namespace

json worklist(const json& survey, const Costs& costs, const LoopWeights& weights) {
  std::map<std::string, const json*> by_tag;
  for (const json& loop : survey.at("loops")) by_tag[loop.at("tag").get<std::string>()] = &loop;
  std::map<std::string, Order> orders;  // by the tag of the loop to work on
  for (const json& loop : survey.at("loops")) {
    const auto work = work_of(loop);
    if (work && served_by(loop).empty()) {
      orders[loop.at("tag").get<std::string>()] = {order_for(loop, *work, costs),
                                                   cost_of(loop, costs, weights), *work};
    }
  }
  // Loops that follow another one. A chain ends at the first loop with an order.
  for (const json& loop : survey.at("loops")) {
    if (!work_of(loop) || orders.count(loop.at("tag").get<std::string>()) > 0) continue;
    const std::string source = served_by(loop);
    std::string at = source;
    for (std::size_t steps = 0; orders.count(at) == 0 && steps < by_tag.size(); ++steps) {
      const auto found = by_tag.find(at);
      const std::string further = found == by_tag.end() ? std::string() : served_by(*found->second);
      if (further.empty()) break;
      at = further;
    }
    const Range cost = cost_of(loop, costs, weights);
    const auto order = orders.find(at);
    if (order == orders.end()) {
      // The source has no finding of its own, so the order is to look there.
      Order made{order_for(loop, Work::upstream, costs), cost, Work::upstream};
      const auto place = by_tag.find(source);
      if (place != by_tag.end()) move_to(*place->second, loop, made.told);
      orders[made.told.at("source_tag").get<std::string>()] = std::move(made);
      continue;
    }
    order->second.told["also_steadies"].push_back(loop.at("shown"));
    order->second.cost = plus(order->second.cost, cost);
  }
  std::vector<Order> sorted;
  for (auto& [tag, order] : orders) {
    const Range saving = times(costs.of(order.work).removes, order.cost);
    order.told["saving_low"] = two_digits(saving.first);
    order.told["saving_high"] = two_digits(saving.second);
    sorted.push_back(std::move(order));
  }
  const auto key = [](const Order& order) {
    return std::tuple(
        order_of(order.told.at("confidence")),
        -order.told.at("saving_low").get<double>() - order.told.at("saving_high").get<double>(),
        order.told.at("rank").get<std::size_t>());
  };
  std::stable_sort(sorted.begin(), sorted.end(),
                   [&](const Order& a, const Order& b) { return key(a) < key(b); });
  json list = json::array();
  for (Order& order : sorted) {
    order.told["order"] = list.size() + 1;
    list.push_back(std::move(order.told));
  }
  return list;
}

std::string saving_text(const json& order) {
  return fmt::format("{:.0f} to {:.0f}", order.at("saving_low").get<double>(),
                     order.at("saving_high").get<double>());
}

std::string worklist_csv(const json& orders) {
  constexpr std::array kFields{"order",       "id",          "short_text", "tag",
                               "action",      "who",         "shutdown",   "minutes",
                               "saving_low",  "saving_high", "currency",   "confidence",
                               "probability", "finding",     "text",       "also_steadies",
                               "area",        "source_tag",  "from",       "to"};
  std::string text = fmt::format("{}\n", fmt::join(kFields, ","));
  for (const json& order : orders) {
    std::string line;
    for (const char* column : kFields) {
      const json& value = order.at(column);
      const std::string name = column;
      std::string cell;
      if (name == "from" || name == "to") {
        // One form for all records: no zone, no fraction of a second.
        cell = value.get<std::string>().substr(0, std::strlen("2026-03-01T00:00:00"));
      } else if (name == "probability" && value.is_number()) {
        cell = fmt::format("{:.2f}", value.get<double>());
      } else if (value.is_string()) {
        cell = csv_cell(value.get<std::string>());
      } else if (value.is_boolean()) {
        cell = value.get<bool>() ? "yes" : "no";
      } else if (value.is_array()) {
        cell = csv_cell(fmt::format("{}", fmt::join(value.get<std::vector<std::string>>(), " ")));
      } else if (value.is_number()) {
        cell = fmt::format("{:.6g}", value.get<double>());
      }
      line += (line.empty() ? "" : ",") + cell;
    }
    text += line + "\n";
  }
  return text;
}

json costs_json(const Costs& costs) {
  const auto range = [](Range r) { return json{r.first, r.second}; };
  json told = {{"source", costs.source},
               {"currency", costs.currency},
               {"hours_per_year", costs.hours_per_year},
               {"loss", json::object()},
               {"valve", {{"overhaul", costs.overhaul}, {"strokes", range(costs.strokes)}}},
               {"work", json::object()}};
  for (const KindCost& kind : costs.kinds) told["loss"][kind.kind] = range(kind.loss);
  for (const WorkCost& work : costs.works) {
    told["work"][work.key] = {{"who", work.who},
                              {"shutdown", work.shutdown},
                              {"minutes", work.minutes},
                              {"removes", range(work.removes)}};
  }
  return told;
}

}  // namespace loopwarden::workbench
