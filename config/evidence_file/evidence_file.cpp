// SPDX-License-Identifier: Apache-2.0
#include "config/evidence_file/evidence_file.hpp"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>
#include <vector>

#include "base/digest/digest.hpp"
#include "base/file.hpp"
#include "model/alarm/alarm_guide.hpp"
#include "model/watch/limits.hpp"
#include "record/record_csv.hpp"

namespace loopwarden::evidence {
namespace {

namespace fs = std::filesystem;
using alarm::AlarmKind;
using nlohmann::json;
using specialist::Condition;
using Result = alarm::WindowJudgement::Result;

constexpr const char* kFormat = "loopwarden-evidence";
// Version 1 had only windows of specialists, without a kind; version 2 had no twins.
constexpr int kVersion = 3;
constexpr std::array kKinds{"window", "routine", "twin"};

constexpr std::array kStickSources{"none", "read-back", "PV and CO"};
constexpr std::array kResults{Result::no_fault, Result::fault, Result::not_enough_movement};
constexpr std::array kVerdicts{
    diagnosis::DiagnosisVerdict::valve_effect, diagnosis::DiagnosisVerdict::other_cause,
    diagnosis::DiagnosisVerdict::healthy, diagnosis::DiagnosisVerdict::not_enough_data,
    diagnosis::DiagnosisVerdict::cant_tell};
constexpr std::array kGrades{diagnosis::Grade::none, diagnosis::Grade::likely,
                             diagnosis::Grade::seen};

template <class Value, std::size_t n>
Value named(const std::array<Value, n>& values, const std::string& name) {
  const auto found =
      std::find_if(values.begin(), values.end(), [&](Value v) { return name == to_text(v); });
  if (found != values.end()) return *found;
  throw EvidenceError("verdict: unknown '" + name + "'");
}

json to_json(const alarm::WindowJudgement& j) {
  json probability = json::object();
  for (const AlarmKind kind : alarm::kWindowAlarms) {
    probability[alarm::to_text(kind)] = j.probability[alarm::index_of(kind)];
  }
  json errors = json::object();
  for (std::size_t c = 0; c < specialist::kConditions; ++c) {
    errors[specialist::to_text(static_cast<Condition>(c))] = j.errors[c];
  }
  return {{"result", to_text(j.result)},
          {"fault", j.result == Result::fault ? json(alarm::to_text(j.fault)) : json(nullptr)},
          {"severity_percent", j.severity_percent},
          {"probability", std::move(probability)},
          {"error_percent_squared", std::move(errors)}};
}

json to_json(const alarm::WindowMeasures& m) {
  return {{"oscillation_index", m.oscillation_index},
          {"period_s", m.period_s},
          {"variability_percent", m.variability_percent},
          {"mean_error_percent", m.mean_error_percent},
          {"saturated_percent", m.saturated_percent},
          {"travel_percent_per_hour", m.travel_percent_per_hour},
          {"reversals_per_hour", m.reversals_per_hour},
          {"stick_percent", m.stick_percent},
          {"stick_source", kStickSources[static_cast<std::size_t>(m.stick_source)]},
          {"bridged_cycles", m.bridged_cycles}};
}

json to_json(const watch::RoutineWatch::Judgement& j) {
  return {{"result", to_text(j.verdict)},
          {"grade", to_text(j.grade)},
          {"probability", j.probability},
          {"fault", alarm::to_text(j.fault)},
          {"severity_percent", j.severity_percent},
          {"log_odds", j.evidence.log_odds},
          {"band_share", j.evidence.share},
          {"explained", j.evidence.explained},
          {"standing", j.evidence.standing},
          {"turns",
           {{"count", j.evidence.reversals.count},
            {"travel_scatter", j.evidence.reversals.travel_scatter},
            {"cycle_scatter", j.evidence.reversals.cycle_scatter},
            {"four_cycle_scatter", j.evidence.reversals.four_cycle_scatter}}},
          {"nats",
           {{"before", j.sum_before}, {"from_specialists", j.from_specialists}, {"after", j.sum}}}};
}

json to_json(const TwinFinding& t) {
  json found = {{"result", alarm::to_text(AlarmKind::model_gap)}, {"change", t.change}};
  if (std::isfinite(t.controller)) found["controller"] = t.controller;
  return found;
}

const char* kind_of(const Evidence& e) {
  if (e.routine) return kKinds[1];
  return e.by_twin ? kKinds[2] : kKinds[0];
}

json about_alarm(const Evidence& e) {
  return {{"format", kFormat},
          {"format_version", kVersion},
          {"kind", kind_of(e)},
          {"loop", e.loop},
          {"control", e.elsewhere ? "elsewhere" : "here"},
          {"alarm", alarm::to_text(e.alarm)},
          {"raised_ms", e.raised_ms},
          {"raised_utc", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}",
                                     fmt::gmtime(static_cast<std::time_t>(e.raised_ms / 1000)))},
          {"guide",
           {{"cause", alarm::guide_of(e.alarm).cause},
            {"consequence", alarm::guide_of(e.alarm).consequence},
            {"action", alarm::guide_of(e.alarm).action}}},
          {"window",
           {{"samples", e.pv.size()},
            {"sample_time_s", e.sample_time_s},
            {"pv_range", {e.pv_low, e.pv_high}},
            {"co_range", {e.co_low, e.co_high}}}},
          {"program", {{"version", e.version}}},
          {"configuration", {{"crc32", e.config_hash}, {"loop_file", e.loop_file}}}};
}

