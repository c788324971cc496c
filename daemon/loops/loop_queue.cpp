// SPDX-License-Identifier: Apache-2.0
#include "daemon/loops/loop_queue.hpp"

#include <utility>

#include "daemon/commands/command_text.hpp"

namespace loopwarden::daemon {

commands::CommandQueue queue_of(LoopRuntime& loop, rt::CommandMailbox& box,
                                journal::Journal& journal, CommandDone done) {
  CurrentSettings& settings = *loop.settings;
  const auto taken = [&loop, &journal, done = std::move(done)](const rt::Command& command,
                                                               const journal::JournalEntry& line) {
    if (command.ends_commissioning && loop.commissioning->give_back()) {
      write_down_commissioning(loop, false, journal, line.utc_ms, line.peer);
    }
    if (command.kp || command.ki || command.kd) {
      loop.settings->gains_ordered(
          {.by = line.peer,
           .utc_ms = line.utc_ms,
           .person = line.kind == journal::JournalEntry::Kind::operator_action});
    }
    if (done) done(command, line);
  };
  return {box, loop.channels->availability,
          commands::CommandCallbacks{
              .write_down =
                  [&journal](journal::JournalEntry line) { return journal.post(std::move(line)); },
              .why =
                  [&settings](const rt::CommandAnswer& answer, const rt::Command& command) {
                    return commands::why_refused(answer, command, settings.get());
                  },
              .done = taken}};
}

rt::InForce in_force(const LoopRuntime& loop, commands::CommandQueue& queue) {
  const rt::LoopAvailability availability =
      queue.availability();  // read first, because the cycle publishes it last
  control::PidGains gains = loop.settings->get().controller.pid.gains;
  rt::InForce now{.mode = availability.mode,
                  .set_point = loop.channels->set_point_wanted.load(std::memory_order_relaxed),
                  .output = loop.channels->output_wanted.load(std::memory_order_relaxed)};
  queue.for_each_waiting([&](const rt::Command& command) {
    now.set_point = command.set_point.value_or(now.set_point);
    now.output = command.output.value_or(now.output);
    rt::set_gains(command, gains);
  });
  now.kp = gains.kp;
  now.ki = gains.ki;
  now.kd = gains.kd;
  return now;
}

void write_down_commissioning(const LoopRuntime& loop, bool begun, journal::Journal& journal,
                              std::int64_t utc_ms, const std::string& peer) {
  journal::JournalEntry line;
  line.kind = journal::JournalEntry::Kind::operator_action;
  line.utc_ms = utc_ms;
  line.loop = loop.config.name;
  line.peer = peer;
  line.what = "commissioning";
  line.new_value = begun ? "begun" : "ended";
  line.result = "done";
  journal.post(std::move(line));
}

}  // namespace loopwarden::daemon
