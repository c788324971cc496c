// SPDX-License-Identifier: Apache-2.0
#include "daemon/monitor/monitor.hpp"

#include <chrono>
#include <thread>

#include "hal/contract/sample.hpp"
#include "model/control/loop_controller.hpp"

namespace loopwarden::daemon::monitor {

namespace model = loopwarden::monitor;
using hal::record::RecordRow;
using model::WindowBuilder;
using model::WindowState;

namespace {

constexpr std::chrono::milliseconds kPause{50};
constexpr double kMostSaturated = 10.0;  // % of a window with CO at an end

model::Cycle cycle_of(const RecordRow& row) {
  return {.period_index = row.period_index,
          .sp = row.sp,
          .pv = row.pv,
          .co = row.co,
          .stem = row.stem,
          .automatic = static_cast<control::Mode>(row.mode) == control::Mode::automatic,
          .pv_good = static_cast<hal::Quality>(row.pv_quality) == hal::Quality::good};
}

}  // namespace

Monitor::Monitor(std::vector<WatchedLoop> loops, WatchBoard& board) : board_(board) {
  tracks_.reserve(loops.size());
  for (const WatchedLoop& loop : loops) {
    Track& track = tracks_.emplace_back(loop);
    const LoopWatch known = board.watch(tracks_.size() - 1);
    for (const model::AlarmKind kind : model::kAlarmKinds) {
      const model::Alarm& alarm = known.alarms.alarm(kind);
      track.rule.restore(kind, alarm.active(), alarm.memory().severity_percent);
    }
  }
}

void Monitor::start() {
  thread_.start({.name = "lw-monitor"}, [this] {
    while (!quit_.load(std::memory_order_relaxed)) {
      round();
      if (backlog_.load(std::memory_order_relaxed) == 0) std::this_thread::sleep_for(kPause);
    }
  });
}

void Monitor::stop() {
  quit_ = true;
  thread_.join();
}

void Monitor::round() {
  std::size_t behind = 0;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    if (take_turn((first_ + i) % tracks_.size())) ++behind;
  }
  first_ = tracks_.empty() ? 0 : (first_ + 1) % tracks_.size();
  backlog_.store(behind, std::memory_order_relaxed);
  board_.pass_time();
  ticks_.fetch_add(1, std::memory_order_relaxed);
}

bool Monitor::take_turn(std::size_t index) {
  Track& track = tracks_[index];
  RecordRow row;
  std::size_t taken = 0;
  bool window_full = false;
  while (taken < kCyclesATurn && !window_full && track.loop.cycles->try_pop(row)) {
    ++taken;
    const bool at_limit = (row.flags & (hal::record::kAtLow | hal::record::kAtHigh)) != 0;
    track.times.add(static_cast<control::Mode>(row.mode), at_limit);
    const WindowBuilder::Event event = track.builder.add(cycle_of(row));
    if (event == WindowBuilder::Event::broken) {
      board_.interrupted(index, track.builder.state());
      // In manual the valve may have been worked on: what was seen before is no evidence any more.
      if (track.builder.state() == WindowState::not_automatic) track.rule.restart();
    }
    window_full = event == WindowBuilder::Event::full;
  }
  if (taken == 0) return false;
  cycles_.fetch_add(taken, std::memory_order_relaxed);
  board_.set_times(index, track.times, track.builder.state());
  if (window_full) judge(index);
  return window_full || taken == kCyclesATurn;
}

void Monitor::judge(std::size_t index) {
  Track& track = tracks_[index];
  const model::Window window = track.builder.window();
  const model::WindowMeasures measures = model::measure(window);
  windows_.fetch_add(1, std::memory_order_relaxed);
  if (measures.saturated_percent > kMostSaturated) {
    board_.window_not_fit(index, measures, WindowState::saturated);
    return;
  }
  if (track.loop.judge == nullptr) {
    board_.window_not_fit(index, measures, WindowState::no_judge);
    return;
  }
  const model::WindowJudgement judgement = track.loop.judge->judge(window);
  const model::AlarmConditions& conditions = track.rule.add(judgement);
  if (judgement.result == model::WindowJudgement::Result::not_enough_movement) {
    board_.window_not_fit(index, measures, WindowState::not_enough_movement);
    return;
  }
  board_.window_judged(index, measures, judgement, conditions);
}

MonitorStatus Monitor::status() const noexcept {
  MonitorStatus status;
  status.windows = windows_.load(std::memory_order_relaxed);
  status.cycles = cycles_.load(std::memory_order_relaxed);
  status.backlog = backlog_.load(std::memory_order_relaxed);
  for (const Track& track : tracks_) status.dropped += track.loop.cycles->dropped();
  return status;
}

}  // namespace loopwarden::daemon::monitor
