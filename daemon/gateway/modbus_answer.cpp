// SPDX-License-Identifier: Apache-2.0
#include "daemon/gateway/modbus_answer.hpp"

#include <algorithm>
#include <string_view>

namespace loopwarden::daemon::gateway {
namespace {

using registers::Table;
using Bytes = std::span<const std::uint8_t>;

constexpr std::uint8_t kReadCoils = 1;
constexpr std::uint8_t kReadDiscreteInputs = 2;
constexpr std::uint8_t kReadHoldingRegisters = 3;
constexpr std::uint8_t kReadInputRegisters = 4;
constexpr std::uint8_t kWriteCoil = 5;
constexpr std::uint8_t kWriteRegister = 6;
constexpr std::uint8_t kWriteCoils = 15;
constexpr std::uint8_t kWriteRegisters = 16;
constexpr std::uint8_t kEncapsulated = 43;
constexpr std::uint8_t kDeviceIdentification = 14;

std::uint16_t word(Bytes bytes, std::size_t at) {
  return static_cast<std::uint16_t>((bytes[at] << 8) | bytes[at + 1]);
}

void append(Pdu& pdu, std::uint8_t byte) { pdu.bytes[pdu.size++] = byte; }
void append_word(Pdu& pdu, std::uint16_t value) {
  append(pdu, static_cast<std::uint8_t>(value >> 8));
  append(pdu, static_cast<std::uint8_t>(value & 0xFF));
}

Pdu exception(std::uint8_t function, Exception code) {
  Pdu pdu;
  append(pdu, function | 0x80U);
  append(pdu, static_cast<std::uint8_t>(code));
  return pdu;
}

// Returns the answer to a write: the first five bytes of the request.
Pdu echo(Bytes request) {
  Pdu pdu;
  for (std::size_t i = 0; i < 5; ++i) append(pdu, request[i]);
  return pdu;
}

bool beyond_addresses(std::uint16_t address, std::size_t count) {
  return address + count > 0x10000;
}

// Reads what the request names into `values`; no more than they hold.
Exception read_named(Bytes request, Table table, RegisterBank& bank,
                     std::span<std::uint16_t>& values) {
  if (request.size() != 5) return Exception::illegal_value;
  const std::uint16_t address = word(request, 1);
  const std::size_t count = word(request, 3);
  if (count < 1 || count > values.size()) return Exception::illegal_value;
  if (beyond_addresses(address, count)) return Exception::illegal_address;
  values = values.first(count);
  return bank.read(table, address, values);
}

Pdu read_bits(Bytes request, Table table, RegisterBank& bank) {
  std::array<std::uint16_t, kMostReadBits> room{};
  std::span<std::uint16_t> values = room;
  const Exception error = read_named(request, table, bank, values);
  if (error != Exception::none) return exception(request[0], error);
  Pdu pdu;
  append(pdu, request[0]);
  const std::size_t count = values.size();
  append(pdu, static_cast<std::uint8_t>((count + 7) / 8));
  for (std::size_t first = 0; first < count; first += 8) {
    unsigned byte = 0;
    for (std::size_t i = first; i < std::min(first + 8, count); ++i) {
      byte |= (values[i] != 0 ? 1U : 0U) << (i - first);
    }
    append(pdu, static_cast<std::uint8_t>(byte));
  }
  return pdu;
}

Pdu read_registers(Bytes request, Table table, RegisterBank& bank) {
  std::array<std::uint16_t, kMostReadRegisters> room{};
  std::span<std::uint16_t> values = room;
  const Exception error = read_named(request, table, bank, values);
  if (error != Exception::none) return exception(request[0], error);
  Pdu pdu;
  append(pdu, request[0]);
  append(pdu, static_cast<std::uint8_t>(2 * values.size()));
  for (const std::uint16_t value : values) append_word(pdu, value);
  return pdu;
}

Pdu write_one(Bytes request, RegisterBank& bank, const Peer& peer) {
  const std::uint8_t function = request[0];
  if (request.size() != 5) return exception(function, Exception::illegal_value);
  std::uint16_t value = word(request, 3);
  Table table = Table::holding_register;
  if (function == kWriteCoil) {
    if (value != 0x0000 && value != 0xFF00) return exception(function, Exception::illegal_value);
    value = value != 0 ? 1 : 0;
    table = Table::coil;
  }
  const Exception error = bank.write(table, word(request, 1), std::span(&value, 1), peer);
  return error == Exception::none ? echo(request) : exception(function, error);
}

Pdu write_several(Bytes request, RegisterBank& bank, const Peer& peer) {
  const std::uint8_t function = request[0];
  const bool coils = function == kWriteCoils;
  if (request.size() < 6) return exception(function, Exception::illegal_value);
  const std::uint16_t address = word(request, 1);
  const std::size_t count = word(request, 3);
  const std::size_t bytes = coils ? (count + 7) / 8 : 2 * count;
  if (count < 1 || count > (coils ? kMostWriteBits : kMostWriteRegisters) || request[5] != bytes ||
      request.size() != 6 + bytes) {
    return exception(function, Exception::illegal_value);
  }
  if (beyond_addresses(address, count)) return exception(function, Exception::illegal_address);
  std::array<std::uint16_t, kMostWriteBits> values{};
  for (std::size_t i = 0; i < count; ++i) {
    if (coils) {
      const unsigned byte = request[6 + i / 8];
      values[i] = static_cast<std::uint16_t>((byte >> (i % 8)) & 1U);
    } else {
      values[i] = word(request, 6 + 2 * i);
    }
  }
  const Exception error = bank.write(coils ? Table::coil : Table::holding_register, address,
                                     std::span(values).first(count), peer);
  return error == Exception::none ? echo(request) : exception(function, error);
}

Pdu identify(Bytes request, const DeviceIdentity& identity) {
  const std::uint8_t function = request[0];
  if (request.size() < 2 || request[1] != kDeviceIdentification) {
    return exception(function, Exception::illegal_function);
  }
  if (request.size() != 4) return exception(function, Exception::illegal_value);
  const std::uint8_t code = request[2];
  std::uint8_t object = request[3];
  const std::array<std::string_view, 5> objects{identity.vendor, identity.product_code,
                                                identity.revision, std::string_view(),
                                                identity.product_name};
  constexpr std::uint8_t kBasic = 3;    // objects 0, 1, 2
  constexpr std::uint8_t kRegular = 5;  // objects 3 and 4 in addition
  if (code < 1 || code > 4) return exception(function, Exception::illegal_value);
  const bool individual = code == 4;
  if (individual && object >= kRegular) return exception(function, Exception::illegal_address);
  const std::uint8_t end = code == 1 ? kBasic : kRegular;
  // A stream that starts after the last object restarts at 0, as the specification requires.
  if (!individual && object >= end) object = 0;
  const std::uint8_t last = individual ? static_cast<std::uint8_t>(object + 1) : end;
  Pdu pdu;
  append(pdu, function);
  append(pdu, kDeviceIdentification);
  append(pdu, code);
  append(pdu, 0x82);  // conformity: regular identification, stream and individual access
  append(pdu, 0x00);  // no more objects follow: five fit into a PDU
  append(pdu, 0x00);
  append(pdu, static_cast<std::uint8_t>(last - object));
  constexpr std::size_t kMostText = 46;
  for (std::uint8_t i = object; i < last; ++i) {
    const std::string_view text = objects[i].substr(0, kMostText);
    append(pdu, i);
    append(pdu, static_cast<std::uint8_t>(text.size()));
    for (const char c : text) append(pdu, static_cast<std::uint8_t>(c));
  }
  return pdu;
}

}  // namespace

Pdu answer(std::span<const std::uint8_t> request, RegisterBank& bank,
           const DeviceIdentity& identity, const Peer& peer) {
  if (request.empty() || request.size() > kMostPduBytes) {
    return exception(request.empty() ? std::uint8_t{0} : request[0], Exception::illegal_value);
  }
  const std::uint8_t function = request[0];
  switch (function) {
    case kReadCoils: return read_bits(request, Table::coil, bank);
    case kReadDiscreteInputs: return read_bits(request, Table::discrete_input, bank);
    case kReadHoldingRegisters: return read_registers(request, Table::holding_register, bank);
    case kReadInputRegisters: return read_registers(request, Table::input_register, bank);
    case kWriteCoil:
    case kWriteRegister:
    case kWriteCoils:
    case kWriteRegisters:
      // For peers without write access, write functions don't exist.
      if (!peer.may_write) return exception(function, Exception::illegal_function);
      return function == kWriteCoil || function == kWriteRegister
                 ? write_one(request, bank, peer)
                 : write_several(request, bank, peer);
    case kEncapsulated: return identify(request, identity);
    default: return exception(function & 0x7FU, Exception::illegal_function);
  }
}

}  // namespace loopwarden::daemon::gateway
