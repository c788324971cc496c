// SPDX-License-Identifier: Apache-2.0
#include "workbench/survey/changes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <tuple>
#include <vector>

#include "base/file.hpp"
#include "base/text.hpp"
#include "record/import/number_text.hpp"
#include "workbench/files/command_error.hpp"
#include "workbench/survey/outcomes.hpp"
#include "workbench/survey/survey_page.hpp"
#include "workbench/text/csv_text.hpp"
#include "workbench/text/letters.hpp"

namespace loopwarden::workbench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::string_view kTagSeparators = "-/\\._: ";

std::string text_in(const fs::path& path) {
  std::optional<std::string> text = base::read_file(path);
  if (!text) {
    throw CommandError(
        kExitIo, fmt::format("{}: can't be read: {}", path.string(), base::error_text(errno)));
  }
  return std::move(*text);
}

// Returns the rank of a criticality; nullopt if the text is not a criticality.
std::optional<double> order_of(const std::string& text) {
  const std::string word = base::lower_case(text);
  if (const auto number = record::parse_number(word, '.')) return number;
  if (word.size() == 1 && word[0] >= 'a' && word[0] <= 'z') return word[0] - 'a' + 1.0;
  if (word == "high") return 1.0;
  if (word == "medium") return 2.0;
  if (word == "low") return 3.0;
  return std::nullopt;
}

bool is_capital(char c) noexcept { return c >= 'A' && c <= 'Z'; }

// Returns the position of the function letters, the last of several.
std::optional<std::pair<std::size_t, std::size_t>> function_letters(std::string_view tag) {
  constexpr std::size_t kFewest = 2;
  constexpr std::size_t kMost = 5;
  std::optional<std::pair<std::size_t, std::size_t>> found;
  for (std::size_t from = 0; from < tag.size();) {
    std::size_t to = from;
    while (to < tag.size() && is_capital(tag[to])) ++to;
    const std::string_view letters = tag.substr(from, to - from);
    if (letters.size() >= kFewest && letters.size() <= kMost &&
        letters.find('C', 1) != letters.npos)
      found.emplace(from, to);
    from = std::max(to, from + 1);
  }
  return found;
}

std::string_view without_separators(std::string_view text) {
  while (!text.empty() && kTagSeparators.find(text.front()) != text.npos) text.remove_prefix(1);
  while (!text.empty() && kTagSeparators.find(text.back()) != text.npos) text.remove_suffix(1);
  return text;
}

std::string default_area(std::string_view tag) {
  const auto letters = function_letters(tag);
  if (!letters) {
    const auto end =
        std::find_if(tag.begin(), tag.end(), [](char c) { return c == '-' || is_digit(c); });
    return std::string(
        without_separators(tag.substr(0, static_cast<std::size_t>(end - tag.begin()))));
  }
  const std::string_view before = without_separators(tag.substr(0, letters->first));
  if (!before.empty()) return std::string(before);
  const std::string_view behind = without_separators(tag.substr(letters->second));
  std::size_t digits = 0;
  while (digits < behind.size() && is_digit(behind[digits])) ++digits;
  constexpr std::size_t kWithinArea = 2;
  return std::string(behind.substr(0, digits > kWithinArea ? digits - kWithinArea : 0));
}

// A survey's finding at a loop: a valve effect, or another cause.
struct Finding {
  std::string what;  // "valve", or the cause
  double size = 0.0;
};

std::optional<Finding> finding_of(const json& loop) {
  if (loop.value("held_back", false)) return std::nullopt;
  if (loop.at("verdict") == "valve_effect")
    return Finding{"valve", loop.at("effects").at(0).at("percent_of_span").get<double>()};
  if (loop.at("verdict") != "other_cause") return std::nullopt;
  const json error = loop.value("error_rms", json(nullptr));
  return Finding{loop.at("cause").get<std::string>(),
                 error.is_number() ? error.get<double>() : 0.0};
}

// Returns the change of a loop; empty if there is no change to report.
std::string change_of(const json* now, const json* before) {
  const auto is = now == nullptr ? std::nullopt : finding_of(*now);
  const auto was = before == nullptr ? std::nullopt : finding_of(*before);
  if (!is) {
    if (!was) return {};
    if (now == nullptr) return "unknown";
    if (now->value("held_back", false)) return "rejected";
    return now->at("verdict") == "healthy" ? "gone" : "unknown";
  }
  if (!was || was->what != is->what) return "new";
  if (is->size >= kGrown * was->size && is->size > 0.0) return "worse";
  return kGrown * is->size <= was->size && was->size > 0.0 ? "better" : "same";
}

