// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/specialist_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "base/digest/digest.hpp"
#include "base/file.hpp"
#include "config/loop_model_reader.hpp"

namespace loopwarden::daemon {
namespace {

constexpr double kPeriodTolerance = 0.01;  // relative

std::uint32_t hash_of_manifest(const std::string& folder, std::uint32_t start) {
  const std::filesystem::path manifest = std::filesystem::path(folder) / "manifest.yaml";
  return base::crc32(base::read_file(manifest).value_or(""), start);
}

config::Diagnostic error_in(const config::LoopConfig& loop, std::string message,
                            const char* key = "monitor.specialists") {
  return {.level = config::Diagnostic::Level::error,
          .file = loop.file,
          .place = {},
          .key = key,
          .message = std::move(message)};
}

// Why a twin is none of this loop; empty where it is.
std::string mismatch(const config::LoopConfig& loop, const plant::LoopModel& twin) {
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
  if (!config::is_watched(loop.io) && !control::gain_fits(twin.process.gain, pid.action)) {
    return fmt::format("has process.gain {:g}, which contradicts this loop's controller.action",
                       twin.process.gain);
  }
  const loopwarden::monitor::CorrectiveSettings& corrective = loop.monitor.corrective;
  if (twin.process.integrating() && corrective.enabled &&
      corrective.form == loopwarden::monitor::CorrectiveForm::planned_moves) {
    return "has an integrating process: corrective_action of form planned_moves is for "
           "self-regulating ones";
  }
  return "";
}

void load_twin(const config::LoopConfig& loop, Specialists& specialists,
               std::vector<config::Diagnostic>& diagnostics) {
  const std::string& file = loop.monitor.twin;
  if (file.empty()) return;
  auto known = specialists.twins.find(file);
  if (known == specialists.twins.end()) {
    auto loaded = config::read_model_file(file);
    std::move(loaded.diagnostics.begin(), loaded.diagnostics.end(),
              std::back_inserter(diagnostics));
    if (!loaded) {
      diagnostics.push_back(error_in(loop, fmt::format("{}: no twin", file), "monitor.twin"));
      return;
    }
    known = specialists.twins.emplace(file, std::move(*loaded.value)).first;
  }
  if (const std::string why = mismatch(loop, known->second); !why.empty()) {
    diagnostics.push_back(error_in(loop, fmt::format("{} {}", file, why), "monitor.twin"));
  }
}

}  // namespace

loopwarden::monitor::WindowSettings window_of(const config::LoopConfig& loop) {
  constexpr double kSample = 0.1;  // s: a window of 961 is then 96 s
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
          .has_set_point = config::knows_set_point(loop.io),
          .on_change = config::is_watched(loop.io)};
}

config::Loaded<Specialists> load_specialists(const config::Configuration& configuration) {
  config::Loaded<Specialists> result;
  Specialists specialists;
  for (const config::LoopConfig& loop : configuration.loops) {
    load_twin(loop, specialists, result.diagnostics);
    const std::string& folder = loop.monitor.specialists;
    if (folder.empty()) continue;
    if (!specialists.folders.contains(folder)) {
      auto loaded = config::read_specialists(folder);
      std::move(loaded.diagnostics.begin(), loaded.diagnostics.end(),
                std::back_inserter(result.diagnostics));
      if (!loaded || !loaded->team) {
        result.diagnostics.push_back(
            error_in(loop, fmt::format("{}: no specialists of the explaining form", folder)));
        continue;
      }
      loaded->signatures.clear();  // nobody judges by them
      specialists.folders.emplace(
          folder, Specialists::Folder{std::move(*loaded.value), hash_of_manifest(folder, 0)});
      specialists.hash = hash_of_manifest(folder, specialists.hash);
    }
    const double known_s = specialists.folders.at(folder).content.team->facts.period_s;
    const auto window = window_of(loop);
    const double sample_s = window.sample_time_s * static_cast<double>(window.decimation);
    if (std::abs(sample_s - known_s) > kPeriodTolerance * known_s) {
      result.diagnostics.push_back(error_in(
          loop, fmt::format("{} knows windows with a sample each {:g} s; this loop's have one each "
                            "{:g} s (sample_time times monitor.decimation)",
                            folder, known_s, sample_s)));
    }
  }
  if (!config::has_errors(result.diagnostics)) result.value = std::move(specialists);
  return result;
}

}  // namespace loopwarden::daemon
