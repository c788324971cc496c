// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/identification.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "model/analysis/excitation.hpp"
#include "model/analysis/limits.hpp"
#include "model/numeric/statistics.hpp"
#include "model/numeric/text.hpp"

namespace loopwarden::analysis {
namespace {

using Values = std::vector<double>;

std::string number(double value, int digits = 6) { return numeric::text("%.*g", digits, value); }

// Fills gaps with the previous value, and a gap at the start with the first value.
Values closed_up(std::span<const double> column) {
  Values out(column.begin(), column.end());
  const auto first =
      std::find_if(out.begin(), out.end(), [](double v) { return std::isfinite(v); });
  double held = first == out.end() ? 0.0 : *first;
  for (double& v : out) {
    if (std::isfinite(v)) held = v;
    v = held;
  }
  return out;
}

// Without gaps.
struct Columns : numeric::LoopRecord {
  Values measured;  // PV with its gaps
};

// The columns at the samples in which the controller acts. A record may be faster than the
// controller, or CO may be sent only after it has moved enough. If CO moves in most samples, every
// sample is used.
struct ControllerRows {
  numeric::LoopRecord loop;
  std::size_t first = 0;  // sample
  std::size_t every = 1;  // samples

  // Returns a column of `samples` values from one value per row.
  Values held(const Values& of_rows, std::size_t samples) const {
    Values out;
    for (std::size_t k = 0; k < samples; ++k) {
      out.push_back(of_rows[std::min(k < first ? 0 : (k - first) / every, of_rows.size() - 1)]);
    }
    return out;
  }
};

Columns columns_of(const numeric::LoopView& record) {
  if (record.co.size() != record.pv.size() || record.co.size() < Limits::kFewestSamples) {
    throw IdentificationError("a record of at least 30 samples with CO and PV is needed");
  }
  if (record.size() - numeric::missing(record.pv) < Limits::kFewestSamples) {
    throw IdentificationError("PV is missing nearly everywhere");
  }
  Columns c{{.period_s = record.period_s, .pv = closed_up(record.pv), .co = closed_up(record.co)},
            {record.pv.begin(), record.pv.end()}};
  if (numeric::LoopRecord::has_value(record.sp)) c.sp = closed_up(record.sp);
  if (numeric::LoopRecord::has_value(record.automatic)) {
    c.automatic = closed_up(record.automatic);
    for (double& v : c.automatic) v = v == 0.0 ? 0.0 : 1.0;
  }
  const auto still = [](const Values& v) {
    return std::all_of(v.begin(), v.end(), [&](double x) { return x == v.front(); });
  };
  if (still(c.co)) throw IdentificationError("CO never moves in this record");
  if (still(c.pv)) throw IdentificationError("PV never moves in this record");
  return c;
}

ControllerRows controller_rows(const Columns& c) {
  std::vector<std::size_t> moved;
  for (std::size_t k = 1; k < c.size(); ++k) {
    if (c.co[k] != c.co[k - 1]) moved.push_back(k);
  }
  ControllerRows rows;
  if (moved.size() >= Limits::kFewestMoves) {
    rows.every = static_cast<std::size_t>(
        std::lround(static_cast<double>(c.size() - 1) / static_cast<double>(moved.size())));
  }
  std::vector<std::size_t> moved_at(rows.every, 0);
  for (const std::size_t k : moved) ++moved_at[k % rows.every];
  rows.first = static_cast<std::size_t>(std::max_element(moved_at.begin(), moved_at.end()) -
                                        moved_at.begin());
  rows.loop.period_s = c.period_s * static_cast<double>(rows.every);
  const auto taken = [&](const Values& column) {
    Values out;
    for (std::size_t k = rows.first; k < column.size(); k += rows.every) out.push_back(column[k]);
    return out;
  };
  rows.loop.co = taken(c.co);
  rows.loop.pv = taken(c.pv);
  rows.loop.sp = taken(c.sp);
  rows.loop.automatic = taken(c.automatic);
  return rows;
}

double mean_of(const Values& column, std::size_t from, std::size_t to) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t k = from; k < std::min(to, column.size()); ++k) {
    if (!std::isfinite(column[k])) continue;
    sum += column[k];
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : std::nan("");
}

// CO is the mean over each block; PV is the mean around the beginning of the block.
Values thinned_co(const Values& co, const SamplesUsed& used) {
  if (used.thinned == 1) {
    return {co.begin() + static_cast<std::ptrdiff_t>(used.from),
            co.begin() + static_cast<std::ptrdiff_t>(used.from + used.count)};
  }
  Values out;
  for (std::size_t i = 0; i < used.count; ++i) {
    const std::size_t from = used.from + i * used.thinned;
    out.push_back(mean_of(co, from, from + used.thinned));
  }
  return out;
}

Values thinned_pv(const Values& pv, const SamplesUsed& used) {
  Values out;
  const std::size_t half = used.thinned / 2;
  for (std::size_t i = 0; i < used.count; ++i) {
    const std::size_t at = used.from + i * used.thinned;
    out.push_back(mean_of(pv, at - std::min(at, half), at - half + used.thinned));
  }
  return out;
}

// Returns the samples for the fit: CO minus its first value, PV minus its mean.
Samples samples_of(const Columns& c, const SamplesUsed& used) {
  Samples s{.u = thinned_co(c.co, used),
            .y = thinned_pv(c.measured, used),
            .period_s = c.period_s * static_cast<double>(used.thinned)};
  const double first = s.u.front();
  for (double& v : s.u) v -= first;
  const double mean = mean_of(s.y, 0, s.y.size());
  for (double& v : s.y) {
    v -= mean;
    if (std::isfinite(v)) ++s.used;
  }
  return s;
}

// Returns the first sample of the stretch of `length` samples in which the column moves most.
std::size_t busiest(const Values& column, std::size_t length) {
  Values travel{0.0};
  for (std::size_t k = 1; k < column.size(); ++k) {
    travel.push_back(travel.back() + std::abs(column[k] - column[k - 1]));
  }
  std::size_t best = 0;
  double most = -1.0;
  for (std::size_t k = 0; k + length <= column.size(); k += std::max<std::size_t>(1, length / 20)) {
    const double here = travel[k + length - 1] - travel[k];
    if (here > most) {
      most = here;
      best = k;
    }
  }
  return best;
}

SamplesUsed choose_samples(const Columns& c, const Feedback& feedback,
                           std::vector<std::string>& notes) {
  SamplesUsed used{.from = 0, .thinned = 1, .count = c.size()};
  if (c.size() <= Limits::kMostSamples) return used;
  // The time constant of the process, from the whole record with the strongest thinning.
  used.thinned = (c.size() + Limits::kMostSamples / 4 - 1) / (Limits::kMostSamples / 4);
  used.count = c.size() / used.thinned;
  const PredictionFit rough = start_fit(samples_of(c, used), false);
  const double rough_s = rough.time_constant_s;
  double longest = rough_s / (Limits::kSamplesPerLag * c.period_s);
  // Moves of the controller within a thinned sample must not reach PV within this sample.
  if (feedback.closed) longest = std::min(longest, rough.dead_time_s / (2.0 * c.period_s));
  const auto most = static_cast<std::size_t>(std::max(1.0, longest));
  used.thinned = std::min((c.size() + Limits::kMostSamples - 1) / Limits::kMostSamples, most);
  if (used.thinned > 1) {
    notes.push_back("thinned: means of " + std::to_string(used.thinned) +
                    " samples, because the process is slow");
  }
  used.count = c.size() / used.thinned;
  if (used.count <= Limits::kMostSamples) return used;
  used.count = Limits::kMostSamples;
  const bool by_set_point = feedback.closed && feedback.set_point_moves;
  used.from = busiest(by_set_point ? c.sp : c.co, Limits::kMostSamples * used.thinned);
  const double from_s = static_cast<double>(used.from) * c.period_s;
  const double length_s = static_cast<double>(used.count * used.thinned) * c.period_s;
  notes.push_back("cut to the stretch in which " + std::string(by_set_point ? "SP" : "CO") +
                  " moves most: from " + number(from_s) + " s to " + number(from_s + length_s) +
                  " s of the record");
  return used;
}

ProcessFit described(const Samples& s, const PredictionFit& fit, const Intervals& intervals,
                     double mean, double spread) {
  ProcessFit out;
  out.form = fit.form;
  out.gain = intervals.gain;
  out.time_constant_s = intervals.time_constant_s;
  out.second_lag_s = intervals.second_lag_s;
  out.dead_time_s = intervals.dead_time_s;
  out.noise_order = fit.noise.order();
  out.criterion = fit.criterion;
  const auto n = static_cast<double>(s.used);
  out.prediction_rms = std::sqrt(fit.sum_squares / n);
  out.free_run = free_run(s, fit);
  // The noise model has no level, so the level of the free run is the mean of the error.
  double left = 0.0;
  for (std::size_t k = 0; k < s.size(); ++k) {
    if (std::isfinite(s.y[k])) left += (s.y[k] - out.free_run[k]) / n;
  }
  double squares = 0.0;
  for (std::size_t k = 0; k < s.size(); ++k) {
    out.free_run[k] += left;
    if (std::isfinite(s.y[k])) squares += std::pow(s.y[k] - out.free_run[k], 2);
    out.free_run[k] += mean;
  }
  out.rest_pv = mean + fit.level + left;
  out.rmse = std::sqrt(squares / n);
  out.fit_percent = 100.0 * (1.0 - out.rmse / spread);
  return out;
}

// Returns the process of a limit cycle, after its valve, as a fit of one lag.
ProcessFit behind_valve(const StickingCycle& cycle) {
  ProcessFit fit;
  fit.gain = cycle.gain;
  fit.time_constant_s = cycle.time_constant_s;
  fit.dead_time_s = cycle.dead_time_s;
  fit.noise_order = 1;
  fit.rest_pv = cycle.level;
  fit.prediction_rms = cycle.noise_rms;
  fit.rmse = cycle.rmse;
  fit.fit_percent = cycle.fit_percent;
  fit.free_run = cycle.free_run;
  return fit;
}

// Returns the reason why the interval of the gain is too wide, or an empty text.
std::string too_wide(const Estimate& gain) {
  const double near = std::min(std::abs(gain.low), std::abs(gain.high));
  const double far = std::max(std::abs(gain.low), std::abs(gain.high));
  if (gain.low * gain.high > 0.0 && Limits::kMostFactor * near >= std::abs(gain.value) &&
      far <= Limits::kMostFactor * std::abs(gain.value)) {
    return {};
  }
  return "The gain lies between " + number(gain.low, 3) + " and " + number(gain.high, 3) +
         " (95 %): too wide for a model.";
}

// Returns the rms error of a straight line through PV.
double left_by_line(const Samples& s) {
  double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0, yy = 0.0;
  for (std::size_t k = 0; k < s.size(); ++k) {
    if (!std::isfinite(s.y[k])) continue;
    const double t = static_cast<double>(k) / static_cast<double>(s.size());
    n += 1.0;
    x += t;
    y += s.y[k];
    xx += t * t;
    xy += t * s.y[k];
    yy += s.y[k] * s.y[k];
  }
  const double own = xx - x * x / n;
  const double slope = own > 0.0 ? (xy - x * y / n) / own : 0.0;
  return std::sqrt(std::max(0.0, (yy - y * y / n - slope * (xy - x * y / n)) / n));
}

// Returns the rms error of the free run around its mean.
double free_run_rms(const Samples& s, const PredictionFit& fit) {
  const Values run = free_run(s, fit);
  double n = 0.0, sum = 0.0, squares = 0.0;
  for (std::size_t k = 0; k < s.size(); ++k) {
    if (!std::isfinite(s.y[k])) continue;
    const double left = s.y[k] - run[k];
    n += 1.0;
    sum += left;
    squares += left * left;
  }
  return std::sqrt(std::max(0.0, squares - sum * sum / n) / n);
}

Samples with_co_earlier(const Samples& s, std::size_t samples) {
  Samples out = s;
  for (std::size_t k = 0; k < s.size(); ++k) out.u[k] = s.u[std::min(k + samples, s.size() - 1)];
  return out;
}

// Returns the number of samples by which CO is logged too late. PV can respond at the earliest in
// the row after the move of CO.
std::size_t late_samples(const Samples& s) {
  double least = Limits::kFarBetter * start_fit(s, false).sum_squares;
  std::size_t late = 0;
  for (std::size_t by = 1; by <= Limits::kMostLate; ++by) {
    const PredictionFit fit = start_fit(with_co_earlier(s, by), false);
    // A larger shift would count as dead time.
    if (!(fit.sum_squares < least)) continue;
    least = Limits::kFarBetter * fit.sum_squares;
    late = by;
  }
  return late;
}

// Returns `fit` with the noise order that suits its form: the error of one lag may have looked like
// noise.
PredictionFit with_own_noise(const Samples& s, const PredictionFit& fit) {
  PredictionFit best = fit;
  for (std::size_t order = 0; order < fit.noise.order(); ++order) {
    const PredictionFit other = refined(s, with_noise_order(s, fit, order));
    if (other.criterion < best.criterion) best = other;
  }
  return best;
}

// Returns `base` and the fits of two lags, integrating, and integrating with a lag, with the noise
// order of `base`.
std::vector<PredictionFit> all_forms(const Samples& s, const PredictionFit& base) {
  std::vector<PredictionFit> fits{base, with_own_noise(s, with_second_lag(s, base))};
  PredictionFit integrating = start_fit(s, true);
  if (base.noise.order() != 1) integrating = with_noise_order(s, integrating, base.noise.order());
  fits.push_back(refined(s, integrating));
  fits.push_back(with_second_lag(s, fits.back()));
  return fits;
}

std::size_t least_criterion(const std::vector<PredictionFit>& fits) {
  const auto least = std::min_element(fits.begin(), fits.end(),
                                      [](const PredictionFit& one, const PredictionFit& other) {
                                        return one.criterion < other.criterion;
                                      });
  return static_cast<std::size_t>(least - fits.begin());
}

// Returns the factor by which an interval is too narrow if successive errors are correlated.
double widening(const Samples& s, const PredictionFit& fit) {
  const Values e = innovations(s, fit);
  double squares = 0.0, products = 0.0;
  for (std::size_t k = 1; k < e.size(); ++k) {
    squares += e[k] * e[k];
    products += e[k] * e[k - 1];
  }
  const double together = squares > 0.0 ? std::clamp(products / squares, 0.0, 0.999) : 0.0;
  return std::sqrt((1.0 + together) / (1.0 - together));
}

Estimate widened(const Estimate& e, double by) {
  return {e.value, e.value - by * (e.value - e.low), e.value + by * (e.high - e.value)};
}

Intervals widened(Intervals i, double by) {
  for (Estimate* e : {&i.gain, &i.time_constant_s, &i.second_lag_s, &i.dead_time_s}) {
    *e = widened(*e, by);
  }
  for (Estimate* e : {&i.time_constant_s, &i.second_lag_s, &i.dead_time_s}) {
    e->low = std::max(0.0, e->low);
  }
  return i;
}

// Widens the intervals for lags of about a sampling period: the record has no information about CO
// between samples.
void allow_for_slow_logging(Intervals& i, double period_s) {
  for (Estimate* lag : {&i.time_constant_s, &i.second_lag_s}) {
    lag->low = std::min(lag->low, lag->value / Limits::kLagFactor);
    lag->high = std::max(lag->high, lag->value * Limits::kLagFactor);
  }
  i.dead_time_s.low = std::max(0.0, std::min(i.dead_time_s.low, i.dead_time_s.value - period_s));
  i.dead_time_s.high = std::max(i.dead_time_s.high, i.dead_time_s.value + period_s);
}

std::string by_switching(SwitchingLaw law) {
  switch (law) {
    case SwitchingLaw::two_levels: return "CO switches between two values when PV passes a level";
    case SwitchingLaw::pulses: return "CO is pulsed, and the on-time follows PV";
    default: break;
  }
  return "CO moves up only on one side of the set point and down only on the other";
}

constexpr const char* kStepByHand =
    "Step CO in manual twice in each direction, each step held until PV has settled.";
constexpr const char* kStepIt =
    "Step the set point by 3 to 5 % of its span twice in each direction, each step held until PV "
    "has settled; or step CO in manual.";

}  // namespace

