// SPDX-License-Identifier: Apache-2.0
// Events to send, servers that receive them, and a scripted daemon.
#pragma once

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "services/notify/rules/dispatch.hpp"
#include "services/notify/text/event_text.hpp"
#include "base/local_server.hpp"
#include "tests/support/device/foreign_process.hpp"
#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::notify::test {

using loopwarden::test::eventually;
using loopwarden::test::ForeignProcess;
using loopwarden::tests::read_file;
using loopwarden::tests::TemporaryFolder;
using loopwarden::tests::write_file;

inline constexpr std::int64_t kNoon = 1'795'521'600'000;  // 2026-11-24 12:00 UTC, ms

inline Event event_of(const std::string& loop, Change change = Change::came,
                      std::optional<double> severity = 6.1) {
  return {.utc_ms = kNoon,
          .loop = loop,
          .alarm = "stiction",
          .change = change,
          .state = change == Change::went ? "normal" : "unacknowledged",
          .severity_percent = severity,
          .worst_percent = severity};
}

inline Message message_with(std::vector<Event> events, std::int64_t id = 7) {
  Message message = message_of("channel", events, kNoon);
  message.id = id;
  message.attempts = 1;
  return message;
}

inline Sender sender() { return {"box 12", find_zone("Europe/Berlin")}; }

// Each log line is JSON.
inline std::vector<nlohmann::json> lines_of(const std::filesystem::path& log) {
  std::vector<nlohmann::json> lines;
  std::ifstream file(log);
  for (std::string line; std::getline(file, line);) lines.push_back(nlohmann::json::parse(line));
  return lines;
}

inline ForeignProcess server(const std::string& program, std::vector<std::string> arguments) {
  return ForeignProcess("../server/" + program, std::move(arguments));
}

// A test authority, a certificate for 127.0.0.1 that it signed, and another authority that did not
// sign it.
class Certificates {
 public:
  Certificates() {
    const std::string at = folder_.path().string();
    const std::string request = "openssl req -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes ";
    const auto run = [](const std::string& line) {
      REQUIRE(tests::run(line + " 2>/dev/null").exit_code == 0);
    };
    for (const char* name : {"ca", "other"}) {
      run(request + "-x509 -days 30 -subj /CN=test -keyout " + at + "/" + name + ".key -out " + at +
          "/" + name + ".pem");
    }
    write_file(folder_ / "names", "subjectAltName=IP:127.0.0.1,DNS:localhost\n");
    run(request + "-subj /CN=127.0.0.1 -keyout " + at + "/server.key -out " + at + "/server.csr");
    run("openssl x509 -req -days 30 -in " + at + "/server.csr -CA " + at + "/ca.pem -CAkey " + at +
        "/ca.key -CAcreateserial -extfile " + at + "/names -out " + at + "/server.pem");
  }

  std::string file(const char* name) const { return (folder_ / name).string(); }

 private:
  TemporaryFolder folder_;
};

inline const Certificates& certificates() {
  static const Certificates made;
  return made;
}

// Answers on a status socket as the daemon does.
class FakeDaemon {
 public:
  explicit FakeDaemon(std::filesystem::path socket) : socket_(std::move(socket)) { start(); }
  FakeDaemon(const FakeDaemon&) = delete;
  FakeDaemon& operator=(const FakeDaemon&) = delete;
  ~FakeDaemon() { stop(); }

  void start() {
    quit_ = false;
    server_.emplace();
    server_->listen({.path = socket_.string()},
                    [this](std::string_view line, unsigned) { return answer(line); });
    thread_ = std::thread([this] {
      while (!quit_) server_->serve(std::chrono::milliseconds(20));
    });
  }
  void stop() {
    quit_ = true;
    if (thread_.joinable()) thread_.join();
    server_.reset();
  }
  // Sets an alarm's state. `raised`: it was raised (again).
  void set(const std::string& loop, const std::string& state, bool raised = false,
           double severity = 6.1, const std::string& alarm = "stiction") {
    const std::lock_guard lock(mutex_);
    nlohmann::json& one =
        alarms_.try_emplace({loop, alarm}, nlohmann::json::object()).first->second;
    const std::int64_t times = one.value("times_raised", std::int64_t{0});
    one = {{"loop", loop},
           {"alarm", alarm},
           {"state", state},
           {"active", state == "unacknowledged" || state == "acknowledged"},
           {"unacknowledged", state.ends_with("unacknowledged")},
           {"times_raised", times + (raised ? 1 : 0)},
           {"severity_percent", severity}};
  }
  void write_journal(const nlohmann::json& line) {
    const std::lock_guard lock(mutex_);
    journal_.insert(journal_.begin(), line);
  }
  // Its only loop, and the answer with the loop's newest cycles.
  void describe(const nlohmann::json& loop) {
    const std::lock_guard lock(mutex_);
    loop_ = loop;
  }
  void set_trend(const nlohmann::json& trend) {
    const std::lock_guard lock(mutex_);
    trend_ = trend;
  }
  // Sets the explanation given for every alarm.
  void set_explanation(const nlohmann::json& explanation) {
    const std::lock_guard lock(mutex_);
    explanation_ = explanation;
  }
  std::atomic<bool> explains{true};  // false: it refuses to explain
  int asked() const { return asked_; }
  // Duration of each explanation, and number of requests.
  std::atomic<int> explain_ms{0};
  std::atomic<int> explained{0};

 private:
  std::string answer(std::string_view line) {
    const std::lock_guard lock(mutex_);
    ++asked_;
    const std::string request = nlohmann::json::parse(line).at("request");
    if (request == "explain") {
      ++explained;
      std::this_thread::sleep_for(std::chrono::milliseconds(explain_ms.load()));
      if (!explains) return nlohmann::json{{"ok", false}, {"error", "not now"}}.dump();
      return nlohmann::json{{"ok", true}, {"evidence", nullptr}, {"explanation", explanation_}}
          .dump();
    }
    if (request == "describe")
      return nlohmann::json{{"ok", true}, {"loops", nlohmann::json::array({loop_})}}.dump();
    if (request == "trend") return trend_.dump();
    if (request == "journal") return nlohmann::json{{"ok", true}, {"lines", journal_}}.dump();
    nlohmann::json all = nlohmann::json::array();
    for (const auto& [key, alarm] : alarms_) all.push_back(alarm);
    return nlohmann::json{{"ok", true}, {"now_ms", kNoon}, {"alarms", all}}.dump();
  }

  std::filesystem::path socket_;
  std::mutex mutex_;
  std::map<AlarmKey, nlohmann::json> alarms_;
  nlohmann::json journal_ = nlohmann::json::array();
  nlohmann::json loop_ = {{"tag", "FIC-101"}, {"description", "cooling water"}};
  nlohmann::json explanation_;
  nlohmann::json trend_ = {{"ok", false}, {"error", "none"}};
  std::atomic<int> asked_{0};
  std::atomic<bool> quit_{false};
  std::optional<base::LocalServer> server_;
  std::thread thread_;
};

}  // namespace loopwarden::notify::test
