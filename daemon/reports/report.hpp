// SPDX-License-Identifier: Apache-2.0
// A report that somebody asked for: what of, how far it is, and about.json in its folder, which tells it to the next start.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace loopwarden::daemon::reports {

// The commands of `loopwarden` that make them, by their names.
enum class Kind : std::uint8_t { gap, commission, survey, diagnose };
inline constexpr std::array kKinds{Kind::gap, Kind::commission, Kind::survey, Kind::diagnose};
const char* to_text(Kind kind) noexcept;
std::optional<Kind> kind_of(std::string_view name) noexcept;
// The file that is the report, in the report's folder.
const char* page_of(Kind kind) noexcept;

enum class State : std::uint8_t { waiting, running, done, failed };
const char* to_text(State state) noexcept;

struct Order {
  std::string loop;
  Kind kind = Kind::gap;
  std::int64_t from_ms = 0;  // UTC, as all times here
  std::int64_t to_ms = 0;
  std::string by;    // who asked
  std::string twin;  // the loop's, a file; empty: it has none
};

struct Report {
  std::string name;  // of its folder: TAG-KIND-UTC
  Order order;
  std::int64_t asked_ms = 0;
  State state = State::waiting;
  std::int64_t started_ms = 0;
  std::string doing;  // while it runs: what, and how much of that
  int percent = 0;
  std::int64_t ended_ms = 0;
  std::string sentence;   // what the command said last
  bool has_page = false;  // of a failed one too, where the command wrote why
  std::size_t place = 0;  // while it waits, from 1

  bool ended() const noexcept { return state == State::done || state == State::failed; }
};

std::string name_of(const Order& order, std::int64_t asked_ms);

// Throws std::runtime_error.
void write_about(const Report& report, const std::filesystem::path& folder);
// Nothing where there is none, or none that can be read.
std::optional<Report> read_about(const std::filesystem::path& folder);

}  // namespace loopwarden::daemon::reports
