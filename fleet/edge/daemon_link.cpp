// SPDX-License-Identifier: Apache-2.0
#include "fleet/edge/daemon_link.hpp"

namespace loopwarden::edge {

nlohmann::json DaemonLink::ask(const nlohmann::json& request) {
  nlohmann::json answer;
  try {
    if (!client_) client_.emplace(path_, patience_);
    answer = nlohmann::json::parse(client_->request(request.dump(), patience_));
  } catch (const std::exception& e) {
    // An answer that comes late must not be taken for that of the next request.
    client_.reset();
    throw DaemonAway(e.what());
  }
  if (!answer.is_object() || !answer.value("ok", false)) {
    throw DaemonRefused(answer.is_object() ? answer.value("error", std::string("no reason"))
                                           : "no answer of ours");
  }
  return answer;
}

}  // namespace loopwarden::edge
