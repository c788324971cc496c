// SPDX-License-Identifier: Apache-2.0
// What the recorder of a running daemon holds of a loop, for commands that otherwise take records from files.
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
#include "workbench/command_line/command.hpp"

namespace loopwarden::workbench {

// A time such as 4h, 90min, 2d or 45s, in s; nullopt: it is none, or not above 0.
std::optional<double> seconds_of(const std::string& text);

// A UTC time such as 2026-11-26T10:00:00Z, in ns since 1970; nullopt: it is none, or of no zone.
std::optional<std::int64_t> utc_ns_of(const std::string& text);

struct Recorded {
  struct Record {
    std::string path;
    std::size_t rows = 0;
  };
  protocol::LoopDescription loop;  // as the daemon has it
  std::vector<Record> records;     // in the order of time, at least one

  const Record& longest() const;
  analysis::KnownRanges ranges() const;
};

// The options --last, --since, --until, --socket and --background; --loop is RecordInput's.
class RecorderInput {
 public:
  // `kept`: where the records stay, as a sentence of the help.
  void add_options(Command& command, const char* kept);
  // Whether a time was given, with `loop` and without files. Ends the command as wrong usage where there are files and it
  // was, or neither. The process works in the background from here on, if it shall.
  bool asked(bool files, const std::string& loop) const;
  bool given() const noexcept { return !last_.empty() || !since_.empty(); }
  bool background() const noexcept { return background_; }
  const std::string& socket() const noexcept { return socket_; }
  // What the recorder holds of the loop, as files in `target`: a restart of the daemon or a long gap begins another. Those
  // below kShortest_s are left out, unless all are. `place` as in record::ExportSettings. Throws CommandError where the
  // daemon does not know the loop or has recorded nothing of it, RecordError, std::runtime_error where no daemon answers.
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
