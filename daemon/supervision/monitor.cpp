// SPDX-License-Identifier: Apache-2.0
#include "daemon/supervision/monitor.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <thread>
#include <utility>

#include "hal/contract/sample.hpp"
#include "model/control/loop_controller.hpp"
#include "model/control/supervisor.hpp"

namespace loopwarden::daemon::supervision {

using record::RecordRow;

namespace {

constexpr std::chrono::milliseconds kPause{50};

watch::Cycle cycle_of(const RecordRow& row) {
  return {.period_index = row.period_index,
          .sp = row.sp,
          .pv = row.pv,
          .co = row.co,
          .stem = row.stem,
          .automatic = static_cast<control::Mode>(row.mode) == control::Mode::automatic,
          .pv_good = static_cast<hal::Quality>(row.pv_quality) == hal::Quality::good};
}

bool is_frozen(const RecordRow& row) {
  return static_cast<hal::Reason>(row.pv_reason) == hal::Reason::frozen;
}

bool is_silence(hal::Reason reason) {
  switch (reason) {
    case hal::Reason::never_received:
    case hal::Reason::stale:
    case hal::Reason::link_lost:
    case hal::Reason::source_silent:
    case hal::Reason::source_dead: return true;
    default: return false;
  }
}

alarm::ProcessCycle process_cycle_of(const RecordRow& row) {
  const auto quality = static_cast<hal::Quality>(row.pv_quality);
  return {.period_index = row.period_index,
          .sp = row.sp,
          .pv = row.pv,
          .pv_good = quality == hal::Quality::good,
          .pv_bad = quality == hal::Quality::bad,
          .pv_frozen = is_frozen(row),
          .pv_silent =
              quality == hal::Quality::bad && is_silence(static_cast<hal::Reason>(row.pv_reason)),
          .output_arrives = (row.flags & record::kOutputLost) == 0,
          .out_of_service = (row.flags & record::kOutOfService) != 0,
          .fault = static_cast<control::Fault>(row.fault),
          .mode = static_cast<control::Mode>(row.mode),
          .requested_mode = static_cast<control::Mode>(row.requested_mode)};
}

std::string pv_text(const RecordRow& row) {
  const auto quality = static_cast<hal::Quality>(row.pv_quality);
  std::string text = fmt::format("PV is {}", to_text(quality));
  if (quality == hal::Quality::good) return text;
  return text + fmt::format(": {}", to_text(static_cast<hal::Reason>(row.pv_reason)));
}

std::string mode_text(const RecordRow& row, alarm::NormalMode normal) {
  const auto fault = static_cast<control::Fault>(row.fault);
  std::string text = to_text(static_cast<control::Mode>(row.mode));
  if (fault != control::Fault::none) text += fmt::format(" ({})", to_text(fault));
  return text + fmt::format("; the normal mode is {}", to_text(normal));
}

// How far PV is from its limit.
std::string limit_text(const alarm::ProcessChange& change, const RecordRow& row,
                       const alarm::LimitSettings& limits, const std::string& unit) {
  const double limit = limits.at(change.kind).limit;
  if (change.kind == alarm::AlarmKind::rate_of_change) {
    return fmt::format("PV {:.4g} {} changes {} than {:.4g} {}/s", row.pv, unit,
                       change.on ? "faster" : "no faster", limit, unit);
  }
  if (change.kind == alarm::AlarmKind::deviation) {
    return fmt::format("PV {:.4g}, SP {:.4g}, limit {:.4g} {}", row.pv, row.sp, limit, unit);
  }
  return fmt::format("PV {:.4g}, limit {:.4g} {}", row.pv, limit, unit);
}

// Why a process alarm came or went, from the cycle that did it.
std::string why_changed(const alarm::ProcessChange& change, const RecordRow& row,
                        const alarm::ProcessSettings& settings, const std::string& unit) {
  const bool pv_bad = static_cast<hal::Quality>(row.pv_quality) == hal::Quality::bad;
  switch (change.kind) {
    case alarm::AlarmKind::output_lost:
      if (!change.on) return "commands reach the device";
      return "commands don't reach the device" + (pv_bad ? "; " + pv_text(row) : std::string());
    case alarm::AlarmKind::output_unknown:
      return change.on ? "nothing tells where the output stands" : "the output is known";
    case alarm::AlarmKind::not_normal_mode: return mode_text(row, settings.normal_mode);
    case alarm::AlarmKind::enable_open:
      return change.on ? "the enable contact is open" : "the enable contact is closed";
    case alarm::AlarmKind::bad_pv:
    case alarm::AlarmKind::source_lost: break;
    default: return limit_text(change, row, settings.limits, unit);
  }
  return pv_text(row);
}

}  // namespace

std::optional<Monitor::PlannedMoves> Monitor::planned_moves_of(const MonitoredLoop& loop) {
  if (loop.corrective.form != alarm::CorrectiveForm::planned_moves) return std::nullopt;
  if (loop.moves == nullptr || loop.twin == nullptr) return std::nullopt;
  PlannedMoves planned{.to_loop = loop.moves_settings,
                       .state = loop.moves,
                       .hardware = loop.hardware,
                       .on_order = loop.corrective.on_order,
                       .period_s = loop.window.sample_time_s,
                       .settings = twin::planned_moves_of(*loop.twin),
                       .explained = nullptr};
  if (planned.settings) {
    planned.settings->max_move = loop.corrective.max_move;
    planned.settings->max_moves_per_hour = loop.corrective.max_moves_per_hour;
  }
  return planned;
}

Monitor::Monitor(const std::vector<MonitoredLoop>& loops, WatchBoard& board, Raised raised)
    : board_(board), raised_(std::move(raised)), started_ms_(board.now_ms()) {
  tracks_.reserve(loops.size());
  for (const MonitoredLoop& loop : loops) {
    Track& track = tracks_.emplace_back(loop);
    board.corrective_state(tracks_.size() - 1, track.corrective.state());
    if (const watch::ControllerWatch* controller = track.monitor.controller()) {
      board.controller_not_watched(tracks_.size() - 1, controller->why_not());
    }
    const LoopWatch known = board.watch(tracks_.size() - 1);
    for (const alarm::AlarmKind kind : alarm::kAlarmKinds) {
      const alarm::Alarm& alarm = known.alarms.alarm(kind);
      if (alarm::is_process_alarm(kind)) {
        track.process.restore(kind, alarm.active());
      } else {
        track.monitor.restore(kind, alarm.active(), alarm.memory().severity_percent);
      }
    }
  }
}

void Monitor::start() {
  thread_.start({.name = "lw-monitor"}, [this] {
    while (!quit_.load(std::memory_order_relaxed)) {
      try {
        round();
      } catch (const std::exception& e) {
        spdlog::error("monitor: {}", e.what());
        std::this_thread::sleep_for(kPause);
      }
      if (backlog_.load(std::memory_order_relaxed) == 0) std::this_thread::sleep_for(kPause);
    }
  });
}

void Monitor::stop() {
  quit_ = true;
  thread_.join();
  for (Track& track : tracks_) {
    if (track.orders != nullptr) track.orders->close();
  }
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
  if (track.corrective.state() != alarm::CorrectiveState::off) attend(index);
  track.monitor.calm(track.corrective.calms());
  RecordRow row;
  std::size_t taken = 0;
  bool window = false;
  while (taken < kCyclesATurn && !window && track.cycles->try_pop(row)) {
    ++taken;
    const bool at_limit = (row.flags & (record::kAtLow | record::kAtHigh)) != 0;
    track.times.add(static_cast<control::Mode>(row.mode), at_limit);
    watch_process(index, row);
    const watch::Cycle cycle = cycle_of(row);
    track.condition.add(
        cycle, {.pv_bad = static_cast<hal::Quality>(row.pv_quality) == hal::Quality::bad,
                .pv_frozen = is_frozen(row),
                .cycle_bad = (row.flags & (record::kLateCycle | record::kOutputLost)) != 0});
    const watch::MonitorStep step = track.monitor.add(cycle);
    if (track.history) {
      track.history->add(cycle);
      if (track.monitor.twin_quiet()) track.history->quiet();
    }
    if ((step.twin || step.routine) && track.condition.verdict(step.conditions)) {
      board_.stick_not_known(index);
    }
    window = pass_on(index, step);
    if (step.twin) {
      raised(index, board_.twin_judged(index, step.conditions), step, alarm::AlarmReason::twin);
    }
    if (step.routine) {
      raised(index, board_.routine_judged(index, *step.routine, step.conditions), step,
             alarm::AlarmReason::routine);
      window = true;  // it took as long as one
    }
  }
  if (taken == 0) return false;
  follow_moves(index, taken);
  cycles_.fetch_add(taken, std::memory_order_relaxed);
  if (const auto remarks = track.monitor.remarks()) {
    board_.twin_says(index, *remarks,
                     track.monitor.settings().sample_time_s * static_cast<double>(taken));
  }
  board_.set_progress(index, track.times, track.condition.indices(), track.monitor.state(),
                      track.monitor.routine_levels());
  board_.set_flaps(index, track.process);
  return window || taken == kCyclesATurn;
}

void Monitor::watch_process(std::size_t index, const RecordRow& row) {
  Track& track = tracks_[index];
  const alarm::ProcessChanges changes = track.process.add(process_cycle_of(row));
  // Before what came in the same cycle is judged.
  if (const bool lost = track.process.pv_lost(); lost != track.pv_lost) {
    board_.pv_lost(index, lost);
    track.pv_lost = lost;
  }
  if (!changes.view().empty()) {
    std::vector<ProcessNews> news;
    for (const alarm::ProcessChange& change : changes.view()) {
      news.push_back({change, why_changed(change, row, track.process_settings, track.pv_unit)});
    }
    board_.process_changed(index, news);
  }
  const bool rests = track.process.deviation_rests();
  if (rests != track.deviation_rests &&
      track.process_settings.at(alarm::AlarmKind::deviation).fitted) {
    board_.deviation_rests(index, rests);
    track.deviation_rests = rests;
  }
}

bool Monitor::pass_on(std::size_t index, const watch::MonitorStep& step) {
  using Kind = watch::MonitorStep::Kind;
  watch::ConditionWatch& condition = tracks_[index].condition;
  switch (step.kind) {
    case Kind::nothing: return false;
    case Kind::interrupted:
      board_.interrupted(index, step.state);
      correct(index, step, false);
      return false;
    case Kind::not_fit:
      condition.window(step.measures, nullptr);
      board_.window_not_fit(index, condition.told(step.measures), step.state, step.judgement);
      correct(index, step, false);
      break;
    case Kind::judged: {
      condition.window(step.measures, &step.conditions);
      const std::vector<alarm::AlarmKind> alarms = board_.window_judged(
          index, condition.told(step.measures), step.judgement, step.conditions);
      raised(index, alarms, step, alarm::AlarmReason::windows);
      correct(index, step,
              std::find(alarms.begin(), alarms.end(), alarm::AlarmKind::stiction) != alarms.end());
      break;
    }
  }
  windows_.fetch_add(1, std::memory_order_relaxed);
  return true;
}

void Monitor::raised(std::size_t index, const std::vector<alarm::AlarmKind>& alarms,
                     const watch::MonitorStep& step, alarm::AlarmReason reason) {
  if (!raised_) return;
  for (const alarm::AlarmKind alarm : alarms) {
    raised_(index, alarm, tracks_[index].monitor, step, reason);
  }
}

void Monitor::attend(std::size_t index) {
  Track& track = tracks_[index];
  if (track.order != 0) {
    if (const auto outcome = track.orders->outcome(track.order)) {
      track.order = 0;
      if (!outcome->why.empty()) follow(index, track.corrective.refused());
    }
  }
  if (!track.orders->has_room()) return;
  if (track.settings_taken != nullptr) {
    const std::uint32_t taken = track.settings_taken->load(std::memory_order_acquire);
    if (taken != track.settings_seen) follow(index, track.corrective.reloaded());
    track.settings_seen = taken;
  }
  // What a commissioning finds must not be changed by what acts beside it.
  const bool commissioned =
      track.commissioned != nullptr && track.commissioned->load(std::memory_order_relaxed);
  const alarm::Veto veto = board_.veto(index);
  follow(index, track.corrective.veto(
                    commissioned && veto == alarm::Veto::none ? alarm::Veto::commissioning : veto));
  if (track.planned && track.orders->has_room()) look_for_stick(index);
}

void Monitor::look_for_stick(std::size_t index) {
  Track& track = tracks_[index];
  const auto [alarm, stick] = board_.sticks(index);
  // If the clock is set back, the alarms that it raises from then on are later than the start.
  const std::int64_t now_ms = board_.now_ms();
  started_ms_ = std::min(started_ms_, now_ms);
  const bool raised_since = stick && stick->raised_ms >= started_ms_ && stick->raised_ms <= now_ms;
  const bool begins = track.planned->on_order || raised_since;
  const bool fresh = stick && begins && stick != track.planned->explained;
  if (alarm && !stick) {
    follow(index, track.corrective.explained_otherwise());
  } else if (fresh && track.planned->settings) {
    twin::set_stick(*track.planned->settings, *stick->stick);
    follow(index,
           track.corrective.explained(!track.planned->hardware || twin::known_well(*stick->stick)));
  }
  track.planned->explained = stick;
  if (!track.orders->has_room()) return;
  if (board_.take_order(index)) follow(index, track.corrective.ordered());
}

void Monitor::follow_moves(std::size_t index, std::size_t cycles) {
  Track& track = tracks_[index];
  if (!track.planned || track.order != 0 || !track.orders->has_room()) return;
  if (const std::optional<control::MovesState> state = track.planned->state->read()) {
    const double passed_s = static_cast<double>(cycles) * track.planned->period_s;
    follow(index, track.corrective.moves(*state, passed_s));
  }
}

void Monitor::correct(std::size_t index, const watch::MonitorStep& step, bool came) {
  using State = alarm::WindowState;
  Track& track = tracks_[index];
  alarm::CorrectiveAction& action = track.corrective;
  if (action.state() == alarm::CorrectiveState::off) return;
  track.came = track.came || came;
  // A loop that does not take its orders does not run either: what it would be told now waits for a later window.
  if (!track.orders->has_room()) return;
  // A loop that the jacket has calmed may move too little to be judged; its error shows all the same.
  if (step.kind == watch::MonitorStep::Kind::judged || step.state == State::not_enough_movement) {
    const alarm::Alarm alarm = board_.watch(index).alarms.alarm(alarm::AlarmKind::stiction);
    follow(index, action.window(step.measures, alarm.active() && !alarm.is_consequence(),
                                std::exchange(track.came, false)));
  } else {
    follow(index,
           action.interrupted(step.state != State::not_automatic && step.state != State::bad_pv));
  }
}

void Monitor::follow(std::size_t index, const alarm::CorrectiveStep& step) {
  using Order = alarm::CorrectiveStep::Order;
  if (!step.changed()) return;
  std::vector<journal::JournalEntry> lines{board_.corrective_step(index, step)};
  if (step.order == Order::none) {
    board_.write_down(std::move(lines.front()));
  } else {
    Track& track = tracks_[index];
    rt::Order order;
    if (!track.planned) {
      order.jacket = step.order == Order::on ? rt::JacketWish::on : rt::JacketWish::shadow;
    } else if (step.order == Order::back) {
      order.moves = rt::MovesWish::off;
    } else {
      order.moves = step.order == Order::on ? rt::MovesWish::on : rt::MovesWish::shadow;
    }
    if (order.moves == rt::MovesWish::shadow) {
      track.planned->to_loop->publish(*track.planned->settings);
    }
    track.order = track.orders->send(order, std::move(lines));
  }
}

MonitorStatus Monitor::status() const noexcept {
  MonitorStatus status;
  status.windows = windows_.load(std::memory_order_relaxed);
  status.cycles = cycles_.load(std::memory_order_relaxed);
  status.backlog = backlog_.load(std::memory_order_relaxed);
  for (const Track& track : tracks_) status.dropped += track.cycles->dropped();
  return status;
}

}  // namespace loopwarden::daemon::supervision
