// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <limits>

#include "model/diagnosis/preparation.hpp"
#include "tests/model/diagnosis/signals.hpp"

namespace loopwarden::tests::preparation_test {
namespace {

using namespace diagnosis;

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

Series pv_of(std::size_t n) {
  return made_of(n, [](double k) { return 50.0 + sine(k / 50.0); });
}
Series co_of(std::size_t n) {
  return made_of(n, [](double k) { return 40.0 + 3.0 * sine(k / 50.0 + 0.4); });
}

TEST_CASE("a record that can't be judged is refused with the reason") {
  const Series pv = pv_of(400);
  const Series co = co_of(400);
  CHECK(prepare({.period_s = 1.0, .pv = pv, .co = co}).refusal.empty());
  CHECK(
      prepare({.period_s = 1.0, .pv = pv_of(60), .co = co_of(60)}).refusal.find("fewer than 100") !=
      std::string::npos);
  const Series still(400, 12.0);
  CHECK(prepare({.period_s = 1.0, .pv = pv, .co = still}).refusal.find("does not move") !=
        std::string::npos);
  CHECK(prepare({.period_s = 1.0, .pv = still, .co = co}).refusal.find("PV is frozen") == 0);
  CHECK(prepare({.period_s = 1.0, .pv = still, .co = co}).gate == Gate::sensor);
  CHECK_FALSE(prepare({.period_s = 1.0, .pv = pv, .co = co_of(300)}).refusal.empty());
  const Series nothing(400, kMissing);
  CHECK_FALSE(prepare({.period_s = 1.0, .pv = nothing, .co = co}).refusal.empty());
  CHECK_FALSE(prepare({}).refusal.empty());
}

TEST_CASE("short gaps are filled; a record with a long gap is cut to its longest part") {
  Series pv = pv_of(600);
  const Series co = co_of(600);
  pv[100] = kMissing;
  for (std::size_t k = 200; k < 230; ++k) pv[k] = kMissing;
  const Prepared p = prepare({.period_s = 1.0, .pv = pv, .co = co});
  CHECK(p.from == 230);
  CHECK(p.used == 370);
  pv = pv_of(600);
  pv[300] = kMissing;
  CHECK(prepare({.period_s = 1.0, .pv = pv, .co = co}).pv[300] ==
        Approx(pv_of(600)[300]).margin(0.02));
}

TEST_CASE("a set point that moves is no reason to cut, a stretch in manual is") {
  Series pv = pv_of(1000);
  Series sp(1000, 50.0);
  for (std::size_t k = 300; k < 1000; ++k) {
    sp[k] = 60.0;
    pv[k] += 10.0;
  }
  Series co = co_of(1000);
  CHECK(prepare({.period_s = 1.0, .pv = pv, .sp = sp, .co = co}).used == 1000);
  for (std::size_t k = 600; k < 1000; ++k) co[k] = 41.0;
  const Prepared p = prepare({.period_s = 1.0, .pv = pv, .sp = sp, .co = co});
  CHECK(p.from == 0);
  CHECK(p.used == 600);
}

TEST_CASE("the series don't depend on units, and hardly on the sample time") {
  const Series pv = pv_of(2000);
  const Series co = co_of(2000);
  Series scaled = pv;
  for (double& v : scaled) v = 1e4 * v - 7.0;
  const Prepared a = prepare({.period_s = 1.0, .pv = pv, .co = co});
  const Prepared b = prepare({.period_s = 3.0, .pv = scaled, .co = co});
  CHECK(b.period == Approx(a.period));
  CHECK(b.period_s == Approx(3.0 * a.period_s));
  CHECK(b.error[77] == Approx(a.error[77]).margin(1e-6));
  // Sampled eight times as fast: averaged to the same number of samples per period.
  const Series fast_pv = made_of(8000, [](double k) { return 50.0 + sine(k / 400.0); });
  const Series fast_co = made_of(8000, [](double k) { return 40.0 + 3.0 * sine(k / 400.0 + 0.4); });
  const Prepared c = prepare({.period_s = 1.0, .pv = fast_pv, .co = fast_co});
  CHECK(c.factor >= 8);
  CHECK(c.period <= 50.0);
}

}  // namespace
}  // namespace loopwarden::tests::preparation_test
