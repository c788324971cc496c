// SPDX-License-Identifier: Apache-2.0
#include "record/import/constant_period.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <utility>

#include "base/text.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::record {
namespace {

using analysis::ArchivedSignal;
using analysis::ArchiveKind;

constexpr double kRegular = 0.01;          // of the period
constexpr double kJitter = 1.0 / 3.0;      // of the period
constexpr double kMostlyPolled = 0.7;      // of the steps
constexpr double kMultiples = 0.97;        // of the steps
constexpr double kAlike = 2.5;             // times the median, below which nearly all steps are
constexpr double kAnyDistance = 1e300;     // samples
constexpr std::size_t kLookedAt = 200000;  // samples or steps, for recognition
constexpr double kSparse = 0.2;            // of the samples missing
constexpr double kMostRowsAValue = 50.0;   // of a record, unless the period is given
constexpr double kSameSample = 0.1;        // of a scan: stamps that are closer are of one sample
constexpr double kStampJitter = 0.19;      // of a scan: two stamps of 0.095 each

bool known(double v) noexcept { return std::isfinite(v); }

std::vector<double> steps_of(const std::vector<double>& time_s) {
  std::vector<double> steps;
  steps.reserve(time_s.size());
  for (std::size_t k = 1; k < time_s.size(); ++k) {
    if (time_s[k] > time_s[k - 1]) steps.push_back(time_s[k] - time_s[k - 1]);
  }
  return steps;
}

// Usual periods of scans and loggers, s.
constexpr std::array kScans{3600.0, 1800.0, 900.0, 600.0, 300.0, 240.0, 180.0, 120.0, 60.0,
                            30.0,   20.0,   15.0,  12.0,  10.0,  8.0,   6.0,   5.0,   4.0,
                            3.0,    2.0,    1.0,   0.5,   0.4,   0.3,   0.25,  0.2,   0.1,
                            0.05,   0.04,   0.02,  0.01,  0.005, 0.002, 0.001};

// Returns the usual period if it moves no sample of `count` by half a period.
double as_set(double period_s, double count) {
  for (const double scan : kScans) {
    if (std::abs(period_s / scan - 1.0) * count < 0.5) return scan;
  }
  return tidy_period_s(period_s);
}

double scan_above(double s) {
  double above = s;
  for (const double scan : kScans) {
    if (scan >= s) above = scan;
  }
  return above;
}

double scan_below(double s) {
  for (const double scan : kScans) {
    if (scan <= s * (1.0 + 1e-9)) return scan;
  }
  return std::pow(10.0, std::floor(std::log10(s)));
}

// Returns the times of all known values.
std::vector<double> times_known(const Signal& signal) {
  std::vector<double> times;
  for (std::size_t k = 0; k < signal.value.size(); ++k) {
    if (!std::isnan(signal.value[k])) times.push_back((*signal.time_s)[k]);
  }
  return times;
}

// Returns the mean of the steps near `step_s`: stamps jitter and are rounded.
double mean_about(const std::vector<double>& steps, double step_s) {
  double sum = 0.0;
  std::size_t ones = 0;
  for (const double step : steps) {
    if (std::abs(step / step_s - 1.0) > 0.1) continue;
    sum += step;
    ++ones;
  }
  if (ones == 0) return step_s;
  const double mean = sum / static_cast<double>(ones);
  const double round = std::nearbyint(mean * 1e3) / 1e3;
  return round > 0.0 && std::abs(round - mean) < 0.01 * mean ? round : mean;
}

// Returns whether nearly all of `steps` are multiples of `scan_s`, apart from jitter of the stamps.
// Steps between two stamps of one scan don't count.
bool are_multiples(const std::vector<double>& steps, double scan_s) {
  const auto all = static_cast<double>(steps.size());
  double misfits = 0.0;
  double close = 0.0;
  for (const double step : steps) {
    const double times = step / scan_s;
    if (times < kSameSample) {
      if (++close > 0.5 * all) return false;
    } else if (times < 0.5 || std::abs(times - std::nearbyint(times)) > kStampJitter) {
      if (++misfits > (1.0 - kMultiples) * all) return false;
    }
  }
  return misfits <= (1.0 - kMultiples) * (all - close);
}

// Returns the resolution of the stamps: the largest of these values that all steps are multiples
// of; 0: none of them.
double resolution_of(const std::vector<double>& steps) {
  for (const double resolution : {60.0, 1.0, 0.1, 0.01, 0.001}) {
    const bool all = std::all_of(steps.begin(), steps.end(), [&](double step) {
      const double times = step / resolution;
      return std::abs(times - std::nearbyint(times)) < 1e-4 * std::max(1.0, 1e-3 * times);
    });
    if (all) return resolution;
  }
  return 0.0;
}

struct Scan {
  double s = 0.0;
  bool found = false;  // false: the times have no common step; derived from their density
};

// Returns the usual period near `scan_s`; otherwise the mean of the steps.
double settled(const std::vector<double>& steps, double scan_s) {
  for (const double usual : kScans) {
    if (std::abs(scan_s / usual - 1.0) < 0.02 && are_multiples(steps, usual)) return usual;
  }
  double sum = 0.0;
  double scans = 0.0;
  for (const double step : steps) {
    const double times = std::nearbyint(step / scan_s);
    if (std::abs(step / scan_s - times) > kStampJitter) continue;
    sum += step;
    scans += times;
  }
  return scans > 0.0 ? sum / scans : scan_s;
}

// Returns the scan period of times stored by an archive. It is the longest step that nearly all
// distances are multiples of. Candidates are the usual periods of loggers and the distances that
// are frequent. The shortest distance is no candidate by itself, because it may be jitter. A step
// near the resolution of the stamps fits all times. It is accepted only if it makes no more rows
// than `most_rows`.
Scan scan_of(std::vector<double> steps, double whole_s, double values, double most_rows) {
  constexpr double kTelling = 5.0;      // times the resolution
  constexpr double kRowsAValue = 16.0;  // if no scan is found; rounding makes it 40 at most
  const double resolution = resolution_of(steps);
  const double median = numeric::quantile(steps, 0.5);
  std::vector<double> candidates(kScans.begin(), kScans.end());
  for (const double place : {0.25, 0.1, 0.05, 0.02, 0.005})
    candidates.push_back(mean_about(steps, numeric::quantile_in_place(steps, place)));
  std::sort(candidates.begin(), candidates.end(), std::greater<>());
  for (const double candidate : candidates) {
    if (!are_multiples(steps, candidate)) continue;
    // Shorter candidates make more rows.
    if (candidate < kTelling * resolution && whole_s > most_rows * candidate) break;
    // For example, 0.1 s is a usual period and 1.7 s is not.
    const double scan = settled(steps, candidate);
    for (double times = std::min(100.0, std::floor(median / scan)); times > 1.0; times -= 1.0) {
      if (are_multiples(steps, times * scan)) return {settled(steps, times * scan), true};
    }
    return {scan, true};
  }
  const double dense =
      std::max(numeric::quantile_in_place(steps, 0.05), whole_s / (kRowsAValue * values));
  return {scan_below(dense), false};
}

// Returns whether the values were polled at an irregular period. An archive that thins values makes
// steps of very different lengths.
bool are_alike(std::vector<double> steps) {
  constexpr double kNearlyAll = 0.99;
  const double median = numeric::quantile(steps, 0.5);
  return numeric::quantile_in_place(steps, kNearlyAll) <= kAlike * median;
}

struct Grid {
  double from_s = 0.0;
  double period_s = 1.0;
  std::size_t count = 0;

