// SPDX-License-Identifier: Apache-2.0
// The real server over loopback, with good and hostile clients.
#include "services/net/http/server.hpp"

#include <catch2/catch.hpp>
#include <zlib.h>

#include <unistd.h>

#include <atomic>
#include <csignal>
#include <future>
#include <new>
#include <stdexcept>
#include <thread>
#include <vector>

#include "services/net/http/response_head.hpp"
#include "tests/services/page/support/failing_memory.hpp"
#include "tests/services/page/support/raw_client.hpp"
#include "tests/support/device/foreign_process.hpp"

namespace loopwarden::tests::server_test {

using namespace http;
using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;
using std::chrono::milliseconds;
using test::eventually;

class Numbers final : public Source {
 public:
  std::string next() override { return n_++ < 3 ? std::string(1000, 'x') : std::string(); }

 private:
  int n_ = 0;
};

// Answers according to the first part of the path.
class Echo final : public Handler {
 public:
  std::atomic<int> waiting{0};  // rounds of "/wait" that have begun
  std::atomic<bool> stay{true};
  std::atomic<int> hanging{0};
  std::promise<void> go;
  std::shared_future<void> open{go.get_future().share()};

  Pool pool(const Request& request) const noexcept override {
    return request.part(0) == "slow"   ? Pool::disk
           : request.part(0) == "busy" ? Pool::daemon
           : request.part(0) == "wait" ? Pool::orders
           : request.part(0) == "act"  ? Pool::orders
                                       : Pool::here;
  }
  Response answer(const Request& request) noexcept override {
    try {
      return made(request);
    } catch (const std::bad_alloc&) {
      return {};
    }
  }

 private:
  Response made(const Request& request) {
    Response response;
    response.content_type = "text/plain";
    if (request.part(0) == "slow") {
      ++hanging;
      open.wait();
    }
    if (request.part(0) == "late") response.delay = milliseconds(300);
    if (request.part(0) == "wait") return round();
    if (request.part(0) == "pieces") response.source = std::make_unique<Numbers>();
    if (request.part(0) == "large") response.body = std::string(8'000'000, 'x');
    if (request.part(0) == "events") response.may_stay = [this] { return stay.load(); };
    if (response.body.empty())
      response.body = "hello " + std::string(request.part(0)) + request.body;
    if (response.may_stay) response.body = "retry: 1000\n\n";
    if (request.part(0) == "starve")
      fail_allocation_after = std::stoi(std::string(request.part(1)));
    return response;
  }