json to_json(const Evidence& e) {
  json about = about_alarm(e);
  if (e.routine) {
    about["verdict"] = to_json(*e.routine);
    return about;
  }
  if (e.by_twin) {
    about["verdict"] = to_json(*e.by_twin);
    return about;
  }
  about["verdict"] = to_json(e.judgement);
  about["measures"] = to_json(e.measures);
  about["specialists"] = {{"folder", e.specialists_folder}, {"crc32", e.specialists_hash}};
  return about;
}

alarm::WindowJudgement judgement_of(const json& j) {
  alarm::WindowJudgement judgement;
  judgement.result = named(kResults, j.at("result").get<std::string>());
  for (const AlarmKind kind : alarm::kWindowAlarms) {
    judgement.probability[alarm::index_of(kind)] =
        j.at("probability").at(alarm::to_text(kind)).get<double>();
    if (j.at("fault") == alarm::to_text(kind)) judgement.fault = kind;
  }
  for (std::size_t c = 0; c < specialist::kConditions; ++c) {
    judgement.errors[c] = j.at("error_percent_squared")
                              .at(specialist::to_text(static_cast<Condition>(c)))
                              .get<double>();
  }
  judgement.severity_percent = j.at("severity_percent").get<double>();
  return judgement;
}

alarm::WindowMeasures measures_of(const json& j) {
  alarm::WindowMeasures m;
  m.oscillation_index = j.at("oscillation_index").get<double>();
  m.period_s = j.at("period_s").get<double>();
  m.variability_percent = j.at("variability_percent").get<double>();
  m.mean_error_percent = j.at("mean_error_percent").get<double>();
  m.saturated_percent = j.at("saturated_percent").get<double>();
  m.travel_percent_per_hour = j.at("travel_percent_per_hour").get<double>();
  m.reversals_per_hour = j.at("reversals_per_hour").get<double>();
  m.stick_percent = j.at("stick_percent").get<double>();
  for (std::size_t i = 0; i < kStickSources.size(); ++i) {
    if (j.at("stick_source") == kStickSources[i]) {
      m.stick_source = static_cast<alarm::StickSource>(i);
    }
  }
  m.bridged_cycles = j.at("bridged_cycles").get<std::size_t>();
  return m;
}

