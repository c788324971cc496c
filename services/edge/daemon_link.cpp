// SPDX-License-Identifier: Apache-2.0
#include "services/edge/daemon_link.hpp"

namespace loopwarden::edge {

nlohmann::json DaemonLink::ask(const nlohmann::json& request) {
  std::string text;
  try {
    text = answer_to(request.dump());
  } catch (const base::NoAnswer& e) {
    // An answer that comes late must not be taken for that of the next request.
    client_.reset();
    throw DaemonAway(e.what(), true);
  } catch (const std::exception& e) {
    client_.reset();
    throw DaemonAway(e.what(), false);
  }
  nlohmann::json answer = nlohmann::json::parse(text, nullptr, false);
  if (!answer.is_object()) {
    client_.reset();
    throw DaemonAway("it answers with something that is no answer", true);
  }
  if (!answer.value("ok", false))
    throw DaemonRefused(answer.value("error", std::string("no reason")));
  return answer;
}

// A connection that was there before may be that of a daemon that has been restarted since: then nothing goes out by it.
std::string DaemonLink::answer_to(const std::string& line) {
  if (client_) {
    try {
      return client_->request(line, patience_);
    } catch (const base::NoAnswer&) {
      throw;
    } catch (const std::runtime_error&) {
      client_.reset();
    }
  }
  client_.emplace(path_, patience_);
  return client_->request(line, patience_);
}

}  // namespace loopwarden::edge