  // Adds another round while `stay` is true.
  Response round() {
    ++waiting;
    Response response;
    response.body = "waited";
    if (!stay) return response;
    response.delay = milliseconds(10);
    response.next = [this] { return round(); };
    return response;
  }
};

ServerSettings quick() {
  ServerSettings settings;
  settings.limits = {
      .clients = 200, .per_address = 50, .loopback = 100, .requests_per_s = 100'000.0};
  // Longer than a slow machine delays a normal client.
  settings.timeouts = {.handshake = milliseconds(2000),
                       .header = milliseconds(2000),
                       .next = milliseconds(2000),
                       .body = milliseconds(2000),
                       .write = milliseconds(2000),
                       .heartbeat = milliseconds(100)};
  return settings;
}

class Running {
 public:
  explicit Running(const ServerSettings& settings = quick()) : server(settings, echo) {
    port = server.listen("127.0.0.1", 0);
    thread_ = std::thread([this] { server.run(); });
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;
  ~Running() {
    if (echo.open.wait_for(milliseconds(0)) != std::future_status::ready) echo.go.set_value();
    server.stop();
    thread_.join();
  }

  RawClient client() const { return RawClient(port); }
  std::string answer(const std::string& request) const {
    RawClient one = client();
    one.send(request);
    return one.rest();
  }

  Echo echo;
  Server server;
  int port = 0;

 private:
  std::thread thread_;
};

std::string unpacked(std::string bytes) {
  z_stream stream{};
  REQUIRE(inflateInit2(&stream, 15 + 16) == Z_OK);
  std::string plain(100'000, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(bytes.data());
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(plain.data());
  stream.avail_out = static_cast<uInt>(plain.size());
  CHECK(inflate(&stream, Z_FINISH) == Z_STREAM_END);
  plain.resize(stream.total_out);
  inflateEnd(&stream);
  return plain;
}

ServerSettings patient() {
  ServerSettings settings = quick();
  settings.timeouts = {};
  return settings;
}

TEST_CASE("requests are answered one after another on one connection") {
  const Running running;
  RawClient client = running.client();
  client.send(get_line("/a") + get_line("/b"));
  CHECK_THAT(client.until("hello a"), StartsWith("HTTP/1.1 200 OK\r\n"));
  CHECK_THAT(client.until("hello b"), Contains("Content-Length: 7\r\n"));
  client.send("POST /c HTTP/1.1\r\nHost: x\r\nContent-Length: 5\r\n\r\n body");
  CHECK_THAT(client.until("hello c body"), Contains("hello c body"));
  client.send("HEAD /d HTTP/1.1\r\nHost: x\r\n\r\n" + get_line("/e", "Connection: close\r\n"));
  const std::string rest = client.rest();
  CHECK_THAT(rest, !Contains("hello d"));
  CHECK_THAT(rest, Contains("hello e"));
  CHECK(client.ended());
}

TEST_CASE("long texts of a pool are compressed for clients that accept it, and are unchanged") {
  const Running running;
  const std::string body(5000, 'x');
  const std::string ask =
      "POST /busy HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\nContent-Length: 5000\r\n";
  const std::string plain = running.answer(ask + "\r\n" + body);
  CHECK_THAT(plain, Contains("Content-Length: 5010") && Contains("Vary: Accept-Encoding") &&
                        !Contains("Content-Encoding") && Catch::EndsWith("hello busy" + body));
  const std::string packed = running.answer(ask + "Accept-Encoding: gzip\r\n\r\n" + body);
  CHECK_THAT(packed, Contains("Content-Encoding: gzip"));
  CHECK(unpacked(packed.substr(packed.find("\r\n\r\n") + 4)) == "hello busy" + body);
  const std::string short_one = running.answer(
      "GET /busy HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\nAccept-Encoding: "
      "gzip\r\n\r\n");
  CHECK_THAT(short_one, !Contains("Content-Encoding") && Catch::EndsWith("hello busy"));
}

TEST_CASE("a body is sent in pieces while it is produced") {
  const Running running;
  const std::string all = running.answer(get_line("/pieces", "Connection: close\r\n"));
  CHECK_THAT(all, Contains("Transfer-Encoding: chunked"));
  CHECK_THAT(all, Contains("\r\n3e8\r\nxxx"));
  CHECK_THAT(all, Catch::Matchers::EndsWith("\r\n0\r\n\r\n"));
}

TEST_CASE("an invalid request is refused and ends the connection") {
  const Running running;
  const auto status = [&](const std::string& text) { return running.answer(text).substr(0, 12); };
  CHECK(status("hello\r\n\r\n") == "HTTP/1.1 400");
  CHECK(status("GET / HTTP/1.1\r\n\r\n") == "HTTP/1.1 400");
  CHECK(status("GET / HTTP/1.0\r\nHost: x\r\n\r\n") == "HTTP/1.1 505");
  CHECK(status("GET /../x HTTP/1.1\r\nHost: x\r\n\r\n") == "HTTP/1.1 400");
  CHECK(status("GET / HTTP/1.1\r\nHost: x\r\nA: " + std::string(20'000, 'a')) == "HTTP/1.1 431");
  CHECK(status("GET / HTTP/1.1\r\nHost: x\r\nA b: c\r\n\r\n") == "HTTP/1.1 400");
  CHECK(status("GET /\r\nX: y HTTP/1.1\r\nHost: x\r\n\r\n") == "HTTP/1.1 400");
}

TEST_CASE("an ambiguous request is refused, never read as two") {
  const Running running;
  const std::string smuggled = get_line("/admin");
  for (const std::string head :
       {"Content-Length: 5\r\nTransfer-Encoding: chunked\r\n",
        "Transfer-Encoding: chunked\r\nContent-Length: 5\r\n", "Transfer-Encoding: chunked\r\n",
        "Transfer-Encoding : chunked\r\n", "Content-Length: 5\r\nContent-Length: 6\r\n",
        "Content-Length: 5\r\n\tfold: x\r\nTransfer-Encoding:\tchunked\r\n",
        "Content-Length: -1\r\n", "Content-Length: 5, 6\r\n", "Transfer-Encoding: xchunked\r\n",
        "transfer-encoding: identity, chunked\r\n"}) {
    CAPTURE(head);
    const std::string all =
        running.answer("POST /a HTTP/1.1\r\nHost: x\r\n" + head + "\r\n0\r\n\r\n" + smuggled);
    CHECK_THAT(all, StartsWith("HTTP/1.1 4"));
    CHECK_THAT(all, !Contains("hello admin"));
  }
}

TEST_CASE("a body of a gigabyte is refused before it is sent") {
  const Running running;
  RawClient client = running.client();
  client.send("POST /a HTTP/1.1\r\nHost: x\r\nContent-Length: 1073741824\r\n\r\n");
  CHECK_THAT(client.until("\r\n"), StartsWith("HTTP/1.1 413"));
  // The body is sent all the same, and is ignored.
  const std::string piece(1'000'000, 'x');
  int sent = 0;
  while (sent < 1000 && client.send(piece)) ++sent;
  CHECK(sent < 100);
  CHECK_THAT(running.answer(get_line("/after", "Connection: close\r\n")), Contains("hello after"));
}

TEST_CASE("a client that sends five megabytes before it reads can read the refusal") {
  const Running running;
  RawClient client = running.client();
  const std::string piece(1'000'000, 'x');
  bool taken = client.send("POST /a HTTP/1.1\r\nHost: x\r\nContent-Length: 5000000\r\n\r\n");
  for (int i = 0; i < 5 && taken; ++i) taken = client.send(piece);
  CHECK(taken);
  CHECK_THAT(client.rest(), StartsWith("HTTP/1.1 413"));
}

TEST_CASE("slow clients are dropped, in every part of a request") {
  const Running running;
  SECTION("the head") {
    RawClient client = running.client();
    client.send("GET / HTT");
    client.rest();
    CHECK(client.ended());
  }
  SECTION("one byte at long intervals") {
    RawClient client = running.client();
    const std::string text = get_line("/a");
    bool taken = true;
    for (std::size_t i = 0; i < text.size() && taken; ++i) {
      taken = client.send(text.substr(i, 1));
      std::this_thread::sleep_for(milliseconds(200));
    }
    CHECK_THAT(client.rest(), !Contains("hello"));
    CHECK(client.ended());
  }
  SECTION("the body") {
    RawClient client = running.client();
    client.send("POST /a HTTP/1.1\r\nHost: x\r\nContent-Length: 5\r\n\r\nab");
    client.rest();
    CHECK(client.ended());
  }
  SECTION("the next request") {
    RawClient client = running.client();
    client.send(get_line("/a"));
    client.until("hello a");
    client.rest();
    CHECK(client.ended());
  }
  SECTION("the answer") {
    const RawClient client(running.port, 4096);
    client.send(get_line("/large"));
    CHECK(eventually([&] { return running.server.counters().timed_out >= 1; }));
  }
  CHECK(eventually([&] { return running.server.counters().connections == 0; }));
}

TEST_CASE("another client is answered while as many as allowed occupy their places") {
  const Running running(patient());
  std::vector<RawClient> slow;
  for (int i = 0; i < 100; ++i) {
    slow.push_back(running.client());
    slow.back().send("GET / HTTP/1.1\r\nHost: x\r\nX-Slow: ");
  }
  REQUIRE(eventually([&] { return running.server.counters().connections == 100; }));
  for (int i = 0; i < 50; ++i) {
    CHECK_THAT(running.answer(get_line("/good", "Connection: close\r\n")), Contains("hello good"));
  }
  CHECK(running.server.counters().connections <= 100);
  CHECK(running.server.counters().displaced > 0);
}

TEST_CASE("work that hangs occupies only its pool's threads") {
  Running running(patient());
  std::vector<RawClient> waiting;
  const auto wait_for_slow = [&] {
    waiting.push_back(running.client());
    waiting.back().send(get_line("/slow"));
  };
  // The pool's threads are occupied first, because a late one would make room in the full queue.
  for (int i = 0; i < 2; ++i) wait_for_slow();
  REQUIRE(eventually([&] { return running.echo.hanging == 2; }));
  for (int i = 0; i < 58; ++i) wait_for_slow();
  CHECK_THAT(running.answer(get_line("/good", "Connection: close\r\n")), Contains("hello good"));
  CHECK_THAT(running.answer(get_line("/busy", "Connection: close\r\n")), Contains("hello busy"));
  RawClient late = running.client();
  CHECK(eventually([&] { return running.server.counters().requests >= 62; }));
  late.send(get_line("/slow"));
  const std::string answer = late.until("\r\n\r\n");
  CHECK_THAT(answer, StartsWith("HTTP/1.1 503"));
  CHECK_THAT(answer, Contains("Retry-After: 1"));
  running.echo.go.set_value();
  CHECK_THAT(waiting.front().until("hello slow"), Contains("hello slow"));
}

TEST_CASE("an answer that waits in rounds occupies no thread of its pool") {
  Running running(patient());
  std::vector<RawClient> waiting;
  // More than the pool's threads, and few enough for the limit of one address in the queue.
  for (int i = 0; i < 6; ++i) {
    waiting.push_back(running.client());
    waiting.back().send(get_line("/wait", "Connection: close\r\n"));
  }
  // All requests continue their rounds, not only as many as the pool has threads.
  REQUIRE(eventually([&] { return running.echo.waiting > 100; }));
  CHECK_THAT(running.answer(get_line("/act", "Connection: close\r\n")), Contains("hello act"));
  running.echo.stay = false;
  for (RawClient& client : waiting) CHECK_THAT(client.rest(), Catch::Matchers::EndsWith("waited"));
}

TEST_CASE("a delayed answer occupies no thread") {
  const Running running(patient());
  std::vector<RawClient> late;
  for (int i = 0; i < 90; ++i) {
    late.push_back(running.client());
    late.back().send(get_line("/late"));
  }
  CHECK_THAT(running.answer(get_line("/good", "Connection: close\r\n")), Contains("hello good"));
  for (RawClient& client : late) CHECK_THAT(client.until("hello late"), Contains("hello late"));
}

TEST_CASE("too many requests of one address are refused with a time to wait") {
  ServerSettings settings = patient();
  settings.limits.requests_per_s = 5.0;
  const Running running(settings);
  RawClient client = running.client();
  std::string all;
  // A burst of a hundred is allowed. The other requests can't all be admitted in time.
  for (int i = 0; i < 300; ++i) client.send(get_line("/a"));
  all = client.rest();
  CHECK_THAT(all, Contains("HTTP/1.1 429"));
  CHECK_THAT(all, Contains("Retry-After: "));
}

TEST_CASE(
    "events are sent to all listeners; one that doesn't read is dropped, and doesn't delay "
    "others") {
  Running running;
  RawClient good = running.client();
  good.send(get_line("/events"));
  CHECK_THAT(good.until("retry: 1000\n\n"),
             Contains("text/event-stream") || Contains("text/plain"));
  const RawClient deaf(running.port, 4096);
  deaf.send(get_line("/events"));
  REQUIRE(eventually([&] { return running.server.counters().streams == 2; }));
  const std::string large(1'000'000, 'x');
  int heard = 0;
  for (int i = 0; i < 100 && running.server.counters().streams == 2; ++i) {
    running.server.publish(EventKind::overview,
                           "{\"n\":" + std::to_string(i) + ",\"x\":\"" + large + "\"}");
    if (good.until("\"}\n\n").find("\"n\":" + std::to_string(i)) != std::string::npos) ++heard;
    std::this_thread::sleep_for(milliseconds(10));
  }
  CHECK(heard > 5);
  CHECK(eventually([&] { return running.server.counters().streams == 1; }));
  running.server.publish(EventKind::alarms, "[]");
  CHECK_THAT(good.until("event: alarms\ndata: []\n\n"), Contains("event: alarms"));
  SECTION("a heartbeat while no event happens") {
    CHECK_THAT(good.until(":\n\n"), Contains(":\n\n"));
  }
  SECTION("it ends when its session does") {
    running.echo.stay = false;
    CHECK_THAT(good.rest(), Catch::Matchers::EndsWith("event: ended\ndata: {}\n\n"));
    CHECK(good.ended());
  }
}

TEST_CASE("a stream ends at the notice that its session has ended, before its heartbeat") {
  ServerSettings settings = patient();
  settings.timeouts.heartbeat = settings.timeouts.streams = std::chrono::hours(1);
  Running running(settings);
  RawClient stream = running.client();
  stream.send(get_line("/events"));
  stream.until("retry: 1000\n\n");
  RawClient another = running.client();
  another.send(get_line("/events"));
  another.until("retry: 1000\n\n");
  REQUIRE(eventually([&] { return running.server.counters().streams == 2; }));
  running.server.look_at_streams();
  running.server.publish(EventKind::alarms, "[1]");
  CHECK_THAT(stream.until("data: [1]\n\n"), !Contains("ended"));
  running.echo.stay = false;
  running.server.look_at_streams();
  CHECK_THAT(stream.rest(), Catch::Matchers::EndsWith("event: ended\ndata: {}\n\n"));
  CHECK(stream.ended());
  another.rest();
  CHECK(another.ended());
  CHECK(eventually([&] { return running.server.counters().streams == 0; }));
}

TEST_CASE("work that throws is repeated for the next request, and the server continues") {
  Echo echo;
  Server server(quick(), echo);
  std::atomic<int> ticks{0};
  std::atomic<int> signals{0};
  const auto throwing = [](std::atomic<int>& count) {
    if (++count < 3) throw std::runtime_error("for the test");
  };
  server.every(milliseconds(5), [&] { throwing(ticks); });
  server.on_signal(SIGUSR2, [&] { throwing(signals); });
  const int port = server.listen("127.0.0.1", 0);
  std::thread thread([&] { server.run(); });
  CHECK(eventually([&] { return ticks > 5; }));
  for (int n = 1; n < 5; ++n) {
    ::kill(::getpid(), SIGUSR2);
    CHECK(eventually([&] { return signals == n; }));
  }
  RawClient client(port);
  client.send(get_line("/a", "Connection: close\r\n"));
  CHECK_THAT(client.rest(), Contains("hello a"));
  server.stop();
  thread.join();
}

TEST_CASE("after any failed allocation the next client is answered") {
  Running running(patient());
  int answered = 0;
  const int before = allocations_failed;
  for (int n = 0; n < 60; ++n) {
    CAPTURE(n);
    // One allocation of the loop's thread fails, n allocations later: in the answer, or in the work
    // for the next clients.
    running.answer(get_line("/starve/" + std::to_string(n), "Connection: close\r\n"));
    for (int i = 0; i < 3; ++i) running.answer(get_line("/a", "Connection: close\r\n"));
    running.answer(get_line("/starve/-1", "Connection: close\r\n"));
    const std::string last = running.answer(get_line("/a", "Connection: close\r\n"));
    answered += last.find("hello a") != std::string::npos ? 1 : 0;
  }
  CHECK(answered == 60);
  CHECK(allocations_failed - before > 50);
  CHECK(eventually([&] { return running.server.counters().connections == 0; }));
}

TEST_CASE("streams leave places for plain requests") {
  ServerSettings settings = patient();
  settings.limits.clients = 16;
  settings.limits.loopback = 8;
  const Running running(settings);
  std::vector<RawClient> listening;
  for (int i = 0; i < 7; ++i) {
    listening.push_back(running.client());
    listening.back().send(get_line("/events"));
    listening.back().until("\r\n\r\n");
  }
  CHECK(running.server.counters().streams == 6);
  CHECK_THAT(running.answer(get_line("/good", "Connection: close\r\n")), Contains("hello good"));
}

TEST_CASE("a server ends with clients in all states") {
  std::vector<RawClient> clients;
  {
    Running running(patient());
    for (const char* path : {"/events", "/slow", "/late", "/large", "/a"}) {
      clients.emplace_back(running.port);
      clients.back().send(get_line(path));
    }
    clients.emplace_back(running.port);
    CHECK(eventually([&] { return running.server.counters().requests == 5; }));
  }
  for (RawClient& client : clients) client.rest();
  CHECK(clients.front().ended());
}

}  // namespace loopwarden::tests::server_test
