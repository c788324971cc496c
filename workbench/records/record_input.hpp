// SPDX-License-Identifier: Apache-2.0
// How every command takes records: the strict format and any historian's export (record/import/importer.hpp), with the
// same options everywhere, and a line on the error output that says what was found and done.
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

// What is wrong with the options or the format file.
class RecordInputError : public CommandError {
 public:
  using CommandError::CommandError;
};

class RecordInput {
 public:
  // `one_loop`: the command takes one loop, by --loop where a file has several.
  void add_options(Command& command, bool one_loop = true);
  // For commands that take whole folders: after add_options.
  void add_rules(Command& command);
  // Throws RecordInputError.
  record::ImportOptions options() const;
  // Throws RecordError, RecordInputError. Shows progress with a large file.
  record::Imported read(const std::filesystem::path& path) const;

  const std::string& loop() const noexcept { return loop_; }
  bool has_rules() const noexcept { return !rules_.empty(); }
  bool takes(const std::string& tag) const;  // no --loop, or this one

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

// Values that were stored by exception, drawn as they may have been instead of held: for judging, not for keeping.
void draw_for_judging(record::Imported& imported);
// Samples in manual become missing ones; how many. A record without a mode stays as it is.
std::size_t leave_out_manual(record::Record& record);

// First sample of the part of this length in which most moves, in automatic and complete.
std::size_t telling_part(const record::Record& record, std::size_t length);

// Of a record of more than twice `most` samples that part only; says so on the error output.
void keep_telling_part(record::Record& record, std::size_t most, const std::string& name);

// That names belong to no loop, with some of them and the option that helps; empty where all do. Then each of the rules
// that decides of no name.
std::string rules_text(const record::Importer& importer, bool with_rules);

// What was found and done, in lines; empty where the record is in the fixed format and nothing is to be said. Words that
// were taken as bad values are left to record::bad_words_text(), since several loops may have them.
std::string import_text(const record::Imported& imported);

// Of the files of an importer those that gave some loop, and those that failed one.
struct FilesRead {
  std::set<std::size_t> good, bad;

  std::size_t lost() const;  // that gave none
};

// The exit code of what reads many loops: 0 where all was read, else 65, also where the rest was done; 74 where nothing
// was read since the system refused a file.
ExitCode reading_exit_code(bool something_failed, bool nothing_read,
                           const record::Importer& importer);

}  // namespace loopwarden::workbench
