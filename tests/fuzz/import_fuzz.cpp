// SPDX-License-Identifier: Apache-2.0
// Reads any bytes as a historian's text export.
#include "tests/fuzz/import_check.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  loopwarden::tests::fuzz::check_export(data, size, ".csv");
  return 0;
}
