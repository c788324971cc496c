// SPDX-License-Identifier: Apache-2.0
#include "daemon/recorder/recorder.hpp"

#include <catch2/catch.hpp>
#include <chrono>
#include <vector>

#include "record/segment_reader.hpp"
#include "tests/support/device/foreign_process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::daemon::recorder_test {
namespace {

using test::eventually;

struct Bench {
  explicit Bench(std::chrono::milliseconds sync)
      : recorder(loops, {.state_directory = folder.path(), .sync = sync}) {
    for (const char* name : {"FIC-101", "FIC-102"}) loops.emplace_back().config.name = name;
    recorder.start();
  }
  void push(std::size_t loop, std::uint64_t count) {
    std::vector<record::RecordRow> rows(count);
    recorder.push(loop, rows);
  }
  std::size_t rows_on_disk(const std::string& loop) const {
    std::size_t rows = 0;
    for (const record::SegmentFile& file :
         record::list_segments(folder.path() / "segments" / loop)) {
      rows += record::read_segment(file.path).rows.size();
    }
    return rows;
  }

  tests::TemporaryFolder folder;
  std::vector<LoopRuntime> loops;
  Recorder recorder;
};

TEST_CASE("rows wait in memory until the sync, and the end writes them", "[recorder]") {
  Bench bench(std::chrono::hours(1));
  bench.push(0, 10);
  bench.push(1, 20);
  REQUIRE(eventually([&] { return bench.recorder.sync_s() > 0.0; }));
  CHECK(bench.recorder.sync_s() == 3600.0);
  REQUIRE(eventually([&] { return bench.recorder.status(1).segments.pending == 20; }));
  CHECK(bench.recorder.status(1).waiting == 20);
  CHECK(bench.rows_on_disk("FIC-101") == 0);
  bench.recorder.stop();
  CHECK(bench.rows_on_disk("FIC-101") == 10);
  CHECK(bench.rows_on_disk("FIC-102") == 20);
}

TEST_CASE("the sync writes the rows of all loops", "[recorder]") {
  Bench bench(std::chrono::milliseconds(0));
  bench.push(0, 10);
  bench.push(1, 20);
  // A file that is read earlier may have no header yet.
  REQUIRE(eventually([&] {
    return bench.recorder.status(0).segments.rows == 10 &&
           bench.recorder.status(1).segments.rows == 20;
  }));
  CHECK(bench.rows_on_disk("FIC-101") == 10);
  CHECK(bench.rows_on_disk("FIC-102") == 20);
  CHECK(eventually([&] { return bench.recorder.status(1).waiting == 0; }));
}

}  // namespace
}  // namespace loopwarden::daemon::recorder_test
