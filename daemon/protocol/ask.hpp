// SPDX-License-Identifier: Apache-2.0
// Sends requests as structs and returns answers as structs. Include it in sources only.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "daemon/protocol/daemon_client.hpp"
#include "daemon/protocol/requests.hpp"

namespace loopwarden::protocol {

// Returns `answer` as a struct. Throws DaemonError.
template <class Answer>
Answer read_answer(const nlohmann::json& answer) {
  try {
    return answer.get<Answer>();
  } catch (const nlohmann::json::exception& e) {
    throw DaemonError(DaemonError::Kind::not_known,
                      std::string("the daemon's answer is not as expected: ") + e.what());
  }
}

template <class Request>
typename Request::Answer ask(Daemon& daemon, const Request& request) {
  return read_answer<typename Request::Answer>(daemon.ask(request));
}

}  // namespace loopwarden::protocol
