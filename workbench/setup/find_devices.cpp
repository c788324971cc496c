// SPDX-License-Identifier: Apache-2.0
// Finds devices and registers. Only the entered addresses are read, and devices are never written
// to.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "workbench/files/command_error.hpp"
#include "workbench/live/test_bench.hpp"
#include "workbench/setup/questions.hpp"
#include "workbench/setup/setup.hpp"

namespace loopwarden::workbench::setup {
namespace {

constexpr std::size_t kMostHosts = 16;

std::vector<std::string> hosts_in(const std::string& text) {
  std::vector<std::string> hosts;
  for (std::size_t at = 0; (at = text.find_first_not_of(" ,\t", at)) != std::string::npos;) {
    const std::size_t end = std::min(text.find_first_of(" ,\t", at), text.size());
    hosts.push_back(text.substr(at, end - at));
    at = end;
  }
  return hosts;
}

std::string in_words(const protocol::Probed& answer) {
  if (answer.state != "read") return answer.why;
  std::string words;
  for (const std::uint16_t word : answer.registers) words += fmt::format(" {:04X}", word);
  return fmt::format("raw{} = {:.7g}", words, answer.raw);
}

// Prints the units that answer. A device that answers with an error counts.
void scan(Setup& setup, protocol::Probe probe, const std::string& where,
          const std::vector<unsigned>& units) {
  for (const unsigned unit : units) {
    probe.unit = unit;
    std::string line;
    for (const char* table : {"input", "holding"}) {
      probe.table = table;
      const protocol::Probed answer = setup.prober.read(probe);
      if (answer.state == "refused") {
        setup.dialogue.say(fmt::format("  {}: no scan: {}", where, answer.why));
        return;
      }
      if (answer.state == "silent") {
        line = answer.why;
        break;  // a unit that does not answer is tried only once
      }
      line += fmt::format("{}{} register 0: {}", line.empty() ? "" : ", ", table, in_words(answer));
    }
    setup.dialogue.say(fmt::format("  {} unit {}: {}", where, unit, line));
  }
}

// Returns why a value is implausible for the range; empty: plausible. A tenth of the span beyond
// the ends is allowed.
std::string outside(double value, std::pair<double, double> range, const std::string& unit) {
  const double more = 0.1 * (range.second - range.first);
  if (value >= range.first - more && value <= range.second + more) return {};
  return fmt::format("{:.5g} {} is outside of the range {:g} to {:g}", value, unit, range.first,
                     range.second);
}

// Returns whether a floating-point number is too extreme for a measurement. Then the register, its
// type or its byte order is wrong.
bool is_no_measurement(double raw) {
  constexpr double kLeast = 1e-20;
  constexpr double kMost = 1e20;
  return !std::isfinite(raw) || std::abs(raw) > kMost || (raw != 0.0 && std::abs(raw) < kLeast);
}

// The median of the readings of a second, and their spread.
struct Sampled {
  double raw = 0.0;
  double noise = 0.0;
};

// Returns nullopt if the register can't be read.
std::optional<Sampled> sample(Setup& setup, const protocol::Probe& probe) {
  constexpr std::size_t kReadings = 11;
  constexpr double kBetween_s = 0.1;
  std::vector<double> raw;
  while (raw.size() < kReadings) {
    if (!raw.empty()) setup.wait(kBetween_s);
    const protocol::Probed now = setup.prober.read(probe);
    if (now.state != "read" || !std::isfinite(now.raw)) return std::nullopt;
    raw.push_back(now.raw);
  }
  std::sort(raw.begin(), raw.end());
  const double resolution = probe.type.starts_with('f') ? 0.0 : 1.0;
  return Sampled{raw[kReadings / 2], std::max(raw.back() - raw.front(), resolution)};
}

double scaled(double raw, const std::string& scale) {
  const auto four = numbers_in(scale, 4);
  if (!four) return raw;
  const auto& v = *four;
  return v[2] + (raw - v[0]) / (v[1] - v[0]) * (v[3] - v[2]);
}

// Derives the scaling from the values that a person reads off the device's display. Returns four
// numbers, or "none".
std::string scale_by_display(Setup& setup, const protocol::Probe& probe, const std::string& id,
                             const std::string& unit, std::pair<double, double> range) {
  Dialogue& dialogue = setup.dialogue;
  struct Said {
    Sampled at;
    double value = 0.0;
  };
  // Two raw values differ clearly if they differ by more than this multiple of their noise. The
  // error of the slope is then some per cent.
  constexpr double kClear = 5.0;
  std::vector<Said> said;
  for (;;) {
    const protocol::Probed before = setup.prober.read(probe);
    dialogue.say("  " + in_words(before));
    if (before.state != "read" || !std::isfinite(before.raw)) {
      return dialogue.ask_now("  Four numbers as above, or none", [](const std::string& answer) {
        return answer == "live" ? "it can't be read now" : question("pv.scale").wrong(answer);
      });
    }
    const std::string text = dialogue.ask_now(
        said.empty()
            ? fmt::format(
                  "  Present value on the device's display ({} or %); r: read again; Enter: the "
                  "register holds it as it is",
                  unit)
            : fmt::format("  Let it change, then say it once more; r: read again; Enter: raw 0 is "
                          "0 {}",
                          unit),
        [&](const std::string& answer) -> std::string {
          if (answer.empty() || answer == "r" || answer == kBack) return {};
          const auto value = said_value(answer, range, unit);
          if (!value) return fmt::format("a number, such as 10.5, 10.5 {} or 43 %", unit);
          return outside(*value, range, unit);
        });
    if (text == kBack) dialogue.back();
    if (text == "r" || text == kBack) continue;
    if (text.empty() && said.empty()) return "none";
    if (text.empty()) {
      said.push_back({});
    } else {
      const std::optional<Sampled> now = sample(setup, probe);
      if (!now) continue;
      said.push_back({*now, said_value(text, range, unit).value()});
    }
    if (said.size() < 2) continue;
    const double change = std::abs(said[1].at.raw - said[0].at.raw);
    const double noise = std::max(said[0].at.noise, said[1].at.noise);
    if (change <= kClear * noise || said[0].value == said[1].value) {
      dialogue.say(
          fmt::format("  The two points are too close: raw {:.5g} = {:.5g} {} and raw {:.5g} = "
                      "{:.5g} {}. The values must differ, and the raw values by more than {:.3g} "
                      "({:g} times the noise of a second). Let the value change more, or enter "
                      "`back` to change the register.",
                      said[0].at.raw, said[0].value, unit, said[1].at.raw, said[1].value, unit,
                      kClear * noise, kClear));
      // Keeps the newer point. Zero was not read.
      said.erase(text.empty() ? said.begin() + 1 : said.begin());
      continue;
    }
    std::sort(said.begin(), said.end(),
              [](const Said& a, const Said& b) { return a.at.raw < b.at.raw; });
    std::string scale =
        fmt::format("{} {} {} {}", said[0].at.raw, said[1].at.raw, said[0].value, said[1].value);
    std::string why = dialogue.why_refused(id, scale);
    if (why.empty()) {
      dialogue.say("  The scale is checked for a few seconds.");
      constexpr double kLater_s = 3.0;
      setup.wait(kLater_s);
      const std::optional<Sampled> later = sample(setup, probe);
      if (later) why = outside(scaled(later->raw, scale), range, unit);
      if (why.empty()) return scale;
      why += ". Enter both points again, or enter `back` to change the register.";
    }
    dialogue.say("  " + why);
    said.clear();
  }
}

struct Point {
  const char* name;
  const char* what;
  bool in_pv_units;
};

// The answers for a point.
struct SaidPoint {
  std::string where, scale;
  friend bool operator==(const SaidPoint&, const SaidPoint&) = default;
};

// Returns whether the device was asked and gave no value.
bool has_no_answer(const protocol::Probed& answer) {
  return answer.state == "error" || answer.state == "silent";
}

// Asks for a point and reads it. Returns why it has no value, or why its value can't be right.
// Returns an empty text if it can be, if the line is in use by others, or if the person confirms
// the answers `before`. `said` receives the answers.
std::string look_at(Setup& setup, const protocol::Probe& link, const Point& point,
                    const SaidPoint& before, SaidPoint& said) {
  Dialogue& dialogue = setup.dialogue;
  const std::string name = point.name;
  said.where = dialogue.ask(name + ".register", point.what);
  const std::optional<RegisterPlace> place = register_in(said.where);
  if (!place || name == "mode") return {};
  const std::string unit = dialogue.ask(point.in_pv_units ? "pv.unit" : "co.unit");
  const auto range = dialogue.range(point.in_pv_units ? "pv.range" : "co.range");
  protocol::Probe probe = link;
  probe.unit = place->unit;
  probe.table = place->table;
  probe.address = place->address;
  probe.type = place->type;
  probe.order = place->order;
  const std::string scale_id = name + ".scale";
  const bool is_float = place->type == "f32" || place->type == "f64";
  if (!dialogue.knows(scale_id) && said.where != before.where) {
    const protocol::Probed first = setup.prober.read(probe);
    if (has_no_answer(first)) return in_words(first);
    if (is_float && first.state == "read" && is_no_measurement(first.raw)) {
      return in_words(first) + " is no measured value";
    }
  }
  std::string scale = dialogue.ask(scale_id);
  if (scale == "live") {
    scale = scale_by_display(setup, probe, scale_id, unit, range);
    setup.state().answer(scale_id, scale);
  }
  said.scale = scale;
  const bool insists = said == before || (said.where == before.where && before.scale.empty());
  const protocol::Probed now = setup.prober.read(probe);
  if (has_no_answer(now) && !insists) return in_words(now);
  if (now.state != "read") {
    dialogue.say("  " + in_words(now));
    return {};
  }
  const double value = scaled(now.raw, scale);
  dialogue.say(fmt::format("  {} = {:.5g} {}", in_words(now), value, unit));
  if (insists) return {};
  // The halves of two numbers, read as one, are often close to 0.
  constexpr double kLeastShare = 1e-6;
  const bool tiny = value != 0.0 && std::abs(value) < kLeastShare * (range.second - range.first);
  if (is_float && (tiny || is_no_measurement(now.raw))) {
    return in_words(now) + " is no measured value";
  }
  return outside(value, range, unit);
}

void find_point(Setup& setup, const protocol::Probe& link, const Point& point) {
  Dialogue& dialogue = setup.dialogue;
  SaidPoint before;
  for (;;) {
    SaidPoint said;
    const std::string why = look_at(setup, link, point, before, said);
    if (why.empty()) return;
    dialogue.say(fmt::format(
        "  {}: unit, register, type, order of the bytes or scaling are wrong. Repeat the answers "
        "to keep them.",
        why));
    before = std::move(said);
    dialogue.forget(std::string(point.name) + ".register");
    dialogue.forget(std::string(point.name) + ".scale");
  }
}

protocol::Probe ask_link(Setup& setup) {
  Dialogue& dialogue = setup.dialogue;
  protocol::Probe probe{.transport = dialogue.ask("link.transport")};
  std::vector<std::string> hosts;
  if (probe.transport == "tcp") {
    hosts = hosts_in(dialogue.ask("link.hosts"));
    if (hosts.size() > kMostHosts) {
      throw CommandError(kExitData, fmt::format("link.hosts: at most {} addresses", kMostHosts));
    }
    probe.port = static_cast<std::uint64_t>(dialogue.number("link.port"));
  } else {
    probe.device = dialogue.ask("link.device");
    probe.baud = static_cast<std::uint64_t>(dialogue.number("link.baud"));
    probe.parity = dialogue.ask("link.parity");
    probe.stop_bits = static_cast<std::uint64_t>(dialogue.number("link.stop_bits"));
    hosts = {""};
  }
  if (const auto units = units_in(dialogue.ask("scan.units"))) {
    for (const std::string& host : hosts) {
      probe.host = host;
      scan(setup, probe, host.empty() ? probe.device : host, *units);
    }
  }
  if (probe.transport == "tcp") {
    if (hosts.size() == 1) setup.state().answer("link.host", hosts.front());
    probe.host = dialogue.ask("link.host");
  }
  return probe;
}

void ask_comm_loss(Setup& setup) {
  Dialogue& dialogue = setup.dialogue;
  const std::string loss = dialogue.ask("comm_loss");
  if (loss == "none") return;
  dialogue.ask("comm_loss.timeout");
  if (loss != "register") return;
  dialogue.ask("comm_loss.register");
  dialogue.ask("comm_loss.scale");
}

// The loops of an OPC UA server are found by their tags. Their files are complete then.
Outcome find_by_opcua(Setup& setup) {
  if (std::filesystem::exists(setup.loop_file())) return Outcome::done;
  const std::string url = setup.dialogue.ask("opcua.url");
  const std::filesystem::path nodes = setup.folder / "setup" / (setup.tag + "-nodes.yaml");
  std::filesystem::create_directories(nodes.parent_path());
  std::filesystem::remove(nodes);
  const int code = setup.run({"discover", "--opcua", url, "--out",
                              (setup.folder / "loops.d").string(), "--nodes", nodes.string()},
                             {});
  if (code != 0) throw TestAborted(fmt::format("discover ended with exit code {}", code));
  if (!std::filesystem::exists(setup.loop_file())) {
    throw TestAborted(setup.loop_file().string() +
                      " is not among the files: a file TAG.yaml.incomplete lists its missing keys, "
                      "and a loop of another tag is set up by that");
  }
  setup.dialogue.say(
      fmt::format("  {} lists the feeder's requests: add it to opcua.yaml", nodes.string()));
  return Outcome::done;
}

}  // namespace

Outcome find_devices(Setup& setup) {
  Dialogue& dialogue = setup.dialogue;
  const bool elsewhere = setup.elsewhere();
  if (elsewhere && dialogue.ask("source") == "opcua") return find_by_opcua(setup);
  const protocol::Probe link = ask_link(setup);
  find_point(setup, link, {"pv", "The register of PV", true});
  if (elsewhere) {
    find_point(setup, link, {"co", "The register of CO", false});
    find_point(setup, link, {"sp", "The register of the set point", true});
    find_point(setup, link, {"stem", "The register of the valve's position", false});
    find_point(setup, link, {"mode", "The register of the controller's mode", true});
    if (dialogue.ask("mode.register") != "none") dialogue.ask("mode.automatic");
    return Outcome::done;
  }
  find_point(setup, link, {"co", "The holding register that takes CO", false});
  find_point(setup, link, {"stem", "The register that reads the valve's position", false});
  ask_comm_loss(setup);
  return Outcome::done;
}

}  // namespace loopwarden::workbench::setup
