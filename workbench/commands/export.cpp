// SPDX-License-Identifier: Apache-2.0
// loopwarden export: writes CSV records from the daemon's recorder on the box.
#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "record/record_csv.hpp"
#include "record/segment_export.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/commands/subcommands.hpp"

namespace loopwarden::workbench {
namespace {

struct ExportOptions {
  std::string folder;
  std::string out;
  bool json = false;
};

void print_json(const record::ExportResult& result) {
  nlohmann::json records = nlohmann::json::array();
  for (const auto& record : result.records) {
    records.push_back({{"file", record.path.string()},
                       {"start_utc_ns", record.start_utc_ns},
                       {"rows", record.rows},
                       {"empty_rows", record.filled_rows}});
  }
  const nlohmann::json printed = {{"records", std::move(records)},
                                  {"damaged_rows", result.damaged_rows},
                                  {"torn_bytes", result.torn_bytes},
                                  {"unreadable", result.unreadable}};
  fmt::print("{}\n", printed.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
}

int exit_code_of(const record::ExportResult& result) {
  return result.records.empty() || !result.unreadable.empty() ? kExitData : kExitOk;
}

int run_export(const ExportOptions& options) {
  OutputFiles files;
  try {
    files.make_folder(options.out);
    record::ExportSettings settings;
    settings.place = [&files](const std::filesystem::path& path) { return files.stage(path); };
    const record::ExportResult result = record::export_csv(options.folder, options.out, settings);
    files.commit();
    if (options.json) {
      print_json(result);
      return exit_code_of(result);
    }
    for (const auto& record : result.records) {
      fmt::print("{}: {} rows{}\n", record.path.string(), record.rows,
                 record.filled_rows > 0 ? fmt::format(", {} of them empty", record.filled_rows)
                                        : std::string());
    }
    for (const std::string& text : result.unreadable) fmt::print(stderr, "skipped: {}\n", text);
    if (result.damaged_rows > 0 || result.torn_bytes > 0) {
      fmt::print(stderr, "{} damaged rows and {} bytes of a torn tail were left out\n",
                 result.damaged_rows, result.torn_bytes);
    }
    if (result.records.empty()) {
      fmt::print(stderr, "{}: no recordings\n", options.folder);
    }
    return exit_code_of(result);
  } catch (const record::RecordError& e) {
    fmt::print(stderr, "{}\n", files.in_users_words(e.what()));
    return e.kind() == record::RecordError::Kind::io ? kExitIo : kExitData;
  }
}

}  // namespace

void add_export(Program& program) {
  auto [command, o] =
      program.command("export", "Export recordings of the daemon as CSV records", run_export);
  command.required("folder", o.folder, "a loop's folder of segments");
  command.required("--out", o.out, "folder for the records");
  command.flag("--json", o.json, "print the result as JSON");
  command.footer("Example: loopwarden export /var/lib/loopwardend/segments/FIC-101 --out .");
}

}  // namespace loopwarden::workbench
