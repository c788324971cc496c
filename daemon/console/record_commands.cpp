// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/record_commands.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <utility>

#include "daemon/console/journal_answer.hpp"

namespace loopwarden::daemon::console {
namespace {

constexpr double kLongestRecord_s = 86'400.0;
// Longest wait of a request for the disk.
constexpr std::chrono::milliseconds kRecordPatience{1000};
constexpr std::chrono::seconds kBetweenLooks{5};  // at receipts that are due
// s of the loop's time that a receipt takes before and after the work. The errors of receipts are
// measured with records of 4 h. At most half of the samples of a report.
constexpr double kBeforeWork_s = 8.0 * 3600.0;
constexpr double kAfterWork_s = 4.0 * 3600.0 + 600.0;
constexpr double kMostReceiptSamples = 5e5;

}  // namespace

protocol::RecordFile RecordCommands::record(const protocol::RecordRequest& request,
                                            const Sender& sender) {
  const std::size_t index = loop_index(plant_, request.loop);
  Recorder& recorder = plant_.historian.recorder();
  const bool stop = request.stop.has_value();
  journal::JournalEntry line = operator_line(plant_, index, sender.peer);
  line.what = stop ? "record stopped" : "record started";
  std::string file;
  try {
    const double at_most_s = request.at_most_s.value_or(kLongestRecord_s);
    if (!stop && !request.start) throw RequestError("a text is needed for \"start\"");
    if (!(at_most_s > 0.0 && at_most_s <= kLongestRecord_s)) {
      throw RequestError("at_most_s must be above 0, at most 86400");
    }
    line.new_value = stop ? std::string() : *request.start;
    file = stop ? recorder.stop_csv(index, kRecordPatience)
                : recorder.start_csv(index, line.new_value, kRecordPatience);
    records_.erase(index);
    if (!stop) limit(index, file, request);
  } catch (const std::exception& e) {
    line.result = (stop ? "" : "refused: ") + std::string(e.what());
    archive_.journal.post(std::move(line));
    throw;
  }
  line.new_value = file;
  line.result = file.empty() ? "no record was being written" : "done";
  archive_.journal.post(std::move(line));
  return {file};
}

// Limits a record that begins during a commissioning or has a time limit.
void RecordCommands::limit(std::size_t loop, const std::string& file,
                           const protocol::RecordRequest& request) {
  const auto session = plant_.loops[loop].commissioning->session();
  if (!session && !request.at_most_s) return;
  const std::chrono::duration<double> most{request.at_most_s.value_or(kLongestRecord_s)};
  records_[loop] = {.file = file,
                    .session = session,
                    .until = Clock::now() + std::chrono::duration_cast<Clock::duration>(most)};
}

void RecordCommands::end_records(Clock::time_point now) {
  if (now >= next_look_) {
    next_look_ = now + kBetweenLooks;
    archive_.reports.look_at_due();
  }
  for (auto at = records_.begin(); at != records_.end();) {
    const auto& [loop, record] = *at;
    const bool commissioned =
        !record.session || plant_.loops[loop].commissioning->session() == record.session;
    if (commissioned && now <= record.until) {
      ++at;
      continue;
    }
    stop_ended(loop, record, commissioned ? "its time is over" : "the commissioning has ended");
    at = records_.erase(at);
  }
}

void RecordCommands::stop_ended(std::size_t loop, const EndingRecord& record, const char* reason) {
  Recorder& recorder = plant_.historian.recorder();
  if (recorder.status(loop).csv_file != record.file) return;
  journal::JournalEntry line = operator_line(plant_, loop, "loopwardend");
  line.what = "record stopped";
  line.new_value = record.file;
  line.reason = reason;
  line.result = "done";
  try {
    recorder.stop_csv(loop, std::chrono::milliseconds(0));
  } catch (const std::exception&) {  // the recorder completes the file later
  }
  archive_.journal.post(std::move(line));
}

base::LocalServer::Answer RecordCommands::report(const protocol::ReportRequest& request,
                                                 const Sender& sender) {
  const std::size_t index = loop_index(plant_, request.loop);
  const std::optional<reports::Kind> kind = reports::kind_of(request.kind);
  if (!kind) throw RequestError("kind is gap, commission, survey, diagnose or receipt");
  check_span(request, *kind, index);
  if (!archive_.reports.has_program()) {
    throw RequestError("loopwarden, which makes reports, is not installed beside the daemon");
  }
  const std::optional<reports::Report> taken =
      archive_.reports.post({.loop = request.loop,
                             .kind = *kind,
                             .from_ms = static_cast<std::int64_t>(request.from_ms),
                             .to_ms = static_cast<std::int64_t>(request.to_ms),
                             .by = sender.peer,
                             .twin = plant_.loops[index].config.monitor.twin});
  journal::JournalEntry line = operator_line(plant_, index, sender.peer);
  line.what = "report";
  line.new_value = taken ? taken->name : request.kind;
  line.result = taken ? "asked for" : "refused: as many as may wait do";
  return when_written(
      archive_.journal,
      protocol::ReportTaken{.taken = taken.has_value(),
                            .waiting = taken ? taken->place : archive_.reports.most_waiting(),
                            .name = taken ? taken->name : std::string()},
      archive_.journal.post(std::move(line)), sender);
}

void RecordCommands::receipt(std::size_t loop, const std::string& peer) {
  if (!archive_.reports.has_program()) return;
  const config::LoopConfig& config = plant_.loops[loop].config;
  const auto ms = [&](double seconds) {
    return std::llround(1000.0 * std::min(seconds, kMostReceiptSamples * config.sample_time_s) /
                        info_.description().accelerate);
  };
  const std::int64_t now_ms = plant_.alarms.now_ms();
  const std::int64_t end_ms = now_ms + ms(kAfterWork_s);
  archive_.reports.post_later({.loop = plant_.alarms.name(loop),
                               .kind = reports::Kind::receipt,
                               .from_ms = now_ms - ms(kBeforeWork_s),
                               .to_ms = end_ms,
                               .by = peer,
                               .twin = config.monitor.twin,
                               .due_ms = end_ms});
}

void RecordCommands::check_span(const protocol::ReportRequest& request, reports::Kind kind,
                                std::size_t loop) const {
  constexpr double kLeast_s = 60.0;  // s of the loop's time
  // One gigabyte of memory holds these samples; a commissioning keeps several copies of them.
  const double most_samples = kind == reports::Kind::commission ? 2e5 : 1e6;
  if (request.from_ms >= request.to_ms) throw RequestError("from_ms must be before to_ms");
  if (request.to_ms > static_cast<std::uint64_t>(plant_.alarms.now_ms())) {
    throw RequestError("to_ms: a time that has been");
  }
  const auto oldest_ms =
      static_cast<std::uint64_t>(plant_.historian.status(loop).segments.oldest_utc_ms);
  if (oldest_ms == 0) throw RequestError("nothing is recorded of " + request.loop);
  if (request.from_ms < oldest_ms) {
    throw RequestError(
        fmt::format("from_ms: what is recorded of {} begins at {:%FT%TZ} ({})", request.loop,
                    fmt::gmtime(static_cast<std::time_t>(oldest_ms / 1000)), oldest_ms));
  }
  const double sample_time_s = plant_.loops[loop].config.sample_time_s;
  const double span_s = static_cast<double>(request.to_ms - request.from_ms) / 1000.0 *
                        info_.description().accelerate;
  if (span_s < kLeast_s) throw RequestError(fmt::format("at least {:g} s are needed", kLeast_s));
  if (span_s > most_samples * sample_time_s) {
    throw RequestError(fmt::format("{} takes at most {:.3g} h of {} ({:.0f} samples)", request.kind,
                                   most_samples * sample_time_s / 3600.0, request.loop,
                                   most_samples));
  }
}

}  // namespace loopwarden::daemon::console
