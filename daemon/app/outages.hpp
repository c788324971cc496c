// SPDX-License-Identifier: Apache-2.0
// Finds the lost connections with their loops. The alarms of these loops are suppressed, because an
// alarm of the box reports the connection.
//
//   feeder       it is not connected, or sends no lines
//   its source   the part that the feeder names (feed_line.hpp), such as a broker or an edge node
//   link         of Modbus loops, with the units that do not answer
//
// A value that never arrived from a connected feeder is no outage: its name may be wrong.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "daemon/host/host_judge.hpp"
#include "daemon/loops/loop_runtime.hpp"
#include "daemon/protocol/answers.hpp"
#include "daemon/supervision/alarm_registry.hpp"
#include "hal/feed/feed_table.hpp"

namespace loopwarden::daemon {

class Outages {
 public:
  // The arguments must outlive this object.
  Outages(const std::vector<LoopRuntime>& loops, const hal::feed::FeedTable& feeders,
          supervision::AlarmRegistry& alarms, const host::HostAlarms& box)
      : loops_(loops), feeders_(feeders), alarms_(alarms), box_(box) {}

  // After a restart: suppresses the active alarms of all loops if the box's alarm for a lost
  // connection is active. Call it before the threads start.
  void restore();
  // `uptime_s`: of the daemon.
  host::LostConnections look(double uptime_s);
  // Returns the state of each feeder and link. Any thread.
  std::vector<protocol::ConnectionStatus> connections() const;

 private:
  struct Behind {
    std::string what;
    bool feeder = false;        // the feeder itself is lost
    std::optional<int> unit{};  // of a Modbus link
  };
  std::optional<Behind> behind(const LoopRuntime& loop, base::Reason silence) const;
  // Returns the active alarm of the box for a lost connection; empty: there is none.
  std::string known_outage() const;

  const std::vector<LoopRuntime>& loops_;
  const hal::feed::FeedTable& feeders_;
  supervision::AlarmRegistry& alarms_;
  const host::HostAlarms& box_;
};

}  // namespace loopwarden::daemon
