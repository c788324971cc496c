// SPDX-License-Identifier: Apache-2.0
// loopwarden receipt: compares a loop before and after work at its valve.
#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/diagnostic.hpp"
#include "daemon/protocol/ask.hpp"
#include "record/import/time_text.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/commands/subcommands.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/live/daemon_client.hpp"
#include "workbench/records/record_input.hpp"
#include "workbench/records/recorder_input.hpp"
#include "workbench/survey/loop_result.hpp"
#include "workbench/survey/outcomes.hpp"
#include "workbench/survey/receipt.hpp"

namespace loopwarden::workbench {
namespace {

namespace fs = std::filesystem;

struct ReceiptCommand {
  std::string tag;
  std::vector<std::string> before, after;
  std::string socket;
  std::string at;
  std::string found;
  double hours = 8.0;
  double settle_min = 10.0;
  std::string kind;
  std::vector<double> co_range;
  std::string costs;
  std::string out;
  bool json = false;
  RecordInput input;
};

struct Work {
  std::int64_t utc_ms = 0;
  std::string found;
};

// Returns the newest answer of `loopwarden outcome --repaired` for the loop.
std::optional<Work> newest_work(DaemonClient& daemon, const std::string& tag) {
  constexpr std::uint64_t kMost = 1000;
  protocol::JournalRequest request{.most = kMost, .text = "outcome"};
  request.loop = tag;
  for (const protocol::JournalLine& line : protocol::ask(daemon, request).lines) {
    if (line.what == "outcome" && line.loop == tag && line.reason.starts_with(kRepaired))
      return Work{line.utc_ms, line.new_};
  }
  return std::nullopt;
}

std::vector<record::Imported> imported(const ReceiptCommand& options,
                                       const std::vector<std::string>& paths) {
  std::vector<record::Imported> records;
  for (const std::string& path : paths) records.push_back(options.input.read(path));
  return records;
}

// Takes the records before and after the work from the daemon's recorder.
ReceiptInput from_daemon(const ReceiptCommand& options, const fs::path& folder) {
  DaemonClient daemon(options.socket);
  ReceiptInput input{.tag = options.tag, .found = options.found};
  std::optional<std::int64_t> at_ns = utc_ns_of(options.at);
  if (!at_ns) {
    const auto work = newest_work(daemon, options.tag);
    if (!work) {
      fail(kExitData,
           "{}: the journal has no answer with --repaired. Give one with loopwarden outcome, or "
           "the time of the work with --at",
           options.tag);
    }
    at_ns = work->utc_ms * 1'000'000;
    if (input.found.empty()) input.found = work->found;
  }
  input.worked_at = record::iso_text(*at_ns / 1'000'000'000, 0.0, true);
  const auto ns = [](double seconds) { return static_cast<std::int64_t>(seconds * 1e9); };
  const auto take = [&](const char* name, std::int64_t from, std::optional<std::int64_t> to) {
    record::ExportSettings settings;
    settings.from_utc_ns = from;
    settings.to_utc_ns = to;
    const fs::path target = folder / name;
    fs::create_directories(target);
    const Recorded recorded = take_recorded(options.socket, options.tag, target, settings);
    input.co_range.assign(recorded.loop.co_range.begin(), recorded.loop.co_range.end());
    input.pv_range = std::pair{recorded.loop.pv_range[0], recorded.loop.pv_range[1]};
    std::vector<record::Imported> records;
    for (const Recorded::Record& one : recorded.records) {
      records.push_back(record::import_record(one.path, {}, {}));
      records.back().notes.units[index_of(record::Role::pv)] = recorded.loop.pv_unit;
    }
    return records;
  };
  const std::int64_t settle = ns(60.0 * options.settle_min);
  const std::int64_t length = ns(3600.0 * options.hours);
  input.before = take("before", *at_ns - settle - length, *at_ns - settle);
  input.after = take("after", *at_ns + settle, *at_ns + settle + length);
  return input;
}

class TemporaryRecords {
 public:
  TemporaryRecords() {
    std::string name = (fs::temp_directory_path() / "loopwarden-receipt-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) fail(kExitIo, "{}: can't be made", name);
    path_ = name;
  }
  ~TemporaryRecords() {
    std::error_code none;
    fs::remove_all(path_, none);
  }
  TemporaryRecords(const TemporaryRecords&) = delete;
  TemporaryRecords& operator=(const TemporaryRecords&) = delete;
  const fs::path& path() const noexcept { return path_; }

 private:
  fs::path path_;
};

int run_receipt(const ReceiptCommand& options) {
  const bool files = !options.before.empty() || !options.after.empty();
  if (files && (options.before.empty() || options.after.empty()))
    require("receipt: both --before and --after");
  if (!files && options.tag.empty()) require("receipt: TAG, or --before and --after");
  std::optional<TemporaryRecords> kept;
  ReceiptInput input;
  if (files) {
    input = {.tag = options.tag,
             .found = options.found,
             .worked_at = options.at,
             .before = imported(options, options.before),
             .after = imported(options, options.after)};
    const record::Imported& first = input.before.front();
    if (input.tag.empty()) input.tag = first.notes.tag;
    input.co_range = likely_co_range(first);
    if (const auto& range = first.notes.ranges[index_of(record::Role::pv)]) input.pv_range = range;
  } else {
    kept.emplace();
    input = from_daemon(options, kept->path());
  }
  if (!options.co_range.empty()) input.co_range = options.co_range;
  input.kind = options.kind.empty() ? diagnosis::to_text(diagnosis::loop_type_from_tag(input.tag))
                                    : options.kind;
  if (!options.costs.empty()) {
    auto costs = read_costs_file(options.costs);
    fmt::print(stderr, "{}", config::to_text(costs.diagnostics));
    if (!costs) fail(kExitConfiguration, "{}: can't be used", options.costs);
    input.costs = std::move(*costs);
  }
  const Receipt receipt = make_receipt(std::move(input));
  if (!options.out.empty()) write_output(options.out, receipt_page(receipt));
  if (options.json) {
    show_json(receipt.told);
    return kExitOk;
  }
  fmt::print("{}", receipt_text(receipt.told));
  if (!options.out.empty()) fmt::print("{}\n", options.out);
  return kExitOk;
}

}  // namespace

void add_receipt(Program& program) {
  auto [command, o] = program.command(
      "receipt", "Compare a loop before and after work at its valve: repaired or not", run_receipt);
  command.option("tag", o.tag, "tag of the loop");
  command.option("--before", o.before, "records before the work, in place of the daemon's");
  command.option("--after", o.after, "records after the work");
  command.option("--at", o.at,
                 "UTC time of the work, such as 2026-11-26T10:00:00Z; default: of the newest "
                 "answer with --repaired");
  command.option("--found", o.found, "what was found at the valve; default: that answer's",
                 one_of(found_words()));
  command.setting("--hours", o.hours, "hours of the daemon's record on each side",
                  between(0.1, 1000.0));
  command.setting("--settle", o.settle_min, "minutes left out on each side of the work",
                  between(0.0, 10000.0));
  command.option("--co-range", o.co_range, "lower and upper end of CO; default: by the values")
      .takes(2);
  command.option("--kind", o.kind, "what the loop controls; default: from its tag",
                 one_of({"flow", "pressure", "level", "temperature", "unknown"}));
  command.option("--costs", o.costs, "YAML with costs (docs/reference/worklist.md)");
  command.option("--out", o.out, "HTML page of one sheet, to print or to save as PDF");
  command.flag("--json", o.json, "print JSON");
  command.socket(o.socket);
  o.input.add_options(command);
  command.footer(
      "Example: loopwarden receipt --before may.csv --after june.csv --out receipt.html");
}

}  // namespace loopwarden::workbench
