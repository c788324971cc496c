// SPDX-License-Identifier: Apache-2.0
#include "config/config_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <system_error>
#include <tuple>

#include "base/digest/digest.hpp"
#include "config/document.hpp"
#include "config/bus_budget.hpp"
#include "config/daemon_reader.hpp"
#include "config/loop_reader.hpp"
#include "config/map_reader.hpp"

namespace loopwarden::config {
namespace {

namespace fs = std::filesystem;
using hal::modbus::LinkSettings;
using hal::modbus::LoopModbusSettings;

constexpr const char* kDaemonFile = "loopwardend.yaml";
constexpr const char* kLoopFolder = "loops.d";

void append(std::vector<Diagnostic>& all, std::vector<Diagnostic> more) {
  std::move(more.begin(), more.end(), std::back_inserter(all));
}

std::optional<std::string> text_of(const fs::path& path, const Drafts& drafts, Report& report) {
  const auto draft = drafts.find(path);
  return draft == drafts.end() ? read_source_file(path, report) : draft->second;
}

// `kept` gets the file's text behind what it holds.
DaemonFile read_daemon_file(const fs::path& path, const Drafts& drafts, Report& report,
                            std::string& kept) {
  DaemonFile daemon;
  daemon.config.file = path.string();
  std::error_code error;
  if (!drafts.contains(path) && !fs::exists(path, error) && !error) return daemon;  // defaults
  if (const std::optional<std::string> text = text_of(path, drafts, report)) {
    kept += *text;
    read_document(*text, report, [&](MapReader& in) { daemon = read_daemon(in, path.string()); });
  }
  return daemon;
}

// The loop files of a configuration in the order of their names; the report says what was passed
// over.
std::vector<fs::path> find_loop_files(const fs::path& folder, const Drafts& drafts,
                                      Report& report) {
  std::vector<fs::path> files;
  for (const auto& [path, text] : drafts) {
    if (path.parent_path() == folder) files.push_back(path);
  }
  std::error_code error;
  fs::directory_iterator entries(folder, error);
  if (error == std::errc::no_such_file_or_directory && !files.empty()) return files;
  if (error) {
    report.error({}, "", fmt::format("can't be read: {}", error.message()));
    return files;
  }
  for (; entries != fs::directory_iterator(); entries.increment(error)) {
    const fs::path& path = entries->path();
    const std::string name = path.filename().string();
    if (path.extension() == ".yaml" && !name.starts_with('.')) {
      if (!drafts.contains(path)) files.push_back(path);
    } else if (path.extension() == ".yml") {
      report.warning({}, "", fmt::format("{} is passed over; loop files end in .yaml", name));
    }
    if (error) break;
  }
  if (error) report.error({}, "", fmt::format("can't be read: {}", error.message()));
  std::sort(files.begin(), files.end());
  if (files.empty()) report.error({}, "", "holds no loop file (*.yaml)");
  return files;
}

// Registers that a loop writes, on the device that carries them.
struct WrittenRegisters {
  std::string device;  // line or network peer, and unit
  int first = 0;
  int last = 0;
};

std::string device_text(const LinkSettings& link, int unit) {
  return link.transport == hal::modbus::Transport::rtu
             ? fmt::format("{} unit {}", link.device, unit)
             : fmt::format("{} port {} unit {}", link.host, link.port, unit);
}

WrittenRegisters written_registers(const LoopModbusSettings& modbus) {
  const hal::modbus::RegisterSpec& reg = modbus.command.reg;
  return {device_text(modbus.positioner_link, modbus.command.unit), reg.address,
          reg.address + register_count(reg.type) - 1};
}

// What both loops write, in words; empty if they write different things.
std::string shared_output(const LoopConfig& a, const LoopConfig& b) {
  const auto* modbus_a = std::get_if<LoopModbusSettings>(&a.io);
  const auto* modbus_b = std::get_if<LoopModbusSettings>(&b.io);
  if (modbus_a != nullptr && modbus_b != nullptr) {
    const WrittenRegisters ra = written_registers(*modbus_a);
    const WrittenRegisters rb = written_registers(*modbus_b);
    if (ra.device != rb.device || ra.first > rb.last || rb.first > ra.last) return {};
    return fmt::format("{} register {}", ra.device, std::max(ra.first, rb.first));
  }
  const auto* analog_a = std::get_if<hal::iio::AnalogSettings>(&a.io);
  const auto* analog_b = std::get_if<hal::iio::AnalogSettings>(&b.io);
  if (analog_a == nullptr || analog_b == nullptr) return {};
  const hal::iio::ChannelSettings& ca = analog_a->output.channel;
  const hal::iio::ChannelSettings& cb = analog_b->output.channel;
  const bool same = analog_a->iio_root == analog_b->iio_root && ca.device == cb.device &&
                    ca.channel == cb.channel;
  return same ? fmt::format("{} {}", ca.device, ca.channel) : std::string();
}

struct ReadFile {
  LoopFile loop;
  Report report;
};

void check_pairs(std::vector<ReadFile>& files) {
  for (std::size_t i = 0; i < files.size(); ++i) {
    const LoopConfig& later = files[i].loop.config;
    for (std::size_t k = 0; k < i; ++k) {
      const LoopConfig& earlier = files[k].loop.config;
      if (!later.name.empty() && later.name == earlier.name) {
        files[i].report.error(files[i].loop.tag, "loop",
                              fmt::format("'{}' is the tag of another loop as well ({}:{})",
                                          later.name, earlier.file, to_text(files[k].loop.tag)));
      }
      const std::string shared = shared_output(earlier, later);
      if (shared.empty()) continue;
      files[i].report.error(files[i].loop.command, "io",
                            fmt::format("{} is written by another loop as well ({}:{})", shared,
                                        earlier.file, to_text(files[k].loop.command)));
    }
  }
}

void check_acceleration(const DaemonFile& daemon, const std::vector<ReadFile>& files,
                        Report& report) {
  if (!daemon.accelerate.valid || daemon.config.accelerate == 1.0) return;
  for (const ReadFile& file : files) {
    if (!file.loop.hardware) continue;
    report.error(daemon.accelerate.place, "accelerate",
                 fmt::format("must be 1: {} works on hardware ({}:{}) (got {})",
                             file.loop.config.name, file.loop.config.file,
                             to_text(file.loop.command), brief(daemon.config.accelerate)));
    return;
  }
}

void check_bus_loads(const DaemonFile& daemon, const std::vector<LoopConfig>& loops,
                     Report& report) {
  for (const auto& [name, link] : daemon.config.links) {
    if (link.transport != hal::modbus::Transport::rtu) continue;
    const BusLoad load = bus_load(loops, link);
    if (load.share <= kMostBusLoad) continue;
    report.error(
        daemon.link_places.at(name), "links." + name,
        fmt::format("at {} baud the line would be busy {:.0f} % of the time, at most {:.0f} % "
                    "is sound: {}. Raise baud or poll_period, or use another line",
                    link.baud, load.share * 100.0, kMostBusLoad * 100.0, load.details));
  }
}

LoopFile read_loop_source(const fs::path& path, const Drafts& drafts, const DaemonConfig& daemon,
                          Report& report, std::string& kept) {
  LoopFile loop;
  if (const std::optional<std::string> text = text_of(path, drafts, report)) {
    kept += *text;
    read_document(*text, report,
                  [&](MapReader& in) { loop = read_loop(in, path.string(), daemon); });
    loop.config.file_hash = base::crc32(*text);
  }
  return loop;
}

}  // namespace

Loaded<Configuration> read_configuration(const fs::path& directory, const Drafts& drafts) {
  Loaded<Configuration> result;
  Report daemon_report((directory / kDaemonFile).string());
  Report folder_report((directory / kLoopFolder).string());
  std::string text;
  const DaemonFile daemon = read_daemon_file(directory / kDaemonFile, drafts, daemon_report, text);
  std::vector<ReadFile> files;
  for (const fs::path& path : find_loop_files(directory / kLoopFolder, drafts, folder_report)) {
    Report report(path.string());
    LoopFile loop = read_loop_source(path, drafts, daemon.config, report, text);
    files.push_back({std::move(loop), std::move(report)});
  }
  check_pairs(files);
  check_acceleration(daemon, files, daemon_report);

  Configuration configuration{daemon.config, {}, std::move(text)};
  bool failed = folder_report.has_errors();
  std::vector<Diagnostic> from_files;
  for (ReadFile& file : files) {
    failed = failed || file.report.has_errors();
    append(from_files, file.report.take());
    configuration.loops.push_back(std::move(file.loop.config));
  }
  // The numbers are worth something only if all that they are made of is right.
  if (!failed && !daemon_report.has_errors()) {
    check_bus_loads(daemon, configuration.loops, daemon_report);
  }
  failed = failed || daemon_report.has_errors();
  std::stable_partition(configuration.loops.begin(), configuration.loops.end(),
                        [](const LoopConfig& loop) { return !is_watched(loop.io); });
  append(result.diagnostics, daemon_report.take());
  append(result.diagnostics, folder_report.take());
  append(result.diagnostics, std::move(from_files));
  if (!failed) result.value = std::move(configuration);
  return result;
}

Loaded<LoopConfig> read_loop_file(const fs::path& path) {
  const fs::path daemon_path = resolve(path.string(), "..") / kDaemonFile;
  Report daemon_report(daemon_path.string());
  std::string unused;
  const DaemonFile daemon = read_daemon_file(daemon_path, {}, daemon_report, unused);
  const bool failed = daemon_report.has_errors();
  Report report(path.string());
  LoopFile loop = read_loop_source(path, {}, daemon.config, report, unused);
  Loaded<LoopConfig> result = loaded(std::move(loop.config), report);
  if (failed) result.value.reset();
  std::vector<Diagnostic> all = daemon_report.take();
  append(all, std::move(result.diagnostics));
  result.diagnostics = std::move(all);
  return result;
}

Loaded<LoopConfig> read_loop_text(const std::string& file, std::string_view text,
                                  const DaemonConfig& daemon) {
  return load_text<LoopConfig>(file, text,
                               [&](MapReader& in) { return read_loop(in, file, daemon).config; });
}

Loaded<DaemonConfig> read_daemon_text(const std::string& file, std::string_view text) {
  return load_text<DaemonConfig>(file, text,
                                 [&](MapReader& in) { return read_daemon(in, file).config; });
}

KeyReference describe_daemon() {
  return keys_of([](MapReader& in) { read_daemon(in, ""); });
}

KeyReference describe_loop() {
  return keys_of([](MapReader& in) { read_loop(in, "", {}); });
}

KeyReference describe_watched_loop() {
  return keys_of([](MapReader& in) { read_watched_loop(in, "", {}); });
}

}  // namespace loopwarden::config
