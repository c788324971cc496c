// SPDX-License-Identifier: Apache-2.0
// Any historian's export as records: files, folders of them, standard input.
//
//   TextSource       lines, whatever the file is packed and encoded in       text_source.hpp
//   Layout           what stands where                                       layout.hpp
//   tags             which columns or tags make a loop                       tags.hpp
//   constant period  samples, missing ones, what an archive left out         constant_period.hpp
//
// Text is streamed: what a file takes of memory is the values of the loops that are read, 8 bytes each.
// What it can't do: records that no column of text holds (OPC servers, SQL), several header lines within a file, times
// of one tag that lie in several columns.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "record/import/constant_period.hpp"
#include "record/import/layout.hpp"

namespace loopwarden::record {

struct FoundLoop {
  LoopSignals signals;             // by the names in the files
  std::string tag;                 // to call it by: the name in the files, else the file's
  std::vector<std::size_t> files;  // of Importer::files()
};

struct FileProblem {
  std::string file;
  std::string why;
};

// Called now and then with the share of the work that is done, 0 to 1.
using ImportProgress = std::function<void(double)>;

class Importer {
 public:
  // A folder stands for the exports in it and below (.csv .txt .tsv .dat, also .gz). Throws RecordError where a path
  // that was named can't be used; of a file within a folder it becomes a problem.
  // `lenient`: of a named path as well.
  Importer(const std::vector<std::filesystem::path>& paths, ImportOptions options,
           bool lenient = false);

  const std::vector<FoundLoop>& loops() const noexcept { return loops_; }
  const std::vector<FileProblem>& problems() const noexcept { return problems_; }
  const std::vector<std::filesystem::path>& files() const noexcept { return files_; }
  // Names that belong to no loop.
  const std::vector<std::string>& other_names() const noexcept { return other_names_; }

  // Of loops(): `take` gets each, in order, or what was wrong with it. One pass over every file that has any of them.
  void read(std::span<const std::size_t> which,
            const std::function<void(std::size_t loop, Imported imported)>& take,
            const std::function<void(std::size_t loop, const RecordError& error)>& fail,
            const ImportProgress& progress = {});
  Imported read_one(std::size_t loop, const ImportProgress& progress = {});
  // Values of a loop when all its files are read, about; for what fits into memory.
  std::uint64_t bytes_of(std::size_t loop) const;

 private:
  struct Source {
    Layout layout;
    std::string layout_text;
    std::uint64_t rows = 0;  // about
  };

  void look_at(const std::filesystem::path& path, bool named);
  void look_at_folder(const std::filesystem::path& folder);
  std::vector<std::string> names_in(const std::filesystem::path& path, const Layout& layout) const;
  void add_loops(std::size_t file, const std::vector<std::string>& names);
  bool path_is_stdin_long(std::size_t file) const;

  ImportOptions options_;
  std::vector<std::filesystem::path> files_;
  std::vector<Source> sources_;
  std::vector<FoundLoop> loops_;
  std::vector<FileProblem> problems_;
  std::vector<std::string> other_names_;
  std::unique_ptr<TextSource> stdin_;
};

// One loop of one path, as commands take it: `loop` by its tag, or empty where there is one only. A file in the fixed
// format of the project is read as that, with its own errors.
Imported import_record(const std::filesystem::path& path, const std::string& loop,
                       const ImportOptions& options, const ImportProgress& progress = {});

}  // namespace loopwarden::record
