// SPDX-License-Identifier: Apache-2.0
#include "services/page/fleet_queries/alarm_rate.hpp"

#include <algorithm>

namespace loopwarden::fleet {
namespace {

using Week = std::array<std::int64_t, kBinsOfWeek>;

template <class It>
RateOfSpan rate_of(It begin, It end) {
  RateOfSpan span;
  std::int64_t floods = 0;
  for (It bin = begin; bin != end; ++bin) {
    span.raised += *bin;
    span.most = std::max(span.most, *bin);
    if (*bin > kFlood) ++floods;
  }
  const auto bins = static_cast<double>(end - begin);
  span.per_bin = static_cast<double>(span.raised) / bins;
  span.flood_percent = 100.0 * static_cast<double>(floods) / bins;
  return span;
}

AlarmRate rates_of(const Week& week) {
  AlarmRate rate;
  const auto* const day = week.end() - kBinsOfDay;
  rate.week = rate_of(week.begin(), week.end());
  rate.day = rate_of(day, week.end());
  std::copy(day, week.end(), rate.bins.begin());
  return rate;
}

}  // namespace

std::map<std::string, AlarmRate> alarm_rates(const std::vector<RaisedRow>& rows,
                                             std::int64_t until) {
  std::map<std::string, Week> weeks;
  weeks[""];
  for (const RaisedRow& row : rows) {
    const std::int64_t from_oldest = row.bin - (until - kBinsOfWeek);
    if (from_oldest < 0 || row.bin >= until) continue;
    const auto bin = static_cast<std::size_t>(from_oldest);
    weeks[row.group][bin] += row.raised;
    weeks[""][bin] += row.raised;
  }
  std::map<std::string, AlarmRate> rates;
  for (const auto& [group, week] : weeks) rates[group] = rates_of(week);
  return rates;
}

}  // namespace loopwarden::fleet
