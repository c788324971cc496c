// SPDX-License-Identifier: Apache-2.0
#include "daemon/loops/loop_orders.hpp"

#include <utility>

#include "daemon/orders/order_text.hpp"

namespace loopwarden::daemon {

orders::OrderDesk desk_of(LoopRuntime& loop, rt::OrderBox& box, journal::Journal& journal,
                          OrderDone done) {
  CurrentSettings& settings = *loop.settings;
  const auto taken = [&loop, &journal, done = std::move(done)](const rt::Order& order,
                                                               const journal::JournalEntry& line) {
    if (order.ends_commissioning && loop.commissioning->give_back()) {
      write_down_commissioning(loop, false, journal, line.utc_ms, line.peer);
    }
    if (order.kp || order.ki || order.kd) {
      loop.settings->gains_ordered(
          {.by = line.peer,
           .utc_ms = line.utc_ms,
           .person = line.kind == journal::JournalEntry::Kind::operator_action});
    }
    if (done) done(order, line);
  };
  return {box, loop.channels->standing,
          orders::DeskEnds{
              .write_down =
                  [&journal](journal::JournalEntry line) { return journal.post(std::move(line)); },
              .why =
                  [&settings](const rt::OrderAnswer& answer, const rt::Order& order) {
                    return orders::why_refused(answer, order, settings.get());
                  },
              .done = taken}};
}

rt::InForce in_force(const LoopRuntime& loop, orders::OrderDesk& desk) {
  const rt::Standing standing = desk.standing();  // read first, because the cycle publishes it last
  control::PidGains gains = loop.settings->get().controller.pid.gains;
  rt::InForce now{.mode = standing.mode,
                  .set_point = loop.channels->set_point_wanted.load(std::memory_order_relaxed),
                  .output = loop.channels->output_wanted.load(std::memory_order_relaxed)};
  desk.for_each_waiting([&](const rt::Order& order) {
    now.set_point = order.set_point.value_or(now.set_point);
    now.output = order.output.value_or(now.output);
    rt::set_gains(order, gains);
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
