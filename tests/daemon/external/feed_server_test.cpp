// SPDX-License-Identifier: Apache-2.0
#include "daemon/external/feed_server.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/local_address.hpp"
#include "daemon/protocol/feed_line.hpp"
#include "daemon/protocol/requests.hpp"
#include "tests/support/device/foreign_process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::daemon::external::feed_server_test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

// A feeder's end of the socket.
class Client {
 public:
  explicit Client(const std::string& path) : fd_(base::try_local_connection(path)) {
    REQUIRE(fd_ >= 0);
  }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  ~Client() { ::close(fd_); }

  void send(const std::string& text) const {
    REQUIRE(::send(fd_, text.data(), text.size(), MSG_NOSIGNAL) ==
            static_cast<ssize_t>(text.size()));
  }
  // Sends as much as fits; returns the number of bytes.
  std::size_t push(const std::string& text) const {
    const ssize_t n = ::send(fd_, text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    return n > 0 ? static_cast<std::size_t>(n) : 0;
  }
  std::string received() const {
    std::array<char, 4096> some{};
    const ssize_t n = ::recv(fd_, some.data(), some.size(), MSG_DONTWAIT);
    return {some.data(), static_cast<std::size_t>(n > 0 ? n : 0)};
  }
  bool ended() const {
    char one = 0;
    return ::recv(fd_, &one, 1, MSG_DONTWAIT) == 0;
  }

 private:
  int fd_;
};

struct Bench {
  struct Settings {
    unsigned uid = ::getuid();
    double bytes_per_second = FeedServer::kBytesPerSecond;
  };
  explicit Bench(const Settings& settings) {
    board.slot({"opcua", "PV"});
    server.emplace(path, std::vector<FeedServer::Right>{{"opcua", settings.uid}}, std::nullopt,
                   board, settings.bytes_per_second);
  }
  Bench() : Bench(Settings{}) {}
  void rounds(int count = 3) {
    for (int i = 0; i < count; ++i) server->serve(0ms);
  }
  double value() { return board.slot({"opcua", "PV"}).newest.newest().sample.value; }
  hal::feed::Feeder::Counters& counters() { return board.feeder("opcua").counters(); }

  tests::TemporaryFolder folder;
  std::string path = (folder / "feed.sock").string();
  hal::feed::FeedTable board;
  std::optional<FeedServer> server;
};

std::string line(double value, const std::string& more = "") {
  return R"({"values":[{"name":"PV","value":)" + std::to_string(value) + "}]" + more + "}\n";
}

}  // namespace

TEST_CASE("a feeder's lines arrive at the board", "[watch][feed]") {
  Bench bench;
  const Client feeder(bench.path);
  bench.rounds();
  CHECK(bench.counters().connected);
  feeder.send(line(1.5) + line(2.5));
  bench.rounds();
  CHECK(bench.value() == 2.5);
  CHECK(bench.counters().lines == 2);
  CHECK(bench.board.feeder("opcua").alive_ns() > 0);
  CHECK(feeder.received().empty());
  feeder.send(R"({"values":[{"name":"PV","val)");  // in two pieces
  bench.rounds();
  feeder.send(R"(ue":3.5},{"name":"TT-1","value":7}],"id":"a"})"
              "\n");
  bench.rounds();
  CHECK(bench.value() == 3.5);
  CHECK(bench.counters().unknown_names == 1);
  CHECK(json::parse(feeder.received()) == json({{"id", "a"}, {"ok", true}, {"taken", 1}}));
}

TEST_CASE("a bad line is counted and the connection stays", "[watch][feed]") {
  Bench bench;
  const Client feeder(bench.path);
  bench.rounds();
  feeder.send("no JSON\n" + line(1.0) + R"({"values": 4, "id": 9})" + "\n" + line(2.0));
  bench.rounds();
  CHECK(bench.counters().bad_lines == 2);
  CHECK(bench.value() == 2.0);
  CHECK(json::parse(feeder.received()).at("ok") == false);
  CHECK_FALSE(feeder.ended());
}

