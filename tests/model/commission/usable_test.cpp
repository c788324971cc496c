// SPDX-License-Identifier: Apache-2.0
// The gates, each just this and just that side of its limit.
#include "model/commission/usable.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/model/gap/gap_support.hpp"

namespace usable_test {

using namespace loopwarden;

gap::Record noisy(double seconds = 1300.0) {
  return test::record_of(test::believed_model(), seconds);
}

TEST_CASE("a raw record passes every gate", "[commission]") {
  const gap::Record record = noisy();
  CHECK(commission::why_compressed(record).empty());
  CHECK(commission::why_clamped(record, {0.0, 10.0, 0.0, 10.0}).empty());
  CHECK(commission::why_still(record, {0.0, 10.0, 0.0, 10.0}).empty());
  CHECK(commission::why_short(record).empty());
}

TEST_CASE("a swinging door and an exception band are compression, rounding is none",
          "[commission]") {
  gap::Record lines = noisy();
  gap::Record holds = noisy();
  gap::Record rounded = noisy();
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const std::size_t before = k - k % 20;
    const std::size_t behind = std::min(before + 20, lines.size() - 1);
    const double share = static_cast<double>(k - before) / 20.0;
    const gap::Record& raw = rounded;
    lines.pv[k] = (1.0 - share) * raw.pv[before] + share * raw.pv[behind];
    holds.pv[k] = raw.pv[before];
  }
  for (double& v : rounded.pv) v = std::round(v / 0.2) * 0.2;
  CHECK(commission::why_compressed(lines).find("straight line") != std::string::npos);
  CHECK(commission::why_compressed(holds).find("repeat the one before") != std::string::npos);
  CHECK(commission::why_compressed(rounded).empty());
}

TEST_CASE("manual, a clamped output, an SP at rest and a short record are refused",
          "[commission]") {
  gap::Record record = noisy();
  std::vector<double> automatic(record.size(), 1.0);
  CHECK(commission::why_by_hand(automatic).empty());
  CHECK(commission::why_by_hand({}).empty());
  for (std::size_t k = 0; k < record.size() / 4; ++k) automatic[k] = 0.0;
  CHECK(commission::why_by_hand(automatic).find("manual in 25 %") != std::string::npos);

  const commission::Spans spans{0.0, 10.0, 0.0, 10.0};
  gap::Record clamped = record;
  for (std::size_t k = 0; k < record.size() / 5; ++k) clamped.co[k] = 10.0;
  CHECK(!commission::why_clamped(clamped, spans).empty());

  gap::Record still = record;
  still.sp.assign(record.size(), 5.0);
  CHECK(commission::why_still(still, spans).find("SP moves never") != std::string::npos);
  still.sp.back() = 6.0;
  CHECK(commission::why_still(still, spans).find("once only") != std::string::npos);
  still.sp.clear();  // then CO counts
  CHECK(commission::why_still(still, spans).empty());

  CHECK(commission::why_short(noisy(1100.0)).find("18.3 minutes") != std::string::npos);
}

}  // namespace usable_test
