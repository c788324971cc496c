// SPDX-License-Identifier: Apache-2.0
// Decides whether the mark in 1,045 is a decimal mark or a thousands mark, from all cells of a
// column in order.
//
//   other forms   12,5 and 0,123 and 1.234,5 and 1,234,567 allow one reading only
//   jumps         998 and then 1,003: read as decimals, the value would fall to a thousandth; a
//                 change between cells with and without the mark decides if one reading changes by
//                 less than 30 % and the other by more than 70 %
//   CO            all cells of a controller output have three digits after the mark: decimals, as
//                 an output in % or mA never has thousands
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "record/import/number_text.hpp"

namespace loopwarden::record {

class MarkEvidence {
 public:
  // `cell`: a number, without its unit.
  void add(std::string_view cell);

  bool decides() const noexcept { return only_ > 0; }  // a cell allows one reading only
  bool is_open() const noexcept { return !example_.empty(); }
  // Returns the decimal mark by jumps; '\0' if they don't decide.
  char by_jumps() const noexcept;
  // Returns the mark that all cells have before three digits; '\0' if there is no such mark.
  char in_all_cells() const noexcept;
  // Returns a text such as "'1,045' can be 1.045 and 1045: --decimal comma or --decimal point".
  std::string question() const;
  const std::string& example() const noexcept { return example_; }

 private:
  struct Mark {
    std::size_t cells = 0;
    std::size_t as_decimals = 0;  // jumps that allow this reading only
    std::size_t as_thousands = 0;
  };
  std::size_t cells_ = 0;
  std::size_t only_ = 0;
  std::array<Mark, 2> open_{};  // point, comma
  std::string example_;
  std::size_t last_kind_ = 0;  // 0: no number or one reading, 1: whole, 2 point, 3 comma
  double last_ = 0.0;          // as a whole number
};

// Returns whether values read with a decimal point jump as if the point were a thousands mark: 998,
// then 1.003.
bool may_be_thousands(std::span<const double> values);

}  // namespace loopwarden::record
