// SPDX-License-Identifier: Apache-2.0
#include "services/page/boxes/box.hpp"

#include <catch2/catch.hpp>
#include <sys/socket.h>
#include <sys/un.h>

#include <optional>

#include "tests/services/page/support/fake_daemon.hpp"
#include "tests/support/device/foreign_process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::box_test {

using namespace page;
using nlohmann::json;
using test::eventually;

// The newest event of each kind, and their number.
struct Heard {
  std::mutex mutex;
  std::array<std::string, http::kEventKinds> newest;
  std::array<int, http::kEventKinds> count{};

  void operator()(http::EventKind kind, std::string data) {
    const std::lock_guard lock(mutex);
    newest[static_cast<std::size_t>(kind)] = std::move(data);
    ++count[static_cast<std::size_t>(kind)];
  }
  std::string of(http::EventKind kind) {
    const std::lock_guard lock(mutex);
    return newest[static_cast<std::size_t>(kind)];
  }
  int times(http::EventKind kind) {
    const std::lock_guard lock(mutex);
    return count[static_cast<std::size_t>(kind)];
  }
};

BoxSettings quick(const std::filesystem::path& socket) {
  return {.status_socket = socket.string(),
          .live = std::chrono::milliseconds(10),
          .quiet = std::chrono::milliseconds(20),
          .patience = std::chrono::milliseconds(30'000)};
}

TEST_CASE("the box reports a daemon that starts, stops and returns") {
  const TemporaryFolder folder;
  std::atomic<int> period{0};
  const auto answer = [&](const json& request) -> json {
    if (request["request"] == "describe") return describe_of_two();
    if (request["request"] == "overview") return overview_of_two(++period, 5.0);
    return {{"now_ms", 1},
            {"alarms",
             {alarm_of("FIC-102", "stiction", "unacknowledged", 5),
              alarm_of("FIC-101", "stiction", "normal", 0)}}};
  };
  Heard heard;
  Box box(quick(folder / "status.sock"));
  box.start([&](http::EventKind kind, std::string data) { heard(kind, std::move(data)); }, [] {});
  REQUIRE(eventually(
      [&] { return heard.of(http::EventKind::daemon).find("\"up\":false") != std::string::npos; }));
  std::optional<FakeDaemon> daemon(std::in_place, folder / "status.sock", answer);
  REQUIRE(eventually([&] { return box.now().up; }));
  CHECK(box.now().state->about.loops.size() == 2);
  CHECK(eventually([&] { return heard.times(http::EventKind::overview) > 3; }));
  REQUIRE(eventually([&] { return !heard.of(http::EventKind::alarms).empty(); }));
  CHECK(json::parse(heard.of(http::EventKind::alarms))["alarms"].size() == 1);
  daemon.reset();
  REQUIRE(eventually([&] { return !box.now().up; }));
  CHECK(box.now().state);
  CHECK_FALSE(box.now().why.empty());
  const int descriptions = heard.times(http::EventKind::describe);
  daemon.emplace(folder / "status.sock", answer);
  REQUIRE(eventually([&] { return box.now().up; }));
  CHECK(heard.times(http::EventKind::describe) > descriptions);
  box.stop();
}

TEST_CASE("a daemon that restarted between two looks is described again") {
  const TemporaryFolder folder;
  std::atomic<int> period{1000};
  const FakeDaemon daemon(folder / "status.sock", [&](const json& request) -> json {
    if (request["request"] == "describe") return describe_of_two();
    if (request["request"] == "overview") return overview_of_two(++period, 5.0);
    return {{"now_ms", 1}, {"alarms", json::array()}};
  });
  Heard heard;
  Box box(quick(folder / "status.sock"));
  box.start([&](http::EventKind kind, std::string data) { heard(kind, std::move(data)); }, [] {});
  REQUIRE(eventually([&] { return heard.times(http::EventKind::overview) > 3; }));
  CHECK(heard.times(http::EventKind::describe) == 1);
  period = 0;
  CHECK(eventually([&] { return heard.times(http::EventKind::describe) == 2; }));
  box.stop();
}

TEST_CASE("a daemon that is stopped, and whose queue is full, blocks no client") {
  const TemporaryFolder folder;
  const std::string path = (folder / "status.sock").string();
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, path.size());
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  REQUIRE(::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  REQUIRE(::listen(fd, 1) == 0);
  protocol::DaemonClient client(path, std::chrono::milliseconds(20));
  for (int i = 0; i < 10; ++i)
    CHECK_THROWS_AS(client.ask({{"request", "overview"}}), protocol::DaemonError);
  ::close(fd);
}

TEST_CASE("the daemon's refusals differ from its absence") {
  const TemporaryFolder folder;
  const bool later = GENERATE(false, true);
  const FakeDaemon daemon(folder / "s", [later](const json&) -> json {
    return {{"ok", false}, {"error", "no loop 'x'"}, {"try_again", later}};
  });
  protocol::DaemonClient client((folder / "s").string(), std::chrono::milliseconds(30'000));
  try {
    client.ask({{"request", "loop"}});
    FAIL("not refused");
  } catch (const protocol::DaemonError& e) {
    CHECK(e.refused());
    CHECK((e.kind() == protocol::DaemonError::Kind::not_yet) == later);
    CHECK(e.what() == std::string("no loop 'x'"));
  }
}

TEST_CASE("the first alarm of each loop is marked as first out") {
  json quiet = alarm_of("A", "hysteresis", "suppressed", 0);
  quiet["active"] = quiet["unacknowledged"] = false;
  const json answer{
      {"now_ms", 9},
      {"alarms",
       {alarm_of("A", "stiction", "unacknowledged", 30),
        alarm_of("A", "backlash", "acknowledged", 20), alarm_of("A", "unknown", "normal", 1), quiet,
        alarm_of("B", "stiction", "unacknowledged", 40)}}};
  const json shown = alarms_for_page(answer);
  REQUIRE(shown["alarms"].size() == 3);
  CHECK(shown["alarms"][0]["first_out"] == false);
  CHECK(shown["alarms"][1]["first_out"] == true);
  CHECK(shown["alarms"][2]["first_out"] == true);
}

TEST_CASE("incidents that are active, or wait for the operator, are shown") {
  json on{{"id", "A-1"}, {"active", true}, {"unacknowledged", false}};
  json waits{{"id", "B-1"}, {"active", false}, {"unacknowledged", true}};
  json over{{"id", "C-1"}, {"active", false}, {"unacknowledged", false}};
  const json shown =
      alarms_for_page(json{{"alarms", json::array()}, {"incidents", {on, waits, over}}});
  REQUIRE(shown["incidents"].size() == 2);
  CHECK(shown["incidents"][0]["id"] == "A-1");
  CHECK(shown["incidents"][1]["id"] == "B-1");
}

}  // namespace loopwarden::tests::box_test
