// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/loop_commands.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "config/loop_model_writer.hpp"
#include "daemon/console/journal_answer.hpp"
#include "daemon/console/words.hpp"
#include "daemon/loops/commissioning.hpp"
#include "daemon/loops/loop_queue.hpp"
#include "daemon/commands/command_text.hpp"

namespace loopwarden::daemon::console {

using nlohmann::json;

namespace {

control::Mode wanted_mode(const std::string& word) {
  static const std::map<std::string, control::Mode> kModes{{"auto", control::Mode::automatic},
                                                           {"automatic", control::Mode::automatic},
                                                           {"man", control::Mode::manual},
                                                           {"manual", control::Mode::manual}};
  return meant_by(word, kModes, "mode is auto or man");
}

rt::Expectation wanted_expectation(const protocol::Expected& expect) {
  rt::Expectation expected;
  if (expect.set_point) expected.set_point = *expect.set_point;
  if (expect.output) {
    expected.output = std::isnan(*expect.output) ? rt::kOutputNotKnown : *expect.output;
  }
  if (expect.mode) expected.mode = wanted_mode(*expect.mode);
  return expected;
}

// Returns one command with the values that its sender expects to be in force.
rt::Command wanted_command(const protocol::SetRequest& request) {
  static const std::map<std::string, rt::JacketMode> kJacket{
      {"off", rt::JacketMode::off}, {"shadow", rt::JacketMode::shadow}, {"on", rt::JacketMode::on}};
  rt::Command command;
  command.set_point = request.set_point;
  command.output = request.output;
  if (request.mode) command.mode = wanted_mode(*request.mode);
  if (request.jacket) {
    command.jacket = meant_by(*request.jacket, kJacket, "jacket is off, shadow or on");
  }
  if (request.expect) command.expected = wanted_expectation(*request.expect);
  return command;
}

// Returns the value in force if the command was refused because it expected another one.
std::optional<protocol::InForce> changed_value(const commands::Outcome& outcome) {
  switch (outcome.refusal) {
    case rt::Refusal::mode_changed:
      return protocol::InForce{.mode = outcome.now.mode == control::Mode::manual ? "manual"
                                                                                 : "automatic"};
    case rt::Refusal::set_point_changed:
      return protocol::InForce{.set_point = outcome.now.set_point};
    case rt::Refusal::output_changed: return protocol::InForce{.output = outcome.now.output};
    case rt::Refusal::gains_changed:
      return protocol::InForce{.gains =
                                   protocol::Gains{outcome.now.kp, outcome.now.ki, outcome.now.kd}};
    default: return std::nullopt;
  }
}

}  // namespace

protocol::OrderTaken LoopCommands::set(const protocol::SetRequest& request, const Sender& sender) {
  const std::size_t index = loop_index(plant_, request.loop);
  check_takes_commands(plant_, index);
  LoopRuntime& loop = plant_.loops[index];
  rt::Command command = wanted_command(request);
  if (command.empty()) throw RequestError("set needs set_point, output, mode or jacket");
  commands::CommandQueue& commands = queue(index);
  const rt::InForce now = in_force(loop, commands);
  // Manual from any operator ends a commissioning. A machine may repeat the manual in force.
  const bool may_repeat = sender.socket == SocketName::edge && command.mode == now.mode;
  command.ends_commissioning = !request.session && command.mode == control::Mode::manual &&
                               !command.set_point && !may_repeat &&
                               loop.commissioning->holder().has_value();
  // The journal has no line for a value that is in force already. A command that changes at least
  // one value is sent whole, because the newest command decides.
  rt::Command changes = command;
  if (!request.expect) {  // otherwise the answer of the cycle decides
    rt::leave_out_in_force(changes, now, commands.availability(), loop.settings->get());
  }
  if (command.ends_commissioning) {
    changes.mode = command.mode;
  } else {
    loop.commissioning->check_command(request.session, Commissioning::Clock::now());
    commands.for_each_waiting([&](const rt::Command& waiting) {
      if (waiting.ends_commissioning) {
        throw RequestError("the commissioning ends: somebody takes the loop back");
      }
    });
  }
  if (changes.empty()) command = changes;
  const bool refused = !refusal_of(index, command).empty();
  return send(index, command, lines_of(refused ? command : changes, index, sender.peer),
              sender.peer, json(request).dump());
}

protocol::OrderTaken LoopCommands::tune(const protocol::TuneRequest& request,
                                        const Sender& sender) {
  const std::size_t index = loop_index(plant_, request.loop);
  check_takes_commands(plant_, index);
  LoopRuntime& loop = plant_.loops[index];
  loop.commissioning->check_command(std::nullopt, Commissioning::Clock::now());
  // The same check as for the loop's file. The cycle refuses negative gains.
  if (request.kp == 0.0 && request.ki == 0.0) {
    throw RequestError("kp and ki are both 0: the output would never move");
  }
  rt::Command command{.kp = request.kp, .ki = request.ki, .kd = request.kd};
  if (request.expect) {
    command.expected.kp = request.expect->kp;
    command.expected.ki = request.expect->ki;
    command.expected.kd = request.expect->kd;
  }
  const rt::InForce now = in_force(loop, queue(index));
  if (!request.expect) {
    rt::leave_out_in_force(command, now, queue(index).availability(), loop.settings->get());
  }
  Lines lines;
  if (!command.empty()) {
    journal::JournalEntry& line = lines.emplace_back(operator_line(plant_, index, sender.peer));
    line.what = "gains";
    line.old_value = commands::gains_text({now.kp, now.ki, now.kd});
    line.new_value = commands::gains_text({request.kp, request.ki, request.kd});
    const auto not_in_file = loop.settings->gains_not_in_file();
    const control::PidGains file =
        not_in_file ? not_in_file->file : loop.settings->get().controller.pid.gains;
    if (request.kp != file.kp || request.ki != file.ki || request.kd != file.kd) {
      line.reason = "not in file: a restart takes " + commands::gains_text(file);
    }
  }
  return send(index, command, std::move(lines), sender.peer, json(request).dump());
}

protocol::OrderState LoopCommands::order(const protocol::OrderRequest& request) {
  const std::size_t index = loop_index(plant_, request.loop);
  commands::CommandQueue& commands = queue(index);
  const std::uint64_t number = request.order.value_or(0);
  if (number < 1 || number > commands.newest()) throw RequestError("there is no such order");
  if (const std::optional<commands::Outcome> outcome = commands.outcome(number)) {
    const bool patient =
        std::chrono::steady_clock::now() - outcome->answered < kLimitedDiskPatience;
    if (outcome->why.empty() && patient && !operations_.command_kept(index)) {
      return {.state = "waiting"};
    }
    return {.state = outcome->why.empty() ? "done" : "refused",
            .outcome =
                protocol::OrderOutcome{.why = outcome->why,
                                       .now = changed_value(*outcome),
                                       .on_disk = journal_.wait_written(
                                           outcome->journal_ticket, std::chrono::milliseconds(0))}};
  }
  bool waits = false;
  commands.for_each_waiting([&](const rt::Command& one) { waits = waits || one.number == number; });
  if (!waits) throw RequestError("what became of that order is in the journal");
  return {.state = "waiting"};
}

std::string LoopCommands::refusal_of(std::size_t loop, const rt::Command& command) {
  const rt::LoopSettings settings = plant_.loops[loop].settings->get();
  commands::CommandQueue& commands = queue(loop);
  const rt::Refusal refusal =
      rt::judge(command, commands.availability(), settings, settings.controller.jacket.form);
  if (refusal != rt::Refusal::none) return commands::why_refused(refusal, command, settings);
  return commands.has_room() ? "" : "too many commands at once; nothing of this order was taken";
}

protocol::OrderTaken LoopCommands::send(std::size_t loop, const rt::Command& command,
                                        const std::string& peer, const std::string& text) {
  return send(loop, command, lines_of(command, loop, peer), peer, text);
}

protocol::OrderTaken LoopCommands::send(std::size_t loop, const rt::Command& command, Lines lines,
                                        const std::string& peer, const std::string& text) {
  const std::string why = refusal_of(loop, command);
  if (!lines.empty()) {  // without lines, all values are in force already
    spdlog::info("loop {}: operator ({}) {}{}{}", plant_.alarms.name(loop), peer, text,
                 why.empty() ? "" : " refused: ", why);
  }
  if (!why.empty()) {
    for (journal::JournalEntry& line : lines) {
      line.result = "refused: " + why;
      journal_.post(std::move(line));
    }
    throw RequestError(why);
  }
  return {.order = queue(loop).send(command, std::move(lines)),
          .sample_time_s = plant_.loops[loop].config.sample_time_s};
}

commands::CommandQueue& LoopCommands::queue(std::size_t loop) {
  // The loops are added after the server is created.
  while (queues_.size() < plant_.loops.size()) {
    const std::size_t next = queues_.size();
    LoopRuntime& runtime = plant_.loops[next];
    queues_.push_back(queue_of(
        runtime, runtime.channels->operator_commands, journal_,
        [this, next](const rt::Command& command, const journal::JournalEntry& line) {
          if (command.kp) worked_(next, line.peer);
          // The monitor must not undo an operator's change of the jacket.
          if (!command.jacket ||
              plant_.alarms.snapshot(next).corrective == alarm::CorrectiveState::off)
            return;
          plant_.alarms.of(next).set_veto(alarm::Veto::hands_off, line.peer, "jacket set by hand");
        }));
  }
  return queues_[loop];
}

LoopCommands::Lines LoopCommands::lines_of(const rt::Command& command, std::size_t loop,
                                           const std::string& peer) const {
  const rt::LoopChannels& channels = *plant_.loops[loop].channels;
  record::RecordRow row;
  const bool known = plant_.historian.latest(loop, row);
  Lines lines;
  const auto add = [&](const char* what, const std::string& before, const std::string& after) {
    journal::JournalEntry& line = lines.emplace_back(operator_line(plant_, loop, peer));
    line.what = what;
    if (known) line.old_value = before;
    line.new_value = after;
  };
  const auto text = [](double value) {
    return std::isfinite(value) ? fmt::format("{:.9g}", value) : std::string();
  };
  if (command.jacket) {
    constexpr std::array kForms{"off", "shadow", "on"};
    add("jacket", config::to_text(row.jacket_form),
        kForms[static_cast<std::size_t>(*command.jacket)]);
  }
  if (command.mode) {
    add("mode", control::to_text(row.requested_mode), control::to_text(*command.mode));
  }
  if (command.set_point) {
    add("set point", text(channels.set_point_wanted.load(std::memory_order_relaxed)),
        text(*command.set_point));
  }
  if (command.output) add("output", text(row.co), text(*command.output));
  return lines;
}

void LoopCommands::collect() {
  for (commands::CommandQueue& queue : queues_) queue.collect();
}

void LoopCommands::close() {
  for (commands::CommandQueue& queue : queues_) queue.close();
}

}  // namespace loopwarden::daemon::console
