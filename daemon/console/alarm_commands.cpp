// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/alarm_commands.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "daemon/console/journal_answer.hpp"
#include "daemon/console/status.hpp"
#include "daemon/console/words.hpp"

namespace loopwarden::daemon::console {

using base::LocalServer;

namespace {

alarm::AlarmAction wanted_action(const std::string& word) {
  static const std::map<std::string, alarm::AlarmAction> kActions{
      {"acknowledge", alarm::AlarmAction::acknowledge},
      {"reset", alarm::AlarmAction::reset},
      {"shelve", alarm::AlarmAction::shelve},
      {"unshelve", alarm::AlarmAction::unshelve}};
  return meant_by(word, kActions,
                  "action is acknowledge, reset, shelve or unshelve; of stiction calm, too");
}

std::int64_t wanted_shelf_ms(const protocol::AlarmRequest& request) {
  constexpr std::uint64_t kMostMinutes = 24UL * 60UL;
  const std::uint64_t minutes = request.minutes.value_or(0);
  if (minutes < 1 || minutes > kMostMinutes) {
    throw RequestError("minutes must be a whole number from 1 to 1440");
  }
  return static_cast<std::int64_t>(minutes) * 60'000;
}

}  // namespace

LocalServer::Answer AlarmCommands::alarm(const protocol::AlarmRequest& request,
                                         const Sender& sender) {
  const bool calms = request.action == "calm" && request.alarm == "stiction";
  const alarm::AlarmAction action =
      calms ? alarm::AlarmAction::acknowledge : wanted_action(request.action);
  const std::int64_t shelve_ms =
      action == alarm::AlarmAction::shelve ? wanted_shelf_ms(request) : 0;
  std::string reason = short_text(request.reason, "reason");
  if (request.loop == alarm::kBox) {
    const alarm::BoxAlarm kind = wanted_box_alarm(request.alarm);
    const supervision::CommandResult result =
        plant_.box_alarms.act({kind, action, shelve_ms, sender.peer, std::move(reason)});
    if (!result.accepted) throw RequestError(result.why);
    return when_written(journal_, protocol::AlarmActed{.alarm = alarm_of(kind, plant_.box_alarms)},
                        result.ticket, sender);
  }
  const std::size_t index = loop_index(plant_, request.loop);
  if (calms) {
    plant_.loops[index].commissioning->check_command(std::nullopt, Commissioning::Clock::now());
  }
  const supervision::AlarmCommand command{wanted_alarm(request.alarm), action, shelve_ms,
                                          sender.peer, std::move(reason)};
  const supervision::CommandResult result =
      calms ? plant_.alarms.of(index).begin_offered(command.peer, command.reason)
            : plant_.alarms.act(index, command);
  if (!result.accepted) throw RequestError(result.why);
  const supervision::AlarmSnapshot watch = plant_.alarms.snapshot(index);
  return when_written(journal_,
                      protocol::AlarmActed{.alarm = alarm_of(request.loop, command.kind, watch)},
                      result.ticket, sender);
}

LocalServer::Answer AlarmCommands::acknowledge_incident(
    const protocol::AcknowledgeIncidentRequest& request, const Sender& sender) {
  const std::size_t index = loop_index(plant_, request.loop);
  const supervision::CommandResult result = plant_.alarms.of(index).acknowledge_incident(
      request.incident, sender.peer, short_text(request.reason, "reason"));
  if (!result.accepted) throw RequestError(result.why);
  protocol::IncidentActed acted;
  plant_.alarms.look(index, [&](const supervision::AlarmSnapshot& watch) {
    acted.incident = incident_of(request.loop, watch).value();
  });
  return when_written(journal_, std::move(acted), result.ticket, sender);
}

LocalServer::Answer AlarmCommands::acknowledge_all(const protocol::AcknowledgeAllRequest& request,
                                                   const Sender& sender) {
  const supervision::Acknowledged done = plant_.alarms.acknowledge_all(
      alarm::kAlarmKinds, sender.peer, short_text(request.reason, "reason"));
  protocol::AllAcknowledged all;
  for (const auto& [loop, kind] : done.alarms) {
    all.acknowledged.push_back({plant_.alarms.name(loop), alarm::to_text(kind)});
  }
  const host::BoxAcknowledged of_box =
      plant_.box_alarms.acknowledge_all(sender.peer, short_text(request.reason, "reason"));
  for (const alarm::BoxAlarm kind : of_box.alarms) {
    all.acknowledged.push_back({alarm::kBox, alarm::to_text(kind)});
  }
  return when_written(journal_, std::move(all), std::max(done.ticket, of_box.ticket), sender);
}

LocalServer::Answer AlarmCommands::veto(const protocol::VetoRequest& request,
                                        const Sender& sender) {
  const std::size_t index = loop_index(plant_, request.loop);
  const supervision::CommandResult result =
      plant_.alarms.of(index).set_veto(request.veto ? alarm::Veto::back : alarm::Veto::none,
                                       sender.peer, short_text(request.reason, "reason"));
  if (!result.accepted) throw RequestError(result.why);
  return when_written(journal_, protocol::Vetoed{}, result.ticket, sender);
}

std::string AlarmCommands::active_valve_alarms(std::size_t loop) const {
  const supervision::AlarmSnapshot watch = plant_.alarms.snapshot(loop);
  std::string text;
  for (const alarm::AlarmKind kind : alarm::kAlarmKinds) {
    const alarm::Alarm& alarm = watch.alarms.alarm(kind);
    if (!alarm.active() || alarm::is_process_alarm(kind)) continue;
    text += (text.empty() ? "" : ", ") + std::string(alarm::to_text(kind));
    if (alarm::has_size(kind)) text += fmt::format(" {:.1f} %", alarm.memory().severity_percent);
  }
  return text.empty() ? "no alarm" : text;
}

LocalServer::Answer AlarmCommands::outcome(const protocol::OutcomeRequest& request,
                                           const Sender& sender) {
  const std::size_t index = loop_index(plant_, request.loop);
  if (std::find(protocol::kFoundWords.begin(), protocol::kFoundWords.end(), request.found) ==
      protocol::kFoundWords.end()) {
    throw RequestError(fmt::format("found is {}", fmt::join(protocol::kFoundWords, ", ")));
  }
  journal::JournalEntry line = operator_line(plant_, index, sender.peer);
  line.what = "outcome";
  line.old_value = active_valve_alarms(index);
  line.new_value = request.found;
  line.reason = short_text(request.note, "note");
  line.result = "done";
  if (line.reason.starts_with(protocol::kRepaired) || line.reason.starts_with(protocol::kChanged))
    worked_(index, sender.peer);
  protocol::OutcomeKept kept{.said = line.old_value};
  return when_written(journal_, std::move(kept), journal_.post(std::move(line)), sender);
}

LocalServer::Answer AlarmCommands::note(const protocol::NoteRequest& request,
                                        const Sender& sender) {
  journal::JournalEntry line = operator_line(plant_, loop_index(plant_, request.loop), sender.peer);
  line.reason = short_text(request.text, "text");
  if (line.reason.empty()) throw RequestError("text: what is to be noted");
  const auto now_ms = static_cast<std::uint64_t>(line.utc_ms);
  const std::uint64_t about_ms = request.about_ms.value_or(now_ms);
  if (about_ms > now_ms) throw RequestError("about_ms: a time that has been");
  line.what = "note";
  line.new_value = fmt::format("{:%FT%TZ}", fmt::gmtime(static_cast<std::time_t>(about_ms / 1000)));
  line.result = "done";
  return when_written(journal_, protocol::Noted{}, journal_.post(std::move(line)), sender);
}

}  // namespace loopwarden::daemon::console