plant::ProcessParameters ProcessFit::process() const {
  plant::ProcessParameters p{.gain = gain.value,
                             .time_constant_s = time_constant_s.value,
                             .dead_time_s = dead_time_s.value,
                             .second_time_constant_s = second_lag_s.value,
                             .level = level};
  if (is_integrating(form)) {
    p.kind = plant::ProcessKind::integrating;
    p.time_constant_s = plant::ProcessParameters{}.time_constant_s;
  }
  return p;
}

namespace {

Identification by_outside_moves(const Columns& c) {
  const ControllerRows rows = controller_rows(c);
  const Feedback feedback = find_feedback(rows.loop.view());
  Identification out;
  if (!feedback.closed || feedback.by_mode) {
    const SwitchingLaw law = switching_law(c.view());
    if (law != SwitchingLaw::none) {
      out.closed_loop = true;
      out.by_mode = feedback.by_mode;
      out.reason = "The loop is closed by a controller that is not linear: " + by_switching(law) +
                   ". The effect of CO on PV can't be separated from other causes.";
      out.settle = kStepByHand;
      return out;
    }
  }
  out.closed_loop = feedback.closed;
  out.by_mode = feedback.by_mode;
  const bool by_hand =
      std::any_of(c.automatic.begin(), c.automatic.end(), [](double v) { return v == 0.0; });
  if (feedback.closed && !c.sp.empty() && !feedback.set_point_moves && !by_hand) {
    out.reason =
        "The loop is closed and SP never moves: CO only follows PV, so the effect of CO on PV "
        "can't be "
        "distinguished from a disturbance.";
    out.settle = kStepIt;
    return out;
  }
  out.used = choose_samples(c, feedback, out.notes);
  Samples s = samples_of(c, out.used);
  if (!feedback.closed) {
    if (const std::size_t late = late_samples(s); late > 0) {
      s = with_co_earlier(s, late);
      out.late = late * out.used.thinned;
      out.notes.push_back("CO is logged " + std::to_string(late) + " sample" +
                          (late > 1 ? "s" : "") +
                          " too late against PV: it was shifted back by as much");
    }
  }

  // The simplest form determines the noise order for the other forms.
  PredictionFit base = start_fit(s, false);
  for (std::size_t order = 0; order <= Limits::kMostNoiseOrder; ++order) {
    if (order == 1) continue;
    const PredictionFit other = with_noise_order(s, base, order);
    if (other.criterion < base.criterion) base = other;
  }
  base = refined(s, base);
  std::vector<PredictionFit> fits = all_forms(s, base);
  std::size_t best = least_criterion(fits);
  const double line = left_by_line(s);
  double wider = 1.0;
  if (const double left = free_run_rms(s, fits[best]);
      !feedback.closed && left > Limits::kHalf * line) {
    std::vector<PredictionFit> exact =
        all_forms(s, refined(s, with_noise_order(s, start_fit(s, false), 0)));
    const std::size_t best_exact = least_criterion(exact);
    if (free_run_rms(s, exact[best_exact]) < Limits::kHalf * left) {
      fits = std::move(exact);
      best = best_exact;
      wider = widening(s, fits[best]);
    }
  }
  out.preferred = best;

  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  const double quickest = is_integrating(fits[best].form) ? kInfinite : fits[best].time_constant_s;
  const bool slow_logging =
      quickest < Limits::kSlowLogging * s.period_s && (feedback.closed || quickest < s.period_s);
  if (slow_logging) {
    out.notes.push_back("the time constant is about the sampling period of " +
                        number(s.period_s, 4) +
                        " s: the moves of CO between two samples are not in the record, and the "
                        "intervals of the lags and of the dead time allow for it");
  }
  std::vector<Intervals> intervals;
  for (std::size_t i = 0; i < fits.size(); ++i) {
    intervals.push_back(widened(
        i == best ? profile_intervals(s, fits[i]) : curvature_intervals(s, fits[i]), wider));
    if (slow_logging) allow_for_slow_logging(intervals.back(), s.period_s);
  }
  double mean =
      mean_of(c.measured, out.used.from, out.used.from + out.used.count * out.used.thinned);
  double spread = 0.0;
  for (const double y : s.y) spread += std::isfinite(y) ? y * y : 0.0;
  spread = std::sqrt(spread / static_cast<double>(s.used));
  const double first_co = thinned_co(c.co, out.used).front();
  std::vector<ProcessFit> described_fits;
  for (std::size_t i = 0; i < fits.size(); ++i) {
    described_fits.push_back(described(s, fits[i], intervals[i], mean, spread));
    ProcessFit& fit = described_fits.back();
    if (!is_integrating(fit.form)) fit.level = fit.rest_pv - fit.gain.value * first_co;
  }
  const ProcessFit& chosen = described_fits[best];
  const std::optional<StaticGain> bent = feedback.closed ? std::nullopt : static_gain(c.co, c.pv);
  std::string of_opening;
  if (bent) {
    of_opening = "the gain depends on the opening: " + number(bent->at_low, 3) +
                 " PV units/CO unit at CO " + number(bent->low_co, 4) + ", " +
                 number(bent->at_high, 3) + " at CO " + number(bent->high_co, 4);
    out.notes.push_back(of_opening);
  }
  Values outside = s.u;
  if (feedback.closed) {
    outside = outside_output(rows.loop.view(), feedback, chosen.process(), rows.loop.period_s);
    if (outside.empty()) {
      out.reason = "The loop is closed, but how CO follows from SP and PV could not be found.";
      out.settle = "Step CO in manual, or give the column `mode`.";
      return out;
    }
    outside = thinned_co(rows.held(outside, c.size()), out.used);
    const double first = outside.front();
    for (double& v : outside) v -= first;
  }
  const double error = gain_error_under(s, fits[best], outside);
  out.outside_margin = 1.96 * error / std::abs(chosen.gain.value);
  if (!(out.outside_margin <= Limits::kMostOutsideMargin)) {
    const char* const moved =
        !feedback.closed ? "The movement of CO"
        : c.sp.empty()
            ? "The loop is closed, SP is not in the record, and the external movement of CO"
            : "The loop is closed, and the movement of SP";
    out.reason = std::string(moved) + " fixes the gain within +-" +
                 number(std::min(100.0 * out.outside_margin, 9999.0), 2) + " % at best: " +
                 (bent ? "no one gain fits, as " + of_opening + "."
                       : std::string("too little compared with the other causes that move PV."));
    out.settle = feedback.closed ? kStepIt : kStepByHand;
    return out;
  }
  out.reason = too_wide(chosen.gain);
  if (!out.can_tell()) {
    out.settle = kStepIt;
    return out;
  }
  if (!(chosen.rmse < line)) {
    out.reason =
        "The best model has an error of " + number(chosen.rmse, 3) +
        " PV units (rms), a straight line has " + number(line, 3) +
        ": the model does not describe this record. " +
        (feedback.closed ? "CO only follows the other causes that move PV."
                         : "PV does not follow CO, or not by one gain, lags and a dead time.");
    out.settle = feedback.closed ? kStepIt : kStepByHand;
    return out;
  }
  out.fits = std::move(described_fits);
  return out;
}

}  // namespace

