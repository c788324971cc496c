// SPDX-License-Identifier: Apache-2.0
#include "hal/modbus/pdu.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <vector>

namespace pdu_test {

using namespace loopwarden::hal::modbus;

namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes bytes_of(const Request& request) { return {request.view().begin(), request.view().end()}; }

ReplyCheck check(const Request& request, const Bytes& bytes) {
  Reply reply;
  return check_reply(request, bytes, reply);
}

}  // namespace

TEST_CASE("requests have the bytes of the Modbus specification", "[modbus][pdu]") {
  CHECK(bytes_of(read_request(17, ReadFunction::input_registers, 0x0102, 3)) ==
        Bytes{17, 4, 1, 2, 0, 3});
  const std::array<std::uint16_t, 2> values{0x47F1, 0x2000};
  CHECK(bytes_of(write_request(1, WriteFunction::single, 0x10, values)) ==
        Bytes{1, 6, 0, 0x10, 0x47, 0xF1});
  CHECK(bytes_of(write_request(1, WriteFunction::multiple, 0x10, values)) ==
        Bytes{1, 16, 0, 0x10, 0, 2, 4, 0x47, 0xF1, 0x20, 0});
}

TEST_CASE("a reply counts only if it answers this request", "[modbus][pdu]") {
  const Request request = read_request(7, ReadFunction::input_registers, 100, 2);
  Reply reply;
  REQUIRE(check_reply(request, Bytes{7, 4, 4, 0x47, 0xF1, 0x20, 0}, reply) == ReplyCheck::valid);
  CHECK(reply.count == 2);
  CHECK(reply.registers[0] == 0x47F1);
  CHECK(reply.registers[1] == 0x2000);

  CHECK(check(request, {8, 4, 4, 0x47, 0xF1, 0x20, 0}) == ReplyCheck::mismatch);        // unit
  CHECK(check(request, {7, 3, 4, 0x47, 0xF1, 0x20, 0}) == ReplyCheck::mismatch);        // function
  CHECK(check(request, {7, 4, 2, 0x47, 0xF1}) == ReplyCheck::mismatch);                 // fewer
  CHECK(check(request, {7, 4, 6, 0x47, 0xF1, 0x20, 0, 1, 2}) == ReplyCheck::mismatch);  // more
  CHECK(check(request, {7, 4, 4, 0x47, 0xF1, 0x20}) == ReplyCheck::mismatch);        // broken off
  CHECK(check(request, {7, 4, 2, 0x47, 0xF1, 0x20, 0}) == ReplyCheck::mismatch);     // byte count
  CHECK(check(request, {7, 4, 4, 0x47, 0xF1, 0x20, 0, 0}) == ReplyCheck::mismatch);  // appendix
  CHECK(check(request, {7, 4}) == ReplyCheck::mismatch);
  CHECK(check(request, {}) == ReplyCheck::mismatch);
}