// Returns the first and the last judged moment, by the exports' clocks.
json span_of(const json& survey) {
  std::string from;
  std::string to;
  for (const json& loop : survey.at("loops")) {
    const json& windows = loop.at("windows");
    if (windows.empty() || !loop.at("import").at("start").is_string()) continue;
    const std::string begin = moment_of(loop, windows.front().at("from_s").get<double>());
    const std::string end = moment_of(loop, windows.back().at("to_s").get<double>());
    if (from.empty() || begin < from) from = begin;
    to = std::max(to, end);
  }
  return {{"from", from}, {"to", to}};
}

using ByTag = std::map<std::string, const json*>;
ByTag by_tag(const json& survey) {
  ByTag loops;
  for (const json& loop : survey.at("loops")) loops[loop.at("tag").get<std::string>()] = &loop;
  return loops;
}

const json* at(const ByTag& loops, const std::string& tag) {
  const auto found = loops.find(tag);
  return found == loops.end() ? nullptr : found->second;
}

// A loop with the keys of the sort order, which are removed afterwards.
struct ChangedLoop {
  std::size_t change;  // of kChanges
  double order;
  double cost;
  std::size_t rank;
  std::string tag;
  json told;
};

ChangedLoop changed_loop(const std::string& tag, std::size_t change, const json* now,
                         const json* before, const std::string& area, const Comparing& how) {
  const auto weight = how.weights.find(tag);
  const bool known = weight != how.weights.end();
  double cost = 0.0;
  json shown_cost;  // null if unknown
  if (known && weight->second.cost_per_hour) {
    cost = *weight->second.cost_per_hour;
    shown_cost = cost;
  }
  const auto words = [](const json* loop) {
    return loop == nullptr ? "" : surveyed_verdict(*loop);
  };
  json told = {{"tag", tag},
               {"change", kChanges[change].key},
               {"area", area},
               {"criticality", known ? weight->second.criticality : ""},
               {"cost_per_hour", shown_cost},
               {"now", words(now)},
               {"before", words(before)},
               {"grade", now == nullptr ? json(nullptr) : now->at("grade")},
               {"since", now == nullptr ? json(nullptr) : now->at("since")},
               {"next", now == nullptr ? json(nullptr) : now->at("next").at("what")},
               {"found", nullptr}};
  const json outcome = (now != nullptr ? *now : *before).value("outcome", json(nullptr));
  if (!outcome.is_null()) told["found"] = outcome.at("found");
  return {
      change, known ? weight->second.order : LoopWeight{}.order,
      cost,   now == nullptr ? static_cast<std::size_t>(-1) : now->at("rank").get<std::size_t>(),
      tag,    std::move(told)};
}

}  // namespace

LoopWeights read_loop_weights(const fs::path& path) {
  constexpr std::size_t kTag = 0;
  constexpr std::size_t kCriticality = 1;
  constexpr std::size_t kCost = 2;
  const CsvTable table =
      read_csv(path.string(), text_in(path), {{"tag", true}, {"criticality"}, {"cost_per_hour"}});
  LoopWeights weights;
  for (const CsvRow& row : table.rows) {
    LoopWeight weight{.criticality = row.cells[kCriticality], .line = row.line};
    if (row.cells[kTag].empty()) table.fail_at(row, kTag, "no tag");
    if (!weight.criticality.empty()) {
      const auto order = order_of(weight.criticality);
      if (!order) {
        table.fail_at(
            row, kCriticality,
            fmt::format("criticality is a number, a letter, or high, medium, low (got {})",
                        base::in_quotes(weight.criticality)));
      }
      weight.order = *order;
    }
    if (!row.cells[kCost].empty()) {
      weight.cost_per_hour = record::parse_number(row.cells[kCost], table.decimal);
      if (!weight.cost_per_hour || *weight.cost_per_hour < 0.0) {
        table.fail_at(row, kCost,
                      fmt::format("cost_per_hour is a number, at least 0 (got {})",
                                  base::in_quotes(row.cells[kCost])));
      }
    }
    const auto [first, is_new] = weights.try_emplace(row.cells[kTag], weight);
    if (!is_new) {
      table.fail_at(row, kTag,
                    fmt::format("{} is in line {} already", base::in_quotes(row.cells[kTag]),
                                first->second.line));
    }
  }
  return weights;
}

