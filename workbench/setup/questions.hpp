// SPDX-License-Identifier: Apache-2.0
// The questions of `loopwarden setup` whose answers are kept and can be read from a file. They do
// not move a valve. Questions that lead to a move are not in this list, because they are asked each
// time.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace loopwarden::workbench::setup {

struct Question {
  std::string_view id;    // key in state and answers
  std::string_view step;  // the step that asks it
  std::string_view text;
  const char* fallback;  // the answer for Enter; null: an answer is required
  // Returns the error of an answer; empty: the answer is valid.
  std::string (*wrong)(const std::string& answer);
  // Unit that a typed number may have: s, pv (unit of PV), co (unit of CO), co/s; null: no unit.
  const char* unit = nullptr;
};

// Throws std::logic_error for an unknown id.
const Question& question(std::string_view id);
std::vector<std::string> question_ids();

// Returns numbers separated by blanks or commas; nullopt if there is other text or not `count`
// numbers.
std::optional<std::vector<double>> numbers_in(const std::string& text, std::size_t count);
// Returns `text` without the unit after its numbers: "5.0 m3/h" gives "5.0".
std::string without_unit(const std::string& text, const std::string& unit);
// Returns "1-3,7" as 1, 2, 3, 7; nullopt if the list is invalid or a number is above 255.
std::optional<std::vector<unsigned>> units_in(const std::string& text);

// UNIT TABLE ADDRESS TYPE [ORDER]
struct RegisterPlace {
  unsigned unit = 1;
  std::string table, type, order;
  unsigned address = 0;
};
std::optional<RegisterPlace> register_in(const std::string& text);

// Returns a value in the range's unit: "43 %" of a range, "10.5", or "10.5" with the unit. nullopt
// for other texts.
std::optional<double> said_value(const std::string& text, std::pair<double, double> range,
                                 const std::string& unit = {});

}  // namespace loopwarden::workbench::setup
