// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <cstdint>
#include <exception>
#include <stdexcept>
#include <string>

#include "lab/hidden_cases/hidden_case.hpp"
#include "lab/hidden_cases/kinds.hpp"

namespace {

namespace cases = loopwarden::hidden_cases;

constexpr int kExitUsage = 64;
constexpr int kExitIo = 74;

struct Options {
  std::string out;
  std::size_t count = 46;
  std::uint64_t seed = 0;
  bool load = false;
  std::string kinds = "single,none,pair,outside";
  std::size_t samples = 4200;
};

int generate(const Options& options) {
  cases::write_cases(
      options.out, cases::plan_cases(options.count, options.seed, cases::parse_kinds(options.kinds),
                                     options.load, options.samples));
  fmt::print(stderr, "{} cases in {}\n", options.count, options.out);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "loopwarden_hidden_cases - writes simulated records of loops whose models lack an effect",
      "loopwarden_hidden_cases");
  Options options;
  app.add_option("--out", options.out, "folder for the cases")->required();
  app.add_option("--count", options.count, "how many")->check(CLI::Range(1, 100000));
  app.add_option("--seed", options.seed,
                 "case k has the seed SEED + k; below 100000 for development")
      ->required();
  app.add_flag("--load", options.load, "with an unmeasured random load on PV");
  app.add_option("--kinds", options.kinds,
                 "of single, none, pair, outside, onset, controller, further, later, healthy")
      ->capture_default_str();
  app.add_option("--samples", options.samples, "rows of a record; sticky loops get 10/7 of it")
      ->check(CLI::Range(600, 1000000))
      ->capture_default_str();
  try {
    app.parse(argc, argv);
    return generate(options);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : kExitUsage;
  } catch (const std::invalid_argument& e) {
    fmt::print(stderr, "loopwarden_hidden_cases: {}\n", e.what());
    return kExitUsage;
  } catch (const std::exception& e) {
    fmt::print(stderr, "loopwarden_hidden_cases: {}\n", e.what());
    return kExitIo;
  }
}
