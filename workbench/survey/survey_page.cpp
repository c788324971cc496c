// SPDX-License-Identifier: Apache-2.0
#include "workbench/survey/survey_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "base/text.hpp"
#include "record/import/time_text.hpp"
#include "workbench/report/assets.hpp"
#include "workbench/report/palette.hpp"
#include "workbench/report/plot.hpp"
#include "workbench/survey/assets.hpp"
#include "workbench/survey/outcomes.hpp"
#include "workbench/survey/worklist.hpp"
#include "workbench/text/import_json.hpp"

namespace loopwarden::workbench {

namespace fs = std::filesystem;
using nlohmann::json;

std::string period_text(double s) {
  if (s < 100.0) return fmt::format("{:.3g} s", s);
  return s < 5400.0 ? fmt::format("{:.3g} min", s / 60.0) : fmt::format("{:.3g} h", s / 3600.0);
}

namespace {

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

// Returns a moment by the export's clock, to the minute. Without a clock it counts from the start.
std::string moment_text(const json& loop, double s) {
  const json& start = loop.at("import").at("start");
  const auto at = start.is_string()
                      ? record::parse_time(start.get<std::string>(), record::TimeForm::ymd)
                      : std::nullopt;
  if (!at) return period_text(s);
  const auto whole = static_cast<std::int64_t>(std::floor(at->rest_s + s));
  std::string text = record::iso_text(at->whole_s + whole, 0.0, false).substr(0, 16);
  text[10] = ' ';
  return text;
}

std::string since_text(const json& loop) {
  if (!loop.at("since_s").is_number()) return {};
  const double s = loop.at("since_s").get<double>();
  return s > 0.0 ? moment_text(loop, s) : "the beginning";
}

std::string unit_of(const json& loop, const char* signal, const char* before) {
  const auto unit = loop.at("import").at("units").value(signal, std::string());
  return unit.empty() ? std::string() : before + unit;
}

}  // namespace

std::string tag_html(const std::string& tag) {
  std::string html;
  std::string part;
  for (const char c : tag) {
    part += c;
    if (std::string_view("./\\_-:| ").find(c) == std::string_view::npos) continue;
    html += escaped(part) + "<wbr>";
    part.clear();
  }
  return html + escaped(part);
}

bool is_skipped(const json& problem) { return problem.value("lost", "loop") == "signals"; }

std::string surveyed_verdict(const json& loop) {
  std::string verdict = loop.at("verdict").get<std::string>();
  if (verdict == "valve_effect") {
    const json& effect = loop.at("effects").at(0);
    return fmt::format("{} {:.2g} %", effect.at("name").get<std::string>(),
                       effect.at("percent_of_span").get<double>());
  }
  if (verdict == "other_cause") {
    return base::in_words(text_of_json(loop.at("cause")));
  }
  if (verdict == "cant_tell") return "can't tell";
  if (verdict == "not_enough_data") return "not enough data";
  return verdict;
}

namespace {

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
                     file_name_for(loop.at("shown").get<std::string>()));
}

// Returns "backlash, 2026-11-20"; empty: no fitter has answered.
std::string found_text(const json& loop) {
  const json outcome = loop.value("outcome", json(nullptr));
  if (outcome.is_null()) return {};
  const auto note = outcome.at("note").get<std::string>();
  return outcome.at("found").get<std::string>() + ", " +
         outcome.at("answered").get<std::string>().substr(0, 10) +
         (note.empty() ? "" : ": " + note);
}

// Returns the verdict, followed by the reason why a loop could not be judged and by the fitter's
// finding.
std::string verdict_html(const json& judged) {
  std::string html = escaped(surveyed_verdict(judged));
  if (judged.value("duplicate_of", json(nullptr)).is_string()) {
    html += fmt::format("<div class=\"why\">{}</div>",
                        escaped(judged.at("next").at("why").get<std::string>()));
  }
  if (const std::string found = found_text(judged); !found.empty())
    html += fmt::format("<div class=\"why\">found: {}</div>", escaped(found));
  if (judged.at("reason").is_string()) {
    html +=
        fmt::format("<div class=\"why\">{}</div>", escaped(judged.at("reason").get<std::string>()));
  }
  return html;
}

