// SPDX-License-Identifier: Apache-2.0
#include "lab/gap_study/calibration.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "model/gap/confidence.hpp"
#include "tests/support/temporary_folder.hpp"

namespace calibration_test {

using namespace loopwarden::lab::gap_study;
using loopwarden::lab::Share;
using loopwarden::tests::read_file;

namespace {

const std::string kKept = LOOPWARDEN_SOURCE_DIR "/lab/gap_study/confidence/";

GivenName given(double lead, bool right, bool noise = true) {
  GivenName one;
  one.id = "h1";
  one.truth = one.name = "stiction";
  one.lead_nats = lead;
  one.right = right;
  one.rest.is_noise = noise;
  return one;
}

GivenName controller(bool right) {
  GivenName one = given(std::nan(""), right);
  one.name = "controller_mismatch";
  return one;
}

// `of` names with leads from `from` on, the first `right` of them right.
void add(std::vector<GivenName>& names, double from, int of, int right, bool noise = true) {
  for (int i = 0; i < of; ++i) names.push_back(given(from + 0.1 * i, i < right, noise));
}

}  // namespace

TEST_CASE("shares of right names are those of their lead, in groups", "[hidden_cases]") {
  std::vector<GivenName> names;
  add(names, 50.0, 10, 10);
  add(names, 10.0, 10, 4);
  add(names, 30.0, 10, 8);
  add(names, 5.0, 10, 1, false);
  const Calibration c = calibrate(names);
  REQUIRE(c.rest_is_noise.size() == 3);
  CHECK(c.rest_is_noise[0].from_nats == 0.0);  // the lowest row begins at the least possible lead
  CHECK(c.rest_is_noise[0].share() == Approx(5.0 / 12.0));
  CHECK(c.rest_is_noise[1].from_nats == Approx(30.0));
  CHECK(c.rest_is_noise[1].share() == Approx(9.0 / 12.0));
  CHECK(c.rest_is_noise[2].from_nats == Approx(50.0));
  CHECK(c.rest_is_noise[2].share() == Approx(11.0 / 12.0));
  REQUIRE(c.rest_is_more.size() == 1);
  CHECK(c.rest_is_more[0].right == 1);
}

TEST_CASE("a group with a larger lead never promises less: the two are joined", "[hidden_cases]") {
  std::vector<GivenName> names;
  add(names, 10.0, 10, 9);
  add(names, 30.0, 10, 6);
  add(names, 50.0, 14, 14);
  const Calibration c = calibrate(names);
  REQUIRE(c.rest_is_noise.size() == 2);
  CHECK(c.rest_is_noise[0].names == 20);
  CHECK(c.rest_is_noise[0].right == 15);
  // the remaining ones after whole groups are added to the last
  CHECK(c.rest_is_noise[1].names == 14);
}

TEST_CASE("names of one lead stay in one group", "[hidden_cases]") {
  std::vector<GivenName> names;
  for (int i = 0; i < 15; ++i) names.push_back(given(20.0, i < 5));
  add(names, 21.0, 10, 10);
  const Calibration c = calibrate(names);
  REQUIRE(c.rest_is_noise.size() == 2);
  CHECK(c.rest_is_noise[0].names == 15);
}

TEST_CASE("a controller's settings have a separate row", "[hidden_cases]") {
  const Calibration c = calibrate({controller(true), controller(true), controller(false)});
  CHECK(c.controller.names == 3);
  CHECK(c.controller.right == 2);
  REQUIRE(c.rest_is_noise.size() == 1);
  CHECK(c.rest_is_noise[0].share() == 0.5);  // no information
}

TEST_CASE("names survive their file, and a bad line is named", "[hidden_cases]") {
  GivenName one = given(31.5, true, false);
  one.rest = {false, 1.5, 3.25, 7.0, 0.9};
  const std::string text = names_csv({"a command", "a day"}, {one, controller(false)});
  const NamesFile back = parse_names(text);
  CHECK(back.made_by == std::vector<std::string>{"a command", "a day"});
  REQUIRE(back.names.size() == 2);
  CHECK(names_csv(back.made_by, back.names) == text);
  CHECK(std::isnan(back.names[1].lead_nats));
  const auto complaint = [](const std::string& bad) -> std::string {
    try {
      parse_names(bad);
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return "none";
  };
  CHECK(complaint("") != "none");
  CHECK(complaint("a,b\n").substr(0, 7) == "line 1:");
  CHECK(complaint(text + "h2,x\n").substr(0, 7) == "line 6:");
  CHECK(complaint(text + "h2,x,x,yes,1,1,1,1,1,1\n").find("'yes'") != std::string::npos);
}

TEST_CASE("the table of confidence equals the output of its command for the kept names",
          "[hidden_cases][confidence]") {
  const NamesFile names = parse_names(read_file(kKept + "made_from.csv"));
  CHECK(table_source(names) == read_file(LOOPWARDEN_SOURCE_DIR "/model/gap/confidence_table.cpp"));
  for (const GivenName& one : names.names) CHECK(std::stoul(one.id.substr(1)) < 100000);
}

TEST_CASE("names of other seeds are right as often as predicted", "[hidden_cases][confidence]") {
  const NamesFile check = parse_names(read_file(kKept + "checked_on.csv"));
  REQUIRE(check.names.size() >= 10);
  double promised = 0.0;
  double spread = 0.0;
  double right = 0.0;
  Share confident;
  for (const GivenName& one : check.names) {
    const std::size_t seed = std::stoul(one.id.substr(1));
    CHECK(seed < 100000);
    const double confidence = std::isnan(one.lead_nats)
                                  ? loopwarden::gap::controller_confidence()
                                  : loopwarden::gap::confidence(one.lead_nats, one.rest.is_noise);
    promised += confidence;
    spread += confidence * (1.0 - confidence);
    right += one.right ? 1.0 : 0.0;
    if (confidence >= 0.9) confident.count(one.right);
  }
  CAPTURE(promised, right, check.names.size(), confident.hits, confident.of);
  CHECK(std::abs(right - promised) < 2.0 * std::sqrt(spread) + 1.0);
  // Nine in ten, or no further below than chance allows.
  CHECK(confident.interval().second >= 90.0);
}

}  // namespace calibration_test