namespace {

// Returns the jump of the stem when it starts from rest: the median, and an interval from the 10 %
// to the 90 % quantile. One sample after the jump, the stem has also followed CO for one to two
// samples. Empty if the stem starts from rest too seldom.
std::optional<Estimate> slip_jump(const Values& stem, const Values& co) {
  Values moves{0.0};
  Values sizes;
  for (std::size_t k = 1; k < stem.size(); ++k) {
    moves.push_back(std::abs(stem[k] - stem[k - 1]));
    sizes.push_back(moves.back());
  }
  const auto [low, high] = std::minmax_element(stem.begin(), stem.end());
  const double still =
      std::max(Limits::kSlipNoise * numeric::kNormalOverMad * numeric::median(sizes),
               Limits::kLeastSlip * (*high - *low));
  Values least;
  Values jumps;
  Values most;
  std::size_t rested = 0;
  for (std::size_t k = 1; k + 1 < stem.size(); ++k) {
    if (moves[k] <= still) {
      ++rested;
      continue;
    }
    if (rested >= Limits::kSlipRest) {
      const double travel = stem[k + 1] - stem[k - 1];
      const double along = std::copysign(1.0, travel) * (co[k + 1] - co[k - 1]);
      const double followed = std::isfinite(along) ? std::max(along, 0.0) : 0.0;
      least.push_back(std::abs(travel) - followed);
      jumps.push_back(std::abs(travel) - 0.75 * followed);
      most.push_back(std::abs(travel) - 0.5 * followed);
    }
    rested = 0;
  }
  if (jumps.size() < Limits::kFewestSlips) return std::nullopt;
  return Estimate{numeric::median(jumps), numeric::quantile(least, 0.1),
                  numeric::quantile(most, 0.9)};
}

// With a measured stem, takes the slip jump from the stem and identifies the process from the stem
// to PV.
void take_stem(Identification& out, const Columns& c, const numeric::LoopView& record) {
  if (record.stem.size() != c.size() || !numeric::LoopRecord::has_value(record.stem)) return;
  const Values stem = closed_up(record.stem);
  if (const std::optional<Estimate> jump = slip_jump(stem, c.co)) {
    out.cycle->j = *jump;
    out.notes.push_back("j is the jump of the stem, from its read-back");
  }
  Columns from_stem = c;
  from_stem.co = stem;
  from_stem.sp.clear();
  from_stem.automatic.assign(c.size(), 0.0);
  Identification process = by_outside_moves(from_stem);
  if (!process.can_tell()) return;
  out.notes.push_back("the process is identified from the stem's read-back to PV");
  out.reason.clear();
  out.settle.clear();
  out.used = process.used;
  out.fits = std::move(process.fits);
  out.preferred = process.preferred;
}

}  // namespace

