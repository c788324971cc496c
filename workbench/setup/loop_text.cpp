// SPDX-License-Identifier: Apache-2.0
#include "workbench/setup/loop_text.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "hal/contract/pv_check_settings.hpp"
#include "workbench/setup/questions.hpp"

namespace loopwarden::workbench::setup {
namespace {

// JSON's double quotes are valid in YAML.
std::string quoted(const std::string& text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

// Returns a double in decimal notation, as the files require.
std::string plain(double value) {
  std::string text = fmt::format("{:.9f}", value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.ends_with('.')) text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string list_of(const std::string& answer, std::size_t count) {
  std::string text;
  for (const double value : numbers_in(answer, count).value_or(std::vector<double>(count, 0.0))) {
    text += (text.empty() ? "" : ", ") + plain(value);
  }
  return "[" + text + "]";
}

// {table: ..., address: ..., type: ..., raw: ..., eu: ...}
std::string register_text(const std::string& where, const std::string& scale, bool written) {
  const RegisterPlace place = register_in(where).value_or(RegisterPlace{});
  std::string text = "{";
  // The reader refuses a table of a written register, so an input register can't become another.
  if (!written || place.table != "holding") text += fmt::format("table: {}, ", place.table);
  text += fmt::format("address: {}, type: {}", place.address, place.type);
  if (place.order != "abcd") text += ", order: " + place.order;
  if (const auto four = numbers_in(scale, 4)) {
    const std::vector<double>& v = *four;
    // The files need rising raw values.
    const bool rises = v[0] < v[1];
    text += fmt::format(", raw: [{}, {}], eu: [{}, {}]", plain(v[rises ? 0 : 1]),
                        plain(v[rises ? 1 : 0]), plain(v[rises ? 2 : 3]), plain(v[rises ? 3 : 2]));
  }
  return text + "}";
}

unsigned unit_of(const std::string& where) {
  return register_in(where).value_or(RegisterPlace{}).unit;
}

bool is_asked(const std::string& answer) { return !answer.empty() && answer != "none"; }

std::string watched_text(const Answered& of, const std::string& link) {
  std::string text = "io:\n  backend: modbus\n";
  for (const char* name : {"pv", "co", "sp", "stem", "mode"}) {
    const std::string where = of((std::string(name) + ".register").c_str());
    if (!is_asked(where)) continue;
    text += fmt::format("  {}: {{link: {}, unit: {}, register: {}", name, link, unit_of(where),
                        register_text(where, of((std::string(name) + ".scale").c_str()), false));
    if (std::string(name) == "mode") {
      std::string automatic;
      for (const char c : of("mode.automatic")) {
        const bool blank = c == ' ' || c == ',' || c == '\t';
        if (!blank) {
          automatic += c;
        } else if (!automatic.empty() && automatic.back() != ' ') {
          automatic += ", ";
        }
      }
      text += fmt::format(", automatic: [{}]", automatic);
    }
    text += "}\n";
  }
  return text;
}

std::string comm_loss_text(const Answered& of) {
  const std::string loss = of("comm_loss");
  if (loss == "none") return "    comm_loss: none_accepted\n";
  const std::string timeout = of("comm_loss.timeout");
  if (loss == "device") {
    return fmt::format("    comm_loss: {{timeout: {}, set_by: device}}\n", timeout);
  }
  return fmt::format(
      "    comm_loss:\n      timeout: {}  # s\n      register: {}\n      value: {}\n", timeout,
      register_text(of("comm_loss.register"), of("comm_loss.scale"), true), timeout);
}

std::string controlled_text(const Answered& of, const std::string& link) {
  const std::string rate = of("co.rate");
  const std::vector<double> sp = numbers_in(of("sp.limits"), 2).value_or(std::vector{0.0, 0.0});
  std::string text = fmt::format(
      "controller:\n"
      "  action: {}\n"
      "  kc: {}  # % of output span per % of PV span\n"
      "  ti: {}  # s\n"
      "  set_point: {{limits: {}}}\n"
      "  output:\n"
      "    unit: {}\n"
      "    range: {}\n"
      "    limits: {}\n",
      of("pv.follows") == "falls" ? "direct" : "reverse", of("kc"), of("ti"),
      list_of(of("sp.limits"), 2), quoted(of("co.unit")), list_of(of("co.range"), 2),
      list_of(of("co.limits"), 2));
  if (is_asked(rate)) text += fmt::format("    rate_limit: {}  # CO units/s\n", rate);
  text += fmt::format(
      "  set_point_tracks_in_manual: true\n"
      "start: {{mode: manual, set_point: {}}}\n"
      "safe_actions:\n"
      "  stop: {}\n"
      "  bad_pv: {}\n"
      "  output_lost: {}\n"
      "  enable_open: hold  # no enable contact on Modbus\n"
      "  recovery: manual\n",
      plain((sp[0] + sp[1]) / 2.0), of("stop.end"), of("stop.bad_pv"), of("stop.output_lost"));
  const std::string pv = of("pv.register");
  const std::string co = of("co.register");
  const std::string stem = of("stem.register");
  text += fmt::format(
      "io:\n"
      "  backend: modbus\n"
      "  poll_period: {}  # s\n"
      "  transmitter: {{link: {}, unit: {}, register: {}}}\n"
      "  positioner:\n"
      "    link: {}\n"
      "    unit: {}\n"
      "    command: {}\n",
      of("sample_time"), link, unit_of(pv), register_text(pv, of("pv.scale"), false), link,
      unit_of(co), register_text(co, of("co.scale"), true));
  if (is_asked(stem)) {
    text += fmt::format("    read_back: {}\n", register_text(stem, of("stem.scale"), false));
  }
  return text + comm_loss_text(of);
}

}  // namespace

std::string loop_text(const Answered& of, const std::string& link) {
  const bool elsewhere = of("control") == "elsewhere";
  std::string text = "loop: " + quoted(of("tag")) + "\n";
  if (!of("description").empty()) text += "description: " + quoted(of("description")) + "\n";
  if (elsewhere) text += "control: elsewhere  # nothing of this loop is ever written\n";
  const auto seconds = [](const std::string& answer) {
    return numbers_in(answer, 1).value_or(std::vector{0.0}).front();
  };
  // If a frozen PV may move the valve, a slow loop gets more time to respond.
  const double frozen_after_s = hal::usual_frozen_after_s(
      seconds(of("sample_time")), elsewhere ? 0.0 : 3.0 * seconds(of("ti")));
  text += fmt::format(
      "sample_time: {}  # s\n"
      "process_variable:\n"
      "  unit: {}\n"
      "  range: {}\n"
      "  frozen_after: {}  # s, after CO has moved by 10 %\n",
      of("sample_time"), quoted(of("pv.unit")), list_of(of("pv.range"), 2), plain(frozen_after_s));
  if (!elsewhere) return text + controlled_text(of, link);
  return text +
         fmt::format("output: {{unit: {}, range: {}}}\n", quoted(of("co.unit")),
                     list_of(of("co.range"), 2)) +
         watched_text(of, link);
}

std::string link_text(const Answered& of) {
  if (of("link.transport") == "tcp") {
    return fmt::format("{{transport: tcp, host: {}, port: {}}}", quoted(of("link.host")),
                       of("link.port"));
  }
  return fmt::format("{{transport: rtu, device: {}, baud: {}, parity: {}, stop_bits: {}}}",
                     quoted(of("link.device")), of("link.baud"), of("link.parity"),
                     of("link.stop_bits"));
}

std::optional<std::string> with_link(const std::string& text, const std::string& name,
                                     const std::string& link) {
  const std::string entry = fmt::format("{}: {}\n", name, link);
  const auto end_of_line = [&](std::size_t at) {
    return std::min(text.find('\n', at), text.size());
  };
  for (std::size_t at = 0; at < text.size(); at = end_of_line(at) + 1) {
    if (!std::string_view(text).substr(at).starts_with("links:")) continue;
    const std::size_t end = end_of_line(at);
    const std::string_view rest = std::string_view(text).substr(at + 6, end - at - 6);
    const std::size_t first = rest.find_first_not_of(" \t\r");
    if (end == text.size() || (first != std::string_view::npos && rest[first] != '#')) {
      return std::nullopt;
    }
    // Uses the indentation of the next line.
    std::size_t depth = 2;
    for (std::size_t next = end + 1; next < text.size(); next = end_of_line(next) + 1) {
      const std::string_view line = std::string_view(text).substr(next, end_of_line(next) - next);
      const std::size_t begins = line.find_first_not_of(' ');
      if (begins == std::string_view::npos || line[begins] == '#') continue;
      if (begins > 0) depth = begins;
      break;
    }
    return text.substr(0, end + 1) + std::string(depth, ' ') + entry + text.substr(end + 1);
  }
  const bool ended = text.empty() || text.ends_with('\n');
  return text + (ended ? "" : "\n") + "links:\n  " + entry;
}

}  // namespace loopwarden::workbench::setup
