// SPDX-License-Identifier: Apache-2.0
#include "daemon/loops/loop_orders.hpp"

#include <utility>

#include "daemon/orders/order_text.hpp"

namespace loopwarden::daemon {

orders::OrderDesk desk_of(LoopRuntime& loop, rt::OrderBox& box, journal::Journal& journal) {
  CurrentSettings& settings = *loop.settings;
  return {box, loop.channels->standing,
          orders::DeskEnds{
              .write_down =
                  [&journal](journal::JournalEntry line) { return journal.post(std::move(line)); },
              .why =
                  [&settings](const rt::OrderAnswer& answer, const rt::Order& order) {
                    return orders::why_refused(answer, order, settings.get());
                  },
              .done =
                  [&settings](const rt::Order& order, const journal::JournalEntry& line) {
                    if (!order.kp && !order.ki && !order.kd) return;
                    settings.gains_ordered(
                        {.by = line.peer,
                         .utc_ms = line.utc_ms,
                         .person = line.kind == journal::JournalEntry::Kind::operator_action});
                  }}};
}

void put_out_of_service(LoopRuntime& loop, bool is, journal::Journal& journal, std::int64_t utc_ms,
                        const std::string& peer) {
  loop.channels->commissioned = is;
  loop.channels->withheld_until_ns = 0;
  journal::JournalEntry line;
  line.kind = journal::JournalEntry::Kind::operator_action;
  line.utc_ms = utc_ms;
  line.loop = loop.config.name;
  line.peer = peer;
  line.what = "commissioning";
  line.new_value = is ? "begun" : "ended";
  line.result = "done";
  journal.post(std::move(line));
}

}  // namespace loopwarden::daemon
