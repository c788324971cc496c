// SPDX-License-Identifier: Apache-2.0
// Reads any bytes as a line of a feeder. An accepted line has names, finite numbers and one
// quality. Only quality bad allows a missing value. The answer is one line of JSON with the line's
// id.
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "daemon/protocol/feed_line.hpp"
#include "daemon/protocol/requests.hpp"
#include "tests/fuzz/require.hpp"

using loopwarden::protocol::FedValue;
using loopwarden::protocol::FeedLine;
using loopwarden::tests::fuzz::require;
using nlohmann::json;

namespace {

void check_answer(const std::string& text, const std::string& id, bool ok) {
  require(text.find('\n') == std::string::npos, "one line");
  const json answer = json::parse(text, nullptr, false);
  require(answer.is_object() && answer.at("ok") == ok, "an answer");
  require(answer.at("id").dump() == id, "the line's id");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view line(reinterpret_cast<const char*>(data), size);
  std::string id;
  try {
    const FeedLine feed = loopwarden::protocol::read_feed_line(line, id);
    require(feed.id == id, "one id");
    for (const FedValue& value : feed.values) {
      require(!value.name.empty() && value.name.size() <= 1024, "a name");
      require(!value.value || std::isfinite(*value.value), "a finite value");
      require(!value.time_s || std::isfinite(*value.time_s), "a finite time");
      require(value.value || !value.word.empty() || value.quality == FedValue::Quality::bad,
              "a value, a word, or bad");
    }
    if (!id.empty())
      check_answer(loopwarden::protocol::feed_taken(id, feed.values.size()), id, true);
  } catch (const loopwarden::protocol::RequestError& e) {
    if (!id.empty()) check_answer(loopwarden::protocol::feed_refused(id, e.what()), id, false);
  }
  return 0;
}