std::string counts_html(const json& survey, const std::map<std::string, int>& next) {
  std::string html;
  const auto count = [&](std::ptrdiff_t number, const char* what) {
    if (number > 0) html += fmt::format("<li><b>{}</b>{}</li>", number, what);
  };
  for (const char* what : {"repair", "test the valve", "tune", "look upstream",
                           "check the transmitter", "look closer", "nothing"}) {
    const auto at = next.find(what);
    count(at == next.end() ? 0 : at->second, what);
  }
  const json& failed = survey.at("failed");
  const auto skipped = std::count_if(failed.begin(), failed.end(), is_skipped);
  count(skipped, "without PV or CO");
  count(static_cast<std::ptrdiff_t>(failed.size()) - skipped, "could not be read");
  return "<ul class=\"counts\">" + html + "</ul>\n";
}

std::string list_head() {
  struct Heading {
    const char* name;
    const char* type;
  };
  constexpr std::array kHeadings{Heading{"#", ""},
                                 Heading{"Loop", "text"},
                                 Heading{"PV", "text"},
                                 Heading{"Verdict", "text"},
                                 Heading{"Valve %", "wide"},
                                 Heading{"Period", "wide"},
                                 Heading{"Group", "wide"},
                                 Heading{"Automatic %", "wide"},
                                 Heading{"At limit %", "wide"},
                                 Heading{"Variability", "wide"},
                                 Heading{"Travel /h", "wide"},
                                 Heading{"Since", "text wide"},
                                 Heading{"Next", "text"}};
  std::string html = "<table class=\"loops\"><thead><tr>";
  for (const Heading& c : kHeadings) {
    html += fmt::format("<th class=\"{}\"><button>{}</button></th>", c.type, c.name);
  }
  return html + "</tr></thead><tbody>\n";
}

std::string list_row(const json& loop) {
  const std::string next = escaped(loop.at("next").at("what").get<std::string>());
  std::string html = fmt::format(
      "<tr data-next=\"{}\"><td>{}</td><td class=\"text tag\"><a href=\"pages/{}\">{}</a></td><td "
      "class=\"text\">{}</td>",
      next, loop.at("rank").get<int>(), escaped(page_name(loop)),
      tag_html(loop.at("shown").get<std::string>()), spark(loop.at("picture").at("pv")));
  html += fmt::format("<td class=\"text verdict {}\">{}</td>",
                      loop.at("verdict").get<std::string>(), verdict_html(loop));
  html += number_cell(loop.at("probability"), 100.0, 2);
  const json& period = loop.at("period_s");
  html += period.is_number() ? fmt::format("<td class=\"wide\" data-v=\"{:.6g}\">{}</td>",
                                           period.get<double>(), period_text(period.get<double>()))
                             : "<td class=\"wide\"></td>";
  html += number_cell(loop.at("group"));
  html += number_cell(loop.at("share_automatic"), 100.0) + number_cell(loop.at("saturated"), 100.0);
  html += number_cell(loop.at("variability"), 1.0, 2) + number_cell(loop.at("travel_per_hour"));
  html += fmt::format("<td class=\"text wide when\">{}</td>", escaped(since_text(loop)));
  return html + fmt::format("<td class=\"text\">{}</td></tr>\n", next);
}

// Page and shown tag of each loop, by tag.
struct LoopName {
  std::string page, shown;
};
using LoopNames = std::map<std::string, LoopName>;

std::string link_to(const LoopName& loop, const char* folder) {
  return fmt::format("<a href=\"{}{}\">{}</a>", folder, escaped(loop.page), tag_html(loop.shown));
}

