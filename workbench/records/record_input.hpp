// SPDX-License-Identifier: Apache-2.0
// How every command takes records: the strict format and any historian's export (record/import/importer.hpp), with the
// same options everywhere, and a line on the error output that says what was found and done.
#pragma once

#include <CLI/CLI.hpp>

#include <filesystem>
#include <string>
#include <vector>

#include "record/import/importer.hpp"
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
  void add_options(CLI::App& sub, bool one_loop = true);
  // Throws RecordInputError.
  record::ImportOptions options() const;
  // Throws RecordError, RecordInputError. Shows progress with a large file.
  record::Imported read(const std::filesystem::path& path) const;

  const std::string& loop() const noexcept { return loop_; }

 private:
  std::string loop_;
  std::string map_;
  std::string format_;
  std::string delimiter_, decimal_, encoding_, time_, time_column_, zone_, fill_;
  std::vector<std::string> bad_values_;
  int header_rows_ = -1;
  double period_s_ = 0.0;
};

// What was found and done, in lines; empty where the record is in the fixed format and nothing is to be said.
std::string import_text(const record::Imported& imported);

}  // namespace loopwarden::workbench