  double time_s(std::size_t k) const { return from_s + static_cast<double>(k) * period_s; }
};

// Returns the last value at or before each time of the grid.
std::vector<double> held(const Signal& signal, const Grid& grid) {
  std::vector<double> out(grid.count, kEmpty);
  const std::vector<double>& time_s = *signal.time_s;
  std::size_t at = 0;
  double last = kEmpty;
  for (std::size_t k = 0; k < grid.count; ++k) {
    const double now = grid.time_s(k) + 0.25 * grid.period_s;
    for (; at < time_s.size() && time_s[at] <= now; ++at) {
      if (!std::isnan(signal.value[at])) last = signal.value[at];
    }
    out[k] = known(last) ? last : kEmpty;
  }
  return out;
}

// Returns values on straight lines between neighbours at most `reach_s` apart. Bad values interrupt
// a line.
std::vector<double> linear(const Signal& signal, const Grid& grid, double reach_s) {
  std::vector<double> out(grid.count, kEmpty);
  const std::vector<double>& time_s = *signal.time_s;
  std::size_t before = time_s.size();
  std::size_t after = 0;
  const double exact = 1e-6 * grid.period_s;
  for (std::size_t k = 0; k < grid.count; ++k) {
    const double now = grid.time_s(k);
    while (after < time_s.size() &&
           (std::isnan(signal.value[after]) || time_s[after] < now - exact)) {
      if (!std::isnan(signal.value[after])) before = after;
      ++after;
    }
    if (after < time_s.size() && std::abs(time_s[after] - now) <= exact) {
      if (known(signal.value[after])) out[k] = signal.value[after];
      continue;
    }
    if (after == time_s.size() || before == time_s.size()) continue;
    if (!known(signal.value[before]) || !known(signal.value[after])) continue;
    const double apart = time_s[after] - time_s[before];
    if (apart > reach_s) continue;
    const double share = (now - time_s[before]) / apart;
    out[k] = signal.value[before] + share * (signal.value[after] - signal.value[before]);
  }
  return out;
}

// Returns the value nearest to each time of the grid, at most half a period away.
std::vector<double> nearest(const Signal& signal, const Grid& grid) {
  std::vector<double> out(grid.count, kEmpty);
  for (std::size_t k = 0; k < signal.value.size(); ++k) {
    if (!known(signal.value[k])) continue;
    const double place = std::nearbyint(((*signal.time_s)[k] - grid.from_s) / grid.period_s);
    if (place >= 0.0 && place < static_cast<double>(grid.count)) {
      out[static_cast<std::size_t>(place)] = signal.value[k];
    }
  }
  return out;
}

double rms_between(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  std::size_t n = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    if (!known(a[k]) || !known(b[k])) continue;
    sum += (a[k] - b[k]) * (a[k] - b[k]);
    ++n;
  }
  return n == 0 ? 0.0 : std::sqrt(sum / static_cast<double>(n));
}