std::string groups_html(const json& groups, const LoopNames& names) {
  if (groups.empty()) return {};
  std::string html =
      "<h2>Loops that oscillate together</h2>\n<p class=\"note\">A likely source is first and "
      "bold if all loops of its group share a unit. A group is no finding: loops may oscillate at "
      "one period by chance.</p>\n<table><thead><tr><th>Group</th><th>Period</th><th "
      "class=\"text\">Loops</th></tr></thead><tbody>\n";
  for (const json& group : groups) {
    std::string members;
    for (const json& member : group.at("loops")) {
      const std::string link = link_to(names.at(member.get<std::string>()), "pages/");
      if (!members.empty()) members += ", ";
      members += members.empty() && group.at("ordered").get<bool>() ? "<b>" + link + "</b>" : link;
    }
    html += fmt::format("<tr><td>{}</td><td>{}</td><td class=\"text\">{}</td></tr>\n",
                        group.at("group").get<int>(),
                        period_text(group.at("period_s").get<double>()), members);
  }
  return html + "</tbody></table>\n";
}

std::string failed_html(const json& failed) {
  if (failed.empty()) return {};
  std::string html =
      "<h2>Skipped, or could not be read</h2>\n<table class=\"skipped\"><thead><tr><th "
      "class=\"text\">File</th><th class=\"text\">Loop</th><th "
      "class=\"text\">Why</th></tr></thead><tbody>\n";
  for (const json& f : failed) {
    html += fmt::format(
        "<tr><td class=\"text\">{}</td><td class=\"text\">{}</td><td class=\"text\">{}</td></tr>\n",
        escaped(f.at("file").get<std::string>()), escaped(f.value("loop", "")),
        escaped(f.at("why").get<std::string>()));
  }
  return html + "</tbody></table>\n";
}

const char* confidence_class(const json& order) {
  return order.at("confidence") == "high"     ? "valve_effect"
         : order.at("confidence") == "medium" ? "other_cause"
                                              : "cant_tell";
}

std::string order_row(const json& order, const LoopNames& names) {
  std::string also;
  for (const json& tag : order.at("also_steadies"))
    also += (also.empty() ? "" : ", ") + tag_html(tag.get<std::string>());
  if (!also.empty()) also = "<div class=\"why\">also steadies " + also + "</div>";
  std::string html = fmt::format(
      "<tr><td>{}</td><td class=\"text action\">{}</td><td class=\"text tag\">{}{}</td>"
      "<td class=\"text\">{}<div class=\"why\">{}</div></td>",
      order.at("order").get<int>(), escaped(order.at("action").get<std::string>()),
      link_to(names.at(order.at("source_tag").get<std::string>()), "pages/"), also,
      escaped(order.at("finding").get<std::string>()),
      escaped(order.at("text").get<std::string>()));
  const auto cell = [&](const char* type, const char* label, const std::string& text) {
    html += fmt::format("<td class=\"{}\" data-label=\"{}\">{}</td>", type, label, text);
  };
  cell("text", "Who", escaped(order.at("who").get<std::string>()));
  cell("text", "Shutdown", order.at("shutdown").get<bool>() ? "yes" : "no");
  cell("", "Minutes", fmt::format("{:g}", order.at("minutes").get<double>()));
  cell("", "Saves per year",
       saving_text(order) + " " + escaped(order.at("currency").get<std::string>()));
  cell(confidence_class(order), "How sure", order.at("confidence").get<std::string>());
  html += "</tr>\n";
  return html;
}

std::string range_text(const json& range) {
  return fmt::format("{:g} to {:g}", range[0].get<double>(), range[1].get<double>());
}

