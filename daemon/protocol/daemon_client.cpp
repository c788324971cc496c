// SPDX-License-Identifier: Apache-2.0
#include "daemon/protocol/daemon_client.hpp"

#include <fmt/format.h>
#include <pwd.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

namespace loopwarden::protocol {

using nlohmann::json;

namespace {

std::string name_of_user() {
  const passwd* user = ::getpwuid(::geteuid());
  return user == nullptr ? std::to_string(::geteuid()) : user->pw_name;
}

}  // namespace

std::string no_permission(const std::string& socket) {
  if (::access(socket.c_str(), W_OK) == 0 || errno != EACCES) return {};
  const std::string name = std::filesystem::path(socket).stem();
  const std::string group = name == "control" ? "loopwardend" : "loopwarden-" + name;
  static const std::string user = name_of_user();  // getpwuid is not thread-safe
  return fmt::format(
      "no permission to use {}. Members of the group {} have it: `sudo adduser {} {}`, then log in "
      "again.",
      socket, group, user, group);
}

std::unique_ptr<base::LocalClient> DaemonClient::take() {
  const std::lock_guard lock(mutex_);
  if (idle_.empty()) return nullptr;
  std::unique_ptr<base::LocalClient> client = std::move(idle_.back());
  idle_.pop_back();
  return client;
}

std::string DaemonClient::ask_text(const std::string& request) {
  // Most idle connections that are kept open.
  constexpr std::size_t kMostIdle = 3;
  const auto until = std::chrono::steady_clock::now() + patience_;
  const auto left = [until] {
    return std::chrono::ceil<std::chrono::milliseconds>(until - std::chrono::steady_clock::now());
  };
  // Idle connections to a daemon that has since ended fail before the request is sent. They are
  // discarded first.
  for (;;) {
    std::unique_ptr<base::LocalClient> client = take();
    const bool fresh = client == nullptr;
    try {
      if (fresh) client = std::make_unique<base::LocalClient>(socket_, left());
      std::string answer = client->request(request, left());
      const std::lock_guard lock(mutex_);
      if (idle_.size() < kMostIdle) idle_.push_back(std::move(client));
      return answer;
    } catch (const base::NoAnswer& e) {
      throw DaemonError(DaemonError::Kind::not_known, e.what());
    } catch (const std::exception& e) {
      if (!fresh && left().count() > 0) continue;
      const std::string why = no_permission(socket_);
      throw DaemonError(DaemonError::Kind::down, why.empty() ? e.what() : why);
    }
  }
}

json DaemonClient::ask(const json& request) {
  return answer_in(ask_text(request.dump(-1, ' ', false, json::error_handler_t::replace)));
}

json answer_in(const std::string& line) {
  json answer = json::parse(line, nullptr, false);
  if (!answer.is_object()) {
    throw DaemonError(DaemonError::Kind::not_known, "the program at the socket is not the daemon");
  }
  if (!answer.value("ok", false)) {
    using Kind = DaemonError::Kind;
    throw DaemonError(answer.value("try_again", false) ? Kind::not_yet : Kind::refused,
                      answer.value("error", std::string("the daemon refused")));
  }
  answer.erase("ok");
  return answer;
}

}  // namespace loopwarden::protocol
