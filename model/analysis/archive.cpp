// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/archive.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/analysis/limits.hpp"
#include "model/numeric/statistics.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::analysis {
namespace {

struct Points {
  std::vector<double> time_s;
  std::vector<double> value;
};

// Returns the step of the last decimal that the values were written with; 0 if there is no such
// decimal.
double last_digit_of(std::span<const double> values) {
  double scale = 1.0;
  for (int digits = 0; digits <= Limits::kMostDigits; ++digits, scale *= 10.0) {
    const bool all = std::all_of(values.begin(), values.end(), [scale](double v) {
      const double scaled = v * scale;
      return !std::isfinite(v) ||
             std::abs(scaled - std::nearbyint(scaled)) <= 1e-9 * std::abs(scaled) + 1e-6;
    });
    if (all) return 1.0 / scale;
  }
  return 0.0;
}

std::vector<double> distinct(std::span<const double> values) {
  std::vector<double> levels(values.begin(), values.end());
  std::sort(levels.begin(), levels.end());
  levels.erase(std::unique(levels.begin(), levels.end()), levels.end());
  return levels;
}

// Returns the smallest possible step of the values: that of the last written decimal, or that of a
// transmitter with few values, independent of the decimals. 0 if there is no such step.
double quantum_of(std::span<const double> values) {
  const double decimal = last_digit_of(values);
  const std::vector<double> levels = distinct(values);
  if (levels.size() * Limits::kFewLevels > values.size() || levels.size() < 2) return decimal;
  std::vector<double> steps;
  for (std::size_t k = 1; k < levels.size(); ++k) steps.push_back(levels[k] - levels[k - 1]);
  return std::max(decimal, numeric::median(steps));
}

ArchivedSignal judge(const Points& stored, double tick_s, double share) {
  ArchivedSignal found{.kind = ArchiveKind::unknown, .deviation = 0.0, .stored_share = share};
  const std::size_t n = stored.value.size();
  if (n < Limits::kLeastStored) return found;
  std::vector<double> steps;
  std::size_t same = 0;
  double before = 0.0;
  // The last value is stored only because the export ends, so it doesn't count.
  for (std::size_t k = 1; k + 1 < n; ++k) {
    const double step = stored.value[k] - stored.value[k - 1];
    if (step == 0.0) continue;  // stored because of its age
    if (step * before > 0.0) ++same;
    steps.push_back(std::abs(step));
    before = step;
  }
  if (steps.size() < Limits::kLeastStored / 2) return found;
  std::sort(steps.begin(), steps.end());
  const double low = numeric::quantile_in_place(steps, 0.02);
  const double tenth = numeric::quantile_in_place(steps, 0.1);
  std::vector<double> sorted = stored.value;
  std::sort(sorted.begin(), sorted.end());
  const double range =
      numeric::quantile_in_place(sorted, 0.98) - numeric::quantile_in_place(sorted, 0.02);
  // A cycle with only its corners stored also has steps of one size, but never two in the same
  // direction.
  const bool sharp = tenth - low < (0.1 + 0.5 * share) * low;
  const bool corners = same * 50 < steps.size() && low > 0.3 * range;
  if (sharp && !corners) {
    found.kind = ArchiveKind::exception;
    found.deviation = low;
    return found;
  }
  std::vector<double> at_once;
  std::vector<double> all;
  for (std::size_t k = 1; k + 1 < n; ++k) {
    const double whole_s = stored.time_s[k + 1] - stored.time_s[k - 1];
    const double chord = stored.value[k - 1] + (stored.value[k + 1] - stored.value[k - 1]) *
                                                   (stored.time_s[k] - stored.time_s[k - 1]) /
                                                   whole_s;
    const double off = std::abs(stored.value[k] - chord);
    all.push_back(off);
    if (stored.time_s[k + 1] - stored.time_s[k] <= 1.5 * tick_s) at_once.push_back(off);
  }
  found.kind = ArchiveKind::swinging_door;
  if (at_once.size() >= Limits::kLeastAtOnce) {
    std::sort(at_once.begin(), at_once.end());
    const double least = numeric::quantile_in_place(at_once, 0.05);
    if (least < Limits::kAnyValue * numeric::quantile_in_place(at_once, 0.5)) {
      found.kind = ArchiveKind::unknown;
      return found;
    }
    found.deviation = Limits::kAtOnceScale * least;
  } else {
    std::sort(all.begin(), all.end());
    found.deviation = Limits::kAllScale * numeric::quantile_in_place(all, 0.25);
  }
  return found;
}

// Returns whether many samples are on the line between their neighbours to the last digit and the
// others are far off it. By chance about 0.5 tolerance / distance of the samples are on it; a slow
// smooth signal has no kinks. The neighbours are `lag` samples away: a line that rises by less than
// the last digit per sample is visible only over a longer distance.
bool drawn_by_lines(std::span<const double> x, std::size_t lag, double tolerance) {
  std::size_t on_line = 0;
  std::vector<double> kinks;
  for (std::size_t k = lag; k + lag < x.size(); ++k) {
    const double off = std::abs(x[k + lag] - 2.0 * x[k] + x[k - lag]);
    if (off > tolerance * 1.01) {
      kinks.push_back(off);
    } else if (std::abs(x[k + lag] - x[k - lag]) > Limits::kRising * tolerance) {
      ++on_line;
    }
  }
  if (kinks.size() < Limits::kLeastStored) return false;
  const double chance = 0.54 * tolerance / numeric::median(kinks);
  return static_cast<double>(on_line) >
         (Limits::kOnLine + 4.0 * chance) * static_cast<double>(x.size());
}

bool drawn_by_lines(std::span<const double> x) {
  const double quantum = quantum_of(x);
  const auto [lowest, highest] = std::minmax_element(x.begin(), x.end());
  const double tolerance = quantum > 0.0 ? 2.0 * quantum : 1e-9 * (*highest - *lowest);
  return drawn_by_lines(x, 1, tolerance) || drawn_by_lines(x, 4, tolerance) ||
         drawn_by_lines(x, 16, tolerance);
}

double variation(const std::vector<double>& lengths) {
  return numeric::deviation(lengths) / numeric::mean(lengths);
}

// Returns the intervals. If only few of them are multiples of the usual one, these are divided,
// because an update with the same value joins two intervals.
std::vector<double> intervals(std::vector<double> lengths) {
  const double usual = numeric::median(lengths);
  const auto whole = [&](double length) { return std::max(1.0, std::round(length / usual)); };
  const auto joined = std::count_if(lengths.begin(), lengths.end(),
                                    [&](double length) { return whole(length) > 1.0; });
  if (usual < 2.0 ||
      static_cast<double>(joined) > Limits::kJoined * static_cast<double>(lengths.size())) {
    return lengths;
  }
  for (double& length : lengths) length /= whole(length);
  return lengths;
}

// Returns whether the steps are those of the signal, not of an archive: multiples of the smallest
// step, or at equal intervals.
bool steps_of_the_signal(const Points& levels) {
  std::vector<double> steps;
  std::vector<double> lengths;
  for (std::size_t k = 1; k < levels.value.size(); ++k) {
    steps.push_back(std::abs(levels.value[k] - levels.value[k - 1]));
    lengths.push_back(levels.time_s[k] - levels.time_s[k - 1]);
  }
  if (steps.size() < 3) return true;
  const double smallest = *std::min_element(steps.begin(), steps.end());
  std::size_t multiples = 0;
  for (double& step : steps) {
    step /= smallest;
    if (std::abs(step - std::nearbyint(step)) < 0.05) ++multiples;
  }
  // One step in ten is a multiple by chance. If steps are large, every one is a multiple of the
  // last digit.
  const bool all_multiples =
      static_cast<double>(multiples) > Limits::kMultiples * static_cast<double>(steps.size()) &&
      numeric::quantile_in_place(steps, 0.5) < Limits::kFewMultiples;
  return all_multiples || variation(intervals(lengths)) < Limits::kEqualIntervals;
}

// Returns whether the steps are those of a converter: the distances of the levels are multiples of
// one step, exact to the last written digit, and successive values are neighbouring levels. In an
// archive the steps are larger than the distance of the levels. An archive of a moving signal
// seldom stores the same value again. Integers, and an output that is stepped manually between the
// same values, return to few levels.
bool steps_by_its_resolution(const std::vector<double>& stored, double last_digit) {
  const std::vector<double> levels = distinct(stored);
  if (levels.size() < 3) return true;
  std::vector<double> gaps;
  for (std::size_t k = 1; k < levels.size(); ++k) gaps.push_back(levels[k] - levels[k - 1]);
  const double tolerance = std::max(1.01 * last_digit, 1e-6 * (levels.back() - levels.front()));
  const double usual = numeric::median(gaps);
  double sum = 0.0;
  double ones = 0.0;
  for (const double gap : gaps) {
    if (std::abs(gap - usual) > tolerance) continue;
    sum += gap;
    ones += 1.0;
  }
  const double step = sum / ones;
  const auto multiples = std::count_if(gaps.begin(), gaps.end(), [&](double gap) {
    return std::abs(gap - std::max(1.0, std::nearbyint(gap / step)) * step) <= tolerance;
  });
  std::vector<double> moves;
  for (std::size_t k = 1; k < stored.size(); ++k)
    moves.push_back(std::abs(stored[k] - stored[k - 1]));
  std::sort(moves.begin(), moves.end());
  const double small = numeric::quantile_in_place(moves, 0.1) - tolerance;
  const bool few_levels = static_cast<double>(levels.size()) <=
                          Limits::kLevelsOfSteps * static_cast<double>(stored.size());
  if (few_levels) return small <= Limits::kFewLevelsStep * step;
  return static_cast<double>(multiples) >= Limits::kMultiples * static_cast<double>(gaps.size()) &&
         small <= Limits::kLevelStep * step;
}

}  // namespace