// The assumptions of minutes and savings.
std::string costs_html(const json& costs) {
  const std::string currency = escaped(costs.at("currency").get<std::string>());
  std::string html = fmt::format(
      "<h3>Assumptions</h3>\n<p class=\"note\">Savings are estimates from this table, not "
      "measurements. It is from {}. A site replaces it with --costs.</p>\n<div "
      "class=\"assumed\"><table><thead><tr><th class=\"text\">Loop</th><th>{} per year and % of "
      "span (RMS)</th></tr></thead><tbody>\n",
      costs.at("source") == "defaults" ? "the defaults"
                                       : escaped(costs.at("source").get<std::string>()),
      currency);
  for (const auto& [kind, loss] : costs.at("loss").items())
    html += fmt::format("<tr><td class=\"text\">{}</td><td>{}</td></tr>\n", kind, range_text(loss));
  html +=
      "</tbody></table>\n<table><thead><tr><th "
      "class=\"text\">Order</th><th>removes</th></tr></thead><tbody>\n";
  for (const auto& [key, work] : costs.at("work").items()) {
    const json& removes = work.at("removes");
    html += fmt::format("<tr><td class=\"text\">{}</td><td>{:g} to {:g} %</td></tr>\n",
                        base::in_words(key), 100.0 * removes[0].get<double>(),
                        100.0 * removes[1].get<double>());
  }
  const json& valve = costs.at("valve");
  return html + fmt::format(
                    "</tbody></table>\n<table><thead><tr><th class=\"text\">Valve and "
                    "plant</th><th></th></tr></thead><tbody>\n"
                    "<tr><td class=\"text\">overhaul of a valve</td><td>{:g} {}</td></tr>\n"
                    "<tr><td class=\"text\">full strokes between two overhauls</td><td>{:g} to "
                    "{:g}</td></tr>\n<tr><td class=\"text\">hours of operation per "
                    "year</td><td>{:g}</td></tr>\n</tbody></table></div>\n",
                    valve.at("overhaul").get<double>(), currency,
                    valve.at("strokes")[0].get<double>(), valve.at("strokes")[1].get<double>(),
                    costs.at("hours_per_year").get<double>());
}

// Returns "9 orders, 19.5 h of work; 3 of them need a shutdown".
std::string orders_text(const json& orders) {
  double minutes = 0.0;
  std::size_t shutdowns = 0;
  for (const json& order : orders) {
    minutes += order.at("minutes").get<double>();
    shutdowns += order.at("shutdown").get<bool>() ? 1U : 0U;
  }
  return fmt::format("{} order{}, {:.3g} h of work; {} with a shutdown", orders.size(),
                     orders.size() == 1 ? "" : "s", minutes / 60.0, shutdowns);
}

// The first page of the report.
std::string worklist_html(const json& survey, const LoopNames& names) {
  const json& orders = survey.at("worklist");
  const auto undecided =
      std::count_if(survey.at("loops").begin(), survey.at("loops").end(), [](const json& loop) {
        return loop.at("next").at("what") == "look closer" && loop.at("verdict") != "other_cause" &&
               loop.at("verdict") != "valve_effect" && !loop.at("oscillating").get<bool>();
      });
  std::string html = fmt::format(
      "<section class=\"worklist\"><h2>Work list</h2>\n<p>{}.{}</p>\n", orders_text(orders),
      undecided == 0 ? std::string()
                     : fmt::format(" {} undecided loop{} without an "
                                   "oscillation: see the list of all "
                                   "loops.",
                                   undecided, undecided == 1 ? "" : "s"));
  if (orders.empty()) return html + "</section>\n";
  html +=
      "<table class=\"orders\"><thead><tr><th>#</th><th class=\"text\">What</th><th "
      "class=\"text\">Loop</th><th class=\"text\">Because</th><th class=\"text\">Who</th><th "
      "class=\"text\">Shutdown</th><th>Minutes</th><th>Saves per year</th><th>How "
      "sure</th></tr></thead><tbody>\n";
  for (const json& order : orders) html += order_row(order, names);
  return html + "</tbody></table>\n" + costs_html(survey.at("costs")) + "</section>\n";
}

