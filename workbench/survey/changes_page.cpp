// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "workbench/report/palette.hpp"
#include "workbench/report/plot.hpp"
#include "workbench/survey/assets.hpp"
#include "workbench/survey/changes.hpp"
#include "workbench/survey/survey_page.hpp"

namespace loopwarden::workbench {
namespace {

using nlohmann::json;

constexpr std::size_t kMostLines = 20;
constexpr std::size_t kMostUnchanged = 10;

std::string words_at(const json& object, const char* key) {
  const json& value = object.at(key);
  return value.is_string() ? value.get<std::string>() : std::string();
}

std::string cost_text(const json& cost) {
  return cost.is_number() ? fmt::format("{:.6g}", cost.get<double>()) : std::string();
}

// Returns "2026-10-01 to 2026-10-31".
std::string span_text(const json& span) {
  constexpr std::size_t kDay = 10;
  const std::string from = words_at(span, "from").substr(0, kDay);
  const std::string to = words_at(span, "to").substr(0, kDay);
  if (from.empty()) return "a survey without dates";
  return from == to ? from : from + " to " + to;
}

std::string title_of(const json& changes) {
  return span_text(changes.at("now")) + " against " + span_text(changes.at("before"));
}

std::vector<const json*> loops_of(const json& changes, const char* change) {
  std::vector<const json*> loops;
  for (const json& loop : changes.at("loops")) {
    if (loop.at("change") == change) loops.push_back(&loop);
  }
  return loops;
}

std::size_t most_shown(const char* change) {
  return std::string(change) == "same" ? kMostUnchanged : kMostLines;
}

// Sorts the areas by cost per hour if it is known, otherwise by findings.
std::vector<const json*> areas_of(const json& changes) {
  std::vector<const json*> areas;
  for (const json& area : changes.at("areas")) areas.push_back(&area);
  std::stable_sort(areas.begin(), areas.end(), [](const json* a, const json* b) {
    const auto key = [](const json* area) {
      return std::pair(area->at("cost_per_hour").get<double>(), area->at("findings").get<int>());
    };
    return key(a) > key(b);
  });
  return areas;
}

// Returns the earlier finding if it differs.
std::string before_text(const json& loop) {
  const std::string before = words_at(loop, "before");
  return before == words_at(loop, "now") ? "" : before;
}

std::string now_text(const json& loop) {
  std::string text = words_at(loop, "now");
  if (text.empty()) return "not in this survey";
  const std::string grade = words_at(loop, "grade");
  return grade.empty() ? text : text + ", " + grade;
}

// Returns the header of the list and the number of its columns.
std::string changes_head(bool weighted) {
  return fmt::format(
      "<table class=\"changes\"><thead><tr><th class=\"text\">Loop</th><th class=\"text "
      "wide\">Area</th>{}<th class=\"text\">Now</th><th class=\"text\">Before</th><th class=\"text "
      "wide\">Since</th><th class=\"text wide\">Found</th><th "
      "class=\"text wide\">Next</th></tr></thead>\n",
      weighted ? "<th class=\"text wide\">Criticality</th><th>Cost /h</th>" : "");
}
constexpr int kListColumns = 7;
constexpr int kWeightedColumns = 9;

std::string section_html(const json& changes, const Change& change) {
  const std::vector<const json*> loops = loops_of(changes, change.key);
  if (loops.empty()) return {};
  const bool weighted = changes.at("weighted").get<bool>();
  const int columns = weighted ? kWeightedColumns : kListColumns;
  std::string html = fmt::format(
      "<tbody><tr><th colspan=\"{}\" class=\"text {}\"><h2>{} <span "
      "class=\"note\">{}</span></h2></th></tr>\n",
      columns, change.key, change.heading, loops.size());
  const std::size_t shown = std::min(loops.size(), most_shown(change.key));
  for (std::size_t k = 0; k < shown; ++k) {
    const json& loop = *loops[k];
    constexpr std::size_t kMinute = 16;
    std::string since = words_at(loop, "since").substr(0, kMinute);
    std::replace(since.begin(), since.end(), 'T', ' ');
    html += fmt::format(
        "<tr><td class=\"text tag\">{}</td><td class=\"text wide\">{}</td>{}<td class=\"text "
        "now\">{}</td><td class=\"text\">{}</td><td class=\"text wide when\">{}</td><td "
        "class=\"text wide\">{}</td><td class=\"text wide\">{}</td></tr>\n",
        tag_html(words_at(loop, "tag")), escaped(words_at(loop, "area")),
        weighted ? fmt::format("<td class=\"text wide\">{}</td><td>{}</td>",
                               escaped(words_at(loop, "criticality")),
                               cost_text(loop.at("cost_per_hour")))
                 : std::string(),
        escaped(now_text(loop)), escaped(before_text(loop)), escaped(since),
        escaped(words_at(loop, "found")), escaped(words_at(loop, "next")));
  }
  if (loops.size() > shown) {
    html += fmt::format(
        "<tr><td colspan=\"{}\" class=\"text note\">and {} more in changes.json</td></tr>\n",
        columns, loops.size() - shown);
  }
  return html + "</tbody>\n";
}

// Draws the number of an area's loops with each change as adjacent bars.
std::string bar_html(const json& area, int most) {
  constexpr double kBarsWidth = 240.0;
  std::string bars;
  double x = 0.0;
  for (const char* change : {"new", "worse", "same", "better", "gone"}) {
    const double width = kBarsWidth * area.at(change).get<double>() / most;
    if (width > 0.0) {
      bars += fmt::format("<rect class=\"{}\" x=\"{:.1f}\" width=\"{:.1f}\" height=\"12\"/>",
                          change, x, std::max(width - 1.0, 0.5));
    }
    x += width;
  }
  return fmt::format("<svg class=\"bar\" viewBox=\"0 0 {:g} 12\" aria-hidden=\"true\">{}</svg>",
                     kBarsWidth, bars);
}

std::string areas_html(const json& changes) {
  constexpr std::array kShown{"new", "worse", "better", "gone"};
  const bool weighted = changes.at("weighted").get<bool>();
  std::string html =
      "<table class=\"areas\"><thead><tr><th class=\"text\">Area</th><th "
      "class=\"wide\">Loops</th><th>Findings</th>";
  for (const char* change : kShown) {
    const auto* const named = std::find_if(kChanges.begin(), kChanges.end(), [&](const Change& c) {
      return std::string_view(c.key) == change;
    });
    html += fmt::format("<th class=\"{}\">{}</th>", change, named->heading);
  }
  html += fmt::format(
      "{}<th class=\"text wide\"><span class=\"new\">new</span>, <span "
      "class=\"worse\">worse</span>, <span "
      "class=\"same\">as before</span>, <span class=\"better\">better</span>, <span "
      "class=\"gone\">gone</span></th></tr></thead><tbody>\n",
      weighted ? "<th>Cost /h</th>" : "");
  int most = 1;
  const std::vector<const json*> areas = areas_of(changes);
  for (const json* area : areas) {
    int sum = 0;
    for (const char* change : {"new", "worse", "same", "better", "gone"})
      sum += area->at(change).get<int>();
    most = std::max(most, sum);
  }
  for (const json* area : areas) {
    html += fmt::format("<tr><td class=\"text\">{}</td><td class=\"wide\">{}</td><td>{}</td>",
                        escaped(words_at(*area, "area")), area->at("loops").get<int>(),
                        area->at("findings").get<int>());
    for (const char* change : kShown) {
      const int loops = area->at(change).get<int>();
      html += fmt::format("<td class=\"{}\">{}</td>", loops > 0 ? change : "note", loops);
    }
    if (weighted) html += fmt::format("<td>{}</td>", cost_text(area->at("cost_per_hour")));
    html += fmt::format("<td class=\"text wide\">{}</td></tr>\n", bar_html(*area, most));
  }
  return html + "</tbody></table>\n";
}

std::string tags_without_survey(const json& changes) {
  const json& tags = changes.at("not_in_survey");
  if (tags.empty()) return {};
  constexpr std::size_t kMost = 8;
  std::string text;
  for (std::size_t k = 0; k < std::min(kMost, tags.size()); ++k)
    text += (k > 0 ? ", " : "") + tags[k].get<std::string>();
  return fmt::format("{} of --loops in neither survey: {}{}", tags.size(), text,
                     tags.size() > kMost ? ", ..." : "");
}

}  // namespace

std::string changes_text(const json& changes) {
  std::string text = title_of(changes) + "\n";
  std::string counts;
  for (const Change& change : kChanges) {
    counts += fmt::format("{}{} {}", counts.empty() ? "" : ", ", change.key,
                          changes.at("counts").at(change.key).get<int>());
  }
  text += counts + "\n";
  const bool weighted = changes.at("weighted").get<bool>();
  const std::vector<const json*> areas = areas_of(changes);
  if (areas.size() > 1) {
    text += fmt::format("\n{:<16} {:>6} {:>9} {:>5} {:>6} {:>7} {:>5}{}\n", "area", "loops",
                        "findings", "new", "worse", "better", "gone", weighted ? "   cost/h" : "");
    for (std::size_t k = 0; k < std::min(kMostLines, areas.size()); ++k) {
      const json& area = *areas[k];
      const auto number = [&](const char* key) { return area.at(key).get<int>(); };
      text += fmt::format("{:<16} {:>6} {:>9} {:>5} {:>6} {:>7} {:>5}", words_at(area, "area"),
                          number("loops"), number("findings"), number("new"), number("worse"),
                          number("better"), number("gone"));
      text += weighted ? fmt::format(" {:>8}\n", cost_text(area.at("cost_per_hour"))) : "\n";
    }
    if (areas.size() > kMostLines)
      text += fmt::format("  ... {} more in changes.html\n", areas.size() - kMostLines);
  }
  for (const Change& change : kChanges) {
    const std::vector<const json*> loops = loops_of(changes, change.key);
    if (loops.empty()) continue;
    text += fmt::format("\n{}\n", change.heading);
    const std::size_t shown = std::min(loops.size(), most_shown(change.key));
    for (std::size_t k = 0; k < shown; ++k) {
      const json& loop = *loops[k];
      const std::string before = before_text(loop);
      const std::string cost = cost_text(loop.at("cost_per_hour"));
      text +=
          fmt::format("  {:<24} {:<26} {:<24} {}{}{}\n", words_at(loop, "tag"), now_text(loop),
                      before.empty() ? "" : "was " + before, words_at(loop, "criticality"),
                      cost.empty() ? "" : " " + cost + "/h",
                      words_at(loop, "found").empty() ? "" : " found: " + words_at(loop, "found"));
      while (text.size() > 1 && text[text.size() - 2] == ' ') text.erase(text.size() - 2, 1);
    }
    if (loops.size() > shown) text += fmt::format("  ... {} more\n", loops.size() - shown);
  }
  if (const std::string tags = tags_without_survey(changes); !tags.empty())
    text += "\n" + tags + "\n";
  return text;
}

std::string changes_page(const json& changes) {
  std::string html = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\">\n<title>Survey: what changed</title>\n<style>{}{}</style>"
      "</head><body>\n<h1>What changed</h1>\n<p class=\"note\">{}</p>\n<ul class=\"counts\">",
      palette_style(), kSurveyStyle, escaped(title_of(changes)));
  for (const Change& change : kChanges) {
    const std::string heading = change.heading;
    html += fmt::format("<li class=\"{}\"><b>{}</b>{}</li>", change.key,
                        changes.at("counts").at(change.key).get<int>(),
                        escaped(heading.substr(0, heading.find(':'))));
  }
  html += "</ul>\n";
  html += areas_html(changes);
  if (!changes.at("loops").empty()) {
    html += changes_head(changes.at("weighted").get<bool>());
    for (const Change& change : kChanges) html += section_html(changes, change);
    html += "</table>\n";
  }
  if (const std::string tags = tags_without_survey(changes); !tags.empty())
    html += fmt::format("<p class=\"note\">{}</p>\n", escaped(tags));
  return html + "</body></html>\n";
}

}  // namespace loopwarden::workbench
