// SPDX-License-Identifier: Apache-2.0
#include "workbench/discover/loop_file.hpp"

#include <fmt/format.h>

#include <array>

#include <nlohmann/json.hpp>

#include "config/config_reader.hpp"
#include "hal/contract/pv_check_settings.hpp"

namespace loopwarden::workbench::discover {
namespace {

using record::Role;

constexpr double kUsualSampleTime_s = 1.0;

// JSON's double quotes are valid in YAML.
std::string yaml_text(const std::string& text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

// Returns a text for a comment, without line breaks.
std::string one_line(std::string text) {
  for (char& c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7F) c = '?';
  }
  return text;
}

std::string list(const std::vector<double>& numbers) {
  return fmt::format("[{}]", fmt::join(numbers, ", "));
}

// Returns values of a mode; words are in quotes, because YAML reads some as other things.
std::string list(const std::vector<std::string>& values) {
  std::string text;
  for (const std::string& value : values) {
    const bool number = value.find_first_not_of("+-.0123456789") == std::string::npos;
    text += (text.empty() ? "" : ", ") + (number ? value : yaml_text(value));
  }
  return "[" + text + "]";
}

class Writer {
 public:
  explicit Writer(LoopFile& file) : file_(file) {}

  void line(const std::string& text) { body_ += text + "\n"; }
  // `path`: name of the key in the result.
  void key(const std::string& path, const std::string& text, const std::string& guess) {
    line(guess.empty() ? text : text + "  # guessed: " + one_line(guess));
    if (guess.empty()) {
      file_.sure.push_back(path);
    } else {
      file_.guessed.emplace_back(path, guess);
    }
  }
  void unit(const std::string& section, const char* signal, const Found<std::string>& unit) {
    if (unit.value.empty()) return missing(section + ".unit", std::string("unit of ") + signal);
    key(section + ".unit", "  unit: " + yaml_text(unit.value), unit.guess);
  }
  void range(const std::string& section, const char* signal,
             const Found<std::optional<record::SignalRange>>& range) {
    if (!range.value)
      return missing(section + ".range", std::string("[lower, upper end] of ") + signal);
    key(section + ".range",
        fmt::format("  range: {}", list({range.value->first, range.value->second})), range.guess);
  }
  void missing(const std::string& path, const std::string& what) {
    file_.missing.push_back(path + ": " + what);
  }
  const std::string& body() const noexcept { return body_; }

 private:
  LoopFile& file_;
  std::string body_;
};

void write_signals(Writer& out, const FoundLoop& loop, const std::string& feeder) {
  out.line("io:");
  out.line("  backend: feed");
  for (const Role role : {Role::pv, Role::co, Role::sp, Role::stem, Role::mode}) {
    const std::optional<LoopSignal>& signal = loop.signal(role);
    if (!signal) continue;
    const std::string name = record::to_text(role);
    std::string text = "feed: " + yaml_text(feeder + ":" + signal->name);
    if (role != Role::mode) {
      out.key(name, fmt::format("  {}: {{{}}}", name, text), signal->guess);
      continue;
    }
    out.line("  mode:");
    out.key(name, "    " + text, signal->guess);
    out.key("mode.automatic", "    automatic: " + list(loop.automatic.value), loop.automatic.guess);
    if (!loop.manual.value.empty())
      out.key("mode.manual", "    manual: " + list(loop.manual.value), loop.manual.guess);
  }
}

// Returns the errors that `loopwarden check` finds in the text.
std::vector<std::string> refusals(const std::string& text, const std::string& feeder) {
  config::DaemonConfig daemon;
  daemon.feeders.emplace(feeder, config::FeederUser{});
  std::vector<std::string> found;
  for (const config::Diagnostic& what : config::read_loop_text("", text, daemon).diagnostics) {
    if (what.level == config::Diagnostic::Level::error)
      found.push_back(what.key + ": " + what.message);
  }
  return found;
}

// Returns the rule for a node GROUP/EDGE/DEVICE/METRIC. The device may be empty, and the metric may
// contain "/".
std::string metric_rule(const LoopSignal& signal) {
  std::array<std::string, 3> places;
  std::string rest = signal.node;
  for (std::string& place : places) {
    const std::size_t end = rest.find('/');
    if (end == std::string::npos) return {};
    place = rest.substr(0, end);
    rest.erase(0, end + 1);
  }
  return fmt::format("  - {{name: {}, group: {}, edge: {}, device: {}, metric: {}}}\n",
                     yaml_text(signal.name), yaml_text(places[0]), yaml_text(places[1]),
                     yaml_text(places[2]), yaml_text(rest));
}

}  // namespace

LoopFile loop_file(const FoundLoop& loop, const LoopFileSettings& settings) {
  LoopFile file;
  Writer out(file);
  out.key("loop", "loop: " + yaml_text(loop.tag.value), loop.tag.guess);
  if (!loop.description.empty()) out.line("description: " + yaml_text(loop.description));
  out.line("control: elsewhere  # nothing of this loop is ever written");
  out.key("sample_time",
          fmt::format("sample_time: {}", settings.sample_time_s.value_or(kUsualSampleTime_s)),
          settings.sample_time_s ? "" : "in s; a fifth of the time constant or shorter");
  out.line("process_variable:");
  out.unit("process_variable", "PV", loop.pv_unit);
  out.range("process_variable", "PV", loop.pv_range);
  const double sample_time_s = settings.sample_time_s.value_or(kUsualSampleTime_s);
  out.line(fmt::format("  frozen_after: {}  # s, after CO has moved by 10 %",
                       hal::usual_frozen_after_s(sample_time_s)));
  out.line("output:");
  out.unit("output", "CO", loop.co_unit);
  out.range("output", "CO", loop.co_range);
  write_signals(out, loop, settings.feeder);
  if (file.is_complete()) file.missing = refusals(out.body(), settings.feeder);
  std::string head =
      fmt::format("# Found by loopwarden discover in {}.\n", one_line(settings.source));
  if (!file.is_complete()) {
    head += fmt::format("# Missing, before this can be {}.yaml:\n", loop.tag.value);
    for (const std::string& what : file.missing) head += "#   " + one_line(what) + "\n";
  }
  file.text = head + out.body();
  return file;
}

std::string node_list(const std::vector<FoundLoop>& loops, NodeForm form) {
  std::string text;
  for (const FoundLoop& loop : loops) {
    for (const std::optional<LoopSignal>& signal : loop.signals) {
      if (!signal || signal->node.empty()) continue;
      text += form == NodeForm::opcua
                  ? fmt::format("  {}: {}\n", yaml_text(signal->name), yaml_text(signal->node))
                  : metric_rule(*signal);
    }
  }
  if (text.empty()) return text;
  return (form == NodeForm::opcua ? "nodes:\n" : "metrics:\n") + text;
}

}  // namespace loopwarden::workbench::discover
