// SPDX-License-Identifier: Apache-2.0
#include "tests/support/oscillation.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::test {
namespace {

std::vector<double> values_of(const std::vector<double>& signal, Cycle cycle) {
  return {signal.begin() + static_cast<std::ptrdiff_t>(cycle.begin),
          signal.begin() + static_cast<std::ptrdiff_t>(cycle.end)};
}

// Returns the median over the cycles of `measure(values of the cycle)`.
template <class Measure>
double median_over(const std::vector<double>& signal, const std::vector<Cycle>& cycles,
                   Measure measure) {
  std::vector<double> results;
  for (const Cycle cycle : cycles) results.push_back(measure(values_of(signal, cycle)));
  return median(std::move(results));
}

double kurtosis_of(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  double mean = 0.0;
  for (const double v : values) mean += v / n;
  double second = 0.0;
  double fourth = 0.0;
  for (const double v : values) {
    const double square = (v - mean) * (v - mean);
    second += square;
    fourth += square * square;
  }
  return n * fourth / (second * second);
}

double share_of(const std::vector<double>& values) {
  const auto [lowest, highest] = std::minmax_element(values.begin(), values.end());
  const double middle = (*lowest + *highest) / 2.0;
  const double near = (*highest - *lowest) / 10.0;
  std::vector<double> upper;
  std::vector<double> lower;
  for (const double v : values) (v > middle ? upper : lower).push_back(v);
  const double high = median(upper);
  const double low = median(lower);
  const auto count = std::count_if(values.begin(), values.end(), [&](double v) {
    return std::abs(v - high) <= near || std::abs(v - low) <= near;
  });
  return static_cast<double>(count) / static_cast<double>(values.size());
}

}  // namespace

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::vector<Cycle> find_cycles(const std::vector<double>& signal, double level, double depth) {
  std::vector<Cycle> cycles;
  bool was_deep = false;
  bool begun = false;
  std::size_t begin = 0;
  for (std::size_t k = 0; k < signal.size(); ++k) {
    if (signal[k] < level - depth) was_deep = true;
    if (!was_deep || signal[k] <= level) continue;
    if (begun) cycles.push_back({begin, k});
    begun = true;
    begin = k;
    was_deep = false;
  }
  return cycles;
}

double period(const std::vector<Cycle>& cycles, double sample_time_s) {
  std::vector<double> periods;
  for (const Cycle cycle : cycles) {
    periods.push_back(static_cast<double>(cycle.end - cycle.begin) * sample_time_s);
  }
  return median(std::move(periods));
}

double amplitude(const std::vector<double>& signal, const std::vector<Cycle>& cycles) {
  return median_over(signal, cycles, [](const std::vector<double>& values) {
    const auto [lowest, highest] = std::minmax_element(values.begin(), values.end());
    return (*highest - *lowest) / 2.0;
  });
}

double kurtosis(const std::vector<double>& signal, const std::vector<Cycle>& cycles) {
  return median_over(signal, cycles, kurtosis_of);
}

double share_at_two_levels(const std::vector<double>& signal, const std::vector<Cycle>& cycles) {
  return median_over(signal, cycles, share_of);
}

}  // namespace loopwarden::test
