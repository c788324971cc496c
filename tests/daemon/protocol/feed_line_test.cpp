// SPDX-License-Identifier: Apache-2.0
#include "daemon/protocol/feed_line.hpp"

#include <catch2/catch.hpp>

#include <string>
#include <utility>
#include <vector>

#include "tests/support/property.hpp"

namespace loopwarden::protocol::feed_line_test {

using Quality = FedValue::Quality;

TEST_CASE("a line of feed.sock has the form that feeders write", "[feed]") {
  const std::vector<FedValue> values{
      {.name = "FIC205.PV", .value = 12.25, .time_s = 1764000000.125, .quality = Quality::good},
      {.name = "FIC205.OP", .quality = Quality::bad}};
  CHECK(
      write_feed_lines(values) ==
      std::vector<std::string>{
          R"({"values":[{"name":"FIC205.PV","quality":"good","time":1764000000.125,"value":12.25},)"
          R"({"name":"FIC205.OP","quality":"bad","value":null}]})"});
  CHECK(write_feed_lines({}).empty());
  std::string id;
  CHECK(read_feed_line(feed_sign_of_life(), id).values.empty());
}

TEST_CASE("a feeder's values are read back unchanged, in lines that are short enough", "[feed]") {
  namespace property = tests::property;
  property::for_all("values there and back", 100, [] {
    std::vector<FedValue> values(static_cast<std::size_t>(property::integer(0, 300)));
    for (FedValue& fed : values) {
      fed.name.assign(static_cast<std::size_t>(property::integer(1, 1024)), '"');
      fed.quality = static_cast<Quality>(property::one_of(3));
      fed.reason = static_cast<FedValue::Reason>(property::one_of(4));
      if (property::coin()) {
        fed.word.assign(static_cast<std::size_t>(property::integer(1, 64)), '"');
      } else if (fed.quality != Quality::bad || property::coin()) {
        fed.value = property::number(-1e9, 1e9);
      }
      if (property::coin()) fed.time_s = property::number(0.0, 4e9);
    }
    std::vector<FedValue> read;
    for (const std::string& line : write_feed_lines(values)) {
      property::require(line.size() <= FeedLine::kLongest, "a line that is short enough");
      std::string id;
      for (FedValue& fed : read_feed_line(line, id).values) read.push_back(std::move(fed));
    }
    property::require(read.size() == values.size(), "all of them");
    for (std::size_t i = 0; i < read.size(); ++i) {
      property::require(read[i].name == values[i].name && read[i].value == values[i].value &&
                            read[i].word == values[i].word && read[i].time_s == values[i].time_s &&
                            read[i].quality == values[i].quality &&
                            read[i].reason == values[i].reason,
                        "the same");
    }
  });
}

}  // namespace loopwarden::protocol::feed_line_test
