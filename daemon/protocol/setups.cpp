// SPDX-License-Identifier: Apache-2.0
#include "daemon/protocol/setups.hpp"

#include "daemon/protocol/members.hpp"

namespace loopwarden::protocol {

PROTOCOL_JSON(SetupStep, name, title, state, since_ms)
PROTOCOL_JSON(SetupUnderWay, loop, begun_ms, command, steps)
PROTOCOL_JSON(Setups, setups)

template <>
struct Members<SetupsRequest> {
  static void put(nlohmann::json& to, const SetupsRequest&) {
    to["request"] = SetupsRequest::kName;
  }
  static void take(const nlohmann::json&, SetupsRequest&) {}
};
PROTOCOL_DEFINE(SetupsRequest)

}  // namespace loopwarden::protocol
