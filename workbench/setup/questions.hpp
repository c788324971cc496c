// SPDX-License-Identifier: Apache-2.0
// What `loopwarden setup` asks that moves nothing: such answers are kept, and may come from a file. What moves a valve is
// no question of this list: it is asked each time.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace loopwarden::workbench::setup {

struct Question {
  std::string_view id;    // in state and answers
  std::string_view step;  // whose it is
  std::string_view text;
  const char* fallback;  // what Enter means; null: there is no such thing
  // What is wrong with an answer; empty: nothing.
  std::string (*wrong)(const std::string& answer);
  // Unit that a typed number may carry: s, pv (unit of PV), co (unit of CO), co/s; null: none.
  const char* unit = nullptr;
};

// Throws std::logic_error for an id that is none.
const Question& question(std::string_view id);
std::vector<std::string> question_ids();

// Numbers separated by blanks or commas; nullopt: something else stands among them, or they are not `count`.
std::optional<std::vector<double>> numbers_in(const std::string& text, std::size_t count);
// `text` without this unit behind its numbers: 5.0 m3/h is 5.0.
std::string without_unit(const std::string& text, const std::string& unit);
// 1-3,7 as 1, 2, 3, 7; nullopt: it is no such list, or a number is above 255.
std::optional<std::vector<unsigned>> units_in(const std::string& text);

// UNIT TABLE ADDRESS TYPE [ORDER]
struct RegisterPlace {
  unsigned unit = 1;
  std::string table, type, order;
  unsigned address = 0;
};
std::optional<RegisterPlace> register_in(const std::string& text);

// 43 %: of a range; 10.5, or 10.5 with the unit: as it is. In the range's unit. nullopt: none of
// these.
std::optional<double> said_value(const std::string& text, std::pair<double, double> range,
                                 const std::string& unit = {});

}  // namespace loopwarden::workbench::setup
