// SPDX-License-Identifier: Apache-2.0
#include "workbench/live/daemon_client.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <thread>

#include "base/text.hpp"
#include "daemon/protocol/ask.hpp"

namespace loopwarden::workbench {
namespace {

// Checks the permission first, because the client's error has only a text.
const std::string& checked(const std::string& socket_path) {
  std::string why = protocol::no_permission(socket_path);
  if (why.empty()) return socket_path;
  if (std::filesystem::path(socket_path).stem() != "status") {
    why +=
        " Members of the group loopwarden-status may read: `--socket "
        "/run/loopwardend/status.sock`.";
  }
  throw std::runtime_error(why);
}

}  // namespace

std::string socket_option(const std::string& socket) {
  return socket == DaemonClient::kDefaultSocket ? "" : " --socket " + base::as_shell_word(socket);
}

DaemonClient::DaemonClient(const std::string& socket_path) : client_(checked(socket_path)) {}

nlohmann::json DaemonClient::ask(const nlohmann::json& request) {
  constexpr std::chrono::milliseconds kPatience{3000};
  try {
    return protocol::answer_in(client_.request(request.dump(), kPatience));
  } catch (const protocol::DaemonError& e) {
    if (!e.refused()) throw;
    throw DaemonRefused(kExitData, std::string("the daemon rejected it: ") + e.what(), e.kind());
  }
}

bool DaemonClient::set(const protocol::SetRequest& request, std::chrono::milliseconds for_disk) {
  using Clock = std::chrono::steady_clock;
  using Seconds = std::chrono::duration<double>;
  constexpr std::chrono::milliseconds kBetweenLooks{5};
  const protocol::OrderTaken sent = protocol::ask(*this, request);
  const protocol::OrderRequest look{.loop = request.loop, .order = sent.order};
  const Clock::time_point start = Clock::now();
  const Seconds patience(5.0 + 3.0 * sent.sample_time_s);
  for (;;) {
    const protocol::OrderState now = protocol::ask(*this, look);
    const protocol::OrderOutcome outcome = now.outcome.value_or(protocol::OrderOutcome{});
    if (now.state == "refused") {
      throw DaemonRefused(kExitData, "the loop rejected it: " + outcome.why);
    }
    const bool done = now.state == "done";
    if (done && (outcome.on_disk || Clock::now() - start > for_disk)) return outcome.on_disk;
    if (!done && Clock::now() - start > patience) {
      throw OrderNotTaken("loop '" + request.loop + "' has not taken the order yet");
    }
    std::this_thread::sleep_for(kBetweenLooks);
  }
}

}  // namespace loopwarden::workbench
