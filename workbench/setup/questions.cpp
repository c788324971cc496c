// SPDX-License-Identifier: Apache-2.0
#include "workbench/setup/questions.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <stdexcept>

#include "base/text.hpp"

namespace loopwarden::workbench::setup {
namespace {

constexpr std::string_view kBlanks = " \t,";

std::vector<std::string> words_in(const std::string& text) {
  std::vector<std::string> words;
  for (std::size_t at = 0; (at = text.find_first_not_of(kBlanks, at)) != std::string::npos;) {
    const std::size_t end = std::min(text.find_first_of(kBlanks, at), text.size());
    words.push_back(text.substr(at, end - at));
    at = end;
  }
  return words;
}

template <class T>
std::optional<T> number_in(std::string_view text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if constexpr (std::is_floating_point_v<T>) {
    if (!std::isfinite(value)) return std::nullopt;
  }
  return value;
}

bool is_one_of(const std::string& word, std::initializer_list<std::string_view> words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

std::string any(const std::string&) { return {}; }
std::string there(const std::string& answer) { return answer.empty() ? "an answer is needed" : ""; }
std::string tag(const std::string& answer) {
  constexpr std::size_t kLongest = 32;
  const bool good = !answer.empty() && answer.size() <= kLongest && answer.front() != '.' &&
                    std::all_of(answer.begin(), answer.end(), [](char c) {
                      const auto byte = static_cast<unsigned char>(c);
                      return std::isalnum(byte) != 0 || c == '-' || c == '_' || c == '.';
                    });
  return good ? "" : "1 to 32 letters, digits, -, _ and ., such as FIC-101";
}
std::string control_word(const std::string& answer) {
  return is_one_of(answer, {"here", "elsewhere"}) ? "" : "here or elsewhere";
}
std::string source_word(const std::string& answer) {
  return is_one_of(answer, {"modbus", "opcua"}) ? "" : "modbus or opcua";
}
std::string transport_word(const std::string& answer) {
  return is_one_of(answer, {"tcp", "rtu"}) ? "" : "tcp or rtu";
}
std::string parity_word(const std::string& answer) {
  return is_one_of(answer, {"none", "even", "odd"}) ? "" : "none, even or odd";
}
std::string direction_word(const std::string& answer) {
  return is_one_of(answer, {"rises", "falls"}) ? "" : "rises or falls";
}
std::string loss_word(const std::string& answer) {
  return is_one_of(answer, {"register", "device", "none"}) ? "" : "register, device or none";
}
std::string yes_or_no(const std::string& answer) {
  return is_one_of(answer, {"yes", "no"}) ? "" : "yes or no";
}
std::string range(const std::string& answer) {
  const auto ends = numbers_in(answer, 2);
  return ends && (*ends)[0] < (*ends)[1]
             ? ""
             : "two numbers, the lower one first, with a decimal point, such as 0.5 25";
}
std::string above_zero_number(const std::string& answer) {
  const auto value = numbers_in(answer, 1);
  return value && value->front() > 0.0 ? "" : "a number above 0, with a decimal point, such as 0.5";
}
std::string above_zero_or_none(const std::string& answer) {
  return answer == "none" ? "" : above_zero_number(answer);
}
std::string whole_number(const std::string& answer) {
  return number_in<unsigned>(answer) ? "" : "a whole number";
}
std::string units_or_none(const std::string& answer) {
  return answer == "none" || units_in(answer) ? "" : "unit numbers such as 1-5,20, or none";
}
std::string register_place(const std::string& answer) {
  return register_in(answer) ? ""
                             : "UNIT TABLE ADDRESS TYPE [ORDER]: 0 to 255; input or holding; 0 to "
                               "65535; u16, i16, u32, i32, f32 or f64; abcd, cdab, badc or dcba";
}
std::string register_or_none(const std::string& answer) {
  return answer == "none" ? "" : register_place(answer);
}
std::string holding_place(const std::string& answer) {
  const auto place = register_in(answer);
  return place && place->table == "holding" ? "" : "a holding register: UNIT holding ADDRESS TYPE";
}
std::string scaling(const std::string& answer) {
  if (is_one_of(answer, {"none", "live"})) return {};
  const auto values = numbers_in(answer, 4);
  if (!values || (*values)[0] == (*values)[1] || (*values)[2] == (*values)[3]) {
    return "none, live, or four numbers: two raw ones and their values, such as 0 10000 0 100";
  }
  return {};
}
std::string hold_or_value(const std::string& answer) {
  return answer == "hold" || numbers_in(answer, 1)
             ? ""
             : "hold, or a number in CO units, with a decimal point, such as 0.5";
}
std::string numbers_list(const std::string& answer) {
  const std::vector<std::string> words = words_in(answer);
  const bool good = !words.empty() && std::all_of(words.begin(), words.end(), [](const auto& w) {
    return number_in<int>(w).has_value();
  });
  return good ? "" : "whole numbers, such as 1 3";
}

constexpr const char* kPlaceHelp = "UNIT TABLE ADDRESS TYPE [ORDER], such as 1 input 0 f32 cdab";
constexpr const char* kHoldingHelp =
    "UNIT TABLE ADDRESS TYPE [ORDER], such as 1 holding 0 f32 cdab";

constexpr std::array kQuestions{
    Question{"tag", "loop", "Tag of the loop, such as FIC-101", nullptr, tag},
    Question{"control", "loop",
             "Controller of the loop: here (this box moves the valve) or elsewhere (a PLC or DCS "
             "moves it; this box only reads)",
             nullptr, control_word},
    Question{"source", "loop",
             "Where its values come from: modbus (the PLC's registers) or opcua (an OPC UA server, "
             "by loopwarden-opcua)",
             "modbus", source_word},
    Question{"description", "loop", "Purpose of the loop, in a few words", "", any},
    Question{"pv.unit", "loop", "Unit of the process variable PV, such as m3/h", nullptr, there},
    Question{"pv.range", "loop", "Range of PV: lower and upper end", nullptr, range, "pv"},
    Question{"co.unit", "loop", "Unit of the controller output CO", "%", there},
    Question{"co.range", "loop", "Range of CO", "0 100", range, "co"},
    Question{"sample_time", "loop",
             "Seconds between two cycles: a fifth of the loop's time constant or shorter", "0.2",
             above_zero_number, "s"},
    Question{"opcua.url", "devices", "Address of the server, opc.tcp://HOST:PORT", nullptr, there},
    Question{"link.transport", "devices", "How its devices are reached: tcp or rtu (serial line)",
             "tcp", transport_word},
    Question{"link.hosts", "devices",
             "IP addresses to look at, separated by blanks. Only these are asked", nullptr, there},
    Question{"link.port", "devices", "TCP port", "502", whole_number},
    Question{"link.device", "devices", "Serial line, such as /dev/ttyUSB0", nullptr, there},
    Question{"link.baud", "devices", "Baud", "19200", whole_number},
    Question{"link.parity", "devices", "Parity: none, even or odd", "even", parity_word},
    Question{"link.stop_bits", "devices", "Stop bits", "1", whole_number},
    Question{"scan.units", "devices",
             "Unit numbers to ask, such as 1-5,20. Each receives only two read requests. "
             "none: no scan",
             "none", units_or_none},
    Question{"link.host", "devices", "Which of these addresses has the loop's devices", nullptr,
             there},
    Question{"pv.register", "devices", kPlaceHelp, nullptr, register_place},
    Question{"pv.scale", "devices",
             "Two raw values and their values in units (0 10000 0 25); none: the register holds "
             "the value itself; live: you enter the value on the display",
             "live", scaling},
    Question{"co.register", "devices", kHoldingHelp, nullptr, register_place},
    Question{"co.scale", "devices", "As for PV: four numbers, none or live", "live", scaling},
    Question{"stem.register", "devices", "The same, or none", "none", register_or_none},
    Question{"stem.scale", "devices", "As for PV: four numbers, none or live", "live", scaling},
    Question{"sp.register", "devices", "The same, or none", "none", register_or_none},
    Question{"sp.scale", "devices", "As for PV: four numbers, none or live", "live", scaling},
    Question{"mode.register", "devices", "The same, or none", "none", register_or_none},
    Question{"mode.automatic", "devices", "Its values in which the loop is closed, such as 1 3",
             nullptr, numbers_list},
    Question{
        "comm_loss", "devices",
        "How the valve reacts when commands cease (cable, power, this box dead). "
        "Only the device can move it: register (its watchdog is a register, written here), device "
        "(set on the device itself), none (it does not move, and you accept it)",
        nullptr, loss_word},
    Question{"comm_loss.timeout", "devices", "Seconds without a command, after which it acts",
             nullptr, above_zero_number, "s"},
    Question{"comm_loss.register", "devices", "Its register, UNIT holding ADDRESS TYPE", nullptr,
             holding_place},
    Question{"comm_loss.scale", "devices",
             "Two raw values of it and their values in seconds, such as 0 10 0 1; none: whole "
             "seconds",
             "none", scaling},
    Question{"pv.follows", "file", "When CO rises, PV: rises or falls", nullptr, direction_word},
    Question{"kc", "file",
             "Gain Kc, % of the output's span per % of PV's span. Start low: 0.2 suits most flow "
             "loops; `loopwarden autotune` finds better",
             nullptr, above_zero_number},
    Question{"ti", "file", "Integral time Ti, s. The loop's time constant, or longer", nullptr,
             above_zero_number, "s"},
    Question{"sp.limits", "file", "Lowest and highest set point that may be ordered, PV units",
             nullptr, range, "pv"},
    Question{"co.limits", "file", "Lowest and highest output that is ever written, CO units",
             nullptr, range, "co"},
    Question{"co.rate", "file", "Fastest change of the output, CO units a second, or none", "none",
             above_zero_or_none, "co/s"},
    Question{
        "stop.end", "file",
        "The service is stopped or the box restarts. hold: the valve keeps its position, without "
        "control. A number: the output takes this value first",
        nullptr, hold_or_value, "co"},
    Question{"stop.bad_pv", "file",
             "The transmitter fails. hold: the valve stays, whatever the flow does. A number: the "
             "output goes there",
             nullptr, hold_or_value, "co"},
    Question{"stop.output_lost", "file",
             "Commands no longer reach the valve, so its own watchdog may have moved it. hold: the "
             "loop continues from the valve's actual position. A number: the output takes it as "
             "soon as possible",
             nullptr, hold_or_value, "co"},
    Question{"write", "file", "Write these files: yes or no", "yes", yes_or_no},
    Question{"masters", "masters",
             "Does a PLC or SCADA read from this box by Modbus? yes: on port 1502, this host alone "
             "until modbus_server.clients lets others in",
             "no", yes_or_no},
};

}  // namespace

const Question& question(std::string_view id) {
  const auto* const found = std::find_if(kQuestions.begin(), kQuestions.end(),
                                         [&](const Question& q) { return q.id == id; });
  if (found == kQuestions.end()) throw std::logic_error("no question " + std::string(id));
  return *found;
}

std::vector<std::string> question_ids() {
  std::vector<std::string> ids;
  for (const Question& q : kQuestions) ids.emplace_back(q.id);
  return ids;
}

std::optional<std::vector<double>> numbers_in(const std::string& text, std::size_t count) {
  std::vector<double> numbers;
  for (const std::string& word : words_in(text)) {
    const std::optional<double> number = number_in<double>(word);
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers.size() == count ? std::optional(numbers) : std::nullopt;
}

std::string without_unit(const std::string& text, const std::string& unit) {
  const std::string wanted = base::lower_case(unit);
  // A digit may belong to the number itself.
  if (wanted.empty() || std::isdigit(static_cast<unsigned char>(wanted.front())) != 0) return text;
  std::string rest = text;
  for (std::size_t at = 0; (at = base::lower_case(rest).find(wanted, at)) != std::string::npos;) {
    const std::size_t before = rest.find_last_not_of(kBlanks, at == 0 ? 0 : at - 1);
    const std::size_t after = at + unit.size();
    const bool behind_number =
        at > 0 && before != std::string::npos &&
        (std::isdigit(static_cast<unsigned char>(rest[before])) != 0 || rest[before] == '.');
    const bool ends = after >= rest.size() || kBlanks.find(rest[after]) != std::string_view::npos;
    if (behind_number && ends) {
      rest.erase(at, unit.size());
    } else {
      at = after;
    }
  }
  return std::string(base::trimmed(rest));
}

std::optional<std::vector<unsigned>> units_in(const std::string& text) {
  constexpr unsigned kMost = 255;
  std::vector<unsigned> units;
  for (const std::string& word : words_in(text)) {
    const std::size_t dash = word.find('-');
    const auto first = number_in<unsigned>(std::string_view(word).substr(0, dash));
    const auto last = dash == std::string::npos
                          ? first
                          : number_in<unsigned>(std::string_view(word).substr(dash + 1));
    if (!first || !last || *first > *last || *last > kMost) return std::nullopt;
    for (unsigned unit = *first; unit <= *last; ++unit) units.push_back(unit);
  }
  return units.empty() ? std::nullopt : std::optional(units);
}

std::optional<RegisterPlace> register_in(const std::string& text) {
  const std::vector<std::string> words = words_in(base::lower_case(text));
  if (words.size() < 4 || words.size() > 5) return std::nullopt;
  const auto unit = number_in<unsigned>(words[0]);
  const auto address = number_in<unsigned>(words[2]);
  RegisterPlace place{.table = words[1], .type = words[3], .order = "abcd"};
  if (words.size() == 5) place.order = words[4];
  if (!unit || *unit > 255 || !address || *address > 65535 ||
      !is_one_of(place.table, {"input", "holding"}) ||
      !is_one_of(place.type, {"u16", "i16", "u32", "i32", "f32", "f64"}) ||
      !is_one_of(place.order, {"abcd", "cdab", "badc", "dcba"})) {
    return std::nullopt;
  }
  place.unit = *unit;
  place.address = *address;
  return place;
}

std::optional<double> said_value(const std::string& text, std::pair<double, double> range,
                                 const std::string& unit) {
  const std::string plain = unit == "%" ? text : without_unit(text, unit);
  std::string_view words = base::trimmed(plain);
  const bool percent = words.ends_with('%');
  if (percent) words = base::trimmed(words.substr(0, words.size() - 1));
  const std::optional<double> value = number_in<double>(words);
  if (!value || !percent) return value;
  return range.first + *value / 100.0 * (range.second - range.first);
}

}  // namespace loopwarden::workbench::setup
