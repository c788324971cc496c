// SPDX-License-Identifier: Apache-2.0
#include "daemon/gateway/modbus_answer.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <initializer_list>
#include <vector>

namespace loopwarden::daemon::gateway::modbus_answer_test {
namespace {

using registers::Table;
using Bytes = std::vector<std::uint8_t>;

// 100 addresses in each table. A read returns the address itself, for bits its lowest bit.
class CountingBank final : public RegisterBank {
 public:
  Exception read(Table table, std::uint16_t address, std::span<std::uint16_t> values) override {
    if (address + values.size() > size) return Exception::illegal_address;
    const bool bits = table == Table::coil || table == Table::discrete_input;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto at = static_cast<std::uint16_t>(address + i);
      values[i] = bits ? at & 1U : at;
    }
    tables.push_back(table);
    return Exception::none;
  }
  Exception write(Table table, std::uint16_t address, std::span<const std::uint16_t> values,
                  const Peer& peer) override {
    if (address + values.size() > size) return Exception::illegal_address;
    tables.push_back(table);
    written_at = address;
    written.assign(values.begin(), values.end());
    by = peer.name;
    return Exception::none;
  }
  std::size_t size = 0x10000;
  std::vector<Table> tables;
  std::uint16_t written_at = 0;
  std::vector<std::uint16_t> written;
  std::string by;
};

Bytes ask(CountingBank& bank, Bytes request, bool may_write = true) {
  const DeviceIdentity identity{.revision = "1.2.3"};
  const Pdu pdu = answer(request, bank, identity, {"master", may_write});
  return {pdu.view().begin(), pdu.view().end()};
}

}  // namespace

TEST_CASE("the specification's requests, byte for byte", "[gateway][pdu]") {
  CountingBank bank;
  // Registers: high byte first.
  CHECK(ask(bank, {3, 0x01, 0x02, 0, 2}) == Bytes{3, 4, 0x01, 0x02, 0x01, 0x03});
  CHECK(ask(bank, {4, 0, 5, 0, 1}) == Bytes{4, 2, 0, 5});
  // Bits: the first in the lowest bit, the last byte filled with zeros.
  CHECK(ask(bank, {1, 0, 1, 0, 10}) == Bytes{1, 2, 0x55, 0x01});
  CHECK(ask(bank, {2, 0, 0, 0, 3}) == Bytes{2, 1, 0x02});
  CHECK(bank.tables == std::vector<Table>{Table::holding_register, Table::input_register,
                                          Table::coil, Table::discrete_input});
  // Writes are answered with the request.
  CHECK(ask(bank, {6, 0, 9, 0x12, 0x34}) == Bytes{6, 0, 9, 0x12, 0x34});
  CHECK(bank.written == std::vector<std::uint16_t>{0x1234});
  CHECK(bank.written_at == 9);
  CHECK(bank.by == "master");
  CHECK(ask(bank, {5, 0, 7, 0xFF, 0}) == Bytes{5, 0, 7, 0xFF, 0});
  CHECK(bank.written == std::vector<std::uint16_t>{1});
  CHECK(ask(bank, {16, 0, 3, 0, 2, 4, 0xAB, 0xCD, 0, 1}) == Bytes{16, 0, 3, 0, 2});
  CHECK(bank.written == std::vector<std::uint16_t>{0xABCD, 1});
  CHECK(ask(bank, {15, 0, 3, 0, 10, 2, 0xCD, 0x01}) == Bytes{15, 0, 3, 0, 10});
  CHECK(bank.written == std::vector<std::uint16_t>{1, 0, 1, 1, 0, 0, 1, 1, 1, 0});
}

