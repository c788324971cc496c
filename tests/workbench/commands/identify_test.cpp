// SPDX-License-Identifier: Apache-2.0
// `loopwarden identify` as its users call it.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::identify_test {
namespace {

ShellOutcome identify(const std::string& arguments) {
  return run(LOOPWARDEN_CLI " identify " + arguments + " 2>&1");
}

// A heater in degC, T 30 s, with an oscillating disturbance: PV = 20 + 0.6 CO. `law` returns CO
// from the sample number and the previous PV and CO.
std::string heater_csv(const std::function<double(int, double, double)>& law) {
  std::string text = "time,pv,co\n";
  double heat = 0.0;
  double co = 0.0;
  for (int k = 0; k < 1500; ++k) {
    const double load = 3.0 * std::sin(0.011 * k) + 1.5 * std::sin(0.0371 * k);
    const double pv = 20.0 + heat + load;
    co = law(k, pv, co);
    char row[64];
    std::snprintf(row, sizeof row, "%d,%.2f,%.2f\n", k, pv, co);
    text += row;
    heat += (0.6 * co - heat) / 30.0;
  }
  return text;
}

}  // namespace

TEST_CASE("identify gives no value for a heater switched by a thermostat", "[identify][program]") {
  const TemporaryFolder folder;
  write_file(folder / "record.csv", heater_csv([](int, double pv, double co) {
               return pv > 46.0 ? 0.0 : pv < 44.0 ? 100.0 : co;
             }));
  const ShellOutcome outcome = identify((folder / "record.csv").string());
  INFO(outcome.text);
  CHECK(outcome.exit_code == 65);
  CHECK(outcome.text.find("Loop: closed") != std::string::npos);
  CHECK(outcome.text.find("not linear") != std::string::npos);
  CHECK(outcome.text.find("Step CO in manual") != std::string::npos);
}

TEST_CASE("identify prints PV at CO 0 for the model file", "[identify][program]") {
  const TemporaryFolder folder;
  const auto by_hand = [](int k, double, double) { return k / 150 % 2 == 0 ? 30.0 : 60.0; };
  write_file(folder / "record.csv", heater_csv(by_hand));
  const ShellOutcome outcome = identify((folder / "record.csv").string());
  INFO(outcome.text);
  REQUIRE(outcome.exit_code == 0);
  CHECK(outcome.text.find("Loop: open") != std::string::npos);
  const std::size_t at = outcome.text.find("  level: ");
  REQUIRE(at != std::string::npos);
  CHECK(std::stod(outcome.text.substr(at + 9)) == Approx(20.0).margin(2.0));
}

}  // namespace loopwarden::tests::identify_test
