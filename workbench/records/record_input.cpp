// SPDX-License-Identifier: Apache-2.0
#include "workbench/records/record_input.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>

#include "model/analysis/stretch.hpp"
#include "base/text.hpp"
#include "workbench/command_line/progress.hpp"
#include "workbench/records/format_file.hpp"
#include "workbench/records/rules_file.hpp"

namespace loopwarden::workbench {
namespace {

using analysis::ArchiveKind;
using record::Role;

std::vector<std::string> split_at(const std::string& text, char at) {
  std::vector<std::string> parts;
  std::size_t from = 0;
  while (from <= text.size()) {
    const std::size_t end = std::min(text.find(at, from), text.size());
    parts.push_back(text.substr(from, end - from));
    from = end + 1;
  }
  return parts;
}

// Parses pv=FIC101.PV,co=FIC101.OP. A name may contain a comma if no role follows it.
record::LoopSignals signals_from(const std::string& map) {
  record::LoopSignals signals;
  std::optional<Role> last;
  for (const std::string& part : split_at(map, ',')) {
    const std::size_t equals = part.find('=');
    std::optional<Role> role;
    if (equals != std::string::npos) {
      role = record::role_from_text(base::trimmed(part.substr(0, equals)));
    }
    if (!role) {
      if (!last) {
        throw RecordInputError(
            kExitUsage, fmt::format("--map: {} is not ROLE=NAME with one of pv, co, sp, stem, mode",
                                    base::in_quotes(part)));
      }
      signals.names[index_of(*last)] += "," + part;
      continue;
    }
    signals.names[index_of(*role)] = std::string(base::trimmed(part.substr(equals + 1)));
    last = role;
  }
  if (!signals.has(Role::pv)) throw RecordInputError(kExitUsage, "--map: pv=NAME is missing");
  return signals;
}

std::string archive_text(const char* signal, const analysis::ArchivedSignal& found) {
  if (found.kind == ArchiveKind::none) return {};
  std::string text = fmt::format("{} ", signal);
  switch (found.kind) {
    case ArchiveKind::exception:
      text += fmt::format("by exception, dead band about {:.2g}", found.deviation);
      break;
    case ArchiveKind::swinging_door:
      text += fmt::format("by swinging door, deviation about {:.2g}", found.deviation);
      break;
    default: text += "in a way that is not known";
  }
  return text + fmt::format(" ({:.2g} % of the samples stored)", 100.0 * found.stored_share);
}

}  // namespace

void RecordInput::add_options(Command& command, bool one_loop) {
  Command reading = command.group("Reading of the record");
  if (one_loop) reading.option("--loop", loop_, "tag of the loop, if a file has several loops");
  reading.option(
      "--map", map_,
      "columns or tags by role: pv=FIC101.PV,co=FIC101.OP,sp=FIC101.SP (also stem, mode)");
  reading.option("--format", format_,
                 "YAML with the layout of the export (docs/reference/import-formats.md)");
  reading.option(
      "--time", time_,
      "form of the times: seconds, milliseconds, microseconds, nanoseconds, minutes or "
      "hours since any start; epoch-s, epoch-ms, epoch-us or epoch-ns since 1970; "
      "excel, ymd, dmy, mdy",
      one_of({"seconds", "milliseconds", "microseconds", "nanoseconds", "minutes", "hours",
              "epoch-s", "epoch-ms", "epoch-us", "epoch-ns", "excel", "ymd", "dmy", "mdy"}));
  reading.option("--time-column", time_column_,
                 "name of the column of times, or its number from 1");
  reading.option("--zone", zone_, "time zone of local times: +01:00, UTC");
  reading.option("--delimiter", delimiter_, "comma, semicolon, tab, bar, space or one character");
  reading.option("--decimal", decimal_, "point or comma", one_of({"point", "comma"}));
  reading.option("--encoding", encoding_, "utf-8, utf-16 or latin-1",
                 one_of({"utf-8", "utf-16", "latin-1"}));
  reading.option("--header-rows", header_rows_, "lines before the first row of data",
                 between(0, 1000));
  reading.option("--bad-value", bad_values_, "a word for a bad value; may be given several times");
  reading.option("--period", period_s_, "period of the samples, s; default: chosen from the data",
                 between(1e-6, 1e7));
  reading.option("--fill", fill_, "between values that an archive stored: held or linear",
                 one_of({"held", "linear"}));
}

void RecordInput::add_rules(Command& command) {
  command.group("Reading of the record")
      .option("--rules", rules_,
              "YAML with the site's rules: which columns or tags are which signal of which loop, "
              "units, ranges, words for modes (docs/reference/import-formats.md)");
}

record::ImportOptions RecordInput::options() const {
  record::ImportOptions out;
  if (!format_.empty()) {
    auto format = read_format_file(format_);
    fmt::print(stderr, "{}", config::to_text(format.diagnostics));
    if (!format) throw RecordInputError(kExitConfiguration, format_ + ": can't be used");
    out = std::move(*format);
  }
  if (!map_.empty()) out.loops = {signals_from(map_)};
  if (!rules_.empty()) {
    if (!out.loops.empty()) {
      throw RecordInputError(kExitUsage, fmt::format("--rules: {} names the loops already",
                                                     map_.empty() ? format_ : "--map"));
    }
    auto rules = read_rules_file(rules_);
    fmt::print(stderr, "{}", config::to_text(rules.diagnostics));
    if (!rules) throw RecordInputError(kExitConfiguration, rules_ + ": can't be used");
    out.rules = std::move(rules->rules);
    out.tags = std::move(rules->tags);
  }
  if (!time_.empty()) out.time = *record::time_form(time_);
  if (!time_column_.empty()) out.time_column = time_column_;
  if (!zone_.empty()) {
    out.zone_s = record::zone_offset_s(base::lower_case(zone_));
    if (!out.zone_s) {
      throw RecordInputError(kExitUsage, fmt::format("--zone: {} is no offset such as +01:00",
                                                     base::in_quotes(zone_)));
    }
  }
  if (!delimiter_.empty()) {
    constexpr std::array<std::pair<const char*, char>, 5> kWords{
        {{"comma", ','}, {"semicolon", ';'}, {"tab", '\t'}, {"bar", '|'}, {"space", ' '}}};
    for (const auto& [word, character] : kWords) {
      if (delimiter_ == word) out.delimiter = character;
    }
    if (!out.delimiter && delimiter_.size() == 1) out.delimiter = delimiter_.front();
    if (!out.delimiter) {
      throw RecordInputError(kExitUsage,
                             "--delimiter: comma, semicolon, tab, bar, space or one character");
    }
  }
  if (!decimal_.empty()) out.decimal = decimal_ == "comma" ? ',' : '.';
  for (const auto known :
       {record::Encoding::utf8, record::Encoding::utf16, record::Encoding::latin1}) {
    if (encoding_ == record::to_text(known)) out.encoding = known;
  }
  if (header_rows_ >= 0) out.header_rows = static_cast<std::size_t>(header_rows_);
  for (const std::string& word : bad_values_) out.bad_words.push_back(base::lower_case(word));
  if (period_s_ > 0.0) out.period_s = period_s_;
  if (fill_ == "held") out.filling = record::Filling::held;
  if (fill_ == "linear") out.filling = record::Filling::linear;
  return out;
}

record::Imported RecordInput::read(const std::filesystem::path& path) const {
  const record::ImportOptions how = options();
  Progress progress(path.string(), 1000);
  record::Imported imported =
      record::import_record(path, loop_, how, [&](double share) { progress.update_share(share); });
  fmt::print(stderr, "{}{}", import_text(imported), record::bad_words_text(imported.notes.words));
  return imported;
}

bool RecordInput::takes(const std::string& tag) const {
  return loop_.empty() || base::lower_case(loop_) == base::lower_case(tag);
}

void draw_for_judging(record::Imported& imported) {
  const auto draw = [](std::vector<double>& column, const analysis::ArchivedSignal& found) {
    if (found.kind == ArchiveKind::exception) {
      column = analysis::within_band(column, found.deviation);
    }
  };
  draw(imported.record.pv, imported.notes.pv);
  if (!imported.record.co.empty()) draw(imported.record.co, imported.notes.co);
}

std::size_t leave_out_manual(record::Record& r) {
  if (r.automatic.empty()) return 0;
  std::size_t left_out = 0;
  for (std::size_t k = 0; k < r.size(); ++k) {
    if (r.automatic[k] != 0.0) continue;
    r.pv[k] = std::numeric_limits<double>::quiet_NaN();
    if (!r.co.empty()) r.co[k] = std::numeric_limits<double>::quiet_NaN();
    ++left_out;
  }
  return left_out;
}

std::size_t telling_part(const record::Record& r, std::size_t length) {
  return analysis::telling_stretches(r.view(), length, 1).front();
}

void keep_telling_part(record::Record& r, std::size_t most, const std::string& name) {
  if (r.size() <= 2 * most) return;
  const std::size_t all = r.size();
  const std::size_t from = telling_part(r, most);
  r.time_s.erase(r.time_s.begin(), r.time_s.begin() + static_cast<std::ptrdiff_t>(from));
  r.time_s.resize(most);
  static_cast<numeric::LoopRecord&>(r) = r.part(from, from + most);
  fmt::print(stderr, "{}: {} samples: the {:g} s from {:g} s on, in which most moves\n", name, all,
             r.time_s.back() - r.time_s.front(), r.time_s.front());
}

std::size_t FilesRead::lost() const {
  return static_cast<std::size_t>(std::count_if(
      bad.begin(), bad.end(), [this](std::size_t file) { return good.count(file) == 0; }));
}

ExitCode reading_exit_code(bool something_failed, bool nothing_read,
                           const record::Importer& importer) {
  if (!something_failed && !nothing_read) return kExitOk;
  const auto& problems = importer.problems();
  const bool by_system = std::any_of(problems.begin(), problems.end(), [](const auto& problem) {
    return problem.kind == record::RecordError::Kind::io;
  });
  return nothing_read && by_system ? kExitIo : kExitData;
}

std::string rules_text(const record::Importer& importer, bool with_rules) {
  constexpr std::size_t kMost = 6;
  const std::vector<std::string>& names = importer.other_names();
  const std::set<std::string> unknown(names.begin(), names.end());
  std::string text;
  if (!unknown.empty()) {
    text = fmt::format("{} {} to no loop: ", unknown.size(),
                       unknown.size() == 1 ? "column or tag belongs" : "columns or tags belong");
    std::size_t shown = 0;
    for (const std::string& name : unknown) {
      if (shown++ < kMost) text += (shown > 1 ? ", " : "") + base::in_quotes(name);
    }
    if (shown > kMost) text += ", ...";
    text += with_rules
                ? "\n"
                : "; --rules RULES.yaml assigns them to loops (docs/reference/import-formats.md)\n";
  }
  for (const std::string& rule : importer.idle_rules()) text += rule + "\n";
  return text;
}

std::string import_text(const record::Imported& imported) {
  const record::ImportNotes& n = imported.notes;
  const record::Record& r = imported.record;
  std::string text;
  const auto line = [&](const std::string& what) { text += n.files + ": " + what + "\n"; };
  if (!n.layout.empty()) {
    line(n.layout);
    std::string names = n.tag + ":";
    for (const Role role : {Role::pv, Role::sp, Role::co, Role::stem, Role::mode}) {
      const std::string& name = n.names[index_of(role)];
      const std::string& unit = n.units[index_of(role)];
      if (!name.empty()) {
        names += fmt::format(" {} '{}'{}", to_text(role), name, unit.empty() ? "" : " in " + unit);
      }
    }
    line(names);
    std::string samples = fmt::format("{} samples, period {:.6g} s", r.size(), r.period_s);
    if (n.start) {
      samples +=
          ", from " + record::iso_text(n.start->whole_s, n.start->rest_s, n.start->zone_known);
    }
    if (n.missing > 0) samples += fmt::format("; {} without a value", n.missing);
    if (n.bad + n.questionable > 0) {
      samples += fmt::format(" ({} cells bad, {} questionable)", n.bad, n.questionable);
    }
    if (n.same_time > 0)
      samples += fmt::format("; {} values replaced by a later one with the same time", n.same_time);
    line(samples);
  }
  if (!n.resampled.empty()) line(n.resampled);
  if (n.compressed()) {
    const std::string pv = archive_text("PV", n.pv);
    const std::string co = archive_text("CO", n.co);
    line("compressed: " + pv + (pv.empty() || co.empty() ? "" : "; ") + co);
  }
  for (const std::string& remark : n.remarks) line(remark);
  return text;
}

}  // namespace loopwarden::workbench
