// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/status_server.hpp"

#include <spdlog/spdlog.h>

#include <exception>
#include <nlohmann/json.hpp>

#include "daemon/console/access.hpp"
#include "daemon/console/operator_commands.hpp"
#include "daemon/console/request.hpp"
#include "base/group_access.hpp"

namespace loopwarden::daemon {
namespace {

constexpr std::size_t kMostReaders = 32;
constexpr double kLinesPerSecond = 200.0;

}  // namespace

StatusServer::StatusServer(const std::filesystem::path& folder, const console::Plant& plant,
                           const console::Archive& archive, const console::DaemonInfo& info)
    : path_((folder / "status.sock").string()), readings_(plant, archive, info, "lw-reader-2") {
  open();
}

void StatusServer::open() {
  if (server_.listens(path_)) return;
  opening_.run([this] {
    server_.listen({.path = path_,
                    .group = base::group_id("loopwarden-status"),
                    .most_peers = kMostReaders,
                    .lines_per_second = kLinesPerSecond},
                   [this](std::string_view line, unsigned) { return answer(line); });
  });
}

void StatusServer::start() {
  readings_.start();
  thread_.start({.name = "lw-status"}, [this] {
    while (!quit_.load(std::memory_order_relaxed)) {
      try {
        open();
        server_.serve(std::chrono::milliseconds(200));
      } catch (const std::exception& e) {
        spdlog::error("status socket: {}", e.what());
      }
      ticks_.fetch_add(1, std::memory_order_relaxed);
    }
  });
}

void StatusServer::end_thread() noexcept {
  quit_ = true;
  thread_.join();
}

void StatusServer::stop() {
  end_thread();
  readings_.stop();
}

bool StatusServer::stop_for(std::chrono::milliseconds patience) {
  end_thread();
  return readings_.stop_for(patience);
}

std::string StatusServer::answer(std::string_view line) {
  return console::answer_line(line, [&](const nlohmann::json& request) {
    const std::string what = protocol::name_of(request);
    console::check_access(what, console::access_of(what), console::SocketName::status, {});
    return readings_.answer(what, request);
  });
}

}  // namespace loopwarden::daemon
