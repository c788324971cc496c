// SPDX-License-Identifier: Apache-2.0
#include "workbench/report/gap_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "base/text.hpp"
#include "config/loop_model_writer.hpp"
#include "model/effects/catalogue.hpp"
#include "model/gap/say.hpp"
#include "workbench/report/assets.hpp"
#include "workbench/report/chart.hpp"
#include "workbench/report/gap_report_plots.hpp"
#include "workbench/text/line_diff.hpp"
#include "workbench/report/next_test_section.hpp"
#include "workbench/text/next_test_text.hpp"
#include "workbench/text/posterior_bars.hpp"
#include "workbench/report/palette.hpp"
#include "workbench/report/plot.hpp"

namespace loopwarden::workbench {
namespace {

constexpr std::size_t kDiffContext = 3;  // lines around a change

std::string percent(double value) {
  return std::isfinite(value) ? fmt::format("{:.1f} %", value) : "-";
}

std::string percent_of(double value, double span) { return percent(100.0 * value / span); }

// Returns a parameter as a share of the span of CO or PV; "-" if it has another unit.
std::string of_span(double value, std::string_view unit, const plant::LoopModel& model) {
  if (unit == "CO units") {
    return percent_of(value, model.controller.output.high - model.controller.output.low);
  }
  if (unit == "PV units") {
    return percent_of(value, model.transmitter.span());
  }
  return "-";
}

std::string sureness(double confidence) {
  return std::isfinite(confidence) ? fmt::format("{:.0f} %", 100.0 * confidence) : "-";
}

std::string span_text(double from_s, double to_s) {
  if (!std::isfinite(from_s) && !std::isfinite(to_s)) return "";
  return fmt::format("{} to {} s", plain_number(from_s), plain_number(to_s));
}

// Returns a name as words.
std::string words(std::string_view name) { return escaped(base::in_words(name)); }

std::string join_words(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + words(name);
  return text;
}

const char* verdict_words(gap::Outcome outcome) {
  switch (outcome) {
    case gap::Outcome::missing_effect: return "The model lacks something";
    case gap::Outcome::no_gap: return "Model and record agree";
    case gap::Outcome::unexplained: break;
  }
  return "Unexplained";
}

// Returns the first sentence of the page if the result has no sentence.
std::string lead(const gap::Result& result) {
  if (!result.sentence.empty()) return escaped(result.sentence);
  if (!result.check.usable) return "The record can't be compared with the model.";
  switch (result.outcome) {
    case gap::Outcome::missing_effect: {
      std::vector<std::string> names;
      for (const gap::FoundEffect& effect : result.effects) names.push_back(effect.spec.name);
      return "The model lacks " + (names.empty() ? "an effect" : join_words(names)) + ".";
    }
    case gap::Outcome::no_gap: return "The model explains the record down to its noise.";
    case gap::Outcome::unexplained: break;
  }
  return "Model and record differ, and no effect of the catalogue explains why.";
}

struct ParameterWords {
  std::string unit;
  std::string meaning;
};

ParameterWords describe(const std::string& effect, const std::string& parameter) {
  if (const effects::Descriptor* info = effects::find_word(effect)) {
    for (const effects::ParameterInfo& p : info->parameters) {
      if (parameter == p.name) return {p.unit, p.meaning};
    }
  }
  return {};
}

std::string short_spec(const effects::EffectSpec& spec) {
  std::string text;
  const auto add = [&](const std::string& item) { text += (text.empty() ? "" : ", ") + item; };
  for (const auto& [name, value] : spec.options) {
    if (name != "description") add(escaped(name) + " " + words(value));  // in the sentence
  }
  for (const auto& [name, value] : spec.parameters) {
    add(escaped(name) + " " + plain_number(value));
  }
  if (!spec.table.empty()) add(fmt::format("table of {} points", spec.table.size()));
  return text;
}

// Draws a bar of `share` of the full width, with a line at the noise floor.
std::string bar(double share, const char* style, double floor_share = -1.0) {
  const double width = std::isfinite(share) ? std::clamp(share, 0.0, 1.0) * 100.0 : 0.0;
  std::string text = fmt::format(
      "<svg class=\"bar\" viewBox=\"0 0 100 10\" preserveAspectRatio=\"none\" aria-hidden=\"true\">"
      "<rect class=\"rest\" width=\"100\" height=\"10\"/>"
      "<rect class=\"{}\" width=\"{:.2f}\" height=\"10\"/>",
      style, width);
  if (floor_share >= 0.0) {
    text += fmt::format("<line class=\"floor\" x1=\"{0:.2f}\" x2=\"{0:.2f}\" y1=\"0\" y2=\"10\"/>",
                        100.0 * std::min(floor_share, 1.0));
  }
  return text + "</svg>";
}

class Page {
 public:
  Page(const gap::Result& result, const GapReportContext& context)
      : result_(result), context_(context) {}

