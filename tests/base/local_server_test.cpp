// SPDX-License-Identifier: Apache-2.0
#include "base/local_server.hpp"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <memory>
#include <filesystem>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include "base/local_address.hpp"
#include "tests/support/temporary_folder.hpp"

namespace local_server_test {

using namespace loopwarden::base;
using loopwarden::tests::TemporaryFolder;

namespace {

constexpr std::chrono::milliseconds kNow{0};

// A peer with arbitrary behaviour. It never waits.
class Peer {
 public:
  explicit Peer(const std::string& path) : fd_(try_local_connection(path)) { REQUIRE(fd_ >= 0); }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;
  ~Peer() { ::close(fd_); }

  void send(const std::string& text) {
    REQUIRE(::send(fd_, text.data(), text.size(), MSG_NOSIGNAL) ==
            static_cast<ssize_t>(text.size()));
  }
  void end() { ::shutdown(fd_, SHUT_WR); }
  // Returns all data received so far.
  std::string received() {
    std::array<char, 65536> buffer{};
    std::string text;
    for (;;) {
      const ssize_t n = ::recv(fd_, buffer.data(), buffer.size(), MSG_DONTWAIT);
      if (n <= 0) {
        closed_ = n == 0 || (errno != EAGAIN && errno != EINTR);
        return text;
      }
      text.append(buffer.data(), static_cast<std::size_t>(n));
    }
  }
  bool closed() {
    received();
    return closed_;
  }

 private:
  int fd_;
  bool closed_ = false;
};

std::string repeated(const std::string& line, int times) {
  std::string all;
  for (int i = 0; i < times; ++i) all += line + '\n';
  return all;
}

struct Bench {
  void listen(LocalSocketSettings settings) {
    server.listen(settings, [this](std::string_view line, unsigned) {
      answered.emplace_back(line);
      return std::string(line);
    });
  }
  std::string path(const char* name = "a.sock") const { return (folder / name).string(); }
  void rounds(int count) {
    for (int i = 0; i < count; ++i) server.serve(kNow);
  }
  std::unique_ptr<Peer> peer(const char* name = "a.sock") {
    auto made = std::make_unique<Peer>(path(name));
    rounds(1);
    return made;
  }
  long count(const std::string& line) const {
    return std::count(answered.begin(), answered.end(), line);
  }

