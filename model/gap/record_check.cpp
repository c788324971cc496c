// SPDX-License-Identifier: Apache-2.0
#include "model/gap/record_check.hpp"

#include "model/numeric/statistics.hpp"
#include "model/numeric/text.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::gap {
namespace {

using numeric::text;

std::string percent(double share) { return text("%.3g %%", 100.0 * share); }

// The longest stretch of equal values.
std::pair<std::size_t, std::size_t> longest_rest(const std::vector<double>& column) {
  std::pair<std::size_t, std::size_t> longest{0, 0};
  std::size_t begin = 0;
  for (std::size_t k = 1; k <= column.size(); ++k) {
    if (k < column.size() && column[k] == column[begin]) continue;
    if (k - begin > longest.second - longest.first) longest = {begin, k};
    begin = k;
  }
  return longest;
}

}  // namespace

double resolution_of(const std::vector<double>& column) {
  std::vector<double> moves;
  for (std::size_t k = 1; k < column.size(); ++k) {
    const double move = std::abs(column[k] - column[k - 1]);
    if (move > 0.0) moves.push_back(move);
  }
  if (moves.size() < 20) return 0.0;
  std::sort(moves.begin(), moves.end());
  // A rounded signal repeats its smallest move; one that is not has no two alike.
  const double least = moves[moves.size() / 50];
  const auto alike = std::count_if(moves.begin(), moves.end(), [&](double m) {
    const double steps = m / least;
    return std::abs(steps - std::nearbyint(steps)) < 0.02;
  });
  return static_cast<double>(alike) > 0.9 * static_cast<double>(moves.size()) ? least : 0.0;
}

std::vector<double> held(const std::vector<double>& column) {
  std::vector<double> out = column;
  const auto first =
      std::find_if(out.begin(), out.end(), [](double v) { return std::isfinite(v); });
  if (first == out.end()) return out;
  double last = *first;
  for (double& v : out) {
    if (std::isfinite(v)) {
      last = v;
    } else {
      v = last;
    }
  }
  return out;
}

std::vector<std::size_t> reversals(const std::vector<double>& column, double band) {
  std::vector<std::size_t> reversals;
  double high = column.empty() ? 0.0 : column.front();
  double low = high;
  int direction = 0;
  for (std::size_t k = 0; k < column.size(); ++k) {
    high = std::max(high, column[k]);
    low = std::min(low, column[k]);
    if (direction <= 0 && column[k] > low + band) {
      if (direction < 0) reversals.push_back(k);
      direction = 1;
      high = column[k];
    } else if (direction >= 0 && column[k] < high - band) {
      if (direction > 0) reversals.push_back(k);
      direction = -1;
      low = column[k];
    }
    if (direction > 0) low = column[k];   // the next turn counts from the top
    if (direction < 0) high = column[k];  // and from the bottom
  }
  return reversals;
}

double noise_of(const std::vector<double>& column) {
  std::vector<double> bends;
  for (std::size_t k = 1; k + 1 < column.size(); ++k) {
    const double bend = std::abs(column[k + 1] - 2.0 * column[k] + column[k - 1]);
    if (std::isfinite(bend)) bends.push_back(bend);
  }
  if (bends.empty()) return 0.0;
  const double noise =
      numeric::kNormalOverMad * numeric::quantile_in_place(bends, 0.5) / std::sqrt(6.0);
  const double rounding = resolution_of(column) / std::sqrt(12.0);
  return std::max(noise, rounding);
}

double noise_of_stored(const std::vector<double>& column) {
  std::vector<std::size_t> at;
  for (std::size_t k = 0; k < column.size(); ++k) {
    if (std::isfinite(column[k])) at.push_back(k);
  }
  std::vector<double> off;
  for (std::size_t i = 1; i + 1 < at.size(); ++i) {
    const double w =
        static_cast<double>(at[i] - at[i - 1]) / static_cast<double>(at[i + 1] - at[i - 1]);
    const double line = (1.0 - w) * column[at[i - 1]] + w * column[at[i + 1]];
    off.push_back(std::abs(column[at[i]] - line) / std::sqrt(1.0 + w * w + (1.0 - w) * (1.0 - w)));
  }
  if (off.empty()) return 0.0;
  const double noise = numeric::kNormalOverMad * numeric::quantile_in_place(off, 0.5);
  return std::max(noise, resolution_of(held(column)) / std::sqrt(12.0));
}