  std::string write() {
    head();
    refusal();
    posterior();
    plots();
    missing();
    next_test();
    tiles();
    located();
    steps();
    candidates();
    parameters();
    record();
    model_diff();
    commands();
    add("<footer>loopwarden {}, {:.2f} s of work.</footer></main><script>{}\n{}</script>"
        "</body></html>\n",
        escaped(context_.version),
        std::isfinite(context_.seconds_of_work) ? context_.seconds_of_work : 0.0, kUplotScript,
        kGapReportScript);
    return std::move(text_);
  }

 private:
  template <class... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Args>(args)...);
  }

  void head() {
    add("<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">"
        // The page can't load anything, even if an escape were missed.
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; "
        "style-src 'unsafe-inline'; script-src 'unsafe-inline'\">"
        "<title>Gap: {}</title><style>{}{}{}</style></head><body><main>\n",
        escaped(context_.record), palette_style(), kUplotStyle, kGapReportStyle);
    add("<header><p class=\"kind\">Gap report: {} against {}</p>"
        "<span class=\"verdict {}\">{}</span><h1>{}</h1></header>\n",
        escaped(context_.record), escaped(context_.model),
        result_.check.usable ? gap::to_text(result_.outcome) : "unexplained",
        result_.check.usable ? verdict_words(result_.outcome) : "Record refused", lead(result_));
  }

  void tile(const char* name, const std::string& value, const std::string& more) {
    add("<div class=\"tile\"><dt>{}</dt><dd><b>{}</b><span>{}</span></dd></div>", name, value,
        more);
  }

  void tiles() {
    if (!result_.check.usable) return;
    const gap::Misfit& before = result_.before;
    const gap::Misfit& after = result_.after;
    add("<dl class=\"tiles\">");
    if (result_.outcome == gap::Outcome::missing_effect) {
      tile("RMS error above the noise floor that is closed",
           percent(
               gap_closed_percent(before.holdout_rmse, after.holdout_rmse, result_.floor.rmse())),
           fmt::format("of RMS values, not squared; on the held-back part, from {} s on",
                       plain_number(result_.holdout_from_s)));
    }
    const auto share = [&](double value) { return of_span(value, "PV units", result_.model); };
    tile("RMS error of PV, held-back part",
         fmt::format("{} &rarr; {}", share(before.holdout_rmse), share(after.holdout_rmse)),
         fmt::format("of span: {} &rarr; {} PV units; noise floor {}",
                     plain_number(before.holdout_rmse), plain_number(after.holdout_rmse),
                     plain_number(result_.floor.rmse())));
    tile("Noise floor, transmitter and disturbance",
         fmt::format("{} and {}", plain_number(result_.floor.transmitter_rmse),
                     plain_number(result_.floor.load_rmse)),
         load_words());
    tile("Fit, held-back part",
         fmt::format("{} &rarr; {}", percent(before.holdout_fit_percent),
                     percent(after.holdout_fit_percent)),
         "of the standard deviation of PV");
    if (has_controller_gap(result_)) {
      tile("RMS error of CO",
           fmt::format("{} &rarr; {}", plain_number(result_.controller_before_rmse),
                       plain_number(result_.controller_after_rmse)),
           "CO units; controller from SP and PV");
    }
    if (result_.remainder) {
      tile("Remaining error on the held-back part", plain_number(result_.remainder->rmse),
           result_.remainder->depends_on.empty()
               ? "PV units; it does not follow SP or CO"
               : "PV units; it follows " + depends_on_words(*result_.remainder));
    }
    if (result_.load_intensity > 0.0) {
      tile("Unmeasured load", plain_number(result_.load_intensity),
           "PV units per root second, modelled");
    }
    if (!result_.effects.empty()) {
      double least = 1.0;
      for (const gap::FoundEffect& effect : result_.effects) {
        if (!(effect.confidence >= least)) least = effect.confidence;  // NaN as well
      }
      tile("How sure", sureness(least),
           result_.effects.size() > 1 ? "confidence of the least certain name"
                                      : "probability that the name is right");
    }
    add("</dl>\n");
  }

