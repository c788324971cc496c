// SPDX-License-Identifier: Apache-2.0
#include "services/page/box/daemon_door.hpp"

#include <nlohmann/json.hpp>

#include <utility>

namespace loopwarden::page {
namespace {

// Places at the daemon's socket that a page keeps while nobody asks.
constexpr std::size_t kMostIdle = 3;

}  // namespace

std::unique_ptr<base::LocalClient> DaemonDoor::take() {
  const std::lock_guard lock(mutex_);
  if (idle_.empty()) return nullptr;
  std::unique_ptr<base::LocalClient> client = std::move(idle_.back());
  idle_.pop_back();
  return client;
}

void DaemonDoor::give_back(std::unique_ptr<base::LocalClient> client) {
  const std::lock_guard lock(mutex_);
  if (connections_ == Connections::reused && idle_.size() < kMostIdle)
    idle_.push_back(std::move(client));
}

std::string DaemonDoor::ask_text(const std::string& request) {
  const auto until = std::chrono::steady_clock::now() + patience_;
  const auto left = [until] {
    return std::chrono::ceil<std::chrono::milliseconds>(until - std::chrono::steady_clock::now());
  };
  // Connections of a daemon that has ended since are used up first.
  for (;;) {
    std::unique_ptr<base::LocalClient> client = take();
    const bool fresh = client == nullptr;
    try {
      if (fresh) client = std::make_unique<base::LocalClient>(socket_, left());
      std::string answer = client->request(request, left());
      give_back(std::move(client));
      return answer;
    } catch (const std::exception& e) {
      if (fresh || left().count() <= 0) throw DaemonDown(e.what());
    }
  }
}

nlohmann::json DaemonDoor::ask(const nlohmann::json& request) {
  using nlohmann::json;
  const std::string text = ask_text(request.dump(-1, ' ', false, json::error_handler_t::replace));
  json answer = json::parse(text, nullptr, false);
  if (!answer.is_object()) throw DaemonDown("what answers at the socket is no daemon");
  if (!answer.value("ok", false)) {
    throw DaemonRefused(answer.value("error", std::string("the daemon refused")));
  }
  answer.erase("ok");
  return answer;
}

}  // namespace loopwarden::page
