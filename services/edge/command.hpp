// SPDX-License-Identifier: Apache-2.0
// Translates an NCMD or DCMD of a host into requests for the daemon. Pure.
//
// | metric | value | request or effect |
// |---|---|---|
// | mode | 0 manual, 1 automatic | set |
// | sp, output | number | set; with mode in one message they take effect in one cycle |
// | acknowledge_NAME, reset_NAME, unshelve_NAME | true | alarm |
// | shelve_NAME | minutes, 0 ends it | alarm |
// | veto_corrective_action | true, false | veto |
// | acknowledge_all (of the node) | true | acknowledge_all |
// | Node Control/Rebirth (of the node) | true | births again |
// | request/evidence | an alarm's name or an evidence folder's | its files |
#pragma once

#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "services/net/sparkplug/payload.hpp"
#include "daemon/protocol/requests.hpp"

namespace loopwarden::edge {

struct Order {
  std::string what;  // "sp 5, mode 1"
  // The request for the daemon, without loop and user.
  std::variant<protocol::SetRequest, protocol::AlarmRequest, protocol::VetoRequest> request;
};

struct Command {
  bool rebirth = false;
  bool acknowledge_all = false;
  std::vector<Order> orders;
  std::vector<std::string> evidence;  // requested names
  std::vector<std::string> refused;   // reasons, one per metric that is not a command
};

// `metrics`: with the names and types of the birth. `of_device`: the message is a DCMD.
Command read_command(const std::vector<sparkplug::Metric>& metrics, bool of_device);

}  // namespace loopwarden::edge