watch::RoutineWatch::Judgement routine_of(const json& j) {
  watch::RoutineWatch::Judgement r;
  r.verdict = named(kVerdicts, j.at("result").get<std::string>());
  r.grade = named(kGrades, j.at("grade").get<std::string>());
  r.fault = named(alarm::kValveAlarms, j.at("fault").get<std::string>());
  r.probability = j.at("probability").get<double>();
  r.severity_percent = j.at("severity_percent").get<double>();
  // Files of earlier versions lack some of these.
  r.evidence = {.log_odds = j.value("log_odds", 0.0),
                .share = j.value("band_share", 0.0),
                .explained = j.value("explained", 0.0),
                .standing = j.value("standing", 0.0),
                .reversals = {}};
  if (const auto reversals = j.find("turns"); reversals != j.end()) {
    r.evidence.reversals = {
        .count = reversals->at("count").get<std::size_t>(),
        .travel_scatter = reversals->at("travel_scatter").get<double>(),
        .cycle_scatter = reversals->at("cycle_scatter").get<double>(),
        .four_cycle_scatter = reversals->at("four_cycle_scatter").get<double>()};
  }
  const json& nats = j.at("nats");
  r.sum_before = nats.at("before").get<double>();
  r.from_specialists = nats.at("from_specialists").get<double>();
  r.sum = nats.at("after").get<double>();
  return r;
}

Evidence evidence_of(const json& j) {
  const bool is_evidence = j.at("format") == kFormat;
  const int version = is_evidence ? j.at("format_version").get<int>() : 0;
  if (version < 1 || version > kVersion) {
    throw EvidenceError(fmt::format("it is no {} of version 1 to {}", kFormat, kVersion));
  }
  const std::string kind = version == 1 ? kKinds[0] : j.at("kind").get<std::string>();
  if (std::find(kKinds.begin(), kKinds.end(), kind) == kKinds.end()) {
    throw EvidenceError("kind: unknown '" + kind + "'");
  }
  Evidence e;
  e.loop = j.at("loop").get<std::string>();
  e.elsewhere = j.value("control", "here") == "elsewhere";
  const auto alarm = j.at("alarm").get<std::string>();
  for (const AlarmKind known : alarm::kValveAlarms) {
    if (alarm == alarm::to_text(known)) e.alarm = known;
  }
  e.raised_ms = j.at("raised_ms").get<std::int64_t>();
  if (kind == kKinds[1]) {
    e.routine = routine_of(j.at("verdict"));
  } else if (kind == kKinds[2]) {
    const json& found = j.at("verdict");
    // Evidence of another version has other measures.
    e.by_twin = {found.value("change", 0.0), found.value("controller", std::nan(""))};
  } else {
    e.judgement = judgement_of(j.at("verdict"));
    e.measures = measures_of(j.at("measures"));
    e.specialists_folder = j.at("specialists").at("folder").get<std::string>();
    e.specialists_hash = j.at("specialists").at("crc32").get<std::uint32_t>();
  }
  const json& window = j.at("window");
  e.sample_time_s = window.at("sample_time_s").get<double>();
  if (e.routine) {
    e.routine->window_s = e.sample_time_s * window.at("samples").get<double>();
  }
  e.pv_low = window.at("pv_range").at(0).get<double>();
  e.pv_high = window.at("pv_range").at(1).get<double>();
  e.co_low = window.at("co_range").at(0).get<double>();
  e.co_high = window.at("co_range").at(1).get<double>();
  e.version = j.at("program").at("version").get<std::string>();
  e.config_hash = j.at("configuration").at("crc32").get<std::uint32_t>();
  e.loop_file = j.at("configuration").at("loop_file").get<std::string>();
  return e;
}

void write_record(const Evidence& e, const fs::path& path) {
  const bool has_stem = !e.stem.empty() && std::isfinite(e.stem.front());
  const bool has_sp = !e.sp.empty() && std::isfinite(e.sp.front());
  record::RecordCsvWriter csv(path, {.sp = has_sp, .stem = has_stem});
  for (std::size_t k = 0; k < e.pv.size(); ++k) {
    csv.add({.time_s = static_cast<double>(k) * e.sample_time_s,
             .pv = e.pv[k],
             .sp = e.sp[k],
             .co = e.co[k],
             .stem = e.stem[k]});
  }
  csv.finish();
}

void write_text(const std::string& text, const fs::path& path) {
  base::File file(path, O_WRONLY | O_CREAT | O_EXCL);
  if (!file.is_open() || !file.write(text.data(), text.size()) || !file.sync() || !file.close()) {
    throw EvidenceError(fmt::format("{}: {}", path.string(), base::error_text(errno)));
  }
}

