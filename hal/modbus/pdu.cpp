// SPDX-License-Identifier: Apache-2.0
#include "hal/modbus/pdu.hpp"

#include <algorithm>

namespace loopwarden::hal::modbus {
namespace {

void append(Request& request, std::uint8_t byte) noexcept { request.bytes[request.size++] = byte; }

void append_word(Request& request, std::uint16_t word) noexcept {
  append(request, static_cast<std::uint8_t>(word >> 8));
  append(request, static_cast<std::uint8_t>(word & 0xFF));
}

Request begin(std::uint8_t unit, std::uint8_t function, std::uint16_t address,
              std::uint16_t count) noexcept {
  Request request{.unit = unit, .function = function, .address = address, .count = count};
  append(request, unit);
  append(request, function);
  append_word(request, address);
  return request;
}

constexpr std::uint8_t kExceptionFlag = 0x80;
constexpr std::uint8_t kWriteSingleRegister = 6;
constexpr std::uint8_t kWriteMultipleRegisters = 16;

}  // namespace

Request read_request(std::uint8_t unit, ReadFunction function, std::uint16_t address,
                     std::uint16_t count) noexcept {
  Request request = begin(unit, static_cast<std::uint8_t>(function), address, count);
  request.read = function;
  append_word(request, count);
  return request;
}

Request write_request(std::uint8_t unit, WriteFunction function, std::uint16_t address,
                      std::span<const std::uint16_t> values) noexcept {
  if (function == WriteFunction::single) {
    Request request = begin(unit, kWriteSingleRegister, address, 1);
    append_word(request, values.front());
    return request;
  }
  const auto count = static_cast<std::uint16_t>(values.size());
  Request request = begin(unit, kWriteMultipleRegisters, address, count);
  append_word(request, count);
  append(request, static_cast<std::uint8_t>(2 * count));
  for (const std::uint16_t value : values) append_word(request, value);
  return request;
}

ReplyCheck check_reply(const Request& request, std::span<const std::uint8_t> bytes,
                       Reply& reply) noexcept {
  reply = {};
  if (bytes.size() < 3 || bytes[0] != request.unit) return ReplyCheck::mismatch;

  if (bytes[1] == (request.function | kExceptionFlag)) {
    if (bytes.size() != 3 || bytes[2] == 0) return ReplyCheck::mismatch;
    reply.exception = bytes[2];
    return ReplyCheck::exception;
  }
  if (bytes[1] != request.function) return ReplyCheck::mismatch;

  if (!request.read) {
    // Function 6 gives the whole request back, function 16 its address and count.
    constexpr std::size_t kEchoBytes = 6;
    const bool echoed =
        bytes.size() == kEchoBytes && std::equal(bytes.begin(), bytes.end(), request.bytes.begin());
    return echoed ? ReplyCheck::valid : ReplyCheck::mismatch;
  }

  const std::size_t data_bytes = reply_bytes(*request.read, request.count);
  if (bytes.size() != 3 + data_bytes || bytes[2] != data_bytes) return ReplyCheck::mismatch;
  reply.count = request.count;
  const std::span<const std::uint8_t> data = bytes.subspan(3);
  for (std::size_t i = 0; i < reply.count; ++i) {
    reply.registers[i] = reads_bits(*request.read)
                             ? static_cast<std::uint16_t>((data[i / 8] >> (i % 8)) & 1)
                             : static_cast<std::uint16_t>((data[2 * i] << 8) | data[2 * i + 1]);
  }
  return ReplyCheck::valid;
}

}  // namespace loopwarden::hal::modbus
