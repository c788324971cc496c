// SPDX-License-Identifier: Apache-2.0
// loopwarden check: validates configuration folders, loop files, loop models, and specialists.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "config/loop_model_reader.hpp"
#include "config/specialists/specialist_folder.hpp"
#include "config/validation/validation.hpp"
#include "daemon/registers/register_map.hpp"
#include "model/control/tuning.hpp"
#include "workbench/commands/subcommands.hpp"
#include "workbench/files/model_file.hpp"

namespace loopwarden::workbench {
namespace {

struct CheckOptions {
  std::vector<std::string> files;
  bool json = false;
};

struct Checked {
  std::vector<config::Diagnostic> diagnostics;
  bool good = false;
  std::string summary;  // content of the file, as text
};

std::string tuning_text(const control::PidGains& gains, double pv_span, double co_span) {
  const control::IsaTuning isa = control::to_isa(gains, pv_span, co_span);
  return fmt::format("Kp {:g}, Ki {:g} 1/s = Kc {:.4g}, Ti {:.4g} s, Td {:.4g} s", gains.kp,
                     gains.ki, isa.kc, isa.ti_s, isa.td_s);
}

std::string loop_text(const config::LoopConfig& loop) {
  if (config::is_watched(loop.io)) {
    return fmt::format("loop {}, sample time {:g} s, controlled elsewhere", loop.name,
                       loop.sample_time_s);
  }
  const control::PidSettings& pid = loop.controller.pid;
  return fmt::format("loop {}, sample time {:g} s, {}", loop.name, loop.sample_time_s,
                     tuning_text(pid.gains, loop.pv.high - loop.pv.low, pid.output_span()));
}

// A loop file has the key `loop` at its top level. A model does not.
bool is_loop_file(const std::string& path) {
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("loop:") || line.starts_with("loop :")) return true;
  }
  return false;
}

template <class T, class Describe>
Checked checked(config::Loaded<T> loaded, Describe describe) {
  Checked result{std::move(loaded.diagnostics), loaded.value.has_value(), {}};
  if (result.good) result.summary = describe(*loaded.value);
  return result;
}

Checked check(const std::string& path) {
  if (std::filesystem::exists(std::filesystem::path(path) / "manifest.yaml")) {
    return checked(config::read_specialists(path), [](const config::SpecialistFolder& s) {
      return fmt::format("specialists of {}: {} explaining, {} of signatures; {}, seed {}", s.plant,
                         s.team ? s.team->members.size() : 0, s.signatures.size(),
                         s.training.source, s.training.seed);
    });
  }
  if (std::filesystem::is_directory(path)) {
    return checked(config::validate_all(path), [](const config::Configuration& c) {
      std::string text = fmt::format("{} loop{}", c.loops.size(), c.loops.size() == 1 ? "" : "s");
      for (std::size_t i = 0; i < c.loops.size(); ++i) {
        text += "\n  " + loop_text(c.loops[i]);
        if (i >= registers::kMostLoops) text += "; no block in the register map";
      }
      return text;
    });
  }
  if (is_loop_file(path)) return checked(config::validate_loop_file(path), loop_text);
  return checked(config::read_model_file(path), [](const plant::LoopModel& m) {
    const control::PidSettings& pid = m.controller.pid;
    return fmt::format("model: {}; {}", process_text(m.process),
                       tuning_text(pid.gains, m.transmitter.span(), pid.output_span()));
  });
}

nlohmann::json as_json(const std::string& path, const Checked& result) {
  nlohmann::json diagnostics = nlohmann::json::array();
  for (const config::Diagnostic& d : result.diagnostics) {
    diagnostics.push_back({{"file", d.file},
                           {"line", d.place.line},
                           {"column", d.place.column},
                           {"level", config::to_text(d.level)},
                           {"key", d.key},
                           {"message", d.message}});
  }
  return {{"file", path}, {"good", result.good}, {"diagnostics", std::move(diagnostics)}};
}

int run_check(const CheckOptions& options) {
  int exit_code = kExitOk;
  nlohmann::json results = nlohmann::json::array();
  for (const std::string& path : options.files) {
    Checked result = check(path);
    if (!result.good) exit_code = kExitConfiguration;
    if (options.json) {
      results.push_back(as_json(path, result));
      continue;
    }
    std::stable_sort(result.diagnostics.begin(), result.diagnostics.end(),
                     [](const config::Diagnostic& a, const config::Diagnostic& b) {
                       return a.level > b.level;  // errors, warnings, notes
                     });
    fmt::print(stderr, "{}", config::to_text(result.diagnostics));
    if (result.good) fmt::print("{}: ok, {}\n", path, result.summary);
  }
  if (options.json)
    fmt::print("{}\n", results.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
  return exit_code;
}

}  // namespace

void add_check(Program& program) {
  auto [command, o] = program.command(
      "check", "Validate configuration folders, loop files, models and specialists", run_check);
  command.required("files", o.files, "files or folders");
  command.flag("--json", o.json, "print the diagnostics as JSON");
  command.footer("Example: loopwarden check /etc/loopwardend examples/models/plant1.yaml");
}

}  // namespace loopwarden::workbench
