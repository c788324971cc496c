// SPDX-License-Identifier: Apache-2.0
// A master that sends any request. Every answer is a PDU that the Modbus specification allows for
// the request. A master without write access writes no register. Every float is finite.
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>

#include "daemon/gateway/map_bank.hpp"
#include "daemon/gateway/modbus_answer.hpp"
#include "tests/daemon/gateway/fake_loops.hpp"

namespace {

using namespace loopwarden;
using namespace loopwarden::daemon::gateway;
using Bytes = std::span<const std::uint8_t>;

[[noreturn]] void fail(const char* what) {
  std::fprintf(stderr, "%s\n", what);
  std::abort();
}

std::size_t word(Bytes bytes, std::size_t at) {
  return static_cast<std::size_t>(bytes[at]) * 256 + bytes[at + 1];
}

void check_answer(Bytes request, Bytes reply) {
  if (reply.size() < 2 || reply.size() > kMostPduBytes) fail("no answer has such a length");
  const std::uint8_t function = request[0];
  if ((reply[0] & 0x80U) != 0) {
    if (reply.size() != 2 || reply[0] != (function | 0x80U)) fail("exception of another function");
    if (reply[1] < 1 || reply[1] > 6) fail("no such exception");
    return;
  }
  if (reply[0] != function) fail("answer to another function");
  switch (function) {
    case 1:
    case 2:
      if (reply[1] != (word(request, 3) + 7) / 8 || reply.size() != 2U + reply[1]) fail("bits");
      return;
    case 3:
    case 4:
      if (reply[1] != 2 * word(request, 3) || reply.size() != 2U + reply[1]) fail("registers");
      return;
    case 5:
    case 6:
    case 15:
    case 16:
      if (reply.size() != 5) fail("length of a write's answer");
      for (std::size_t i = 0; i < 5; ++i) {
        if (reply[i] != request[i]) fail("a write's answer repeats the request");
      }
      return;
    case 43: return;
    default: fail("answer to an unknown function");
  }
}

}  // namespace

// First byte: bit 0 gives the master write access, bits 1 and 2 are the word order. The other bytes
// are the request.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  tests::FakeLoops plant(3);
  ServerState server{.word_order = static_cast<hal::modbus::ByteOrder>((data[0] >> 1) & 3U)};
  MapBank bank(plant, server);
  const Peer peer{"fuzzer", (data[0] & 1U) != 0};
  const Bytes request(data + 1, size - 1);
  const Pdu reply = answer(request, bank, {}, peer);
  if (request.size() <= kMostPduBytes) check_answer(request, reply.view());
  for (const auto& [loop, order] : plant.commands) {
    if (loop >= 3) fail("an order to no loop");
    for (const auto& value : {order.set_point, order.output, order.kp, order.ki, order.kd}) {
      if (value && !std::isfinite(*value)) fail("an order that is none");
    }
  }
  const bool written = !plant.commands.empty() || !plant.actions.empty() || server.master_beat;
  if (written && (!peer.may_write || (reply.bytes[0] & 0x80U) != 0)) {
    fail("written by a request that was refused");
  }
  return 0;
}