std::optional<StaticGain> static_gain(std::span<const double> co, std::span<const double> pv) {
  std::vector<std::pair<double, double>> rests;
  std::size_t from = 0;
  for (std::size_t k = 1; k <= co.size(); ++k) {
    if (k < co.size() && co[k] == co[from]) continue;
    const std::size_t length = k - from;
    if (length >= Limits::kFewestRestRows) {
      const auto tail = pv.subspan(k - length / 3, length / 3);
      rests.emplace_back(co[from], numeric::mean(tail));
    }
    from = k;
  }
  std::sort(rests.begin(), rests.end());
  std::size_t levels = rests.empty() ? 0 : 1;
  for (std::size_t i = 1; i < rests.size(); ++i) {
    if (rests[i].first > rests[i - 1].first) ++levels;
  }
  if (rests.size() < Limits::kFewestRests || levels < Limits::kFewestLevels) return std::nullopt;
  // A line and a parabola of PV over CO, with CO scaled to -1 to 1.
  const double middle = 0.5 * (rests.front().first + rests.back().first);
  const double half = 0.5 * (rests.back().first - rests.front().first);
  const auto n = static_cast<Eigen::Index>(rests.size());
  Eigen::MatrixXd columns(n, 3);
  Eigen::VectorXd y(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& [u, v] = rests[static_cast<std::size_t>(i)];
    const double x = (u - middle) / half;
    columns.row(i) << 1.0, x, x * x;
    y(i) = v;
  }
  const Eigen::VectorXd line = columns.leftCols(2).colPivHouseholderQr().solve(y);
  const Eigen::VectorXd parabola = columns.colPivHouseholderQr().solve(y);
  const double line_left = (y - columns.leftCols(2) * line).squaredNorm();
  const double parabola_left = (y - columns * parabola).squaredNorm();
  // The slopes through the rests of the lower and of the upper third of the travel.
  const auto slope = [&](double least, double most) {
    double count = 0.0, x = 0.0, v = 0.0, xx = 0.0, xv = 0.0;
    for (const auto& [co_at, pv_at] : rests) {
      const double at = (co_at - middle) / half;
      if (at < least || at > most) continue;
      count += 1.0;
      x += at;
      v += pv_at;
      xx += at * at;
      xv += at * pv_at;
    }
    const double own = count * xx - x * x;
    return own > 0.0 ? (count * xv - x * v) / own / half : std::nan("");
  };
  constexpr double kThird = 1.0 / 3.0;
  const StaticGain gain{.low_co = rests.front().first,
                        .high_co = rests.back().first,
                        .at_low = slope(-1.0, -kThird),
                        .at_high = slope(kThird, 1.0)};
  const double lesser = std::min(std::abs(gain.at_low), std::abs(gain.at_high));
  const double greater = std::max(std::abs(gain.at_low), std::abs(gain.at_high));
  if (parabola_left > Limits::kBentLeaves * line_left || !(greater >= Limits::kBentGain * lesser)) {
    return std::nullopt;
  }
  return gain;
}