  std::string load_words() const {
    const gap::Floor& floor = result_.floor;
    if (!floor.load_tested) {
      return "PV units; the remaining error cannot be tested for a disturbance: " +
             escaped(floor.why_not_tested);
    }
    return floor.load_rmse > 0.0 ? "PV units; the remaining error does not follow SP or CO"
                                 : "PV units; the remaining error does not look like a disturbance";
  }

  static std::string depends_on_words(const gap::Remainder& remainder) {
    std::string words;
    for (const std::string& signal : remainder.depends_on) {
      words += (words.empty() ? "" : " and ") + std::string(signal == "sp" ? "SP" : "CO");
    }
    return words;
  }

  void refusal() {
    if (result_.check.usable) return;
    add("<div class=\"refusal\"><h3>Why</h3><p>{}</p></div>\n",
        result_.check.refusal.empty() ? "No reason given." : escaped(result_.check.refusal));
  }

  void posterior() {
    constexpr std::size_t kMost = 5;
    const std::vector<Bar> bars = posterior_bars(result_.posterior, kMost);
    if (bars.empty()) return;
    add("<figure class=\"posterior\"><figcaption><b>What the model lacks</b> Probability of each "
        "explanation.</figcaption><table class=\"shares\"><tbody>");
    for (const Bar& one : bars) {
      add("<tr><td>{}</td><td class=\"b\">{}</td><td class=\"n\">{}</td></tr>", escaped(one.title),
          bar(one.probability, one.named ? "v" : "w"), sureness(one.probability));
    }
    add("</tbody></table></figure>\n");
  }

  void missing() {
    if (result_.effects.empty()) return;
    add("<h2>What the model lacks</h2>\n");
    for (const gap::FoundEffect& effect : result_.effects) {
      const effects::Descriptor* info = effects::find_effect(effect.spec.name);
      add("<div class=\"effect\"><h3>{}</h3><p class=\"note\">{}{}, {} sure</p>",
          words(effect.spec.name), effects::to_text(effect.block),
          info == nullptr ? std::string() : fmt::format("; {}", escaped(info->meaning)),
          sureness(effect.confidence));
      if (const std::string size = short_spec(effect.spec); !size.empty()) {
        add("<p><b>{}</b></p>", size);
      }
      if (!effect.evidence.empty()) add("<p>Evidence: {}.</p>", escaped(effect.evidence));
      if (!effect.alternatives.empty()) {
        add("<p>This record can't distinguish it from: {}.</p>", join_words(effect.alternatives));
      }
      if (info != nullptr) add("<p><b>Action.</b> {}</p>", escaped(info->remedy));
      add("</div>\n");
    }
  }

  void next_test() {
    if (!result_.why_no_test.empty()) {
      add("<h2>Next test</h2><p>No small test decides. {}</p>\n", escaped(result_.why_no_test));
    }
    if (!result_.next_test) return;
    const gap::NextTest& test = *result_.next_test;
    add("<h2>Next test: {}</h2>{}", escaped(joined(names_of(test), " or ")),
        next_test_section(test));
  }

  void plots() {
    const std::string plots = gap_plots_html(result_);
    if (plots.empty()) return;
    add("<h2>Measured, before and after</h2>\n{}\n", plots);
  }

  // Rows by block are distinguished by the block itself.
  static std::string place_of(const gap::Located& row) {
    std::string block = effects::to_text(row.block);
    if (row.what.empty() || row.what == block) return block;
    if (row.by != gap::LocatedBy::block) return escaped(row.what);
    return fmt::format("{} <span class=\"note\">{}</span>", block, escaped(row.what));
  }

