// SPDX-License-Identifier: Apache-2.0
// loopwarden import: any historian's export as records.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "record/import/importer.hpp"
#include "record/text.hpp"
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
  for (const std::size_t file : loop.files)
    entry["files"].push_back(importer.files()[file].string());
  return entry;
}

nlohmann::json problems_json(const record::Importer& importer) {
  nlohmann::json list = nlohmann::json::array();
  for (const record::FileProblem& p : importer.problems())
    list.push_back({{"file", p.file}, {"why", p.why}});
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
        signals += fmt::format("{}{} {}{}", signals.empty() ? "" : ", ", to_text(role), name,
                               unit.empty() ? "" : " in " + unit);
      }
    }
    if (!loop.signals.has(Role::pv)) signals += "; no PV: can't be used";
    if (loop.signals.has(Role::pv) && !loop.signals.has(Role::co))
      signals += "; no CO: nothing can be said of the valve";
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
  for (const record::FileProblem& p : importer.problems()) fmt::print("failed: {}\n", p.why);
}

void write_loop(const record::Record& r, const fs::path& path) {
  record::RecordColumns columns{.sp = r.has_sp, .co = r.has_co, .stem = r.has_stem, .more = {}};
  if (r.has_mode) columns.more.emplace_back("mode");
  record::RecordCsvWriter writer(path, columns);
  const auto at = [](bool has, const std::vector<double>& column, std::size_t k) {
    return has ? column[k] : record::RecordSample::kNone;
  };
  for (std::size_t k = 0; k < r.size(); ++k) {
    const record::RecordSample sample{.time_s = r.time_s[k],
                                      .pv = r.pv[k],
                                      .sp = at(r.has_sp, r.sp, k),
                                      .co = at(r.has_co, r.co, k),
                                      .stem = at(r.has_stem, r.stem, k)};
    if (r.has_mode) {
      const double mode = r.automatic[k];
      writer.add(sample, {&mode, 1});
    } else {
      writer.add(sample);
    }
  }
  writer.finish();
}

// With --check nothing is written.
int read_all(record::Importer& importer, const ImportCommand& options) {
  const fs::path out(options.out);
  std::vector<std::string> inputs;
  for (const fs::path& file : importer.files()) inputs.push_back(file.string());
  OutputFiles files(inputs);
  if (!options.check) files.make_folder(out);
  std::vector<std::size_t> usable;
  for (std::size_t k = 0; k < importer.loops().size(); ++k) {
    const record::FoundLoop& loop = importer.loops()[k];
    if (loop.signals.has(Role::pv) && options.input.takes(loop.tag)) usable.push_back(k);
  }
  if (usable.empty() && !options.input.loop().empty()) {
    fmt::print(stderr, "no loop {} with a PV; --list shows those that were found\n",
               record::in_quotes(options.input.loop()));
    return kExitData;
  }
  nlohmann::json note = {{"loops", nlohmann::json::array()}, {"failed", problems_json(importer)}};
  std::string text;
  std::set<std::string> names;
  Progress progress("import", 1000);
  std::size_t read = 0;
  for (std::size_t from = 0; from < usable.size();) {
    std::size_t to = from;
    for (std::uint64_t bytes = 0; to < usable.size() && (to == from || bytes < kAtOnceBytes);
         ++to) {
      bytes += importer.bytes_of(usable[to]);
    }
    importer.read(
        std::span(usable).subspan(from, to - from),
        [&](std::size_t loop, const record::Imported& imported) {
          std::string name = file_name_for(importer.loops()[loop].tag);
          while (!names.insert(name).second) name += "_";
          const fs::path path = out / (name + ".csv");
          if (!options.check) write_loop(imported.record, files.stage(path));
          nlohmann::json entry = import_json(imported.notes, {}, std::nullopt);
          entry["file"] = path.filename().string();
          entry["from"] = loop_json(importer, importer.loops()[loop]);
          entry["samples"] = imported.record.size();
          note["loops"].push_back(std::move(entry));
          const std::string said = import_text(imported);
          text += path.filename().string() + "\n" + said;
          fmt::print(stderr, "{}", said);
          if (!options.check && !options.json) fmt::print("{}\n", path.string());
          ++read;
        },
        [&](std::size_t loop, const record::RecordError& error) {
          fmt::print(stderr, "{}\n", error.what());
          note["failed"].push_back(
              {{"file", importer.files()[importer.loops()[loop].files.front()].string()},
               {"loop", importer.loops()[loop].tag},
               {"why", error.what()}});
        },
        [&](double share) {
          const double done = (static_cast<double>(from) + share * static_cast<double>(to - from)) /
                              static_cast<double>(usable.size());
          progress.update(static_cast<std::uint64_t>(1000.0 * done));
        });
    from = to;
  }
  for (const record::FileProblem& p : importer.problems()) fmt::print(stderr, "{}\n", p.why);
  if (read == 0) {
    fmt::print(stderr, "no loop could be read\n");
    return kExitData;
  }
  if (!options.check) {
    files.add(out / "import.json", note.dump(2) + "\n");
    files.add(out / "import.txt", text);
    files.commit();
  }
  if (options.json) fmt::print("{}\n", note.dump(2));
  return note["failed"].empty() ? kExitOk : kExitData;
}

int run_import(const ImportCommand& options) {
  if (!options.list && !options.check && options.out.empty()) {
    fmt::print(
        stderr,
        "import: --out DIR writes the records, --list shows the loops, --check reads them\n");
    return kExitUsage;
  }
  try {
    record::Importer importer({options.files.begin(), options.files.end()},
                              options.input.options());
    if (!options.list) return read_all(importer, options);
    if (options.json) {
      nlohmann::json entry = {{"loops", nlohmann::json::array()},
                              {"not_used", importer.other_names()},
                              {"failed", problems_json(importer)}};
      for (const record::FoundLoop& loop : importer.loops())
        entry["loops"].push_back(loop_json(importer, loop));
      fmt::print("{}\n", entry.dump(2));
    } else {
      print_list(importer);
    }
    return importer.loops().empty() ? kExitData : kExitOk;
  } catch (const record::RecordError& e) {
    fmt::print(stderr, "{}\n", e.what());
    return e.kind() == record::RecordError::Kind::io ? kExitIo : kExitData;
  }
}

}  // namespace

void add_import(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<ImportCommand>();
  CLI::App* sub = app.add_subcommand("import", "any historian's export as records");
  sub->add_option("file", options->files,
                  "exports: text, also gzip; folders of them; - for standard input")
      ->required();
  sub->add_option("--out", options->out, "folder for a record a loop, import.json and import.txt");
  sub->add_flag("--list", options->list, "print the loops that were found, write nothing");
  sub->add_flag("--check", options->check, "read all of it, say what would be done, write nothing");
  sub->add_flag("--json", options->json, "print what --list or import.json has");
  options->input.add_options(*sub);
  sub->footer(
      "What an export looks like is found out and said; every command that takes a record reads "
      "such exports by itself.\n"
      "Example: loopwarden import export.csv --list");
  sub->callback([options, &exit_code] { exit_code = run_import(*options); });
}

}  // namespace loopwarden::workbench
