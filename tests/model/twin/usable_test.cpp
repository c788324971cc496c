// SPDX-License-Identifier: Apache-2.0
// Tests each gate just below and just above its limit.
#include "model/twin/usable.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/model/gap/gap_support.hpp"
#include "tests/support/archive.hpp"

namespace usable_test {

using namespace loopwarden;

numeric::LoopRecord noisy(double seconds = 1300.0) {
  return test::record_of(test::believed_model(), seconds);
}

TEST_CASE("a raw record passes every gate", "[commission]") {
  const numeric::LoopRecord record = noisy();
  CHECK(twin::why_compressed(record).empty());
  CHECK(twin::why_clamped(record, {0.0, 10.0, 0.0, 10.0}).empty());
  CHECK(twin::why_still(record, {0.0, 10.0, 0.0, 10.0}).empty());
  CHECK(twin::why_short(record).empty());
}

TEST_CASE("a swinging door and an exception band are compression, rounding is not",
          "[commission]") {
  numeric::LoopRecord lines = noisy();
  numeric::LoopRecord holds = noisy();
  numeric::LoopRecord rounded = noisy();
  numeric::LoopRecord slow = noisy();
  const std::vector<double>& raw = rounded.pv;
  lines.pv = tests::lines_between(raw, tests::by_swinging_door(raw, 0.06));
  holds.pv = tests::held_between(raw, tests::by_exception(raw, 0.08));
  for (std::size_t k = 0; k < raw.size(); ++k) slow.pv[k] = raw[k - k % 20];
  CHECK(twin::why_compressed(lines).find("straight lines") != std::string::npos);
  CHECK(twin::why_compressed(holds).find("the last value is held") != std::string::npos);
  CHECK(twin::why_compressed(slow).find("repeat the previous one") != std::string::npos);
  for (double& v : rounded.pv) v = std::round(v / 0.2) * 0.2;
  CHECK(twin::why_compressed(rounded).empty());
  // An archive that kept most of the samples is usable.
  const numeric::LoopRecord fine = noisy();
  numeric::LoopRecord nearly = fine;
  nearly.pv = tests::lines_between(fine.pv, tests::by_swinging_door(fine.pv, 0.003));
  CHECK(twin::why_compressed(nearly).empty());
}

TEST_CASE("manual, a clamped output, an SP at rest and a short record are refused",
          "[commission]") {
  numeric::LoopRecord record = noisy();
  std::vector<double> automatic(record.size(), 1.0);
  CHECK(twin::why_by_hand(automatic).empty());
  CHECK(twin::why_by_hand({}).empty());
  for (std::size_t k = 0; k < record.size() / 4; ++k) automatic[k] = 0.0;
  CHECK(twin::why_by_hand(automatic).find("manual in 25 %") != std::string::npos);

  const twin::Spans spans{0.0, 10.0, 0.0, 10.0};
  numeric::LoopRecord clamped = record;
  for (std::size_t k = 0; k < record.size() / 5; ++k) clamped.co[k] = 10.0;
  CHECK(!twin::why_clamped(clamped, spans).empty());

  numeric::LoopRecord still = record;
  still.sp.assign(record.size(), 5.0);
  CHECK(twin::why_still(still, spans).find("SP moves never") != std::string::npos);
  still.sp.back() = 6.0;
  CHECK(twin::why_still(still, spans).find("only once") != std::string::npos);
  still.sp.clear();  // then CO counts
  CHECK(twin::why_still(still, spans).empty());

  CHECK(twin::why_short(noisy(1100.0)).find("18.3 minutes") != std::string::npos);
}

}  // namespace usable_test