Identification identify(const numeric::LoopView& record) {
  const Columns c = columns_of(record);
  Identification out = by_outside_moves(c);
  if (out.can_tell()) return out;
  out.cycle = find_sticking_cycle(c.co, c.pv, c.period_s);
  if (!out.cycle) return out;
  take_stem(out, c, record);
  const StickingCycle& cycle = *out.cycle;
  out.notes.push_back("the valve sticks, s " + number(cycle.s.value, 3) + " and j " +
                      number(cycle.j.value, 3) +
                      " CO units: it and the process were identified together from the cycle");
  if (out.can_tell()) return out;
  out.reason = too_wide(cycle.gain);
  if (!out.can_tell()) {
    out.reason += " The stem stops after each slip, and a slip shows only gain times slip jump: " +
                  number(cycle.gain.value * cycle.j.value, 3) + " PV units.";
    return out;
  }
  out.settle.clear();
  out.used = {.from = 0, .thinned = cycle.every, .count = cycle.free_run.size()};
  out.fits = {behind_valve(cycle)};
  out.preferred = 0;
  return out;
}

std::pair<double, double> assumed_range(std::span<const double> column) {
  const numeric::Range range = numeric::range_of(column);
  if (range.low >= 0.0 && range.high <= 100.0 && range.high > 10.0) return {0.0, 100.0};
  if (range.low >= 0.0 && range.high <= 10.0 && range.high > 1.0) return {0.0, 10.0};
  const double more = 0.1 * (range.high - range.low);
  return {range.low - more, range.high + more};
}