std::string list_page(const json& survey, const LoopNames& pages) {
  std::map<std::string, int> next;
  for (const json& loop : survey.at("loops")) ++next[loop.at("next").at("what").get<std::string>()];
  std::string html = head("Survey", "assets/") + "</head><body>\n<h1>Survey</h1>\n";
  html += fmt::format(
      "<p class=\"note\">{} loop{}. Each tag links to its evidence. The orders are in "
      "worklist.csv, too.</p>\n",
      survey.at("loops").size(), survey.at("loops").size() == 1 ? "" : "s");
  html += counts_html(survey, next) + worklist_html(survey, pages) + "<h2>All loops</h2>\n";
  if (const std::string text = precision_text(survey.at("outcomes")); !text.empty())
    html += fmt::format("<p class=\"note\">{}.</p>\n", escaped(text));
  html +=
      "<div class=\"filter\"><input type=\"search\" placeholder=\"tag, verdict, ...\" "
      "aria-label=\"filter\">"
      "<select aria-label=\"what to do\"><option value=\"\">all</option>";
  for (const auto& [what, n] : next) html += fmt::format("<option>{}</option>", what);
  html += "</select><span class=\"shown note\"></span></div>\n" + list_head();
  for (const json& loop : survey.at("loops")) html += list_row(loop);
  html += "</tbody></table>\n";
  html += groups_html(survey.at("groups"), pages) + failed_html(survey.at("failed"));
  return html + "<script src=\"assets/survey.js\"></script></body></html>\n";
}

std::string row_html(const char* name, const std::string& html) {
  return html.empty() ? std::string() : fmt::format("<dt>{}</dt><dd>{}</dd>", name, html);
}

std::string row(const char* name, const std::string& value) {
  return row_html(name, escaped(value));
}

// Returns the size of the effect, its confidence, and its trend.
std::string size_rows(const json& loop) {
  if (loop.at("effects").empty()) return {};
  const json& effect = loop.at("effects").at(0);
  const json& range = loop.at("co_range");
  const double span = range[1].get<double>() - range[0].get<double>();
  const json& interval = effect.at("interval").begin().value();
  std::string html = row(
      "Size",
      fmt::format("{:.2g} % of the CO span ({:g} to {:g}{}), 90 % interval {:.2g} to {:.2g} %; {}",
                  effect.at("percent_of_span").get<double>(), range[0].get<double>(),
                  range[1].get<double>(), unit_of(loop, "co", " "),
                  100.0 * interval[0].get<double>() / span,
                  100.0 * interval[1].get<double>() / span, text_of_json(loop.at("grade"))));
  const json trend = loop.value("size_trend", json(nullptr));
  if (trend.is_object()) {
    html += row("Size over the windows",
                fmt::format("{:.2g} % at first, {:.2g} % at last; {:+.2g} % a window",
                            trend.at("first_percent_of_span").get<double>(),
                            trend.at("last_percent_of_span").get<double>(),
                            trend.at("percent_of_span_per_window").get<double>()));
  }
  return html;
}

// Returns the other loops of its group, the likely source first.
std::string group_row(const json& loop, const json& groups, const LoopNames& names) {
  if (!loop.at("group").is_number()) return {};
  constexpr std::size_t kMost = 8;
  const json& members = groups.at(loop.at("group").get<std::size_t>() - 1).at("loops");
  std::string html;
  std::size_t shown = 0;
  for (const json& member : members) {
    const std::string tag = member.get<std::string>();
    if (member == loop.at("tag") || shown == kMost) continue;
    html += (shown++ > 0 ? ", " : "") + link_to(names.at(tag), "");
  }
  if (members.size() - 1 > shown) html += fmt::format(" and {} more", members.size() - 1 - shown);
  // A loop whose own valve has a fault needs no other source.
  const bool own = loop.at("verdict") == "valve_effect";
  const json& source = loop.at("likely_source");
  if (source.is_string() && source != loop.at("tag") && !own)
    html += ": look first at " + link_to(names.at(source.get<std::string>()), "");
  return row_html("Swings like", html);
}

