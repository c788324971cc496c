// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <utility>

namespace loopwarden::lab {

// A share, `hits` of `of`, with its 95 % interval, in percent.
struct Share {
  std::size_t hits = 0;
  std::size_t of = 0;

  void count(bool hit);
  double percent() const;  // NaN if `of` is 0
  std::pair<double, double> interval() const;
  // "81.8 % (80.3 to 83.2) of 2785"
  std::string text() const;
};

}  // namespace loopwarden::lab
