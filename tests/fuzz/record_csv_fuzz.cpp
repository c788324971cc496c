// SPDX-License-Identifier: Apache-2.0
// Reads any bytes as a record. It is refused with a place in the file, or it satisfies the format
// and survives being written and read again.
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "record/record_csv.hpp"
#include "tests/fuzz/require.hpp"

namespace {

using namespace loopwarden::record;
using namespace loopwarden::tests::fuzz;

bool same(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (std::isnan(a[i]) != std::isnan(b[i])) return false;
    if (!std::isnan(a[i]) &&
        std::bit_cast<std::uint64_t>(a[i]) != std::bit_cast<std::uint64_t>(b[i]))
      return false;
  }
  return true;
}

void check(const Record& record) {
  require(record.size() >= 2, "two rows at least");
  require(std::isfinite(record.period_s) && record.period_s > 0.0, "a positive period");
  for (std::size_t i = 1; i < record.size(); ++i) {
    require(record.time_s[i] > record.time_s[i - 1], "rising time");
  }
  check_columns(record);
}

const std::filesystem::path& scratch() {
  static const std::filesystem::path path =
      "/dev/shm/loopwarden_record_fuzz_" + std::to_string(::getpid()) + ".csv";
  return path;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(data, data + size);
  Record record;
  try {
    record = parse_record(text, "input");
  } catch (const RecordError& error) {
    require(std::string_view(error.what()).starts_with("input:"), "the file's name in the message");
    const auto lines = 1 + static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
    require(error.line() <= lines, "a line of the file");
    return 0;
  }
  check(record);

  // Steps near the limit of 1 % can cross it when times are rounded. The values never change.
  write_record(record, scratch());
  try {
    const Record again = read_record(scratch());
    check(again);
    require(same(record.pv, again.pv) && same(record.sp, again.sp) && same(record.co, again.co) &&
                same(record.stem, again.stem),
            "the values when written and read again");
  } catch (const RecordError& error) {
    require(std::string_view(error.what()).find("a step of") != std::string_view::npos,
            "readable when written");
  }
  std::filesystem::remove(scratch());
  return 0;
}
