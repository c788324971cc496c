// SPDX-License-Identifier: Apache-2.0
#include "workbench/records/rules_file.hpp"

#include <catch2/catch.hpp>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::rules_file_test {
namespace {

using record::Role;
using record::TagRule;
using workbench::read_rules_text;

TEST_CASE("the example of rules is accepted unchanged, and names every key", "[import][rules]") {
  const std::string file = LOOPWARDEN_SOURCE_DIR "/examples/survey/rules.yaml";
  const auto rules = workbench::read_rules_file(file);
  INFO(config::to_text(rules.diagnostics));
  REQUIRE(rules);
  CHECK(rules.diagnostics.empty());
  REQUIRE(rules->rules.size() == 6);
  CHECK(rules->tags.size() == 2);
  const auto loop_of = [&](const char* name) {
    const auto ruled = record::rule_for(rules->rules, name);
    return ruled ? ruled->loop : std::string();
  };
  CHECK(loop_of("21FT101") == "21FIC101");
  CHECK(loop_of("21FV101.CMD") == "21FIC101");
  CHECK(loop_of("21fic101.w") == "21FIC101");
  CHECK(rules->rules[0].kind == "flow");
  CHECK(rules->rules[0].range == record::SignalRange(0.0, 120.0));
  CHECK(rules->rules[1].role == Role::co);
  REQUIRE(rules->rules[3].mode_words);
  CHECK(rules->rules[3].mode_words->manual == std::vector<std::string>{"hnd", "1"});
  CHECK_FALSE(rules->rules[4].role);
  CHECK(rules->rules[5].unused);
  CHECK(rules->rules[0].place == file + ":5");
  const std::string text = read_file(file);
  const config::KeyReference reference = workbench::describe_rules();
  for (const config::KeyDescription& key : reference.keys()) {
    INFO(key.path);
    CHECK(text.find(key.path.substr(key.path.find_last_of('.') + 1) + ":") != std::string::npos);
  }
}

TEST_CASE("errors of rules are reported with their place", "[import][rules]") {
  const auto error_of = [](const std::string& rule) {
    return config::to_text(read_rules_text("r.yaml", "rules:\n  - " + rule + "\n").diagnostics);
  };
  using Catch::Contains;
  CHECK_THAT(
      error_of("{match: \"F[T\", signal: none}"),
      Contains(
          "r.yaml:2:13: error: rules[0].match: must be a pattern: the bracket [ is not closed"));
  CHECK_THAT(error_of("{match: FT*, signal: pv}"), Contains("'loop'"));
  CHECK_THAT(error_of("{match: FT*, loop: F$1}"), Contains("needs signal"));
  CHECK_THAT(error_of("{match: FT*, signal: pv, loop: F$2}"), Contains("one of the 1 of *, ?"));
  CHECK_THAT(error_of("{match: FT*, signal: pw, loop: F$1}"), Contains("did you mean 'pv'?"));
  CHECK_THAT(error_of("{match: FT*, signal: co, loop: F$1, kind: flow}"), Contains("signal: pv"));
  CHECK_THAT(error_of("{match: FT*, signal: pv, loop: F$1, kind: flaw}"),
             Contains("did you mean 'flow'?"));
  CHECK_THAT(error_of("{match: FT*, signal: pv, loop: F$1, manual: [M]}"),
             Contains("signal: mode"));
  CHECK_THAT(error_of("{match: FT*, signal: pv, loop: F$1, range: [5, 5]}"), Contains("range"));
  CHECK_THAT(error_of("{matches: FT*, signal: none}"), Contains("did you mean 'match'?"));
  CHECK_THAT(config::to_text(read_rules_text("r.yaml", "rule: []\n").diagnostics),
             Contains("did you mean 'rules'?"));
  CHECK_FALSE(read_rules_text("r.yaml", "rules: []\n"));
  const auto tag_error = [](const std::string& tag) {
    return config::to_text(read_rules_text("r.yaml", "tags:\n  - " + tag + "\n").diagnostics);
  };
  CHECK(tag_error("{match: \"dcs.*\", show: $1}").empty());
  CHECK_THAT(tag_error("{match: \"dcs.*\", show: $2}"), Contains("one of the 1 of *, ?"));
  CHECK_THAT(tag_error("{match: \"dcs.*\"}"), Contains("show, area and master"));
  CHECK_THAT(tag_error("{match: \"dcs.*\", shown: $1}"), Contains("did you mean 'show'?"));
  CHECK_FALSE(read_rules_text("r.yaml", ""));
}

}  // namespace
}  // namespace loopwarden::tests::rules_file_test
