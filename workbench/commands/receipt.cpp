// SPDX-License-Identifier: Apache-2.0
// loopwarden receipt: compares a loop before and after a repair or another change.
#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "config/diagnostic.hpp"
#include "config/loop_model_reader.hpp"
#include "daemon/protocol/ask.hpp"
#include "record/import/time_text.hpp"
#include "workbench/command_line/background.hpp"
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
  std::string since, until;
  std::string model;
  std::vector<double> gains_before, gains_after;
  bool background = false;
  double hours = 8.0;
  double settle_min = 10.0;
  std::string kind;
  std::vector<double> co_range;
  std::string costs;
  std::string out;
  bool json = false;
  RecordInput input;
};

// Work at a loop. Several changes within an hour are one work.
struct Work {
  std::int64_t from_ms = 0, to_ms = 0;
  std::string found;               // of the newest repair
  bool gains_only = true;          // neither a repair nor another change
  std::vector<std::string> lines;  // oldest first
  std::string gains_before, gains_after;
};

// Adds what the line reports. Lines come in the order newest first.
void add_line(Work& work, const protocol::JournalLine& line) {
  std::string text = line.reason;
  if (line.what == "gains") {
    work.gains_before = line.old_;
    if (work.gains_after.empty()) work.gains_after = line.new_;
    text = fmt::format("gains: {}, before {}", line.new_, line.old_);
  } else {
    work.gains_only = false;
  }
  if (line.reason.starts_with(protocol::kRepaired)) {
    if (work.found.empty()) work.found = line.new_;
    text = fmt::format("{}: {}", line.new_, line.reason);
  }
  work.from_ms = line.utc_ms;
  if (work.to_ms == 0) work.to_ms = line.utc_ms;
  work.lines.insert(work.lines.begin(),
                    record::iso_text(line.utc_ms / 1000, 0.0, true) + " " + text);
}

bool is_work(const protocol::JournalLine& line) {
  if (line.what == "gains") return line.result == "done";
  return line.what == "outcome" && (line.reason.starts_with(protocol::kRepaired) ||
                                    line.reason.starts_with(protocol::kChanged));
}

// Returns the newest work at the loop in the journal, between --since and --until.
std::optional<Work> newest_work(DaemonClient& daemon, const ReceiptCommand& options,
                                double accelerate) {
  constexpr std::uint64_t kMost = 1000;
  constexpr double kOneWork_ms = 3.6e6;
  protocol::JournalRequest request{.most = kMost, .kind = "operator"};
  request.loop = options.tag;
  const auto moment = [](const std::string& text) -> protocol::Maybe<std::uint64_t> {
    const auto ns = utc_ns_of(text);
    return ns ? protocol::Maybe<std::uint64_t>(static_cast<std::uint64_t>(*ns / 1'000'000))
              : protocol::Maybe<std::uint64_t>();
  };
  request.from_ms = moment(options.since);
  request.to_ms = moment(options.until);
  Work work;
  for (const protocol::JournalLine& line : protocol::ask(daemon, request).lines) {
    if (line.loop != options.tag || !is_work(line)) continue;
    const auto gap_ms = static_cast<double>(work.from_ms - line.utc_ms);
    if (work.to_ms != 0 && gap_ms * accelerate > kOneWork_ms) break;
    add_line(work, line);
  }
  return work.to_ms == 0 ? std::nullopt : std::optional(work);
}

