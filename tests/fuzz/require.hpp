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

inline void check_column(const record::Record& record, const std::vector<double>& column,
                         bool present, std::size_t missing) {
  require(column.size() == (present ? record.size() : 0), "columns of equal length");
  std::size_t empty = 0;
  for (const double value : column) {
    if (std::isnan(value)) ++empty;
    require(!std::isinf(value), "finite values");
  }
  require(empty == missing, "the number of missing samples");
}

}  // namespace loopwarden::tests::fuzz