TEST_CASE("a line that is too long is skipped to its end", "[watch][feed]") {
  Bench bench;
  const Client feeder(bench.path);
  const std::string piece(30'000, 'x');
  for (int i = 0; i < 10; ++i) {
    feeder.send(piece);
    bench.rounds();
  }
  feeder.send("\n" + line(4.0));
  bench.rounds();
  CHECK(bench.counters().bad_lines == 1);
  CHECK(bench.value() == 4.0);
}

TEST_CASE("a new connection of a feeder ends the old", "[watch][feed]") {
  Bench bench;
  const Client old(bench.path);
  bench.rounds();
  const Client fresh(bench.path);
  bench.rounds();
  CHECK(old.ended());
  fresh.send(line(6.0));
  bench.rounds();
  CHECK(bench.value() == 6.0);
  CHECK(bench.counters().connected);
  CHECK(bench.counters().connections == 2);
}

TEST_CASE("a client that is no feeder is disconnected", "[watch][feed]") {
  Bench bench({.uid = ::getuid() + 1});
  const Client stranger(bench.path);
  bench.rounds();
  CHECK(stranger.ended());
  CHECK(bench.server->refused() == 1);
  CHECK_FALSE(bench.counters().connected);
}

TEST_CASE("feeders of one user name themselves in their first line", "[watch][feed]") {
  Bench bench;
  bench.server.reset();
  bench.board.slot({"mqtt", "PV"});
  bench.server.emplace(bench.path,
                       std::vector<FeedServer::Right>{{"opcua", ::getuid()}, {"mqtt", ::getuid()}},
                       std::nullopt, bench.board);
  const Client mqtt(bench.path);
  const Client opcua(bench.path);
  mqtt.send(protocol::feed_sign_of_life("mqtt") + "\n" + line(1.5));
  opcua.send(protocol::feed_sign_of_life("opcua") + "\n" + line(2.5));
  bench.rounds();
  CHECK(bench.value() == 2.5);
  CHECK(bench.board.slot({"mqtt", "PV"}).newest.newest().sample.value == 1.5);
  CHECK(bench.board.feeder("mqtt").counters().connected);
  const Client unnamed(bench.path);
  unnamed.send(line(9.0));
  bench.rounds();
  CHECK(unnamed.ended());
  CHECK(bench.value() == 2.5);
}

TEST_CASE("a feeder that ends is not connected any more", "[watch][feed]") {
  Bench bench;
  {
    const Client feeder(bench.path);
    feeder.send(line(1.0));
    bench.rounds();
    CHECK(bench.counters().connected);
  }
  bench.rounds();
  CHECK_FALSE(bench.counters().connected);
}

TEST_CASE("a flood is read no faster than the rate allows", "[watch][feed]") {
  Bench bench({.bytes_per_second = 10'000.0});
  const Client feeder(bench.path);
  bench.rounds(1);
  const auto lines_of = [](std::size_t bytes) {
    std::string lines;
    while (lines.size() < bytes) lines += line(1.0);
    return lines;
  };
  // Lines that are read beyond the rate are made up for by a pause.
  feeder.send(lines_of(20'000));
  bench.rounds(1);
  const std::uint64_t lines = bench.counters().lines;
  CHECK(lines >= 20'000 / line(1.0).size());
  feeder.send(lines_of(60'000));
  bench.rounds(20);
  CHECK(bench.counters().lines == lines);
  CHECK(test::eventually([&] {
    bench.rounds(1);
    return bench.counters().lines > lines;
  }));
  // The pause was worth six seconds.
  const std::uint64_t then = bench.counters().lines;
  bench.rounds(20);
  CHECK(bench.counters().lines == then);
}

TEST_CASE("a feeder that does not read its answers is not read any more", "[watch][feed]") {
  Bench bench;
  const Client feeder(bench.path);
  bench.rounds();
  std::string asked;
  while (asked.size() < 20'000) asked += line(1.0, R"(,"id":")" + std::string(60, 'i') + "\"");
  std::size_t pushed = 0;
  for (int i = 0; i < 300; ++i) {
    pushed += feeder.push(asked);
    bench.rounds(1);
  }
  // Its own answers, which fill the socket, block it.
  const std::uint64_t lines = bench.counters().lines;
  bench.rounds(20);
  CHECK(bench.counters().lines == lines);
  CHECK(pushed < 300 * asked.size());
}

TEST_CASE("the allowed forms of a line of values", "[protocol][feed]") {
  const auto why = [](const std::string& text) {
    std::string id;
    try {
      protocol::read_feed_line(text, id);
    } catch (const protocol::RequestError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  std::string id;
  const protocol::FeedLine all = protocol::read_feed_line(
      R"({"values":[{"name":"FIC205.PV","value":12.3,"time":1764000000.123,"quality":"uncertain"},)"
      R"({"name":"M","value":null,"time":null,"quality":"bad"}],"id":7,"more":true})",
      id);
  REQUIRE(all.values.size() == 2);
  CHECK(all.values[0].name == "FIC205.PV");
  CHECK(all.values[0].value == 12.3);
  CHECK(all.values[0].time_s == 1764000000.123);
  CHECK(all.values[0].quality == protocol::FedValue::Quality::uncertain);
  CHECK_FALSE(all.values[1].value);
  CHECK_FALSE(all.values[1].time_s);
  CHECK(id == "7");
  CHECK(why(R"({"values":[]})").empty());
  CHECK(why("[]") == "a line is a JSON object");
  CHECK(why("{}") == "values must be a list");
  CHECK(why(R"({"values":[1]})") == "each of values must be an object");
  CHECK(why(R"({"values":[{"value":1}]})") == "name must be a text");
  CHECK(why(R"({"values":[{"name":"","value":1}]})") == "name must have 1 to 1024 bytes");
  CHECK(why(R"({"values":[{"name":"A","value":[1]}]})") ==
        "value must be a number, a word or null");
  CHECK(why(R"({"values":[{"name":"A","value":"AUTO"}]})").empty());
  CHECK(why(R"({"values":[{"name":"A","value":""}]})") == "a word must have 1 to 64 bytes");
  CHECK(why(R"({"values":[{"name":"A","value":")" + std::string(65, 'A') + "\"}]}") ==
        "a word must have 1 to 64 bytes");
  CHECK(why(R"({"values":[{"name":"A","value":null}]})") ==
        "value may be null with quality bad only");
  CHECK(why(R"({"values":[{"name":"A","value":1,"time":"now"}]})") ==
        "time must be a number or null");
  CHECK(why(R"({"values":[{"name":"A","value":1,"quality":"fine"}]})") ==
        "quality must be good, uncertain or bad");
  CHECK(why(R"({"values":[],"id":[]})") == "id must be a number or a text of at most 64 bytes");
}

}  // namespace loopwarden::daemon::external::feed_server_test
