// SPDX-License-Identifier: Apache-2.0
#include "config/config_reader.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <sstream>
#include <system_error>
#include <tuple>
#include <utility>

#include "base/device_name.hpp"
#include "base/digest/digest.hpp"
#include "base/file.hpp"
#include "config/document.hpp"
#include "config/link_address.hpp"
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

// Appends the file's text to `kept`.
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

// Returns the loop files of a configuration in the order of their names. The report lists skipped
// files.
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
      report.warning({}, "", fmt::format("{} is skipped: loop files end in .yaml", name));
    }
    if (error) break;
  }
  if (error) report.error({}, "", fmt::format("can't be read: {}", error.message()));
  std::sort(files.begin(), files.end());
  if (files.empty()) report.error({}, "", "contains no loop file (*.yaml)");
  return files;
}

// The registers that a loop writes, and their device.
struct WrittenRegisters {
  std::string device;  // line or network peer, and unit
  std::string text;    // the same as written in the file
  int first = 0;
  int last = 0;
};

WrittenRegisters written_registers(const LoopModbusSettings& modbus) {
  const hal::modbus::RegisterSpec& reg = modbus.command.reg;
  const std::string unit = fmt::format(" unit {}", modbus.command.unit);
  return {device_of(modbus.positioner_link) + unit, spelled_device(modbus.positioner_link) + unit,
          reg.address, reg.address + register_count(reg.type) - 1};
}

