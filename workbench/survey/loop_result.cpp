// SPDX-License-Identifier: Apache-2.0
#include "workbench/survey/loop_result.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <utility>

#include "model/numeric/statistics.hpp"
#include "model/diagnosis/nonlinearity.hpp"
#include "model/diagnosis/survey_window.hpp"
#include "workbench/records/record_input.hpp"
#include "workbench/survey/judged_windows.hpp"
#include "workbench/survey/neighbours.hpp"
#include "workbench/text/diagnose_text.hpp"
#include "workbench/text/import_json.hpp"
#include "workbench/text/json_number.hpp"

namespace loopwarden::workbench {
namespace {

using diagnosis::WindowFindings;
using nlohmann::json;

// A window that the user requested, with the joint result of its stretches.
struct SurveyWindow {
  WindowFindings findings;
  DiagnosedLoop judged;  // one window: the representative stretch
  double regularity = 0.0;
  double nonlinearity = 0.0;

  const DiagnosedWindow& like() const { return judged.windows.front(); }
};

constexpr std::size_t kTrendColumns = 500;
constexpr std::size_t kZoomSamples = 400;
constexpr double kZoomPeriods = 8.0;
constexpr std::size_t kLeastWindow = 100;  // samples

json rounded(double value) {
  if (!std::isfinite(value)) return nullptr;
  if (value == 0.0) return 0.0;
  const double scale = std::pow(10.0, 5.0 - std::floor(std::log10(std::abs(value))));
  return std::nearbyint(value * scale) / scale;
}

template <class Value>
double median_of(const std::vector<SurveyWindow>& windows, Value&& value) {
  std::vector<double> values;
  for (const SurveyWindow& w : windows) {
    if (const double v = value(w); std::isfinite(v)) values.push_back(v);
  }
  return values.empty() ? std::nan("") : numeric::median(values);
}

json window_json(const record::Record& r, Stretch cut, const SurveyWindow& window, double co_span) {
  const WindowFindings& w = window.findings;
  const json diagnosed = diagnosis_json(window.judged);
  const double sees_from = window.like().sees_from;
  json out = {{"from_s", r.time_s[cut.from]},
              {"to_s", r.time_s[cut.from + cut.size - 1]},
              {"share_automatic", rounded(w.automatic)},
              {"complete", rounded(w.complete)},
              {"saturated", rounded(w.saturated)},
              {"oscillating", diagnosed.at("oscillating")},
              {"period_s", diagnosed.at("period_s")},
              {"regularity", rounded(window.regularity)},
              {"nonlinearity", rounded(window.nonlinearity)},
              {"error_rms", rounded(w.error)},
              {"crossings_per_hour", rounded(w.crossings_per_hour)},
              {"variability", rounded(w.variability)},
              {"dead_time_s", rounded(w.dead_time_s)},
              {"travel_per_hour", rounded(w.travel_per_hour)},
              {"reversals_per_hour", rounded(w.reversals_per_hour)},
              {"noise", rounded(w.noise)},
              {"sees_from_percent",
               sees_from > 0.0 ? rounded(100.0 * sees_from / co_span) : json(nullptr)}};
  for (const char* key :
       {"verdict", "grade", "effects", "cause", "reason", "settle", "evidence", "probability"}) {
    out[key] = diagnosed.at(key);
  }
  return out;
}

// Returns the least and the greatest value of each column of a picture, in order of time.
json trend_of(const record::Record& r, const std::vector<double>& values) {
  json out = json::array();
  const std::size_t columns = std::min(kTrendColumns, r.size());
  for (std::size_t c = 0; c < columns; ++c) {
    const std::size_t from = r.size() * c / columns;
    const std::size_t to = r.size() * (c + 1) / columns;
    double low = std::nan("");
    double high = std::nan("");
    bool low_first = true;
    for (std::size_t k = from; k < to; ++k) {
      const double v = values[k];
      if (!std::isfinite(v)) continue;
      if (!(low <= v)) {
        low = v;
        low_first = false;
      }
      if (!(high >= v)) {
        high = v;
        low_first = true;
      }
    }
    out.push_back(rounded(low_first ? low : high));
    out.push_back(rounded(low_first ? high : low));
  }
  return out;
}

json picture_of(const record::Record& r, std::size_t zoom_from, std::size_t zoom_size) {
  json picture = {
      {"from_s", r.time_s.front()}, {"to_s", r.time_s.back()}, {"pv", trend_of(r, r.pv)}};
  if (!r.co.empty()) picture["co"] = trend_of(r, r.co);
  if (!r.sp.empty()) picture["sp"] = trend_of(r, r.sp);
  const std::size_t step = std::max<std::size_t>(1, zoom_size / kZoomSamples);
  json zoom = {{"from_s", r.time_s[zoom_from]}, {"step_s", r.period_s * static_cast<double>(step)}};
  const auto cut = [&](const std::vector<double>& values) {
    json out = json::array();
    for (std::size_t k = zoom_from; k < zoom_from + zoom_size; k += step)
      out.push_back(rounded(values[k]));
    return out;
  };
  zoom["pv"] = cut(r.pv);
  if (!r.co.empty()) zoom["co"] = cut(r.co);
  if (!r.sp.empty()) zoom["sp"] = cut(r.sp);
  picture["zoom"] = std::move(zoom);
  return picture;
}

}  // namespace

std::vector<double> likely_co_range(const record::Imported& imported) {
  double low = std::nan("");
  double high = std::nan("");
  for (const double v : imported.record.co) {
    if (!std::isfinite(v)) continue;
    if (!(low <= v)) low = v;
    if (!(high >= v)) high = v;
  }
  if (const auto& told = imported.notes.ranges[index_of(record::Role::co)])
    return {told->first, told->second};
  const std::string& unit = imported.notes.units[index_of(record::Role::co)];
  if (unit == "mA" && low > 3.0 && high < 21.0) return {4.0, 20.0};
  if (high <= 1.05 && low >= -0.05 && unit != "%") return {0.0, 1.0};
  return {0.0, 100.0};
}

namespace {

// Cuts a record into windows of equal length. The remainder is a window if it is at least half as
// long. Otherwise it extends the last window.
std::vector<Stretch> cuts_of(const record::Record& r, double window_s) {
  const auto length = static_cast<std::size_t>(
      std::max(static_cast<double>(kLeastWindow), std::floor(window_s / r.period_s)));
  const std::size_t count = std::max<std::size_t>(1, (r.size() + length / 2) / length);
  std::vector<Stretch> cuts;
  for (std::size_t w = 0; w < count; ++w) {
    cuts.push_back({w * length, w + 1 == count ? r.size() - w * length : length});
  }
  return cuts;
}

// Returns the stretches whose middle is in the cut. If there is no such stretch, returns the one
// that contains the middle of the cut.
Stretch stretches_in(std::span<const Stretch> stretches, Stretch cut) {
  const auto first_from = [&](std::size_t sample) {
    return static_cast<std::size_t>(
        std::find_if(stretches.begin(), stretches.end(),
                     [sample](Stretch s) { return s.from + s.size / 2 >= sample; }) -
        stretches.begin());
  };
  const std::size_t first = first_from(cut.from);
  const std::size_t last = first_from(cut.from + cut.size);
  if (last > first) return {first, last - first};
  const std::size_t middle = cut.from + cut.size / 2;
  std::size_t holds = 0;
  while (holds + 1 < stretches.size() && stretches[holds + 1].from <= middle) ++holds;
  return {holds, 1};
}

WindowFindings findings_of(const record::Record& r, Stretch cut,
                           const std::vector<double>& co_range) {
  numeric::LoopView part = r.view().part(cut.from, cut.from + cut.size);
  part.co_low = co_range[0];
  part.co_high = co_range[1];
  return diagnosis::judge_window(part);
}

// Judges the loop's stretches and returns them.
std::vector<Stretch> judge_stretches(const record::Imported& imported, diagnosis::LoopType kind,
                                     DiagnosedLoop& loop) {
  const record::ImportNotes& notes = imported.notes;
  record::Record in_automatic = imported.record;
  leave_out_manual(in_automatic);
  std::vector<Stretch> stretches = stretches_of(in_automatic);
  loop.imports = {notes};
  for (const Stretch stretch : stretches) {
    loop.windows.push_back(
        judge_stretch(in_automatic, stretch, kind, loop.co_range, {notes.pv, notes.co}));
    loop.windows.back().file = notes.files;
  }
  return stretches;
}

// Returns the loop's verdict and the result of each cut.
std::vector<SurveyWindow> judged_windows(const record::Record& record,
                                         const std::vector<Stretch>& stretches,
                                         const std::vector<Stretch>& cuts, DiagnosedLoop& loop) {
  const std::vector<diagnosis::Diagnosis> each = judge_together(loop);
  std::vector<SurveyWindow> windows;
  for (std::size_t w = 0; w < cuts.size(); ++w) {
    const Stretch in = stretches_in(stretches, cuts[w]);
    const diagnosis::LoopVerdict verdict = verdict_of(loop, each, in.from, in.size);
    SurveyWindow window{.findings = findings_of(record, cuts[w], loop.co_range),
                        .judged = {.windows = {loop.windows[verdict.like]},
                                   .verdict = verdict,
                                   .co_range = loop.co_range}};
    window.judged.verdict.like = window.judged.verdict.since = 0;
    const diagnosis::Diagnosis& like = window.like().diagnosis;
    const diagnosis::Prepared& prepared = like.prepared;
    window.regularity = prepared.pv_oscillation.regularity;
    if (like.oscillating && !prepared.pv.empty()) {
      window.nonlinearity = diagnosis::nonlinearity(prepared.pv, prepared.period, w + 1);
    }
    windows.push_back(std::move(window));
  }
  return windows;
}

// Returns the size of PV's moves in % of its span: the RMS of SP - PV, or of PV about its mean if
// the record has no SP. The span is that of the rules, otherwise 1.5 times the largest value.
json swing_percent(const record::Imported& imported, double error_rms) {
  const std::vector<double>& pv = imported.record.pv;
  double sum = 0.0;
  double squares = 0.0;
  double largest = 0.0;
  double n = 0.0;
  for (const double v : pv) {
    if (!std::isfinite(v)) continue;
    sum += v;
    squares += v * v;
    largest = std::max(largest, std::abs(v));
    n += 1.0;
  }
  if (n == 0.0) return nullptr;
  const double rms = std::isfinite(error_rms)
                         ? error_rms
                         : std::sqrt(std::max(0.0, squares / n - sum / n * (sum / n)));
  const auto& range = imported.notes.ranges[index_of(record::Role::pv)];
  const double span = range ? range->second - range->first : 1.5 * largest;
  return span > 0.0 ? rounded(100.0 * rms / span) : json(nullptr);
}

// Returns a moment by the export's clock if it has one, otherwise in s of the record.
json moment(const record::ImportNotes& notes, double at_s) {
  if (!notes.start) return at_s;
  const double at = notes.start->rest_s + at_s;
  const double whole = std::floor(at);
  return record::iso_text(notes.start->whole_s + static_cast<std::int64_t>(whole), at - whole,
                          notes.start->zone_known);
}

// Returns the start of the present verdict, in s of the record, if an earlier part has another
// verdict.
std::optional<double> since(const DiagnosedLoop& loop) {
  if (loop.windows.size() == 1) return std::nullopt;
  if (loop.verdict.verdict == diagnosis::DiagnosisVerdict::valve_effect) {
    return loop.windows[loop.verdict.since].from_s;
  }
  if (loop.verdict.verdict != diagnosis::DiagnosisVerdict::other_cause) return std::nullopt;
  std::vector<diagnosis::Cause> causes;
  for (const DiagnosedWindow& w : loop.windows) causes.push_back(w.diagnosis.cause);
  const auto first = diagnosis::cause_since(causes, loop.verdict.cause);
  return first ? std::optional(loop.windows[*first].from_s) : std::nullopt;
}

json picture_of(const record::Record& r, Stretch stretch, const diagnosis::Diagnosis& like) {
  double zoom = static_cast<double>(kZoomSamples);
  if (like.oscillating) zoom = std::max(zoom / 4.0, kZoomPeriods * like.period_s / r.period_s);
  const std::size_t size = std::min(stretch.size, static_cast<std::size_t>(zoom));
  return picture_of(r, stretch.from + (stretch.size - size) / 2, size);
}

}  // namespace

json judge_loop(record::Imported imported, const SurveySettings& settings) {
  DiagnosedLoop loop;
  loop.co_range = settings.co_range.empty() ? likely_co_range(imported) : settings.co_range;
  const double co_span = loop.co_range[1] - loop.co_range[0];
  json moves = moves_json(imported.record, imported.notes);
  draw_for_judging(imported);
  const std::string& told = settings.kind.empty() ? imported.notes.kind : settings.kind;
  const diagnosis::LoopType kind = told.empty() ? diagnosis::loop_type_from_tag(imported.notes.tag)
                                                : *diagnosis::loop_type(told);
  const std::vector<Stretch> stretches = judge_stretches(imported, kind, loop);
  const std::vector<Stretch> cuts = cuts_of(imported.record, settings.window_s);
  const std::vector<SurveyWindow> windows = judged_windows(imported.record, stretches, cuts, loop);
  plan_test(loop);
  const DiagnosedWindow& like = loop.windows[loop.verdict.like];
  const json diagnosed = diagnosis_json(loop);
  const std::optional<double> since_s = since(loop);
  json out = {{"tag", imported.notes.tag},
              {"files", imported.notes.files},
              {"import", import_json(imported.notes, {std::nullopt, co_span},
                                     like.sees_from > 0.0 && std::isfinite(like.sees_from)
                                         ? std::optional(100.0 * like.sees_from / co_span)
                                         : std::nullopt)},
              {"co_range", loop.co_range},
              {"kind", diagnosed.at("kind")},
              {"regularity", rounded(like.diagnosis.prepared.pv_oscillation.regularity)},
              {"since_s", since_s ? json(*since_s) : json(nullptr)},
              {"since", since_s ? moment(imported.notes, *since_s) : json(nullptr)}};
  constexpr std::array<std::pair<const char*, double WindowFindings::*>, 10> kMedians{
      {{"share_automatic", &WindowFindings::automatic},
       {"complete", &WindowFindings::complete},
       {"saturated", &WindowFindings::saturated},
       {"error_rms", &WindowFindings::error},
       {"crossings_per_hour", &WindowFindings::crossings_per_hour},
       {"variability", &WindowFindings::variability},
       {"dead_time_s", &WindowFindings::dead_time_s},
       {"travel_per_hour", &WindowFindings::travel_per_hour},
       {"reversals_per_hour", &WindowFindings::reversals_per_hour},
       {"noise", &WindowFindings::noise}}};
  for (const auto& [key, what] : kMedians) {
    out[key] = rounded(
        median_of(windows, [member = what](const SurveyWindow& w) { return w.findings.*member; }));
  }
  const json& error = out["error_rms"];
  out["swing_percent"] =
      swing_percent(imported, error.is_number() ? error.get<double>() : std::nan(""));
  out["nonlinearity"] =
      rounded(median_of(windows, [](const SurveyWindow& w) { return w.nonlinearity; }));
  for (const char* key : {"verdict", "grade", "effects", "cause", "reason", "settle", "evidence",
                          "against", "probability", "oscillating", "period_s", "next_test"}) {
    out[key] = diagnosed.at(key);
  }
  if (diagnosed.contains("size_trend")) out["size_trend"] = diagnosed.at("size_trend");
  out["windows"] = json::array();
  for (std::size_t w = 0; w < windows.size(); ++w) {
    out["windows"].push_back(window_json(imported.record, cuts[w], windows[w], co_span));
  }
  out["moves"] = std::move(moves);
  out["picture"] = picture_of(imported.record, stretches[loop.verdict.like], like.diagnosis);
  return out;
}

}  // namespace loopwarden::workbench