// Returns the loops that disturb it, strongest first.
std::string pushed_row(const json& loop, const LoopNames& names) {
  if (!loop.at("pushed_by").is_array()) return {};
  std::string html;
  for (const json& source : loop.at("pushed_by")) {
    html += (html.empty() ? "" : ", ") + link_to(names.at(source.get<std::string>()), "");
  }
  return row_html("Pushed by", html);
}

std::string compression_row(const json& import) {
  if (import.at("compression").at("kind") == "none") return {};
  const json& sees = import.at("sees_from_percent");
  return row(
      "Compressed",
      import.at("compression").at("kind").get<std::string>() +
          (sees.is_number() ? fmt::format("; effects below {:.2g} % of the CO span are not visible",
                                          sees.get<double>())
                            : std::string("; the loss is unknown")));
}

std::string facts_html(const json& loop, const json& groups, const LoopNames& pages) {
  std::string html = "<dl>";
  if (loop.at("shown") != loop.at("tag"))
    html += row("Tag in the export", loop.at("tag").get<std::string>());
  html += row("Area", text_of_json(loop.at("area"))) + row("Found", found_text(loop)) +
          row("Because", text_of_json(loop.at("evidence"))) +
          row("Against it", text_of_json(loop.at("against"))) +
          row("Next step to decide", text_of_json(loop.at("settle")));
  if (loop.at("probability").is_number()) {
    html += row("Probability of a valve effect",
                fmt::format("{:.0f} %", 100.0 * loop.at("probability").get<double>()));
  }
  html += size_rows(loop) + row("Since", since_text(loop));
  if (loop.at("period_s").is_number()) {
    const json& regularity = loop.at("regularity");
    html += row("Swings every", period_text(loop.at("period_s").get<double>()) +
                                    (regularity.is_number() ? fmt::format(", regularity {:.2g}",
                                                                          regularity.get<double>())
                                                            : std::string()));
  }
  html +=
      pushed_row(loop, pages) + group_row(loop, groups, pages) + compression_row(loop.at("import"));
  const json& start = loop.at("import").at("start");
  if (start.is_string()) {
    html += row("Clock", start.get<std::string>().ends_with('Z') ? "UTC" : "as in the export");
  }
  return html + row("Read from", text_of_json(loop.at("files"))) + "</dl>\n";
}

std::string pictures_html(const json& loop) {
  const std::string pv = "PV" + unit_of(loop, "pv", " in ");
  const std::string co = "CO" + unit_of(loop, "co", " in ");
  return fmt::format(
      "<figure><figcaption>The whole export: {0} left, {1} right</figcaption><div id=\"trend\" "
      "class=\"plot\"></div></figure>\n"
      "<div class=\"pictures\"><figure><figcaption>The representative stretch</figcaption><div "
      "id=\"zoom\" class=\"plot\"></div></figure>"
      "<figure><figcaption>{0} over {1} there</figcaption><div id=\"phase\" "
      "class=\"plot\"></div></figure></div>\n",
      escaped(pv), escaped(co));
}

std::string window_row(const json& loop, const json& w) {
  const auto cell = [&w](const char* key, double factor = 1.0) {
    const json& value = w.at(key);
    return value.is_number() ? fmt::format("<td>{:.3g}</td>", factor * value.get<double>())
                             : std::string("<td></td>");
  };
  std::string html =
      fmt::format("<tr><td class=\"text when\">{}</td><td class=\"text verdict {}\">{}</td>",
                  moment_text(loop, w.at("from_s").get<double>()),
                  w.at("verdict").get<std::string>(), verdict_html(w));
  html += cell("probability", 100.0);
  html += w.at("period_s").is_number()
              ? "<td>" + period_text(w.at("period_s").get<double>()) + "</td>"
              : "<td></td>";
  html += cell("regularity") + cell("share_automatic", 100.0) + cell("saturated", 100.0) +
          cell("error_rms") + cell("crossings_per_hour") + cell("variability") +
          cell("dead_time_s") + cell("travel_per_hour") + cell("reversals_per_hour");
  return html + cell("noise") + "</tr>\n";
}

