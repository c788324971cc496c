// SPDX-License-Identifier: Apache-2.0
#include "daemon/historian.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <utility>

#include "hal/contract/sample.hpp"

namespace loopwarden::daemon {
namespace {

using hal::record::RecordRow;

constexpr std::chrono::milliseconds kPause{20};
constexpr std::uint64_t kLongestFilledGap = 6000;  // periods; a longer one ends the CSV record

bool fit_for_file_name(const std::string& name) {
  return !name.empty() && name.size() <= 100 && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                  c == '-' || c == '_' || c == '.';
         });
}

}  // namespace

Historian::Historian(std::vector<LoopRuntime>& loops, std::filesystem::path state_directory)
    : loops_(loops), state_directory_(std::move(state_directory)) {}

void Historian::start() {
  for (const LoopRuntime& loop : loops_) {
    fresh_.reserve(std::max(fresh_.capacity(), loop.channels->records.capacity()));
    tracks_.emplace_back().kept.resize(kKept);
    csv_.emplace_back();
    Disk& disk = disks_.emplace_back();
    if (!loop.config.recording.enabled) continue;
    try {
      disk.segments = std::make_unique<hal::record::SegmentWriter>(
          hal::record::SegmentSettings{.folder = state_directory_ / "segments" / loop.config.name,
                                       .loop = loop.config.name,
                                       .period_s = loop.config.sample_time_s,
                                       .limit_bytes = loop.config.recording.limit_bytes});
    } catch (const std::exception& e) {
      spdlog::error("loop {}: no recording: {}", loop.config.name, e.what());
    }
  }
  thread_.start({.name = "lw-historian"}, [this] { run(); });
}

void Historian::stop() {
  quit_ = true;
  thread_.join();
}

void Historian::run() {
  bool last_round = false;
  while (!last_round) {
    last_round = quit_.load(std::memory_order_relaxed);
    for (std::size_t i = 0; i < loops_.size(); ++i) {
      take_rows(i);
      try {
        if (disks_[i].segments) disks_[i].segments->append(fresh_);
        keep(i);
        write_csv(i);
      } catch (const std::exception& e) {
        spdlog::error("loop {}: recording: {}", loops_[i].config.name, e.what());
      }
    }
    ticks_.fetch_add(1, std::memory_order_relaxed);
    std::this_thread::sleep_for(kPause);
  }
  disks_.clear();  // ends the segments
}

void Historian::take_rows(std::size_t loop) {
  fresh_.clear();
  RecordRow row;
  // What is beyond the room waits in its ring for the next round.
  while (fresh_.size() < fresh_.capacity() && loops_[loop].channels->records.try_pop(row)) {
    fresh_.push_back(row);
  }
}

void Historian::keep(std::size_t loop) {
  const std::lock_guard lock(tracks_mutex_);
  Track& track = tracks_[loop];
  for (const RecordRow& row : fresh_) {
    track.kept[track.rows++ % kKept] = row;
    if (static_cast<hal::Quality>(row.pv_quality) == hal::Quality::good)
      track.last_good_pv = row.pv;
  }
  if (disks_[loop].segments) track.segment_status = disks_[loop].segments->status();
}

void Historian::write_csv(std::size_t loop) {
  const std::lock_guard lock(csv_mutex_);
  Csv& csv = csv_[loop];
  if (!csv.writer) return;
  const double period_s = loops_[loop].config.sample_time_s;
  const auto time_s = [&](std::uint64_t period) {
    return static_cast<double>(period - csv.first_period) * period_s;
  };
  try {
    for (const RecordRow& row : fresh_) {
      if (!csv.begun) {
        csv.begun = true;
        csv.first_period = csv.next_period = row.period_index;
      }
      if (row.period_index - csv.next_period > kLongestFilledGap) {
        throw std::runtime_error("the loop paused for too long; the record ends before the pause");
      }
      for (; csv.next_period < row.period_index; ++csv.next_period) {
        csv.writer->add({.time_s = time_s(csv.next_period)});
      }
      const std::array<double, 3> more{static_cast<double>(row.mode),
                                       static_cast<double>(row.fault),
                                       static_cast<double>(row.jacket)};
      csv.writer->add({.time_s = time_s(row.period_index),
                       .pv = row.pv,
                       .sp = row.sp,
                       .co = row.co,
                       .stem = row.stem},
                      more);
      csv.next_period = row.period_index + 1;
    }
  } catch (const std::exception& e) {
    csv.error = e.what();
    spdlog::error("loop {}: CSV record ends: {}", loops_[loop].config.name, e.what());
    csv.writer.reset();
  }
}

bool Historian::latest(std::size_t loop, RecordRow& row) const {
  const std::lock_guard lock(tracks_mutex_);
  const Track& track = tracks_[loop];
  if (track.rows == 0) return false;
  row = track.kept[(track.rows - 1) % kKept];
  return true;
}

double Historian::last_good_pv(std::size_t loop) const {
  const std::lock_guard lock(tracks_mutex_);
  return tracks_[loop].last_good_pv;
}

std::vector<RecordRow> Historian::rows(std::size_t loop, std::uint64_t from,
                                       std::size_t most) const {
  std::vector<RecordRow> found;
  const std::lock_guard lock(tracks_mutex_);
  const Track& track = tracks_[loop];
  const std::uint64_t kept = std::min<std::uint64_t>({track.rows, kKept, most});
  for (std::uint64_t i = track.rows - kept; i < track.rows; ++i) {
    const RecordRow& row = track.kept[i % kKept];
    if (row.period_index >= from) found.push_back(row);
  }
  return found;
}

RecordingStatus Historian::status(std::size_t loop) const {
  RecordingStatus status;
  status.dropped = loops_[loop].channels->records.dropped();
  {
    const std::lock_guard lock(tracks_mutex_);
    status.rows = tracks_[loop].rows;
    status.segments = tracks_[loop].segment_status;
  }
  const std::lock_guard lock(csv_mutex_);
  status.csv_error = csv_[loop].error;
  if (csv_[loop].writer) status.csv_file = csv_[loop].writer->path();
  return status;
}

std::string Historian::start_csv(std::size_t loop, const std::string& name) {
  if (!fit_for_file_name(name)) {
    throw std::runtime_error("a record's name consists of letters, digits, '-', '_' and '.'");
  }
  const std::lock_guard lock(csv_mutex_);
  Csv& csv = csv_[loop];
  if (csv.writer) throw std::runtime_error("already recording to " + csv.writer->path().string());
  const std::filesystem::path folder = state_directory_ / "records";
  std::filesystem::create_directories(folder);
  csv = {};
  csv.writer = std::make_unique<hal::record::RecordCsvWriter>(
      folder / (name + ".csv"), hal::record::RecordColumns{.more = {"mode", "fault", "jacket"}});
  return csv.writer->path();
}

std::string Historian::stop_csv(std::size_t loop) {
  const std::lock_guard lock(csv_mutex_);
  Csv& csv = csv_[loop];
  if (!csv.writer) {
    if (!csv.error.empty()) throw std::runtime_error("the record is incomplete: " + csv.error);
    return {};
  }
  const std::unique_ptr<hal::record::RecordCsvWriter> writer = std::move(csv.writer);
  writer->finish();
  return writer->path();
}

}  // namespace loopwarden::daemon
