// SPDX-License-Identifier: Apache-2.0
#include "daemon/supervision/corrective_control.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "model/twin/planned_moves_of.hpp"

namespace loopwarden::daemon::supervision {

using Order = alarm::CorrectiveStep::Order;

namespace {

const char* what_of(const alarm::CorrectiveStep& step) noexcept {
  const bool planned = step.form == alarm::CorrectiveForm::planned_moves;
  switch (step.order) {
    case Order::on: return planned ? "planned moves on" : "jacket on";
    case Order::back: return planned ? "planned moves off" : "jacket back to shadow";
    case Order::shadow: return "planned moves in shadow";
    case Order::none: break;
  }
  return "corrective action";
}

}  // namespace

std::optional<CorrectiveControl::PlannedMoves> CorrectiveControl::planned_moves_of(
    const alarm::CorrectiveSettings& settings, const CorrectiveChannels& channels,
    const plant::LoopModel* twin) {
  if (settings.form != alarm::CorrectiveForm::planned_moves) return std::nullopt;
  if (channels.moves == nullptr || twin == nullptr) return std::nullopt;
  PlannedMoves planned{.on_order = settings.on_order,
                       .settings = twin::planned_moves_of(*twin),
                       .explained = nullptr};
  if (planned.settings) {
    planned.settings->max_move = settings.max_move;
    planned.settings->max_moves_per_hour = settings.max_moves_per_hour;
  }
  return planned;
}

CorrectiveControl::CorrectiveControl(const alarm::CorrectiveSettings& settings,
                                     const CorrectiveChannels& channels,
                                     const plant::LoopModel* twin, double period_s,
                                     JournaledAlarms& alarms)
    : channels_(channels),
      period_s_(period_s),
      alarms_(alarms),
      action_(channels.commands != nullptr ? settings : alarm::CorrectiveSettings{}),
      planned_(planned_moves_of(settings, channels, twin)),
      settings_seen_(channels.settings_taken != nullptr ? channels.settings_taken->load() : 0),
      started_ms_(alarms.now_ms()) {
  alarms_.set_corrective_state(action_.state());
}

void CorrectiveControl::attend() {
  if (action_.state() == alarm::CorrectiveState::off) return;
  if (command_ != 0) {
    if (const auto outcome = channels_.commands->outcome(command_)) {
      command_ = 0;
      if (!outcome->why.empty()) follow(action_.refused());
    }
  }
  if (!channels_.commands->has_room()) return;
  if (channels_.settings_taken != nullptr) {
    const std::uint32_t taken = channels_.settings_taken->load(std::memory_order_acquire);
    if (taken != settings_seen_) follow(action_.reloaded());
    settings_seen_ = taken;
  }
  // A commissioning must find the loop without corrective action.
  const bool commissioned =
      channels_.commissioned != nullptr && channels_.commissioned->load(std::memory_order_relaxed);
  const alarm::Veto veto = alarms_.veto();
  follow(
      action_.veto(commissioned && veto == alarm::Veto::none ? alarm::Veto::commissioning : veto));
  if (planned_ && channels_.commands->has_room()) follow_explanation();
}

void CorrectiveControl::follow_explanation() {
  const auto [alarm, stick] = alarms_.sticks();
  // If the clock is set back, alarms raised from then on are later than the start.
  const std::int64_t now_ms = alarms_.now_ms();
  started_ms_ = std::min(started_ms_, now_ms);
  const bool raised_since = stick && stick->raised_ms >= started_ms_ && stick->raised_ms <= now_ms;
  const bool begins = planned_->on_order || raised_since;
  const bool fresh = stick && begins && stick != planned_->explained;
  if (alarm && !stick) {
    follow(action_.explained_otherwise());
  } else if (fresh && planned_->settings) {
    twin::set_stick(*planned_->settings, *stick->stick);
    follow(action_.explained(!channels_.hardware || twin::known_well(*stick->stick)));
  }
  planned_->explained = stick;
  if (!channels_.commands->has_room()) return;
  if (alarms_.take_begin_request()) follow(action_.ordered());
}

void CorrectiveControl::follow_moves(std::size_t cycles) {
  if (!planned_ || command_ != 0 || !channels_.commands->has_room()) return;
  if (const std::optional<control::MovesState> state = channels_.moves->read()) {
    follow(action_.moves(*state, static_cast<double>(cycles) * period_s_));
  }
}

void CorrectiveControl::follow_step(const watch::MonitorStep& step, bool raised) {
  using State = alarm::WindowState;
  if (action_.state() == alarm::CorrectiveState::off) return;
  alarm_raised_ = alarm_raised_ || raised;
  // A loop that takes no commands does not run either. The action waits for a later window.
  if (!channels_.commands->has_room()) return;
  // A loop that no longer cycles may move too little to be judged; its error is measured anyway.
  if (step.kind == watch::MonitorStep::Kind::judged || step.state == State::not_enough_movement) {
    follow(action_.window(step.measures, alarms_.stiction_is_on(),
                          std::exchange(alarm_raised_, false)));
  } else {
    follow(action_.interrupted(step.state != State::not_automatic && step.state != State::bad_pv));
  }
}

void CorrectiveControl::close() {
  if (channels_.commands != nullptr) channels_.commands->close();
}

void CorrectiveControl::follow(const alarm::CorrectiveStep& step) {
  if (!step.changed()) return;
  alarms_.set_corrective_state(step.to);
  std::vector<journal::JournalEntry> lines{line_of(step)};
  if (step.order == Order::none) {
    lines.front().result = "done";
    alarms_.post(std::move(lines.front()));
    return;
  }
  const rt::Command command = command_of(step);
  if (command.moves == rt::MovesMode::shadow) {
    channels_.moves_settings->publish(*planned_->settings);
  }
  command_ = channels_.commands->send(command, std::move(lines));
}

rt::Command CorrectiveControl::command_of(const alarm::CorrectiveStep& step) const {
  rt::Command command;
  if (!planned_) {
    command.jacket = step.order == Order::on ? rt::JacketMode::on : rt::JacketMode::shadow;
  } else if (step.order == Order::back) {
    command.moves = rt::MovesMode::off;
  } else {
    command.moves = step.order == Order::on ? rt::MovesMode::on : rt::MovesMode::shadow;
  }
  return command;
}

// The result of the line is known once the loop has answered the command.
journal::JournalEntry CorrectiveControl::line_of(const alarm::CorrectiveStep& step) const {
  journal::JournalEntry line;
  line.kind = journal::JournalEntry::Kind::system;
  line.utc_ms = alarms_.now_ms();
  line.loop = alarms_.name();
  line.alarm = alarm::to_text(alarm::AlarmKind::stiction);
  line.what = what_of(step);
  line.old_value = alarm::to_text(step.from);
  line.new_value = alarm::to_text(step.to);
  line.reason = step.why;
  if (step.rms_before > 0.0) {
    line.reason += fmt::format("; % of PV span, before: rms {:.3g}, mean {:.3g}", step.rms_before,
                               step.mean_before);
  }
  if (step.rms_after > 0.0) {
    line.reason += fmt::format("; after: rms {:.3g}, mean {:.3g}", step.rms_after, step.mean_after);
  }
  if (step.gain_in_shadow > 0.0) {
    line.reason += fmt::format("; in shadow: rms {:.2f} of that without", step.gain_in_shadow);
  }
  return line;
}

}  // namespace loopwarden::daemon::supervision
