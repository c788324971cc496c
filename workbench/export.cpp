// SPDX-License-Identifier: Apache-2.0
// loopwarden export: what the daemon recorded on the box, as CSV records.
#include <fmt/format.h>

#include <memory>
#include <string>

#include "hal/record/record_csv.hpp"
#include "hal/record/segment_export.hpp"
#include "workbench/subcommands.hpp"

namespace loopwarden::workbench {
namespace {

struct ExportOptions {
  std::string folder;
  std::string out;
};

int run_export(const ExportOptions& options) {
  try {
    const hal::record::ExportResult result = hal::record::export_csv(options.folder, options.out);
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
      fmt::print(stderr, "{}: nothing recorded\n", options.folder);
      return kExitData;
    }
    return result.unreadable.empty() ? kExitOk : kExitData;
  } catch (const hal::record::RecordError& e) {
    fmt::print(stderr, "{}\n", e.what());
    return e.kind() == hal::record::RecordError::Kind::io ? kExitIo : kExitData;
  }
}

}  // namespace

void add_export(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<ExportOptions>();
  CLI::App* sub = app.add_subcommand("export", "recordings of the daemon as CSV records");
  sub->add_option("folder", options->folder, "a loop's folder of segments")->required();
  sub->add_option("--out", options->out, "folder for the records")->required();
  sub->footer("Example: loopwarden export /var/lib/loopwardend/segments/FIC-101 --out .");
  sub->callback([options, &exit_code] { exit_code = run_export(*options); });
}

}  // namespace loopwarden::workbench
