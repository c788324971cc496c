// SPDX-License-Identifier: Apache-2.0
#include "workbench/commands/made_test.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "record/segment_export.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/records/record_input.hpp"

namespace loopwarden::workbench {
namespace {

using State = estimator::MadeMove::State;

// SP or output, where the loop is in the mode of the plan.
std::vector<double> moved_signal(const TestPlanFile& plan, const record::Record& record) {
  const bool manual = estimator::in_manual(plan.move.kind);
  std::vector<double> value = manual ? record.co : record.sp;
  if (value.empty()) fail(kExitData, "the record has no column '{}'", manual ? "co" : "sp");
  for (std::size_t k = 0; k < record.automatic.size(); ++k) {
    if (record.automatic[k] == (manual ? 1.0 : 0.0)) {
      value[k] = std::numeric_limits<double>::quiet_NaN();
    }
  }
  return value;
}

TestRecord cut(const record::Record& record, const estimator::MadeMove& move, double rest_s) {
  const auto rest = static_cast<std::size_t>(std::ceil(rest_s / record.period_s));
  std::size_t first = move.begin - std::min(move.begin, rest);
  const auto complete = [&](std::size_t k) {
    return std::isfinite(record.pv[k]) && std::isfinite(record.co[k]);
  };
  while (first < move.begin && !complete(first)) ++first;
  TestRecord test{
      .period_s = record.period_s, .time_s = {}, .sp = {}, .pv = {}, .co = {}, .stem = {}};
  for (std::size_t k = first; k < std::min(move.end, record.size()); ++k) {
    const double after = static_cast<double>(k) - static_cast<double>(move.begin);
    test.time_s.push_back(after * record.period_s);
    test.sp.push_back(record.sp.empty() ? record.pv[first] : record.sp[k]);
    test.pv.push_back(record.pv[k]);
    test.co.push_back(record.co[k]);
    test.stem.push_back(record.stem.empty() ? std::numeric_limits<double>::quiet_NaN()
                                            : record.stem[k]);
  }
  return test;
}

}  // namespace

MadeTest find_made_test(const TestPlanFile& plan, const std::vector<record::Record>& records,
                        double rest_s) {
  MadeTest newest;
  for (const record::Record& record : records) {
    if (record.co.empty()) fail(kExitData, "the record has no column 'co'");
    const estimator::MadeMove move =
        estimator::find_move(plan.move, plan.from, moved_signal(plan, record), record.period_s);
    if (move.state == State::none) continue;
    newest.move = move;
    if (move.state != State::made) continue;
    newest.record = cut(record, move, rest_s);
    break;
  }
  return newest;
}

std::vector<record::Record> read_later_records(const std::filesystem::path& path,
                                               std::int64_t from_s, std::int64_t to_s,
                                               OutputFiles& files) {
  if (!std::filesystem::is_directory(path)) return {RecordInput().read(path).record};
  constexpr std::int64_t kNs = 1'000'000'000;
  const record::ExportResult exported = record::export_csv(
      path, files.make_scratch_folder(), {.from_utc_ns = from_s * kNs, .to_utc_ns = to_s * kNs});
  std::vector<record::Record> records;
  for (const record::ExportedRecord& one : exported.records) {
    records.push_back(record::read_record(one.path));
  }
  return records;
}

}  // namespace loopwarden::workbench
