// SPDX-License-Identifier: Apache-2.0
// Requirements of every record, from any source. A fuzzer stops if one is not satisfied.
#pragma once

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "record/record_csv.hpp"

namespace loopwarden::tests::fuzz {

inline void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "not kept: %s\n", what);
  std::abort();
}

inline void check_columns(const record::Record& record) {
  for (const auto* column : {&record.pv, &record.sp, &record.co, &record.stem}) {
    require(column->empty() || column->size() == record.time_s.size(), "columns of equal length");
    for (const double value : *column) require(!std::isinf(value), "finite values");
  }
}

}  // namespace loopwarden::tests::fuzz
