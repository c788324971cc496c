// SPDX-License-Identifier: Apache-2.0
#include "daemon/recorder/historian.hpp"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "hal/contract/sample.hpp"

namespace loopwarden::daemon {
namespace {

using record::RecordRow;

constexpr std::chrono::milliseconds kPause{20};

}  // namespace

Historian::Historian(std::vector<LoopRuntime>& loops, RecorderSettings settings)
    : loops_(loops), recorder_(loops, std::move(settings)) {}

void Historian::start() {
  for (const LoopRuntime& loop : loops_) {
    fresh_.reserve(std::max(fresh_.capacity(), loop.channels->records.capacity()));
    tracks_.emplace_back().kept.resize(kKept);
  }
  recorder_.start();
  thread_.start({.name = "lw-historian"}, [this] { run(); });
}

void Historian::end_thread() noexcept {
  quit_ = true;
  thread_.join();
}

void Historian::stop() {
  end_thread();
  recorder_.stop();
}

bool Historian::stop_for(std::chrono::milliseconds patience) {
  end_thread();
  return recorder_.stop_for(patience);
}

void Historian::run() {
  bool last_round = false;
  while (!last_round) {
    last_round = quit_.load(std::memory_order_relaxed);
    for (std::size_t i = 0; i < loops_.size(); ++i) {
      take_rows(i);
      keep(i);
      recorder_.push(i, fresh_);
    }
    ticks_.fetch_add(1, std::memory_order_relaxed);
    std::this_thread::sleep_for(kPause);
  }
}

void Historian::take_rows(std::size_t loop) {
  fresh_.clear();
  RecordRow row;
  // Further rows wait in their ring for the next round.
  while (fresh_.size() < fresh_.capacity() && loops_[loop].channels->records.try_pop(row)) {
    fresh_.push_back(row);
  }
}

void Historian::keep(std::size_t loop) {
  const std::lock_guard lock(tracks_mutex_);
  Track& track = tracks_[loop];
  for (const RecordRow& row : fresh_) {
    track.kept[track.rows++ % kKept] = {.period_index = row.period_index,
                                        .sp = row.sp,
                                        .pv = row.pv,
                                        .co = row.co,
                                        .stem = row.stem,
                                        .jacket_rate = row.jacket_rate,
                                        .compensator = row.compensator,
                                        .mode = row.mode};
    if (row.pv_quality == hal::Quality::good) track.last_good_pv = row.pv;
  }
  if (!fresh_.empty()) track.latest = fresh_.back();
}

bool Historian::latest(std::size_t loop, RecordRow& row) const {
  const std::lock_guard lock(tracks_mutex_);
  const Track& track = tracks_[loop];
  if (track.rows == 0) return false;
  row = track.latest;
  return true;
}

double Historian::last_good_pv(std::size_t loop) const {
  const std::lock_guard lock(tracks_mutex_);
  return tracks_[loop].last_good_pv;
}

std::vector<TrendRow> Historian::trend(std::size_t loop, std::uint64_t from,
                                       std::size_t most) const {
  std::vector<TrendRow> found;
  const std::lock_guard lock(tracks_mutex_);
  const Track& track = tracks_[loop];
  const std::uint64_t kept = std::min<std::uint64_t>({track.rows, kKept, most});
  for (std::uint64_t i = track.rows - kept; i < track.rows; ++i) {
    const TrendRow& row = track.kept[i % kKept];
    if (row.period_index >= from) found.push_back(row);
  }
  return found;
}

std::uint64_t Historian::dropped() const {
  std::uint64_t all = 0;
  for (std::size_t i = 0; i < loops_.size(); ++i) {
    const rt::LoopChannels& channels = *loops_[i].channels;
    all +=
        channels.records.dropped() + channels.watched.dropped() + recorder_.status(i).queue_dropped;
  }
  return all;
}

RecordingStatus Historian::status(std::size_t loop) const {
  RecordingStatus status{recorder_.status(loop)};
  status.dropped = loops_[loop].channels->records.dropped();
  const std::lock_guard lock(tracks_mutex_);
  status.rows = tracks_[loop].rows;
  return status;
}

}  // namespace loopwarden::daemon
