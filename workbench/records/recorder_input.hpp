// SPDX-License-Identifier: Apache-2.0
// What the recorder of a running daemon holds of a loop, for commands that otherwise take records from files.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "model/analysis/identification.hpp"
#include "protocol/answers.hpp"
#include "workbench/command_line/command.hpp"

namespace loopwarden::workbench {

// A time such as 4h, 90min, 2d or 45s, in s; nullopt: it is none, or not above 0.
std::optional<double> seconds_of(const std::string& text);

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

// The options --last and --socket; --loop is RecordInput's.
class RecorderInput {
 public:
  // `kept`: where the records stay, as a sentence of the help.
  void add_options(Command& command, const char* kept);
  // Whether --last was given, with `loop` and without files. Ends the command as wrong usage where there are files and it
  // was, or neither.
  bool asked(bool files, const std::string& loop) const;
  // What the recorder holds of the loop, as files in `target`: a restart of the daemon or a long gap begins another. Those
  // below kShortest_s are left out, unless all are. `place` as in record::ExportSettings. Throws CommandError where the
  // daemon does not know the loop or has recorded nothing of it, RecordError, std::runtime_error where no daemon answers.
  Recorded take(
      const std::string& loop, const std::filesystem::path& target,
      const std::function<std::filesystem::path(const std::filesystem::path&)>& place = {}) const;

 private:
  std::string socket_;
  std::string last_;
};
inline constexpr double kShortest_s = 300.0;

}  // namespace loopwarden::workbench
