// SPDX-License-Identifier: Apache-2.0
// What is wrong with a file and where, in the form of a compiler's messages:
//   loops.d/FIC-101.yaml:14:9: error: controller.ti: must be > 0 s (got 0)
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace loopwarden::config {

// Both count from 1; line 0 stands for the file as a whole. Columns count bytes.
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
  // Nothing is wrong; but who reads the file should know.
  void note(Place place, std::string_view key, std::string message);

  const std::string& file() const noexcept { return file_; }
  std::size_t error_count() const noexcept { return errors_; }
  bool has_errors() const noexcept { return errors_ > 0; }
  // By its place; there must be one.
  const Diagnostic& first_error() const noexcept;
  // In the order of their places; leaves the report empty.
  std::vector<Diagnostic> take();

 private:
  std::string file_;
  std::vector<Diagnostic> diagnostics_;
  std::size_t errors_ = 0;
};

// What was read, unless there were errors; warnings may stand beside a value.
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

// "; did you mean 'gain'?" if one of `known` is close enough to `word`, in either case, else
// nothing.
std::string suggestion(std::string_view word, std::span<const std::string> known);

// Text from a file as it may stand in a message: shortened, control characters replaced.
std::string quotable(std::string_view text);

}  // namespace loopwarden::config
