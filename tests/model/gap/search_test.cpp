// SPDX-License-Identifier: Apache-2.0
// Tests only the search, with few candidates that are quick to fit.
#include "model/gap/search.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <set>
#include <string>
#include <vector>

#include "tests/model/gap/gap_support.hpp"

namespace search_test {

using namespace loopwarden;
using namespace loopwarden::gap;

namespace {

constexpr std::size_t kSamples = 900;

struct Found {
  std::set<std::string> names;
  SearchResult search;
};

// Searches among the named candidates, with the PV of `truth` plus noise.
Found search_for(const plant::LoopModel& truth, const std::set<std::string>& among,
                 const SearchOptions& options = {}, double least_rms = 0.015,
                 double noise_rms = 0.015) {
  const plant::LoopModel believed = test::believed_model();
  const std::vector<double> co = test::exciting_output(kSamples);
  std::vector<double> pv = test::driven(truth, co);
  numeric::Random random(5);
  for (double& v : pv) v += 0.015 * random.normal();
  static std::vector<Candidate> searched;  // the result has pointers into it
  searched = test::candidates_for(believed, co);
  std::erase_if(searched, [&](const Candidate& c) { return among.count(c.name) == 0; });
  const FreeRun run(believed, co);
  const Fitter fitter(run, pv, std::vector<bool>(kSamples, true),
                      {.load = options.load ? 0.3 : 0.0}, true);
  Found found;
  found.search = search_effects(fitter, searched, {noise_rms, least_rms}, options, test::serial,
                                [](double) {});
  for (const Candidate* term : found.search.chosen.fit.terms) found.names.insert(term->name);
  return found;
}

const std::set<std::string> kQuick{"gain_change", "output_bias", "drift", "step_disturbance"};

}  // namespace

TEST_CASE("no effect is chosen if the model is right", "[gap][search]") {
  const Found found = search_for(test::believed_model(), kQuick);
  CHECK(found.names.empty());
  CHECK(found.search.path.empty());
  CHECK(found.search.singles.size() == kQuick.size());
}

TEST_CASE("one effect is chosen as the only one", "[gap][search]") {
  plant::LoopModel truth = test::believed_model();
  truth.process.gain *= 0.75;
  const Found found = search_for(truth, kQuick);
  CHECK(found.names == std::set<std::string>{"gain_change"});
  CHECK(found.search.path == std::vector<std::vector<std::string>>{{"gain_change"}});
  CHECK(found.search.singles.front().fit.terms[0]->name == std::string("gain_change"));
}

TEST_CASE("two effects are both chosen, but only if several are allowed", "[gap][search]") {
  plant::LoopModel truth = test::believed_model();
  truth.process.gain *= 0.75;
  truth.transmitter_effects = {{"drift", {{"rate", 0.02}}}};
  CHECK(search_for(truth, kQuick, {.load = false}).names ==
        std::set<std::string>{"gain_change", "drift"});
  CHECK(search_for(truth, kQuick, {.several = false, .load = false}).names.size() == 1);
}

TEST_CASE("a wrong first name is withdrawn", "[gap][search]") {
  // One early and one late step look most like a drift, until both are found.
  plant::LoopModel truth = test::believed_model();
  truth.process.gain *= 1.12;
  truth.disturbances = {{"step_disturbance", {{"size", 0.9}, {"time", 45.0}}}};
  const Found found = search_for(truth, {"drift", "step_disturbance", "gain_change"});
  CHECK(found.names == std::set<std::string>{"gain_change", "step_disturbance"});
}

TEST_CASE("an effect too small to matter is not chosen, however clear", "[gap][search]") {
  plant::LoopModel truth = test::believed_model();
  truth.transmitter_effects = {{"output_bias", {{"bias", 0.3}}}};
  const auto chosen = [&](double least_rms) {
    return search_for(truth, {"output_bias"}, {.load = false}, least_rms).names;
  };
  CHECK(chosen(0.1) == std::set<std::string>{"output_bias"});
  CHECK(chosen(0.5).empty());
}

TEST_CASE("no second effect is searched if the remaining error is too small", "[gap][search]") {
  plant::LoopModel truth = test::believed_model();
  truth.process.gain *= 0.75;
  const auto tried = [&](double noise_rms) {
    return search_for(truth, kQuick, {}, 0.005, noise_rms).search.tried.size();
  };
  CHECK(tried(0.015) == kQuick.size());
  CHECK(tried(0.005) > kQuick.size());
}

TEST_CASE("a starved actuator that never reaches its rate limit is a lag", "[gap][search]") {
  plant::LoopModel truth = test::believed_model();
  truth.process_effects = {{"extra_lag", {{"time_constant", 1.5}}}};
  const Found found = search_for(truth, {"low_air_supply"});
  CHECK(found.names.empty());
  truth.process_effects.clear();
  truth.valve_effects = {{"low_air_supply", {{"rate", 0.35}, {"travel_limit", 6.5}, {"lag", 0.4}}}};
  CHECK(search_for(truth, {"low_air_supply", "extra_lag"}).names ==
        std::set<std::string>{"low_air_supply"});
}

}  // namespace search_test