bool all_share_time(const Signals& signals) {
  const auto& time = signals[index_of(Role::pv)].time_s;
  return std::all_of(signals.begin(), signals.end(),
                     [&](const Signal& s) { return s.empty() || s.time_s == time; });
}

bool is_regular(const std::vector<double>& time_s) {
  const std::vector<double> steps = steps_of(time_s);
  if (steps.size() + 1 != time_s.size() || steps.empty()) return false;
  const double median = numeric::quantile(steps, 0.5);
  return std::all_of(steps.begin(), steps.end(),
                     [median](double s) { return std::abs(s - median) <= kRegular * median; });
}

ArchivedSignal recognise(const Signal& signal, double tick_s) {
  std::vector<double> times;
  std::vector<double> values;
  for (std::size_t k = 0; k < signal.value.size() && times.size() < kLookedAt; ++k) {
    if (!known(signal.value[k])) continue;
    times.push_back((*signal.time_s)[k]);
    values.push_back(signal.value[k]);
  }
  return analysis::recognise_stored(times, values, tick_s);
}

// CO is held, because a controller holds its output between two samples.
Filling filling_for(Role role, ArchiveKind kind, const ImportOptions& options) {
  if (options.filling != Filling::automatic) return options.filling;
  if (role == Role::co) return kind == ArchiveKind::swinging_door ? Filling::linear : Filling::held;
  return kind == ArchiveKind::exception ? Filling::held : Filling::linear;
}

// Returns whether the interpolation between two stored values is only an assumption.
bool is_guess(ArchiveKind kind, const ImportOptions& options) {
  return options.filling == Filling::automatic &&
         (kind == ArchiveKind::none || kind == ArchiveKind::unknown);
}

std::vector<bool> without_value(const std::vector<double>& column) {
  std::vector<bool> without;
  for (const double v : column) without.push_back(!known(v));
  return without;
}

void finish(Record& r) {
  const auto clean = [](std::vector<double>& column) {
    for (double& v : column) {
      if (!known(v)) v = kEmpty;
    }
  };
  clean(r.pv);
  clean(r.sp);
  clean(r.co);
  clean(r.stem);
  clean(r.automatic);
}

void count_missing(const Record& r, ImportNotes& notes) {
  notes.missing = 0;
  for (std::size_t k = 0; k < r.size(); ++k) {
    if (!known(r.pv[k]) || (!r.co.empty() && !known(r.co[k]))) ++notes.missing;
  }
}

std::vector<double>* column_of(Record& r, Role role) {
  switch (role) {
    case Role::pv: return &r.pv;
    case Role::sp: return &r.sp;
    case Role::co: return &r.co;
    case Role::stem: return &r.stem;
    case Role::mode: return &r.automatic;
  }
  return nullptr;
}

