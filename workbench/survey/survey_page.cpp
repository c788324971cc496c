// SPDX-License-Identifier: Apache-2.0
#include "workbench/survey/survey_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "record/import/time_text.hpp"
#include "workbench/report/assets.hpp"
#include "workbench/report/palette.hpp"
#include "workbench/report/plot.hpp"
#include "workbench/survey/assets.hpp"
#include "workbench/text/import_json.hpp"

namespace loopwarden::workbench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kSparkWidth = 140.0;
constexpr double kSparkHeight = 28.0;

std::string text_of_json(const json& value) {
  if (value.is_null()) return {};
  return value.is_string() ? value.get<std::string>() : value.dump();
}

std::string number_cell(const json& value, double factor = 1.0, int digits = 3) {
  if (!value.is_number()) return "<td class=\"wide\"></td>";
  const double v = factor * value.get<double>();
  return fmt::format("<td class=\"wide\" data-v=\"{:.6g}\">{:.{}g}</td>", v, v, digits);
}

std::string period_text(double s) {
  if (s < 100.0) return fmt::format("{:.3g} s", s);
  return s < 5400.0 ? fmt::format("{:.3g} min", s / 60.0) : fmt::format("{:.3g} h", s / 3600.0);
}

std::string verdict_words(const json& loop) {
  std::string verdict = loop.at("verdict").get<std::string>();
  if (verdict == "valve_effect") {
    const json& effect = loop.at("effects").at(0);
    return fmt::format("{} {:.2g} %", effect.at("name").get<std::string>(),
                       effect.at("percent_of_span").get<double>());
  }
  if (verdict == "other_cause") {
    std::string cause = text_of_json(loop.at("cause"));
    std::replace(cause.begin(), cause.end(), '_', ' ');
    return cause;
  }
  if (verdict == "cant_tell") return "can't tell";
  if (verdict == "not_enough_data") return "not enough data";
  return verdict;
}

std::string spark(const json& pv) {
  double low = 1e300;
  double high = -1e300;
  for (const json& v : pv) {
    if (!v.is_number()) continue;
    low = std::min(low, v.get<double>());
    high = std::max(high, v.get<double>());
  }
  if (!(high > low)) return {};
  constexpr std::size_t kMost = 140;
  const std::size_t step = std::max<std::size_t>(1, pv.size() / kMost);
  std::string path;
  bool pen = false;
  for (std::size_t k = 0; k < pv.size(); k += step) {
    if (!pv[k].is_number()) {
      pen = false;
      continue;
    }
    const double x = kSparkWidth * static_cast<double>(k) / static_cast<double>(pv.size());
    const double y = 2.0 + (kSparkHeight - 4.0) * (high - pv[k].get<double>()) / (high - low);
    path += fmt::format("{}{:.1f} {:.1f}", pen ? "L" : "M", x, y);
    pen = true;
  }
  return fmt::format(
      "<svg class=\"spark\" viewBox=\"0 0 {:g} {:g}\" aria-hidden=\"true\"><path d=\"{}\" "
      "fill=\"none\" "
      "stroke=\"currentColor\"/></svg>",
      kSparkWidth, kSparkHeight, path);
}

std::string head(const std::string& title, const std::string& assets) {
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\">\n<title>{}</title>\n<link rel=\"stylesheet\" "
      "href=\"{}survey.css\">\n",
      escaped(title), assets);
}

std::string page_name(const json& loop) {
  return fmt::format("{:04}-{}.html", loop.at("rank").get<int>(),
                     file_name_for(loop.at("tag").get<std::string>()));
}