// Returns the folder of an IIO device, found by its name or label. If no device matches now,
// returns the name from the file.
std::string iio_device(const std::string& root, const std::string& name) {
  std::vector<std::string> found;
  std::error_code error;
  for (fs::directory_iterator entry(root, error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    for (const char* attribute : {"name", "label"}) {
      const auto text = base::read_file(entry->path() / attribute);
      if (!text || text->substr(0, text->find('\n')) != name) continue;
      found.push_back(base::device_name(entry->path().string()));
      break;
    }
  }
  return found.size() == 1 ? found.front() : base::device_name(root) + "/" + name;
}

// Returns a description of the output that both loops write; empty if their outputs differ.
std::string shared_output(const LoopConfig& a, const LoopConfig& b) {
  const auto* modbus_a = std::get_if<LoopModbusSettings>(&a.io);
  const auto* modbus_b = std::get_if<LoopModbusSettings>(&b.io);
  if (modbus_a != nullptr && modbus_b != nullptr) {
    const WrittenRegisters ra = written_registers(*modbus_a);
    const WrittenRegisters rb = written_registers(*modbus_b);
    if (ra.device != rb.device || ra.first > rb.last || rb.first > ra.last) return {};
    return fmt::format("{} register {}", rb.text, std::max(ra.first, rb.first));
  }
  const auto* analog_a = std::get_if<hal::iio::AnalogSettings>(&a.io);
  const auto* analog_b = std::get_if<hal::iio::AnalogSettings>(&b.io);
  if (analog_a == nullptr || analog_b == nullptr) return {};
  const hal::iio::ChannelSettings& ca = analog_a->output.channel;
  const hal::iio::ChannelSettings& cb = analog_b->output.channel;
  const bool same = ca.channel == cb.channel && iio_device(analog_a->iio_root, ca.device) ==
                                                    iio_device(analog_b->iio_root, cb.device);
  return same ? fmt::format("{} {}", cb.device, cb.channel) : std::string();
}

struct ReadFile {
  LoopFile loop;
  Report report;
  std::string top;  // beginning of its text, if it is no YAML
  std::string why;  // reason outside this file why the loop does not run
};

// Takes both of two loops out of service if they claim the same resource, because the correct one
// is unknown.
void refuse_pair(ReadFile& earlier, ReadFile& later, Place earlier_place, Place later_place,
                 const char* key, const std::string& what) {
  later.report.error(later_place, key,
                     fmt::format("{} another loop as well ({}:{})", what, earlier.loop.config.file,
                                 to_text(earlier_place)));
  earlier.why =
      fmt::format("{}:{}: {}: {} another loop as well ({}:{})", earlier.loop.config.file,
                  to_text(earlier_place), key, what, later.loop.config.file, to_text(later_place));
}

// Returns whether the stop action of two loops with the same output is the same in both files.
bool same_stop_action(const LoopConfig& a, const LoopConfig& b) {
  const control::OutputAction& stop_a = a.safety.on_stop;
  const control::OutputAction& stop_b = b.safety.on_stop;
  if (stop_a.kind != stop_b.kind || stop_a.value != stop_b.value) return false;
  const auto* modbus_a = std::get_if<LoopModbusSettings>(&a.io);
  const auto* modbus_b = std::get_if<LoopModbusSettings>(&b.io);
  if (modbus_a != nullptr && modbus_b != nullptr) {
    return modbus_a->command == modbus_b->command && modbus_a->output == modbus_b->output;
  }
  const auto* analog_a = std::get_if<hal::iio::AnalogSettings>(&a.io);
  const auto* analog_b = std::get_if<hal::iio::AnalogSettings>(&b.io);
  return analog_a != nullptr && analog_b != nullptr && analog_a->output == analog_b->output;
}

void check_pairs(std::vector<ReadFile>& files) {
  for (std::size_t i = 0; i < files.size(); ++i) {
    const LoopConfig& later = files[i].loop.config;
    for (std::size_t k = 0; k < i; ++k) {
      const LoopConfig& earlier = files[k].loop.config;
      if (!later.name.empty() && later.name == earlier.name) {
        refuse_pair(files[k], files[i], files[k].loop.tag, files[i].loop.tag, "loop",
                    fmt::format("'{}' is the tag of", later.name));
      }
      const std::string shared = shared_output(earlier, later);
      if (shared.empty()) continue;
      refuse_pair(files[k], files[i], files[k].loop.command, files[i].loop.command, "io",
                  fmt::format("{} is written by", shared));
      if (same_stop_action(earlier, later)) continue;
      files[k].loop.output_known = files[i].loop.output_known = false;
    }
  }
}

// Refuses a master that is no loop of the folder, and slaves that are their own masters through
// others.
void check_cascades(std::vector<ReadFile>& files) {
  std::map<std::string, std::string> master_of;
  std::vector<std::string> tags;
  for (const ReadFile& file : files) {
    tags.push_back(file.loop.config.name);
    master_of[file.loop.config.name] = file.loop.config.master;
  }
  for (ReadFile& file : files) {
    const std::string& name = file.loop.config.name;
    const std::string& master = file.loop.config.master;
    if (master.empty() || master == name) continue;
    const auto refuse = [&](const std::string& why) {
      file.report.error(file.loop.master, "cascade.master", why);
    };
    if (master_of.count(master) == 0) {
      refuse(fmt::format("no loop file has the tag '{}'{}", quotable(master),
                         suggestion(master, tags)));
      continue;
    }
    std::string chain = name;
    std::string at = master;
    for (std::size_t steps = 0; !at.empty() && at != name && steps < files.size(); ++steps) {
      chain += " < " + at;
      const auto next = master_of.find(at);
      at = next == master_of.end() ? std::string() : next->second;
    }
    if (at == name) refuse(fmt::format("the cascade is a circle: {} < {}", chain, name));
  }
}

bool same_settings(LinkSettings a, const LinkSettings& b) {
  a.name = b.name;
  a.host = b.host;
  a.device = b.device;
  return a == b;
}

// Returns whether two TCP links conflict. Each unit has its own connection unless a link limits
// them, so only settings for the same unit must agree. Two links on one serial line are refused
// elsewhere, at their definition.
bool collide(const LinkSettings& a, std::uint8_t unit_a, const LinkSettings& b,
             std::uint8_t unit_b) {
  using hal::modbus::Transport;
  if (a.transport != Transport::tcp || b.transport != Transport::tcp) return false;
  const bool limited = a.connections.has_value() || b.connections.has_value();
  return device_of(a) == device_of(b) && !same_settings(a, b) && (limited || unit_a == unit_b);
}

// Refuses the second of two links to one device with different settings.
void check_links(const DaemonFile& daemon, std::vector<ReadFile>& files) {
  struct Known {
    const ReadFile* file;
    const LinkUse* use;
  };
  std::vector<Known> all;
  const auto find = [&](const LinkSettings& link, const LinkUse& use) -> const Known* {
    const auto found = std::find_if(all.begin(), all.end(), [&](const Known& known) {
      return collide(link, use.unit, daemon.config.links.at(known.use->link), known.use->unit);
    });
    return found == all.end() ? nullptr : &*found;
  };
  const auto place_of = [&](const std::string& link) {
    return fmt::format("{}:{}", daemon.config.file, to_text(daemon.links.at(link).place));
  };
  for (const bool watched : {false, true}) {
    for (ReadFile& file : files) {
      if (file.loop.watched != watched) continue;
      std::string refused;
      for (const LinkUse& use : file.loop.link_uses) {
        const LinkSettings& link = daemon.config.links.at(use.link);
        const Known* known = find(link, use);
        if (known == nullptr) {
          all.push_back({&file, &use});
        } else if (refused != use.link) {
          refused = use.link;
          file.report.error(
              use.place, use.key,
              fmt::format("'{}' ({}) leads to {} unit {} with other settings than link '{}' ({}), "
                          "which another loop uses ({}:{}). Use one link for both",
                          quotable(use.link), place_of(use.link), spelled_device(link), use.unit,
                          quotable(known->use->link), place_of(known->use->link),
                          known->file->loop.config.file, to_text(known->use->place)));
        }
      }
    }
  }
}

void check_acceleration(const DaemonFile& daemon, const std::vector<ReadFile>& files,
                        Report& report) {
  constexpr double kShortest_s = 1e-5;  // on the wall clock; a thread can't keep a shorter period
  const double times = daemon.config.accelerate;
  if (!daemon.accelerate.valid || times == 1.0) return;
  for (const ReadFile& file : files) {
    const std::string where =
        fmt::format("({}:{})", file.loop.config.file, to_text(file.loop.command));
    if (file.loop.hardware) {
      report.error(daemon.accelerate.place, "accelerate",
                   fmt::format("must be 1: {} works on hardware {} (got {})", file.loop.config.name,
                               where, brief(times)));
      return;
    }
    if (file.loop.config.sample_time_s / times < kShortest_s) {
      report.error(daemon.accelerate.place, "accelerate",
                   fmt::format("must be at most {:g}: {} has a sample_time of {} s {} (got {})",
                               file.loop.config.sample_time_s / kShortest_s, file.loop.config.name,
                               brief(file.loop.config.sample_time_s), where, brief(times)));
      return;
    }
  }
}

// `loops`: the loops that can run.
void check_bus_loads(DaemonFile& daemon, const std::vector<LoopConfig>& loops, Report& report) {
  for (const auto& [name, link] : daemon.config.links) {
    LinkState& state = daemon.links.at(name);
    if (link.transport != hal::modbus::Transport::rtu || !state.sound) continue;
    const BusLoad load = bus_load(loops, link);
    if (load.share <= kMostBusLoad) continue;
    state.sound = false;
    ++daemon.link_errors;
    report.error(
        state.place, "links." + name,
        fmt::format("at {} baud the line would be busy {:.0f} % of the time, at most {:.0f} % "
                    "is sound: {}. Raise baud or poll_period, or use another line",
                    link.baud, load.share * 100.0, kMostBusLoad * 100.0, load.details));
  }
}

ReadFile read_loop_source(const fs::path& path, const Drafts& drafts, const DaemonConfig& daemon,
                          std::string& kept) {
  ReadFile file{.loop = {}, .report = Report(path.string()), .top = {}, .why = {}};
  if (const std::optional<std::string> text = text_of(path, drafts, file.report)) {
    kept += *text;
    file.top = *text;
    read_document(*text, file.report,
                  [&](MapReader& in) { file.loop = read_loop(in, path.string(), daemon); });
    file.loop.config.file_hash = base::crc32(*text);
    struct stat about {};
    if (::stat(path.c_str(), &about) == 0) file.loop.config.file_time_s = about.st_mtime;
  }
  file.loop.config.file = path.string();
  return file;
}

// Returns the word after `key` at the beginning of a line; empty if absent. For a text that
// is no valid YAML.
std::string word_behind(const std::string& text, std::string_view key) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with(key)) continue;
    const std::size_t first = line.find_first_not_of(" \t\"'", key.size());
    if (first == std::string::npos) return {};
    return line.substr(first, line.find_first_of(" \t\"'#\r", first) - first);
  }
  return {};
}

