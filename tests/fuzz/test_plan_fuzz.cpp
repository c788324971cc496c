// SPDX-License-Identifier: Apache-2.0
// Reads any bytes as next_test.yaml. The reader must not crash. An accepted plan is written back
// equal.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "workbench/files/test_plan_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace loopwarden;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto plan = workbench::read_test_plan_text("fuzz.yaml", text);
  if (!plan) {
    if (config::to_text(plan.diagnostics).empty()) std::abort();
    return 0;
  }
  const std::string written = workbench::write_test_plan(*plan);
  const auto again = workbench::read_test_plan_text("again.yaml", written);
  if (!again || workbench::write_test_plan(*again) != written) std::abort();
  return 0;
}
