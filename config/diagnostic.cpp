// SPDX-License-Identifier: Apache-2.0
#include "config/diagnostic.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/edit_distance.hpp"
#include "base/text.hpp"

namespace loopwarden::config {
namespace {

constexpr std::size_t kMostDiagnostics = 100;  // per file

}  // namespace

std::string to_text(Place place) { return fmt::format("{}:{}", place.line, place.column); }

const char* to_text(Diagnostic::Level level) noexcept {
  switch (level) {
    case Diagnostic::Level::note: return "note";
    case Diagnostic::Level::warning: return "warning";
    case Diagnostic::Level::error: break;
  }
  return "error";
}

std::string to_text(const Diagnostic& diagnostic) {
  std::string text = diagnostic.file;
  if (diagnostic.place.line > 0) text += fmt::format(":{}", to_text(diagnostic.place));
  text += fmt::format(": {}: ", to_text(diagnostic.level));
  if (!diagnostic.key.empty()) text += fmt::format("{}: ", diagnostic.key);
  return text + diagnostic.message;
}

std::string to_text(std::span<const Diagnostic> diagnostics) {
  std::string text;
  for (const Diagnostic& diagnostic : diagnostics) text += fmt::format("{}\n", to_text(diagnostic));
  return text;
}

bool has_errors(std::span<const Diagnostic> diagnostics) noexcept {
  return std::any_of(diagnostics.begin(), diagnostics.end(), [](const Diagnostic& diagnostic) {
    return diagnostic.level == Diagnostic::Level::error;
  });
}

void Report::error(Place place, std::string_view key, std::string message) {
  ++errors_;
  diagnostics_.push_back(
      {Diagnostic::Level::error, file_, place, std::string(key), std::move(message)});
}

void Report::warning(Place place, std::string_view key, std::string message) {
  diagnostics_.push_back(
      {Diagnostic::Level::warning, file_, place, std::string(key), std::move(message)});
}

void Report::note(Place place, std::string_view key, std::string message) {
  diagnostics_.push_back(
      {Diagnostic::Level::note, file_, place, std::string(key), std::move(message)});
}

const Diagnostic& Report::first_error() const noexcept {
  return *std::min_element(diagnostics_.begin(), diagnostics_.end(),
                           [](const Diagnostic& a, const Diagnostic& b) {
                             const bool error_a = a.level == Diagnostic::Level::error;
                             const bool error_b = b.level == Diagnostic::Level::error;
                             return error_a != error_b ? error_a : a.place < b.place;
                           });
}

std::vector<Diagnostic> Report::take() {
  std::stable_sort(diagnostics_.begin(), diagnostics_.end(),
                   [](const Diagnostic& a, const Diagnostic& b) { return a.place < b.place; });
  if (diagnostics_.size() > kMostDiagnostics) {
    const std::size_t more = diagnostics_.size() - kMostDiagnostics;
    const bool failed = errors_ > 0;
    diagnostics_.resize(kMostDiagnostics);
    diagnostics_.push_back({failed ? Diagnostic::Level::error : Diagnostic::Level::warning,
                            file_,
                            {},
                            "",
                            fmt::format("{} more are not shown", more)});
  }
  errors_ = 0;
  return std::exchange(diagnostics_, {});
}

std::string suggestion(std::string_view word, std::span<const std::string> known) {
  constexpr std::size_t kLongestWord = 40;
  if (word.size() < 2 || word.size() > kLongestWord) return {};
  const std::string lower = base::lower_case(word);
  std::size_t best_distance = std::max<std::size_t>(1, word.size() / 3) + 1;
  std::string_view best;
  for (const std::string& candidate : known) {
    const std::size_t distance = base::edit_distance(lower, base::lower_case(candidate));
    if (distance < best_distance) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best.empty() ? std::string() : fmt::format("; did you mean '{}'?", best);
}

std::string quotable(std::string_view text) {
  constexpr std::size_t kMostCharacters = 60;
  std::string shown(base::cut(text, kMostCharacters));
  const bool cut = shown.size() < text.size();
  for (char& c : shown) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7F) c = '?';
  }
  return cut ? fmt::format("{}...", shown) : shown;
}

}  // namespace loopwarden::config