LoopRecord believed(LoopRecord record, const plant::LoopModel& model) {
  const double span = model.transmitter.span();
  for (double& v : record.pv) {
    if (!(v >= model.transmitter.low - span && v <= model.transmitter.high + span)) v = kNone;
  }
  return record;
}

namespace {

void note(RecordCheck& check, const char* what, std::string sentence, double from_s = kNone,
          double to_s = kNone) {
  check.notes.push_back({what, std::move(sentence), from_s, to_s});
}

// The share of the column that stands at an end of its range.
double at_limit(const std::vector<double>& column, double low, double high) {
  const double margin = kAtEnd * (high - low);
  return static_cast<double>(
             std::count_if(column.begin(), column.end(),
                           [&](double v) { return v <= low + margin || v >= high - margin; })) /
         static_cast<double>(column.size());
}

// Each part adds figures and notes, and returns why the record can't be used; empty: it can.

std::string check_sampling(const LoopRecord& record, const plant::LoopModel& model, RecordCheck&) {
  if (record.size() < kFewestSamples) {
    return "only " + std::to_string(record.size()) + " samples; at least " +
           std::to_string(kFewestSamples) + " are needed";
  }
  if (std::abs(record.period_s - model.sample_time_s) > 0.01 * model.sample_time_s) {
    return text(
        "sampled every %g s, but the model's sample_time is %g s, and neither is a "
        "multiple of the other; --period %g reads it on that",
        record.period_s, model.sample_time_s, model.sample_time_s);
  }
  return {};
}

std::string check_pv(const LoopRecord& record, const plant::LoopModel& model, RecordCheck& check) {
  const std::size_t n = record.size();
  const std::size_t missing = numeric::missing(record.pv);
  if (record.pv_as_stored) {
    note(check, "stored",
         text("PV is compared at the %zu samples for which a value was stored", n - missing));
  } else if (missing * 5 > n) {
    return percent(static_cast<double>(missing) / static_cast<double>(n)) +
           " of PV is missing or far outside the transmitter's range; at most 20 % may be";
  }
  if (missing > 0 && !record.pv_as_stored) {
    note(check, "missing",
         std::to_string(missing) +
             " samples of PV are missing or far outside the transmitter's range; skipped");
  }
  const std::vector<double> pv = held(record.pv);
  check.noise_rms = record.pv_as_stored ? noise_of_stored(record.pv) : noise_of(record.pv);
  check.pv_resolution = resolution_of(pv);
  const auto [pv_low, pv_high] = std::minmax_element(pv.begin(), pv.end());
  std::size_t moves = 0;
  for (std::size_t k = 1; k < n; ++k) {
    if (pv[k] != pv[k - 1]) ++moves;
  }
  if (moves < kFewestMoves) {
    return (moves == 0 ? "PV never moves" : "PV hardly ever moves") +
           std::string(": the transmitter or the record is frozen");
  }

  const auto [rest_begin, rest_end] = longest_rest(record.pv);
  if (check.pv_resolution < 0.3 * (*pv_high - *pv_low) / 20.0 && rest_end - rest_begin >= 50 &&
      check.noise_rms > check.pv_resolution) {
    note(check, "frozen", "PV does not change although it is noisy elsewhere",
         record.seconds_at(rest_begin), record.seconds_at(rest_end));
    std::vector<double> moving = record.pv;
    std::fill(moving.begin() + static_cast<std::ptrdiff_t>(rest_begin),
              moving.begin() + static_cast<std::ptrdiff_t>(rest_end), kNone);
    check.noise_rms = noise_of(moving);
  }
  const double limited = at_limit(pv, model.transmitter.low, model.transmitter.high);
  if (limited > 0.002) {
    note(check, "saturated",
         "PV stands at an end of the transmitter's range for " + percent(limited) +
             " of the record");
  }
  return {};
}

std::string check_co(const LoopRecord& record, const plant::LoopModel& model, RecordCheck& check) {
  if (!record.has_co()) return {};
  const std::size_t n = record.size();
  const std::size_t missing = numeric::missing(record.co);
  if (missing * 20 > n) {
    return percent(static_cast<double>(missing) / static_cast<double>(n)) +
           " of CO is missing; at most 5 % may be";
  }
  if (missing > 0) {
    note(check, "missing",
         std::to_string(missing) + " samples of CO are missing; the value before holds");
  }
  const std::vector<double> co = held(record.co);
  check.co_resolution = resolution_of(co);
  const double low = model.controller.pid.output_low;
  const double high = model.controller.pid.output_high;
  const auto [co_low, co_high] = std::minmax_element(co.begin(), co.end());
  check.output_span_used = *co_high - *co_low;
  if (*co_low < low - 0.02 * (high - low) || *co_high > high + 0.02 * (high - low)) {
    return text(
        "CO runs from %g to %g, outside the model's output range of %g to %g; another "
        "unit (--co-range), or what the controller asked for before its limits "
        "(--clip-co)",
        *co_low, *co_high, low, high);
  }
  const double limited = at_limit(co, low, high);
  if (limited > 0.002) {
    note(check, "saturated", "CO stands at a limit for " + percent(limited) + " of the record");
  }
  // Reversals beyond the noise of CO.
  const double band = std::max(0.005 * (high - low), 6.0 * noise_of(co));
  check.output_reversals = static_cast<int>(reversals(co, band).size());
  if (check.output_span_used < kLeastMovement * (high - low)) {
    note(check, "little movement",
         "CO moves by less than 1 % of its span: valve effects can't be told apart; "
         "step the set point by 3 % twice in each direction");
  }
  return {};
}

std::string check_rest(const LoopRecord& record, const plant::LoopModel& model, RecordCheck&) {
  const std::vector<bool> used = usable_samples(record, model);
  const auto usable = static_cast<std::size_t>(std::count(
      used.begin(), used.begin() + static_cast<std::ptrdiff_t>(training_samples(record.size())),
      true));
  if (usable >= kFewestSamples / 2) return {};
  return "only " + std::to_string(usable) +
         " samples of the first two thirds can be used; at least " +
         std::to_string(kFewestSamples / 2) + " are needed";
}

}  // namespace

RecordCheck check_record(const LoopRecord& record, const plant::LoopModel& model) {
  RecordCheck check;
  for (const auto part : {check_sampling, check_pv, check_co, check_rest}) {
    check.refusal = part(record, model, check);
    check.usable = check.refusal.empty();
    if (!check.usable) break;
  }
  return check;
}

std::vector<bool> usable_samples(const LoopRecord& record, const plant::LoopModel& model) {
  std::vector<bool> used(record.size(), true);
  const auto wake = static_cast<std::size_t>(
      (model.process.dead_time_s + 4.0 * model.process.time_constant_s) / record.period_s);
  std::size_t blind = 0;
  for (std::size_t k = 0; k < record.size(); ++k) {
    if (!std::isfinite(record.pv[k])) used[k] = false;
    if (!record.has_co()) continue;
    blind = std::isfinite(record.co[k]) ? 0 : blind + 1;
    // One sample is bridged by the value before; after more, PV answers to what nobody knows.
    if (blind == 2) {
      for (std::size_t i = k; i < std::min(record.size(), k + wake); ++i) used[i] = false;
    } else if (blind > 2 && k + wake < record.size()) {
      used[k + wake] = false;
    }
  }
  return used;
}

}  // namespace loopwarden::gap