TEST_CASE("invalid requests", "[gateway][pdu]") {
  struct Case {
    Bytes request;
    std::uint8_t exception;
  };
  const Bytes zeros(300, 0);
  Bytes long_write{16, 0, 0, 0, 124, 248};
  long_write.resize(6 + 248);
  for (const Case& c : {
           Case{{3, 0, 0, 0, 0}, 3},    // no register
           Case{{3, 0, 0, 0, 126}, 3},  // more than 125
           Case{{4, 0, 0, 0, 126}, 3},
           Case{{1, 0, 0, 0x07, 0xD1}, 3},  // more than 2000 bits
           Case{{3, 0xFF, 0xFF, 0, 2}, 2},  // beyond the last address
           Case{{1, 0xFF, 0xFF, 0, 2}, 2},
           Case{{3, 0, 0, 0}, 3},           // cut short
           Case{{3, 0, 0, 0, 1, 0}, 3},     // too long
           Case{{5, 0, 0, 0x12, 0x34}, 3},  // neither on nor off
           Case{{5, 0, 0, 0xFF}, 3},
           Case{{16, 0, 0, 0, 2, 3, 0, 0, 0}, 3},  // wrong byte count
           Case{{16, 0, 0, 0, 2, 4, 0, 0, 0}, 3},  // fewer bytes than counted
           Case{{16, 0, 0, 0, 0, 0}, 3},
           Case{long_write, 3},  // more than 123
           Case{{16, 0xFF, 0xFF, 0, 2, 4, 0, 0, 0, 0}, 2},
           Case{{15, 0, 0, 0, 9, 1, 0}, 3},
           Case{{16, 0}, 3},
           Case{{7}, 1},
           Case{{8, 0, 0, 0, 0}, 1},
           Case{{22, 0, 0, 0, 0, 0, 0}, 1},
           Case{{23, 0, 0, 0, 1, 0, 0, 0, 1, 2, 0, 0}, 1},
           Case{{43, 13, 1, 0}, 1},
           Case{{43}, 1},
           Case{{43, 14, 1}, 3},
           Case{{43, 14, 0, 0}, 3},
           Case{{43, 14, 5, 0}, 3},
           Case{{43, 14, 4, 9}, 2},
       }) {
    CountingBank bank;
    const Bytes reply = ask(bank, c.request);
    INFO("function " << static_cast<int>(c.request[0]) << ", " << c.request.size() << " bytes");
    CHECK(reply == Bytes{static_cast<std::uint8_t>(c.request[0] | 0x80), c.exception});
    CHECK(bank.written.empty());
  }
  CountingBank bank;
  CHECK(ask(bank, {0xFF}) == Bytes{0xFF, 1});
  CHECK(ask(bank, zeros) == Bytes{0x80, 3});
  CHECK(ask(bank, {}) == Bytes{0x80, 3});
}

TEST_CASE("the largest requests fit", "[gateway][pdu]") {
  CountingBank bank;
  CHECK(ask(bank, {3, 0, 0, 0, 125}).size() == 2 + 250);
  CHECK(ask(bank, {1, 0, 0, 0x07, 0xD0}).size() == 2 + 250);
  Bytes write{16, 0, 0, 0, 123, 246};
  write.resize(6 + 246);
  CHECK(ask(bank, write) == Bytes{16, 0, 0, 0, 123});
}

TEST_CASE("a client without write access gets an illegal function", "[gateway][pdu]") {
  CountingBank bank;
  for (const Bytes& request : {Bytes{5, 0, 0, 0xFF, 0}, Bytes{6, 0, 0, 0, 1},
                               Bytes{15, 0, 0, 0, 1, 1, 1}, Bytes{16, 0, 0, 0, 1, 2, 0, 1}}) {
    CHECK(ask(bank, request, false) == Bytes{static_cast<std::uint8_t>(request[0] | 0x80), 1});
  }
  CHECK(bank.written.empty());
  CHECK(ask(bank, {3, 0, 1, 0, 1}, false) == Bytes{3, 2, 0, 1});
}

TEST_CASE("device identification: vendor, product, revision", "[gateway][pdu]") {
  CountingBank bank;
  const Bytes basic = ask(bank, {43, 14, 1, 0});
  REQUIRE(basic.size() > 7);
  CHECK(Bytes(basic.begin(), basic.begin() + 7) == Bytes{43, 14, 1, 0x82, 0, 0, 3});
  const std::string text(basic.begin(), basic.end());
  CHECK(text.find("Loopwarden") != std::string::npos);
  CHECK(text.find("1.2.3") != std::string::npos);
  const Bytes revision = ask(bank, {43, 14, 4, 2});
  CHECK(revision == Bytes{43, 14, 4, 0x82, 0, 0, 1, 2, 5, '1', '.', '2', '.', '3'});
  CHECK(ask(bank, {43, 14, 2, 0})[6] == 5);
  CHECK(ask(bank, {43, 14, 2, 4})[6] == 1);
  CHECK(ask(bank, {43, 14, 1, 200})[6] == 3);  // starts again

  const DeviceIdentity talkative{.vendor = std::string(500, 'v'),
                                 .product_code = std::string(500, 'p'),
                                 .revision = std::string(500, 'r'),
                                 .product_name = std::string(500, 'n')};
  const Bytes request{43, 14, 2, 0};
  CHECK(answer(request, bank, talkative, {}).size <= kMostPduBytes);
}

}  // namespace loopwarden::daemon::gateway::modbus_answer_test
