// SPDX-License-Identifier: Apache-2.0
// The files that a command writes.
//
// Each is written under a temporary name in the folder where it belongs; commit() gives all of them their names. Until
// then what stood there stays, and whatever ends the command before (an error, a full disk, Ctrl-C) leaves no
// trace. An output that is one of the command's inputs, by whatever name, is refused.
//
// A kill or a power failure can come between two names. commit() gives them in the order in which
// the files were added, after the disk has all of their data, so that the caller decides what is
// there then: a file that another one refers to is added before it, and the file that says that all
// is there is added last.
#pragma once

#include <deque>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "workbench/files/command_error.hpp"

namespace loopwarden::workbench {

class OutputError : public CommandError {
 public:
  using CommandError::CommandError;
};

class OutputFiles {
 public:
  // `inputs`: the files that the command reads; empty names are passed over. Throws OutputError as all do here:
  // usage where an output is an input, else I/O.
  explicit OutputFiles(std::vector<std::string> inputs = {});
  OutputFiles(const OutputFiles&) = delete;
  OutputFiles& operator=(const OutputFiles&) = delete;
  ~OutputFiles();

  // Makes the folder now where it is missing; gone again without commit().
  void make_folder(const std::filesystem::path& folder);
  // A folder of the user's own for what stands between and is never committed: it goes with this.
  std::filesystem::path make_scratch_folder();
  // The name under which to write what becomes `path`; the same for the same path. What a RecordCsvWriter
  // leaves beside it is removed as well. Counts as added now, unless it is added later.
  std::filesystem::path stage(const std::filesystem::path& path);
  // Refuses now what would be refused after the work.
  void expect(const std::filesystem::path& path) { stage(path); }
  void add(const std::filesystem::path& path, std::string_view text);
  // Waits for the disk.
  void commit();

  // `message` with the temporary names replaced by those that the user knows.
  std::string in_users_words(std::string message) const;

 private:
  struct Staged {
    std::filesystem::path asked;   // as the user wrote it
    std::filesystem::path target;  // links followed
    std::filesystem::path temporary;
    bool stream = false;  // a pipe or device: written to, not replaced
  };

  struct Named {
    const Staged* staged;
    bool replaced = false;
    // The file that was there; empty: there was none, or the file system keeps no second name.
    std::filesystem::path earlier;
  };

  void refuse_input(const std::filesystem::path& path) const;
  int sync_data(std::filesystem::path& failed) const;
  // Returns errno, with the file in `failed`.
  int give_names(std::vector<Named>& done, std::filesystem::path& failed) const;

  std::vector<std::filesystem::path> inputs_;
  std::deque<Staged> staged_;
  std::vector<std::filesystem::path> folders_;
};

// One file alone.
void write_output(const std::filesystem::path& path, std::string_view text,
                  std::vector<std::string> inputs = {});

}  // namespace loopwarden::workbench