// Returns the gains of a line of the journal, such as "kp 1 ki 0.1 kd 0".
std::optional<control::PidGains> gains_in(const std::string& text) {
  std::istringstream words(text);
  std::string name;
  control::PidGains gains;
  words >> name >> gains.kp >> name >> gains.ki >> name >> gains.kd;
  return words ? std::optional(gains) : std::nullopt;
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
  const double accelerate = protocol::ask(daemon, protocol::DescribeRequest{}).accelerate;
  ReceiptInput input{.tag = options.tag, .found = options.found};
  constexpr std::int64_t kNsPerMs = 1'000'000;
  std::int64_t begin_ns = utc_ns_of(options.at).value_or(0);
  std::int64_t end_ns = begin_ns;
  if (begin_ns == 0) {
    const auto work = newest_work(daemon, options, accelerate);
    if (!work) {
      fail(kExitData,
           "{}: the journal has no repair and no change in this time. Report one with loopwarden "
           "outcome --repaired or --changed, or give its time with --at",
           options.tag);
    }
    begin_ns = work->from_ms * kNsPerMs;
    end_ns = work->to_ms * kNsPerMs;
    if (input.found.empty()) input.found = work->found;
    input.gains_only = work->gains_only;
    input.work = work->lines;
    const auto before = gains_in(work->gains_before);
    const auto after = gains_in(work->gains_after);
    if (before && after) input.gains = {*before, *after};
  }
  input.worked_at = record::iso_text(end_ns / 1'000'000'000, 0.0, true);
  const auto ns = [&](double seconds) {
    return static_cast<std::int64_t>(seconds * 1e9 / accelerate);
  };
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
      record::ImportNotes& notes = records.back().notes;
      notes.units[index_of(record::Role::pv)] = recorded.loop.pv_unit;
      constexpr std::int64_t kNsPerS = 1'000'000'000;
      notes.start =
          record::TimePoint{.whole_s = one.start_utc_ns / kNsPerS,
                            .rest_s = static_cast<double>(one.start_utc_ns % kNsPerS) * 1e-9,
                            .zone_known = true};
    }
    return records;
  };
  const std::int64_t settle = ns(60.0 * options.settle_min);
  const std::int64_t length = ns(3600.0 * options.hours);
  input.before = take("before", utc_ns_of(options.since).value_or(begin_ns - settle - length),
                      begin_ns - settle);
  input.after =
      take("after", end_ns + settle, utc_ns_of(options.until).value_or(end_ns + settle + length));
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

void add_model(const ReceiptCommand& options, ReceiptInput& input) {
  const auto gains = [](const std::vector<double>& given) {
    return control::PidGains{.kp = given[0], .ki = given[1], .kd = given[2]};
  };
  if (!options.gains_before.empty() && !options.gains_after.empty()) {
    input.gains_only = true;
    input.gains = {gains(options.gains_before), gains(options.gains_after)};
  }
  if (options.model.empty()) return;
  auto model = config::read_model_file(options.model);
  if (!model) fail(kExitConfiguration, "{}", config::to_text(model.diagnostics));
  input.model = std::move(*model.value);
}

int run_receipt(const ReceiptCommand& given) {
  ReceiptCommand options = given;
  if (options.background) work_in_background();
  if (options.tag.empty()) options.tag = options.input.loop();
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
  add_model(options, input);
  if (!options.costs.empty()) input.costs = read_costs_file(options.costs);
  const Receipt receipt = make_receipt(std::move(input));
  if (!options.out.empty()) write_output(options.out, receipt_page(receipt));
  if (options.json) {
    show_json(receipt.told);
    return kExitOk;
  }
  if (options.background) {
    fmt::print("{}\n", receipt_sentence(receipt.told));
    return kExitOk;
  }
  fmt::print("{}", receipt_text(receipt.told));
  if (!options.out.empty()) fmt::print("{}\n", options.out);
  return kExitOk;
}

}  // namespace

void add_receipt(Program& program) {
  auto [command, o] = program.command(
      "receipt", "Compare a loop before and after a repair or a change of its gains or positioner",
      run_receipt);
  command.option("tag", o.tag, "tag of the loop");
  command.option("--before", o.before, "records before the work, in place of the daemon's");
  command.option("--after", o.after, "records after the work");
  command.option("--at", o.at,
                 "UTC time of the work, such as 2026-11-26T10:00:00Z; default: of the newest "
                 "repair, change or new gains in the daemon's journal");
  command.option("--since", o.since, "UTC start of the record before, in place of --hours");
  command.option("--until", o.until, "UTC end of the record after, in place of --hours");
  command.option("--found", o.found, "what was found at the valve; default: that answer's",
                 one_of(found_words()));
  command.option("--model", o.model,
                 "model or twin of the loop: compare new gains on the same disturbance");
  const Option before =
      command.option("--gains-before", o.gains_before, "kp, ki and kd before; default: journal's")
          .takes(3);
  command.option("--gains-after", o.gains_after, "kp, ki and kd after; default: journal's")
      .takes(3)
      .needs(before);
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
  add_background(command, o.background);
  o.input.add_options(command);
  command.footer(
      "Example: loopwarden receipt --before may.csv --after june.csv --out receipt.html");
}

}  // namespace loopwarden::workbench