const char* to_text(ArchiveKind kind) noexcept {
  return numeric::enum_name<ArchiveKind::unknown>(
      kind, {"none", "exception", "swinging_door", "unknown"});
}

ArchivedSignal recognise_stored(std::span<const double> time_s, std::span<const double> values,
                                double tick_s) {
  const std::size_t n = values.size();
  if (n < 2) return {};
  const double share =
      static_cast<double>(n - 1) / std::max(1.0, (time_s.back() - time_s.front()) / tick_s);
  if (share > Limits::kStoredAll) return {.stored_share = std::min(share, 1.0)};
  return judge({{time_s.begin(), time_s.end()}, {values.begin(), values.end()}}, tick_s, share);
}

std::vector<std::size_t> run_ends(std::span<const double> values) {
  std::vector<std::size_t> ends;
  const std::size_t n = values.size();
  if (n == 0) return ends;
  const double quantum = quantum_of(values);
  const auto [lowest, highest] =
      std::minmax_element(values.begin(), values.end(), [](double a, double b) { return a < b; });
  const double tolerance = quantum > 0.0 ? 1.05 * quantum : 1e-9 * (*highest - *lowest);
  std::size_t from = 0;
  ends.push_back(0);
  while (from + 1 < n) {
    double least = -std::numeric_limits<double>::infinity();
    double most = std::numeric_limits<double>::infinity();
    std::size_t to = from;
    while (to + 1 < n) {
      const double samples = static_cast<double>(to + 1 - from);
      const double change = values[to + 1] - values[from];
      const double slope_low = std::max(least, (change - tolerance) / samples);
      const double slope_high = std::min(most, (change + tolerance) / samples);
      if (!(slope_low <= slope_high)) break;
      least = slope_low;
      most = slope_high;
      ++to;
    }
    if (to == from) to = from + 1;  // a missing sample
    ends.push_back(to);
    from = to;
  }
  return ends;
}

