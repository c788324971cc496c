// SPDX-License-Identifier: Apache-2.0
// loopwarden import: converts any historian's export to records.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "record/import/importer.hpp"
#include "base/text.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/command_line/progress.hpp"
#include "workbench/commands/subcommands.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/records/record_input.hpp"
#include "workbench/text/import_json.hpp"

namespace loopwarden::workbench {
namespace {

namespace fs = std::filesystem;
using record::Role;

struct ImportCommand {
  std::vector<std::string> files;
  std::string out;
  RecordInput input;
  bool list = false;
  bool check = false;
  bool json = false;
};

constexpr std::uint64_t kAtOnceBytes = 512ULL * 1024ULL * 1024ULL;  // of values in memory
constexpr std::array kShown{Role::pv, Role::sp, Role::co, Role::stem, Role::mode};

nlohmann::json loop_json(const record::Importer& importer, const record::FoundLoop& loop) {
  nlohmann::json entry = {{"tag", loop.tag}};
  for (const Role role : kShown) {
    const std::string& name = loop.signals.names[index_of(role)];
    entry[to_text(role)] = name.empty() ? nlohmann::json(nullptr) : nlohmann::json(name);
  }
  entry["files"] = nlohmann::json::array();
  for (const std::size_t file : loop.files) entry["files"].push_back(importer.file(file).string());
  return entry;
}

nlohmann::json problems_json(const std::vector<record::FileProblem>& problems) {
  nlohmann::json list = nlohmann::json::array();
  for (const record::FileProblem& p : problems) list.push_back({{"file", p.file}, {"why", p.why}});
  return list;
}

void print_list(const record::Importer& importer) {
  std::size_t width = 4;
  for (const record::FoundLoop& loop : importer.loops())
    width = std::max(width, std::min<std::size_t>(40, loop.tag.size()));
  fmt::print("{:<{}}  signals\n", "loop", width);
  for (const record::FoundLoop& loop : importer.loops()) {
    std::string signals;
    for (const Role role : kShown) {
      const std::string& name = loop.signals.names[index_of(role)];
      const std::string& unit = loop.signals.units[index_of(role)];
      if (!name.empty()) {
        signals += fmt::format("{}{}: '{}'{}", signals.empty() ? "" : ", ", to_text(role), name,
                               unit.empty() ? "" : " in " + unit);
      }
    }
    if (!loop.signals.has(Role::pv)) signals += "; no PV: can't be used";
    if (loop.signals.has(Role::pv) && !loop.signals.has(Role::co))
      signals += "; no CO: the valve can't be judged";
    if (loop.files.size() > 1) signals += fmt::format("; in {} files", loop.files.size());
    fmt::print("{:<{}}  {}\n", loop.tag, width, signals);
  }
  if (!importer.other_names().empty()) {
    constexpr std::size_t kMost = 12;
    std::string others;
    for (std::size_t k = 0; k < std::min(kMost, importer.other_names().size()); ++k) {
      others += (k > 0 ? ", " : "") + importer.other_names()[k];
    }
    if (importer.other_names().size() > kMost)
      others += fmt::format(" and {} more", importer.other_names().size() - kMost);
    fmt::print("not used: {}\n", others);
  }
}

// Writes one record per loop and notes the corrections. With --check, the output is not written.
class ImportedLoops {
 public:
  ImportedLoops(const record::Importer& importer, const ImportCommand& options, OutputFiles& files)
      : importer_(importer), options_(options), files_(files), out_(options.out) {
    note_ = {{"loops", nlohmann::json::array()},
             {"failed", problems_json(importer.problems())},
             {"passed_over", problems_json(importer.passed_over())}};
  }

