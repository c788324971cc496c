// SPDX-License-Identifier: Apache-2.0
#include "workbench/survey/receipt.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "model/analysis/gain_comparison.hpp"
#include "model/diagnosis/limits.hpp"
#include "model/diagnosis/survey_window.hpp"
#include "model/numeric/statistics.hpp"
#include "record/import/time_text.hpp"
#include "workbench/files/command_error.hpp"
#include "workbench/records/record_input.hpp"
#include "workbench/report/palette.hpp"
#include "workbench/report/plot.hpp"
#include "workbench/survey/judged_windows.hpp"
#include "workbench/text/json_number.hpp"

namespace loopwarden::workbench {
namespace {

using nlohmann::json;

// One side of the receipt: the records of one time.
struct Side {
  std::vector<diagnosis::Diagnosis> windows;
  diagnosis::WindowFindings figures;  // of the longest record
  double swing = std::nan("");        // PV units: width that holds 95 % of SP - PV
  double unpredicted = std::nan("");  // PV units
  double hours = 0.0;                 // of all records
  const record::Imported* longest = nullptr;
  numeric::LoopRecord complete{};  // its longest piece in automatic without missing samples
  std::optional<std::array<double, 2>>
      by_model{};  // RMS, PV units, with the gains before and after
};

std::vector<double> errors_of(const numeric::LoopRecord& r) {
  std::vector<double> known;
  for (const double v : r.pv) {
    if (std::isfinite(v)) known.push_back(v);
  }
  const double level = known.empty() ? 0.0 : numeric::mean(known);
  std::vector<double> errors;
  for (std::size_t k = 0; k < r.pv.size(); ++k) {
    const double e = (r.sp.empty() ? level : r.sp[k]) - r.pv[k];
    if (std::isfinite(e)) errors.push_back(e);
  }
  return errors;
}

double rms_of(const std::vector<double>& errors) {
  double squares = 0.0;
  for (const double e : errors) squares += e * e;
  return std::sqrt(squares / static_cast<double>(errors.size()));
}

// Returns the longest piece without missing samples.
numeric::LoopRecord complete_piece(const record::Record& r) {
  std::pair<std::size_t, std::size_t> best{0, 0};  // from, size
  std::size_t from = 0;
  for (std::size_t k = 0; k <= r.size(); ++k) {
    const bool known = k < r.size() && std::isfinite(r.pv[k]) && std::isfinite(r.co[k]) &&
                       (r.sp.empty() || std::isfinite(r.sp[k]));
    if (known) continue;
    if (k - from > best.second) best = {from, k - from};
    from = k + 1;
  }
  const auto part = [&](const std::vector<double>& column) {
    if (column.empty()) return std::vector<double>();
    const auto begin = column.begin() + static_cast<std::ptrdiff_t>(best.first);
    return std::vector<double>(begin, begin + static_cast<std::ptrdiff_t>(best.second));
  };
  numeric::LoopRecord piece;
  piece.period_s = r.period_s;
  piece.pv = part(r.pv);
  piece.sp = part(r.sp);
  piece.co = part(r.co);
  return piece;
}

Side judged_side(std::vector<record::Imported>& records, const ReceiptInput& input,
                 const char* when) {
  Side side;
  const diagnosis::LoopType kind =
      diagnosis::loop_type(input.kind).value_or(diagnosis::LoopType::unknown);
  for (record::Imported& imported : records) {
    draw_for_judging(imported);
    record::Record automatic = imported.record;
    leave_out_manual(automatic);
    if (automatic.pv.empty() || automatic.co.empty()) continue;
    DiagnosedLoop loop{.windows = {}, .verdict = {}, .co_range = input.co_range};
    loop.imports = {imported.notes};
    for (const Stretch stretch : stretches_of(automatic)) {
      loop.windows.push_back(judge_stretch(automatic, stretch, kind, input.co_range,
                                           {imported.notes.pv, imported.notes.co}));
    }
    const auto each = judge_together(loop);
    side.windows.insert(side.windows.end(), each.begin(), each.end());
    side.hours += static_cast<double>(imported.record.size()) * imported.record.period_s / 3600.0;
    if (side.longest != nullptr && imported.record.size() <= side.longest->record.size()) continue;
    side.longest = &imported;
    side.complete = complete_piece(automatic);
  }
  if (side.longest == nullptr) {
    throw CommandError(kExitData,
                       fmt::format("no record {} the work has PV and CO. Export both", when));
  }
  const record::Record& r = side.longest->record;
  numeric::LoopView view = r.view();
  view.co_low = input.co_range[0];
  view.co_high = input.co_range[1];
  side.figures = diagnosis::judge_window(view);
  std::vector<double> errors = errors_of(r);
  if (errors.empty())
    throw CommandError(kExitData, fmt::format("the record {} the work has no values", when));
  side.figures.error = rms_of(errors);
  const double low = numeric::quantile_in_place(errors, 0.025);
  side.swing = numeric::quantile_in_place(errors, 0.975) - low;
  side.unpredicted = diagnosis::unpredicted(side.complete.pv, side.complete.co);
  if (input.model && input.gains)
    side.by_model = analysis::compare_gains(side.complete.view(), *input.model, *input.gains);
  return side;
}

// The values of 95 % of the samples; NaN without samples.
struct Spread {
  double low = std::nan(""), high = std::nan("");
};

Spread spread_of(std::vector<double> values) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  if (values.empty()) return {};
  const double low = numeric::quantile_in_place(values, 0.025);
  return {low, numeric::quantile_in_place(values, 0.975)};
}

// Returns whether both can hardly be the same signal in the same unit.
bool differ_widely(const Spread& a, const Spread& b) {
  constexpr double kFactor = 3.0;
  if (a.low <= b.high && b.low <= a.high) return false;
  const double first = std::abs(a.low + a.high);
  const double second = std::abs(b.low + b.high);
  return std::max(first, second) > kFactor * std::min(first, second);
}

// Returns the signs that both sides are records of different loops, or in different units.
std::vector<std::string> doubts_of(const record::Imported& before, const record::Imported& after) {
  std::vector<std::string> doubts;
  const auto named = [&](const char* what, const std::string& was, const std::string& is) {
    if (!was.empty() && !is.empty() && was != is)
      doubts.push_back(fmt::format("{} is {} before and {} after", what, was, is));
  };
  const auto level = [&](const char* what, const std::vector<double>& was,
                         const std::vector<double>& is) {
    const Spread a = spread_of(was);
    const Spread b = spread_of(is);
    if (differ_widely(a, b)) {
      doubts.push_back(fmt::format("{} is {:.3g} to {:.3g} before and {:.3g} to {:.3g} after", what,
                                   a.low, a.high, b.low, b.high));
    }
  };
  const auto unit = [](const record::Imported& one, record::Role role) -> const std::string& {
    return one.notes.units[index_of(role)];
  };
  named("the unit of PV", unit(before, record::Role::pv), unit(after, record::Role::pv));
  named("the unit of CO", unit(before, record::Role::co), unit(after, record::Role::co));
  level("PV", before.record.pv, after.record.pv);
  level("CO", before.record.co, after.record.co);
  return doubts;
}

std::string receipt_moment(const record::Imported& imported, double s) {
  if (!imported.notes.start) return fmt::format("{:.0f} s", s);
  const double at = imported.notes.start->rest_s + s;
  std::string text =
      record::iso_text(imported.notes.start->whole_s + static_cast<std::int64_t>(std::floor(at)),
                       0.0, imported.notes.start->zone_known);
  return text;
}

json side_json(const Side& side, const diagnosis::Diagnosis& like, double co_span) {
  const record::Record& r = side.longest->record;
  const double percent = 100.0 / co_span;
  const bool valve = like.verdict == diagnosis::DiagnosisVerdict::valve_effect;
  json told = {{"from", receipt_moment(*side.longest, 0.0)},
               {"to", receipt_moment(*side.longest, r.time_s.back() - r.time_s.front())},
               {"hours", finite_or_null(side.hours)},
               {"verdict", diagnosis::to_text(like.verdict)},
               {"effect", valve ? json(diagnosis::to_text(like.cause)) : json(nullptr)},
               {"band_percent", valve ? finite_or_null(percent * like.s) : json(nullptr)},
               {"band_interval_percent", valve ? json{finite_or_null(percent * like.s_low),
                                                      finite_or_null(percent * like.s_high)}
                                               : json(nullptr)},
               {"rms", finite_or_null(side.figures.error)},
               {"swing", finite_or_null(side.swing)},
               {"period_s", like.oscillating ? finite_or_null(like.period_s) : json(nullptr)},
               {"travel_percent_per_hour", finite_or_null(percent * side.figures.travel_per_hour)},
               {"reversals_per_hour", finite_or_null(side.figures.reversals_per_hour)},
               {"disturbance", finite_or_null(side.unpredicted)},
               {"by_model", side.by_model ? json(*side.by_model) : json(nullptr)}};
  return told;
}

// Returns the saving per year, or null if the records do not allow a statement.
json saving_json(const ReceiptInput& input, const Side& before, const Side& after, bool same) {
  if (!same) return nullptr;
  double span = 0.0;
  if (input.pv_range) {
    span = input.pv_range->second - input.pv_range->first;
  } else {
    for (const double v : before.longest->record.pv)
      if (std::isfinite(v)) span = std::max(span, 1.5 * std::abs(v));
  }
  if (!(span > 0.0)) return nullptr;
  const Costs& costs = input.costs;
  // By the model, another set point does not count as a saving.
  const double less = before.by_model ? (*before.by_model)[0] - (*before.by_model)[1]
                                      : before.figures.error - after.figures.error;
  const double swing = 100.0 * less / span;
  const double strokes = (before.figures.travel_per_hour - after.figures.travel_per_hour) /
                         (input.co_range[1] - input.co_range[0]) * costs.hours_per_year;
  const Range loss = costs.loss_of(input.kind);
  const double least = swing * loss.first + strokes * costs.overhaul / costs.strokes.second;
  const double most = swing * loss.second + strokes * costs.overhaul / costs.strokes.first;
  return {{"low", std::round(std::min(least, most))},
          {"high", std::round(std::max(least, most))},
          {"currency", costs.currency},
          {"assumptions", costs.source}};
}

// Draws PV, SP and CO of a record, to the same ranges on both sides.
std::string receipt_trend(const record::Record& r, const PlotRange& pv, const PlotRange& co,
                          const std::string& title, double left) {
  constexpr double kWidth = 480.0;
  constexpr double kHeight = 150.0;
  constexpr std::size_t kColumns = 300;
  const auto curve = [&](const std::vector<double>& values, const PlotRange& range, double top,
                         const char* colour) {
    if (values.empty()) return std::string();
    const auto points = decimated(values, range, kColumns);
    return fmt::format(
        "<g transform=\"translate({:g} {:g}) scale({:.6g} {:.6g})\"><path d=\"{}\" fill=\"none\" "
        "stroke=\"{}\" vector-effect=\"non-scaling-stroke\"/></g>\n",
        left, top, kWidth / static_cast<double>(std::max<std::size_t>(1, values.size() - 1)),
        kHeight / kPlotHeight, path_data(points), colour);
  };
  std::string svg =
      fmt::format("<text x=\"{:g}\" y=\"14\" class=\"name\">{}</text>\n", left, escaped(title));
  for (const double top : {22.0, 190.0}) {
    svg += fmt::format(
        "<rect x=\"{:g}\" y=\"{:g}\" width=\"{:g}\" height=\"{:g}\" fill=\"none\" "
        "stroke=\"#bbb\"/>\n",
        left, top, kWidth, kHeight);
  }
  svg += curve(r.sp, pv, 22.0, palette::kSetPoint) + curve(r.pv, pv, 22.0, palette::kMeasured);
  return svg + curve(r.co, co, 190.0, palette::kAfter);
}

std::string both_trends(const record::Record& before, const record::Record& after) {
  const std::array<std::span<const double>, 4> of_pv{before.pv, after.pv, before.sp, after.sp};
  const std::array<std::span<const double>, 2> of_co{before.co, after.co};
  const PlotRange pv = range_of(of_pv, 0.03);
  const PlotRange co = range_of(of_co, 0.03);
  const auto label = [](double y, const std::string& text) {
    return fmt::format("<text x=\"1042\" y=\"{:g}\">{}</text>\n", y, text);
  };
  return receipt_trend(before, pv, co, "Before: PV with SP, and CO below", 20.0) +
         receipt_trend(after, pv, co, "After", 550.0) + label(32.0, plain_number(pv.high)) +
         label(172.0, plain_number(pv.low)) + label(200.0, plain_number(co.high)) +
         label(340.0, plain_number(co.low));
}

std::string figure(const json& value, const char* unit, int digits = 3) {
  return value.is_number() ? fmt::format("{:.{}g}{}", value.get<double>(), digits, unit) : "-";
}

std::string band_text(const json& side) {
  if (side.at("band_percent").is_null()) return "none found";
  const json& interval = side.at("band_interval_percent");
  return fmt::format("{} {:.2g} % ({:.2g} to {:.2g})", side.at("effect").get<std::string>(),
                     side.at("band_percent").get<double>(), interval[0].get<double>(),
                     interval[1].get<double>());
}

struct Result {
  std::string word, why;
};

// Returns what a side lacks for a judgement, with the present and the needed amount and what to do;
// empty: it lacks nothing.
std::string lack_of(const Side& side, const diagnosis::Diagnosis& like, const char* when) {
  constexpr double kLeastMinutes = 30.0;
  constexpr std::size_t kLeastSamples = diagnosis::DiagnosisLimits::kLeastSamples;
  if (60.0 * side.hours < kLeastMinutes) {
    return fmt::format(
        "the record {} the work has {:.0f} min, and {:.0f} min are needed: wait, or export a "
        "longer record",
        when, 60.0 * side.hours, kLeastMinutes);
  }
  if (side.complete.pv.size() < kLeastSamples) {
    return fmt::format(
        "the record {} the work has {} samples of PV and CO in a row in automatic, and {} are "
        "needed: export a longer record in automatic, or more samples per hour",
        when, side.complete.pv.size(), kLeastSamples);
  }
  if (like.verdict == diagnosis::DiagnosisVerdict::not_enough_data) {
    return fmt::format("the record {} the work can't be judged, because {}: export {}", when,
                       like.reason, like.settle);
  }
  return {};
}

// Returns the result of the judgement that fits the work, unless the loop's own figures do not
// support it.
Result result_of(const ReceiptInput& input, const diagnosis::Repair& repair, const Side& before,
                 const Side& after, bool same_disturbance) {
  using diagnosis::RepairResult;
  const std::string open = diagnosis::to_text(RepairResult::cant_tell);
  for (std::string lack :
       {lack_of(before, repair.before, "before"), lack_of(after, repair.after, "after")}) {
    if (!lack.empty()) return {open, std::move(lack)};
  }
  if (input.gains_only) {
    const auto side = [](const Side& one) {
      return analysis::GainRecord{.rms = rms_of(errors_of(one.complete)), .by_model = one.by_model};
    };
    const analysis::GainChange change = analysis::judge_gains(side(before), side(after));
    return {analysis::to_text(change.result), change.why};
  }
  if (repair.result == RepairResult::repaired && same_disturbance &&
      after.figures.error >= before.figures.error)
    return {open, "the RMS of SP - PV has not fallen, although the disturbance is the same"};
  return {diagnosis::to_text(repair.result), repair.why};
}

struct ReceiptRow {
  std::string name, before, after;
};

std::vector<ReceiptRow> receipt_rows(const json& r) {
  const json& before = r.at("before");
  const json& after = r.at("after");
  const std::string unit = r.at("pv_unit").get<std::string>().empty()
                               ? std::string()
                               : " " + r.at("pv_unit").get<std::string>();
  const auto row = [&](const char* name, const char* key, const char* unit_text) {
    return ReceiptRow{name, figure(before.at(key), unit_text), figure(after.at(key), unit_text)};
  };
  std::vector<ReceiptRow> rows{
      {"from", before.at("from").get<std::string>(), after.at("from").get<std::string>()},
      {"to", before.at("to").get<std::string>(), after.at("to").get<std::string>()},
      row("records", "hours", " h"),
      {"band of the valve, of CO span", band_text(before), band_text(after)},
      row("RMS of SP - PV", "rms", unit.c_str()),
      row("swing (95 % of SP - PV)", "swing", unit.c_str()),
      row("period", "period_s", " s"),
      row("travel of CO, of its span", "travel_percent_per_hour", " %/h"),
      row("reversals of CO", "reversals_per_hour", " /h"),
      row("disturbance and noise per sample", "disturbance", unit.c_str())};
  if (before.at("by_model").is_null() || after.at("by_model").is_null()) return rows;
  constexpr std::array kGains{"RMS by the model, gains before", "RMS by the model, gains after"};
  for (std::size_t k = 0; k < kGains.size(); ++k) {
    rows.push_back({kGains[k], figure(before.at("by_model")[k], unit.c_str()),
                    figure(after.at("by_model")[k], unit.c_str())});
  }
  return rows;
}

std::string disturbance_text(const json& r) {
  const json& same = r.at("same_disturbance");
  if (same.is_null()) return "The disturbance cannot be compared.";
  return same.get<bool>() ? "The disturbance was the same before and after."
                          : "The disturbance was not the same before and after: RMS, swing and "
                            "travel cannot be compared, and no saving is stated.";
}

std::string saving_sentence(const json& r) {
  const json& saving = r.at("saving");
  if (saving.is_null()) return "Saving: not stated.";
  return fmt::format("Saving: {:.0f} to {:.0f} {} per year (assumptions: {}).",
                     saving.at("low").get<double>(), saving.at("high").get<double>(),
                     saving.at("currency").get<std::string>(),
                     saving.at("assumptions").get<std::string>());
}

// Returns an empty text without doubts.
std::string doubts_text(const json& r) {
  const json& doubts = r.at("doubts");
  if (doubts.empty()) return {};
  std::string text = "Warning: ";
  for (const json& doubt : doubts)
    text += (doubt == doubts.front() ? "" : "; ") + doubt.get<std::string>();
  return text + ". Are both records of the same loop, in the same units?";
}

std::string result_words(const json& r) {
  const auto result = r.at("result").get<std::string>();
  if (result == "not_repaired") return "NOT repaired";
  if (result == "worse") return "WORSE";
  if (result == "no_difference") return "no difference";
  return result == "cant_tell" ? "can't tell" : result;
}

constexpr const char* kReceiptStyle = R"(
@page { size: A4 portrait; margin: 15mm; }
body { font: 14px/1.45 system-ui, sans-serif; margin: 1rem auto; max-width: 56rem;
  padding: 0 1rem; color: #16191d; background: #fff; }
h1 { font-size: 1.4rem; margin: 0; }
.result { font-size: 1.25rem; font-weight: 600; border-left: .5rem solid; padding: .5rem .75rem;
  margin: 1rem 0; }
.result { color: #5b6470; }
.repaired, .improved { color: #176b3a; } .not_repaired, .worse { color: #b3261e; }
table { border-collapse: collapse; width: 100%; }
th, td { text-align: left; padding: .25rem .5rem; border-bottom: 1px solid #ddd;
  vertical-align: top; }
th { font-weight: 500; color: #5b6470; }
svg { width: 100%; height: auto; margin: 1rem 0; }
svg text { font: 12px system-ui, sans-serif; fill: #5b6470; }
svg .name { font-weight: 600; }
.signed { display: grid; grid-template-columns: 1fr 1fr; gap: 3rem; margin-top: 2.5rem; }
.signed span { border-top: 1px solid; color: #5b6470; }
@media (max-width: 500px) { th, td { padding: .25rem; font-size: 12px; overflow-wrap: anywhere; } }
@media print {
  body { margin: 0; padding: 0; max-width: none; font-size: 11pt; }
  * { -webkit-print-color-adjust: exact; print-color-adjust: exact; }
}
)";

}  // namespace

Receipt make_receipt(ReceiptInput input) {
  const Side before = judged_side(input.before, input, "before");
  const Side after = judged_side(input.after, input, "after");
  const diagnosis::Repair repair = diagnosis::judge_repair(before.windows, after.windows);
  const double co_span = input.co_range[1] - input.co_range[0];
  json same = nullptr;
  if (before.unpredicted > 0.0 && after.unpredicted > 0.0) {
    const double ratio = after.unpredicted / before.unpredicted;
    same = std::max(ratio, 1.0 / ratio) <= diagnosis::RepairLimits::kSameDisturbance;
  }
  const bool is_same = same.is_boolean() && same.get<bool>();
  const Result result = result_of(input, repair, before, after, is_same);
  Receipt receipt;
  receipt.told = {{"tag", input.tag},
                  {"found", input.found},
                  {"worked_at", input.worked_at},
                  {"work", input.work},
                  {"result", result.word},
                  {"why", result.why},
                  {"excluded_nats", finite_or_null(repair.excluded_nats)},
                  {"pv_unit", before.longest->notes.units[index_of(record::Role::pv)]},
                  {"before", side_json(before, repair.before, co_span)},
                  {"after", side_json(after, repair.after, co_span)},
                  {"same_disturbance", same},
                  {"doubts", doubts_of(*before.longest, *after.longest)},
                  {"saving", nullptr}};
  if (result.word == "repaired" || result.word == "improved")
    receipt.told["saving"] = saving_json(input, before, after, is_same);
  receipt.picture = both_trends(before.longest->record, after.longest->record);
  return receipt;
}

std::string receipt_sentence(const json& r) {
  std::string why = r.at("why").get<std::string>();
  if (!why.empty() && why[0] >= 'a' && why[0] <= 'z') why[0] = static_cast<char>(why[0] - 32);
  return fmt::format("{}: {}. {}.", r.at("tag").get<std::string>(), result_words(r), why);
}

std::string receipt_text(const json& r) {
  std::string text = receipt_sentence(r) + "\n";
  if (const std::string doubts = doubts_text(r); !doubts.empty()) text += doubts + "\n";
  for (const json& work : r.at("work")) text += "work: " + work.get<std::string>() + "\n";
  text += fmt::format("{:<34} {:<30} {}\n", "", "before", "after");
  for (const ReceiptRow& row : receipt_rows(r))
    text += fmt::format("{:<34} {:<30} {}\n", row.name, row.before, row.after);
  return text + disturbance_text(r) + "\n" + saving_sentence(r) + "\n";
}

std::string receipt_page(const Receipt& receipt) {
  const json& r = receipt.told;
  const std::string tag = escaped(r.at("tag").get<std::string>());
  std::string html = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\">\n<title>Receipt: {}</title>\n<style>{}</style></head>"
      "<body>\n<h1>Receipt: {}</h1>\n",
      tag, kReceiptStyle, tag);
  const auto note = [&](const char* name, const char* key) {
    const auto text = r.at(key).get<std::string>();
    if (!text.empty()) html += fmt::format("{}: {}. ", name, escaped(text));
  };
  html += "<p>";
  note("Found at the valve", "found");
  note("Work finished", "worked_at");
  html += "</p>\n";
  if (!r.at("work").empty()) html += "<ul>\n";
  for (const json& work : r.at("work"))
    html += fmt::format("<li>{}</li>\n", escaped(work.get<std::string>()));
  if (!r.at("work").empty()) html += "</ul>\n";
  html += fmt::format("<p class=\"result {}\">{}</p>\n", r.at("result").get<std::string>(),
                      escaped(receipt_sentence(r)));
  if (const std::string doubts = doubts_text(r); !doubts.empty())
    html += fmt::format("<p><strong>{}</strong></p>\n", escaped(doubts));
  html += "<table><thead><tr><th></th><th>Before</th><th>After</th></tr></thead><tbody>\n";
  for (const ReceiptRow& row : receipt_rows(r)) {
    html += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td></tr>\n",
                        escaped(row.name), escaped(row.before), escaped(row.after));
  }
  html += fmt::format(
      "</tbody></table>\n<p>{} {}</p>\n<svg viewBox=\"0 0 1100 350\" role=\"img\" "
      "aria-label=\"PV, SP and CO before and after\">\n{}</svg>\n",
      escaped(disturbance_text(r)), escaped(saving_sentence(r)), receipt.picture);
  return html +
         "<div class=\"signed\"><span>Date, technician</span><span>Date, "
         "operator</span></div>\n</body></html>\n";
}

}  // namespace loopwarden::workbench