// Returns a tag that no other loop has: the file's tag if free, otherwise one made from the file's
// name.
std::string tag_of(const ReadFile& file, std::set<std::string>& taken) {
  std::string tag = file.loop.config.name;
  if (tag.empty()) tag = word_behind(file.top, "loop:");
  if (!is_usable_tag(tag) || taken.contains(tag)) {
    tag = fs::path(file.loop.config.file).stem().string().substr(0, 24);
    std::replace_if(
        tag.begin(), tag.end(),
        [](char c) {
          return !is_usable_tag(std::string{'x', c});
        },
        '_');
    if (!is_usable_tag(tag)) tag.insert(0, "x");
  }
  const std::string first = tag;
  for (int i = 2; taken.contains(tag); ++i) tag = fmt::format("{}-{}", first, i);
  taken.insert(tag);
  return tag;
}

bool is_watched(const ReadFile& file) {
  return file.loop.watched || word_behind(file.top, "control:") == "elsewhere";
}

// Returns why a loop does not run; empty if it runs.
std::string why_not_run(const ReadFile& file, const DaemonFile& daemon) {
  if (file.report.has_errors()) return to_text(file.report.first_error());
  if (!file.why.empty()) return file.why;
  for (const LinkUse& use : file.loop.link_uses) {
    const LinkState& link = daemon.links.at(use.link);
    if (link.sound) continue;
    return fmt::format("{}:{}: {}: link '{}' has errors ({}:{})", file.loop.config.file,
                       to_text(use.place), use.key, use.link, daemon.config.file,
                       to_text(link.place));
  }
  return {};
}