ArchivedSignal recognise_filled(std::span<const double> values) {
  const std::size_t n = values.size();
  std::vector<double> known;
  std::vector<double> at;
  for (std::size_t k = 0; k < n; ++k) {
    if (!std::isfinite(values[k])) continue;
    known.push_back(values[k]);
    at.push_back(static_cast<double>(k));
  }
  if (known.size() < Limits::kLeastStored) return {};
  // Cells without a stored value are empty.
  const double share = static_cast<double>(known.size()) / static_cast<double>(n);
  if (share < Limits::kStoredAll) {
    std::vector<double> gaps;
    for (std::size_t k = 1; k < at.size(); ++k) gaps.push_back(at[k] - at[k - 1]);
    // One long outage, or a record of every fifth sample, isn't an archive.
    std::size_t steps = 0;
    for (const double gap : gaps) steps += gap > 1.5 ? 1 : 0;
    if (steps * 10 < gaps.size() || variation(gaps) < Limits::kEqualIntervals) {
      return {.stored_share = share};
    }
    return judge({at, known}, 1.0, share);
  }
  const auto [lowest, highest] = std::minmax_element(known.begin(), known.end());
  const std::vector<std::size_t> ends =
      *highest > *lowest ? run_ends(known) : std::vector<std::size_t>{0};
  // The result without a rule. The stored share is still useful if the record consists of few
  // lines, because another signal of the record may show the rule.
  const ArchivedSignal none{.stored_share = ends.size() < Limits::kLeastStored
                                                ? static_cast<double>(ends.size()) /
                                                      static_cast<double>(known.size())
                                                : 1.0};
  if (!(*highest > *lowest)) return none;
  if (drawn_by_lines(known)) {
    Points points;
    for (const std::size_t end : ends) {
      points.time_s.push_back(static_cast<double>(end));
      points.value.push_back(known[end]);
    }
    const ArchivedSignal found =
        judge(points, 1.0, static_cast<double>(ends.size()) / static_cast<double>(known.size()));
    return {.kind = ArchiveKind::swinging_door,
            .deviation = found.deviation,
            .stored_share = found.stored_share};
  }
  Points levels{{0.0}, {known.front()}};
  std::size_t repeats = 0;
  for (std::size_t k = 1; k < known.size(); ++k) {
    if (known[k] == known[k - 1]) {
      ++repeats;
      continue;
    }
    levels.time_s.push_back(static_cast<double>(k));
    levels.value.push_back(known[k]);
  }
  const double quantum = last_digit_of(known);
  const double repeated = static_cast<double>(repeats) / static_cast<double>(known.size());
  if (repeated < Limits::kRepeated || levels.value.size() < Limits::kLeastStored ||
      steps_of_the_signal(levels) || steps_by_its_resolution(levels.value, quantum)) {
    return none;
  }
  ArchivedSignal found = judge(levels, 1.0, 1.0 - repeated);
  // Rounding of a settling signal looks like a dead band of the last digit.
  if (found.kind == ArchiveKind::unknown || found.deviation <= Limits::kLastDigits * quantum)
    return none;
  found.held_lines = found.kind == ArchiveKind::swinging_door;
  return found;
}

std::vector<double> within_band(std::span<const double> held, double dead_band) {
  std::vector<double> out(held.begin(), held.end());
  std::size_t from = 0;
  for (std::size_t k = 1; k < held.size(); ++k) {
    if (!std::isfinite(held[k]) || !std::isfinite(held[k - 1])) {
      from = k;
      continue;
    }
    if (held[k] == held[k - 1]) continue;
    const double change = held[k] - held[from];
    const auto length = static_cast<double>(k - from);
    for (std::size_t i = from; i < k; ++i) {
      out[i] = held[from] +
               std::clamp(change * static_cast<double>(i - from) / length, -dead_band, dead_band);
    }
    from = k;
  }
  return out;
}

std::vector<double> lines_for_steps(std::span<const double> held) {
  return within_band(held, std::numeric_limits<double>::infinity());
}

}  // namespace loopwarden::analysis
