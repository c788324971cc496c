// SPDX-License-Identifier: Apache-2.0
#include "workbench/report/gap_report.hpp"

#include <catch2/catch.hpp>
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "config/loop_model_writer.hpp"
#include "tests/workbench/report/gap_result_support.hpp"

namespace loopwarden::tests::gap_report_test {
namespace {

using workbench::gap_report_html;
using workbench::GapReportContext;

GapReportContext context_of(const gap::Result& result) {
  return {.record = "record.csv",
          .model = "model.yaml",
          .model_text = config::write_model(result.model),
          .corrected_text = config::write_model(result.corrected),
          .out = "found",
          .options = "--without load",
          .seconds_of_work = 1.5,
          .version = "1.2.3"};
}

std::string page_of(const gap::Result& result) {
  return gap_report_html(result, context_of(result));
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

// Returns the page without the content of its styles and scripts, whose braces and arrows are no
// markup.
std::string markup_of(std::string page) {
  for (const std::string tag : {"style", "script"}) {
    for (std::size_t at = page.find("<" + tag); at != std::string::npos;
         at = page.find("<" + tag, at + 1)) {
      const std::size_t begin = page.find('>', at) + 1;
      const std::size_t end = page.find("</" + tag + ">", at);
      REQUIRE(begin <= end);
      page.erase(begin, end - begin);
    }
  }
  return page;
}

// Returns the data that the page's script draws.
nlohmann::json data_of(const std::string& page) {
  const std::string begin = "<script type=\"application/json\" id=\"data\">";
  const std::size_t at = page.find(begin);
  REQUIRE(at != std::string::npos);
  const std::size_t from = at + begin.size();
  return nlohmann::json::parse(page.substr(from, page.find("</script>", from) - from));
}

// Returns an error in the nesting of the tags or in an attribute, or an empty text.
std::string markup_error(const std::string& page) {
  const std::set<std::string> empty_tags{"meta", "!DOCTYPE"};
  const std::string text = markup_of(page);
  std::vector<std::string> open;
  for (std::size_t i = text.find('<'); i != std::string::npos; i = text.find('<', i)) {
    std::size_t end = i + 1;
    bool quoted = false;
    while (end < text.size() && (quoted || text[end] != '>')) {
      if (text[end] == '"') quoted = !quoted;
      if (text[end] == '<') return "'<' within a tag: " + text.substr(i, 60);
      ++end;
    }
    if (end == text.size()) return "tag without an end: " + text.substr(i, 60);
    const std::string tag = text.substr(i + 1, end - i - 1);
    const bool closes = tag.starts_with('/');
    const std::string name =
        tag.substr(closes ? 1 : 0, tag.find_first_of(" /", 1) - (closes ? 1 : 0));
    if (closes) {
      const std::string closed = tag.substr(1);
      if (open.empty() || open.back() != closed) return "</" + closed + "> closes nothing";
      open.pop_back();
    } else if (!tag.ends_with('/') && !empty_tags.contains(name)) {
      open.push_back(name);
    }
    i = end;
  }
  return open.empty() ? "" : "<" + open.back() + "> stays open";
}

// Returns whether the visible text contains a word for a value that is not finite.
bool shows_nan(const std::string& page) {
  const std::string text = markup_of(page);
  for (const char* word : {"nan", "inf"}) {
    for (std::size_t i = text.find(word); i != std::string::npos; i = text.find(word, i + 1)) {
      const bool before = i > 0 && std::isalpha(static_cast<unsigned char>(text[i - 1])) != 0;
      const bool after = std::isalpha(static_cast<unsigned char>(text[i + 3])) != 0;
      if (!before && !after) return true;
    }
  }
  return false;
}

void check_page(const gap::Result& result) {
  const std::string page = page_of(result);
  CHECK(markup_error(page) == "");
  CHECK_FALSE(shows_nan(page));
}

TEST_CASE("the page shows both floors, and what the remaining error follows", "[report]") {
  gap::Result result = complete_gap_result();
  const std::string page = page_of(result);
  CHECK(contains(page, "Noise floor, transmitter and disturbance</dt><dd><b>0.012 and 0.005</b>"));
  CHECK(contains(page, "the remaining error does not follow SP or CO"));
  // 0.33 - 0.021 of 0.33 - 0.013
  CHECK(contains(page, "<b>97.5 %</b>"));
  CHECK(contains(page, "of RMS values, not squared"));
  CHECK(contains(page, "it follows SP and CO"));
  result.floor = {.transmitter_rmse = 0.012, .why_not_tested = "SP is constant there"};
  CHECK(contains(page_of(result), "cannot be tested for a disturbance: SP is constant there"));
}

TEST_CASE("the report shows all findings, with the sentence first", "[gap][report]") {
  const gap::Result result = complete_gap_result();
  const std::string page = page_of(result);
  CHECK(markup_error(page) == "");
  const std::size_t sentence = page.find("<h1>" + result.sentence + "</h1>");
  CHECK(sentence < page.find("<h2>"));
  CHECK(contains(page, "The stem rests after each of 41 reversals."));
  CHECK(contains(page, "can't distinguish it from: backlash"));
  CHECK(contains(page, "leaves the jumps"));
  CHECK(contains(page, "after the output reverses"));
  CHECK(contains(page, "2 samples of PV are missing."));
  CHECK(contains(page, "0.88"));
  CHECK(contains(page, "deadband + stickband"));
  CHECK(contains(page, "<span class=\"added\">+     - {effect: stiction"));
  CHECK(contains(page, "+1.0 %"));  // how far the gain moved
  CHECK(contains(page, "loopwarden gap record.csv --model model.yaml --out found --without load"));
  CHECK(contains(page, "loopwarden 1.2.3"));
  CHECK(contains(page, "<b>Stem over CO</b>"));
  CHECK(contains(page, "<b>PV over stem</b>"));
  // The sentence, the probabilities, then PV before and after.
  const std::size_t bars = page.find("<figure class=\"posterior\">");
  CHECK(sentence < bars);
  CHECK(bars < page.find("id=\"trend\""));
  CHECK(page.find("id=\"trend\"") < page.find("class=\"effect\""));
  CHECK(contains(page, "<td>none of these</td>"));
}

TEST_CASE("the report opens without a network", "[gap][report]") {
  const std::string page = page_of(complete_gap_result());
  // The name of SVG's namespace is no address.
  const std::string markup =
      std::regex_replace(markup_of(page), std::regex(" xmlns=\"[^\"]*\""), "");
  for (const char* loads :
       {"http:", "https:", "src=", "@import", "url(", "<link", "<iframe", "<object", "<img"}) {
    INFO(loads);
    CHECK_FALSE(contains(markup, loads));
  }
  for (const char* loads : {"@import", "url(", "fetch(", "XMLHttpRequest", "new Worker"}) {
    INFO(loads);
    CHECK_FALSE(contains(page, loads));
  }
  CHECK(contains(page, "default-src 'none'"));
  for (std::size_t i = page.find("href="); i != std::string::npos; i = page.find("href=", i + 1)) {
    CHECK(page.substr(i, 7) == "href=\"#");
  }
}

TEST_CASE("the located moments are shaded and the held-out part is marked", "[gap][report]") {
  gap::Result result = complete_gap_result();
  const std::string page = page_of(result);
  const auto& time = result.series.time_s;
  // Samples 200 to 300 and 220 to 250 are shaded. The whole record, its remaining part and the
  // blocks are not.
  const nlohmann::json data = data_of(page);
  const nlohmann::json& shades = data.at("plots").at(1).at("shades");
  REQUIRE(shades.size() == 2);
  CHECK(shades.at(0).at(0).get<double>() == Approx(time[200]));
  CHECK(shades.at(0).at(1).get<double>() == Approx(time[300]));
  CHECK(shades.at(1).at(0).get<double>() == Approx(time[220]));
  CHECK(shades.at(1).at(1).get<double>() == Approx(time[250]));
  CHECK(data.at("held_from_s").get<double>() == Approx(time[400]));
  // The printed picture has them as well.
  CHECK(contains(page, "fill-opacity=\"0.24\""));
  CHECK(contains(page, "<title>held out</title>"));
  result.holdout_from_s = 0.0;
  CHECK_FALSE(contains(page_of(result), "<title>held out</title>"));
  CHECK(data_of(page_of(result)).at("held_from_s").is_null());
}

TEST_CASE("the page's script gets every curve with its gaps and its peak", "[gap][report]") {
  gap::Result result = complete_gap_result(20'000);
  for (std::size_t k = 100; k < 200; ++k) result.series.pv[k] = gap::kNone;
  result.series.pv[12'345] = 77.0;
  const nlohmann::json data = data_of(page_of(result));
  CHECK(data.at("samples") == 20'000);
  const nlohmann::json& curves = data.at("plots").at(0).at("curves");
  REQUIRE(curves.size() == 4);
  CHECK(curves.at(3).at("name") == "measured");
  const auto k = curves.at(3).at("k").get<std::vector<std::size_t>>();
  const nlohmann::json& y = curves.at(3).at("y");
  REQUIRE(k.size() == y.size());
  bool gap = false;
  bool peak = false;
  for (std::size_t i = 0; i < k.size(); ++i) {
    if (i > 0) CHECK(k[i] > k[i - 1]);
    gap = gap || (y.at(i).is_null() && k[i] >= 100 && k[i] < 200);
    peak = peak || (k[i] == 12'345 && y.at(i) == 77.0);
    if (k[i] >= 100 && k[i] < 200) CHECK(y.at(i).is_null());
  }
  CHECK(gap);
  CHECK(peak);
}

TEST_CASE("the controller's curves are shown if the controller contributes to the gap",
          "[gap][report]") {
  gap::Result result = complete_gap_result();
  CHECK_FALSE(contains(page_of(result), "controller as given"));
  result.located[1] = {
      gap::LocatedBy::block, effects::Block::controller, "controller", 0.0, 0.0, 0.2};
  CHECK(contains(page_of(result), "controller as given"));
  result.located.clear();
  result.effects[0].block = effects::Block::controller;
  CHECK(contains(page_of(result), "corrected controller"));
}

TEST_CASE("text from files can't become markup", "[gap][report]") {
  const std::string hostile = "</h1><script>alert('x')</script>\"&\x01";
  gap::Result result = complete_gap_result();
  result.sentence = hostile;
  result.effects[0].spec.name = hostile;
  result.effects[0].spec.parameters = {{hostile, 1.0}};
  result.effects[0].spec.options = {{hostile, hostile}};
  result.effects[0].alternatives = {hostile};
  result.effects[0].evidence = hostile;
  result.check.notes = {{hostile, hostile}};
  result.steps[0].effect = hostile;
  for (gap::Located& located : result.located) located.what = hostile;
  result.candidates[0] = {hostile, effects::Block::valve, {hostile}, 1.0, 1.0, false, hostile};
  GapReportContext context = context_of(result);
  context.record = context.model = context.out = context.version = hostile;
  context.model_text = "a: 1\nb: " + hostile + "\n";
  context.corrected_text = "a: 1\nb: 2\n# " + hostile + "\n";
  const std::string page = gap_report_html(result, context);
  CHECK(markup_error(page) == "");
  CHECK_FALSE(contains(markup_of(page), "<script>alert"));
  CHECK_FALSE(contains(page, "\x01"));
  CHECK(contains(page, "&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt;&quot;&amp;"));
  // A refusal contains text of the record, too.
  result.check.usable = false;
  result.check.refusal = hostile;
  CHECK(markup_error(gap_report_html(result, context)) == "");
}

TEST_CASE("a name with a quote is one word of the command", "[gap][report]") {
  const gap::Result result = complete_gap_result();
  GapReportContext context = context_of(result);
  context.record = "loop 7's.csv";
  CHECK(contains(gap_report_html(result, context),
                 "loopwarden gap &#39;loop 7&#39;\\&#39;&#39;s.csv&#39; --model model.yaml"));
}

TEST_CASE("a record that is not stored appears in no command", "[gap][report]") {
  const gap::Result result = complete_gap_result();
  GapReportContext context = context_of(result);
  CHECK(contains(gap_report_html(result, context), "loopwarden gap record.csv"));
  context.record_stays = false;
  const std::string html = gap_report_html(result, context);
  CHECK_FALSE(contains(html, "loopwarden gap record.csv"));
  CHECK(contains(html, "the record is not stored"));
}

TEST_CASE("100 000 samples make a page below a megabyte", "[gap][report]") {
  gap::Result result = complete_gap_result(100'000);
  for (std::size_t k = 0; k < result.series.pv.size(); ++k) {
    result.series.pv[k] += 0.3 * std::sin(static_cast<double>(k * k % 997));  // no smooth curve
  }
  result.series.pv[54'321] = 77.0;
  const std::string page = page_of(result);
  CHECK(page.size() < 1'000'000);
  CHECK(contains(page, " to 77."));  // the range in the description has the peak
  CHECK(markup_error(page) == "");
}

TEST_CASE("every state of a result makes a page", "[gap][report]") {
  gap::Result result = complete_gap_result();
  SECTION("an empty result") { result = gap::Result{}; }
  SECTION("no gap") {
    result.outcome = gap::Outcome::no_gap;
    result.effects.clear();
    result.steps.clear();
    result.series.pv_after = result.series.pv_before;
    const std::string page = page_of(result);
    CHECK(contains(page, "Model and record agree"));
    CHECK(contains(page, "model as given, unchanged"));
    CHECK_FALSE(contains(page, "that is closed"));
  }
  SECTION("unexplained, without a sentence") {
    result.outcome = gap::Outcome::unexplained;
    result.effects.clear();
    result.sentence.clear();
    CHECK(contains(page_of(result), "no effect of the catalogue explains why"));
  }
  SECTION("refused") {
    result = gap::Result{};
    result.check.usable = false;
    result.check.refusal = "PV is frozen from 3 s on.";
    const std::string page = page_of(result);
    CHECK(contains(page, "PV is frozen from 3 s on."));
    CHECK(contains(page, "Record refused"));
    CHECK_FALSE(contains(page, "agree"));
  }
  SECTION("closed loop without CO") {
    result.closed_loop = true;
    result.series.co.clear();
    result.series.co_before.clear();
    result.series.co_after.clear();
    const std::string page = page_of(result);
    CHECK(contains(page, "driven by SP"));
    CHECK(contains(page, "compared as a closed loop"));
    CHECK_FALSE(contains(page, "PV over CO"));
  }
  SECTION("without SP and corrected model") {
    result.series.sp.clear();
    result.series.pv_after.clear();
    result.series.stem.clear();
    CHECK_FALSE(contains(page_of(result), "over stem"));
  }
  SECTION("columns of other lengths are left out") {
    result.series.pv_before.pop_back();
    result.series.co.clear();
    const nlohmann::json data = data_of(page_of(result));
    for (const nlohmann::json& curve : data.at("plots").at(0).at("curves")) {
      CHECK(curve.at("name") != "model as given");
    }
  }
  SECTION("missing samples") {
    for (std::size_t k = 100; k < 200; ++k) result.series.pv[k] = gap::kNone;
    result.series.pv_before.assign(result.series.pv.size(), gap::kNone);
  }
  SECTION("no finite value") {
    const double none = gap::kNone;
    result.before = result.after = {none, none, none, none, none};
    result.floor.transmitter_rmse = result.load_intensity = none;
    result.controller_before_rmse = result.controller_after_rmse = none;
    result.holdout_from_s = none;
    result.steps = {{"stiction", none, none}};
    for (gap::Located& located : result.located) {
      located.from_s = located.to_s = located.share_of_gap = none;
    }
    for (auto& [name, value] : result.effects[0].spec.parameters) value = none;
    result.effects[0].confidence = none;
    result.effects[0].interval = {{"s", {none, none}}};
    result.check.noise_rms = none;
  }
  SECTION("one sample") {
    result.series = {};
    result.series.time_s = {0.0};
    result.series.pv = {1.0};
  }
  SECTION("a constant PV") {
    result.series.pv.assign(result.series.pv.size(), 5.0);
    result.series.sp.clear();
    result.series.pv_before.clear();
    result.series.pv_after.clear();
  }
  check_page(result);
}

TEST_CASE("share of the gap that was closed", "[gap][report]") {
  using workbench::gap_closed_percent;
  CHECK(gap_closed_percent(0.5, 0.3, 0.3) == Approx(100.0));
  CHECK(gap_closed_percent(0.5, 0.4, 0.3) == Approx(50.0));
  CHECK(gap_closed_percent(0.5, 9.0, 0.3) == -100.0);
  CHECK(gap_closed_percent(0.5, 0.2, 0.3) == 100.0);
  CHECK(std::isnan(gap_closed_percent(0.3, 0.2, 0.3)));
  CHECK(std::isnan(gap_closed_percent(gap::kNone, 0.2, 0.3)));
  CHECK(std::isnan(gap_closed_percent(0.5, gap::kNone, 0.3)));
}

}  // namespace
}  // namespace loopwarden::tests::gap_report_test