std::string list_page(const json& survey) {
  std::map<std::string, int> next;
  for (const json& loop : survey.at("loops")) ++next[loop.at("next").at("what").get<std::string>()];
  std::string html = head("Survey", "assets/") + "</head><body>\n<h1>Survey</h1>\n";
  html += fmt::format(
      "<p class=\"note\">{} loops, worst first. Each line leads to what speaks for it.</p>\n<ul "
      "class=\"counts\">",
      survey.at("loops").size());
  for (const char* what : {"repair", "tune", "look upstream", "look closer", "nothing"}) {
    html += fmt::format("<li><b>{}</b>{}</li>", next[what], what);
  }
  html += fmt::format("<li><b>{}</b>could not be read</li></ul>\n", survey.at("failed").size());
  html +=
      "<div class=\"filter\"><input type=\"search\" placeholder=\"tag, verdict, ...\" "
      "aria-label=\"filter\">"
      "<select aria-label=\"what to do\"><option value=\"\">all</option>";
  for (const auto& [what, n] : next) html += fmt::format("<option>{}</option>", what);
  html += "</select><span class=\"shown note\"></span></div>\n<table class=\"loops\"><thead><tr>";
  struct Column {
    const char* name;
    const char* type;
  };
  constexpr std::array kColumns{Column{"#", ""},
                                Column{"Loop", "text"},
                                Column{"PV", "text"},
                                Column{"Verdict", "text"},
                                Column{"p %", "wide"},
                                Column{"Period", "wide"},
                                Column{"Group", "wide"},
                                Column{"Automatic %", "wide"},
                                Column{"At limit %", "wide"},
                                Column{"Variability", "wide"},
                                Column{"Travel /h", "wide"},
                                Column{"Since", "text wide"},
                                Column{"Next", "text"}};
  for (const Column& c : kColumns) {
    html += fmt::format("<th class=\"{}\"><button>{}</button></th>", c.type, c.name);
  }
  html += "</tr></thead><tbody>\n";
  for (const json& loop : survey.at("loops")) {
    const std::string verdict = loop.at("verdict").get<std::string>();
    html += fmt::format(
        "<tr data-next=\"{}\"><td>{}</td><td class=\"text\"><a href=\"pages/{}\">{}</a></td><td "
        "class=\"text\">{}</td>",
        escaped(loop.at("next").at("what").get<std::string>()), loop.at("rank").get<int>(),
        escaped(page_name(loop)), escaped(loop.at("tag").get<std::string>()),
        spark(loop.at("picture").at("pv")));
    html +=
        fmt::format("<td class=\"text verdict {}\">{}</td>", verdict, escaped(verdict_words(loop)));
    html += number_cell(loop.at("probability"), 100.0, 2);
    const json& period = loop.at("period_s");
    html += period.is_number()
                ? fmt::format("<td class=\"wide\" data-v=\"{:.6g}\">{}</td>", period.get<double>(),
                              period_text(period.get<double>()))
                : "<td class=\"wide\"></td>";
    html += number_cell(loop.at("group"));
    html +=
        number_cell(loop.at("share_automatic"), 100.0) + number_cell(loop.at("saturated"), 100.0);
    html += number_cell(loop.at("variability"), 1.0, 2) + number_cell(loop.at("travel_per_hour"));
    html += fmt::format("<td class=\"text wide\">{}</td>", escaped(text_of_json(loop.at("since"))));
    html += fmt::format("<td class=\"text\">{}</td></tr>\n",
                        escaped(loop.at("next").at("what").get<std::string>()));
  }
  html += "</tbody></table>\n";
  if (!survey.at("groups").empty()) {
    html +=
        "<h2>Loops that swing together</h2>\n<p class=\"note\">Where to look first stands first. A "
        "list to look at, no finding: "
        "loops may swing at one period by "
        "chance.</p>\n<table><thead><tr><th>Group</th><th>Period</th><th "
        "class=\"text\">Loops</th></tr></thead><tbody>\n";
    for (const json& group : survey.at("groups")) {
      std::string members;
      for (const json& tag : group.at("loops")) {
        members += (members.empty() ? "<b>" : ", ") + escaped(tag.get<std::string>()) +
                   (members.empty() ? "</b>" : "");
      }
      html += fmt::format("<tr><td>{}</td><td>{}</td><td class=\"text\">{}</td></tr>\n",
                          group.at("group").get<int>(),
                          period_text(group.at("period_s").get<double>()), members);
    }
    html += "</tbody></table>\n";
  }
  if (!survey.at("failed").empty()) {
    html +=
        "<h2>Could not be read</h2>\n<table><thead><tr><th class=\"text\">File</th><th "
        "class=\"text\">Loop</th><th class=\"text\">Why</th></tr></thead><tbody>\n";
    for (const json& f : survey.at("failed")) {
      html += fmt::format(
          "<tr><td class=\"text\">{}</td><td class=\"text\">{}</td><td "
          "class=\"text\">{}</td></tr>\n",
          escaped(f.at("file").get<std::string>()), escaped(f.value("loop", "")),
          escaped(f.at("why").get<std::string>()));
    }
    html += "</tbody></table>\n";
  }
  return html + "<script src=\"assets/survey.js\"></script></body></html>\n";
}

std::string row(const char* name, const std::string& value) {
  return value.empty() ? std::string()
                       : fmt::format("<dt>{}</dt><dd>{}</dd>", name, escaped(value));
}

