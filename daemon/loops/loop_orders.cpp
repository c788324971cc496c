// SPDX-License-Identifier: Apache-2.0
#include "daemon/loops/loop_orders.hpp"

#include <utility>

#include "daemon/orders/order_text.hpp"

namespace loopwarden::daemon {

orders::OrderDesk desk_of(LoopRuntime& loop, rt::OrderBox& box, journal::Journal& journal) {
  const CurrentSettings& settings = *loop.settings;
  return {box, loop.channels->standing,
          orders::DeskEnds{
              .write_down =
                  [&journal](journal::JournalEntry line) { return journal.post(std::move(line)); },
              .why =
                  [&settings](const rt::OrderAnswer& answer, const rt::Order& order) {
                    return orders::why_refused(answer, order, settings.get());
                  }}};
}

}  // namespace loopwarden::daemon
