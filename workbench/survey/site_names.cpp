// SPDX-License-Identifier: Apache-2.0
#include "workbench/survey/site_names.hpp"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "base/text.hpp"
#include "record/import/time_text.hpp"
#include "workbench/survey/changes.hpp"
#include "workbench/text/letters.hpp"

namespace loopwarden::workbench {
namespace {

using nlohmann::json;

constexpr std::string_view kBetween = "/\\:.]";

bool is_figure(char c) noexcept { return c >= '0' && c <= '9'; }

// Returns whether the part has the function letters of a controller and a number.
bool is_instrument(std::string_view part) {
  for (std::size_t from = 0; from < part.size();) {
    std::size_t to = from;
    while (to < part.size() && is_letter(part[to])) ++to;
    const std::string letters = base::lower_case(part.substr(from, to - from));
    const bool number =
        std::any_of(part.begin() + static_cast<std::ptrdiff_t>(to), part.end(), is_figure);
    constexpr std::size_t kMost = 5;
    if (letters.size() >= 2 && letters.size() <= kMost && letters.find('c', 1) != letters.npos &&
        number)
      return true;
    from = std::max(to, from + 1);
  }
  return false;
}

// Returns the position and length of the instrument's name in the tag.
std::optional<std::pair<std::size_t, std::size_t>> instrument_at(std::string_view tag) {
  std::optional<std::pair<std::size_t, std::size_t>> found;
  for (std::size_t from = 0; from <= tag.size();) {
    const std::size_t to = std::min(tag.find_first_of(kBetween, from), tag.size());
    if (is_instrument(tag.substr(from, to - from))) found.emplace(from, to - from);
    from = to + 1;
  }
  return found;
}

// Returns the folders before the instrument's name without a server in brackets.
std::string folders_of(std::string_view tag) {
  const auto at = instrument_at(tag);
  if (!at) return {};
  std::string_view before = tag.substr(0, at->first);
  if (before.starts_with("[")) before.remove_prefix(std::min(before.find(']') + 1, before.size()));
  if (before.find_first_of("/\\") == before.npos) return {};
  std::string path(before);
  std::replace(path.begin(), path.end(), '\\', '/');
  const std::size_t first = path.find_first_not_of('/');
  const std::size_t last = path.find_last_not_of('/');
  return first == path.npos ? std::string() : path.substr(first, last + 1 - first);
}

const record::TagText* rule_of(std::span<const record::TagText> rules, const std::string& tag,
                               const std::string record::TagText::*text, std::string& filled) {
  for (const record::TagText& rule : rules) {
    if ((rule.*text).empty()) continue;
    const auto found = rule.pattern.match(tag);
    if (!found) continue;
    filled = record::filled_in(rule.*text, *found).value_or(std::string());
    return &rule;
  }
  return nullptr;
}

void name_area(json& loop, std::span<const record::TagText> rules,
               const std::optional<record::TagPattern>& pattern) {
  const std::string tag = loop.at("tag").get<std::string>();
  std::string area;
  const char* from = nullptr;
  if (rule_of(rules, tag, &record::TagText::area, area) != nullptr) {
    from = "rule";
  } else if (pattern) {
    area = area_of(tag, pattern);
    from = area == "-" ? nullptr : "rule";
  } else if (!(area = folders_of(tag)).empty()) {
    from = "folder";
  } else {
    area = area_of(instrument_part(tag), std::nullopt);
    from = area == "-" || !instrument_at(tag) ? nullptr : "tag";
  }
  loop["area"] = area.empty() || area == "-" ? json(nullptr) : json(area);
  loop["area_from"] = from == nullptr ? json(nullptr) : json(from);
}

// Returns the first and the last time of the loop's record since 1970; nullopt without a clock.
std::optional<std::pair<double, double>> time_of(const json& loop) {
  const json& start = loop.at("import").at("start");
  const json& windows = loop.at("windows");
  if (!start.is_string() || windows.empty()) return std::nullopt;
  const auto at = record::parse_time(start.get<std::string>(), record::TimeForm::ymd);
  if (!at) return std::nullopt;
  const double first = static_cast<double>(at->whole_s) + at->rest_s;
  return std::pair(first, first + windows.back().at("to_s").get<double>());
}

}  // namespace

std::string_view instrument_part(std::string_view tag) {
  const auto at = instrument_at(tag);
  return at ? tag.substr(at->first, at->second) : tag;
}

void name_loops(std::vector<json>& loops, std::span<const record::TagText> rules,
                const std::optional<record::TagPattern>& area) {
  std::map<std::string, std::size_t> times;
  for (json& loop : loops) {
    const std::string tag = loop.at("tag").get<std::string>();
    std::string shown;
    if (rule_of(rules, tag, &record::TagText::show, shown) == nullptr || shown.empty())
      shown = instrument_part(tag);
    ++times[shown];
    loop["shown"] = shown;
    std::string master;
    rule_of(rules, tag, &record::TagText::master, master);
    loop["master"] = master.empty() ? json(nullptr) : json(master);
    name_area(loop, rules, area);
  }
  for (json& loop : loops) {
    if (times[loop.at("shown").get<std::string>()] > 1) loop["shown"] = loop.at("tag");
  }
}

bool share_a_unit(const json& a, const json& b) {
  if (a.at("area_from").is_string() && a.at("area_from") == b.at("area_from")) {
    const auto in_a = a.at("area").get<std::string>();
    const auto in_b = b.at("area").get<std::string>();
    return base::is_in_area(in_a, in_b) || base::is_in_area(in_b, in_a);
  }
  for (const json& file : a.value("files", json::array())) {
    for (const json& other : b.value("files", json::array())) {
      if (file == other) return true;
    }
  }
  const auto of_a = time_of(a);
  const auto of_b = time_of(b);
  if (!of_a || !of_b) return false;
  const double common = std::min(of_a->second, of_b->second) - std::max(of_a->first, of_b->first);
  const double longest = std::max(of_a->second - of_a->first, of_b->second - of_b->first);
  return 2.0 * common >= longest && longest > 0.0;
}

}  // namespace loopwarden::workbench
