// SPDX-License-Identifier: Apache-2.0
#include "daemon/protocol/overview.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "daemon/protocol/members.hpp"

namespace loopwarden::protocol {
namespace {

using nlohmann::json;

constexpr std::array<const char*, kColumns> kNames{"period",
                                                   "pv",
                                                   "sp",
                                                   "co",
                                                   "stem",
                                                   "mode",
                                                   "requested_mode",
                                                   "fault",
                                                   "quality",
                                                   "flags",
                                                   "pv_age_ms",
                                                   "ne107",
                                                   "alarm",
                                                   "alarm_kind",
                                                   "alarms_unacknowledged",
                                                   "condition",
                                                   "not_in_file",
                                                   "commissioned"};

void put(std::string& text, double value, int digits) {
  if (!std::isfinite(value)) {
    text += "null";
  } else if (value == std::trunc(value) && std::abs(value) < 1e15) {
    fmt::format_to(std::back_inserter(text), "{}", static_cast<std::int64_t>(value));
  } else {
    fmt::format_to(std::back_inserter(text), "{:.{}g}", value, digits);
  }
}

void put(std::string& text, const std::vector<double>& values, int digits) {
  text += '[';
  for (const double value : values) {
    put(text, value, digits);
    text += ',';
  }
  if (text.back() == ',') text.pop_back();
  text += ']';
}

}  // namespace

template <>
struct Members<Overview> {
  static void put(json& to, const Overview& overview) { to = json::parse(to_text(overview)); }
  static void take(const json& from, Overview& overview) {
    from.at("now_ms").get_to(overview.now_ms);
    read(from, "config_hash", overview.config_hash);
    for (std::size_t i = 0; i < kColumns; ++i) read(from, kNames[i], overview.columns[i]);
  }
};
PROTOCOL_DEFINE(Overview)

std::string to_text(const Overview& overview) {
  constexpr int kDigits = 6;
  std::string text = fmt::format(R"({{"ok":true,"now_ms":{},"config_hash":{})", overview.now_ms,
                                 overview.config_hash);
  text.reserve(200 + 100 * overview.columns.front().size());
  for (std::size_t i = 0; i < kColumns; ++i) {
    text += fmt::format(",\"{}\":", kNames[i]);
    put(text, overview.columns[i], kDigits);
  }
  return text + '}';
}

std::string to_text(const Registers& registers) {
  constexpr int kDigits = 9;  // significant digits of a float, the type of the registers
  std::string text = R"({"ok":true,)";
  if (registers.names) text += "\"names\":" + json(*registers.names).dump() + ',';
  text += fmt::format("\"alarm_changes\":{},\"box\":", registers.alarm_changes);
  put(text, registers.box, kDigits);
  text += ",\"loops\":[";
  for (const LoopRegisters& loop : registers.loops) {
    text +=
        (text.back() == '[' ? "{\"tag\":" : ",{\"tag\":") + json(loop.tag).dump() + ",\"values\":";
    put(text, loop.values, kDigits);
    text += '}';
  }
  return text + "]}";
}

bool same(const std::vector<double>& a, const std::vector<double>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](double x, double y) { return x == y || (std::isnan(x) && std::isnan(y)); });
}

}  // namespace loopwarden::protocol