std::string area_of(std::string_view tag, const std::optional<record::TagPattern>& pattern) {
  std::string area;
  if (!pattern) {
    area = default_area(tag);
  } else if (const auto found = pattern->match(tag); found && !found->empty()) {
    area = found->front();
  }
  return area.empty() ? "-" : area;
}

json read_survey(const fs::path& path) {
  std::error_code none;
  const fs::path file = fs::is_directory(path, none) ? path / "survey.json" : path;
  json survey = json::parse(text_in(file), nullptr, false);
  const auto is_loop = [](const json& loop) {
    const auto has = [&](const char* key, auto is) {
      return loop.contains(key) && (loop.at(key).*is)();
    };
    return loop.is_object() && has("tag", &json::is_string) && has("verdict", &json::is_string) &&
           has("effects", &json::is_array) && has("windows", &json::is_array) &&
           has("import", &json::is_object) && has("next", &json::is_object);
  };
  const bool right = survey.is_object() && survey.contains("loops") && survey["loops"].is_array() &&
                     std::all_of(survey["loops"].begin(), survey["loops"].end(), is_loop);
  if (!right) throw CommandError(kExitData, fmt::format("{}: is no survey.json", file.string()));
  return survey;
}

json compare_surveys(const json& now, const json& before, const Comparing& how) {
  const ByTag is = by_tag(now);
  const ByTag was = by_tag(before);
  std::map<std::string, const json*> all = was;
  for (const auto& [tag, loop] : is) all[tag] = loop;
  std::map<std::string, json> areas;
  std::vector<ChangedLoop> changed;
  json counts = json::object();
  for (const Change& change : kChanges) counts[change.key] = 0;
  const auto count = [](json& in, const char* key) { in[key] = in.value(key, 0) + 1; };
  for (const auto& [tag, any] : all) {
    const json* of_now = at(is, tag);
    const json* of_before = at(was, tag);
    const json named = any->value("area", json(nullptr));
    const std::string area =
        !how.area && named.is_string() ? named.get<std::string>() : area_of(tag, how.area);
    const auto [in_area, is_new] = areas.try_emplace(area, json::object());
    json& sums = in_area->second;
    if (is_new) sums = {{"area", area}, {"loops", 0}, {"findings", 0}, {"cost_per_hour", 0.0}};
    if (of_now != nullptr) count(sums, "loops");
    const std::string change = change_of(of_now, of_before);
    if (change.empty()) continue;
    const auto which = std::find_if(kChanges.begin(), kChanges.end(),
                                    [&](const Change& c) { return change == c.key; });
    count(counts, which->key);
    count(sums, which->key);
    changed.push_back(changed_loop(tag, static_cast<std::size_t>(which - kChanges.begin()), of_now,
                                   of_before, area, how));
    if (of_now == nullptr || !finding_of(*of_now)) continue;
    count(sums, "findings");
    sums["cost_per_hour"] = sums["cost_per_hour"].get<double>() + changed.back().cost;
  }
  std::sort(changed.begin(), changed.end(), [](const ChangedLoop& a, const ChangedLoop& b) {
    return std::tuple(a.change, a.order, -a.cost, a.rank, a.tag) <
           std::tuple(b.change, b.order, -b.cost, b.rank, b.tag);
  });
  json out = {{"now", span_of(now)},
              {"before", span_of(before)},
              {"counts", counts},
              {"areas", json::array()},
              {"loops", json::array()},
              {"not_in_survey", json::array()},
              {"weighted", !how.weights.empty()}};
  for (ChangedLoop& loop : changed) out["loops"].push_back(std::move(loop.told));
  for (auto& [area, sums] : areas) {
    for (const Change& change : kChanges) sums[change.key] = sums.value(change.key, 0);
    out["areas"].push_back(std::move(sums));
  }
  for (const auto& [tag, weight] : how.weights) {
    if (all.count(tag) == 0) out["not_in_survey"].push_back(tag);
  }
  return out;
}

}  // namespace loopwarden::workbench
