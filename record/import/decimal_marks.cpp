// SPDX-License-Identifier: Apache-2.0
#include "record/import/decimal_marks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/text.hpp"

namespace loopwarden::record {
namespace {

constexpr double kSmallChange = 0.3;  // of the larger value
constexpr double kAbsurdChange = 0.7;

double change(double a, double b) {
  const double larger = std::max(std::abs(a), std::abs(b));
  return larger > 0.0 ? std::abs(a - b) / larger : 0.0;
}

// Returns the digits of a number with one mark as a whole number.
double without_mark(std::string_view cell) {
  std::string digits;
  for (const char c : cell) {
    if (c != '.' && c != ',') digits += c;
  }
  return parse_number(digits, '.').value_or(0.0);
}

}  // namespace

void MarkEvidence::add(std::string_view cell) {
  const Marks marks = marks_of(cell);
  if (marks == Marks::none) return;
  ++cells_;
  if (marks == Marks::point_decimal || marks == Marks::comma_decimal) {
    ++only_;
    last_kind_ = 0;
    return;
  }
  const bool whole = marks == Marks::whole;
  const std::size_t kind = whole ? 1 : marks == Marks::point_open ? 2 : 3;
  const double value = whole ? parse_number(cell, '.').value_or(0.0) : without_mark(cell);
  if (!whole) {
    if (example_.empty()) example_ = cell;
    ++open_[kind - 2].cells;
  }
  if (last_kind_ > 0 && (last_kind_ == 1) != whole && value != 0.0 && last_ != 0.0) {
    Mark& mark = open_[(whole ? last_kind_ : kind) - 2];
    const double beside = whole ? value : last_;
    const double marked = whole ? last_ : value;
    const double thousands = change(beside, marked);
    const double decimals = change(beside, marked / 1000.0);
    if (thousands < kSmallChange && decimals > kAbsurdChange) ++mark.as_thousands;
    if (decimals < kSmallChange && thousands > kAbsurdChange) ++mark.as_decimals;
  }
  last_kind_ = kind;
  last_ = value;
}

char MarkEvidence::by_jumps() const noexcept {
  char decided = '\0';
  for (const std::size_t which : {0U, 1U}) {
    const Mark& mark = open_[which];
    if ((mark.as_decimals > 0) == (mark.as_thousands > 0)) continue;
    const char own = which == 0 ? '.' : ',';
    const char decimal = mark.as_decimals > 0 ? own : (own == '.' ? ',' : '.');
    if (decided != '\0' && decided != decimal) return '\0';
    decided = decimal;
  }
  return decided;
}

char MarkEvidence::in_all_cells() const noexcept {
  if (cells_ > 0 && open_[0].cells == cells_) return '.';
  return cells_ > 0 && open_[1].cells == cells_ ? ',' : '\0';
}

std::string MarkEvidence::question() const {
  const double thousands = without_mark(example_);
  return fmt::format("{} can be {:.3f} and {:.0f}: --decimal {} or --decimal {}",
                     base::in_quotes(example_), thousands / 1000.0, thousands,
                     example_.find(',') != example_.npos ? "comma" : "point",
                     example_.find(',') != example_.npos ? "point" : "comma");
}

bool may_be_thousands(std::span<const double> values) {
  const auto is_whole = [](double v) { return v == std::nearbyint(v); };
  for (std::size_t k = 1; k < values.size(); ++k) {
    double whole = values[k - 1];
    double marked = values[k];
    if (is_whole(marked)) std::swap(whole, marked);
    if (!is_whole(whole) || is_whole(marked) || std::abs(marked) < 1.0) continue;
    const double thousands = std::nearbyint(1000.0 * marked);
    if (std::abs(1000.0 * marked - thousands) < 1e-6 && change(whole, marked) > kAbsurdChange &&
        change(whole, thousands) < kSmallChange)
      return true;
  }
  return false;
}

}  // namespace loopwarden::record