// Returns the replacement for a loop that does not run. It takes the identifying keys from the
// file; all other settings are defaults without an effect on a device.
LoopConfig placeholder(const ReadFile& file, std::string tag, std::string why) {
  const LoopConfig& read = file.loop.config;
  LoopConfig loop;
  loop.file = read.file;
  loop.name = std::move(tag);
  loop.description = read.description;
  loop.area = read.area;
  loop.master = read.master;
  loop.pv_unit = read.pv_unit;
  loop.co_unit = read.co_unit;
  loop.sample_time_s = std::max(read.sample_time_s, 0.1);
  if (read.pv.low < read.pv.high)
    std::tie(loop.pv.low, loop.pv.high) = std::tie(read.pv.low, read.pv.high);
  std::tie(loop.controller.set_point.low, loop.controller.set_point.high) =
      std::tie(loop.pv.low, loop.pv.high);
  loop.start.set_point = loop.pv.low;
  const control::PidSettings& pid = read.controller.pid;
  if (pid.output_low < pid.output_high) {
    loop.controller.pid.output_low = loop.controller.output.low = pid.output_low;
    loop.controller.pid.output_high = loop.controller.output.high = pid.output_high;
  }
  loop.recording.enabled = false;
  loop.monitor.routine = false;
  using alarm::AlarmKind;
  for (const AlarmKind kind : alarm::kProcessAlarms) {
    loop.alarms.process.at(kind).fitted = kind == AlarmKind::bad_pv;
  }
  loop.alarms.texts[alarm::index_of(AlarmKind::bad_pv)] = {
      .cause = "The loop is out of service, because its files have errors: " + why,
      .consequence = "Loopwarden neither controls nor watches this loop.",
      .action =
          "Correct the files until `loopwarden check` finds no error, then restart loopwardend.",
      .time_to_act = {}};
  loop.io = OutOfService{.why = std::move(why), .watched = is_watched(file)};
  return loop;
}

// Returns the loop with its output only, for a loop with errors in other keys: its PV source may be
// wrong.
LoopConfig output_alone(LoopConfig loop) {
  if (auto* modbus = std::get_if<LoopModbusSettings>(&loop.io)) {
    modbus->transmitter_link = modbus->positioner_link;
    modbus->process_variable = modbus->command;
    modbus->read_back.reset();
    modbus->comm_loss = {};
  } else if (auto* analog = std::get_if<hal::iio::AnalogSettings>(&loop.io)) {
    analog->process_variable = {};
    analog->read_back.reset();
    analog->enable.reset();
    analog->alarm_relay.reset();
    analog->alive.reset();
  }
  return loop;
}

