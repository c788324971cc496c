// SPDX-License-Identifier: Apache-2.0
// Exports the records of a loop from the recorder of a running daemon, for commands that otherwise
// read files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "model/analysis/identification.hpp"
#include "daemon/protocol/answers.hpp"
#include "record/segment_export.hpp"
#include "workbench/command_line/command.hpp"

namespace loopwarden::workbench {

// Returns a duration such as 4h, 90min, 2d or 45s in s. nullopt if it is invalid or not above 0.
std::optional<double> seconds_of(const std::string& text);

// Returns a UTC time such as 2026-11-26T10:00:00Z in ns since 1970. nullopt if it is invalid or has
// no zone.
std::optional<std::int64_t> utc_ns_of(const std::string& text);

struct Recorded {
  struct Record {
    std::string path;
    std::size_t rows = 0;
    std::int64_t start_utc_ns = 0;
  };
  protocol::LoopDescription loop;  // from the daemon
  std::vector<Record> records;     // in order of time, at least one

  const Record& longest() const;
  analysis::KnownRanges ranges() const;
};

// Exports the records of a loop of a running daemon to files in `target`. A restart of the daemon
// or a long gap starts a new record. Records shorter than kShortest_s are left out, unless all are.
// Throws CommandError if the daemon does not have the loop or has no record of it, RecordError, or
// std::runtime_error if no daemon answers.
Recorded take_recorded(const std::string& socket, const std::string& loop,
                       const std::filesystem::path& target, const record::ExportSettings& settings);

// Adds the options --last, --since, --until, --socket and --background. RecordInput adds --loop.
class RecorderInput {
 public:
  // `kept`: a sentence of the help with the place of the exported records.
  void add_options(Command& command, const char* kept);
  // Returns whether a time was given, with `loop` and without files. Ends the command with a usage
  // error if both files and a time were given, or neither. Switches to background work if that was
  // requested.
  bool asked(bool files, const std::string& loop) const;
  bool given() const noexcept { return !last_.empty() || !since_.empty(); }
  bool background() const noexcept { return background_; }
  const std::string& socket() const noexcept { return socket_; }
  // Exports the records of the time as take_recorded(). `place` as in record::ExportSettings.
  Recorded take(
      const std::string& loop, const std::filesystem::path& target,
      const std::function<std::filesystem::path(const std::filesystem::path&)>& place = {}) const;

 private:
  std::string socket_;
  std::string last_, since_, until_;
  bool background_ = false;
};
inline constexpr double kShortest_s = 300.0;

}  // namespace loopwarden::workbench
