// SPDX-License-Identifier: Apache-2.0
// Formats a column of rows as the text of a PostgreSQL array. One statement can then take many
// rows: unnest($1::integer[], ...).
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>

namespace loopwarden::fleet {

class ArrayText {
 public:
  void add(int number) { next("{}", number); }
  void add(std::int64_t number) { next("{}", number); }
  // the shortest text that parses to the same number
  void add(double number) { next("{}", number); }
  void add(bool flag) { next("{}", flag ? "t" : "f"); }
  void add(std::string_view text) {
    separate();
    text_ += '"';
    for (const char c : text) {
      if (c == '"' || c == '\\') text_ += '\\';
      text_ += c;
    }
    text_ += '"';
  }
  void add(const std::string& text) { add(std::string_view(text)); }
  template <class T>
  void add(const std::optional<T>& value) {
    if (value) {
      add(*value);
    } else {
      next("{}", "NULL");
    }
  }
  // Adds milliseconds since 1970 as seconds, for to_timestamp().
  void add_time(std::int64_t ms) { add(static_cast<double>(ms) / 1e3); }

  std::string text() const { return text_ + '}'; }
  bool empty() const noexcept { return text_.size() == 1; }

 private:
  void separate() {
    if (text_.size() > 1) text_ += ',';
  }
  template <class T>
  void next(fmt::format_string<const T&> pattern, const T& value) {
    separate();
    fmt::format_to(std::back_inserter(text_), pattern, value);
  }

  std::string text_ = "{";
};

}  // namespace loopwarden::fleet
