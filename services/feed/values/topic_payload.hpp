// SPDX-License-Identifier: Apache-2.0
// Reads the payload of a plain MQTT topic as a value for feed.sock: a number or word, or JSON with
// a value and optionally time and quality, at JSON Pointers (RFC 6901). Pure: no clock, no I/O.
//
// Value: a number (also as text), true and false as 1 and 0, a word of at most 64 bytes if the rule
// takes words, or null, which is quality bad. Time: a number of s or ms since 1970, or ISO 8601
// text with Z or an offset. Quality: good, uncertain, bad (in any case), true, false, or a code.
// Any other or missing content makes the payload bad.
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
  std::optional<JsonPointer> value{};  // nullopt: the payload itself is the value
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

// Accepts any bytes. Throws BadTopicPayload, which names the expected content.
protocol::FedValue read_topic_payload(const PayloadRule& rule, const std::string& name,
                                      std::string_view payload);

// Returns s since 1970 for a time such as 2026-11-25T10:00:00.5Z or ...+01:00.
std::optional<double> parse_iso_time(const std::string& text);

}  // namespace loopwarden::feed
