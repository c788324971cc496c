// SPDX-License-Identifier: Apache-2.0
#include "config/modbus_server_reader.hpp"

#include <fmt/format.h>

#include <array>
#include <optional>
#include <utility>

#include "config/byte_orders.hpp"
#include "config/serial_line_reader.hpp"

namespace loopwarden::config {
namespace {

using LossAction = ModbusServer::LossAction;

constexpr auto kLossActions =
    std::to_array<Choice<LossAction>>({{"report", LossAction::report},
                                       {"manual", LossAction::manual},
                                       {"automatic", LossAction::automatic}});

void read_client(MapReader& in, ModbusServer& server) {
  const Value<std::string> peer =
      in.need_text("peer", "IPv4 or IPv6 address, or network such as 192.168.10.0/24");
  const bool may_write =
      in.flag("writes", "may write, if modbus_server.writes is true as well", false);
  if (!peer.given || !peer.valid) return;
  const std::optional<base::Network> network = base::parse_network(peer.value);
  if (!network) {
    in.error("peer",
             fmt::format(
                 "must be a numeric address, or a network without bits after its length (got '{}')",
                 quotable(peer.value)));
    return;
  }
  server.clients.push_back({*network, may_write});
}

void read_heartbeat(MapReader& in, ModbusServer& server) {
  server.master_timeout_s = in.need_number(
      "timeout", {"s", between(0.5, 3600.0),
                  "longest time without a new number in master_heartbeat, after the first one"});
  in.set_one_of(
      "action", kLossActions,
      "report: a bit and a line in the journal; manual: every loop to manual, its output stays; "
      "automatic: every loop to automatic on its last set point",
      server.on_master_loss);
}

void read_serial(MapReader& in, ModbusServer& server) {
  ModbusServer::Serial serial;
  read_serial_line(in, serial.line);
  in.set_integer("unit", {1, 247, "", "unit identifier on this line"}, serial.unit);
  serial.writes = in.flag(
      "writes", "masters on this line may write, if modbus_server.writes is true as well", false);
  server.serial = std::move(serial);
}

}  // namespace

ModbusServer read_modbus_server(MapReader& in) {
  ModbusServer server;
  const Value<std::string> address = in.text(
      "address", "numeric address to listen at; 0.0.0.0: every IPv4 network", server.address);
  server.address = address;
  if (address.given && address.valid && !base::is_address(address.value)) {
    in.error("address",
             fmt::format("must be a numeric address (got '{}')", quotable(address.value)));
  }
  in.set_integer("port", {1, 65535, "", "TCP port; below 1024 needs CAP_NET_BIND_SERVICE"},
                 server.port);
  in.set_integer("unit", {1, 247, "", "unit identifier; 0 and 255 are answered as well"},
                 server.unit);
  in.set_one_of("word_order", kByteOrders,
                "of 32-bit values, in either case; abcd: most significant first", server.word_order,
                {.any_case = true});
  in.set_integer(
      "max_clients",
      {1, 500, "",
       "connections; if all are in use, a new one replaces the one that was silent for longest"},
      server.most_clients);
  in.set_number("idle_timeout", {"s", between(1.0, 86400.0), "time without a valid request"},
                server.idle_timeout_s);
  in.set_number("request_rate",
                {"1/s", between(1.0, 10000.0), "limit per client; further requests wait"},
                server.requests_per_second);
  in.set_flag("writes",
              "true: clients may write if their entry permits it; false: all writes are refused",
              server.writes);
  const bool listed = in.given("clients");
  for (MapReader& client :
       in.maybe_list("clients", "permitted clients; default: this host only, without writes")) {
    read_client(client, server);
  }
  if (!listed) {
    server.clients = {{*base::parse_network("127.0.0.1"), false},
                      {*base::parse_network("::1"), false}};
  }
  in.maybe_section("master_heartbeat", "reaction to a silent master that leads the loops",
                   [&](MapReader& heartbeat) { read_heartbeat(heartbeat, server); });
  in.maybe_section("serial", "the same map on a serial line, as a Modbus RTU slave",
                   [&](MapReader& serial) { read_serial(serial, server); });
  return server;
}

Alarms read_alarms(MapReader& in) {
  constexpr double kHour = 3600.0 * 1000.0;  // ms
  Alarms alarms;
  alarms.settings.latching =
      in.flag("latching", "a cleared alarm stays on until it is reset", false);
  alarms.settings.shelve_limit_ms =
      static_cast<std::int64_t>(kHour * in.number("shelve_limit",
                                                  {"h",
                                                   {.low = 0.0, .high = 24.0, .low_is_open = true},
                                                   "longest time that an alarm may be shelved"},
                                                  8.0));
  in.set_number(
      "severe",
      {"% of CO span", between(0.0, 100.0),
       "a valve fault of this size is out of specification (NE 107), a smaller one maintenance"},
      alarms.severe_percent);
  in.set_integer(
      "evidence",
      {0, 100'000, "", "number of newest alarms whose evidence is kept, about 200 kB each"},
      alarms.most_evidence);
  return alarms;
}

}  // namespace loopwarden::config
