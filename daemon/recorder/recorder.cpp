// SPDX-License-Identifier: Apache-2.0
#include "daemon/recorder/recorder.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "daemon/recorder/flash_memory.hpp"

namespace loopwarden::daemon {
namespace {

using record::RecordRow;

constexpr std::chrono::milliseconds kRound{50};
constexpr std::size_t kSmallestQueue = 64;         // rows
constexpr std::uint64_t kLongestFilledGap = 6000;  // periods; a longer one ends the CSV record

// Returns how many rows of a loop wait for the next sync. They fit into the historian's memory
// (Historian::kKept), which bridges them for readers.
std::size_t most_pending(std::size_t loops) {
  constexpr std::size_t kPendingBytes = 4UL * 1024UL * 1024UL;  // of all loops
  return std::clamp<std::size_t>(
      kPendingBytes / sizeof(RecordRow) / std::max<std::size_t>(loops, 1), 32, 256);
}

bool fit_for_file_name(const std::string& name) {
  return !name.empty() && name.size() <= 100 && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                  c == '-' || c == '_' || c == '.';
         });
}

}  // namespace

Recorder::Recorder(std::vector<LoopRuntime>& loops, RecorderSettings settings)
    : loops_(loops), settings_(std::move(settings)) {}

void Recorder::start() {
  disks_.resize(loops_.size());
  tracks_.resize(loops_.size());
  const std::size_t share =
      settings_.queue_bytes / sizeof(RecordRow) / std::max<std::size_t>(loops_.size(), 1);
  for (std::size_t i = 0; i < loops_.size(); ++i) {
    const auto wished =
        static_cast<std::size_t>(settings_.queue_s / loops_[i].config.sample_time_s);
    tracks_[i].room = std::max(kSmallestQueue, std::min(wished, share));
  }
  thread_.start({.name = "lw-recorder"}, [this] { run(); });
}

void Recorder::stop() {
  base::ask_to_end(mutex_, quit_, changed_);
  thread_.join();
}

bool Recorder::stop_for(std::chrono::milliseconds patience) {
  base::ask_to_end(mutex_, quit_, changed_);
  return thread_.join_for(patience);
}

void Recorder::push(std::size_t loop, std::span<const RecordRow> rows) noexcept {
  if (rows.empty()) return;
  const std::lock_guard lock(mutex_);
  Track& track = tracks_[loop];
  if (!loops_[loop].config.recording.enabled && track.csv.state == CsvState::none) return;
  const std::size_t taken = std::min(rows.size(), track.room - track.waiting.size());
  try {
    track.waiting.insert(track.waiting.end(), rows.begin(),
                         rows.begin() + static_cast<std::ptrdiff_t>(taken));
  } catch (const std::exception&) {
    track.dropped += rows.size();  // without memory the rows are dropped
    return;
  }
  track.queued += taken;
  track.dropped += rows.size() - taken;
}

RecorderStatus Recorder::status(std::size_t loop) const {
  const std::lock_guard lock(mutex_);
  const Track& track = tracks_[loop];
  const bool writes = track.csv.state != CsvState::none && !track.csv.cancelled;
  return {.waiting = track.waiting.size() + track.segments.pending,
          .queue_dropped = track.dropped,
          .segments = track.segments,
          .csv_file = writes ? track.csv.file.string() : std::string(),
          .csv_error = track.csv.error};
}

std::string Recorder::start_csv(std::size_t loop, const std::string& name,
                                std::chrono::milliseconds patience) {
  if (!fit_for_file_name(name)) {
    throw std::runtime_error("a record's name consists of letters, digits, '-', '_' and '.'");
  }
  std::unique_lock lock(mutex_);
  Track& track = tracks_[loop];
  Csv& csv = track.csv;
  if (csv.cancelled) throw std::runtime_error("the disk does not answer; no record was begun");
  if (csv.state != CsvState::none) {
    throw std::runtime_error("already recording to " + csv.file.string());
  }
  csv.file = settings_.state_directory / "records" / (name + ".csv");
  csv.error.clear();
  csv.state = CsvState::starting;
  csv.orders.push_back({true, track.queued});
  urgent_ = true;
  changed_.notify_all();
  changed_.wait_for(lock, patience, [&] { return csv.state != CsvState::starting; });
  if (csv.state == CsvState::starting) {
    csv.cancelled = true;
    throw std::runtime_error(
        fmt::format("{}: the disk has not answered for {:.1f} s; no record was "
                    "begun",
                    csv.file.string(), wait_.seconds()));
  }
  // Also reports a record that failed on the disk after its first rows.
  if (csv.state == CsvState::none) throw std::runtime_error(csv.error);
  return csv.file.string();
}

