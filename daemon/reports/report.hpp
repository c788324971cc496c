// SPDX-License-Identifier: Apache-2.0
// A requested report: its kind, its progress, and about.json in its folder, which restores it at
// the next start.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace loopwarden::daemon::reports {

// Kinds of reports, named after the commands of `loopwarden` that make them.
enum class Kind : std::uint8_t { gap, commission, survey, diagnose, receipt };
inline constexpr std::array kKinds{Kind::gap, Kind::commission, Kind::survey, Kind::diagnose,
                                   Kind::receipt};
const char* to_text(Kind kind) noexcept;
std::optional<Kind> kind_of(std::string_view name) noexcept;
// Returns the name of the report's main file in its folder.
const char* page_of(Kind kind) noexcept;

enum class State : std::uint8_t { waiting, running, done, failed };
const char* to_text(State state) noexcept;

struct Order {
  std::string loop;
  Kind kind = Kind::gap;
  std::int64_t from_ms = 0;  // UTC, like all times here
  std::int64_t to_ms = 0;
  std::string by;    // the requesting user
  std::string twin;  // file of the loop's twin; empty: no twin
  // The report is made from this time on, because its record ends then; 0: at once.
  std::int64_t due_ms = 0;
};

struct Report {
  std::string name;  // name of its folder: TAG-KIND-UTC
  Order order;
  std::int64_t asked_ms = 0;
  State state = State::waiting;
  std::int64_t started_ms = 0;
  std::string doing;  // present step and its progress; only while it runs
  int percent = 0;
  std::int64_t ended_ms = 0;
  std::string sentence;   // the last sentence that the command printed
  bool has_page = false;  // also for a failed report, if the command wrote the reason
  std::size_t place = 0;  // position in the queue, from 1; only while it waits

  bool ended() const noexcept { return state == State::done || state == State::failed; }
};

std::string name_of(const Order& order, std::int64_t asked_ms);

// Throws std::runtime_error.
void write_about(const Report& report, const std::filesystem::path& folder);
// Returns nullopt if the file is missing or unreadable.
std::optional<Report> read_about(const std::filesystem::path& folder);

}  // namespace loopwarden::daemon::reports
