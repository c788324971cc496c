// SPDX-License-Identifier: Apache-2.0
#include "lab/hidden_cases/element.hpp"

#include <catch2/catch.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

namespace element_test {

using namespace loopwarden::hidden_cases;

namespace {

// Moves the input at 0.02 per second until the output has moved by 0.1, more than bristles yield,
// and has stopped again.
constexpr double kSlip = 0.1;
struct Slip {
  double input;
  double jump;
};
Slip ramp_until_slip(Element& element, double& input, double& output, double direction) {
  const double start = output;
  double last = output;
  while (std::abs(output - start) < kSlip || std::abs(output - last) > 1e-7) {
    last = output;
    if (std::abs(output - start) < kSlip) input += direction * 0.02 * kStep_s;
    output = element.step(input, 0.0);
  }
  return {input, output - start};
}

}  // namespace

TEST_CASE("a sticky stem holds, jumps and reverses according to s and j", "[hidden_cases]") {
  const double s = 1.2;
  const double j = 0.4;
  const bool lugre = GENERATE(false, true);
  const Stem stem{0.5 * (s + j), 0.5 * (s - j), lugre ? 0.03 : 0.0, 30.0, 0.1, {}};
  const auto element = lugre ? make_lugre_stem(stem, 80.0) : make_karnopp_stem(stem);
  double input = 3.0;
  double output = element->reset(input);
  // Bristles yield a little before they break loose.
  const double tolerance = lugre ? 0.03 : 0.01;

  const Slip up = ramp_until_slip(*element, input, output, 1.0);
  CHECK(up.input - 3.0 == Approx(0.5 * (s + j)).margin(tolerance));
  CHECK(up.jump == Approx(j).margin(tolerance));
  const double turn = input;
  const Slip down = ramp_until_slip(*element, input, output, -1.0);
  CHECK(turn - down.input == Approx(s).margin(tolerance));
  CHECK(down.jump == Approx(-j).margin(tolerance));
}

TEST_CASE("a stem sticks only while it is gripped", "[hidden_cases]") {
  const auto element = make_karnopp_stem({2.0, 1.0, 0.0, 30.0, 0.1, {{0.0, 1.0}}});
  element->reset(5.0);
  double output = 0.0;
  for (int i = 0; i < 1000; ++i) output = element->step(6.0, 1e-3 * i);
  CHECK(output == 5.0);
  for (int i = 1000; i < 3000; ++i) output = element->step(6.0, 1e-3 * i);
  CHECK(output == Approx(6.0).margin(1e-3));
}

TEST_CASE("play loses its width on a reversal, and only then", "[hidden_cases]") {
  const auto play = make_linkage_play(0.8, 0.02);
  double input = play->reset(5.0);
  double output = input;
  const auto ramp_to = [&](double target) {
    const double step = target > input ? 1e-4 : -1e-4;
    while (std::abs(target - input) > 1e-5) {
      input += step;
      output = play->step(input, 0.0);
    }
  };
  ramp_to(7.0);
  CHECK(output == Approx(6.6).margin(0.005));
  const double high = output;
  ramp_to(6.25);
  CHECK(output == Approx(high).margin(0.005));
  ramp_to(5.0);
  CHECK(output == Approx(5.4).margin(0.005));
}

TEST_CASE("branches of a hysteresis are its width apart at mid travel", "[hidden_cases]") {
  const double width = 0.9;
  const bool stack = GENERATE(false, true);
  const auto element = stack ? make_play_stack({{0.3, 0.5, 0.7}, {0.5, 0.3, 0.2}})
                             : make_bouc_wen({width, 0.7, 1.5, 0.6});
  const double wanted = stack ? 2.0 * (0.3 * 0.5 + 0.5 * 0.3 + 0.7 * 0.2) : width;
  element->reset(5.0);
  double up = 0.0;
  double down = 0.0;
  for (int i = 0; i <= 8000; ++i) {
    const double output = element->step(1.0 + 1e-3 * i, 0.0);
    if (i == 4000) up = output;
  }
  for (int i = 0; i <= 8000; ++i) {
    const double output = element->step(9.0 - 1e-3 * i, 0.0);
    if (i == 4000) down = output;
  }
  CHECK(down - up == Approx(wanted).epsilon(0.02));
}

TEST_CASE("starved air moves at its rate and ends at the supply", "[hidden_cases]") {
  const auto air = make_air_supply({0.2, 0.6, 6.0, 0.5, false});
  air->reset(3.0);
  double output = 0.0;
  for (int i = 0; i < 5000; ++i) output = air->step(9.0, 0.0);
  CHECK(output == Approx(4.0).margin(1e-6));
  for (int i = 0; i < 30000; ++i) output = air->step(9.0, 0.0);
  CHECK(output == Approx(6.0).margin(1e-3));
  for (int i = 0; i < 2000; ++i) output = air->step(1.0, 0.0);
  CHECK(output == Approx(6.0 - 2.0 * 0.6).margin(1e-3));
}

TEST_CASE("an underdamped positioner overshoots by the textbook's share", "[hidden_cases]") {
  const double damping = 0.2;
  const auto positioner = make_positioner(1.0, damping, 0.0);
  positioner->reset(0.0);
  double highest = 0.0;
  for (int i = 0; i < 10000; ++i) highest = std::max(highest, positioner->step(1.0, 0.0));
  const double overshoot =
      std::exp(-std::numbers::pi * damping / std::sqrt(1.0 - damping * damping));
  CHECK(highest == Approx(1.0 + overshoot).epsilon(0.01));
}

TEST_CASE("dead time of plug flow is volume over flow", "[hidden_cases]") {
  const double flow = GENERATE(2.0, 4.0);
  const auto pipe = make_plug_flow(8.0);
  pipe->reset(1.0);
  int steps = 0;
  while (pipe->step(flow, 0.0) < 0.5 * (1.0 + flow)) ++steps;
  CHECK(steps * kStep_s == Approx(8.0 / flow).margin(0.01));
}

TEST_CASE("every element rests at its reset value", "[hidden_cases]") {
  Chain chain;
  chain.push_back(make_lag(0.3));
  chain.push_back(make_positioner(2.0, 0.5, 0.2));
  chain.push_back(make_air_supply({0.3, 0.3, 8.0, 1.0, true}));
  chain.push_back(make_karnopp_stem({0.5, 0.3, 0.01, 30.0, 0.1, {}}));
  chain.push_back(make_linkage_play(0.5, 0.02));
  chain.push_back(make_bouc_wen({0.5, 0.5, 1.0, 0.5}));
  chain.push_back(make_play_stack({{0.2, 0.4}, {0.5, 0.5}}));
  chain.push_back(make_curve([](double u) { return 0.1 * u * u; }));
  chain.push_back(make_dead_time(1.0));
  chain.push_back(make_plug_flow(5.0));
  chain.push_back(make_gain([](double) { return 2.0; }));
  chain.push_back(make_two_way_lag(1.0, 3.0));
  chain.push_back(make_inverse_response(1.0, 3.0, 1.0));
  chain.push_back(make_recycle(0.4, 5.0));
  chain.push_back(make_slow_tail(0.3, 20.0));
  const double rest = reset(chain, 4.0);
  CHECK(rest == Approx(2.0 * 0.1 * 16.0));
  double output = 0.0;
  for (int i = 0; i < 20000; ++i) output = step(chain, 4.0, 1e-3 * i);
  CHECK(output == Approx(rest).epsilon(1e-9));
}

TEST_CASE("an inverse response starts the wrong way and ends at its gain", "[hidden_cases]") {
  const auto element = make_inverse_response(2.0, 3.0, 1.0);
  element->reset(0.0);
  double lowest = 0.0;
  double output = 0.0;
  for (int i = 0; i < 40000; ++i) {
    output = element->step(1.0, 0.0);
    lowest = std::min(lowest, output);
  }
  CHECK(lowest < -0.05);
  CHECK(output == Approx(1.0).margin(1e-3));
}

}  // namespace element_test