std::string Recorder::stop_csv(std::size_t loop, std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  Track& track = tracks_[loop];
  Csv& csv = track.csv;
  const auto unfinished = [&] {
    return std::runtime_error(
        fmt::format("{}: the disk has not answered for {:.1f} s; the record is "
                    "completed once it does",
                    csv.file.string(), wait_.seconds()));
  };
  if (csv.state == CsvState::stopping) throw unfinished();
  if (csv.state == CsvState::none || csv.cancelled) {
    if (!csv.error.empty()) throw std::runtime_error("the record is incomplete: " + csv.error);
    return {};
  }
  csv.state = CsvState::stopping;
  csv.orders.push_back({false, track.queued});
  urgent_ = true;
  changed_.notify_all();
  changed_.wait_for(lock, patience, [&] { return csv.state != CsvState::stopping; });
  if (csv.state == CsvState::stopping) throw unfinished();
  if (!csv.error.empty()) throw std::runtime_error("the record is incomplete: " + csv.error);
  return csv.file.string();
}

void Recorder::run() {
  for (std::size_t i = 0; i < loops_.size(); ++i) open_segments(i);
  const std::chrono::milliseconds sync = choose_sync();
  sync_ms_ = sync.count();
  next_sync_ = std::chrono::steady_clock::now() + sync;
  bool last_round = false;
  while (!last_round) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, kRound, [&] { return urgent_ || quit_; });
      urgent_ = false;
      last_round = quit_;
    }
    for (std::size_t i = 0; i < loops_.size(); ++i) {
      try {
        const base::DiskWait::Section waiting(wait_);
        write_loop(i);
      } catch (const std::exception& e) {
        spdlog::error("loop {}: recording: {}", loops_[i].config.name, e.what());
      }
    }
    sync_if_due();
    publish_status();
  }
  const base::DiskWait::Section waiting(wait_);
  disks_.clear();  // closes the segments
}

void Recorder::open_segments(std::size_t loop) {
  const config::LoopConfig& config = loops_[loop].config;
  if (!config.recording.enabled) return;
  try {
    const base::DiskWait::Section waiting(wait_);
    disks_[loop].segments = std::make_unique<record::SegmentWriter>(
        record::SegmentSettings{.folder = segments_folder(config.name),
                                .loop = config.name,
                                .period_s = config.sample_time_s,
                                .limit_bytes = config.recording.limit_bytes,
                                .most_pending = most_pending(loops_.size())});
    writers_.push_back(disks_[loop].segments.get());
  } catch (const std::exception& e) {
    spdlog::error("loop {}: no recording: {}", config.name, e.what());
  }
}

// Looks at the disk, which may hang.
std::chrono::milliseconds Recorder::choose_sync() const {
  constexpr std::chrono::seconds kOnFlash{60};
  constexpr std::chrono::seconds kOnOthers{5};
  if (settings_.sync) return *settings_.sync;
  return is_on_flash(settings_.state_directory) ? kOnFlash : kOnOthers;
}

// One sync for all loops costs least writes.
void Recorder::sync_if_due() {
  const auto now = std::chrono::steady_clock::now();
  if (now < next_sync_) return;
  next_sync_ = now + std::chrono::milliseconds(sync_ms_.load());
  const base::DiskWait::Section waiting(wait_);
  record::SegmentWriter::sync_all(writers_);
}

void Recorder::publish_status() {
  for (std::size_t i = 0; i < loops_.size(); ++i) {
    if (!disks_[i].segments) continue;
    record::SegmentStatus status = disks_[i].segments->status();
    const std::lock_guard lock(mutex_);
    tracks_[i].segments = std::move(status);
  }
}

void Recorder::write_loop(std::size_t loop) {
  std::uint64_t at = 0;  // number of the batch's first row
  batch_.clear();
  {
    const std::lock_guard lock(mutex_);
    std::swap(batch_, tracks_[loop].waiting);
    at = tracks_[loop].queued - batch_.size();
  }
  std::span<const RecordRow> rows(batch_);
  Disk& disk = disks_[loop];
  if (disk.segments) disk.segments->append(rows);
  while (const std::optional<CsvOrder> order = next_order(loop, at + rows.size())) {
    const auto before = rows.first(order->after > at ? order->after - at : 0);
    write_csv(loop, before);
    rows = rows.subspan(before.size());
    at += before.size();
    carry_out(loop, order->start);
  }
  write_csv(loop, rows);
}

