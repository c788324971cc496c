// SPDX-License-Identifier: Apache-2.0
#include "model/gap/record_check.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "tests/model/gap/gap_support.hpp"

namespace record_check_test {

using namespace loopwarden;

namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

bool noted(const gap::RecordCheck& check, const std::string& what) {
  return std::any_of(check.notes.begin(), check.notes.end(),
                     [&](const gap::RecordNote& note) { return note.what == what; });
}

}  // namespace

TEST_CASE("a sound record is accepted without remarks", "[gap][record]") {
  const plant::LoopModel model = test::believed_model();
  const gap::RecordCheck check = gap::check_record(test::record_of(model, 120.0), model);
  CHECK(check.usable);
  CHECK(check.notes.empty());
  CHECK(check.noise_rms == Approx(0.015).epsilon(0.15));
  CHECK(check.co_resolution == Approx(10.0 / 4096.0).epsilon(0.01));
  CHECK(check.output_reversals >= 3);
}

TEST_CASE("implausible records are refused, with the reason", "[gap][record]") {
  const plant::LoopModel model = test::believed_model();
  numeric::LoopRecord record = test::record_of(model, 60.0);
  std::string reason;
  SECTION("short") {
    record.pv.resize(150);
    reason = "150 samples";
  }
  SECTION("another period") {
    record.period_s = 0.2;
    reason = "sampled every 0.2 s";
  }
  SECTION("PV missing") {
    for (std::size_t k = 100; k < 300; ++k) record.pv[k] = kMissing;
    reason = "of PV is missing";
  }
  SECTION("CO missing") {
    for (std::size_t k = 100; k < 200; ++k) record.co[k] = kMissing;
    reason = "of CO is missing";
  }
  SECTION("frozen PV") {
    std::fill(record.pv.begin(), record.pv.end(), 4.0);
    reason = "PV never moves";
  }
  SECTION("PV that changes only now and then") {
    for (std::size_t k = 0; k < record.size(); ++k) record.pv[k] = k == 77 ? 4.1 : 4.0;
    reason = "PV hardly ever moves";
  }
  SECTION("too little of the first two thirds is left") {
    for (std::size_t k = 0; k < record.size(); k += 80) {
      record.co[k] = record.co[k + 1] = kMissing;
    }
    reason = "can be used";
  }
  SECTION("PV in other units") {
    for (double& v : record.pv) v *= 100.0;
    record = gap::believed(record, model);
    reason = "far outside the transmitter's range";
  }
  SECTION("CO in other units") {
    for (double& u : record.co) u *= 10.0;
    reason = "outside the model's output range";
  }
  const gap::RecordCheck check = gap::check_record(record, model);
  CHECK_FALSE(check.usable);
  INFO(check.refusal);
  CHECK(check.refusal.find(reason) != std::string::npos);
}

TEST_CASE("values that no transmitter can have sent count as missing", "[gap][record]") {
  const plant::LoopModel model = test::believed_model();
  numeric::LoopRecord record = test::record_of(model, 60.0);
  record.pv[10] = 1e300;
  record.pv[20] = -11.0;
  record.pv[30] = 19.0;  // a span above the range is still accepted
  const numeric::LoopRecord taken = gap::believed(record, model);
  CHECK(std::isnan(taken.pv[10]));
  CHECK(std::isnan(taken.pv[20]));
  CHECK(taken.pv[30] == 19.0);
  CHECK(noted(gap::check_record(taken, model), "missing"));
}

TEST_CASE("two hundred samples are enough, and five moves of PV", "[gap][record]") {
  const plant::LoopModel model = test::believed_model();
  numeric::LoopRecord record = test::record_of(model, 21.0);
  CHECK(gap::check_record(record, model).usable);
  for (std::size_t k = 0; k < record.size(); ++k) {
    record.pv[k] = 4.0 + 0.1 * static_cast<double>(k * 7 / record.size());  // six moves
  }
  CHECK_THAT(gap::check_record(record, model).refusal, !Catch::Contains("hardly ever"));
}

TEST_CASE("CO that moves by less than a percent of its span is remarked on", "[gap][record]") {
  const plant::LoopModel model = test::believed_model();
  const auto remarked = [&](double span) {
    numeric::LoopRecord record = test::record_of(model, 60.0);
    const auto [low, high] = std::minmax_element(record.co.begin(), record.co.end());
    const double middle = (*low + *high) / 2.0;
    const double by = span / (*high - *low);
    for (double& u : record.co) u = middle + by * (u - middle);
    return noted(gap::check_record(record, model), "little movement");
  };
  CHECK(remarked(0.07));
  CHECK_FALSE(remarked(0.14));
}