  void located() {
    if (result_.located.empty()) return;
    add("<h2>Location of the error</h2>\n<p class=\"note\">The squared residual of the model as "
        "given, split in three ways. The spans link to the plots.</p>\n");
    for (const auto& [by, title] :
         {std::pair{gap::LocatedBy::block, "By block"}, std::pair{gap::LocatedBy::time, "By time"},
          std::pair{gap::LocatedBy::condition, "By condition"}}) {
      std::vector<const gap::Located*> rows;
      for (const gap::Located& row : result_.located) {
        if (row.by == by) rows.push_back(&row);
      }
      if (rows.empty()) continue;
      const bool in_time = by == gap::LocatedBy::time;
      std::stable_sort(rows.begin(), rows.end(), [&](const auto* a, const auto* b) {
        return !in_time && a->share_of_gap > b->share_of_gap;
      });
      add("<h3>{}</h3><div class=\"wide\"><table "
          "class=\"shares\"><thead><tr><th>{}</th><th>share</th>"
          "<th class=\"n\">%</th><th>shows most</th></tr></thead><tbody>",
          title, gap::to_text(by));
      for (const gap::Located* row : rows) {
        const bool links = row->to_s > row->from_s && std::isfinite(row->to_s - row->from_s);
        const std::string span = links ? span_text(row->from_s, row->to_s) : "";
        add("<tr><td>{}</td><td class=\"b\">{}</td><td class=\"n\">{}</td><td>{}</td></tr>",
            place_of(*row), bar(row->share_of_gap, "v"),
            std::isfinite(row->share_of_gap) ? fmt::format("{:.0f}", 100.0 * row->share_of_gap)
                                             : "-",
            links ? fmt::format("<a href=\"#residual\" data-from=\"{}\" data-to=\"{}\">{}</a>",
                                row->from_s, row->to_s, span)
                  : span);
      }
      add("</tbody></table></div>\n");
    }
  }

