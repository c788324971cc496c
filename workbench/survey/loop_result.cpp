// SPDX-License-Identifier: Apache-2.0
#include "workbench/survey/loop_result.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "model/numeric/statistics.hpp"
#include "model/survey/window.hpp"
#include "workbench/records/record_input.hpp"
#include "workbench/survey/neighbours.hpp"
#include "workbench/text/diagnose_text.hpp"
#include "workbench/text/import_json.hpp"
#include "workbench/text/json_number.hpp"

namespace loopwarden::workbench {
namespace {

using nlohmann::json;
using survey::WindowFindings;

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

double median_of(const std::vector<WindowFindings>& windows, double WindowFindings::*what) {
  std::vector<double> values;
  for (const WindowFindings& w : windows) {
    if (std::isfinite(w.*what)) values.push_back(w.*what);
  }
  return values.empty() ? std::nan("") : numeric::median(values);
}

json window_json(const WindowFindings& w, const json& diagnosed, double co_span) {
  json out = {{"from_s", diagnosed.at("from_s")},
              {"to_s", diagnosed.at("to_s")},
              {"share_automatic", rounded(w.automatic)},
              {"complete", rounded(w.complete)},
              {"saturated", rounded(w.saturated)},
              {"oscillating", diagnosed.at("oscillating")},
              {"period_s", diagnosed.at("period_s")},
              {"regularity", rounded(w.regularity)},
              {"nonlinearity", rounded(w.nonlinearity)},
              {"error_rms", rounded(w.error)},
              {"crossings_per_hour", rounded(w.crossings_per_hour)},
              {"variability", rounded(w.variability)},
              {"dead_time_s", rounded(w.dead_time_s)},
              {"travel_per_hour", rounded(w.travel_per_hour)},
              {"reversals_per_hour", rounded(w.reversals_per_hour)},
              {"noise", rounded(w.noise)},
              {"sees_from_percent",
               w.sees_from > 0.0 ? rounded(100.0 * w.sees_from / co_span) : json(nullptr)}};
  for (const char* key :
       {"verdict", "grade", "effects", "cause", "reason", "settle", "evidence", "probability"}) {
    out[key] = diagnosed.at(key);
  }
  return out;
}

// Least and greatest value of each column of a picture, in the order in which they come.
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
  if (r.has_co) picture["co"] = trend_of(r, r.co);
  if (r.has_sp) picture["sp"] = trend_of(r, r.sp);
  const std::size_t step = std::max<std::size_t>(1, zoom_size / kZoomSamples);
  json zoom = {{"from_s", r.time_s[zoom_from]}, {"step_s", r.period_s * static_cast<double>(step)}};
  const auto cut = [&](const std::vector<double>& values) {
    json out = json::array();
    for (std::size_t k = zoom_from; k < zoom_from + zoom_size; k += step)
      out.push_back(rounded(values[k]));
    return out;
  };
  zoom["pv"] = cut(r.pv);
  if (r.has_co) zoom["co"] = cut(r.co);
  if (r.has_sp) zoom["sp"] = cut(r.sp);
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

// Windows of one length; what is left at the end makes the last one longer, or is one where it is half a window.
struct Cuts {
  std::size_t length;
  std::size_t count;
  std::size_t samples;

