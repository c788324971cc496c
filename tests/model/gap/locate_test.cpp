// SPDX-License-Identifier: Apache-2.0
#include "model/gap/locate.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <string>

#include "tests/model/gap/gap_support.hpp"

namespace locate_test {

using namespace loopwarden;
using namespace loopwarden::gap;
using namespace loopwarden::test;

namespace {

constexpr std::size_t kSamples = 1000;

struct Case {
  loopwarden::plant::LoopModel model = believed_model();
  std::vector<double> time_s, pv, pv_before, co;
  double rmse = 0.0;
  double noise_floor_rmse = 0.0;
  double controller_rmse = 0.0;
  std::vector<LocatedEffect> effects;

  std::vector<Located> located() const {
    return locate({.model = model,
                   .time_s = time_s,
                   .pv = pv,
                   .pv_before = pv_before,
                   .co = co,
                   .rmse = rmse,
                   .noise_floor_rmse = noise_floor_rmse,
                   .controller_rmse = controller_rmse,
                   .effects = effects});
  }
};

// A case whose model is wrong in PV by `residual`, a function of the time in s.
Case missing(const std::function<double(double)>& residual,
             const std::vector<double>& co = exciting_output(kSamples)) {
  Case r;
  r.co = co;
  double sum = 0.0;
  for (std::size_t k = 0; k < kSamples; ++k) {
    const double time_s = 0.1 * static_cast<double>(k);
    const double by = residual(time_s);
    sum += by * by;
    r.time_s.push_back(time_s);
    r.pv_before.push_back(5.0);
    r.pv.push_back(5.0 + by);
  }
  r.rmse = std::sqrt(sum / kSamples);
  return r;
}

double wobble(double time_s) { return 0.1 * std::sin(7.3 * time_s) * std::cos(0.9 * time_s); }

std::vector<Located> located_by(const std::vector<Located>& all, LocatedBy by) {
  std::vector<Located> list;
  std::copy_if(all.begin(), all.end(), std::back_inserter(list),
               [&](const Located& l) { return l.by == by; });
  return list;
}

double share(const std::vector<Located>& all, const std::string& what) {
  double sum = 0.0;
  for (const Located& l : all) sum += l.what == what ? l.share_of_gap : 0.0;
  return sum;
}

void check_shares(const std::vector<Located>& all) {
  std::map<LocatedBy, double> sums;
  for (const Located& l : all) {
    CAPTURE(l.what);
    CHECK(l.share_of_gap >= 0.0);
    CHECK(l.from_s <= l.to_s);
    CHECK(l.to_s <= 0.1 * kSamples);
    sums[l.by] += l.share_of_gap;
  }
  CHECK(sums.size() == 3);
  for (const auto& [by, sum] : sums) {
    CAPTURE(to_text(by));
    CHECK(sum == Approx(1.0).epsilon(1e-6));
  }
}

}  // namespace

TEST_CASE("a level from one moment on is named, with its moment", "[gap][locate]") {
  Case r = missing([](double t) { return (t >= 40.0 ? 0.5 : 0.0) + 0.1 * wobble(t); });
  std::vector<Located> all = r.located();
  check_shares(all);
  const Located first = located_by(all, LocatedBy::condition).front();
  CHECK(first.what == "from one moment on");
  CHECK(first.from_s == Approx(40.0).margin(0.5));
  CHECK(first.share_of_gap > 0.95);
}

TEST_CASE("a constant, a drift and a sine have separate names", "[gap][locate]") {
  Case r = missing([](double) { return -0.3; });
  std::vector<Located> all = r.located();
  check_shares(all);
  CHECK(located_by(all, LocatedBy::condition).front().what == "all the time, by a constant");

  r = missing([](double t) { return 0.01 * t; });
  all = r.located();
  check_shares(all);
  CHECK(located_by(all, LocatedBy::condition).front().what == "a slow drift");

  r = missing([](double t) { return 0.3 * std::sin(2.0 * std::numbers::pi * t / 9.0); });
  all = r.located();
  check_shares(all);
  CHECK(located_by(all, LocatedBy::condition).front().what == "periodically");
}

TEST_CASE("without a pattern the conditions share the gap", "[gap][locate]") {
  const std::vector<double> co = exciting_output(kSamples);
  const auto [low, high] = std::minmax_element(co.begin(), co.end());
  const double upper = *low + 0.7 * (*high - *low);
  // PV differs if CO was high one dead time before.
  Case r = missing(
      [&](double t) {
        const auto k = static_cast<std::size_t>(std::lround(t / 0.1));
        return k >= 8 && co[k - 8] > upper ? 4.0 * wobble(t) : 0.0;
      },
      co);
  std::vector<Located> all = r.located();
  check_shares(all);
  CHECK(share(all, "at low opening") == 0.0);
  CHECK(share(all, "a slow drift") + share(all, "from one moment on") == 0.0);

  std::vector<double> limited(kSamples, 10.0);
  r = missing(wobble, limited);
  all = r.located();
  check_shares(all);
  CHECK(share(all, "while the controller output stands at a limit") == Approx(1.0));

  r = missing(wobble, std::vector<double>(kSamples, 5.0));
  all = r.located();
  CHECK(share(all, "while the valve should rest") == Approx(1.0));
}

TEST_CASE("an error after a reversal is attributed to the reversal", "[gap][locate]") {
  // A triangle of 40 s. PV differs for 3 s after each reversal and the dead time.
  std::vector<double> co;
  for (std::size_t k = 0; k < kSamples; ++k) {
    const double phase = std::fmod(0.1 * static_cast<double>(k), 40.0) / 20.0;
    co.push_back(3.0 + 4.0 * (phase < 1.0 ? phase : 2.0 - phase));
  }
  Case r = missing(
      [](double t) {
        const double since = std::fmod(t, 20.0);
        return t > 20.0 && since > 1.5 && since < 4.5 ? 3.0 * wobble(t) : 0.0;
      },
      co);
  std::vector<Located> all = r.located();
  check_shares(all);
  CHECK(share(all, "after the controller output reverses") > 0.95);
}

TEST_CASE("a conspicuous stretch is found in time", "[gap][locate]") {
  Case r = missing([](double t) { return wobble(t) * (t >= 25.0 && t < 37.5 ? 5.0 : 0.2); });
  std::vector<Located> all = r.located();
  check_shares(all);
  const Located first = located_by(all, LocatedBy::time).front();
  CHECK(first.what == "a stretch with a large error");
  CHECK(first.from_s == Approx(25.0).margin(4.2));
  CHECK(first.to_s == Approx(37.5).margin(4.2));
  CHECK(first.share_of_gap > 0.9);
}

TEST_CASE("the blocks share the gap by the gain of each effect", "[gap][locate]") {
  Case r = missing(wobble);
  r.effects = {{effects::Block::valve, 3.0}, {effects::Block::transmitter, 1.0}};
  const std::vector<Located> all = r.located();
  check_shares(all);
  for (const Located& l : located_by(all, LocatedBy::block)) {
    CHECK(l.share_of_gap == Approx(l.block == effects::Block::valve ? 0.75 : 0.25));
  }
  for (const Located& l : located_by(all, LocatedBy::condition))
    CHECK(l.block == effects::Block::valve);
}

TEST_CASE("a controller that differs takes its part of the gap", "[gap][locate]") {
  Case r = missing(wobble);
  r.noise_floor_rmse = r.rmse;  // no error is left for the plant
  r.controller_rmse = 0.5;
  const std::vector<Located> all = r.located();
  check_shares(all);
  const std::vector<Located> blocks = located_by(all, LocatedBy::block);
  const auto it = std::find_if(blocks.begin(), blocks.end(), [](const Located& l) {
    return l.block == effects::Block::controller;
  });
  REQUIRE(it != blocks.end());
  CHECK(it->share_of_gap > 0.999);
}

TEST_CASE("missing samples and an exact model do no harm", "[gap][locate]") {
  Case r = missing([](double) { return 0.0; });
  std::vector<Located> all = r.located();
  CHECK(all.empty());
  r = missing(wobble);
  for (std::size_t k = 100; k < 140; ++k) r.pv[k] = kNone;
  all = r.located();
  check_shares(all);
}

TEST_CASE("the remaining error is named after its likely source", "[gap][locate]") {
  const auto left = [](const Case& c, bool is_noise = false) {
    return looks_like(
        {.model = c.model, .pv = c.pv, .pv_after = c.pv_before, .co = c.co, .is_noise = is_noise});
  };
  CHECK(left(missing([](double t) { return t > 55.0 ? 0.4 : 0.0; })) == LooksLike::disturbance);
  CHECK(left(missing([](double) { return 0.3; })) == LooksLike::process);
  CHECK(left(missing([](double) { return 0.0; })) == LooksLike::nothing_known);
  CHECK(left(missing(wobble), true) == LooksLike::disturbance);

  // A triangle of 40 s: an error after each reversal belongs to the valve, a sine all the time
  // doesn't.
  std::vector<double> co;
  for (std::size_t k = 0; k < kSamples; ++k) {
    const double phase = std::fmod(0.1 * static_cast<double>(k), 40.0) / 20.0;
    co.push_back(3.0 + 4.0 * (phase < 1.0 ? phase : 2.0 - phase));
  }
  CHECK(left(missing(
            [](double t) {
              const double since = std::fmod(t, 20.0);
              return t > 20.0 && since > 1.5 && since < 4.5 ? 3.0 * wobble(t) : 0.0;
            },
            co)) == LooksLike::valve);
  CHECK(left(missing([](double t) { return std::sin(2.1 * t); }, co)) == LooksLike::disturbance);
}

}  // namespace locate_test