std::string windows_html(const json& loop) {
  std::string html =
      "<h2>Windows</h2>\n<div class=\"strip\" role=\"img\" aria-label=\"verdict by window\">";
  for (const json& w : loop.at("windows")) {
    html += fmt::format("<span class=\"{}\" title=\"{}\"></span>",
                        w.at("verdict").get<std::string>(), escaped(surveyed_verdict(w)));
  }
  html += fmt::format(
      "</div>\n<div class=\"scroll\"><table><thead><tr><th class=\"text\">From</th><th "
      "class=\"text\">Verdict</th><th>Valve %</th><th>Period</th><th>Regularity</th><th>Automatic "
      "%</th><th>At limit %</th><th>Error rms{0}</th><th>SP crossings "
      "/h</th><th>Variability</th><th>Dead time s</th><th>Travel /h</th><th>Turns "
      "/h</th><th>Noise{0}</th></tr></thead><tbody>\n",
      escaped(unit_of(loop, "pv", " ")));
  for (const json& w : loop.at("windows")) html += window_row(loop, w);
  return html + "</tbody></table></div>\n";
}

std::string data_html(const json& loop) {
  json data = {{"picture", loop.at("picture")}, {"start_s", nullptr}};
  const json& start = loop.at("import").at("start");
  if (start.is_string()) {
    const auto at = record::parse_time(start.get<std::string>(), record::TimeForm::ymd);
    if (at) data["start_s"] = static_cast<double>(at->whole_s) + at->rest_s;
  }
  std::string text = data.dump();
  for (std::size_t at = 0; (at = text.find('<', at)) != std::string::npos;) {
    text.replace(at, 1, "\\u003c");
  }
  return "<script type=\"application/json\" id=\"data\">" + text + "</script>\n";
}

std::string loop_page(const json& loop, const json& groups, const LoopNames& pages) {
  const std::string tag = loop.at("shown").get<std::string>();
  std::string html = head(tag, "../assets/") +
                     "<link rel=\"stylesheet\" href=\"../assets/uPlot.min.css\">\n</head><body>\n";
  html += fmt::format(
      "<p><a href=\"../survey.html\">Survey</a></p>\n<h1>{}. {}: <span "
      "class=\"{}\">{}</span></h1>\n",
      loop.at("rank").get<int>(), tag_html(tag), loop.at("verdict").get<std::string>(),
      escaped(surveyed_verdict(loop)));
  html +=
      fmt::format("<p><b>{}</b>: {}.</p>\n", escaped(loop.at("next").at("what").get<std::string>()),
                  escaped(loop.at("next").at("why").get<std::string>()));
  html +=
      facts_html(loop, groups, pages) + pictures_html(loop) + windows_html(loop) + data_html(loop);
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
  LoopNames pages;
  std::set<std::string> written;
  for (const json& loop : survey.at("loops")) {
    pages[loop.at("tag").get<std::string>()] = {page_name(loop),
                                                loop.at("shown").get<std::string>()};
    written.insert(page_name(loop));
  }
  for (const json& loop : survey.at("loops")) {
    files.add(out / "pages" / page_name(loop), loop_page(loop, survey.at("groups"), pages));
  }
  // Deletes pages of an earlier run without a link to them.
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(out / "pages", none)) {
    if (entry.path().extension() == ".html" &&
        written.count(entry.path().filename().string()) == 0) {
      fs::remove(entry.path(), none);
    }
  }
  files.add(out / "survey.html", list_page(survey, pages));
}

}  // namespace loopwarden::workbench
