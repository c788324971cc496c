// SPDX-License-Identifier: Apache-2.0
#include "workbench/discover/loop_file.hpp"

#include <catch2/catch.hpp>

#include <algorithm>

#include "config/config_reader.hpp"

namespace loopwarden::workbench::discover::loop_file_test {
namespace {

using record::Role;

FoundLoop whole_loop() {
  FoundLoop loop;
  loop.tag.value = "FIC-205";
  loop.description = "Feed: \"R-2\" #1";
  loop.signals[record::index_of(Role::pv)] = LoopSignal{"A \"b\": {x}", "nsu=urn:p;s=\"b\"", ""};
  loop.signals[record::index_of(Role::co)] = LoopSignal{"OP", "", "the same number"};
  loop.signals[record::index_of(Role::mode)] = LoopSignal{"M", "nsu=urn:p;i=7", ""};
  loop.pv_unit = {"m3/h", ""};
  loop.pv_range = {record::SignalRange{-0.5, 1e9}, ""};
  loop.co_unit = {"%", "CO runs\rfrom 0 to 100"};
  loop.co_range = {record::SignalRange{0.0, 100.0}, ""};
  loop.automatic = {{"1", "3"}, ""};
  loop.manual = {{"0"}, ""};
  return loop;
}

config::Loaded<config::LoopConfig> as_read(const LoopFile& file) {
  config::DaemonConfig daemon;
  daemon.feeders.emplace("opcua", config::FeederUser{});
  return config::read_loop_text("f", file.text, daemon);
}

}  // namespace

TEST_CASE("the file of a loop contains the found values", "[discover]") {
  const LoopFile file = loop_file(whole_loop(), {.feeder = "opcua", .source = "a\nb.csv"});
  INFO(file.text);
  CHECK(file.is_complete());
  const auto loop = as_read(file);
  INFO(config::to_text(loop.diagnostics));
  REQUIRE(loop);
  CHECK(loop->name == "FIC-205");
  CHECK(loop->description == "Feed: \"R-2\" #1");
  CHECK(loop->pv.low == -0.5);
  CHECK(loop->pv.high == 1e9);
  CHECK(loop->pv_unit == "m3/h");
  CHECK(loop->co_unit == "%");
  CHECK(loop->controller.output.high == 100.0);
  CHECK(loop->sample_time_s == 1.0);
  const auto& feed = std::get<hal::feed::FeedSettings>(loop->io);
  CHECK(feed.process_variable.name == hal::feed::FeedName{"opcua", "A \"b\": {x}"});
  CHECK(feed.output.name == hal::feed::FeedName{"opcua", "OP"});
  CHECK(feed.mode == hal::feed::FeedName{"opcua", "M"});
  CHECK(feed.mode_values.automatic == std::vector<double>{1.0, 3.0});
  CHECK_FALSE(feed.set_point);
  // Each guess is a comment after its key.
  CHECK(file.text.find("  unit: \"%\"  # guessed: CO runs?from 0 to 100\n") != std::string::npos);
  CHECK(file.text.find("  co: {feed: \"opcua:OP\"}  # guessed: the same number\n") !=
        std::string::npos);
  CHECK(file.text.find("sample_time: 1  # guessed: ") != std::string::npos);
  REQUIRE(file.guessed.size() == 3);
  CHECK(file.guessed[0].first == "sample_time");
  CHECK(file.guessed[1].first == "output.unit");
  CHECK(file.guessed[2].first == "co");
  CHECK(std::count(file.text.begin(), file.text.end(), '#') == 3 + 1 + 1 + 1 + 1);
  CHECK(file.text.find("  frozen_after: 60  # s") != std::string::npos);
  CHECK(loop->pv.frozen_after_s == 60.0);
  CHECK(file.sure == std::vector<std::string>{"loop", "process_variable.unit",
                                              "process_variable.range", "output.range", "pv",
                                              "mode", "mode.automatic", "mode.manual"});
}

TEST_CASE("a given sample time is no guess", "[discover]") {
  const LoopFile file =
      loop_file(whole_loop(), {.feeder = "opcua", .source = "t", .sample_time_s = 0.5});
  CHECK(file.text.find("sample_time: 0.5\n") != std::string::npos);
  CHECK(as_read(file)->sample_time_s == 0.5);
}

TEST_CASE("missing values are listed at the top, including values that check would refuse",
          "[discover]") {
  FoundLoop loop = whole_loop();
  loop.pv_range.value.reset();
  loop.co_unit.value.clear();
  const LoopFile open = loop_file(loop, {.feeder = "opcua", .source = "t"});
  CHECK(open.missing == std::vector<std::string>{"process_variable.range: [lower, upper end] of PV",
                                                 "output.unit: unit of CO"});
  CHECK(open.text.find("# Found by loopwarden discover in t.\n"
                       "# Missing, before this can be FIC-205.yaml:\n"
                       "#   process_variable.range: [lower, upper end] of PV\n"
                       "#   output.unit: unit of CO\n") == 0);
  CHECK_FALSE(as_read(open));
  FoundLoop clashing = whole_loop();
  clashing.manual.value = {"3"};
  const LoopFile refused = loop_file(clashing, {.feeder = "opcua", .source = "t"});
  REQUIRE(refused.missing.size() == 1);
  CHECK(refused.missing[0].find("io.mode.manual: 3 is in automatic") == 0);
}

TEST_CASE("known nodes are listed for loopwarden-opcua", "[discover]") {
  CHECK(node_list({whole_loop()}, NodeForm::opcua) ==
        "nodes:\n"
        "  \"A \\\"b\\\": {x}\": \"nsu=urn:p;s=\\\"b\\\"\"\n"
        "  \"M\": \"nsu=urn:p;i=7\"\n");
  FoundLoop without = whole_loop();
  for (auto& signal : without.signals) {
    if (signal) signal->node.clear();
  }
  CHECK(node_list({without}, NodeForm::opcua).empty());
}

}  // namespace loopwarden::workbench::discover::loop_file_test
