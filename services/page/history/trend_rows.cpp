// SPDX-License-Identifier: Apache-2.0
#include "services/page/history/trend_rows.hpp"

#include <cmath>

namespace loopwarden::page::history {

std::vector<Block> rows_of(const protocol::Trend& trend, const LastCycle& last,
                           const std::optional<Block>& newest) {
  std::vector<Block> rows;
  for (std::size_t i = 0; i < trend.period.size(); ++i) {
    record::RecordRow row;
    row.period_index = trend.period[i];
    row.pv = trend.pv.at(i);
    row.sp = trend.sp.at(i);
    row.co = trend.co.at(i);
    row.stem = trend.stem.at(i);
    if (trend.mode.at(i) == "AUTO") row.mode = control::Mode::automatic;
    const double ago = last.period - static_cast<double>(row.period_index);
    const std::int64_t at_ms = last.utc_ms - std::llround(ago * last.ms_per_period);
    if (newest && at_ms <= newest->last_ms) continue;
    rows.push_back(block_of(row, at_ms, 0, 0));
  }
  return rows;
}

}  // namespace loopwarden::page::history