plant::LoopModel stem_follows_output(std::span<const double> co, double sample_time_s) {
  constexpr double kAtOnce = 0.1;  // share of a sample
  plant::LoopModel model;
  model.sample_time_s = sample_time_s;
  model.process = {.gain = 1.0, .time_constant_s = kAtOnce * sample_time_s};
  const auto [low, high] = assumed_range(co);
  model.controller.pid.gains = {.kp = 1.0};  // not used: the measured CO counts
  model.controller.pid.output_low = model.controller.output.low = low;
  model.controller.pid.output_high = model.controller.output.high = high;
  model.transmitter.low = model.controller.set_point.low = low;
  model.transmitter.high = model.controller.set_point.high = high;
  return model;
}

AssumedModel assumed_model(const numeric::LoopView& record, const KnownRanges& known) {
  AssumedModel out;
  out.identification = identify(record);
  const std::optional<StickingCycle>& cycle = out.identification.cycle;
  if (!out.identification.can_tell() && !cycle) return out;
  const ProcessFit best =
      out.identification.can_tell() ? out.identification.best() : behind_valve(*cycle);
  const Columns c = columns_of(record);
  plant::LoopModel model;
  model.sample_time_s = record.period_s;
  model.process = best.process();
  const auto relative = [](const Estimate& e, double least) {
    const double half = (std::min(e.high, 2.0 * e.value) - e.low) / 2.0;
    return std::clamp(half / std::max(std::abs(e.value), 1e-300), least, 1.0);
  };
  const plant::ProcessUncertainty usual;
  model.uncertainty = {
      .gain = relative(best.gain.value > 0.0
                           ? best.gain
                           : Estimate{-best.gain.value, -best.gain.high, -best.gain.low},
                       usual.gain),
      .time_constant = is_integrating(best.form)
                           ? usual.time_constant
                           : relative(best.time_constant_s, usual.time_constant),
      .dead_time = relative(best.dead_time_s, usual.dead_time)};
  out.assumptions.push_back(
      std::string("process: ") + to_text(best.form) +
      (cycle ? ", identified together with a valve that sticks" : ", identified from this record"));
  if (cycle || !is_integrating(best.form)) {
    const double level = cycle ? cycle->level : numeric::mean(c.pv);
    const double mean_co = cycle ? cycle->mean_co : numeric::mean(c.co);
    model.process.level = level - best.gain.value * mean_co;
    out.assumptions.push_back("level: PV " + number(level) + " at CO " + number(mean_co) +
                              ", as in this record");
  }
  auto [co_low, co_high] = known.co.value_or(assumed_range(c.co));
  if (cycle && !known.co) {  // the band fills the used range, so the true range is wider
    const double more =
        std::max(0.0, Limits::kSpanOverBand * cycle->s.value - (co_high - co_low)) / 2.0;
    co_low -= more;
    co_high += more;
  }
  const auto [pv_low, pv_high] = known.pv.value_or(assumed_range(c.pv));
  model.controller.pid.output_low = model.controller.output.low = co_low;
  model.controller.pid.output_high = model.controller.output.high = co_high;
  model.transmitter.low = model.controller.set_point.low = pv_low;
  model.transmitter.high = model.controller.set_point.high = pv_high;
  const auto say_range = [&](const char* signal, double low, double high, bool told) {
    out.assumptions.push_back(signal + (" runs from " + number(low)) + " to " + number(high) +
                              (told ? ", as given" : ""));
  };
  say_range("CO", co_low, co_high, known.co.has_value());
  say_range("PV", pv_low, pv_high, known.pv.has_value());
  const ControllerRows rows = controller_rows(c);
  const PiGains gains = find_pi_gains(rows.loop.view());
  if (out.identification.closed_loop && gains.explained >= Limits::kUnderstood) {
    out.controller_known = true;
    const bool direct = gains.kp < 0.0;
    model.controller.pid.action = direct ? control::Action::direct : control::Action::reverse;
    model.controller.pid.gains = {.kp = std::abs(gains.kp),
                                  .ki = std::max(0.0, direct ? -gains.ki : gains.ki)};
    out.assumptions.push_back("controller: PI with kp " + number(gains.kp, 4) + " and ki " +
                              number(gains.ki, 4) + ", as CO follows SP and PV");
    if (c.sp.empty()) {
      model.scenario.set_point = {{0.0, gains.set_point}};
      out.assumptions.push_back("SP: " + number(gains.set_point) +
                                " throughout; it is not in the record");
    }
  } else {
    model.controller.pid.gains = {.kp = 1.0 / std::max(std::abs(best.gain.value), 1e-9)};
    out.assumptions.emplace_back(
        "controller: unknown; only the measured CO counts, and a proportional controller "
        "replaces it");
  }
  out.assumptions.emplace_back("valve: no effect at all");
  out.model = std::move(model);
  return out;
}

