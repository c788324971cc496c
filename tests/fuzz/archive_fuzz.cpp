// SPDX-License-Identifier: Apache-2.0
// Reads any bytes as an archive or a workbook, including sizes and offsets of its directory.
#include "tests/fuzz/import_check.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  loopwarden::tests::fuzz::check_export(data, size, ".zip");
  return 0;
}
