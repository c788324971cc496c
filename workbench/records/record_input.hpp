// SPDX-License-Identifier: Apache-2.0
// Reads records for every command: the strict format and any historian's export
// (record/import/importer.hpp). All commands have the same options. A line on standard error
// reports the findings and corrections.
#pragma once

#include <cstddef>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "record/import/importer.hpp"
#include "workbench/command_line/command.hpp"
#include "workbench/files/command_error.hpp"

namespace loopwarden::workbench {

// An error of the options or the format file.
class RecordInputError : public CommandError {
 public:
  using CommandError::CommandError;
};

class RecordInput {
 public:
  // `one_loop`: the command takes one loop. --loop selects it if a file has several.
  void add_options(Command& command, bool one_loop = true);
  // Adds the options of commands that take whole folders. Call after add_options.
  void add_rules(Command& command);
  // Throws RecordInputError.
  record::ImportOptions options() const;
  // Throws RecordError, RecordInputError. Shows progress with a large file.
  record::Imported read(const std::filesystem::path& path) const;

  const std::string& loop() const noexcept { return loop_; }
  bool has_rules() const noexcept { return !rules_.empty(); }
  bool takes(const std::string& tag) const;  // true for --loop TAG or without --loop

 private:
  std::string loop_;
  std::string map_;
  std::string format_;
  std::string rules_;
  std::string delimiter_, decimal_, encoding_, time_, time_column_, zone_, fill_;
  std::vector<std::string> bad_values_;
  int header_rows_ = -1;
  double period_s_ = 0.0;
};

// Replaces held values of an archive that stores by exception with interpolated ones. Use it for
// judging only, not for files.
void draw_for_judging(record::Imported& imported);
// Marks samples in manual as missing and returns their number. A record without a mode is
// unchanged.
std::size_t leave_out_manual(record::Record& record);

// Returns the first sample of the stretch of this length that has most moves in automatic and is
// complete.
std::size_t telling_part(const record::Record& record, std::size_t length);

// Cuts a record of more than twice `most` samples to that stretch. Reports this on standard error.
void keep_telling_part(record::Record& record, std::size_t most, const std::string& name);

// Returns a text about names that belong to no loop, with examples and the option that helps. The
// text also lists each rule without effect. May be empty.
std::string rules_text(const record::Importer& importer, bool with_rules);

// Returns the findings and corrections as lines. Empty if the record is in the fixed format and
// there is no finding. record::bad_words_text() reports words that were read as bad values, because
// several loops may have them.
std::string import_text(const record::Imported& imported);

// The files of an importer that yielded a loop, and the files for which a loop failed.
struct FilesRead {
  std::set<std::size_t> good, bad;

  std::size_t lost() const;  // number of files that yielded no loop
};

// Returns the exit code of commands that read many loops: 0 if all was read, otherwise 65, even if
// the other loops were processed. 74 if the system refused a file and no loop was read.
ExitCode reading_exit_code(bool something_failed, bool nothing_read,
                           const record::Importer& importer);

}  // namespace loopwarden::workbench
