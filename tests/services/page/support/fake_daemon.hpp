// SPDX-License-Identifier: Apache-2.0
// The part of a daemon that a page needs, with the test's own data.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/local_server.hpp"
#include "daemon/protocol/daemon_client.hpp"

namespace loopwarden::tests {

inline nlohmann::json describe_of_two() {
  using nlohmann::json;
  const auto loop = [](const char* tag) {
    return json{{"tag", tag},          {"pv_unit", "L/min"},
                {"co_unit", "V"},      {"sample_time_s", 0.1},
                {"recording", true},   {"stem", true},
                {"pv_range", {0, 10}}, {"folder", std::string("/state/segments/") + tag}};
  };
  return {{"version", "0.2.0"},
          {"config_hash", 7},
          {"model_hash", 8},
          {"accelerate", 1.0},
          {"started_ms", 1'750'000'000'000},
          {"state_directory", "/state"},
          {"page", {{"alarms", true}, {"control", true}, {"reports", true}}},
          {"loops", {loop("FIC-101"), loop("FIC-102")}}};
}

inline nlohmann::json overview_of_two(int period, double pv) {
  return {{"now_ms", 1'750'000'000'000 + period * 100},
          {"config_hash", 7},
          {"period", {period, period}},
          {"pv", {pv, nullptr}},
          {"alarm", {0, 1}},
          {"alarm_kind", {nullptr, 0}},
          {"alarms_unacknowledged", {0, 1}}};
}

inline nlohmann::json alarm_of(const char* loop, const char* alarm, const char* state,
                               std::int64_t raised_ms) {
  const bool active = std::string(state) != "normal";
  return {{"loop", loop},     {"alarm", alarm},           {"state", state},
          {"active", active}, {"unacknowledged", active}, {"raised_ms", raised_ms}};
}

// Answers on a socket, in a separate thread.
class FakeDaemon {
 public:
  using Answer = std::function<nlohmann::json(const nlohmann::json& request)>;

  FakeDaemon(const std::filesystem::path& socket, Answer answer) {
    server_.listen({.path = socket.string()}, [answer](std::string_view line, unsigned) {
      nlohmann::json reply = answer(nlohmann::json::parse(line));
      if (!reply.contains("ok")) reply["ok"] = true;
      return reply.dump();
    });
    thread_ = std::thread([this] {
      while (!quit_) server_.serve(std::chrono::milliseconds(20));
    });
  }
  FakeDaemon(const FakeDaemon&) = delete;
  FakeDaemon& operator=(const FakeDaemon&) = delete;
  ~FakeDaemon() {
    quit_ = true;
    thread_.join();
  }

 private:
  base::LocalServer server_;
  std::atomic<bool> quit_{false};
  std::thread thread_;
};

// Keeps the requests, without a socket. Any thread may ask.
class SpokenDaemon final : public protocol::Daemon {
 public:
  std::function<nlohmann::json(const nlohmann::json&)> says = [](const nlohmann::json&) {
    return nlohmann::json::object();
  };
  std::vector<nlohmann::json> asked;

  nlohmann::json ask(const nlohmann::json& request) override {
    const std::lock_guard lock(mutex_);
    asked.push_back(request);
    return says(request);
  }

 private:
  std::mutex mutex_;
};

}  // namespace loopwarden::tests