std::string loop_page(const json& loop) {
  const std::string tag = loop.at("tag").get<std::string>();
  const std::string verdict = loop.at("verdict").get<std::string>();
  std::string html = head(tag, "../assets/") +
                     "<link rel=\"stylesheet\" href=\"../assets/uPlot.min.css\">\n</head><body>\n";
  html += fmt::format(
      "<p><a href=\"../survey.html\">Survey</a></p>\n<h1>{}. {}: <span "
      "class=\"{}\">{}</span></h1>\n",
      loop.at("rank").get<int>(), escaped(tag), verdict, escaped(verdict_words(loop)));
  html +=
      fmt::format("<p><b>{}</b>: {}.</p>\n", escaped(loop.at("next").at("what").get<std::string>()),
                  escaped(loop.at("next").at("why").get<std::string>()));
  html += "<dl>" + row("Because", text_of_json(loop.at("evidence"))) +
          row("Against it", text_of_json(loop.at("against"))) +
          row("What would settle it", text_of_json(loop.at("settle")));
  if (loop.at("probability").is_number()) {
    html += row("Probability of a valve effect",
                fmt::format("{:.0f} %", 100.0 * loop.at("probability").get<double>()));
  }
  html += row("Since", text_of_json(loop.at("since")));
  if (loop.at("period_s").is_number()) {
    html += row("Swings every", period_text(loop.at("period_s").get<double>()));
  }
  if (!loop.at("likely_source").is_null() && loop.at("likely_source") != loop.at("tag")) {
    html += row("Swings with", loop.at("likely_source").get<std::string>() + " (look there first)");
  }
  const json& import = loop.at("import");
  if (import.at("compression").at("kind") != "none") {
    const json& sees = import.at("sees_from_percent");
    html += row(
        "Compressed",
        import.at("compression").at("kind").get<std::string>() +
            (sees.is_number() ? fmt::format("; effects below {:.2g} % of the CO span can't be seen",
                                            sees.get<double>())
                              : std::string("; what was lost is not known")));
  }
  html += row("Read from", text_of_json(loop.at("files"))) + "</dl>\n";
  html +=
      "<figure><figcaption>The whole export</figcaption><div id=\"trend\" "
      "class=\"plot\"></div></figure>\n"
      "<div class=\"pictures\"><figure><figcaption>The stretch that stands for it</figcaption><div "
      "id=\"zoom\" class=\"plot\"></div></figure>"
      "<figure><figcaption>PV over CO there</figcaption><div id=\"phase\" "
      "class=\"plot\"></div></figure></div>\n";
  html += "<h2>Windows</h2>\n<div class=\"strip\" role=\"img\" aria-label=\"verdict by window\">";
  for (const json& w : loop.at("windows")) {
    html += fmt::format("<span class=\"{}\" title=\"{}\"></span>",
                        w.at("verdict").get<std::string>(), escaped(verdict_words(w)));
  }
  html +=
      "</div>\n<table><thead><tr><th class=\"text\">From</th><th class=\"text\">Verdict</th><th>p "
      "%</th><th>Period</th><th>Automatic %</th>"
      "<th>At limit %</th><th>Error rms</th><th>Variability</th><th>Dead time s</th><th>Travel "
      "/h</th><th>Turns /h</th></tr></thead><tbody>\n";
  const auto cell = [](const json& value, double factor = 1.0) {
    return value.is_number() ? fmt::format("<td>{:.3g}</td>", factor * value.get<double>())
                             : std::string("<td></td>");
  };
  for (const json& w : loop.at("windows")) {
    html += fmt::format("<tr><td class=\"text\">{}</td><td class=\"text verdict {}\">{}</td>",
                        period_text(w.at("from_s").get<double>()),
                        w.at("verdict").get<std::string>(), escaped(verdict_words(w)));
    html += cell(w.at("probability"), 100.0) +
            (w.at("period_s").is_number()
                 ? "<td>" + period_text(w.at("period_s").get<double>()) + "</td>"
                 : "<td></td>") +
            cell(w.at("share_automatic"), 100.0) + cell(w.at("saturated"), 100.0) +
            cell(w.at("error_rms")) + cell(w.at("variability")) + cell(w.at("dead_time_s")) +
            cell(w.at("travel_per_hour")) + cell(w.at("reversals_per_hour")) + "</tr>\n";
  }
  html += "</tbody></table>\n";
  json data = {{"picture", loop.at("picture")}, {"start_s", nullptr}};
  if (import.at("start").is_string()) {
    const auto start =
        record::parse_time(import.at("start").get<std::string>(), record::TimeForm::ymd);
    if (start) data["start_s"] = static_cast<double>(start->whole_s) + start->rest_s;
  }
  std::string text = data.dump();
  for (std::size_t at = 0; (at = text.find('<', at)) != std::string::npos;) {
    text.replace(at, 1, "\\u003c");
  }
  html += "<script type=\"application/json\" id=\"data\">" + text + "</script>\n";
  return html +
         "<script src=\"../assets/uPlot.iife.min.js\"></script><script "
         "src=\"../assets/loop.js\"></script></body></html>\n";
}

}  // namespace

void write_survey_pages(const json& survey, const fs::path& out, OutputFiles& files) {
  files.make_folder(out / "assets");
  files.make_folder(out / "pages");
  files.add(out / "assets/survey.css", palette_style() + kSurveyStyle);
  files.add(out / "assets/survey.js", kSurveyScript);
  files.add(out / "assets/loop.js", kSurveyLoopScript);
  files.add(out / "assets/uPlot.min.css", kUplotStyle);
  files.add(out / "assets/uPlot.iife.min.js", kUplotScript);
  std::set<std::string> pages;
  for (const json& loop : survey.at("loops")) {
    pages.insert(page_name(loop));
    files.add(out / "pages" / page_name(loop), loop_page(loop));
  }
  // Those of an earlier run that nothing leads to any more.
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(out / "pages", none)) {
    if (entry.path().extension() == ".html" && pages.count(entry.path().filename().string()) == 0) {
      fs::remove(entry.path(), none);
    }
  }
  files.add(out / "survey.html", list_page(survey));
}

}  // namespace loopwarden::workbench