  TemporaryFolder folder;
  LocalServer server;
  std::vector<std::string> answered;
};

}  // namespace

TEST_CASE("lines sent in advance are answered one by one, in order", "[os][socket]") {
  Bench bench;
  bench.listen({.path = bench.path()});
  const auto peer = bench.peer();
  peer->send("one\ntwo\nthr");
  bench.rounds(3);
  CHECK(peer->received() == "one\ntwo\n");
  peer->send("ee\n");
  bench.rounds(2);
  CHECK(peer->received() == "three\n");
}

TEST_CASE("in a round each peer is answered once, even if another sends many lines",
          "[os][socket]") {
  Bench bench;
  bench.listen({.path = bench.path()});
  const auto loud = bench.peer();
  const auto calm = bench.peer();
  loud->send(repeated("loud", 500));
  bench.rounds(1);
  calm->send(repeated("calm", 3));
  bench.rounds(3);
  CHECK(bench.count("calm") == 3);
  CHECK(bench.count("loud") == 4);
  for (int i = 0; i < 500; ++i) {
    bench.rounds(1);
    loud->received();
  }
  CHECK(bench.count("loud") == 500);
}

TEST_CASE("sixteen peers that flood a limited socket cost the other socket one answer per round",
          "[os][socket]") {
  Bench bench;
  bench.listen({.path = bench.path("control.sock")});
  bench.listen({.path = bench.path("page.sock"), .lines_a_round = 1});
  std::vector<std::unique_ptr<Peer>> flood;
  for (int i = 0; i < 16; ++i) {
    flood.push_back(bench.peer("page.sock"));
    flood.back()->send(repeated("page " + std::to_string(i), 100));
  }
  const auto operators = bench.peer("control.sock");
  bench.answered.clear();
  operators->send(repeated("control", 40));
  bench.rounds(40);
  CHECK(bench.count("control") == 40);
  CHECK(bench.answered.size() == 80);
  // They take turns: within 40 answers each of the 16 got at least two.
  for (int i = 0; i < 16; ++i) CHECK(bench.count("page " + std::to_string(i)) >= 2);
}

TEST_CASE("turns stay fair when peers leave", "[os][socket]") {
  Bench bench;
  bench.listen({.path = bench.path(), .lines_a_round = 1});
  std::vector<std::unique_ptr<Peer>> peers;
  for (int i = 0; i < 4; ++i) {
    peers.push_back(bench.peer());
    peers.back()->send(repeated(std::to_string(i), 20));
  }
  bench.rounds(8);
  peers.erase(peers.begin());
  bench.rounds(30);
  for (int i = 1; i < 4; ++i) CHECK(bench.count(std::to_string(i)) >= 7);
}

TEST_CASE("beyond the rate lines wait, without losses", "[os][socket]") {
  Bench bench;
  bench.listen({.path = bench.path(), .lines_per_second = 2.0});
  const auto peer = bench.peer();
  peer->send(repeated("x", 8));
  // Without the rate there would be 8 answers. With the rate they take 3 s.
  bench.rounds(8);
  const bool held = bench.answered.size() < 8;
  std::string received;
  for (int i = 0; i < 10'000 && received.size() < 16; ++i) {
    bench.server.serve(std::chrono::milliseconds(20));
    received += peer->received();
  }
  CHECK(received.size() == 16);
  CHECK(held);
}

TEST_CASE("a peer with a delayed answer doesn't delay others", "[os][socket]") {
  Bench bench;
  bool there = false;
  bench.server.listen({.path = bench.path()}, [&](std::string_view line, unsigned) {
    bench.answered.emplace_back(line);
    if (line != "later") return LocalServer::Answer(std::string(line));
    return LocalServer::Answer([&there]() -> std::optional<std::string> {
      return there ? std::optional<std::string>("now") : std::nullopt;
    });
  });
  const auto waits = bench.peer();
  const auto other = bench.peer();
  waits->send("later\nnext\n");
  bench.rounds(3);
  CHECK(waits->received().empty());
  other->send("other\n");
  bench.rounds(2);
  CHECK(other->received() == "other\n");
  CHECK(bench.count("next") == 0);  // answers are sent in order
  there = true;
  bench.rounds(3);
  CHECK(waits->received() == "now\nnext\n");

  // A peer that has hung up meanwhile is closed when its answer is ready.
  there = false;
  waits->send("later\n");
  waits->end();
  bench.rounds(2);
  there = true;
  bench.rounds(2);
  CHECK(waits->received() == "now\n");
  CHECK(waits->closed());
}

TEST_CASE("a line without end is cut off", "[os][socket]") {
  Bench bench;
  bench.listen({.path = bench.path()});
  const auto endless = bench.peer();
  const std::string piece(4096, 'x');
  for (int i = 0; i < 17; ++i) {
    endless->send(piece);
    bench.rounds(1);
  }
  CHECK(endless->closed());
  CHECK(bench.answered.empty());
}

TEST_CASE("a peer that doesn't read its answers is not read from, and doesn't delay others",
          "[os][socket]") {
  Bench bench;
  int large = 0;
  bench.server.listen({.path = bench.path()}, [&](std::string_view line, unsigned) {
    if (line != "large") return std::string("small");
    ++large;
    return std::string(4'000'000, 'y');
  });
  const auto slow = bench.peer();
  const auto other = bench.peer();
  slow->send(repeated("large", 1000));
  for (int i = 0; i < 20; ++i) {
    other->send("?\n");
    bench.rounds(2);
    CHECK(other->received() == "small\n");
  }
  CHECK(large == 1);
  // It reads at last, and receives the whole answer.
  std::string received;
  for (int i = 0; i < 10'000 && received.size() < 4'000'001; ++i) {
    received += slow->received();
    bench.rounds(1);
  }
  CHECK(received.substr(0, 4'000'001).back() == '\n');
}

TEST_CASE("the peers of a socket that don't read occupy at most its bound", "[os][socket]") {
  Bench bench;
  int large = 0;
  bench.server.listen({.path = bench.path()}, [&](std::string_view, unsigned) {
    ++large;
    return std::string(6'000'000, 'y');
  });
  std::vector<std::unique_ptr<Peer>> peers;
  for (int i = 0; i < 16; ++i) {
    peers.push_back(bench.peer());
    peers.back()->send("large\n");
  }
  bench.rounds(20);
  CHECK(large == 3);  // 16 MiB, and the answer that exceeds it
}

TEST_CASE("a full socket refuses peers until a place is free", "[os][socket]") {
  Bench bench;
  bench.listen({.path = bench.path(), .most_peers = 2});
  auto first = bench.peer();
  const auto second = bench.peer();
  const auto third = bench.peer();
  CHECK(third->closed());
  CHECK_FALSE(second->closed());
  first.reset();
  bench.rounds(2);
  const auto fourth = bench.peer();
  fourth->send("here\n");
  bench.rounds(2);
  CHECK(fourth->received() == "here\n");
}

TEST_CASE("a peer that has stopped sending still receives its answers", "[os][socket]") {
  Bench bench;
  bench.listen({.path = bench.path()});
  const auto peer = bench.peer();
  peer->send("one\ntwo\n");
  peer->end();
  bench.rounds(5);
  CHECK(peer->received() == "one\ntwo\n");
  CHECK(peer->closed());
}

TEST_CASE("lines sent before a hang-up are still executed", "[os][socket]") {
  Bench bench;
  bench.listen({.path = bench.path()});
  auto peer = bench.peer();
  peer->send("order\n");
  peer.reset();
  bench.rounds(3);
  CHECK(bench.count("order") == 1);
}

TEST_CASE("a handler that throws ends only its peer's connection", "[os][socket]") {
  Bench bench;
  bench.server.listen({.path = bench.path()}, [](std::string_view line, unsigned) {
    if (line == "bad") throw std::bad_alloc();
    return std::string(line);
  });
  const auto bad = bench.peer();
  const auto good = bench.peer();
  bad->send("bad\n");
  good->send("good\n");
  bench.rounds(2);
  CHECK(bad->closed());
  CHECK(good->received() == "good\n");
}

TEST_CASE("sockets are opened and closed while others are served", "[os][socket]") {
  Bench bench;
  bench.listen({.path = bench.path("a.sock")});
  bench.listen({.path = bench.path("b.sock")});
  const auto a = bench.peer("a.sock");
  const auto b = bench.peer("b.sock");
  bench.server.close(bench.path("b.sock"));
  CHECK_FALSE(bench.server.listens(bench.path("b.sock")));
  CHECK_FALSE(std::filesystem::exists(bench.path("b.sock")));
  CHECK(b->closed());
  a->send("still here\n");
  bench.rounds(2);
  CHECK(a->received() == "still here\n");
  bench.listen({.path = bench.path("b.sock")});
  CHECK_FALSE(bench.peer("b.sock")->closed());
}

TEST_CASE("a socket belongs to its owner and the owner's group, with any umask", "[os][socket]") {
  Bench bench;
  const mode_t before = umask(0);
  bench.listen({.path = bench.path()});
  const mode_t kept = umask(before);
  CHECK(kept == 0);
  struct stat status {};
  REQUIRE(stat(bench.path().c_str(), &status) == 0);
  CHECK((status.st_mode & 07777U) == 0660U);
}

TEST_CASE("a socket left by a crash is replaced, a served one is not", "[os][socket]") {
  Bench bench;
  loopwarden::tests::write_file(bench.path(), "left over");
  bench.listen({.path = bench.path()});
  CHECK_THROWS_WITH(bench.listen({.path = bench.path()}),
                    Catch::Contains("another daemon already listens"));
  std::filesystem::create_directory(bench.path("folder"));
  CHECK_THROWS_WITH(bench.listen({.path = bench.path("folder")}),
                    Catch::Contains("can't listen at"));
  CHECK_THROWS_WITH(bench.listen({.path = "/" + std::string(200, 'x')}),
                    Catch::Contains("longer than"));
}

}  // namespace local_server_test
