// SPDX-License-Identifier: Apache-2.0
// Writes the output files of a command so that they appear only when the command succeeds.
//
// Each file is written under a temporary name in its target folder. commit() renames all of them.
// Until then, existing files keep their content. An error, a full disk or Ctrl-C before commit()
// removes the temporary files. An output that is also an input of the command is refused, whatever
// name it has.
//
// A kill or a power failure can happen between two renames. commit() renames the files in the order
// in which they were added, after all of their data is on the disk. Add a file before the files
// that refer to it. Add the file that marks the set as complete last.
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
  // `inputs`: the files that the command reads; empty names are ignored. All functions throw
  // OutputError: a usage error if an output is an input, otherwise an I/O error.
  explicit OutputFiles(std::vector<std::string> inputs = {});
  OutputFiles(const OutputFiles&) = delete;
  OutputFiles& operator=(const OutputFiles&) = delete;
  ~OutputFiles();

  // Creates the folder now if it is missing. It is removed again without commit().
  void make_folder(const std::filesystem::path& folder);
  // Creates a temporary folder for intermediate files. The destructor removes it.
  std::filesystem::path make_scratch_folder();
  // Returns the temporary name for `path`; the same path returns the same name. Removes the
  // additional files of a RecordCsvWriter as well. The file counts as added now, unless add()
  // follows.
  std::filesystem::path stage(const std::filesystem::path& path);
  // Refuses a path now instead of after the work.
  void expect(const std::filesystem::path& path) { stage(path); }
  void add(const std::filesystem::path& path, std::string_view text);
  // Waits until the data is on the disk, then renames the files.
  void commit();

  // Returns `message` with the user's file names in place of the temporary ones.
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
    // The file that existed before. Empty if no file existed or the file system has no hard links.
    std::filesystem::path earlier;
  };

  void refuse_input(const std::filesystem::path& path) const;
  int sync_data(std::filesystem::path& failed) const;
  // Returns errno. `failed` receives the file.
  int give_names(std::vector<Named>& done, std::filesystem::path& failed) const;

  std::vector<std::filesystem::path> inputs_;
  std::deque<Staged> staged_;
  std::vector<std::filesystem::path> folders_;
};

// Writes a single output file.
void write_output(const std::filesystem::path& path, std::string_view text,
                  std::vector<std::string> inputs = {});

}  // namespace loopwarden::workbench
