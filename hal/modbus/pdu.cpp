// SPDX-License-Identifier: Apache-2.0
#include "hal/modbus/pdu.hpp"

#include <algorithm>
#include <string>

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
    // Function 6 returns the whole request, function 16 its address and count.
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

namespace {

enum Exception : std::uint8_t {
  kIllegalFunction = 1,
  kIllegalAddress = 2,
  kIllegalValue = 3,
  kDeviceFailure = 4,
  kAcknowledge = 5,
  kBusy = 6,
  kNegativeAcknowledge = 7,
  kMemoryParity = 8,
  kGatewayPath = 0x0A,
  kGatewayTarget = 0x0B
};

const char* exception_name(std::uint8_t exception) noexcept {
  switch (exception) {
    case kIllegalFunction: return "illegal function";
    case kIllegalAddress: return "illegal data address";
    case kIllegalValue: return "illegal data value";
    case kDeviceFailure: return "device failure";
    case kAcknowledge: return "acknowledge, the device is busy";
    case kBusy: return "device busy";
    case kNegativeAcknowledge: return "negative acknowledge";
    case kMemoryParity: return "memory parity error";
    case kGatewayPath: return "gateway path unavailable";
    case kGatewayTarget: return "gateway target device failed to respond";
    default: return "not a standard code, see the device's manual";
  }
}

const char* function_name(const Request& request) noexcept {
  if (!request.read) return "writing holding register";
  switch (*request.read) {
    case ReadFunction::coils: return "reading coil";
    case ReadFunction::discrete_inputs: return "reading discrete input";
    case ReadFunction::input_registers: return "reading input register";
    case ReadFunction::holding_registers: break;
  }
  return "reading holding register";
}

}  // namespace

bool is_transient(std::uint8_t exception) noexcept {
  switch (exception) {
    case kIllegalFunction:
    case kIllegalAddress:
    case kIllegalValue:
    case kDeviceFailure:
    case kNegativeAcknowledge:
    case kMemoryParity: return false;
    default: return true;
  }
}

std::string exception_text(std::uint8_t exception) {
  return "exception " + std::to_string(exception) + " (" + exception_name(exception) + ")";
}

std::string request_text(const Request& request) {
  std::string text = function_name(request);
  const int last = request.address + request.count - 1;
  if (request.count > 1) text += 's';
  text += ' ' + std::to_string(request.address);
  if (request.count > 1) text += " to " + std::to_string(last);
  return text + " (function " + std::to_string(request.function) + ")";
}

std::string write_function_hint(const Request& request) {
  if (request.read) return {};
  if (request.function == kWriteSingleRegister) {
    return "If the device accepts only function 16, set write_function: multiple.";
  }
  if (request.count == 1) {
    return "If the device accepts only function 6, set write_function: single.";
  }
  return "If the device accepts only function 6, use a command of one register (u16 or i16 with "
         "scale) and set write_function: single.";
}

std::string mismatch_text(const Request& request, std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 2) return "a reply that is too short";
  if (bytes[0] != request.unit) {
    return "the reply is from unit " + std::to_string(bytes[0]) +
           ". Check `unit`, and the unit that the device or gateway is set to.";
  }
  const int function = bytes[1] & ~kExceptionFlag;
  if (function != request.function) {
    return "a reply to function " + std::to_string(function);
  }
  if (!request.read) return "the device confirms another address or value than was written";
  return "a reply with another number of values than was asked for";
}

}  // namespace loopwarden::hal::modbus