Tangent tangent_method(std::span<const double> co, std::span<const double> pv,
                       double sample_time_s) {
  const Columns c = columns_of({.period_s = sample_time_s, .pv = pv, .co = co});
  std::size_t at = 0;
  double largest = 0.0;
  double travel = 0.0;
  for (std::size_t k = 1; k < c.co.size(); ++k) {
    const double move = std::abs(c.co[k] - c.co[k - 1]);
    travel += move;
    if (move > largest) {
      largest = move;
      at = k;
    }
  }
  if (travel > 1.05 * largest) {
    throw IdentificationError("the record needs exactly one step of CO");
  }
  const auto mean = [&](std::size_t from, std::size_t to) {
    const double value = mean_of(c.measured, from, to);
    if (std::isnan(value)) throw IdentificationError("PV is missing during the step");
    return value;
  };
  const std::size_t n = c.measured.size();
  Tangent t;
  t.before = mean(0, at + 1);
  t.final_value = mean(n - std::max<std::size_t>(1, (n - at) / 10), n);
  const double rise = t.final_value - t.before;
  const auto reach = [&](double share) {
    for (std::size_t k = at; k < n; ++k) {
      if ((c.measured[k] - t.before) / rise >= share) return k;
    }
    return n - 1;
  };
  const std::size_t slow = reach(0.85) - reach(0.2);
  const std::size_t width = std::max<std::size_t>(3, slow / 10);
  double steepest = 0.0;
  double touch = 0.0;
  double touch_value = 0.0;
  for (std::size_t k = at; k + width <= n; ++k) {
    const double middle = static_cast<double>(width - 1) / 2.0;
    double sum = 0.0, weighted = 0.0, squares = 0.0;
    for (std::size_t i = 0; i < width; ++i) {
      const double x = static_cast<double>(i) - middle;
      sum += c.measured[k + i];
      weighted += x * c.measured[k + i];
      squares += x * x;
    }
    const double slope = weighted / squares;
    if (!(slope * rise > steepest * std::abs(rise))) continue;
    steepest = std::abs(slope);
    touch = static_cast<double>(k) + middle;
    touch_value = sum / static_cast<double>(width);
  }
  if (!(steepest > 0.0)) throw IdentificationError("PV does not answer to CO in this record");
  t.slope = std::copysign(steepest, rise) / sample_time_s;
  t.step_time_s = static_cast<double>(at) * sample_time_s;
  t.steepest_s = touch * sample_time_s;
  const double start_s = t.steepest_s - (touch_value - t.before) / t.slope;
  t.process = {.gain = rise / (c.co[at] - c.co[at - 1]),
               .time_constant_s = rise / t.slope,
               .dead_time_s = std::max(0.0, start_s - t.step_time_s)};
  return t;
}

}  // namespace loopwarden::analysis