// Fills cells without a value in a regular file, which an archive left out or which are missing.
// `proved`: false if repeated values may have another reason; then no value is replaced.
ArchivedSignal fill_sparse(Role role, std::vector<double>& column, const ImportOptions& options,
                           bool proved, std::string& how) {
  const double share = static_cast<double>(numeric::missing(column)) /
                       static_cast<double>(std::max<std::size_t>(1, column.size()));
  const std::size_t looked = std::min(column.size(), kLookedAt);
  const ArchivedSignal found = analysis::recognise_filled(std::span(column).first(looked));
  if (found.kind == ArchiveKind::none) return found;
  if (share <= kSparse && found.held_lines && !proved) return {};
  if (share <= kSparse) {
    if (found.held_lines && filling_for(role, found.kind, options) == Filling::linear) {
      column = analysis::lines_for_steps(column);
      how = "values that were stored by swinging door and then held, as straight lines again";
    }
    return found;
  }
  Signal stored;
  stored.time_s = std::make_shared<std::vector<double>>();
  for (std::size_t k = 0; k < column.size(); ++k) {
    if (std::isnan(column[k])) continue;
    stored.time_s->push_back(static_cast<double>(k));
    stored.value.push_back(column[k]);
  }
  const Grid grid{0.0, 1.0, column.size()};
  const Filling filling = filling_for(role, found.kind, options);
  column = filling == Filling::held ? held(stored, grid) : linear(stored, grid, kAnyDistance);
  how = filling == Filling::held ? "the last value held" : "straight lines between the values";
  return found;
}

// Returns the samples at which the value changes.
std::vector<std::size_t> steps_in(const std::vector<double>& column) {
  std::vector<std::size_t> steps;
  for (std::size_t k = 1; k < column.size(); ++k) {
    if (column[k] != column[k - 1]) steps.push_back(k);
  }
  return steps;
}

// Returns whether the straight lines of PV bend some samples after the steps of CO. An integrating
// process responds in this way.
bool bends_at_steps(const std::vector<double>& pv, const std::vector<double>& co) {
  constexpr std::size_t kLongestLag = 30;  // samples
  constexpr std::size_t kNear = 5;         // samples
  constexpr double kMostSteps = 0.6;       // of the steps; by chance it is a quarter
  const std::vector<std::size_t> steps = steps_in(co);
  if (numeric::missing(pv) > 0 || steps.empty() || 2 * steps.size() > co.size()) return false;
  const std::vector<std::size_t> bends = analysis::run_ends(pv);
  for (std::size_t lag = 0; lag <= kLongestLag; ++lag) {
    const auto at_bends = std::count_if(steps.begin(), steps.end(), [&](std::size_t step) {
      const std::size_t at = step + lag;
      const auto next = std::lower_bound(bends.begin(), bends.end(), at > kNear ? at - kNear : 0);
      return next != bends.end() && *next <= at + kNear;
    });
    if (static_cast<double>(at_bends) >= kMostSteps * static_cast<double>(steps.size()))
      return true;
  }
  return false;
}

}  // namespace

