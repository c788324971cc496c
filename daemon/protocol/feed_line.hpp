// SPDX-License-Identifier: Apache-2.0
// A line of feed.sock: values of loops that another controller runs.
//
//   {"values": [{"name": "FIC205.PV", "value": 12.3, "time": 1764000000.123, "quality": "good"}],
//    "id": 7}
//
// - `value`: a number, a word of 1 to 64 bytes such as "AUTO", or null with quality bad.
// - `time`: s since 1970 (UTC) by the source; null or absent if the source gives no time.
// - `quality`: good (the default), uncertain or bad.
// - `reason`, with quality bad: "timeout" (no message for too long), "death" (the source's death
//   was reported) or "link" (the feeder lost the source's network). Absent: the source reports bad
//   quality itself.
// - `source`, with quality bad: the lost part, such as "broker mqtt://10.0.0.5", at most 128 bytes.
//   Loops with the same lost source share one alarm.
// - `id`, a number or a text of at most 64 bytes, requests an answer: {"id": 7, "ok": true,
//   "taken": 1} or {"id": 7, "ok": false, "error": "..."}.
//
// - `feeder`: name of the feeder, in the first line of a connection. Required if several feeders of
//   loopwardend.yaml have the same user.
//
// Other keys are ignored. A line without values is a sign of life.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace loopwarden::protocol {

struct FedValue {
  static constexpr std::size_t kLongestWord = 64;     // bytes
  static constexpr std::size_t kLongestSource = 128;  // bytes
  enum class Quality : std::uint8_t { good, uncertain, bad };
  enum class Reason : std::uint8_t { source, timeout, death, link };
  std::string name{};
  std::optional<double> value{};   // finite
  std::string word{};              // 1 to 64 bytes instead of a value, such as AUTO
  std::optional<double> time_s{};  // finite, since 1970
  Quality quality = Quality::good;
  Reason reason = Reason::source;  // if quality is bad or uncertain
  std::string source{};            // the lost part; empty: not known
};

struct FeedLine {
  static constexpr std::size_t kLongest = 64UL * 1024UL;  // bytes, without the line end
  std::vector<FedValue> values{};
  std::string id{};      // as JSON; empty: no answer is requested
  std::string feeder{};  // empty: not named
};

// Parses a line. Throws RequestError with the expected form. `id` is set if the line has a valid
// one, also if the rest is invalid.
FeedLine read_feed_line(std::string_view line, std::string& id);

// Returns lines, without their ends, that read_feed_line() parses into these values in order. No
// line is longer than kLongest. Names must have at most 1024 bytes.
std::vector<std::string> write_feed_lines(const std::vector<FedValue>& values);
// Returns a line without values. `feeder`: names the feeder, in the first line of a connection.
std::string feed_sign_of_life(const std::string& feeder = {});

// Return the answers to a line with this id: accepted, or refused.
std::string feed_taken(const std::string& id, std::size_t taken);
std::string feed_refused(const std::string& id, std::string_view why);

}  // namespace loopwarden::protocol