StopOutput stop_output_of(const ReadFile& file, const LoopConfig& in_configuration,
                          const DaemonFile& daemon) {
  const std::string* why = out_of_service(in_configuration.io);
  if (why == nullptr) return {.loop = in_configuration, .why_not = {}};
  StopOutput output{.loop = output_alone(file.loop.config), .why_not = {}};
  output.loop.name = in_configuration.name;
  const auto* modbus = std::get_if<LoopModbusSettings>(&output.loop.io);
  const auto link =
      modbus == nullptr ? daemon.links.end() : daemon.links.find(modbus->positioner_link.name);
  const bool addressed = link == daemon.links.end() || link->second.addressed;
  if (!file.loop.output_known || !addressed) output.why_not = *why;
  return output;
}

}  // namespace

FolderReading read_folder(const fs::path& directory, const Drafts& drafts, const LoopCheck& check) {
  FolderReading result;
  Report daemon_report((directory / kDaemonFile).string());
  Report folder_report((directory / kLoopFolder).string());
  std::string text;
  DaemonFile daemon = read_daemon_file(directory / kDaemonFile, drafts, daemon_report, text);
  std::vector<ReadFile> files;
  for (const fs::path& path : find_loop_files(directory / kLoopFolder, drafts, folder_report)) {
    files.push_back(read_loop_source(path, drafts, daemon.config, text));
  }
  check_pairs(files);
  check_cascades(files);
  check_links(daemon, files);
  check_acceleration(daemon, files, daemon_report);
  std::vector<Diagnostic> of_named_files;
  for (ReadFile& file : files) {
    if (check && !file.report.has_errors()) check(file.loop, file.report, of_named_files);
  }
  std::vector<LoopConfig> sound;
  for (const ReadFile& file : files) {
    if (why_not_run(file, daemon).empty()) sound.push_back(file.loop.config);
  }
  check_bus_loads(daemon, sound, daemon_report);

  std::stable_partition(files.begin(), files.end(),
                        [](const ReadFile& file) { return !is_watched(file); });
  std::set<std::string> tags;
  for (const ReadFile& file : files) {
    if (why_not_run(file, daemon).empty()) tags.insert(file.loop.config.name);
  }
  result.configuration = {daemon.config, {}, std::move(text)};
  bool any_runs = false;
  for (const ReadFile& file : files) {
    std::string why = why_not_run(file, daemon);
    any_runs = any_runs || why.empty();
    result.configuration.loops.push_back(
        why.empty() ? file.loop.config : placeholder(file, tag_of(file, tags), std::move(why)));
    const LoopConfig& loop = result.configuration.loops.back();
    if (is_watched(loop.io)) continue;
    result.outputs.push_back(stop_output_of(file, loop, daemon));
  }
  result.runnable =
      any_runs && !folder_report.has_errors() && daemon_report.error_count() == daemon.link_errors;
  std::stable_sort(files.begin(), files.end(), [](const ReadFile& a, const ReadFile& b) {
    return fs::path(a.loop.config.file) < fs::path(b.loop.config.file);
  });
  append(result.diagnostics, daemon_report.take());
  append(result.diagnostics, folder_report.take());
  append(result.diagnostics, std::move(of_named_files));
  for (ReadFile& file : files) append(result.diagnostics, file.report.take());
  result.sound = !has_errors(result.diagnostics);
  return result;
}

Loaded<Configuration> loaded(FolderReading reading) {
  Loaded<Configuration> result{std::nullopt, std::move(reading.diagnostics)};
  if (reading.sound) result.value = std::move(reading.configuration);
  return result;
}

Loaded<Configuration> read_configuration(const fs::path& directory, const Drafts& drafts) {
  return loaded(read_folder(directory, drafts));
}

Loaded<LoopConfig> read_loop_file(const fs::path& path, const LoopCheck& check) {
  const fs::path daemon_path = resolve(path.string(), "..") / kDaemonFile;
  Report daemon_report(daemon_path.string());
  std::string unused;
  const DaemonFile daemon = read_daemon_file(daemon_path, {}, daemon_report, unused);
  const bool failed = daemon_report.has_errors();
  ReadFile file = read_loop_source(path, {}, daemon.config, unused);
  std::vector<ReadFile> alone;
  alone.push_back(std::move(file));
  check_links(daemon, alone);
  ReadFile& read = alone.front();
  std::vector<Diagnostic> all = daemon_report.take();
  if (check && !failed && !read.report.has_errors()) check(read.loop, read.report, all);
  Loaded<LoopConfig> result = loaded(std::move(read.loop.config), read.report);
  if (failed) result.value.reset();
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
