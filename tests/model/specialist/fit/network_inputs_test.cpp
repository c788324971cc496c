// SPDX-License-Identifier: Apache-2.0
#include "model/specialist/fit/network_inputs.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <string_view>

#include "model/specialist/train/team_training.hpp"
#include "tests/model/specialist/judge/specialist_support.hpp"

namespace network_inputs_test {

using namespace loopwarden;
using namespace loopwarden::specialist;

TEST_CASE("no input of the networks is dead", "[specialist]") {
  const std::vector<Example> examples =
      simulate_examples(tests::flow_loop(), 64, 11, tests::one_thread());
  for (std::size_t i = 0; i < kNetworkInputs; ++i) {
    double low = examples.front().inputs[i];
    double high = low;
    for (const Example& e : examples) {
      CHECK(std::isfinite(e.inputs[i]));
      low = std::min(low, e.inputs[i]);
      high = std::max(high, e.inputs[i]);
    }
    INFO(input_name(i) << ": " << low << " to " << high);
    CHECK(high - low > 0.1);
  }
}

TEST_CASE("an input is found by its name", "[specialist]") {
  std::map<std::string_view, double> named;
  for (std::size_t i = 0; i < kNetworkInputs; ++i) named[input_name(i)] = 0.0;
  CHECK(named.size() == kNetworkInputs);
  WindowFits f = tests::plain_fits();
  f.reversals = 6.0;
  FaultFit& stiction = f.fits[static_cast<std::size_t>(FaultModel::stiction)];
  stiction.mse = 0.01;
  stiction.shape = 0.25;
  const NetworkInputs inputs = network_inputs_of(f);
  for (std::size_t i = 0; i < kNetworkInputs; ++i) named[input_name(i)] = inputs[i];
  CHECK(named.at("stiction_misfit") == Approx(0.0).margin(1e-6));
  CHECK(named.at("backlash_misfit") == Approx(std::log(2.0)));
  CHECK(named.at("stiction_over_backlash") == Approx(-2.0 * std::log(2.0)));
  CHECK(named.at("stiction_jump") == Approx(1.0));
  CHECK(named.at("co_range_over_noise") == Approx(std::log(100.0)));
  CHECK(named.at("co_reversals") == Approx(std::log(7.0)));
}

}  // namespace network_inputs_test
