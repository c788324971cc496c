// SPDX-License-Identifier: Apache-2.0
// The only place that compiles rapidcheck's templates.
#include "tests/support/property.hpp"

#include <rapidcheck.h>
#include <rapidcheck/detail/TestListenerAdapter.h>

#include <catch2/catch.hpp>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <sstream>

namespace loopwarden::tests::property {

void for_all(const std::string& what, int tries, const std::function<void()>& one_try) {
  rc::detail::TestParams params;
  params.seed = 1;
  params.maxSuccess = tries;
  if (const char* asked = std::getenv("RC_PARAMS")) {
    rc::detail::Configuration ours;
    ours.testParams = params;
    params = rc::detail::configFromString(asked, ours).testParams;
  }
  rc::detail::TestMetadata metadata;
  metadata.id = what;
  metadata.description = what;
  rc::detail::TestListenerAdapter silent;
  const auto result = rc::detail::checkTestable(one_try, metadata, params, silent);
  std::ostringstream text;
  rc::detail::printResultMessage(result, text);
  INFO(what << ", seed " << params.seed << ": " << text.str());
  CHECK(result.template is<rc::detail::SuccessResult>());
}

std::int64_t integer(std::int64_t low, std::int64_t high) {
  return *rc::gen::inRange(low, high + 1);
}

std::uint64_t bits() { return *rc::gen::arbitrary<std::uint64_t>(); }

bool coin() { return *rc::gen::arbitrary<bool>(); }

std::size_t one_of(std::size_t count) {
  return *rc::gen::resize(rc::kNominalSize, rc::gen::inRange<std::size_t>(0, count));
}

double number(double low, double high) {
  switch (one_of(8)) {
    case 0: return low;
    case 1: return high;
    // Draws a magnitude first, because evenly distributed values would rarely be small.
    case 2:
    case 3:
    case 4: {
      const double size = std::pow(10.0, static_cast<double>(integer(-12, 12))) *
                          static_cast<double>(integer(-999, 999));
      return std::min(high, std::max(low, size));
    }
    default: break;
  }
  const auto any = *rc::gen::resize(rc::kNominalSize, rc::gen::arbitrary<std::uint64_t>());
  const double share = static_cast<double>(any >> 11U) * 0x1p-53;
  return std::min(high, std::max(low, low * (1.0 - share) + high * share));
}

void require(bool holds, const char* what) {
  if (!holds) RC_FAIL(what);
}

}  // namespace loopwarden::tests::property
