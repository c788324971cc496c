// SPDX-License-Identifier: Apache-2.0
// Both ends of the specification's rules: the edge node's session and the host's view of it.
#include <catch2/catch.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fleet/sparkplug/alias_table.hpp"
#include "fleet/sparkplug/edge_session.hpp"
#include "fleet/sparkplug/host_state.hpp"
#include "fleet/sparkplug/node_view.hpp"
#include "fleet/sparkplug/sequence.hpp"
#include "tests/support/property.hpp"

namespace session_test {

using namespace loopwarden::sparkplug;
namespace property = loopwarden::tests::property;
using Next = EdgeSession::Next;
using State = EdgeSession::State;

Metric metric(std::string name, std::uint64_t alias, DataType type, Value value) {
  Metric m;
  m.name = std::move(name);
  m.alias = alias;
  m.type = type;
  m.value = std::move(value);
  return m;
}

Metric bd_seq(std::uint64_t number) {
  Metric m = metric("bdSeq", 0, DataType::int64, static_cast<std::int64_t>(number));
  m.alias.reset();
  return m;
}

Topic topic(MessageType type, std::string device = "") {
  return {"g", type, "e", std::move(device)};
}

TEST_CASE("seq runs from 0 in a birth to 255 and on from 0", "[sparkplug]") {
  Sequence seq;
  CHECK(seq.restart() == 0);
  for (unsigned i = 1; i <= 255; ++i) REQUIRE(seq.next() == i);
  CHECK(seq.next() == 0);
  CHECK(seq.next() == 1);
  CHECK(seq.restart() == 0);
  CHECK(seq.next() == 1);
}

TEST_CASE("bdSeq counts connections from 0 to 255 and on from 0, over restarts", "[sparkplug]") {
  EdgeSession first(false, std::nullopt);
  CHECK(first.connecting() == 0);
  CHECK(first.connecting() == 1);
  EdgeSession later(false, std::uint8_t{255});
  CHECK(later.connecting() == 0);
  CHECK(later.bd_seq() == 0);
}

TEST_CASE("without a primary host births follow the connection", "[sparkplug]") {
  EdgeSession session(false, std::nullopt);
  session.connecting();
  CHECK_FALSE(session.live());
  CHECK(session.rebirth_asked() == Next::nothing);
  CHECK(session.connected() == Next::births);
  CHECK(session.live());
  CHECK(session.host_said({false, 5}) == Next::nothing);
  CHECK(session.rebirth_asked() == Next::births);
  CHECK(session.bd_seq() == 0);
  session.disconnected();
  CHECK(session.state() == State::offline);
}

TEST_CASE("with a primary host births wait until it is online, and it leaves when it goes",
          "[sparkplug]") {
  EdgeSession session(true, std::nullopt);
  session.connecting();
  CHECK(session.connected() == Next::nothing);
  CHECK(session.state() == State::waiting_for_host);
  CHECK(session.rebirth_asked() == Next::nothing);
  CHECK(session.host_said({false, 1}) == Next::nothing);
  CHECK(session.host_said({true, 2}) == Next::births);
  CHECK(session.live());
  CHECK(session.host_said({true, 3}) == Next::nothing);
  // The will of the connection before: older than what is known.
  CHECK(session.host_said({false, 2}) == Next::nothing);
  CHECK(session.live());
  CHECK(session.host_said({false, 3}) == Next::leave);
  CHECK_FALSE(session.live());
  // The next connection hears the retained word again, of the same time.
  CHECK(session.connecting() == 1);
  CHECK(session.connected() == Next::nothing);
  CHECK(session.host_said({false, 3}) == Next::nothing);
  CHECK(session.host_said({true, 4}) == Next::births);
}

TEST_CASE("a host's word may come before the subscription is granted", "[sparkplug]") {
  EdgeSession session(true, std::nullopt);
  session.connecting();
  CHECK(session.host_said({true, 1}) == Next::nothing);
  CHECK_FALSE(session.live());
  CHECK(session.connected() == Next::births);
  session.disconnected();
  // Of an older connection: it has to be said again.
  session.connecting();
  CHECK(session.connected() == Next::nothing);
}

TEST_CASE("a host's word is an object with online and timestamp", "[sparkplug]") {
  CHECK(to_text(HostState{true, 7}) == R"({"online":true,"timestamp":7})");
  CHECK(parse_host_state(R"({"online":false,"timestamp":7})") == HostState{false, 7});
  for (const char* text :
       {"", "ONLINE", "[]", "{}", R"({"online":1,"timestamp":7})", R"({"online":true})",
        R"({"online":true,"timestamp":-1})", R"({"online":true,"timestamp":"7"})"}) {
    INFO(text);
    CHECK_FALSE(parse_host_state(text));
  }
}

TEST_CASE("an alias stands for one metric of the whole node", "[sparkplug]") {
  AliasTable table;
  table.take_birth("", {metric("a", 1, DataType::int8, {})});
  table.take_birth("d", {metric("a", 2, DataType::int16, {})});
  CHECK(table.find(2)->device == "d");
  CHECK(table.find("d", "a")->type == DataType::int16);
  CHECK_THROWS_AS(table.take_birth("e", {metric("b", 2, DataType::int8, {})}), BadPayload);
  CHECK(table.find("e", "b") == nullptr);
  CHECK_THROWS_AS(table.take_birth("d", {metric("b", 5, DataType::int8, {}),
                                         metric("b", 6, DataType::int8, {})}),
                  BadPayload);
  CHECK(table.find(2) == nullptr);
  CHECK(table.find(5) == nullptr);
  CHECK_THROWS_AS(table.take_birth("d", {metric("", 7, DataType::int8, {})}), BadPayload);
  CHECK_THROWS_AS(table.take_birth("d", {metric("b", 7, DataType::unknown, {})}), BadPayload);
  table.take_birth("d", {metric("b", 7, DataType::int16, {})});
  std::vector<Metric> data{metric("", 7, DataType::unknown, std::uint64_t{0xFFFFFFFF})};
  CHECK(table.resolve("d", data));
  CHECK(data[0].name == "b");
  CHECK(data[0].value == Value(std::int64_t{-1}));
  data = {metric("", 7, DataType::unknown, {})};
  CHECK_FALSE(table.resolve("", data));  // of another device
  data = {metric("none", 7, DataType::unknown, {})};
  CHECK_FALSE(table.resolve("d", data));
  table.take_birth("", {metric("a", 7, DataType::int8, {})});  // takes the devices away
  CHECK(table.find("d", "b") == nullptr);
}

struct Host {
  NodeView view;
  Verdict take(MessageType type, std::optional<std::uint64_t> seq, std::vector<Metric> metrics,
               std::string device = "") {
    Payload payload{.time_ms = 1, .seq = seq, .metrics = std::move(metrics)};
    const Verdict verdict = view.take(topic(type, std::move(device)), payload);
    last = payload;
    return verdict;
  }
  Payload last;
};

TEST_CASE("a host follows a node from birth to death", "[sparkplug]") {
  Host host;
  CHECK(host.take(MessageType::ndata, 4, {}).ask_rebirth);
  CHECK(host.take(MessageType::nbirth, 0, {bd_seq(3), metric("x", 1, DataType::int8, {})}).usable);
  CHECK(host.view.online());
  CHECK(host.view.bd_seq() == 3);
  CHECK(host.take(MessageType::dbirth, 1, {metric("pv", 2, DataType::float32, 1.0)}, "d").usable);
  CHECK(host.view.online("d"));
  const Verdict data =
      host.take(MessageType::ddata, 2, {metric("", 2, DataType::unknown, 2.0)}, "d");
  CHECK((data.usable && !data.ask_rebirth));
  CHECK(host.last.metrics[0].name == "pv");
  CHECK(host.take(MessageType::ddeath, 3, {}, "d").usable);
  CHECK_FALSE(host.view.online("d"));
  CHECK(host.take(MessageType::ddata, 4, {}, "d").ask_rebirth);
  // The will of an older connection: this one lives.
  CHECK_FALSE(host.take(MessageType::ndeath, std::nullopt, {bd_seq(2)}).usable);
  CHECK(host.view.online());
  CHECK(host.take(MessageType::ndeath, std::nullopt, {bd_seq(3)}).usable);
  CHECK_FALSE(host.view.online());
  CHECK_FALSE(host.take(MessageType::ncmd, std::nullopt, {}).usable);
}

TEST_CASE("a host uses what it can read of a broken sequence, and asks for a rebirth once",
          "[sparkplug]") {
  Host host;
  host.take(MessageType::nbirth, 0, {bd_seq(0), metric("x", 1, DataType::int8, {})});
  const Verdict gap =
      host.take(MessageType::ndata, 2, {metric("", 1, DataType::unknown, std::uint64_t{1})});
  CHECK((gap.usable && gap.ask_rebirth));
  CHECK_FALSE(host.take(MessageType::ndata, 3, {}).ask_rebirth);
  CHECK(host.take(MessageType::ndata, 4, {metric("", 9, DataType::unknown, {})}).ask_rebirth);
  CHECK(host.take(MessageType::ndata, std::nullopt, {}).ask_rebirth);
  CHECK(host.take(MessageType::nbirth, 1, {bd_seq(0)}).ask_rebirth);
  CHECK_FALSE(host.view.online());
  CHECK(host.take(MessageType::nbirth, 0, {}).ask_rebirth);
  CHECK_THROWS_AS(host.take(MessageType::nbirth, 0, {bd_seq(0), bd_seq(0)}), BadPayload);
}

TEST_CASE("whatever happens, a host that sees every message never misses one", "[sparkplug]") {
  property::for_all("no gap", 200, [] {
    EdgeSession edge(property::coin(), static_cast<std::uint8_t>(property::integer(0, 255)));
    Host host;
    std::uint64_t time = 1;
    const auto births = [&](Next next) {
      if (next != Next::births) return;
      property::require(
          !host.take(MessageType::nbirth, edge.birth_seq(), {bd_seq(edge.bd_seq())}).ask_rebirth,
          "an NBIRTH");
      property::require(!host.take(MessageType::dbirth, edge.next_seq(), {}, "d").ask_rebirth,
                        "a DBIRTH");
    };
    for (int step = 0; step < 400; ++step) {
      switch (property::one_of(6)) {
        case 0:
          edge.disconnected();
          if (host.view.bd_seq()) host.take(MessageType::ndeath, {}, {bd_seq(*host.view.bd_seq())});
          edge.connecting();
          births(edge.connected());
          break;
        case 1: births(edge.host_said({property::coin(), ++time})); break;
        case 2: births(edge.rebirth_asked()); break;
        default:
          if (edge.live()) {
            const Verdict v = host.take(MessageType::ddata, edge.next_seq(), {}, "d");
            property::require(v.usable && !v.ask_rebirth, "data");
          }
      }
    }
  });
}

}  // namespace session_test