// Returns the next request that was made before row `end`.
std::optional<Recorder::CsvOrder> Recorder::next_order(std::size_t loop, std::uint64_t end) {
  const std::lock_guard lock(mutex_);
  std::list<CsvOrder>& orders = tracks_[loop].csv.orders;
  if (orders.empty() || orders.front().after > end) return std::nullopt;
  const CsvOrder order = orders.front();
  orders.pop_front();
  return order;
}

void Recorder::write_csv(std::size_t loop, std::span<const RecordRow> rows) {
  if (!disks_[loop].csv) return;
  try {
    add_rows(loop, rows);
  } catch (const std::exception& e) {
    disks_[loop].csv.reset();
    settle(loop, e.what());
  }
}

void Recorder::add_rows(std::size_t loop, std::span<const RecordRow> rows) {
  Disk& disk = disks_[loop];
  const double period_s = loops_[loop].config.sample_time_s;
  const auto time_s = [&](std::uint64_t period) {
    return static_cast<double>(period - disk.first_period) * period_s;
  };
  for (const RecordRow& row : rows) {
    if (!disk.begun) {
      disk.begun = true;
      disk.first_period = disk.next_period = row.period_index;
    }
    if (row.period_index - disk.next_period > kLongestFilledGap) {
      throw std::runtime_error("the loop paused for too long; the record ends before the pause");
    }
    for (; disk.next_period < row.period_index; ++disk.next_period) {
      disk.csv->add({.time_s = time_s(disk.next_period)});
    }
    const std::array<double, 4> more{static_cast<double>(row.mode), static_cast<double>(row.fault),
                                     static_cast<double>(row.jacket_rate),
                                     static_cast<double>(row.compensator)};
    disk.csv->add({.time_s = time_s(row.period_index),
                   .pv = row.pv,
                   .sp = row.sp,
                   .co = row.co,
                   .stem = row.stem},
                  more);
    disk.next_period = row.period_index + 1;
  }
}

void Recorder::carry_out(std::size_t loop, bool start) {
  try {
    if (start) {
      begin_csv(loop);
    } else {
      end_csv(loop);
    }
  } catch (const std::exception& e) {
    disks_[loop].csv.reset();
    settle(loop, e.what());
  }
}

void Recorder::begin_csv(std::size_t loop) {
  std::filesystem::path file;
  {
    const std::lock_guard lock(mutex_);
    file = tracks_[loop].csv.file;
  }
  std::filesystem::create_directories(file.parent_path());
  auto writer = std::make_unique<record::RecordCsvWriter>(
      file, record::RecordColumns{.more = {"mode", "fault", "jacket", "compensator"}});
  bool cancelled = false;
  {
    const std::lock_guard lock(mutex_);
    Csv& csv = tracks_[loop].csv;
    cancelled = csv.cancelled;
    if (!cancelled) csv.state = CsvState::recording;
  }
  changed_.notify_all();
  Disk& disk = disks_[loop];
  disk.begun = false;
  if (!cancelled) {
    disk.csv = std::move(writer);
    return;
  }
  const std::filesystem::path nothing = writer->temporary_path();
  writer.reset();
  std::error_code ignored;  // an empty file under a temporary name is harmless
  std::filesystem::remove(nothing, ignored);
  settle(loop, {});
}

void Recorder::end_csv(std::size_t loop) {
  const std::unique_ptr<record::RecordCsvWriter> writer = std::move(disks_[loop].csv);
  if (!writer) {
    const std::lock_guard lock(mutex_);
    tracks_[loop].csv.state = CsvState::none;  // it has already ended with its error
    changed_.notify_all();
    return;
  }
  writer->finish();
  settle(loop, {});
}

void Recorder::settle(std::size_t loop, const std::string& error) {
  {
    const std::lock_guard lock(mutex_);
    Csv& csv = tracks_[loop].csv;
    csv.state = CsvState::none;
    csv.cancelled = false;
    csv.error = error;
  }
  changed_.notify_all();
  if (!error.empty()) {
    spdlog::error("loop {}: CSV record ends: {}", loops_[loop].config.name, error);
  }
}

}  // namespace loopwarden::daemon
