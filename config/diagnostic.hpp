// SPDX-License-Identifier: Apache-2.0
// An error in a file with its place, in the form of a compiler's messages:
//   loops.d/FIC-101.yaml:14:9: error: controller.ti: must be > 0 s (got 0)
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace loopwarden::config {

// Both numbers count from 1; line 0 is the file as a whole. Columns count bytes.
struct Place {
  int line = 0;
  int column = 0;

  friend bool operator==(const Place&, const Place&) = default;
  friend bool operator<(const Place& a, const Place& b) noexcept {
    return a.line != b.line ? a.line < b.line : a.column < b.column;
  }
};

std::string to_text(Place place);  // "14:9"

struct Diagnostic {
  enum class Level { note, warning, error };
  Level level = Level::error;
  std::string file;
  Place place;
  std::string key;  // path of the key, such as controller.ti; empty: the file as a whole
  std::string message;
};

const char* to_text(Diagnostic::Level level) noexcept;

std::string to_text(const Diagnostic& diagnostic);             // one line, without its end
std::string to_text(std::span<const Diagnostic> diagnostics);  // each line ends with \n

bool has_errors(std::span<const Diagnostic> diagnostics) noexcept;

// Collects the diagnostics of one file.
class Report {
 public:
  explicit Report(std::string file) : file_(std::move(file)) {}

  void error(Place place, std::string_view key, std::string message);
  void warning(Place place, std::string_view key, std::string message);
  // Adds information for the reader of the file that is no error.
  void note(Place place, std::string_view key, std::string message);

  const std::string& file() const noexcept { return file_; }
  std::size_t error_count() const noexcept { return errors_; }
  bool has_errors() const noexcept { return errors_ > 0; }
  // Returns the error with the first place. There must be an error.
  const Diagnostic& first_error() const noexcept;
  // Returns all diagnostics in the order of their places and empties the report.
  std::vector<Diagnostic> take();

 private:
  std::string file_;
  std::vector<Diagnostic> diagnostics_;
  std::size_t errors_ = 0;
};

// The result of reading: a value, unless there were errors. Warnings may accompany a value.
template <class T>
struct Loaded {
  std::optional<T> value;
  std::vector<Diagnostic> diagnostics;

  explicit operator bool() const noexcept { return value.has_value(); }
  const T& operator*() const noexcept { return *value; }
  T& operator*() noexcept { return *value; }
  const T* operator->() const noexcept { return &*value; }
  T* operator->() noexcept { return &*value; }
};

template <class T>
Loaded<T> loaded(T value, Report& report) {
  const bool failed = report.has_errors();
  Loaded<T> result{std::nullopt, report.take()};
  if (!failed) result.value = std::move(value);
  return result;
}

// Returns "; did you mean 'gain'?" if a word of `known` is close to `word`, ignoring case;
// otherwise an empty text.
std::string suggestion(std::string_view word, std::span<const std::string> known);

// Returns text from a file in a form for messages: shortened, control characters replaced.
std::string quotable(std::string_view text);

}  // namespace loopwarden::config
