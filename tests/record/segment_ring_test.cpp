// SPDX-License-Identifier: Apache-2.0
#include "record/segment_ring.hpp"

#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <numeric>
#include <span>
#include <thread>
#include <vector>

#include "record/record_csv.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/undeletable.hpp"

namespace segment_ring_test {

using namespace loopwarden::record;
using loopwarden::tests::TemporaryFolder;
using loopwarden::tests::write_file;
namespace fs = std::filesystem;
using std::chrono::milliseconds;

namespace {

constexpr std::size_t kLimit = 64UL * 1024UL;  // 8 segments of 87 rows
constexpr std::uint64_t kRowsPerSegment = 87;

SegmentSettings settings_in(const fs::path& folder) {
  SegmentSettings settings;
  settings.folder = folder;
  settings.loop = "FIC-101";
  settings.limit_bytes = kLimit;
  return settings;
}

std::vector<RecordRow> rows(std::uint64_t first, std::uint64_t count) {
  std::vector<RecordRow> made(count);
  for (std::uint64_t i = 0; i < count; ++i) made[i].period_index = first + i;
  return made;
}

// Appends rows and writes them.
void append(SegmentWriter& writer, std::span<const RecordRow> taken) {
  writer.append(taken);
  const std::array<SegmentWriter*, 1> all{&writer};
  SegmentWriter::sync_all(all);
}

std::vector<std::uint64_t> periods_in(const fs::path& folder) {
  std::vector<std::uint64_t> periods;
  for (const SegmentFile& file : list_segments(folder)) {
    for (const RecordRow& row : read_segment(file.path).rows) periods.push_back(row.period_index);
  }
  return periods;
}

std::vector<std::uint64_t> range(std::uint64_t first, std::uint64_t count) {
  std::vector<std::uint64_t> numbers(count);
  std::iota(numbers.begin(), numbers.end(), first);
  return numbers;
}

std::size_t bytes_in(const fs::path& folder) {
  std::size_t bytes = 0;
  for (const auto& entry : fs::directory_iterator(folder)) bytes += entry.file_size();
  return bytes;
}

// Runs `body` in a separate process and returns its exit code. A failed check returns a value other
// than 0.
template <class Body>
int exit_code_of(Body body) {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(body());
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1000;
}

// Mounts 40 KiB of memory at `folder`, only for this process.
bool mount_small_disk(const fs::path& folder) {
  const std::string user = "0 " + std::to_string(::getuid()) + " 1";
  const std::string group = "0 " + std::to_string(::getgid()) + " 1";
  if (::unshare(CLONE_NEWUSER | CLONE_NEWNS) != 0) return false;
  std::ofstream("/proc/self/setgroups") << "deny";
  std::ofstream("/proc/self/uid_map") << user;
  std::ofstream("/proc/self/gid_map") << group;
  return ::mount("none", folder.c_str(), "tmpfs", 0, "size=40k") == 0;
}

}  // namespace

TEST_CASE("synced rows are on the disk, without an end of the file") {
  const TemporaryFolder folder;
  SegmentWriter writer(settings_in(folder / "FIC-101"));
  CHECK_FALSE(fs::exists(folder / "FIC-101"));
  append(writer, rows(100, 10));
  append(writer, rows(110, 5));
  CHECK(periods_in(folder / "FIC-101") == range(100, 15));
  const Segment segment = read_segment(folder / "FIC-101" / "0000000001.lwseg");
  CHECK(segment.header.loop == "FIC-101");
  CHECK(segment.header.run == 1);
  CHECK(segment.header.period_s == 0.1);
  const SegmentStatus status = writer.status();
  CHECK(status.rows == 15);
  CHECK(status.rows_lost == 0);
  CHECK(status.bytes == 4096);
  CHECK(status.last_error.empty());
}

TEST_CASE("a full segment ends and the next one follows without a gap") {
  const TemporaryFolder folder;
  SegmentWriter writer(settings_in(folder.path()));
  append(writer, rows(0, kRowsPerSegment - 1));
  CHECK(list_segments(folder.path()).size() == 1);
  append(writer, rows(kRowsPerSegment - 1, 2 * kRowsPerSegment));
  const auto segments = list_segments(folder.path());
  REQUIRE(segments.size() == 3);
  CHECK(read_segment(segments[2].path).header.run == 1);
  CHECK(periods_in(folder.path()) == range(0, 3 * kRowsPerSegment - 1));
}

TEST_CASE("the oldest segment is deleted when the limit is reached") {
  const TemporaryFolder folder;
  SegmentWriter writer(settings_in(folder.path()));
  for (std::uint64_t i = 0; i < 40; ++i) {
    append(writer, rows(i * 50, 50));
    REQUIRE(bytes_in(folder.path()) <= kLimit);
    REQUIRE(writer.status().bytes <= kLimit);
  }
  // 2000 rows fill 22 segments and begin the 23rd.
  const auto kept = periods_in(folder.path());
  CHECK(kept == range(15 * kRowsPerSegment, 2000 - 15 * kRowsPerSegment));
  CHECK(writer.status().segments_dropped == 15);
  CHECK(writer.status().rows == 2000);
}

TEST_CASE("a segment that can't be deleted stays, and the next oldest is deleted") {
  const TemporaryFolder folder;
  SegmentWriter writer(settings_in(folder.path()));
  append(writer, rows(0, 50));
  const loopwarden::tests::Undeletable oldest(list_segments(folder.path()).front().path);
  for (std::uint64_t i = 1; i < 40; ++i) {
    append(writer, rows(i * 50, 50));
    REQUIRE(bytes_in(folder.path()) <= kLimit);
  }
  CHECK(writer.status().rows == 2000);
  CHECK(writer.status().rows_lost == 0);
  CHECK(writer.status().segments_dropped == 15);
  CHECK_THAT(writer.status().last_error, Catch::Contains("deleting the oldest segment"));
  const auto segments = list_segments(folder.path());
  CHECK(segments.front().sequence == 1);
  CHECK(segments[1].sequence == 17);
}

TEST_CASE("a restart begins a new segment and a new run and keeps the old ones") {
  const TemporaryFolder folder;
  { SegmentWriter(settings_in(folder.path())).append(rows(0, 10)); }
  // The last segment after a power failure.
  fs::resize_file(folder / "0000000001.lwseg", kSegmentHeaderBytes + 9 * kSegmentRowBytes + 33);
  SegmentWriter writer(settings_in(folder.path()));
  append(writer, rows(0, 3));
  const auto segments = list_segments(folder.path());
  REQUIRE(segments.size() == 2);
  CHECK(read_segment(segments[0].path).rows.size() == 9);
  CHECK(read_segment(segments[1].path).header.run == 2);
  CHECK(read_segment(segments[1].path).rows.size() == 3);
}

TEST_CASE("segments of earlier runs count against the limit, other files are kept") {
  const TemporaryFolder folder;
  write_file(folder / "notes.txt", std::string(100000, 'x'));
  for (int run = 0; run < 30; ++run) SegmentWriter(settings_in(folder.path())).append(rows(0, 1));
  CHECK(list_segments(folder.path()).size() <= kLimit / 4096);
  CHECK(fs::exists(folder / "notes.txt"));
  CHECK(fs::exists(folder / "0000000030.lwseg"));
}

TEST_CASE("the header gives UTC for the monotonic clock") {
  const TemporaryFolder folder;
  const auto now = [](clockid_t clock) {
    timespec time{};
    clock_gettime(clock, &time);
    return time.tv_sec * 1'000'000'000LL + time.tv_nsec;
  };
  std::vector<RecordRow> waited = rows(0, 1);
  const std::int64_t taken_utc = now(CLOCK_REALTIME) - 20'000'000'000;
  waited[0].time_ns = now(CLOCK_MONOTONIC) - 20'000'000'000;
  SegmentWriter writer(settings_in(folder.path()));
  append(writer, waited);
  const Segment segment = read_segment(folder / "0000000001.lwseg");
  const std::int64_t error = utc_ns(segment.header, segment.rows[0]) - taken_utc;
  CHECK(std::abs(error) < 5'000'000'000);
}

TEST_CASE("rows wait in memory until the sync of all loops, the limit of rows, or the end") {
  const TemporaryFolder folder;
  SegmentSettings settings = settings_in(folder / "a");
  settings.most_pending = 20;
  SegmentSettings other_settings = settings;
  other_settings.folder = folder / "b";
  {
    SegmentWriter a(settings);
    SegmentWriter b(other_settings);
    const std::array<SegmentWriter*, 2> both{&a, &b};
    a.append(rows(0, 19));
    CHECK(a.status().pending == 19);
    CHECK(a.status().rows == 0);
    CHECK_FALSE(fs::exists(folder / "a"));
    a.append(rows(19, 1));
    CHECK(a.status().pending == 0);
    CHECK(a.status().syncs == 0);
    CHECK(periods_in(folder / "a") == range(0, 20));
    b.append(rows(0, 5));
    SegmentWriter::sync_all(both);
    CHECK(a.status().syncs == 1);
    CHECK(b.status().syncs == 1);
    CHECK(periods_in(folder / "b") == range(0, 5));
    SegmentWriter::sync_all(both);
    CHECK(a.status().syncs == 1);
    a.append(rows(20, 3));
  }
  CHECK(periods_in(folder / "a") == range(0, 23));
}

TEST_CASE("a segment's space is allocated at its begin, and released at its end or after a crash") {
  const TemporaryFolder folder;
  const auto allocated = [&] {
    struct stat status {};
    REQUIRE(::stat((folder / "0000000001.lwseg").c_str(), &status) == 0);
    return static_cast<std::size_t>(status.st_blocks) * 512;
  };
  SegmentSettings settings = settings_in(folder.path());
  settings.limit_bytes = 16UL * 1024UL * 1024UL;  // segments of 1 MiB
  const int code = exit_code_of([&] {
    auto* const crashes = new SegmentWriter(settings);
    append(*crashes, rows(0, 10));
    return 0;
  });
  REQUIRE(code == 0);
  if (allocated() < 900'000) {
    WARN("not checked: this file system allocates no space in advance");
    return;
  }
  {
    SegmentWriter writer(settings);
    CHECK(allocated() <= 8192);
    CHECK(periods_in(folder.path()) == range(0, 10));
    append(writer, rows(10, 10));
  }
  std::size_t bytes = 0;
  for (const SegmentFile& segment : list_segments(folder.path())) {
    struct stat status {};
    REQUIRE(::stat(segment.path.c_str(), &status) == 0);
    bytes += static_cast<std::size_t>(status.st_blocks) * 512;
  }
  CHECK(bytes <= 16384);
}

TEST_CASE("a folder that can't be created is counted, reported and tried again") {
  const TemporaryFolder folder;
  write_file(folder / "file", "x");
  SegmentSettings settings = settings_in(folder / "file" / "FIC-101");
  settings.retry_interval = milliseconds(0);
  SegmentWriter writer(settings);
  append(writer, rows(0, 4));
  CHECK(writer.status().rows_lost == 4);
  CHECK(writer.status().disk_errors == 1);
  CHECK_THAT(writer.status().last_error, Catch::Contains("FIC-101: creating the folder"));
  fs::remove(folder / "file");
  append(writer, rows(4, 2));
  CHECK(writer.status().rows == 2);
  CHECK(periods_in(settings.folder) == range(4, 2));
}

TEST_CASE("after a disk error the next attempt waits for a while") {
  const TemporaryFolder folder;
  write_file(folder / "file", "x");
  SegmentSettings settings = settings_in(folder / "file" / "FIC-101");
  settings.retry_interval = std::chrono::hours(1);
  SegmentWriter writer(settings);
  for (int i = 0; i < 100; ++i) append(writer, rows(0, 1));
  CHECK(writer.status().disk_errors == 1);
  CHECK(writer.status().rows_lost == 100);
}

TEST_CASE("a refused write loses its rows, not the earlier ones") {
  const TemporaryFolder folder;
  const int code = exit_code_of([&] {
    ::signal(SIGXFSZ, SIG_IGN);
    // Room for the header, 10 rows and a half.
    const rlimit limit{kSegmentHeaderBytes + 10 * kSegmentRowBytes + 40, RLIM_INFINITY};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    SegmentSettings settings = settings_in(folder.path());
    settings.retry_interval = milliseconds(0);
    SegmentWriter writer(settings);
    append(writer, rows(0, 10));
    append(writer, rows(10, 5));
    if (writer.status().rows_lost != 5) return 1;
    append(writer, rows(15, 3));
    return writer.status().rows == 13 ? 0 : 2;
  });
  CHECK(code == 0);
  std::vector<std::uint64_t> expected = range(0, 10);
  for (const std::uint64_t period : range(15, 3)) expected.push_back(period);
  CHECK(periods_in(folder.path()) == expected);
  CHECK(read_segment(folder / "0000000001.lwseg").torn_bytes == 0);
}

TEST_CASE("on a full disk the oldest segment is deleted for each new one") {
  const TemporaryFolder folder;
  constexpr int kNoNamespace = 77;
  const int code = exit_code_of([&] {
    if (!mount_small_disk(folder.path())) {
      return kNoNamespace;
    }
    SegmentSettings settings = settings_in(folder / "FIC-101");
    settings.retry_interval = milliseconds(0);
    SegmentWriter writer(settings);
    for (std::uint64_t i = 0; i < 20; ++i)
      append(writer, rows(i * kRowsPerSegment, kRowsPerSegment));
    const SegmentStatus full = writer.status();
    if (full.rows != 20 * kRowsPerSegment || full.rows_lost != 0 || full.disk_errors != 0) return 1;
    if (full.segments_dropped < 10) return 2;
    const auto kept = periods_in(settings.folder);
    if (kept.back() != 20 * kRowsPerSegment - 1 || kept.size() < 3 * kRowsPerSegment) return 3;

    // Another program takes all free space. A new segment takes the space of the oldest one at
    // once, so no row is lost.
    const std::size_t segments = list_segments(settings.folder).size();
    for (std::uint64_t i = 0; i < 10; ++i) {
      std::ofstream(folder / "neighbour", std::ios::app) << std::string(40000, 'x');
      append(writer, rows(5000 + i * 60, 60));
    }
    if (writer.status().rows_lost != 0) return 4;
    if (list_segments(settings.folder).size() + 1 < segments) return 5;
    // When there is room again, recording continues.
    fs::remove(folder / "neighbour");
    append(writer, rows(9000, 10));
    return periods_in(settings.folder).back() == 9009 ? 0 : 6;
  });
  if (code == kNoNamespace) {
    WARN("not checked: this machine gives no namespace to mount a small disk in");
  } else {
    CHECK(code == 0);
  }
}

TEST_CASE("impossible settings are reported at the start") {
  const TemporaryFolder folder;
  write_file(folder / "file", "x");
  CHECK_THROWS_AS(SegmentWriter(settings_in(folder / "file")), RecordError);
  SegmentSettings settings = settings_in(folder.path());
  settings.period_s = 0.0;
  CHECK_THROWS_AS(SegmentWriter(settings), RecordError);
}

TEST_CASE("the time of the oldest stored row is reported", "[record][segments]") {
  const TemporaryFolder folder;
  const auto oldest_in = [&] {
    return read_segment(list_segments(folder.path()).front().path).header.start_utc_ns / 1'000'000;
  };
  {
    SegmentWriter writer(settings_in(folder.path()));
    CHECK(writer.status().oldest_utc_ms == 0);
    append(writer, rows(0, 10));
    CHECK(writer.status().oldest_utc_ms == oldest_in());
    const std::int64_t first = writer.status().oldest_utc_ms;
    CHECK(first > 0);
    // Waits so that the next segments begin later.
    std::this_thread::sleep_for(milliseconds(5));
    append(writer, rows(10, 12 * kRowsPerSegment));
    REQUIRE(writer.status().segments_dropped > 0);
    CHECK(writer.status().oldest_utc_ms == oldest_in());
    CHECK(writer.status().oldest_utc_ms > first);
  }
  const std::int64_t before = oldest_in();
  CHECK(SegmentWriter(settings_in(folder.path())).status().oldest_utc_ms == before);
  write_file(list_segments(folder.path()).front().path, "damaged");
  const std::int64_t next = SegmentWriter(settings_in(folder.path())).status().oldest_utc_ms;
  CHECK(next >= before);
  CHECK(next > 0);
}

}  // namespace segment_ring_test
