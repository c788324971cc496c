// SPDX-License-Identifier: Apache-2.0
// Reads any bytes as next_test.yaml. The reader must not crash. An accepted plan is written back
// equal.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "daemon/protocol/planned_test/test_plan_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace loopwarden;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto plan = protocol::read_test_plan_text("fuzz.yaml", text);
  if (!plan) {
    if (config::to_text(plan.diagnostics).empty()) std::abort();
    return 0;
  }
  const std::string written = protocol::write_test_plan(*plan);
  const auto again = protocol::read_test_plan_text("again.yaml", written);
  if (!again || protocol::write_test_plan(*again) != written) std::abort();
  return 0;
}
