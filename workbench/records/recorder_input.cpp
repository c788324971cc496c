// SPDX-License-Identifier: Apache-2.0
#include "workbench/records/recorder_input.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <map>
#include <string_view>

#include "daemon/protocol/ask.hpp"
#include "record/import/time_text.hpp"
#include "record/segment_export.hpp"
#include "workbench/command_line/background.hpp"
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

std::optional<std::int64_t> utc_ns_of(const std::string& text) {
  const auto time = record::parse_time(text, record::TimeForm::ymd);
  if (!time || !time->zone_known) return std::nullopt;
  return time->whole_s * 1'000'000'000 + std::llround(time->rest_s * 1e9);
}

const Recorded::Record& Recorded::longest() const {
  return *std::max_element(records.begin(), records.end(),
                           [](const Record& a, const Record& b) { return a.rows < b.rows; });
}

analysis::KnownRanges Recorded::ranges() const {
  const auto pair = [](const protocol::Range& range) { return std::pair{range[0], range[1]}; };
  return {.pv = pair(loop.pv_range), .co = pair(loop.co_range)};
}

void RecorderInput::add_options(Command& command, const char* kept) {
  const Check is_utc = checked([](const std::string& text) {
    return utc_ns_of(text) ? std::string()
                           : "must be a time such as 2026-11-26T10:00:00Z (got '" + text + "')";
  });
  const Option last = command.option(
      "--last", last_,
      std::string("in place of files: this much of the daemon's record of --loop, such as 4h, "
                  "90min, 2d") +
          kept,
      checked([](const std::string& text) {
        return seconds_of(text) ? std::string()
                                : "must be a time such as 4h, 90min or 2d (got '" + text + "')";
      }));
  Option since = command.option("--since", since_,
                                "in place of --last: start of the time, such as "
                                "2026-11-26T10:00:00Z",
                                is_utc);
  since.excludes(last);
  command.option("--until", until_, "end of the time that starts at --since", is_utc).needs(since);
  command.socket(socket_);
  add_background(command, background_);
}

bool RecorderInput::asked(bool files, const std::string& loop) const {
  if (background_) work_in_background();
  if (!given()) {
    if (!files) require("records, or --loop and --last or --since,");
    return false;
  }
  if (files) require("either records or --last or --since");
  if (loop.empty()) require("--loop with --last or --since");
  return true;
}

Recorded RecorderInput::take(
    const std::string& loop, const std::filesystem::path& target,
    const std::function<std::filesystem::path(const std::filesystem::path&)>& place) const {
  using std::chrono::system_clock;
  const std::int64_t now_ns =
      std::chrono::duration_cast<std::chrono::nanoseconds>(system_clock::now().time_since_epoch())
          .count();
  record::ExportSettings settings;
  settings.from_utc_ns = since_.empty() ? now_ns - std::llround(seconds_of(last_).value() * 1e9)
                                        : utc_ns_of(since_).value();
  if (!until_.empty()) settings.to_utc_ns = utc_ns_of(until_);
  settings.place = place;
  return take_recorded(socket_, loop, target, settings);
}

Recorded take_recorded(const std::string& socket, const std::string& loop,
                       const std::filesystem::path& target,
                       const record::ExportSettings& settings) {
  DaemonClient daemon(socket);
  const protocol::Description box = protocol::ask(daemon, protocol::DescribeRequest{});
  const auto found = std::find_if(box.loops.begin(), box.loops.end(),
                                  [&](const auto& one) { return one.tag == loop; });
  if (found == box.loops.end()) {
    fail(kExitUsage, "--loop: the daemon has no loop '{}'", loop);
  }
  Recorded recorded{.loop = *found, .records = {}};
  for (const record::ExportedRecord& one :
       record::export_csv(found->folder, target, settings).records) {
    recorded.records.push_back({one.path.string(), one.rows, one.start_utc_ns});
  }
  if (recorded.records.empty()) {
    fail(kExitData, "{}: the recorder has no samples of {} in this time{}", found->folder, loop,
         found->recording ? "" : "; its recording is not enabled");
  }
  const Recorded::Record longest = recorded.longest();
  std::erase_if(recorded.records, [&](const Recorded::Record& one) {
    return static_cast<double>(one.rows) * found->sample_time_s < kShortest_s;
  });
  if (recorded.records.empty()) recorded.records.push_back(longest);
  return recorded;
}

}  // namespace loopwarden::workbench