  void steps() {
    if (result_.steps.empty() && !std::isfinite(result_.before.rmse)) return;
    struct Row {
      std::string name;
      double fit;
      double holdout;
    };
    const gap::Misfit& before = result_.before;
    std::vector<Row> rows{{"model as given",
                           std::isfinite(before.training_rmse) ? before.training_rmse : before.rmse,
                           before.holdout_rmse}};
    for (const gap::Step& step : result_.steps) {
      rows.push_back({"+ " + words(step.effect), step.rmse, step.holdout_rmse});
    }
    double most = std::isfinite(result_.floor.rmse()) ? result_.floor.rmse() : 0.0;
    for (const Row& row : rows) {
      if (std::isfinite(row.fit)) most = std::max(most, row.fit);
      if (std::isfinite(row.holdout)) most = std::max(most, row.holdout);
    }
    if (!(most > 0.0)) most = 1.0;
    const double floor = result_.floor.rmse() / most;
    add("<h2>The gap, step by step</h2>\n<p class=\"note\">RMS error of PV, PV units. The line in "
        "the bars is the noise floor, {}: a model can't close more.</p>\n"
        "<div class=\"wide\"><table><thead><tr><th>model</th><th>fitted part</th><th class=\"n\">"
        "RMS</th><th>held-back part</th><th class=\"n\">RMS</th></tr></thead><tbody>",
        plain_number(result_.floor.rmse()));
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const char* style = i == 0 ? "w" : "v";
      add("<tr><td>{}</td><td class=\"b\">{}</td><td class=\"n\">{}</td><td class=\"b\">{}</td>"
          "<td class=\"n\">{}</td></tr>",
          rows[i].name, bar(rows[i].fit / most, style, floor), plain_number(rows[i].fit),
          bar(rows[i].holdout / most, style, floor), plain_number(rows[i].holdout));
    }
    add("</tbody></table></div>\n");
  }

  void candidates() {
    if (result_.candidates.empty()) return;
    std::vector<const gap::TriedCandidate*> rows;
    double most = 0.0;
    for (const gap::TriedCandidate& row : result_.candidates) {
      rows.push_back(&row);
      if (std::isfinite(row.score)) most = std::max(most, row.score);
    }
    const auto rank = [](const gap::TriedCandidate* c) {
      return std::isfinite(c->score) ? c->score : -std::numeric_limits<double>::infinity();
    };
    std::stable_sort(rows.begin(), rows.end(),
                     [&](const auto* a, const auto* b) { return rank(a) > rank(b); });
    add("<h2>Tried effects</h2>\n<p class=\"note\">Each effect of the catalogue, fitted separately "
        "to "
        "the error of the model. Score: log likelihood less a penalty for its parameters, over the "
        "model as given.</p>\n<div class=\"wide\"><table "
        "class=\"tried\"><thead><tr><th>effect</th><th>block</th>"
        "<th>fitted</th><th class=\"n\">RMS</th><th>score</th><th class=\"n\"></th>"
        "<th>why not</th></tr></thead><tbody>");
    for (const gap::TriedCandidate* c : rows) {
      add("<tr><td>{}</td><td>{}</td><td>{}</td><td class=\"n\">{}</td><td class=\"b\">{}</td>"
          "<td class=\"n\">{}</td><td>{}</td></tr>",
          c->chosen ? "<b>" + words(c->name) + "</b>" : words(c->name), effects::to_text(c->block),
          short_spec(c->spec), plain_number(c->rmse),
          bar(most > 0.0 ? c->score / most : 0.0, c->chosen ? "v" : "w"),
          std::isfinite(c->score) ? fmt::format("{:.0f}", c->score) : "-",
          c->chosen ? "<b>chosen</b>" : escaped(c->why_not));
    }
    add("</tbody></table></div>\n");
  }

  void parameters() {
    if (!result_.check.usable) return;
    add("<h2>Parameters</h2>\n");
    if (!result_.effects.empty()) {
      add("<div class=\"wide\"><table><caption>Effects, with 95 % intervals</caption><thead><tr>"
          "<th>effect</th><th>parameter</th><th class=\"n\">value</th><th class=\"n\">from</th>"
          "<th class=\"n\">to</th><th>unit</th><th class=\"n\">of span</th><th>meaning</th></tr>"
          "</thead><tbody>");
      for (const gap::FoundEffect& effect : result_.effects) {
        for (const auto& [name, value] : effect.spec.parameters) {
          const auto interval = effect.interval.find(name);
          const bool known = interval != effect.interval.end();
          const ParameterWords about = describe(effect.spec.name, name);
          add("<tr><td>{}</td><td><code>{}</code></td><td class=\"n\">{}</td><td class=\"n\">{}"
              "</td><td class=\"n\">{}</td><td>{}</td><td class=\"n\">{}</td><td>{}</td></tr>",
              words(effect.spec.name), escaped(name), plain_number(value),
              known ? plain_number(interval->second[0]) : "-",
              known ? plain_number(interval->second[1]) : "-", escaped(about.unit),
              of_span(value, about.unit, result_.model), escaped(about.meaning));
        }
      }
      add("</tbody></table></div>\n");
    }
    add("<div class=\"wide\"><table><caption>Process, free only within its stated uncertainty"
        "</caption><thead><tr><th>parameter</th><th class=\"n\">as given</th>"
        "<th class=\"n\">corrected</th><th class=\"n\">moved</th><th class=\"n\">allowed</th>"
        "</tr></thead><tbody>");
    const plant::ProcessParameters& a = result_.model.process;
    const plant::ProcessParameters& b = result_.corrected.process;
    const plant::ProcessUncertainty& u = result_.model.uncertainty;
    process_row("gain, PV units/CO unit", a.gain, b.gain, u.gain);
    process_row("time constant, s", a.time_constant_s, b.time_constant_s, u.time_constant);
    process_row("dead time, s", a.dead_time_s, b.dead_time_s, u.dead_time);
    add("</tbody></table></div>\n");
  }

  void process_row(const char* name, double before, double after, double allowed) {
    const double moved =
        before != 0.0 ? 100.0 * (after / before - 1.0) : std::numeric_limits<double>::quiet_NaN();
    add("<tr><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td>"
        "<td class=\"n\">&plusmn;{}</td></tr>",
        name, plain_number(before), plain_number(after),
        std::isfinite(moved) ? fmt::format("{:+.1f} %", moved) : "-", percent(100.0 * allowed));
  }

  void record() {
    const gap::RecordCheck& check = result_.check;
    add("<h2>The record</h2>\n<div class=\"wide\"><table><tbody>");
    const auto row = [&](const char* name, const std::string& value) {
      add("<tr><td>{}</td><td>{}</td></tr>", name, value);
    };
    const std::size_t samples = result_.series.pv.size();
    if (samples > 0) row("samples", fmt::format("{}", samples));
    row("noise of PV", plain_number(check.noise_rms) + " PV units, from the record itself");
    if (check.pv_resolution > 0.0) {
      row("resolution of PV", plain_number(check.pv_resolution) + " PV units");
    }
    if (check.co_resolution > 0.0) {
      row("resolution of CO", plain_number(check.co_resolution) + " CO units");
    }
    if (!result_.closed_loop) {
      row("CO moves over", plain_number(check.output_span_used) + " CO units");
      row("CO reverses", fmt::format("{} times beyond its noise", check.output_reversals));
    } else {
      row("CO", "not measured: compared as a closed loop");
    }
    for (const gap::RecordNote& note : check.notes) {
      const std::string span = span_text(note.from_s, note.to_s);
      add("<tr><td>{}</td><td>{}{}</td></tr>", escaped(note.what), escaped(note.text),
          span.empty() ? "" : fmt::format(" <span class=\"note\">({})</span>", span));
    }
    add("</tbody></table></div>\n");
  }

  void model_diff() {
    if (context_.corrected_text.empty()) return;
    std::vector<DiffLine> lines = line_diff(context_.model_text, context_.corrected_text);
    const auto changes = [](const std::vector<DiffLine>& diff) {
      return static_cast<std::size_t>(std::count_if(
          diff.begin(), diff.end(), [](const auto& l) { return l.kind != DiffLine::Kind::same; }));
    };
    const char* how = "Lines taken out and put in.";
    if (2 * changes(lines) > lines.size()) {
      // A different layout would hide the changes, so the contents are compared.
      std::vector<DiffLine> same_layout =
          line_diff(config::write_model(result_.model), config::write_model(result_.corrected));
      if (const std::size_t n = changes(same_layout); n > 0 && n < changes(lines)) {
        lines = std::move(same_layout);
        how = "Lines taken out and put in; both models in the layout of the corrected file.";
      }
    }
    add("<h2>The model file</h2>\n<p class=\"note\">{}</p>\n<pre class=\"diff\">", how);
    if (changes(lines) == 0) add("<span class=\"cut\">no difference</span>");
    std::vector<bool> near(lines.size(), false);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      if (lines[i].kind == DiffLine::Kind::same) continue;
      const std::size_t first = i - std::min(i, kDiffContext);
      for (std::size_t k = first; k < std::min(lines.size(), i + kDiffContext + 1); ++k) {
        near[k] = true;
      }
    }
    for (std::size_t i = 0; i < lines.size(); ++i) {
      if (!near[i]) {
        if (i > 0 && near[i - 1]) add("<span class=\"cut\">...</span>");
        continue;
      }
      switch (lines[i].kind) {
        case DiffLine::Kind::same: add("<span>  {}</span>", escaped(lines[i].text)); break;
        case DiffLine::Kind::removed:
          add("<span class=\"removed\">- {}</span>", escaped(lines[i].text));
          break;
        case DiffLine::Kind::added:
          add("<span class=\"added\">+ {}</span>", escaped(lines[i].text));
          break;
      }
    }
    add("</pre>\n");
  }

  void commands() {
    std::string lines;
    if (context_.record_stays) {
      lines = fmt::format("loopwarden gap {} --model {} --out {}{}{}\n",
                          base::as_shell_word(context_.record), base::as_shell_word(context_.model),
                          base::as_shell_word(context_.out), context_.options.empty() ? "" : " ",
                          context_.options);
    }
    if (!context_.corrected_text.empty()) {
      lines += fmt::format("loopwarden simulate {} --out {}\n",
                           base::as_shell_word(context_.out + "/model.corrected.yaml"),
                           base::as_shell_word(context_.out + "/simulated.csv"));
    }
    add("<h2>Again</h2>\n<p class=\"note\">{}</p>\n",
        context_.record_stays ? "The same record and model give the same result."
                              : "The record is from the daemon's recorder. If the daemon requested "
                                "this report, the record is not stored.");
    if (!lines.empty()) add("<pre>{}</pre>\n", escaped(lines));
  }

  const gap::Result& result_;
  const GapReportContext& context_;
  std::string text_;
};

}  // namespace

double gap_closed_percent(double before_rmse, double after_rmse, double floor_rmse) {
  return 100.0 * gap::rms_closed(before_rmse, after_rmse, floor_rmse);
}

std::string gap_report_html(const gap::Result& result, const GapReportContext& context) {
  return Page(result, context).write();
}

}  // namespace loopwarden::workbench
