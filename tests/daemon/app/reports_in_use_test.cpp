// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/reports_in_use.hpp"

#include <catch2/catch.hpp>
#include <filesystem>
#include <vector>

#include "tests/config/config_support.hpp"

namespace loopwarden::tests::reports_in_use_test {
namespace {

namespace fs = std::filesystem;
using daemon::needed_by_loops;

const std::string kLoop = config::test::kLoopHead + "io: {backend: simulated, model: ../m.yaml}\n";

struct Bench {
  Bench() {
    files.write("m.yaml", config::test::kModel);
    files.write("loops.d/a.yaml", kLoop);
    files.write("state/reports/one/twin.yaml", "");
    files.write("state/reports/one-more/twin.yaml", "");
  }
  bool needed(const std::string& report) {
    return needed_by_loops(files / "state/reports" / report, running, files.path());
  }

  config::test::ScratchFolder files;
  std::vector<daemon::LoopRuntime> running = std::vector<daemon::LoopRuntime>(1);
};

}  // namespace

TEST_CASE("a report that a running loop uses is needed, under any name", "[app]") {
  Bench bench;
  CHECK_FALSE(bench.needed("one"));
  bench.running[0].config.monitor.twin =
      (bench.files / "loops.d/../state/reports/one/twin.yaml").string();
  CHECK(bench.needed("one"));
  CHECK_FALSE(bench.needed("one-more"));
  fs::create_directory_symlink(bench.files / "state", bench.files / "link");
  bench.running[0].config.monitor = {};
  bench.running[0].config.monitor.specialists =
      (bench.files / "link/reports/one-more/specialists").string();
  CHECK_FALSE(bench.needed("one"));
  CHECK(bench.needed("one-more"));
}

TEST_CASE("a report that a file names is needed by the next start", "[app]") {
  Bench bench;
  bench.files.write("loops.d/a.yaml", kLoop + "monitor: {twin: ../state/reports/one/twin.yaml}\n");
  CHECK(bench.needed("one"));
  CHECK_FALSE(bench.needed("one-more"));
  // The names in an unreadable file are unknown.
  bench.files.write("loops.d/a.yaml", "loop: [\n");
  CHECK(bench.needed("one-more"));
}

}  // namespace loopwarden::tests::reports_in_use_test
