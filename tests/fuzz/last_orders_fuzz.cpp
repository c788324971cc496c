// SPDX-License-Identifier: Apache-2.0
// Reads any bytes with a correct checksum as the file of the loops' last commands. Accepted
// commands are finite, and are the same after they are written and read again.
#include <cmath>
#include <cstdint>
#include <fmt/format.h>
#include <exception>
#include <map>
#include <string>
#include <string_view>

#include "base/digest/digest.hpp"
#include "daemon/loops/last_commands.hpp"
#include "tests/fuzz/require.hpp"

using loopwarden::tests::fuzz::require;
namespace daemon_ = loopwarden::daemon;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string body(reinterpret_cast<const char*>(data), size);
  const std::string text = fmt::format("{:08x}\n{}", loopwarden::base::crc32(body), body);
  std::map<std::string, daemon_::LastCommand> loops;
  try {
    loops = daemon_::read_last_orders(text);
  } catch (const std::exception&) {
    return 0;  // damaged
  }
  for (const auto& [tag, order] : loops) {
    require(std::isfinite(order.set_point), "a finite set point");
    require(std::isfinite(order.pv_range.first) && std::isfinite(order.pv_range.second),
            "a finite range");
  }
  require(daemon_::read_last_orders(daemon_::text_of(loops)) == loops, "the same loops");
  return 0;
}