  void take(std::size_t loop, const record::Imported& imported) {
    std::string name = file_name_for(importer_.loops()[loop].tag);
    while (!names_.insert(name).second) name += "_";
    const fs::path path = out_ / (name + ".csv");
    if (!options_.check) write(imported.record, path);
    nlohmann::json entry = import_json(imported.notes, {}, std::nullopt);
    entry["file"] = path.filename().string();
    entry["from"] = loop_json(importer_, importer_.loops()[loop]);
    entry["samples"] = imported.record.size();
    note_["loops"].push_back(std::move(entry));
    in_part_ += broken_.count(loop);
    for (const std::size_t file : importer_.loops()[loop].files) {
      if (broken_files_.count({loop, file}) == 0) files_read_.good.insert(file);
    }
    words_.insert(words_.end(), imported.notes.words.begin(), imported.notes.words.end());
    const std::string said = import_text(imported);
    text_ += path.filename().string() + "\n" + said;
    fmt::print(stderr, "{}", said);
    if (!options_.check && !options_.json) fmt::print("{}\n", path.string());
  }
  void fail(std::size_t loop, std::size_t file, const record::RecordError& error) {
    // An error of a row is printed once, not once per loop.
    if (failures_.insert(error.what()).second) fmt::print(stderr, "{}\n", error.what());
    broken_.insert(loop);
    broken_files_.emplace(loop, file);
    files_read_.bad.insert(file);
    note_["failed"].push_back({{"file", importer_.file(file).string()},
                               {"loop", importer_.loops()[loop].tag},
                               {"why", error.what()}});
  }
  void write_note() {
    if (options_.check) return;
    files_.add(out_ / "import.json", note_.dump(2) + "\n");
    files_.add(out_ / "import.txt", text_ + words());
    files_.commit();
  }
  const nlohmann::json& note() const { return note_; }

  std::size_t files_lost() const { return files_read_.lost(); }
  std::size_t in_part() const { return in_part_; }
  std::string words() const { return record::bad_words_text(words_); }

 private:
  void write(const record::Record& r, const fs::path& path) {
    try {
      record::write_record(r, files_.stage(path));
    } catch (const record::RecordError& e) {
      throw CommandError(kExitIo, files_.in_users_words(e.what()));
    }
  }

