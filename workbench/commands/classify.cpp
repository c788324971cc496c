// SPDX-License-Identifier: Apache-2.0
// loopwarden classify: prints the specialists' verdict on every window of a record.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "config/specialists/specialist_folder.hpp"
#include "record/record_csv.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/files/model_file.hpp"
#include "workbench/records/record_input.hpp"
#include "workbench/text/json_number.hpp"
#include "workbench/commands/subcommands.hpp"

namespace loopwarden::workbench {
namespace {

using specialist::kWindowSamples;

constexpr double kPeriodTolerance = 0.01;  // relative

struct ClassifyOptions {
  RecordInput input;
  std::string record;
  std::string specialists;
  std::string form = "auto";
  double every_s = 0.0;
  bool json = false;
};

struct NamedError {
  std::string specialist;
  std::string condition;
  double mse = 0.0;
};

struct JudgedWindow {
  double from_s = 0.0;
  double to_s = 0.0;
  std::string verdict;
  double probability = 0.0;       // NaN: not available in this form
  double severity_percent = 0.0;  // NaN: not known
  std::vector<NamedError> errors;
};

// Judges one window after the other and calls row(first sample).
template <class MakeRow>
std::vector<JudgedWindow> walk(const record::Record& record, const ClassifyOptions& options,
                               MakeRow make_row) {
  const double every_s =
      options.every_s > 0.0 ? options.every_s : 0.5 * record.period_s * kWindowSamples;
  const auto step = static_cast<std::size_t>(std::max(1.0, std::floor(every_s / record.period_s)));
  std::vector<JudgedWindow> rows;
  for (std::size_t k = 0; k + kWindowSamples <= record.size(); k += step) {
    JudgedWindow row = make_row(k);
    row.from_s = record.time_s[k];
    row.to_s = record.time_s[k + kWindowSamples - 1];
    rows.push_back(std::move(row));
  }
  return rows;
}

std::vector<JudgedWindow> by_team(const specialist::Team& team, const record::Record& record,
                                  const ClassifyOptions& options) {
  specialist::TeamJudge judge(team);
  return walk(record, options, [&](std::size_t k) {
    const specialist::WindowVerdict v = judge.judge(record.view().part(k, k + kWindowSamples));
    JudgedWindow row;
    row.verdict = to_text(v.verdict);
    row.probability = v.probability;
    row.severity_percent =
        v.verdict == specialist::VerdictName::unknown ? std::nan("") : v.severity_percent;
    for (const specialist::TeamMember& m : team.members) {
      row.errors.push_back(
          {m.name, to_text(m.condition), v.mse[static_cast<std::size_t>(m.condition)]});
    }
    return row;
  });
}

std::vector<JudgedWindow> by_signatures(
    const std::vector<specialist::SignatureSpecialist>& specialists, const record::Record& record,
    const ClassifyOptions& options) {
  specialist::SignatureEnsemble ensemble(specialists);
  return walk(record, options, [&](std::size_t k) {
    const auto pv = std::span(record.pv).subspan(k, kWindowSamples);
    const std::span<const double> errors = ensemble.errors(pv);
    JudgedWindow row;
    for (std::size_t i = 0; i < specialists.size(); ++i) {
      row.errors.push_back({specialists[i].name, to_text(specialists[i].condition), errors[i]});
    }
    const std::optional<std::size_t> best = ensemble.verdict(pv);
    row.verdict = best ? to_text(specialists[*best].condition) : "unknown";
    row.probability = std::nan("");
    row.severity_percent = std::nan("");
    return row;
  });
}

void print_json(const std::vector<JudgedWindow>& rows) {
  nlohmann::json windows = nlohmann::json::array();
  for (const JudgedWindow& row : rows) {
    nlohmann::json mse = nlohmann::json::array();
    for (const NamedError& e : row.errors) {
      mse.push_back(
          {{"specialist", e.specialist}, {"class", e.condition}, {"mse", finite_or_null(e.mse)}});
    }
    windows.push_back({{"from_s", row.from_s},
                       {"to_s", row.to_s},
                       {"verdict", row.verdict},
                       {"probability", finite_or_null(row.probability)},
                       {"severity_percent", finite_or_null(row.severity_percent)},
                       {"mse", std::move(mse)}});
  }
  show_json(nlohmann::json{{"windows", std::move(windows)}});
}

void print_text(const std::vector<JudgedWindow>& rows, bool explaining) {
  fmt::print("{:>9} {:>9}  {:<20} {:>5} {:>8}", "from s", "to s", "verdict", "p", "severity");
  for (const NamedError& e : rows.front().errors) fmt::print(" {:>9}", e.specialist);
  fmt::print("\n");
  for (const JudgedWindow& row : rows) {
    fmt::print("{:9.1f} {:9.1f}  {:<20}", row.from_s, row.to_s, row.verdict);
    if (explaining) {
      fmt::print(" {:5.2f} {:>8}", row.probability,
                 row.severity_percent > 0.0 ? fmt::format("{:.1f} %", row.severity_percent) : "-");
    } else {
      fmt::print(" {:>5} {:>8}", "-", "-");
    }
    for (const NamedError& e : row.errors) fmt::print(" {:9.4g}", e.mse);
    fmt::print("\n");
  }
  fmt::print(
      "{}\n",
      explaining
          ? "mean square errors of the explanations in (% of CO span)^2, severity in % of CO span"
          : "mean square errors in (PV units)^2; the lowest decides");
}

int run_classify(const ClassifyOptions& options) {
  const auto specialists = usable(config::read_specialists(options.specialists));
  const record::Record record = options.input.read(options.record).record;
  const bool explaining = options.form == "auto"
                              ? specialists.team.has_value() && !record.co.empty()
                              : options.form == "explaining";
  if (explaining ? !specialists.team : specialists.signatures.empty()) {
    fail(kExitData, "{}: no specialists of the {} form{}", options.specialists,
         explaining ? "explaining" : "signature",
         !record.co.empty() ? "" : ", and the record has no column 'co' for the explaining one");
  }
  if (explaining && record.co.empty()) {
    fail(kExitData, "{}: no column 'co': the explaining form needs it", options.record);
  }
  if (record.size() < kWindowSamples) {
    fail(kExitData, "{}: {} samples; a window takes {}", options.record, record.size(),
         kWindowSamples);
  }
  if (explaining) {
    const double period_s = specialists.team->facts.period_s;
    if (std::abs(record.period_s - period_s) > kPeriodTolerance * period_s) {
      fail(kExitData, "{}: its period is {:g} s, the specialists know loops with {:g} s",
           options.record, record.period_s, period_s);
    }
  }
  const std::vector<JudgedWindow> rows =
      explaining ? by_team(*specialists.team, record, options)
                 : by_signatures(specialists.signatures, record, options);
  options.json ? print_json(rows) : print_text(rows, explaining);
  return kExitOk;
}

}  // namespace

void add_classify(Program& program) {
  auto [command, o] = program.command(
      "classify", "Print the specialists' verdict on every window of a record", run_classify);
  command.required("record", o.record, "record, CSV: time, pv, and co for the explaining form");
  command.required("--specialists", o.specialists, "folder with manifest.yaml");
  command.setting("--form", o.form, "auto: explaining if folder and record allow it",
                  one_of({"auto", "explaining", "signature"}));
  command.setting("--every", o.every_s, "s from window to window; 0: half a window",
                  between(0.0, 1e9));
  command.flag("--json", o.json, "print the windows as JSON");
  o.input.add_options(command);
  command.footer(
      "Example: loopwarden classify run.csv --specialists examples/specialists/plant1 --json");
}

}  // namespace loopwarden::workbench
