// SPDX-License-Identifier: Apache-2.0
#include "services/page/boxes/sparklines.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace loopwarden::tests::sparklines_test {

using nlohmann::json;
using page::Sparklines;

constexpr std::int64_t kStart = 1'000'000;

TEST_CASE("ten minutes in sixty steps, each with its first, least, greatest and last value") {
  Sparklines lines;
  for (int s = 0; s < 1000; ++s)
    lines.add(kStart + s * 1000, {static_cast<double>((s + 3) % 10), std::nan("")});
  const json all = json::parse(lines.json(7));
  CHECK(all["step_s"] == 10);
  CHECK(all["until_ms"] == 7);
  REQUIRE(all["pv"].size() == 2);
  REQUIRE(all["pv"][0].size() == 240);
  const std::vector<double> step(all["pv"][0].begin(), all["pv"][0].begin() + 4);
  CHECK(step == std::vector<double>{3.0, 0.0, 9.0, 2.0});
  CHECK(all["pv"][1][239].is_null());
}

TEST_CASE("a stretch without values is empty, without values of an hour ago") {
  Sparklines lines;
  lines.add(kStart, {5.0});
  lines.add(kStart + 100'000, {6.0});
  const json pv = json::parse(lines.json(7))["pv"][0];
  CHECK(pv[239] == 6.0);
  CHECK(pv[235].is_null());
  CHECK(pv[199] == 5.0);
  lines.add(kStart + 3'600'000, {7.0});
  const json later = json::parse(lines.json(7))["pv"][0];
  CHECK(later[239] == 7.0);
  CHECK(std::count_if(later.begin(), later.end(), [](const json& v) { return !v.is_null(); }) == 4);
}

TEST_CASE("another number of loops, or a clock set back, clears the sparklines") {
  Sparklines lines;
  lines.add(kStart, {5.0});
  lines.add(kStart, {5.0, 6.0});
  CHECK(json::parse(lines.json(7))["pv"].size() == 2);
  lines.add(kStart - 100'000, {7.0, 8.0});
  CHECK(json::parse(lines.json(7))["pv"][0][235].is_null());
  CHECK(json::parse(Sparklines().json(7))["pv"].empty());
}

}  // namespace loopwarden::tests::sparklines_test