TEST_CASE("bits come eight to a byte, the lowest first", "[modbus][pdu]") {
  const Request request = read_request(7, ReadFunction::discrete_inputs, 0x0102, 9);
  CHECK(bytes_of(request) == Bytes{7, 2, 1, 2, 0, 9});
  Reply reply;
  REQUIRE(check_reply(request, Bytes{7, 2, 2, 0b1000'0010, 0b1}, reply) == ReplyCheck::valid);
  REQUIRE(reply.count == 9);
  CHECK(reply.registers[0] == 0);
  CHECK(reply.registers[1] == 1);
  CHECK(reply.registers[7] == 1);
  CHECK(reply.registers[8] == 1);
  CHECK(check(request, {7, 2, 1, 0b1}) == ReplyCheck::mismatch);
  CHECK(check(request, {7, 1, 2, 0, 0}) == ReplyCheck::mismatch);
}

TEST_CASE("a rejected reply leaves no values", "[modbus][pdu]") {
  const Request request = read_request(7, ReadFunction::input_registers, 100, 1);
  Reply reply;
  REQUIRE(check_reply(request, Bytes{7, 4, 2, 1, 2}, reply) == ReplyCheck::valid);
  REQUIRE(check_reply(request, Bytes{7, 4, 2, 1}, reply) == ReplyCheck::mismatch);
  CHECK(reply.count == 0);
  CHECK(reply.registers[0] == 0);
}

TEST_CASE("an exception is distinguished from a reply", "[modbus][pdu]") {
  const Request request = read_request(7, ReadFunction::holding_registers, 100, 2);
  Reply reply;
  REQUIRE(check_reply(request, Bytes{7, 0x83, 2}, reply) == ReplyCheck::exception);
  CHECK(reply.exception == 2);
  CHECK(check(request, {7, 0x84, 2}) == ReplyCheck::mismatch);  // of another function
  CHECK(check(request, {7, 0x83, 0}) == ReplyCheck::mismatch);  // no such exception
  CHECK(check(request, {7, 0x83, 2, 0}) == ReplyCheck::mismatch);
  CHECK(check(request, {8, 0x83, 2}) == ReplyCheck::mismatch);
}

TEST_CASE("a write is confirmed only by an echo of its data", "[modbus][pdu]") {
  const std::array<std::uint16_t, 2> values{0x1234, 0x5678};
  const Request single = write_request(7, WriteFunction::single, 100, values);
  CHECK(check(single, {7, 6, 0, 100, 0x12, 0x34}) == ReplyCheck::valid);
  CHECK(check(single, {7, 6, 0, 100, 0x12, 0x35}) == ReplyCheck::mismatch);  // an older command
  CHECK(check(single, {7, 6, 0, 101, 0x12, 0x34}) == ReplyCheck::mismatch);
  CHECK(check(single, {7, 0x86, 4}) == ReplyCheck::exception);

  const Request multiple = write_request(7, WriteFunction::multiple, 100, values);
  CHECK(check(multiple, {7, 16, 0, 100, 0, 2}) == ReplyCheck::valid);
  CHECK(check(multiple, {7, 16, 0, 100, 0, 1}) == ReplyCheck::mismatch);
  CHECK(check(multiple, {7, 16, 0, 99, 0, 2}) == ReplyCheck::mismatch);
  CHECK(check(multiple, {7, 16, 0, 100, 0, 2, 4}) == ReplyCheck::mismatch);
}

TEST_CASE("busy devices and gateways, and codes of no standard, may answer soon", "[modbus][pdu]") {
  for (const int code : {5, 6, 0x0A, 0x0B, 9, 12, 100, 244, 255}) {
    CHECK(is_transient(static_cast<std::uint8_t>(code)));
  }
  for (const int code : {1, 2, 3, 4, 7, 8}) {
    CHECK_FALSE(is_transient(static_cast<std::uint8_t>(code)));
  }
}

TEST_CASE("a refusal names the exception, the request and the key that may help", "[modbus][pdu]") {
  CHECK(exception_text(1) == "exception 1 (illegal function)");
  CHECK_THAT(exception_text(244), Catch::StartsWith("exception 244 ("));
  CHECK(request_text(read_request(7, ReadFunction::coils, 3, 1)) == "reading coil 3 (function 1)");
  CHECK(request_text(read_request(7, ReadFunction::input_registers, 10, 4)) ==
        "reading input registers 10 to 13 (function 4)");
  const std::array<std::uint16_t, 2> values{1, 2};
  const Request one = write_request(7, WriteFunction::multiple, 5, std::span(values).first(1));
  CHECK(request_text(one) == "writing holding register 5 (function 16)");
  CHECK_THAT(write_function_hint(one), Catch::Contains("write_function: single."));
  CHECK_THAT(write_function_hint(write_request(7, WriteFunction::single, 5, values)),
             Catch::Contains("write_function: multiple."));
  CHECK_THAT(write_function_hint(write_request(7, WriteFunction::multiple, 5, values)),
             Catch::Contains("one register") && Catch::Contains("write_function: single."));
  CHECK(write_function_hint(read_request(7, ReadFunction::coils, 3, 1)).empty());
}

TEST_CASE("a reply that does not answer the request is described by its difference",
          "[modbus][pdu]") {
  const Request request = read_request(7, ReadFunction::holding_registers, 100, 1);
  CHECK_THAT(mismatch_text(request, Bytes{255, 3, 2, 0, 1}), Catch::Contains("from unit 255"));
  CHECK(mismatch_text(request, Bytes{7, 4, 2, 0, 1}) == "a reply to function 4");
  CHECK(mismatch_text(request, Bytes{7, 0x84, 2}) == "a reply to function 4");
  CHECK_THAT(mismatch_text(request, Bytes{7, 3, 4, 0, 1, 0, 2}),
             Catch::Contains("number of values"));
  CHECK_THAT(mismatch_text(request, Bytes{7}), Catch::Contains("too short"));
  const std::array<std::uint16_t, 1> value{1};
  const Request write = write_request(7, WriteFunction::single, 5, value);
  CHECK_THAT(mismatch_text(write, Bytes{7, 6, 0, 5, 0, 2}),
             Catch::Contains("another address or value"));
}

}  // namespace pdu_test
