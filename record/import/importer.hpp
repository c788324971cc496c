// SPDX-License-Identifier: Apache-2.0
// Any historian's export as records: files, folders of them, standard input.
//
//   Containers       archives and workbooks as folders                       containers.hpp
//   TextSource       lines, whatever the file is packed and encoded in       text_source.hpp
//   Layout           what stands where                                       layout.hpp
//   file reader      rows and cells                                          file_reader.hpp
//   tags             which columns or tags make a loop                       tags.hpp
//   constant period  samples, missing ones, what an archive left out         constant_period.hpp
//
// Text is streamed: what a file takes of memory is the values of the loops that are read, 8 bytes each.
// What it can't do: records that no column of text holds (OPC servers, SQL), several header lines within a file.
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
  std::string tag;                 // to call it by: the name in the files, else the file's
  std::vector<std::size_t> files;  // for Importer::file()
};

struct FileProblem {
  std::string file;
  std::string why;  // for a problem with the file's name
  RecordError::Kind kind = RecordError::Kind::data;
};

// Each loop that was read; and what kept a loop from being read, or one of its files, where the rest goes to TakeLoop.
using TakeLoop = std::function<void(std::size_t loop, Imported imported)>;
using FailLoop = std::function<void(std::size_t loop, std::size_t file, const RecordError& error)>;

class Importer {
 public:
  // A folder stands for the exports in it and below (.csv .txt .tsv .dat, also .gz; .zip, .xlsx), an archive for those in
  // it, a workbook for its sheets. Throws RecordError where a path that was named can't be used; of a file within a folder
  // it becomes a problem. `lenient`: of a named path as well. Throws,
  // too, where two names are the same signal of one loop by rule.
  Importer(const std::vector<std::filesystem::path>& paths, ImportOptions options,
           bool lenient = false, const ImportProgress& progress = {});

  const std::vector<FoundLoop>& loops() const noexcept { return loops_; }
  const std::vector<FileProblem>& problems() const noexcept { return problems_; }
  // Files that are exports, by their number in FoundLoop::files.
  std::size_t files() const noexcept { return sources_.size(); }
  const std::filesystem::path& file(std::size_t number) const { return sources_[number].path; }
  // What lies on the disk for it: the archive of a member.
  const std::filesystem::path& on_disk(std::size_t number) const {
    return sources_[number].on_disk;
  }
  // In folders and archives: what is no export, with the reason.
  const std::vector<FileProblem>& passed_over() const noexcept { return passed_over_; }
  // A line a reason: "passed over: a.pdf, b.pdf: PDF holds no values that can be read"; empty: nothing was.
  std::string passed_over_text() const;
  // Names that belong to no loop.
  const std::vector<std::string>& other_names() const noexcept { return other_names_; }
  // Rules that decide of no name, each with the reason.
  std::vector<std::string> idle_rules() const;
  // That none has a PV, with some of the names and the option that helps.
  std::string no_pv() const;
  // Names without a role that look like PV and CO of one loop (FT129, FV129), and how to say so; empty: none.
  std::string pairs_hint() const;

  // Of loops(): `take` gets each, in order, `fail` what was wrong. One pass over every file that has any of them. What
  // they throw comes through.
  void read(std::span<const std::size_t> which, const TakeLoop& take, const FailLoop& fail,
            const ImportProgress& progress = {});
  Imported read_one(std::size_t loop, const ImportProgress& progress = {});
  // Values of a loop when all its files are read, about; for what fits into memory.
  std::uint64_t bytes_of(std::size_t loop) const;

 private:
  struct Source {
    std::filesystem::path path, on_disk;
    std::string tag;  // of a loop that has none
    Layout layout;
    std::string layout_text;
    std::uint64_t rows = 0;  // about
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
  std::unordered_map<std::string, std::size_t> by_tag_;  // the first of loops_ that has it
  std::vector<FileProblem> problems_;
  std::vector<FileProblem> passed_over_;
  std::vector<std::string> other_names_;
  Containers containers_;
  std::vector<RuleUse> rule_use_;
  std::set<std::string> clashes_;  // of rules
  std::unique_ptr<TextSource> stdin_;
  std::shared_ptr<std::FILE> stdin_copy_;  // a row a value is read twice
};

// One loop of one path, as commands take it: `loop` by its tag, or empty where there is one only. A file in the fixed
// format of the project is read as that, with its own errors.
Imported import_record(const std::filesystem::path& path, const std::string& loop,
                       const ImportOptions& options, const ImportProgress& progress = {});

}  // namespace loopwarden::record
