// SPDX-License-Identifier: Apache-2.0
#include "hal/modbus/rtu_frame.hpp"

#include <catch2/catch.hpp>
#include <vector>

namespace rtu_frame_test {

using namespace loopwarden::hal::modbus;
using Bytes = std::vector<std::uint8_t>;
using State = RtuReply::State;

namespace {

Bytes framed(Bytes bytes) {
  const std::uint16_t crc = rtu_crc(bytes);
  bytes.push_back(static_cast<std::uint8_t>(crc & 0xFF));
  bytes.push_back(static_cast<std::uint8_t>(crc >> 8));
  return bytes;
}

Bytes operator+(Bytes left, const Bytes& right) {
  left.insert(left.end(), right.begin(), right.end());
  return left;
}

const Request kRead = read_request(1, ReadFunction::input_registers, 0, 2);
const std::vector<std::uint16_t> kValue{0x1234};
const Request kWrite = write_request(1, WriteFunction::single, 100, kValue);
const Bytes kReply = framed({1, 4, 4, 0x41, 0xA0, 0, 0});
const Bytes kBusy = framed({1, 0x84, 6});

Bytes sent(const Request& request) {
  const RtuFrame frame = rtu_frame(request);
  return {frame.view().begin(), frame.view().end()};
}

}  // namespace

TEST_CASE("the CRC is that of the specification", "[modbus]") {
  CHECK(framed({2, 7}) == Bytes{2, 7, 0x41, 0x12});  // Modbus over Serial Line, 6.2.2
}

TEST_CASE("a reply is found as soon as it is whole", "[modbus]") {
  for (std::size_t size = 0; size < kReply.size(); ++size) {
    CHECK(find_reply(kRead, Bytes(kReply.begin(), kReply.begin() + static_cast<long>(size)), false)
              .state == State::incomplete);
  }
  const RtuReply reply = find_reply(kRead, kReply, false);
  REQUIRE(reply.state == State::found);
  CHECK(reply.end == kReply.size());
  CHECK(reply.stray == 0);
  CHECK_FALSE(reply.echo);
  CHECK(Bytes(reply.body.begin(), reply.body.end()) == Bytes{1, 4, 4, 0x41, 0xA0, 0, 0});
  CHECK(find_reply(kRead, kBusy, false).state == State::found);
}

TEST_CASE("an echo and up to four stray bytes are not part of the reply", "[modbus]") {
  for (std::size_t stray = 0; stray <= kMostStrayBytes; ++stray) {
    for (const int byte : {0x00, 0xFF, 0x01, 0x04}) {
      const Bytes noise(stray, static_cast<std::uint8_t>(byte));
      for (const Bytes& answer : {kReply, kBusy}) {
        const RtuReply plain = find_reply(kRead, noise + answer + Bytes{0}, false);
        REQUIRE(plain.state == State::found);
        CHECK(plain.stray == stray);
        CHECK(plain.end == stray + answer.size());
        const RtuReply echoed = find_reply(kRead, sent(kRead) + noise + answer, false);
        REQUIRE(echoed.state == State::found);
        CHECK(echoed.echo);
        CHECK(echoed.stray == stray);
      }
    }
  }
  // More bytes than that may be another reply: the following bytes are not trusted.
  CHECK(find_reply(kRead, Bytes(kShortestReplyBytes, 0) + kReply, false).state == State::whole);
  CHECK(find_reply(kRead, sent(kRead), false).state == State::incomplete);
}

TEST_CASE("a write of one register is confirmed by its own echo only if the line does not echo",
          "[modbus]") {
  CHECK(find_reply(kWrite, sent(kWrite), false).state == State::found);
  CHECK(find_reply(kWrite, sent(kWrite), true).state == State::incomplete);
  const RtuReply both = find_reply(kWrite, sent(kWrite) + sent(kWrite), true);
  CHECK(both.state == State::found);
  CHECK(both.echo);
  const Request several = write_request(1, WriteFunction::multiple, 100, kValue);
  CHECK(find_reply(several, sent(several), false).state == State::incomplete);
  const Bytes confirmed = framed({1, 16, 0, 100, 0, 1});
  CHECK(find_reply(several, sent(several) + confirmed, false).state == State::found);
}

TEST_CASE("a reply with a wrong checksum is invalid, and another unit's frame is reported",
          "[modbus]") {
  Bytes broken = kReply;
  broken[3] ^= 1;
  CHECK(find_reply(kRead, broken, false).state == State::whole);
  const Bytes foreign = framed({9, 4, 4, 0x41, 0xA0, 0, 0});
  const RtuReply other = find_reply(kRead, foreign, false);
  REQUIRE(other.state == State::found);
  CHECK(other.body[0] == 9);
}

}  // namespace rtu_frame_test