  std::size_t from(std::size_t w) const { return w * length; }
  std::size_t size(std::size_t w) const { return w + 1 == count ? samples - from(w) : length; }
};

Cuts cuts_of(const record::Record& r, double window_s) {
  const auto length = static_cast<std::size_t>(
      std::max(static_cast<double>(kLeastWindow), std::floor(window_s / r.period_s)));
  return {length, std::max<std::size_t>(1, (r.size() + length / 2) / length), r.size()};
}

std::vector<WindowFindings> judged_windows(const record::Imported& imported, const Cuts& cuts,
                                           diagnosis::LoopKind kind, DiagnosedLoop& loop) {
  const record::Record& r = imported.record;
  std::vector<WindowFindings> windows;
  for (std::size_t w = 0; w < cuts.count; ++w) {
    const std::size_t from = cuts.from(w);
    const std::size_t size = cuts.size(w);
    const auto part = [&](bool has, const std::vector<double>& column) {
      return has ? std::span<const double>(column).subspan(from, size) : std::span<const double>();
    };
    windows.push_back(survey::judge_window({.pv = part(true, r.pv),
                                            .co = part(true, r.co),
                                            .sp = part(r.has_sp, r.sp),
                                            .automatic = part(r.has_mode, r.automatic),
                                            .sample_time_s = r.period_s,
                                            .co_low = loop.co_range[0],
                                            .co_high = loop.co_range[1],
                                            .kind = kind,
                                            .archived = {imported.notes.pv, imported.notes.co}},
                                           w + 1));
  }
  survey::share_turns(windows, {imported.notes.pv, imported.notes.co},
                      loop.co_range[1] - loop.co_range[0]);
  for (std::size_t w = 0; w < cuts.count; ++w) {
    loop.windows.push_back({.file = imported.notes.files,
                            .from_s = r.time_s[cuts.from(w)],
                            .to_s = r.time_s[cuts.from(w) + cuts.size(w) - 1],
                            .period_s = r.period_s,
                            .diagnosis = windows[w].diagnosis,
                            .sees_from = windows[w].sees_from});
  }
  return windows;
}

json diagnosed_json(const DiagnosedLoop& loop, const std::vector<WindowFindings>& windows) {
  json diagnosed = diagnosis_json(loop);
  if (loop.windows.size() == 1) {
    diagnosed["windows"] = json::array({diagnosed});
    diagnosed["windows"][0]["from_s"] = loop.windows[0].from_s;
    diagnosed["windows"][0]["to_s"] = loop.windows[0].to_s;
    diagnosed["since_s"] = nullptr;
  } else if (const auto since = survey::cause_since(windows, loop.verdict)) {
    diagnosed["since_s"] = loop.windows[*since].from_s;
  }
  return diagnosed;
}

// By the export's clock where it has one, else s of the record.
json moment(const record::ImportNotes& notes, double at_s) {
  if (!notes.start) return at_s;
  const double at = notes.start->rest_s + at_s;
  const double whole = std::floor(at);
  return record::iso_text(notes.start->whole_s + static_cast<std::int64_t>(whole), at - whole,
                          notes.start->zone_known);
}

json picture_of(const record::Record& r, const Cuts& cuts, std::size_t like,
                const WindowFindings& window) {
  double zoom = static_cast<double>(kZoomSamples);
  if (window.diagnosis.oscillating)
    zoom = std::max(zoom / 4.0, kZoomPeriods * window.diagnosis.period_s / r.period_s);
  const std::size_t size = std::min(cuts.size(like), static_cast<std::size_t>(zoom));
  return picture_of(r, cuts.from(like) + (cuts.size(like) - size) / 2, size);
}

}  // namespace

json judge_loop(record::Imported imported, const SurveySettings& settings) {
  DiagnosedLoop loop;
  loop.co_range = settings.co_range.empty() ? likely_co_range(imported) : settings.co_range;
  const double co_span = loop.co_range[1] - loop.co_range[0];
  json moves = moves_json(imported.record, imported.notes);
  draw_for_judging(imported);
  const std::string& told = settings.kind.empty() ? imported.notes.kind : settings.kind;
  const diagnosis::LoopKind kind =
      told.empty() ? diagnosis::kind_from_tag(imported.notes.tag) : *diagnosis::loop_kind(told);
  const Cuts cuts = cuts_of(imported.record, settings.window_s);
  const std::vector<WindowFindings> windows = judged_windows(imported, cuts, kind, loop);
  loop.verdict = survey::judge_windows(windows, {imported.notes.pv, imported.notes.co}, co_span);
  const WindowFindings& like = windows[loop.verdict.like];
  const json diagnosed = diagnosed_json(loop, windows);
  json out = {{"tag", imported.notes.tag},
              {"files", imported.notes.files},
              {"import", import_json(imported.notes, {std::nullopt, co_span},
                                     like.sees_from > 0.0 && std::isfinite(like.sees_from)
                                         ? std::optional(100.0 * like.sees_from / co_span)
                                         : std::nullopt)},
              {"co_range", loop.co_range},
              {"kind", diagnosed.at("kind")},
              {"regularity", rounded(like.regularity)},
              {"since_s", diagnosed.at("since_s")},
              {"since", nullptr}};
  constexpr std::array<std::pair<const char*, double WindowFindings::*>, 11> kMedians{
      {{"share_automatic", &WindowFindings::automatic},
       {"complete", &WindowFindings::complete},
       {"saturated", &WindowFindings::saturated},
       {"error_rms", &WindowFindings::error},
       {"crossings_per_hour", &WindowFindings::crossings_per_hour},
       {"variability", &WindowFindings::variability},
       {"dead_time_s", &WindowFindings::dead_time_s},
       {"travel_per_hour", &WindowFindings::travel_per_hour},
       {"reversals_per_hour", &WindowFindings::reversals_per_hour},
       {"noise", &WindowFindings::noise},
       {"nonlinearity", &WindowFindings::nonlinearity}}};
  for (const auto& [key, what] : kMedians) out[key] = rounded(median_of(windows, what));
  for (const char* key : {"verdict", "grade", "effects", "cause", "reason", "settle", "evidence",
                          "against", "probability", "oscillating", "period_s"}) {
    out[key] = diagnosed.at(key);
  }
  if (diagnosed.contains("size_trend")) out["size_trend"] = diagnosed.at("size_trend");
  if (!out["since_s"].is_null())
    out["since"] = moment(imported.notes, out["since_s"].get<double>());
  out["windows"] = json::array();
  for (std::size_t w = 0; w < windows.size(); ++w) {
    out["windows"].push_back(window_json(windows[w], diagnosed.at("windows")[w], co_span));
  }
  out["moves"] = std::move(moves);
  out["picture"] = picture_of(imported.record, cuts, loop.verdict.like, like);
  return out;
}

}  // namespace loopwarden::workbench
