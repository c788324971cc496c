// SPDX-License-Identifier: Apache-2.0
#include "lab/gap_study/score.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "lab/gap_study/study_report.hpp"

namespace score_test {

using namespace loopwarden::lab::gap_study;
using loopwarden::lab::Share;

namespace {

Truth truth(const std::string& effect, std::vector<std::string> accept,
            std::map<std::string, double> parameters = {}, double floor = 0.02) {
  return {"t", effect, std::move(accept), std::move(parameters), "", floor};
}

Answer answer(const std::string& verdict, std::vector<NamedEffect> effects, double before = 0.1,
              double after = 0.05) {
  Answer made;
  made.verdict = verdict;
  made.effects = std::move(effects);
  made.before = before;
  made.after = after;
  made.seconds = 1.0;
  return made;
}

ScoredCase scored(const Truth& one, const Answer& given) {
  return {one, given, score_case(one, given)};
}

const Truth kStiction = truth("stiction", {"stiction"}, {{"s", 1.0}, {"j", 0.5}});
const Truth kHysteresis = truth("hysteresis", {"hysteresis", "backlash"}, {{"width", 0.8}});
const Truth kPair = truth("stiction+gain_change", {"stiction", "gain_change"}, {{"factor", 2.0}});
const Truth kNone = truth("none", {"none"});
const Truth kOutside = truth("outside:slow_tail", {"unexplained"});

}  // namespace

TEST_CASE("a single effect is right if exactly one accepted name is given", "[hidden_cases]") {
  CHECK(score_case(kStiction, answer("missing_effect", {{"stiction", 0.9, {}}})).right);
  CHECK(score_case(kHysteresis, answer("missing_effect", {{"backlash", 0.9, {}}})).right);
  CHECK_FALSE(score_case(kStiction, answer("missing_effect", {{"backlash", 0.9, {}}})).right);
  CHECK_FALSE(score_case(kStiction, answer("no_gap", {})).right);
  CHECK_FALSE(score_case(kStiction, answer("unexplained", {})).right);
  CHECK_FALSE(
      score_case(kStiction, answer("missing_effect", {{"stiction", 0.9, {}}, {"drift", 0.9, {}}}))
          .right);
  CHECK_FALSE(score_case(kHysteresis,
                         answer("missing_effect", {{"hysteresis", 0.9, {}}, {"backlash", 0.9, {}}}))
                  .right);
}

TEST_CASE("a pair is right when both are named and no other", "[hidden_cases]") {
  const NamedEffect s{"stiction", 0.9, {}};
  const NamedEffect g{"gain_change", 0.9, {}};
  const NamedEffect d{"drift", 0.9, {}};
  CHECK(score_case(kPair, answer("missing_effect", {g, s})).right);
  CHECK_FALSE(score_case(kPair, answer("missing_effect", {s})).right);
  CHECK_FALSE(score_case(kPair, answer("missing_effect", {s, s})).right);
  CHECK_FALSE(score_case(kPair, answer("missing_effect", {s, g, d})).right);
  const Truth play = truth("hysteresis+drift", {"hysteresis", "drift"});
  CHECK(score_case(play, answer("missing_effect", {{"backlash", 0.9, {}}, d})).right);
  CHECK_FALSE(score_case(kPair, answer("missing_effect", {{"backlash", 0.9, {}}, g})).right);
}

TEST_CASE("a case without a hidden effect may get no name", "[hidden_cases]") {
  CHECK(score_case(kNone, answer("no_gap", {})).right);
  CHECK(score_case(kNone, answer("unexplained", {})).right);
  CHECK_FALSE(score_case(kNone, answer("missing_effect", {{"drift", 0.5, {}}})).right);
}

TEST_CASE(
    "outside the catalogue 'unexplained' is right, or its present name, if the gap is sizeable",
    "[hidden_cases]") {
  CHECK(score_case(kOutside, answer("unexplained", {})).right);
  CHECK_FALSE(score_case(kOutside, answer("no_gap", {})).right);
  CHECK_FALSE(score_case(kOutside, answer("missing_effect", {{"drift", 0.5, {}}})).right);
  const Truth known_now = truth("outside:inverse_response", {"unexplained", "inverse_response"});
  CHECK(score_case(known_now, answer("unexplained", {})).right);
  CHECK(score_case(known_now, answer("missing_effect", {{"inverse_response", 0.9, {}}})).right);
  CHECK_FALSE(score_case(known_now, answer("missing_effect", {{"extra_lag", 0.9, {}}})).right);
  CHECK_FALSE(score_case(known_now, answer("missing_effect",
                                           {{"inverse_response", 0.9, {}}, {"drift", 0.9, {}}}))
                  .right);
  CHECK(score_case(kOutside, answer("no_gap", {}, 0.031)).counts);
  CHECK_FALSE(score_case(kOutside, answer("no_gap", {}, 0.029)).counts);
}

TEST_CASE("the closed gap is of squares, over the floor", "[hidden_cases]") {
  const Answer half = answer("missing_effect", {{"stiction", 0.9, {}}}, 0.1, 0.05);
  const auto closed = score_case(kStiction, half).closed;
  REQUIRE(closed);
  CHECK(*closed == Approx((0.01 - 0.0025) / (0.01 - 0.0004)));
  CHECK(score_case(kPair, half).closed);
  CHECK_FALSE(score_case(kStiction, answer("no_gap", {}, 0.039)).closed);
  CHECK_FALSE(score_case(kNone, half).closed);
  CHECK_FALSE(score_case(kOutside, half).closed);
  const Truth controller = truth("controller_mismatch", {"controller_mismatch"});
  CHECK_FALSE(score_case(controller, half).closed);
}

TEST_CASE("parameters count for right names only", "[hidden_cases]") {
  const std::map<std::string, double> found{{"s", 1.1}, {"j", 0.25}, {"lag", 3.0}};
  const auto right = score_case(kStiction, answer("missing_effect", {{"stiction", 0.9, found}}));
  REQUIRE(right.parameter_errors.size() == 2);
  CHECK(right.parameter_errors[0] == Approx(0.5));
  CHECK(right.parameter_errors[1] == Approx(0.1));
  CHECK(score_case(kStiction, answer("missing_effect", {{"cam_obstruction", 0.9, found}}))
            .parameter_errors.empty());
  const auto play =
      score_case(kHysteresis, answer("missing_effect", {{"backlash", 0.9, {{"deadband", 0.6}}}}));
  REQUIRE(play.parameter_errors.size() == 1);
  CHECK(play.parameter_errors[0] == Approx(0.25));
}

TEST_CASE("the summary counts every line of the table", "[hidden_cases]") {
  Answer broken;
  broken.failure = "time limit";
  broken.seconds = 120.0;
  const std::vector<ScoredCase> cases{
      scored(kStiction, answer("missing_effect", {{"stiction", 0.95, {}}})),
      scored(kStiction, answer("missing_effect", {{"stiction", 0.5, {}}})),
      scored(kStiction, answer("missing_effect", {{"drift", 0.95, {}}}, 0.1, 0.09)),
      scored(kStiction, broken),
      scored(kPair, answer("missing_effect", {{"stiction", 0.9, {}}})),
      scored(kNone, answer("no_gap", {})),
      scored(kNone, answer("missing_effect", {{"drift", 0.4, {}}})),
      scored(kNone, broken),
      scored(kOutside, answer("unexplained", {})),
      scored(kOutside, answer("missing_effect", {{"drift", 0.91, {}}})),
      scored(kOutside, answer("no_gap", {}, 0.02)),
      scored(kOutside, broken)};
  const Summary summary = summarise(cases);
  CHECK(summary.cases == 12);
  CHECK(summary.failures == 3);
  CHECK(summary.single_right.hits == 2);
  CHECK(summary.single_right.of == 4);
  CHECK(summary.none_named.hits == 1);
  CHECK(summary.none_named.of == 3);
  CHECK(summary.pair_right.hits == 0);
  CHECK(summary.pair_right.of == 1);
  // Confident: stiction, drift (wrong), the pair's stiction, drift outside (wrong).
  CHECK(summary.confident_right.hits == 2);
  CHECK(summary.confident_right.of == 4);
  CHECK(summary.right_confident.hits == 2);
  CHECK(summary.right_confident.of == 3);
  CHECK(summary.outside_unexplained.hits == 1);
  CHECK(summary.outside_unexplained.of == 3);
  CHECK(summary.closed.size() == 4);
  CHECK(quantile(summary.seconds, 1.0) == 120.0);
  CHECK(summary.confusion.at("stiction").at("failed") == 1);
  CHECK(summary.confusion.at("none").at("drift") == 1);
}

TEST_CASE("Wilson's interval", "[hidden_cases]") {
  // Newcombe 1998, table of examples: 81 of 263, 15 of 148, 0 of 20.
  const auto check = [](Share share, double low, double high) {
    const auto [found_low, found_high] = share.interval();
    CHECK(found_low == Approx(low).margin(0.01));
    CHECK(found_high == Approx(high).margin(0.01));
  };
  check({81, 263}, 25.53, 36.62);
  check({15, 148}, 6.24, 16.05);
  check({0, 20}, 0.0, 16.11);
}

TEST_CASE("quantiles lie between order statistics", "[hidden_cases]") {
  CHECK(quantile({3.0, 1.0, 2.0}, 0.5) == 2.0);
  CHECK(quantile({0.0, 10.0}, 0.1) == Approx(1.0));
  CHECK_THROWS_AS(quantile({}, 0.5), std::invalid_argument);
}

TEST_CASE("gap.json and truth.json are read, or refused with a reason", "[hidden_cases]") {
  const Answer read = parse_answer(R"({"verdict": "missing_effect",
    "effects": [{"name": "valve_characteristic", "block": "valve", "confidence": 0.8,
                 "parameters": {"curve": {"name": "equal_percentage"}, "x": 2}}],
    "gap": {"before": {"rmse": 1, "holdout_rmse": 0.5}, "after": {"rmse": 1, "holdout_rmse": null}},
    "candidates": [{"name": "drift", "rmse": 0.3, "why_not": ""}]})");
  CHECK(label_of(read) == "valve_characteristic");
  CHECK(read.effects[0].parameters == std::map<std::string, double>{{"x", 2.0}});
  CHECK(read.before == 0.5);
  CHECK_FALSE(read.after.has_value());
  CHECK(read.candidates.at(0).second == 0.3);
  CHECK_THROWS_AS(parse_answer("{"), std::runtime_error);
  CHECK_THROWS_AS(parse_answer(R"({"verdict": "no_gap"})"), std::runtime_error);
  CHECK_THROWS_AS(parse_truth(R"([{"id": "a"}])"), std::runtime_error);
  CHECK(kind_of(parse_truth(R"([{"id": "a", "effect": "none", "accept": ["none"], )"
                            R"("par": {}, "floor_rmse": 0.1}])")
                    .at(0)) == Kind::kNone);
}

TEST_CASE("the table names figures, aims and failures; the list names misses", "[hidden_cases]") {
  StudyPart part;
  part.name = "load";
  part.load = true;
  part.cases = {scored(kStiction, answer("missing_effect", {{"stiction", 0.95, {}}})),
                scored(kStiction, answer("missing_effect", {{"drift", 0.95, {}}}))};
  const std::string table = table_text({part});
  CHECK(table.find("load: 2 cases") != std::string::npos);
  CHECK(table.find("50.0 %  1/2  [9.5, 90.5]") != std::string::npos);
  CHECK(table.find("(>= 92)") != std::string::npos);
  CHECK(table.find("(>= 97)") == std::string::npos);
  CHECK(list_text(part).find("MISS stiction") != std::string::npos);
  CHECK(confusion_text(part).find("1 drift  1 stiction") != std::string::npos);
  CHECK(study_json({part}).find("\"single_right\"") != std::string::npos);
}

}  // namespace score_test
