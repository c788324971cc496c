// SPDX-License-Identifier: Apache-2.0
#include "workbench/records/recorder_input.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <map>
#include <string_view>

#include "protocol/ask.hpp"
#include "record/segment_export.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/live/daemon_client.hpp"

namespace loopwarden::workbench {

std::optional<double> seconds_of(const std::string& text) {
  static const std::map<std::string_view, double> kUnits{
      {"s", 1.0}, {"min", 60.0}, {"h", 3600.0}, {"d", 86'400.0}};
  double number = 0.0;
  const auto [end, wrong] = std::from_chars(text.data(), text.data() + text.size(), number);
  const auto unit = kUnits.find(std::string_view(end, text.data() + text.size()));
  if (wrong != std::errc() || unit == kUnits.end() || !(number > 0.0) || !std::isfinite(number)) {
    return std::nullopt;
  }
  return number * unit->second;
}

std::vector<std::string> recorded(const std::string& socket, const std::string& loop, double last_s,
                                  const std::filesystem::path& target) {
  DaemonClient daemon(socket);
  const protocol::Description box = protocol::ask(daemon, protocol::DescribeRequest{});
  const auto found = std::find_if(box.loops.begin(), box.loops.end(),
                                  [&](const auto& one) { return one.tag == loop; });
  if (found == box.loops.end()) {
    fail(kExitUsage, "--loop: the daemon has no loop '{}'", loop);
  }
  using std::chrono::system_clock;
  const std::int64_t now_ns =
      std::chrono::duration_cast<std::chrono::nanoseconds>(system_clock::now().time_since_epoch())
          .count();
  record::ExportSettings settings;
  settings.from_utc_ns = now_ns - std::llround(last_s * 1e9);
  const record::ExportResult result = record::export_csv(found->folder, target, settings);
  std::vector<record::ExportedRecord> records = result.records;
  if (records.empty()) {
    fail(kExitData, "{}: the recorder holds nothing of {} in this time{}", found->folder, loop,
         found->recording ? "" : "; its recording is not enabled");
  }
  std::stable_sort(records.begin(), records.end(),
                   [](const auto& a, const auto& b) { return a.rows > b.rows; });
  std::vector<std::string> paths;
  for (const record::ExportedRecord& one : records) {
    const bool enough = static_cast<double>(one.rows) * found->sample_time_s >= kShortest_s;
    if (enough || paths.empty()) paths.push_back(one.path.string());
  }
  return paths;
}

}  // namespace loopwarden::workbench
