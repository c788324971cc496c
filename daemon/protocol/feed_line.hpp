// SPDX-License-Identifier: Apache-2.0
// A line of feed.sock: values of loops that another controller runs.
//
//   {"values": [{"name": "FIC205.PV", "value": 12.3, "time": 1764000000.123, "quality": "good"}], "id": 7}
//
// `value`: a number, a word of 1 to 64 bytes such as "AUTO", or null with quality bad. `time`: s
// since 1970 (UTC) by the source; null or absent where it has none. `quality`: good (also where it
// is absent), uncertain or bad. `reason`, with quality bad: "timeout" (no message for too long),
// "death" (the source's death was reported) or "link" (the feeder lost the source's network);
// absent: the source says so. `id`, a number or a text of at most 64 bytes: the line is answered,
// {"id": 7, "ok": true, "taken": 1} or {"id": 7, "ok": false, "error": "..."}. Other keys are
// passed over. A line without values is a sign of life.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace loopwarden::protocol {

struct FedValue {
  static constexpr std::size_t kLongestWord = 64;  // bytes
  enum class Quality : std::uint8_t { good, uncertain, bad };
  enum class Reason : std::uint8_t { source, timeout, death, link };
  std::string name{};
  std::optional<double> value{};   // finite
  std::string word{};              // 1 to 64 bytes in place of a value, such as AUTO
  std::optional<double> time_s{};  // finite, since 1970
  Quality quality = Quality::good;
  Reason reason = Reason::source;  // of quality bad or uncertain
};

struct FeedLine {
  static constexpr std::size_t kLongest = 64UL * 1024UL;  // bytes, without the line's end
  std::vector<FedValue> values{};
  std::string id{};  // as JSON; empty: no answer is wanted
};

// Throws RequestError, with what was expected. `id` is set where the line has one, whatever else is wrong with it.
FeedLine read_feed_line(std::string_view line, std::string& id);

// Lines, without their ends, that read_feed_line() reads as these values, in order; none is longer than kLongest. Names have at most
// 1024 bytes.
std::vector<std::string> write_feed_lines(const std::vector<FedValue>& values);
// A line without values.
std::string feed_sign_of_life();

// The answers to a line with this id.
std::string feed_taken(const std::string& id, std::size_t taken);
std::string feed_refused(const std::string& id, std::string_view why);

}  // namespace loopwarden::protocol
