// SPDX-License-Identifier: Apache-2.0
// Imports exports of historians as records: files, folders of files, standard input.
//
//   Containers       archives and workbooks as folders                       containers.hpp
//   TextSource       lines, independent of packing and encoding              text_source.hpp
//   Layout           meaning of rows and columns                             layout.hpp
//   file reader      rows and cells                                          file_reader.hpp
//   tags             columns or tags that form a loop                        tags.hpp
//   constant period  samples, missing ones, values left out by an archive    constant_period.hpp
//
// Text is streamed. A file needs memory only for the values of the loops that are read, 8 bytes
// each.
// Limits: it can't read sources without text columns (OPC servers, SQL), or several header lines
// within a file.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "record/import/constant_period.hpp"
#include "record/import/containers.hpp"
#include "record/import/file_reader.hpp"
#include "record/import/layout.hpp"

namespace loopwarden::record {

struct FoundLoop {
  LoopSignals signals;             // by the names in the files
  std::string tag;                 // its name: from the file's content, otherwise the file's name
  std::vector<std::size_t> files;  // for Importer::file()
};

struct FileProblem {
  std::string file;
  std::string why;  // problem with the file's name in front
  RecordError::Kind kind = RecordError::Kind::data;
};

// Receive each loop that was read, and the errors of a loop or of one of its files. If only one of
// its files has an error, the other files are still passed to TakeLoop.
using TakeLoop = std::function<void(std::size_t loop, Imported imported)>;
using FailLoop = std::function<void(std::size_t loop, std::size_t file, const RecordError& error)>;

class Importer {
 public:
  // Finds the loops in `paths`. A folder stands for all exports in it and below (.csv .txt .tsv
  // .dat, also .gz; .zip, .xlsx), an archive for its exports, a workbook for its sheets. Throws
  // RecordError if a path in `paths` can't be used. A file within a folder becomes a problem
  // instead, and with `lenient` a path of `paths` as well. Also throws if rules make two names the
  // same signal of one loop.
  Importer(const std::vector<std::filesystem::path>& paths, ImportOptions options,
           bool lenient = false, const ImportProgress& progress = {});

  const std::vector<FoundLoop>& loops() const noexcept { return loops_; }
  const std::vector<FileProblem>& problems() const noexcept { return problems_; }
  // Returns the number of exports. FoundLoop::files contains their indices.
  std::size_t files() const noexcept { return sources_.size(); }
  const std::filesystem::path& file(std::size_t number) const { return sources_[number].path; }
  // Returns the file on the disk: for a member, its archive.
  const std::filesystem::path& on_disk(std::size_t number) const {
    return sources_[number].on_disk;
  }
  // Returns files in folders and archives that are no exports, with the reason.
  const std::vector<FileProblem>& passed_over() const noexcept { return passed_over_; }
  // Returns one line per reason: "skipped: a.pdf, b.pdf: PDF holds no values that can be read";
  // empty if no file was skipped.
  std::string passed_over_text() const;
  // Returns one line per file whose dates were read in an order that it does not prove.
  const std::vector<std::string>& assumed() const noexcept { return assumed_; }
  // Returns names that belong to no loop.
  const std::vector<std::string>& other_names() const noexcept { return other_names_; }
  // Returns the rules that match no name or have no effect, each with the reason.
  std::vector<std::string> idle_rules() const;
  // Returns a message that no loop has a PV, with some of the names and the option that helps.
  std::string no_pv() const;
  // Returns names without a role that look like PV and CO of one loop (FT129, FV129), with the
  // option to use them; empty: no such names.
  std::string pairs_hint() const;

  // Reads the loops `which` of loops(). `take` receives each one, in order, and `fail` its errors.
  // Each file is read once. Exceptions of both functions are passed on.
  void read(std::span<const std::size_t> which, const TakeLoop& take, const FailLoop& fail,
            const ImportProgress& progress = {});
  Imported read_one(std::size_t loop, const ImportProgress& progress = {});
  // Returns the approximate memory for the values of a loop from all its files.
  std::uint64_t bytes_of(std::size_t loop) const;

 private:
  struct Source {
    std::filesystem::path path, on_disk;
    std::string tag;  // name for a loop that has none
    Layout layout;
    std::string layout_text;
    std::uint64_t rows = 0;  // approximate
  };

  struct ToLookAt;

  void find_files(const std::filesystem::path& path, bool lenient, std::vector<ToLookAt>& files);
  void find_in_folder(const std::filesystem::path& folder, std::vector<ToLookAt>& files);
  void find_in_container(const std::filesystem::path& path, std::vector<ToLookAt>& files);
  void look_at(const ToLookAt& file, const ImportProgress& progress);
  std::unique_ptr<TextSource> open(const std::filesystem::path& path);
  ImportOptions options_for(const TextSource& text) const;
  std::string name_of(std::size_t file) const;
  std::vector<std::string> names_in(const std::filesystem::path& path, const Layout& layout,
                                    const ImportProgress& progress);
  std::vector<LoopSignals> asked_for(std::size_t file, const std::vector<std::string>& names) const;
  void take_units(std::size_t file, LoopSignals& signals) const;
  void join(FoundLoop& same, const LoopSignals& signals);
  void add_loop(std::size_t file, LoopSignals signals);
  void add_loops(std::size_t file, const std::vector<std::string>& names);
  Imported finished(std::size_t loop, std::vector<ImportPart>& pieces) const;

  ImportOptions options_;
  std::vector<Source> sources_;  // by the number of the file
  std::vector<FoundLoop> loops_;
  std::unordered_map<std::string, std::size_t> by_tag_;  // the first of loops_ with this tag
  std::vector<FileProblem> problems_;
  std::vector<FileProblem> passed_over_;
  std::vector<std::string> assumed_;
  std::vector<std::string> other_names_;
  Containers containers_;
  std::vector<RuleUse> rule_use_;
  std::set<std::string> clashes_;  // between rules
  std::unique_ptr<TextSource> stdin_;
  std::shared_ptr<std::FILE> stdin_copy_;  // needed because a long table is read twice
};

// Imports one loop of one path, for commands. `loop`: its tag, or empty if there is only one. A
// file in the fixed format of the project is read directly, with its own errors.
Imported import_record(const std::filesystem::path& path, const std::string& loop,
                       const ImportOptions& options, const ImportProgress& progress = {});

}  // namespace loopwarden::record