void recognise_archive(Imported& imported, const ImportOptions& options) {
  Record& record = imported.record;
  ImportNotes& notes = imported.notes;
  std::string how;
  std::vector<bool> without = without_value(record.pv);
  notes.pv = fill_sparse(Role::pv, record.pv, options, true, how);
  if (!how.empty() && is_guess(notes.pv.kind, options)) imported.pv_drawn = std::move(without);
  if (how.empty() && !record.co.empty() && notes.pv.kind == ArchiveKind::swinging_door &&
      bends_at_steps(record.pv, record.co))
    notes.pv = {};
  // An operator may make steps of CO of any size; an archive holds PV as well.
  const bool archived = notes.pv.kind != ArchiveKind::none;
  if (!record.co.empty()) notes.co = fill_sparse(Role::co, record.co, options, archived, how);
  // The loop itself can cause such a pattern in a single signal. With a sticking valve and without
  // noise, CO is a straight line, and so is the PV of a tank. An archive holds both signals. A
  // constant signal is no evidence.
  if (how.empty() && !record.co.empty()) {
    const auto samples = static_cast<double>(record.size());
    const bool still = static_cast<double>(steps_in(record.co).size()) < 0.5 * samples;
    // An operator may make a few steps of one size.
    constexpr double kLeastAlone = 100.0;  // stored values of CO if PV is stored completely
    if (notes.pv.kind == ArchiveKind::none &&
        (notes.co.kind != ArchiveKind::exception || notes.co.stored_share * samples < kLeastAlone))
      notes.co = {};
    if (notes.co.kind == ArchiveKind::none && !still && notes.pv.kind != ArchiveKind::exception)
      notes.pv = {};
  }
  // If PV was thinned, a CO of few straight lines was thinned as well. The original values can't be
  // recovered.
  constexpr double kFew = 0.05;
  if (notes.pv.kind != ArchiveKind::none && notes.co.kind == ArchiveKind::none &&
      !record.co.empty() && notes.co.stored_share < kFew) {
    notes.co.kind = ArchiveKind::unknown;
  }
  const auto hold = [](std::vector<double>& column) {
    double last = kEmpty;
    for (double& v : column) {
      if (known(v)) last = v;
      if (std::isnan(v)) v = last;
    }
  };
  // Set points and modes are stored only when they change.
  if (!record.sp.empty() && 2 * numeric::missing(record.sp) > record.size()) hold(record.sp);
  if (!record.automatic.empty() && 2 * numeric::missing(record.automatic) > record.size())
    hold(record.automatic);
  if (!how.empty()) notes.resampled = "empty cells filled: " + how;
  finish(record);
  count_missing(record, notes);
}

namespace {

// Resamples the signals of a loop to a record, using the known properties of their times.
class Resampler {
 public:
  Resampler(Signals signals, const ImportOptions& options, ImportNotes notes, std::string place)
      : signals_(std::move(signals)),
        options_(options),
        place_(std::move(place)),
        out_{{}, std::move(notes)} {}

