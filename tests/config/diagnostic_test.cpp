// SPDX-License-Identifier: Apache-2.0
#include "config/diagnostic.hpp"

#include <catch2/catch.hpp>

namespace diagnostic_test {

using namespace loopwarden::config;

TEST_CASE("A diagnostic reads like a compiler's", "[config]") {
  const Diagnostic full{Diagnostic::Level::error,
                        "loops.d/FIC-101.yaml",
                        {14, 9},
                        "controller.ti",
                        "must be > 0 s (got 0)"};
  CHECK(to_text(full) == "loops.d/FIC-101.yaml:14:9: error: controller.ti: must be > 0 s (got 0)");
  CHECK(to_text(Diagnostic{Diagnostic::Level::warning, "f", {1, 2}, "", "odd"}) ==
        "f:1:2: warning: odd");
  CHECK(to_text(Diagnostic{Diagnostic::Level::note, "f", {1, 2}, "", "so it is"}) ==
        "f:1:2: note: so it is");
  CHECK(to_text(Diagnostic{Diagnostic::Level::error, "dir", {}, "", "can't be read"}) ==
        "dir: error: can't be read");
}

TEST_CASE("A report gives its diagnostics in the order of the file", "[config]") {
  Report report("f");
  report.error({9, 1}, "", "third");
  report.warning({2, 7}, "", "second");
  report.error({2, 3}, "", "first");
  CHECK(report.error_count() == 2);
  CHECK(to_text(report.take()) ==
        "f:2:3: error: first\nf:2:7: warning: second\nf:9:1: error: third\n");
  CHECK_FALSE(report.has_errors());
}

TEST_CASE("Warnings do not keep a value from being loaded, errors do", "[config]") {
  Report report("f");
  report.warning({1, 1}, "", "odd");
  const Loaded<int> good = loaded(5, report);
  REQUIRE(good);
  CHECK(*good == 5);
  CHECK(good.diagnostics.size() == 1);
  report.error({1, 1}, "", "wrong");
  CHECK_FALSE(loaded(5, report));
}

TEST_CASE("A flood of errors is cut short, and stays an error", "[config]") {
  Report report("f");
  for (int line = 1; line <= 250; ++line) report.error({line, 1}, "", "wrong");
  const Loaded<int> flooded = loaded(5, report);
  CHECK_FALSE(flooded);
  REQUIRE(flooded.diagnostics.size() == 101);
  CHECK(flooded.diagnostics.back().message == "150 more are not shown");
}

TEST_CASE("A misspelt word is reported with the nearest known one", "[config]") {
  const std::vector<std::string> known{"gain", "range", "time_constant", "unit"};
  CHECK(suggestion("gian", known) == "; did you mean 'gain'?");  // neighbours swapped
  CHECK(suggestion("gai", known) == "; did you mean 'gain'?");   // one letter missing
  // in the other case (upper and lower)
  CHECK(suggestion("GAIN", known) == "; did you mean 'gain'?");
  CHECK(suggestion("rnage", known) == "; did you mean 'range'?");
  CHECK(suggestion("timeconstant", known) == "; did you mean 'time_constant'?");
  CHECK(suggestion("colour", known).empty());
  CHECK(suggestion("", known).empty());
  CHECK(suggestion(std::string(100'000, 'x'), known).empty());
}

TEST_CASE("Text from a file is harmless in a message", "[config]") {
  CHECK(quotable("plain") == "plain");
  CHECK(quotable("a\x1b[31mb\nc") == "a?[31mb?c");
  CHECK(quotable(std::string(100, 'x')) == std::string(60, 'x') + "...");
  // A cut never leaves part of a character.
  CHECK(quotable(std::string(59, 'x') + "\xc3\xa9" + "yy") == std::string(59, 'x') + "...");
}

}  // namespace diagnostic_test