TEST_CASE("faults that don't prevent the work are stated", "[gap][record]") {
  const plant::LoopModel model = test::believed_model();
  numeric::LoopRecord record = test::record_of(model, 60.0);
  SECTION("some PV missing") {
    record.pv[50] = kMissing;
    const gap::RecordCheck check = gap::check_record(record, model);
    CHECK(check.usable);
    CHECK(noted(check, "missing"));
    CHECK_FALSE(gap::usable_samples(record, model)[50]);
  }
  SECTION("a frozen stretch") {
    for (std::size_t k = 200; k < 320; ++k) record.pv[k] = record.pv[200];
    CHECK(noted(gap::check_record(record, model), "frozen"));
  }
  SECTION("CO at a limit") {
    for (std::size_t k = 200; k < 260; ++k) record.co[k] = 10.0;
    CHECK(noted(gap::check_record(record, model), "saturated"));
  }
  SECTION("PV at the end of the transmitter's range") {
    for (std::size_t k = 200; k < 220; ++k) record.pv[k] = 10.0;
    CHECK(noted(gap::check_record(record, model), "saturated"));
  }
  SECTION("some CO missing") {
    record.co[50] = kMissing;
    const gap::RecordCheck check = gap::check_record(record, model);
    CHECK(check.usable);
    CHECK(noted(check, "missing"));
    // One sample is bridged by the previous value.
    CHECK(gap::usable_samples(record, model) == std::vector<bool>(record.size(), true));
  }
  SECTION("CO was not measured at all") {
    record.co.clear();
    const gap::RecordCheck check = gap::check_record(record, model);
    CHECK(check.usable);
    CHECK(check.notes.empty());
  }
  SECTION("hardly any movement") {
    for (double& u : record.co) u = 5.0 + 0.001 * u;
    CHECK(noted(gap::check_record(record, model), "little movement"));
  }
  SECTION("a gap in CO makes the following PV unusable") {
    for (std::size_t k = 200; k < 205; ++k) record.co[k] = kMissing;
    const std::vector<bool> used = gap::usable_samples(record, model);
    CHECK(used[199]);
    CHECK_FALSE(used[210]);
    CHECK_FALSE(used[280]);
    CHECK(used[330]);
  }
}

TEST_CASE("a gap is closed by the value before it, at the start by the first value",
          "[gap][record]") {
  CHECK(gap::held({kMissing, kMissing, 2.0, kMissing, 3.0, kMissing}) ==
        std::vector<double>{2.0, 2.0, 2.0, 2.0, 3.0, 3.0});
  CHECK(std::isnan(gap::held({kMissing, kMissing})[0]));
}

TEST_CASE("reversals count beyond the band, at the sample that shows them", "[gap][record]") {
  const std::vector<double> column{0, 1, 2, 3, 2.9, 3.1, 2, 1, 1.1, 3, 3, 1};
  CHECK(gap::reversals(column, 0.5) == std::vector<std::size_t>{6, 9, 11});
  CHECK(gap::reversals(column, 5.0).empty());
  CHECK(gap::reversals({}, 1.0).empty());
  // A slow reversal is not missed, and the first move does not count.
  std::vector<double> slow;
  for (int k = 0; k < 200; ++k) slow.push_back(k < 100 ? 0.01 * k : 2.0 - 0.01 * k);
  CHECK(gap::reversals(slow, 0.5).size() == 1);
}

TEST_CASE("noise is seen between values that are constant here and there", "[gap][record]") {
  numeric::Random random(4);
  std::vector<double> column;
  for (std::size_t k = 0; k < 8000; ++k) {
    const bool stored = random.uniform() < 0.3;
    column.push_back(stored ? 0.001 * static_cast<double>(k) + 0.02 * random.normal() : gap::kNone);
  }
  CHECK(gap::noise_of_stored(column) == Approx(0.02).epsilon(0.1));
  CHECK(gap::noise_of_stored({1.0, gap::kNone, 2.0}) == 0.0);
}

TEST_CASE("a PV that is constant only because of its storage is no fault of the record",
          "[gap][record]") {
  const plant::LoopModel model = test::believed_model();
  numeric::LoopRecord record = test::record_of(model, 130.0);
  for (std::size_t k = 0; k < record.size(); ++k) {
    if (k % 4 != 0) record.pv[k] = gap::kNone;
  }
  CHECK_FALSE(gap::check_record(record, model).usable);
  record.pv_as_stored = true;
  const gap::RecordCheck check = gap::check_record(record, model);
  CHECK(check.usable);
  CHECK(check.noise_rms == Approx(0.015).epsilon(0.25));
}

TEST_CASE("noise is seen in spite of slow movement, outliers and rounding", "[gap][record]") {
  numeric::Random random(4);
  std::vector<double> column;
  for (int k = 0; k < 3000; ++k) {
    column.push_back(5.0 + 3.0 * std::sin(0.01 * k) + 0.02 * random.normal());
  }
  for (std::size_t k = 50; k < column.size(); k += 100) column[k] += 4.0;
  CHECK(gap::noise_of(column) == Approx(0.02).epsilon(0.12));
  for (double& v : column) v = std::round(v / 0.25) * 0.25;
  CHECK(gap::noise_of(column) == Approx(0.25 / std::sqrt(12.0)).epsilon(0.01));
  CHECK(gap::noise_of(std::vector<double>(500, 3.0)) == 0.0);
}

}  // namespace record_check_test
