// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/control_server.hpp"

#include <spdlog/spdlog.h>

#include <exception>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>
#include <variant>

#include "daemon/console/metrics.hpp"
#include "daemon/console/request.hpp"
#include "daemon/console/status.hpp"
#include "base/group_access.hpp"
#include "base/local_listener.hpp"

namespace loopwarden::daemon {

using base::LocalServer;
using console::Rights;
using console::SocketName;

namespace {

// page.sock and edge.sock get one answer per round: a flood of requests delays an operator by one.
constexpr std::size_t kLimitedLinesARound = 1;
constexpr double kLimitedLinesPerSecond = 50.0;
constexpr std::chrono::minutes kBetweenWarnings{1};

}  // namespace

ControlServer::ControlServer(std::filesystem::path folder, const console::Plant& plant,
                             const console::Archive& archive, const console::DaemonInfo& info,
                             console::Operations& operations, const Rights& rights)
    : folder_(std::move(folder)),
      plant_(plant),
      info_(info),
      readings_(plant, archive, info, "lw-reader"),
      commands_(plant, archive, info, operations),
      rights_(rights),
      page_group_(base::group_id("loopwarden-page")),
      edge_group_(base::group_id("loopwarden-edge")) {
  const std::string other = base::other_listener(path_of(SocketName::control).string());
  if (!other.empty()) throw std::runtime_error(other);
  open_and_close();
}

std::filesystem::path ControlServer::path_of(SocketName socket) const {
  return folder_ / (std::string(to_text(socket)) + ".sock");
}

void ControlServer::listen(SocketName socket) {
  base::LocalSocketSettings settings{.path = path_of(socket).string()};
  if (socket != SocketName::control) {
    settings.group = socket == SocketName::page ? page_group_ : edge_group_;
    settings.lines_a_round = kLimitedLinesARound;
    settings.lines_per_second = kLimitedLinesPerSecond;
  }
  server_.listen(settings, [this, socket](std::string_view line, unsigned uid) {
    return answer(line, socket, uid);
  });
}

void ControlServer::set_rights(const Rights& rights) {
  const std::lock_guard lock(rights_mutex_);
  rights_ = rights;
}

Rights ControlServer::rights() const {
  const std::lock_guard lock(rights_mutex_);
  return rights_;
}

std::vector<std::string> ControlServer::problems() const {
  std::vector<std::string> all;
  for (const base::RepeatedAttempt& attempt : opening_) {
    std::string problem = attempt.problem();
    if (!problem.empty()) all.push_back(std::move(problem));
  }
  return all;
}

// Opens each socket that should be open, and closes each one that lost its last right by a reload.
void ControlServer::open_and_close() {
  constexpr std::array kSockets{SocketName::control, SocketName::page, SocketName::edge};
  const Rights now = rights();
  for (std::size_t i = 0; i < kSockets.size(); ++i) {
    const std::string path = path_of(kSockets[i]).string();
    if (!now.of(kSockets[i]).any()) {
      server_.close(path);
      opening_[i].give_up();
    } else if (!server_.listens(path)) {
      opening_[i].run([&] { listen(kSockets[i]); });
    }
  }
}

void ControlServer::round() {
  try {
    open_and_close();
    server_.serve(std::chrono::milliseconds(200));
  } catch (const std::exception& e) {
    spdlog::error("control socket: {}", e.what());
  }
  try {
    commands_.collect();
  } catch (const std::exception& e) {
    spdlog::error("orders: {}", e.what());
  }
  publish_metrics();
  ticks_.fetch_add(1, std::memory_order_relaxed);
}

void ControlServer::start() {
  readings_.start();
  metrics_.start();
  thread_.start({.name = "lw-control"}, [this] {
    while (!quit_.load(std::memory_order_relaxed)) round();
  });
}

void ControlServer::publish_metrics() {
  constexpr std::chrono::seconds kInterval{5};
  if (metrics_file_.empty() || std::chrono::steady_clock::now() < metrics_due_) return;
  metrics_due_ = std::chrono::steady_clock::now() + kInterval;
  try {
    // If the disk fails, the age of the file shows it.
    std::string text = metrics_text(info_.status(), plant_.loops.size(), [this](std::size_t loop) {
      return console::loop_status(plant_, loop);
    });
    metrics_.begin(
        [file = metrics_file_, text = std::move(text)] { (void)write_metrics(file, text); });
  } catch (const std::exception& e) {
    spdlog::error("metrics: {}", e.what());
  }
}

void ControlServer::end_thread() noexcept {
  quit_ = true;
  thread_.join();
  try {
    commands_.close();
  } catch (const std::exception& e) {
    spdlog::error("orders: {}", e.what());
  }
}

void ControlServer::stop() {
  end_thread();
  readings_.stop();
  metrics_.stop();
}

bool ControlServer::stop_for(std::chrono::milliseconds patience) {
  end_thread();
  const bool read = readings_.stop_for(patience);
  return metrics_.stop_for(patience) && read;
}

// Logs requests beyond the rights of a socket, at most one line per minute.
void ControlServer::check_allowed(const std::string& request, SocketName socket) {
  try {
    console::check_access(request, console::access_of(request), socket, rights());
  } catch (const std::exception& e) {
    const auto now = std::chrono::steady_clock::now();
    ++not_allowed_;
    if (now >= log_again_) {
      spdlog::warn("refused at {}.sock: {} (so many since the last such line: {})", to_text(socket),
                   e.what(), not_allowed_);
      log_again_ = now + kBetweenWarnings;
      not_allowed_ = 0;
    }
    throw;
  }
}

LocalServer::Answer ControlServer::answer(std::string_view line, SocketName socket,
                                          unsigned peer_uid) {
  LocalServer::Answer answer;
  std::string now = console::answer_line(line, [&](const nlohmann::json& request) -> std::string {
    const std::string what = protocol::name_of(request);
    const console::Sender sender =
        console::sender_of(request.get<protocol::Person>(), socket, peer_uid);
    check_allowed(what, socket);
    if (console::Readings::offers(what)) return readings_.answer(what, request);
    answer = commands_.answer(what, request, sender);
    const auto* const text = std::get_if<std::string>(&answer);
    return text != nullptr ? *text : std::string();
  });
  if (!std::holds_alternative<LocalServer::Later>(answer)) answer = std::move(now);
  return answer;
}

}  // namespace loopwarden::daemon
