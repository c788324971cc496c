// SPDX-License-Identifier: Apache-2.0
// The effects of a simulated valve and the rows of stems that specialists try on a window use the
// same equation. On the same CO they take the same path.
#include "model/numeric/lanes.hpp"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "model/effects/backlash/backlash.hpp"
#include "model/effects/hysteresis/hysteresis_width.hpp"
#include "model/effects/low_air_supply/low_air_supply.hpp"
#include "model/effects/stiction/stiction_choudhury.hpp"
#include "model/effects/stiction/stiction_he.hpp"
#include "tests/support/property.hpp"

namespace lanes_test {

using namespace loopwarden;
using namespace loopwarden::effects;
using namespace loopwarden::tests;
using numeric::kLanes;
using numeric::Lanes;

namespace {

// A float holds multiples of 1/256 of a percent below 128 %, and their sums and differences,
// exactly. So a row and a number agree to the last bit if the equation only adds, compares and
// halves.
constexpr double kGrain = 1.0 / 256.0;

double grains(double low, double high) {
  return kGrain * static_cast<double>(property::integer(static_cast<std::int64_t>(low / kGrain),
                                                        static_cast<std::int64_t>(high / kGrain)));
}

// CO in %: steps, ramps and rests of random length.
std::vector<double> random_co() {
  std::vector<double> co;
  double u = grains(0.0, 100.0);
  while (co.size() < 200) {
    const double to = grains(0.0, 100.0);
    const auto samples = static_cast<std::size_t>(property::integer(1, 30));
    switch (property::one_of(3)) {
      case 0: co.insert(co.end(), samples, u); break;
      case 1: co.insert(co.end(), samples, u = to); break;
      default:
        for (std::size_t k = 0; k < samples; ++k) {
          co.push_back(u = std::clamp(u + (to > u ? 1.0 : -1.0) * grains(0.0, 2.0), 0.0, 100.0));
        }
    }
  }
  return co;
}

// `effect(lane)` is the effect of a simulated valve, `row` the same for all lanes; both begin at
// rest on the first CO.
template <class MakeEffect, class Row>
void same_path(const std::vector<double>& co, MakeEffect effect, Row row, double tolerance) {
  std::array<decltype(effect(0)), kLanes> effects{effect(0), effect(1), effect(2), effect(3)};
  for (auto& e : effects) e.reset(co.front());
  for (const double u : co) {
    const Lanes x = row.step(numeric::every<Lanes>(u));
    for (std::size_t i = 0; i < kLanes; ++i) {
      const double expected = effects[i].step(u);
      property::require(std::abs(static_cast<double>(x[i]) - expected) <= tolerance,
                        "row and effect part");
    }
  }
}

using Values = std::array<double, kLanes>;
Values four(double low, double high) {
  Values values{};
  for (double& v : values) v = grains(low, high);
  return values;
}
template <class Of>
Lanes row_of(Of of) {
  Lanes row{};
  for (std::size_t i = 0; i < kLanes; ++i) row[i] = static_cast<float>(of(i));
  return row;
}

}  // namespace

TEST_CASE("a row of plays takes the path of backlash", "[plant][lanes]") {
  property::for_all("play", 200, [] {
    const auto co = random_co();
    const Values width = four(0.0, 30.0);
    same_path(
        co, [&](std::size_t i) { return Backlash(width[i]); },
        PlayLaw<Lanes>{row_of([&](std::size_t i) { return width[i] / 2.0; }),
                       numeric::every<Lanes>(co.front())},
        0.0);
  });
}

TEST_CASE("a row of distributed plays takes the path of hysteresis", "[plant][lanes]") {
  property::for_all("plays", 100, [] {
    const auto co = random_co();
    const Values width = four(0.0, 30.0);
    const Values knee = four(-2.0, 1.0);
    PlaysLaw<Lanes, 12> row{};
    for (std::size_t k = 0; k < 12; ++k) {
      row.plays[k] = {
          row_of([&](std::size_t i) { return half_deadbands<12>(width[i], knee[i])[k]; }),
          numeric::every<Lanes>(co.front())};
    }
    same_path(
        co, [&](std::size_t i) { return HysteresisWidth(width[i], knee[i]); }, row, 1e-4);
  });
}

TEST_CASE("a row of sticking stems takes the path of stiction", "[plant][lanes]") {
  property::for_all("stiction", 200, [] {
    const auto co = random_co();
    const Values s = four(0.0, 20.0);
    Values j{};
    for (std::size_t i = 0; i < kLanes; ++i) j[i] = grains(0.0, s[i]);
    const auto parameters = [&](std::size_t i) { return StictionParameters{s[i], j[i]}; };
    const Lanes hold = row_of([&](std::size_t i) { return parameters(i).static_friction(); });
    const Lanes drag = row_of([&](std::size_t i) { return parameters(i).moving_friction(); });
    const auto start = numeric::every<Lanes>(co.front());
    same_path(
        co, [&](std::size_t i) { return StictionHe(parameters(i)); },
        HeLaw<Lanes>{hold, drag, start}, 0.0);
    same_path(
        co, [&](std::size_t i) { return StictionChoudhury(parameters(i)); },
        ChoudhuryLaw<Lanes>{hold, drag, start, start, Lanes{}}, 0.0);
  });
}

TEST_CASE("a row of stems short of air takes the path of low air supply", "[plant][lanes]") {
  property::for_all("low air", 200, [] {
    const auto co = random_co();
    const Values rate = four(0.05, 20.0);
    const Values limit = four(20.0, 110.0);
    const Values lag = four(0.0, 8.0);
    const bool one_sided = property::coin();
    const double period_s = property::coin() ? 0.1 : 1.0;
    const auto start = row_of([&](std::size_t i) { return std::min(co.front(), limit[i]); });
    same_path(
        co,
        [&](std::size_t i) {
          return LowAirSupply({.rate = rate[i],
                               .travel_limit = limit[i],
                               .lag_s = lag[i],
                               .filling = one_sided ? LowAirSupply::Filling::one_sided
                                                    : LowAirSupply::Filling::both_ways},
                              period_s);
        },
        LowAirLaw<Lanes>({.limit = row_of([&](std::size_t i) { return limit[i]; }),
                          .share = numeric::every<Lanes>(1.0),
                          .rate = row_of([&](std::size_t i) { return rate[i]; }),
                          .lag_s = row_of([&](std::size_t i) { return lag[i]; }),
                          .one_sided = one_sided},
                         period_s, start),
        2e-3);
  });
}

TEST_CASE("lanes choose, bound and raise each for itself", "[plant][lanes]") {
  const Lanes x{-3.0F, 0.5F, 2.0F, 9.0F};
  const Lanes kept = numeric::within(x, numeric::every<Lanes>(0.0), numeric::every<Lanes>(2.5));
  const Lanes size = numeric::magnitude(x);
  const Lanes raised = numeric::exponential(x, x < numeric::every<Lanes>(1.0));
  const std::array expected{0.0F, 0.5F, 2.0F, 2.5F};
  for (std::size_t i = 0; i < kLanes; ++i) {
    CHECK(kept[i] == expected[i]);
    CHECK(size[i] == std::abs(x[i]));
  }
  CHECK(raised[0] == std::exp(-3.0F));
  CHECK(raised[1] == std::exp(0.5F));
  CHECK(numeric::any(x > numeric::every<Lanes>(8.0)));
  CHECK_FALSE(numeric::any(x > numeric::every<Lanes>(9.0)));
  CHECK(std::isnan(numeric::within(std::nan(""), 0.0, 1.0)));
  CHECK(numeric::within(5.0, std::nan(""), std::nan("")) == 5.0);
}

}  // namespace lanes_test