// Waits until files written by another library are on the disk.
void sync_files(const fs::path& folder) {
  for (const auto& entry : fs::directory_iterator(folder)) {
    base::File file(entry.path(), O_RDONLY);
    if (!file.is_open() || !file.sync()) {
      throw EvidenceError(fmt::format("{}: {}", entry.path().string(), base::error_text(errno)));
    }
  }
}

std::uint32_t crc_of(const fs::path& path) {
  return base::crc32(base::read_file(path).value_or(""));
}

// Returns the files that the verdict depends on. The manifest contains the digests of the weights.
std::vector<const char*> files_of(const Evidence& evidence) {
  if (evidence.routine) return {"record.csv"};
  if (evidence.by_twin) return {"record.csv", "twin.yaml"};
  return {"record.csv", "specialists/manifest.yaml"};
}

void put_specialists(const config::SpecialistFolder& specialists, const fs::path& folder) {
  fs::create_directory(folder);
  const std::string wrong = config::write_specialists(specialists, folder);
  if (!wrong.empty()) throw EvidenceError(wrong);
  sync_files(folder);
  if (!base::sync_folder(folder)) {
    throw EvidenceError(fmt::format("{}: {}", folder.string(), base::error_text(errno)));
  }
}

void write_into(const Evidence& evidence, const config::SpecialistFolder* specialists,
                const fs::path& folder) {
  fs::create_directory(folder);
  write_record(evidence, folder / "record.csv");
  if (!evidence.twin.empty()) write_text(evidence.twin, folder / "twin.yaml");
  if (specialists != nullptr) put_specialists(*specialists, specialists_of(folder));
  json about = to_json(evidence);
  for (const char* file : files_of(evidence)) about["files"][file] = crc_of(folder / file);
  write_text(about.dump(2, ' ', false, json::error_handler_t::replace) + "\n",
             folder / "evidence.json");
  if (!base::sync_folder(folder)) {
    throw EvidenceError(fmt::format("{}: {}", folder.string(), base::error_text(errno)));
  }
}

}  // namespace

fs::path specialists_of(const fs::path& folder) { return folder / "specialists"; }

void write_evidence(const Evidence& evidence, const config::SpecialistFolder* specialists,
                    const fs::path& folder) {
  const fs::path temporary = folder.parent_path() / ("." + folder.filename().string() + ".tmp");
  std::error_code ignored;
  fs::remove_all(temporary, ignored);  // left by a program that was killed
  try {
    write_into(evidence, specialists, temporary);
    fs::rename(temporary, folder);
    base::sync_folder(folder.parent_path());
  } catch (const std::exception& e) {
    fs::remove_all(temporary, ignored);
    throw EvidenceError(e.what());
  }
}

Evidence read_evidence(const fs::path& folder) {
  const fs::path file = folder / "evidence.json";
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw EvidenceError(file.string() + ": missing or unreadable");
  Evidence evidence;
  try {
    const json about = json::parse(stream);
    evidence = evidence_of(about);
    for (const char* name : files_of(evidence)) {
      if (about.at("files").at(name) != crc_of(folder / name)) {
        throw EvidenceError(fmt::format("{} has been changed", name));
      }
    }
  } catch (const std::exception& e) {
    throw EvidenceError(fmt::format("{}: {}", file.string(), e.what()));
  }
  try {
    record::Record record = record::read_record(folder / "record.csv");
    const std::size_t samples =
        evidence.routine ? watch::WatchLimits::kRoutineSamples : alarm::kWindowSamples;
    // A record of routine evidence may also have two windows.
    const bool fits =
        record.size() == samples || (evidence.routine && record.size() == 2 * samples);
    if ((!evidence.by_twin && !fits) || record.sp.empty() || record.co.empty()) {
      throw EvidenceError(fmt::format("{}: it is no window of {} samples with sp, pv and co",
                                      (folder / "record.csv").string(), samples));
    }
    evidence.sp = std::move(record.sp);
    evidence.pv = std::move(record.pv);
    evidence.co = std::move(record.co);
    evidence.stem = !record.stem.empty() ? std::move(record.stem)
                                         : std::vector<double>(evidence.pv.size(), std::nan(""));
  } catch (const record::RecordError& e) {
    throw EvidenceError(e.what());
  }
  return evidence;
}

}  // namespace loopwarden::evidence