  Imported run() {
    if (pv_.empty()) fail("no values of PV");
    for (const Signal& s : signals_) {
      notes_.bad += s.bad;
      notes_.questionable += s.questionable;
    }
    if (all_share_time(signals_) && !options_.period_s && is_regular(*pv_.time_s)) {
      take_as_it_is();
    } else {
      find_steps();
      find_grid();
      count_samples();
      fill();
    }
    notes_.period_s = out_.record.period_s;
    return std::move(out_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw RecordError(RecordError::Kind::data, 0, 0, place_ + ": " + what);
  }

  std::vector<double>& column(Role role) { return *column_of(out_.record, role); }

  // All signals share one regular column of times.
  void take_as_it_is() {
    Record& r = out_.record;
    // Other loops of the file may share the times.
    const auto sharing = std::count_if(signals_.begin(), signals_.end(),
                                       [&](const Signal& s) { return s.time_s == pv_.time_s; });
    if (pv_.time_s.use_count() == sharing) {
      r.time_s = std::move(*pv_.time_s);
    } else {
      r.time_s = *pv_.time_s;
    }
    r.period_s = tidy_period_s((r.time_s.back() - r.time_s.front()) /
                               static_cast<double>(r.time_s.size() - 1));
    for (std::size_t k = 0; k < kRoles; ++k)
      column(static_cast<Role>(k)) = std::move(signals_[k].value);
    recognise_archive(out_, options_);
  }

  void find_steps() {
    pv_times_ = times_known(pv_);
    if (pv_times_.size() < 2) fail("fewer than two values of PV");
    values_ = pv_times_.size();
    pv_steps_ = steps_of(pv_times_);
    if (pv_steps_.empty()) fail("all values of PV have the same time");
    notes_.same_time += pv_times_.size() - 1 - pv_steps_.size();
  }

  void find_grid() {
    const double median = numeric::quantile(pv_steps_, 0.5);
    std::size_t near = 0;
    for (const double step : pv_steps_)
      near += static_cast<std::size_t>(std::abs(step - median) <= kJitter * median);
    polled_ = static_cast<double>(near) >= kMostlyPolled * static_cast<double>(pv_steps_.size());
    grid_.from_s = pv_times_.front();
    to_s_ = pv_times_.back();
    if (polled_) {
      double places = 0.0;
      for (const double step : pv_steps_) places += std::max(1.0, std::nearbyint(step / median));
      grid_.period_s = as_set((to_s_ - grid_.from_s) / places, places);
    } else {
      find_stored_grid(median);
    }
    if (options_.period_s) grid_.period_s = *options_.period_s;
  }

  // An archive may keep nine values in ten: its times are then multiples of a shorter period.
  // Stamps of PV and CO a few milliseconds apart belong to one scan, so only the distances within
  // each signal count.
  void find_stored_grid(double median) {
    const std::vector<double> co_times = co_.empty() ? std::vector<double>() : times_known(co_);
    if (!co_times.empty()) {
      grid_.from_s = std::min(grid_.from_s, co_times.front());
      to_s_ = std::max(to_s_, co_times.back());
    }
    std::vector<double> steps = steps_of(co_times);
    steps.insert(steps.end(), pv_steps_.begin(), pv_steps_.end());
    values_ = std::max(pv_times_.size(), co_times.size());
    if (const std::size_t every = steps.size() / kLookedAt; every > 1) {
      for (std::size_t k = 0; k * every < steps.size(); ++k) steps[k] = steps[k * every];
      steps.resize((steps.size() - 1) / every + 1);
    }
    const auto values = static_cast<double>(values_);
    const Scan scan =
        scan_of(std::move(steps), to_s_ - grid_.from_s, values, kMostRowsAValue * values);
    has_scan_ = scan.found;
    loosely_ = !has_scan_ && are_alike(pv_steps_);
    if (!loosely_) {
      grid_.period_s = scan.s;
      return;
    }
    grid_.from_s = pv_times_.front();
    to_s_ = pv_times_.back();
    polled_ = true;
    double sum = 0.0;
    std::size_t alike = 0;
    for (const double step : pv_steps_) {
      if (step > kAlike * median) continue;
      sum += step;
      ++alike;
    }
    grid_.period_s =
        as_set(sum / static_cast<double>(alike), static_cast<double>(pv_times_.size()));
  }

  void count_samples() {
    const double count = std::floor((to_s_ - grid_.from_s) / grid_.period_s + 0.5) + 1.0;
    if (!(count <= options_.most_samples)) {
      const double longest_s = *std::max_element(pv_steps_.begin(), pv_steps_.end());
      const bool gap = longest_s > kMostRowsAValue * grid_.period_s;
      fail(
          fmt::format("{:.3g} samples of {:g} s are too many: {}", count, grid_.period_s,
                      gap ? fmt::format("for {:.3g} h there are no values. Export the times before "
                                        "and after as two files",
                                        longest_s / 3600.0)
                          : std::string("set a longer one with --period")));
    }
    grid_.count = static_cast<std::size_t>(count);
    if (grid_.count < 2) fail(fmt::format("less than two samples of {:g} s", grid_.period_s));
    if (!options_.period_s && count > kMostRowsAValue * static_cast<double>(values_))
      refuse_sparse(count);
  }

  // Refuses a record of mostly interpolated values.
  [[noreturn]] void refuse_sparse(double count) const {
    const std::string what =
        fmt::format("{} values would make {:.0f} samples of {:g} s, more than {:g} per value",
                    values_, count, grid_.period_s, kMostRowsAValue);
    const double longer_s =
        (to_s_ - grid_.from_s) / (0.5 * kMostRowsAValue * static_cast<double>(values_));
    const std::string help = fmt::format("--period {:g} makes fewer", scan_above(longer_s));
    if (polled_) {
      const double longest_s = *std::max_element(pv_steps_.begin(), pv_steps_.end());
      fail(
          fmt::format("{}, because there are no values for up to {:.3g} h. Export the times before "
                      "and after as two files; {}",
                      what, longest_s / 3600.0, help));
    }
    fail(fmt::format("{}: most samples are not stored. Export raw values; {}", what, help));
  }

  void fill() {
    Record& r = out_.record;
    r.period_s = grid_.period_s;
    r.time_s.resize(grid_.count);
    for (std::size_t k = 0; k < grid_.count; ++k) r.time_s[k] = grid_.time_s(k);
    for (const Role role : {Role::sp, Role::mode}) {
      if (!signals_[index_of(role)].empty()) column(role) = held(signals_[index_of(role)], grid_);
    }
    if (polled_ && !options_.period_s) {
      fill_polled();
      recognise_archive(out_, options_);
    } else {
      fill_stored();
      // Steps shorter than those of the archive were not examined.
      finish(r);
      count_missing(r, notes_);
    }
  }

  void fill_polled() {
    double jitter = 0.0;
    for (const double step : pv_steps_) {
      const double off = std::abs(step / grid_.period_s - std::nearbyint(step / grid_.period_s));
      jitter = std::max(jitter, std::min(off, kJitter));
    }
    const bool steady = jitter <= 2.0 * kRegular && !loosely_;
    for (const Role role : {Role::pv, Role::co, Role::stem}) {
      const Signal& s = signals_[index_of(role)];
      if (s.empty()) continue;
      if (steady && s.time_s == pv_.time_s) {
        column(role) = nearest(s, grid_);
        continue;
      }
      column(role) = role == Role::co
                         ? held(s, grid_)
                         : linear(s, grid_, (loosely_ ? 2.0 * kAlike : 2.0) * grid_.period_s);
      if (role == Role::pv) notes_.moved_pv = rms_between(column(role), nearest(s, grid_));
    }
    if (steady) {
      if (grid_.count > pv_times_.size()) notes_.resampled = "missing rows are missing samples";
      return;
    }
    notes_.resampled = fmt::format(
        "{}: PV by straight lines between neighbours, which moves it by {:.3g} (rms), CO held",
        loosely_ ? fmt::format("times are {:.3g} to {:.3g} s apart, at no constant period",
                               *std::min_element(pv_steps_.begin(), pv_steps_.end()),
                               *std::max_element(pv_steps_.begin(), pv_steps_.end()))
                 : fmt::format("times jitter by up to {:.2g} % of the period", 100.0 * jitter),
        notes_.moved_pv);
  }

  // Returns the rule used to fill in values between the stored ones.
  const char* fill_by_rule(Role role, ArchivedSignal& found) {
    const Signal& s = signals_[index_of(role)];
    found = recognise(s, grid_.period_s);
    const bool hold = filling_for(role, found.kind, options_) == Filling::held;
    column(role) = hold ? held(s, grid_) : linear(s, grid_, kAnyDistance);
    if (role == Role::pv && is_guess(found.kind, options_))
      out_.pv_drawn = without_value(nearest(s, grid_));
    return hold ? "the last value held" : "straight lines";
  }

  void fill_stored() {
    std::string rule = fmt::format("PV: {}", fill_by_rule(Role::pv, notes_.pv));
    if (!co_.empty()) rule += fmt::format(", CO: {}", fill_by_rule(Role::co, notes_.co));
    ArchivedSignal stem;
    if (!signals_[index_of(Role::stem)].empty()) fill_by_rule(Role::stem, stem);
    notes_.resampled = fmt::format("values at {} times on a period of {:g} s ({}); {}",
                                   pv_times_.size(), grid_.period_s,
                                   options_.period_s ? "as told"
                                   : has_scan_       ? "their times are multiples of it"
                                                     : "their times have no common step",
                                   rule);
  }

  Signals signals_;
  const ImportOptions& options_;
  std::string place_;
  Imported out_;
  ImportNotes& notes_ = out_.notes;
  const Signal& pv_ = signals_[index_of(Role::pv)];
  const Signal& co_ = signals_[index_of(Role::co)];
  std::vector<double> pv_times_, pv_steps_;  // s
  Grid grid_;
  double to_s_ = 0.0;
  bool polled_ = false;
  bool has_scan_ = true;
  std::size_t values_ = 0;  // number of values of PV or of CO, the larger one
  bool loosely_ = false;    // polled, but at an irregular period
};

}  // namespace

std::string bad_words_text(const std::vector<BadWord>& words) {
  struct Found {
    std::size_t cells = 0;
    std::set<std::string> signals;
  };
  std::map<std::pair<std::string, std::string>, Found> all;
  for (const BadWord& one : words) {
    Found& found = all[{one.file, one.word}];
    // Loops may share a signal.
    if (found.signals.insert(one.signal).second) found.cells += one.cells;
  }
  std::string text;
  for (const auto& [place, found] : all) {
    const std::string signals = found.signals.size() == 1
                                    ? *found.signals.begin()
                                    : fmt::format("{} signals", found.signals.size());
    text += fmt::format("{}: {} in {} {} of {}: taken as a bad value\n", place.first,
                        base::in_quotes(place.second), found.cells,
                        found.cells == 1 ? "cell" : "cells", signals);
  }
  return text;
}

Imported on_constant_period(Signals signals, const ImportOptions& options, ImportNotes notes,
                            const std::string& place) {
  return Resampler(std::move(signals), options, std::move(notes), place).run();
}

}  // namespace loopwarden::record
