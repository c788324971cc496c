// SPDX-License-Identifier: Apache-2.0
#include "services/net/mqtt/client.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/mqtt_broker.hpp"

namespace client_test {

using namespace loopwarden;
using namespace std::chrono_literals;
using mqtt::Client;
using mqtt::ClientSettings;
using mqtt::Event;
using mqtt::Message;
using mqtt::Qos;
using Kind = Event::Kind;
using tests::MqttBroker;

ClientSettings settings(int port, std::string id = "test") {
  ClientSettings s;
  s.broker = {"127.0.0.1", static_cast<std::uint16_t>(port), false};
  s.client_id = std::move(id);
  s.keep_alive = 5s;
  s.reconnect_min = 50ms;
  s.reconnect_max = 200ms;
  return s;
}

// Returns the next event of that kind, and skips other events.
std::optional<Event> await(Client& client, Kind kind, std::chrono::seconds patience = 30s) {
  const auto end = std::chrono::steady_clock::now() + patience;
  while (std::chrono::steady_clock::now() < end) {
    for (Event& event : client.events(100ms)) {
      if (event.kind == kind) return std::move(event);
    }
  }
  return std::nullopt;
}

TEST_CASE("messages sent to the broker are received again", "[mqtt]") {
  std::signal(SIGPIPE, SIG_IGN);
  MqttBroker broker;
  ClientSettings wanted = settings(broker.port());
  wanted.subscriptions = {{"a/+", Qos::at_least_once}, {"b", Qos::at_most_once}};
  Client client(wanted);
  CHECK_FALSE(client.publish({"a/1", "early"}));
  client.connect(std::nullopt);
  REQUIRE(await(client, Kind::connected));
  CHECK(client.publish({"a/1", std::string("\0x", 2), Qos::at_least_once, false}));
  const auto message = await(client, Kind::message);
  REQUIRE(message);
  CHECK(message->message.topic == "a/1");
  CHECK(message->message.payload == std::string("\0x", 2));
  CHECK(message->message.qos == Qos::at_least_once);
  CHECK_FALSE(message->message.retain);
}

TEST_CASE("the broker publishes the will only of a client that left without a goodbye", "[mqtt]") {
  MqttBroker broker;
  ClientSettings wanted = settings(broker.port(), "watcher");
  wanted.subscriptions = {{"#", Qos::at_least_once}};
  Client watcher(wanted);
  watcher.connect(std::nullopt);
  REQUIRE(await(watcher, Kind::connected));
  auto gone = std::make_unique<Client>(settings(broker.port(), "gone"));
  gone->connect(Message{"will", "first", Qos::at_least_once, false});
  REQUIRE(await(*gone, Kind::connected));
  gone->leave();
  REQUIRE(await(*gone, Kind::disconnected));
  CHECK_FALSE(gone->connected());
  gone->connect(Message{"will", "second", Qos::at_least_once, false});
  REQUIRE(await(*gone, Kind::connected));
  gone.reset();
  const auto will = await(watcher, Kind::message);
  REQUIRE(will);
  CHECK(will->message.payload == "second");
}

TEST_CASE("after a goodbye with unconfirmed messages they arrive, and the will is not published",
          "[mqtt]") {
  MqttBroker broker;
  ClientSettings wanted = settings(broker.port(), "watcher");
  wanted.subscriptions = {{"#", Qos::at_least_once}};
  Client watcher(wanted);
  watcher.connect(std::nullopt);
  REQUIRE(await(watcher, Kind::connected));
  Client client(settings(broker.port(), "leaves"));
  constexpr int kTimes = 20;
  constexpr int kMessages = 20;
  for (int time = 0; time < kTimes; ++time) {
    client.connect(Message{"will", "", Qos::at_least_once, false});
    REQUIRE(await(client, Kind::connected));
    for (int i = 0; i < kMessages; ++i) {
      REQUIRE(client.publish({"said", std::string(1000, 'x'), Qos::at_least_once, false}));
    }
    client.leave();
    CHECK_FALSE(client.publish({"late", "", Qos::at_least_once, false}));
    REQUIRE(await(client, Kind::disconnected));
  }
  client.connect(std::nullopt);
  REQUIRE(await(client, Kind::connected));
  REQUIRE(client.publish({"end", "", Qos::at_least_once, false}));
  std::map<std::string, int> heard;
  const auto end = std::chrono::steady_clock::now() + 30s;
  while (heard["end"] == 0 && std::chrono::steady_clock::now() < end) {
    for (const Event& event : watcher.events(100ms)) ++heard[event.message.topic];
  }
  CHECK(heard["said"] == kTimes * kMessages);
  CHECK(heard["will"] == 0);
  CHECK(heard["late"] == 0);
  CHECK(heard["end"] == 1);
}

TEST_CASE("a broker that dies is noticed, and reconnected when it returns", "[mqtt]") {
  MqttBroker broker;
  Client client(settings(broker.port()));
  client.connect(std::nullopt);
  REQUIRE(await(client, Kind::connected));
  broker.kill();
  REQUIRE(await(client, Kind::disconnected));
  CHECK_FALSE(client.publish({"a", ""}));
  client.connect(std::nullopt);
  const auto refused = await(client, Kind::disconnected);
  REQUIRE(refused);
  CHECK_THAT(refused->why, Catch::Contains("refused"));
  broker.start();
  bool back = false;
  for (int attempt = 0; attempt < 20 && !back; ++attempt) {
    client.connect(std::nullopt);
    back = await(client, Kind::connected, 2s).has_value();
  }
  CHECK(back);
}

TEST_CASE("the connection to a broker that accepts and never answers ends by keep-alive",
          "[mqtt]") {
  const tests::SilentBroker silent;
  Client client(settings(silent.port()));
  client.connect(std::nullopt);
  const auto given_up = await(client, Kind::disconnected, 60s);
  REQUIRE(given_up);
  CHECK_FALSE(given_up->why.empty());
}

TEST_CASE(
    "a broker that hangs blocks no caller: excess messages are refused, then the connection ends",
    "[mqtt]") {
  MqttBroker broker;
  ClientSettings wanted = settings(broker.port());
  wanted.most_waiting = 8;
  Client client(wanted);
  client.connect(std::nullopt);
  REQUIRE(await(client, Kind::connected));
  broker.hang();
  const std::string large(1'000'000, 'x');
  int taken = 0;
  while (taken < 1000 && client.publish({"a", large})) ++taken;
  CHECK(taken < 1000);
  CHECK(client.waiting() == 8);
  REQUIRE(await(client, Kind::disconnected, 60s));
  CHECK(client.waiting() == 0);
  broker.go_on();
}

TEST_CASE("a goodbye to a broker that hangs also ends", "[mqtt]") {
  MqttBroker broker;
  Client client(settings(broker.port()));
  client.connect(std::nullopt);
  REQUIRE(await(client, Kind::connected));
  broker.hang();
  const bool unconfirmed = GENERATE(false, true);
  if (unconfirmed) REQUIRE(client.publish({"a", "", Qos::at_least_once, false}));
  client.leave();
  CHECK(await(client, Kind::disconnected, 60s));
  broker.go_on();
}

TEST_CASE("a wrong password is refused, with the reason", "[mqtt]") {
  const tests::TemporaryFolder folder;
  REQUIRE(
      tests::run("mosquitto_passwd -b -c " + (folder / "passwords").string() + " box right 2>&1")
          .exit_code == 0);
  tests::write_file(folder / "acl", "user box\ntopic write out\ntopic read in\n");
  tests::write_file(folder / "right", "right\n");
  tests::write_file(folder / "wrong", "wrong\n");
  MqttBroker broker("allow_anonymous false\npassword_file " + (folder / "passwords").string() +
                    "\nacl_file " + (folder / "acl").string() + "\n");
  ClientSettings wanted = settings(broker.port());
  wanted.user = "box";
  wanted.subscriptions = {{"in", Qos::at_least_once}};
  const auto outcome = [&](const char* password) {
    wanted.password.file = folder / password;
    Client client(wanted);
    client.connect(std::nullopt);
    for (;;) {
      for (Event& event : client.events(30s)) return event;
    }
  };
  CHECK(outcome("right").kind == Kind::connected);
  CHECK_THAT(outcome("wrong").why, Catch::Contains("not authorised"));
  CHECK_THAT(outcome("none").why, Catch::Contains("can't be read"));
}

// Mosquitto grants every subscription and filters later. Other brokers refuse it.
TEST_CASE("a refused subscription ends the connection", "[mqtt]") {
  const tests::SilentBroker broker;
  ClientSettings wanted = settings(broker.port());
  wanted.subscriptions = {{"secret/#", Qos::at_least_once}};
  Client client(wanted);
  client.connect(std::nullopt);
  const int peer = ::accept(broker.fd(), nullptr, nullptr);
  std::array<unsigned char, 64> heard{};
  const auto hear = [&](unsigned char type) {
    const auto bytes = ::recv(peer, heard.data(), heard.size(), 0);
    REQUIRE(bytes > 4);
    REQUIRE(heard[0] == type);
  };
  const auto say = [&](std::array<unsigned char, 5> bytes, std::size_t count) {
    REQUIRE(::send(peer, bytes.data(), count, 0) == static_cast<ssize_t>(count));
  };
  hear(0x10);                                   // CONNECT
  say({0x20, 2, 0, 0}, 4);                      // CONNACK
  hear(0x82);                                   // SUBSCRIBE
  say({0x90, 3, heard[2], heard[3], 0x80}, 5);  // SUBACK: failure
  const auto refused = await(client, Kind::disconnected);
  ::close(peer);
  REQUIRE(refused);
  CHECK(refused->why == "the broker refuses a subscription");
}

TEST_CASE("TLS: both sides show a certificate, and one that the authority did not sign is refused",
          "[mqtt]") {
  const tests::Certificates certificates;
  MqttBroker broker(certificates.broker_lines());
  ClientSettings wanted = settings(broker.port());
  wanted.broker.tls = true;
  const auto outcome = [](const ClientSettings& s) {
    Client client(s);
    client.connect(std::nullopt);
    for (;;) {
      for (Event& event : client.events(30s)) return event.kind;
    }
  };
  wanted.ca_file = certificates.file("ca.crt");
  CHECK(outcome(wanted) == Kind::disconnected);  // no client certificate
  wanted.certificate_file = certificates.file("client.crt");
  wanted.key.file = certificates.file("client.key");
  CHECK(outcome(wanted) == Kind::connected);
  wanted.ca_file = certificates.file("other.crt");
  CHECK(outcome(wanted) == Kind::disconnected);
  wanted.ca_file = certificates.file("none.crt");
  CHECK(outcome(wanted) == Kind::disconnected);
  wanted.ca_file = certificates.file("ca.crt");
  wanted.broker.host = "localhost";  // a name that is not in the server's certificate
  CHECK(outcome(wanted) == Kind::disconnected);
}

}  // namespace client_test
