// SPDX-License-Identifier: Apache-2.0
#include "workbench/text/diagnose_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <cmath>

#include "model/diagnosis/limits.hpp"
#include "model/effects/catalogue.hpp"
#include "workbench/text/import_json.hpp"
#include "workbench/text/deciding_test_text.hpp"

namespace loopwarden::workbench {
namespace {

using diagnosis::Cause;
using diagnosis::Diagnosis;
using diagnosis::DiagnosisVerdict;
using diagnosis::Grade;

// Returns the reasons for the verdict, with the figures of this record.
std::string because(const Diagnosis& d) {
  switch (d.verdict) {
    case DiagnosisVerdict::valve_effect:
      return fmt::format(
          "a band of {:.0f} % of CO's movement explains PV better than a small band or no band "
          "({:.0f} "
          "nats), and PV rests during {:.0f} % of CO's moves{}",
          100.0 * d.evidence.share, d.evidence.log_odds, 100.0 * d.evidence.standing,
          d.evidence.reversals.by() == diagnosis::ReversalsBy::travel
              ? "; CO reverses after a fixed travel"
              : "");
    case DiagnosisVerdict::other_cause:
      switch (d.cause) {
        case Cause::master_loop: return "PV swings with its set point, at the same period";
        case Cause::sensor:
        case Cause::neighbour:
        case Cause::no_flow: return d.reason;
        case Cause::saturation:
          if (!d.reason.empty()) return d.reason;
          return fmt::format("CO rests at its limits in {:.0f} % of the samples",
                             100.0 * d.prepared.share_at_limit);
        default:
          return "the loop cycles, and PV follows CO without a band; shapes and timing point to " +
                 std::string(d.cause == Cause::tuning ? "the controller" : "a load");
      }
    case DiagnosisVerdict::healthy:
      return "PV follows CO without a band, and the loop does not cycle";
    case DiagnosisVerdict::not_enough_data:
    case DiagnosisVerdict::cant_tell: return d.reason;
  }
  return {};
}

// Returns the reason against the verdict; may be empty.
std::string against(const Diagnosis& d) {
  if (!d.judged() || d.verdict == DiagnosisVerdict::cant_tell) return {};
  if (d.verdict != DiagnosisVerdict::valve_effect) {
    if (d.evidence.log_odds < diagnosis::DiagnosisLimits::kNamedFrom) return {};
    return "a band explains PV better than a small band or no band";
  }
  return d.evidence.standing < diagnosis::DiagnosisLimits::kStandsFrom
             ? "PV moves during most of CO's moves"
             : "";
}

nlohmann::json effects_of(const Diagnosis& d, double probability, double span) {
  nlohmann::json effects = nlohmann::json::array();
  if (d.verdict != DiagnosisVerdict::valve_effect) return effects;
  nlohmann::json parameters;
  const bool sticks = d.cause == Cause::stiction;
  if (sticks) {
    parameters = {{"s", d.s}};
  } else {
    parameters = {{"deadband", d.s}};
  }
  nlohmann::json alternatives = nlohmann::json::array();
  if (d.alternative != Cause::none) alternatives.push_back(to_text(d.alternative));
  effects.push_back(
      {{"name", to_text(d.cause)},
       {"block", "valve"},
       {"parameters", parameters},
       {"percent_of_span", 100.0 * d.s / span},
       {"confidence", probability * (sticks ? d.stiction_share : 1.0 - d.stiction_share)},
       {"alternatives", alternatives},
       {"interval", {{sticks ? "s" : "deadband", {d.s_low, d.s_high}}}},
       {"evidence", because(d)}});
  return effects;
}

nlohmann::json or_null(const std::string& text) {
  return text.empty() ? nlohmann::json(nullptr) : nlohmann::json(text);
}

nlohmann::json json_of(const Diagnosis& d, double probability, double span) {
  const bool open =
      d.verdict == DiagnosisVerdict::not_enough_data || d.verdict == DiagnosisVerdict::cant_tell;
  nlohmann::json result = {
      {"verdict", to_text(d.verdict)},
      {"grade",
       d.verdict == DiagnosisVerdict::valve_effect ? nlohmann::json(to_text(d.grade)) : nullptr},
      {"effects", effects_of(d, probability, span)},
      {"cause",
       d.verdict == DiagnosisVerdict::other_cause ? nlohmann::json(to_text(d.cause)) : nullptr},
      {"reason", open ? or_null(d.reason) : nullptr},
      {"settle", open ? or_null(d.settle) : nullptr},
      {"oscillating", d.oscillating},
      {"period_s", d.oscillating ? nlohmann::json(d.period_s) : nullptr},
      {"kind", to_text(d.loop_type)},
      {"evidence", because(d)},
      {"against", or_null(against(d))},
      {"probability", nullptr},
      {"band", nullptr}};
  if (!d.judged()) return result;
  result["probability"] = probability;
  result["band"] = {{"log_odds", d.evidence.log_odds},
                    {"co_units", d.band.band},
                    {"share_of_movement", d.evidence.share},
                    {"explained", d.evidence.explained}};
  result["standing"] = d.evidence.standing;
  const diagnosis::Reversals& reversals = d.evidence.reversals;
  result["turns"] = {{"by", to_text(reversals.by())},
                     {"count", reversals.count},
                     {"travel_scatter", reversals.travel_scatter},
                     {"cycle_scatter", reversals.cycle_scatter},
                     {"four_cycle_scatter", reversals.four_cycle_scatter}};
  return result;
}

// Returns the representative window with the loop's verdict.
Diagnosis for_loop(const DiagnosedLoop& loop) {
  Diagnosis d = loop.windows[loop.verdict.like].diagnosis;
  d.verdict = loop.verdict.verdict;
  d.grade = loop.verdict.grade;
  d.cause = loop.verdict.cause;
  d.reason = loop.verdict.reason;
  d.settle = loop.test ? deciding_test_text(*loop.test, loop.co_range) : loop.verdict.settle;
  d.probability = loop.verdict.probability;
  return d;
}

// PV's own span is unknown, so the range in which it moved replaces it.
ImportSpans spans_of(const Diagnosis& d, double co_span) {
  ImportSpans spans{.pv = std::nullopt, .co = co_span};
  if (!d.prepared.raw_pv.empty()) {
    const auto [low, high] =
        std::minmax_element(d.prepared.raw_pv.begin(), d.prepared.raw_pv.end());
    spans.pv = *high - *low;
  }
  return spans;
}

// Returns the trend of the size over the windows.
diagnosis::SizeTrend trend_of(const DiagnosedLoop& loop) {
  std::vector<Diagnosis> windows;
  windows.reserve(loop.windows.size());
  for (const DiagnosedWindow& w : loop.windows) windows.push_back(w.diagnosis);
  return diagnosis::size_trend(windows);
}

// Returns what the verdict means for the master of a slave; empty without a consequence.
std::string master_text(const Diagnosis& d, const std::string& master) {
  if (master.empty() || d.verdict == DiagnosisVerdict::healthy || !d.judged()) return {};
  if (d.verdict == DiagnosisVerdict::valve_effect) {
    return fmt::format(
        "{} moves the set point. A cycle of it can come from this valve: repair the "
        "valve before you tune {}",
        master, master);
  }
  if (d.cause == Cause::master_loop)
    return fmt::format("{} moves the set point: diagnose {} next", master, master);
  return fmt::format("{} moves the set point", master);
}

std::string band_line(const Diagnosis& d) {
  return fmt::format(
      "band of 30 % of CO's movement or more: {:+.1f} nats; PV rests during {:.0f} % of CO's "
      "moves\n",
      d.evidence.log_odds, 100.0 * d.evidence.standing);
}

}  // namespace

std::string headline(const Diagnosis& d, const std::vector<double>& co_range) {
  switch (d.verdict) {
    case DiagnosisVerdict::valve_effect:
      return fmt::format(
          "valve effect: {} ({}), {:.2g} % of the CO span ({:g} to {:g}), probability {:.0f} %",
          to_text(d.cause), to_text(d.grade), 100.0 * d.s / (co_range[1] - co_range[0]),
          co_range[0], co_range[1], 100.0 * d.probability);
    case DiagnosisVerdict::other_cause: return fmt::format("no valve effect: {}", to_text(d.cause));
    case DiagnosisVerdict::healthy:
      return fmt::format("healthy, probability of a valve effect {:.0f} %", 100.0 * d.probability);
    case DiagnosisVerdict::not_enough_data: return "not enough data";
    case DiagnosisVerdict::cant_tell: return "can't tell";
  }
  return {};
}

std::string time_text(const DiagnosedLoop& loop, const DiagnosedWindow& window, double time_s) {
  if (window.import < loop.imports.size()) {
    if (const auto& start = loop.imports[window.import].start) {
      const double at_s = start->rest_s + time_s;
      const double whole_s = std::floor(at_s);
      return record::iso_text(start->whole_s + static_cast<std::int64_t>(whole_s), at_s - whole_s,
                              start->zone_known);
    }
  }
  return fmt::format("{:g} s", time_s);
}

std::string unit_text(const DiagnosedLoop& loop, const DiagnosedWindow& window, record::Role role,
                      const char* otherwise) {
  if (window.import >= loop.imports.size()) return otherwise;
  const std::string& unit = loop.imports[window.import].units[index_of(role)];
  return unit.empty() ? otherwise : unit;
}

nlohmann::json diagnosis_json(const DiagnosedLoop& loop) {
  const double span = loop.co_range[1] - loop.co_range[0];
  const Diagnosis whole = for_loop(loop);
  nlohmann::json result = json_of(whole, whole.probability, span);
  result["co_range"] = loop.co_range;
  result["next_test"] =
      loop.test ? deciding_test_json(*loop.test, loop.co_range) : nlohmann::json(nullptr);
  if (loop.pushed_by) result["pushed_by"] = *loop.pushed_by;
  result["master"] = or_null(loop.master);
  if (!loop.imports.empty()) {
    // Of several files, uses the one whose result the verdict has.
    const DiagnosedWindow& like = loop.windows[loop.verdict.like];
    const record::ImportNotes& notes = loop.imports.at(like.import);
    result["import"] = import_json(notes, spans_of(whole, span),
                                   std::isfinite(like.sees_from) && like.sees_from > 0.0
                                       ? std::optional(100.0 * like.sees_from / span)
                                       : std::nullopt);
    if (loop.imports.size() > 1) {
      result["imports"] = nlohmann::json::array();
      for (const record::ImportNotes& one : loop.imports) {
        nlohmann::json entry = import_json(one, spans_of(whole, span), std::nullopt);
        entry["file"] = one.files;
        result["imports"].push_back(std::move(entry));
      }
    }
  }
  if (loop.windows.size() == 1) return result;
  result["since_s"] = whole.verdict == DiagnosisVerdict::valve_effect
                          ? nlohmann::json(loop.windows[loop.verdict.since].from_s)
                          : nullptr;
  result["since_file"] = whole.verdict == DiagnosisVerdict::valve_effect
                             ? nlohmann::json(loop.windows[loop.verdict.since].file)
                             : nullptr;
  const diagnosis::SizeTrend trend = trend_of(loop);
  result["size_trend"] = nullptr;
  if (whole.verdict == DiagnosisVerdict::valve_effect && trend.windows > 1) {
    result["size_trend"] = {{"windows", trend.windows},
                            {"first_percent_of_span", 100.0 * trend.first / span},
                            {"last_percent_of_span", 100.0 * trend.last / span},
                            {"percent_of_span_per_window", 100.0 * trend.per_window / span}};
  }
  result["windows"] = nlohmann::json::array();
  for (const DiagnosedWindow& w : loop.windows) {
    nlohmann::json window = json_of(w.diagnosis, w.diagnosis.probability, span);
    window["file"] = w.file;
    window["from_s"] = w.from_s;
    window["to_s"] = w.to_s;
    if (loop.imports.size() > w.import && loop.imports[w.import].start) {
      window["from"] = time_text(loop, w, w.from_s);
      window["to"] = time_text(loop, w, w.to_s);
    }
    result["windows"].push_back(window);
  }
  return result;
}

std::string diagnosis_text(const DiagnosedLoop& loop) {
  const Diagnosis d = for_loop(loop);
  std::string text = headline(d, loop.co_range) + "\n";
  if (d.verdict == DiagnosisVerdict::valve_effect) {
    const double span = loop.co_range[1] - loop.co_range[0];
    text += fmt::format("90 % interval of the size: {:.2g} to {:.2g} %\n", 100.0 * d.s_low / span,
                        100.0 * d.s_high / span);
    if (d.alternative != Cause::none) {
      text += fmt::format("or {}: this record can't distinguish them\n", to_text(d.alternative));
    }
    if (const effects::Descriptor* effect = effects::find_effect(to_text(d.cause)))
      text += fmt::format("Action: {}\n", effect->remedy);
  }
  text += fmt::format("because: {}\n", because(d));
  if (const std::string master = master_text(d, loop.master); !master.empty())
    text += fmt::format("master: {}\n", master);
  if (loop.pushed_by) {
    text +=
        fmt::format("pushed by: {}\n", loop.pushed_by->empty()
                                           ? "no neighbour"
                                           : fmt::format("{}", fmt::join(*loop.pushed_by, ", ")));
  }
  if (const double sees_from = loop.windows[loop.verdict.like].sees_from;
      sees_from > 0.0 && std::isfinite(sees_from)) {
    text += fmt::format(
        "the archive is compressed: this record cannot show effects below {:.2g} % of the CO "
        "span\n",
        100.0 * sees_from / (loop.co_range[1] - loop.co_range[0]));
  }
  if (const std::string contra = against(d); !contra.empty()) {
    text += fmt::format("against it: {}\n", contra);
  }
  if (!d.settle.empty() && d.grade != Grade::seen) {
    text += fmt::format("next step to decide: {}\n", d.settle);
  }
  if (loop.windows.size() > 1) {
    if (d.verdict == DiagnosisVerdict::valve_effect) {
      const DiagnosedWindow& since = loop.windows[loop.verdict.since];
      text += fmt::format("since {} of {}\n", time_text(loop, since, since.from_s), since.file);
      if (const diagnosis::SizeTrend trend = trend_of(loop); trend.windows > 1) {
        const double span = loop.co_range[1] - loop.co_range[0];
        text += fmt::format(
            "size over {} windows: first {:.2g} %, last {:.2g} % of the CO span, {:+.2g} % a "
            "window\n",
            trend.windows, 100.0 * trend.first / span, 100.0 * trend.last / span,
            100.0 * trend.per_window / span);
      }
    }
    for (const DiagnosedWindow& w : loop.windows) {
      text += fmt::format("  {} {} to {}: {}\n", w.file, time_text(loop, w, w.from_s),
                          time_text(loop, w, w.to_s), headline(w.diagnosis, loop.co_range));
    }
  }
  if (!d.judged()) return text;
  text += band_line(d);
  if (d.loop_type != diagnosis::LoopType::unknown)
    text += fmt::format("kind of loop: {}\n", to_text(d.loop_type));
  text += d.oscillating ? fmt::format("oscillates with a period of {:.4g} s, {:.0f} periods\n",
                                      d.period_s, d.prepared.cycles)
                        : std::string("does not oscillate\n");
  text += fmt::format("{} samples used\n", d.prepared.used);
  return text;
}

}  // namespace loopwarden::workbench
