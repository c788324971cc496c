// SPDX-License-Identifier: Apache-2.0
#include "config/validation/specialist_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <utility>

#include "base/digest/digest.hpp"
#include "base/file.hpp"
#include "config/loop_model_reader.hpp"

namespace loopwarden::config {
namespace {

constexpr double kPeriodTolerance = 0.01;  // relative

std::uint32_t hash_of_manifest(const std::string& folder, std::uint32_t start) {
  const std::filesystem::path manifest = std::filesystem::path(folder) / "manifest.yaml";
  return base::crc32(base::read_file(manifest).value_or(""), start);
}

// Returns why a twin does not fit this loop; empty if it fits.
std::string mismatch(const LoopConfig& loop, const plant::LoopModel& twin) {
  const auto apart = [](double a, double b, double span) {
    return std::abs(a - b) > kPeriodTolerance * std::abs(span);
  };
  const control::PidSettings& pid = loop.controller.pid;
  const control::PidSettings& of_twin = twin.controller.pid;
  const double pv_span = loop.pv.high - loop.pv.low;
  const double co_span = pid.output_high - pid.output_low;
  if (apart(loop.sample_time_s, twin.sample_time_s, loop.sample_time_s)) {
    return fmt::format("has sample_time {:g} s, this loop {:g} s", twin.sample_time_s,
                       loop.sample_time_s);
  }
  if (apart(loop.pv.low, twin.transmitter.low, pv_span) ||
      apart(loop.pv.high, twin.transmitter.high, pv_span)) {
    return fmt::format("has transmitter.range [{:g}, {:g}], this loop's PV [{:g}, {:g}]",
                       twin.transmitter.low, twin.transmitter.high, loop.pv.low, loop.pv.high);
  }
  if (apart(pid.output_low, of_twin.output_low, co_span) ||
      apart(pid.output_high, of_twin.output_high, co_span)) {
    return fmt::format("has controller.output [{:g}, {:g}], this loop's [{:g}, {:g}]",
                       of_twin.output_low, of_twin.output_high, pid.output_low, pid.output_high);
  }
  if (!is_watched(loop.io) && !control::gain_fits(twin.process.gain, pid.action)) {
    return fmt::format("has process.gain {:g}, which contradicts this loop's controller.action",
                       twin.process.gain);
  }
  const alarm::CorrectiveSettings& corrective = loop.monitor.corrective;
  if (twin.process.integrating() && corrective.enabled &&
      corrective.form == alarm::CorrectiveForm::planned_moves) {
    return "has an integrating process: corrective_action of form planned_moves is for "
           "self-regulating ones";
  }
  return "";
}

void append(std::vector<Diagnostic>& all, std::vector<Diagnostic> more) {
  std::move(more.begin(), more.end(), std::back_inserter(all));
}

}  // namespace

watch::WindowSettings window_of(const LoopConfig& loop) {
  constexpr double kSample = 0.1;  // s: a window of 961 samples is then 96 s
  const auto fitting =
      static_cast<std::size_t>(std::max(1L, std::lround(kSample / loop.sample_time_s)));
  return {.overlap = loop.monitor.overlap,
          .decimation = loop.monitor.decimation.value_or(fitting),
          .sample_time_s = loop.sample_time_s,
          .pv_low = loop.pv.low,
          .pv_high = loop.pv.high,
          .co_low = loop.controller.pid.output_low,
          .co_high = loop.controller.pid.output_high,
          .routine = loop.monitor.routine,
          .has_set_point = knows_set_point(loop.io),
          .on_change = is_watched(loop.io)};
}

void SpecialistFiles::check(const LoopFile& file, Report& report,
                            std::vector<Diagnostic>& of_named_files) {
  check_twin(file, report, of_named_files);
  check_specialists(file, report, of_named_files);
}

void SpecialistFiles::check_twin(const LoopFile& loop, Report& report,
                                 std::vector<Diagnostic>& of_named_files) {
  const std::string& file = loop.config.monitor.twin;
  if (file.empty()) return;
  const auto error = [&](const std::string& what) {
    report.error(loop.twin, "monitor.twin", fmt::format("{}{}", file, what));
  };
  if (!read_.twins.contains(file) && !failed_.contains(file)) {
    auto loaded = read_model_file(file);
    append(of_named_files, std::move(loaded.diagnostics));
    if (loaded) {
      read_.twins.emplace(file, std::move(*loaded.value));
    } else {
      failed_.insert(file);
    }
  }
  const auto twin = read_.twins.find(file);
  if (twin == read_.twins.end()) return error(": no twin");
  if (const std::string why = mismatch(loop.config, twin->second); !why.empty()) {
    error(" " + why);
  }
}

void SpecialistFiles::check_specialists(const LoopFile& loop, Report& report,
                                        std::vector<Diagnostic>& of_named_files) {
  const std::string& folder = loop.config.monitor.specialists;
  if (folder.empty()) return;
  const auto error = [&](const std::string& what) {
    report.error(loop.specialists, "monitor.specialists", fmt::format("{}{}", folder, what));
  };
  if (!read_.folders.contains(folder) && !failed_.contains(folder)) {
    auto loaded = read_specialists(folder);
    append(of_named_files, std::move(loaded.diagnostics));
    if (loaded && loaded->team) {
      loaded->signatures.clear();  // the daemon does not use this form
      read_.folders.emplace(
          folder, Specialists::Folder{std::move(*loaded.value), hash_of_manifest(folder, 0)});
      read_.hash = hash_of_manifest(folder, read_.hash);
    } else {
      failed_.insert(folder);
    }
  }
  const auto known = read_.folders.find(folder);
  if (known == read_.folders.end()) return error(": no specialists of the explaining form");
  const double known_s = known->second.content.team->facts.period_s;
  const auto window = window_of(loop.config);
  const double sample_s = window.sample_time_s * static_cast<double>(window.decimation);
  if (std::abs(sample_s - known_s) > kPeriodTolerance * known_s) {
    error(fmt::format(
        " was trained on windows with one sample per {:g} s; this loop has one per {:g} s "
        "(sample_time times monitor.decimation)",
        known_s, sample_s));
  }
}

}  // namespace loopwarden::config
