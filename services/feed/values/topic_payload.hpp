// SPDX-License-Identifier: Apache-2.0
// The payload of a plain MQTT topic as a value of feed.sock: a number or word, or JSON with a value, and maybe a time and a
// quality, at places that JSON Pointers (RFC 6901) name. Pure: no clock, no I/O.
//
// A value: a number, also as text, true and false as 1 and 0, where the rule
// takes words one of at most 64 bytes, or null, which is quality bad. A time: a
// number of s or ms since 1970, or ISO 8601 text with Z or an offset. A quality: good, uncertain, bad (in any case), true,
// false, or a code. Whatever else stands there, or does not, makes the payload a bad one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "daemon/protocol/feed_line.hpp"
#include "services/feed/values/quality_code.hpp"

namespace loopwarden::feed {

using JsonPointer = nlohmann::json::json_pointer;

enum class TimeForm : std::uint8_t { s, ms, iso };

struct PayloadRule {
  std::optional<JsonPointer> value{};  // none: the payload itself is the value
  bool words = false;
  std::optional<JsonPointer> time{};
  TimeForm time_form = TimeForm::s;
  std::optional<JsonPointer> quality{};
  QualityCodes quality_codes = QualityCodes::opc;
};

class BadTopicPayload : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

inline constexpr std::size_t kMostTopicBytes = 1024UL * 1024UL;

// Any bytes. Throws BadTopicPayload with what was expected.
protocol::FedValue read_topic_payload(const PayloadRule& rule, const std::string& name,
                                      std::string_view payload);

// A time such as 2026-11-25T10:00:00.5Z or ...+01:00, s since 1970.
std::optional<double> parse_iso_time(const std::string& text);

}  // namespace loopwarden::feed