  const record::Importer& importer_;
  const ImportCommand& options_;
  OutputFiles& files_;
  fs::path out_;
  nlohmann::json note_;
  std::string text_;
  std::set<std::string> names_;
  std::set<std::string> failures_;
  FilesRead files_read_;
  std::vector<record::BadWord> words_;
  std::set<std::size_t> broken_;  // loops of which a file could not be read
  std::set<std::pair<std::size_t, std::size_t>> broken_files_;  // loop, file
  std::size_t in_part_ = 0;  // of them, those that the other files give
};

struct Counts {
  std::size_t loops = 0;  // that were to be read
  std::size_t loops_read = 0;
  std::size_t in_part = 0;     // of these, without some of their files
  std::size_t files_lost = 0;  // besides those that are no exports
};

// Returns "20 of 29 files read, 31 of 33 loops; 9 files and 2 loops could not be read: see above; 3
// files skipped".
std::string count_text(const record::Importer& importer, const Counts& counts) {
  const auto of = [](std::size_t count, const char* what) {
    return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
  };
  const std::size_t files = importer.files() + importer.problems().size();
  const std::size_t files_lost = importer.problems().size() + counts.files_lost;
  const std::size_t loops_lost = counts.loops - counts.loops_read;
  std::string text = fmt::format("{} of {} read, {} of {}", files - files_lost, of(files, "file"),
                                 counts.loops_read, of(counts.loops, "loop"));
  if (files_lost + loops_lost > 0) {
    text += "; " + (files_lost > 0 ? of(files_lost, "file") : std::string()) +
            (files_lost > 0 && loops_lost > 0 ? " and " : "") +
            (loops_lost > 0 ? of(loops_lost, "loop") : std::string()) +
            " could not be read: see above";
  }
  if (counts.in_part > 0)
    text += fmt::format("; {} read without some of the files", of(counts.in_part, "loop"));
  if (const std::size_t others = importer.passed_over().size(); others > 0)
    text += fmt::format("; {} skipped", of(others, "file"));
  return text;
}

// Prints the files and loops that were not read, with the reasons.
void print_left_out(const record::Importer& importer) {
  if (const std::string others = importer.passed_over_text(); !others.empty())
    fmt::print(stderr, "{}\n", others);
  for (const record::FileProblem& p : importer.problems()) fmt::print(stderr, "{}\n", p.why);
}

std::vector<std::size_t> usable_loops(const record::Importer& importer, const RecordInput& input) {
  std::vector<std::size_t> usable;
  for (std::size_t k = 0; k < importer.loops().size(); ++k) {
    const record::FoundLoop& loop = importer.loops()[k];
    if (loop.signals.has(Role::pv) && input.takes(loop.tag)) usable.push_back(k);
  }
  return usable;
}

int read_all(record::Importer& importer, const ImportCommand& options) {
  std::vector<std::string> inputs;
  for (std::size_t k = 0; k < importer.files(); ++k) inputs.push_back(importer.on_disk(k).string());
  OutputFiles files(inputs);
  if (!options.check) files.make_folder(options.out);
  const std::vector<std::size_t> usable = usable_loops(importer, options.input);
  if (usable.empty() && !options.input.loop().empty()) {
    print_left_out(importer);
    fail(kExitData, "no loop {} with a PV; --list shows those that were found",
         base::in_quotes(options.input.loop()));
  }
  ImportedLoops loops(importer, options, files);
  Progress progress("import", 1000);
  for (std::size_t from = 0; from < usable.size();) {
    std::size_t to = from;
    for (std::uint64_t bytes = 0; to < usable.size() && (to == from || bytes < kAtOnceBytes);
         ++to) {
      bytes += importer.bytes_of(usable[to]);
    }
    importer.read(
        std::span(usable).subspan(from, to - from),
        [&](std::size_t loop, const record::Imported& imported) { loops.take(loop, imported); },
        [&](std::size_t loop, std::size_t file, const record::RecordError& error) {
          loops.fail(loop, file, error);
        },
        [&](double share) {
          progress.update_share(
              (static_cast<double>(from) + share * static_cast<double>(to - from)) /
              static_cast<double>(usable.size()));
        });
    from = to;
  }
  const bool none = loops.note()["loops"].empty();
  if (!none) loops.write_note();
  std::fflush(stdout);
  if (options.json && !none) show_json(loops.note());
  std::fflush(stdout);
  fmt::print(stderr, "{}", loops.words());
  print_left_out(importer);
  if (options.input.has_rules()) fmt::print(stderr, "{}", rules_text(importer, true));
  if (usable.empty() && importer.files() > 0) fmt::print(stderr, "{}\n", importer.no_pv());
  fmt::print(stderr, "{}\n",
             count_text(importer, {.loops = usable.size(),
                                   .loops_read = loops.note()["loops"].size(),
                                   .in_part = loops.in_part(),
                                   .files_lost = loops.files_lost()}));
  return reading_exit_code(!loops.note()["failed"].empty(), none, importer);
}

int run_import(const ImportCommand& options) {
  if (!options.list && !options.check && options.out.empty()) {
    fail(kExitUsage,
         "import: --out DIR writes the records, --list shows the loops, --check reads them");
  }
  record::Importer importer({options.files.begin(), options.files.end()}, options.input.options(),
                            true);
  if (!options.list) return read_all(importer, options);
  const std::size_t usable = usable_loops(importer, options.input).size();
  if (options.json) {
    nlohmann::json entry = {{"loops", nlohmann::json::array()},
                            {"not_used", importer.other_names()},
                            {"failed", problems_json(importer.problems())},
                            {"passed_over", problems_json(importer.passed_over())}};
    for (const record::FoundLoop& loop : importer.loops())
      entry["loops"].push_back(loop_json(importer, loop));
    show_json(entry);
  } else {
    print_list(importer);
  }
  std::fflush(stdout);
  print_left_out(importer);
  for (const std::string& rule : importer.idle_rules()) fmt::print(stderr, "{}\n", rule);
  if (usable == 0 && importer.files() > 0) {
    fmt::print(stderr, "{}\n", importer.no_pv());
  } else if (const std::string hint = importer.pairs_hint(); !hint.empty()) {
    fmt::print(stderr, "{}\n", hint);
  }
  fmt::print(stderr, "{}\n", count_text(importer, {.loops = usable, .loops_read = usable}));
  return reading_exit_code(!importer.problems().empty(), usable == 0, importer);
}

}  // namespace

void add_import(Program& program) {
  auto [command, o] =
      program.command("import", "Convert any historian's export to records", run_import);
  command.required(
      "file", o.files,
      "exports: text, also gzip; .xlsx; .zip and folders of them; - for standard input");
  command.option("--out", o.out, "folder for one record per loop, import.json and import.txt");
  command.flag("--list", o.list, "print the loops that were found, without output files");
  command.flag("--check", o.check, "read all of it and report, without output files");
  command.flag("--json", o.json, "print what --list or import.json has");
  o.input.add_options(command);
  o.input.add_rules(command);
  command.footer(
      "The layout of an export is detected and reported; every command that takes a record reads "
      "such exports by itself. ARCHIVE.zip/MEMBER and BOOK.xlsx/SHEET are files as well. Exit code "
      "65: something could not be read; the rest was.\n"
      "Example: loopwarden import export.csv --list");
}

}  // namespace loopwarden::workbench
