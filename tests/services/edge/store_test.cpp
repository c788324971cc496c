// SPDX-License-Identifier: Apache-2.0
// Tests of the messages that wait on disk, and of when they are sent again.
#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <string>
#include <vector>

#include "services/edge/outbox.hpp"
#include "services/edge/store.hpp"
#include "tests/support/file_size_limit.hpp"
#include "tests/support/temporary_folder.hpp"

namespace store_test {

using namespace std::chrono_literals;
using namespace loopwarden::edge;
using loopwarden::sparkplug::DataType;
using loopwarden::sparkplug::Metric;
using loopwarden::sparkplug::Value;
using loopwarden::tests::TemporaryFolder;

constexpr std::uint64_t kPlenty = 1024UL * 1024UL;

Report report(std::string device, double value) {
  Metric metric;
  metric.name = "pv";
  metric.type = DataType::float64;
  metric.time_ms = 7;
  metric.value = value;
  return {std::move(device), {metric}};
}

double value_of(const Report& r) { return std::get<double>(r.metrics.at(0).value); }

std::vector<double> stored(Store& store) {
  std::vector<double> values;
  for (const Store::Row& row : store.read(0, 100'000)) values.push_back(value_of(row.report));
  return values;
}

TEST_CASE("reports and bdSeq survive a restart, in their order", "[edge]") {
  const TemporaryFolder folder;
  {
    Store store(folder / "s", kPlenty);
    CHECK_FALSE(store.bd_seq());
    store.keep_bd_seq(255);
    store.append({report("a", 1), report("b", 2)});
    store.append({report("a", 3)});
  }
  Store store(folder / "s", kPlenty);
  CHECK(store.bd_seq() == 255);
  CHECK(store.waiting() == 3);
  const auto rows = store.read(0, 2);
  REQUIRE(rows.size() == 2);
  CHECK(rows[0].report.device == "a");
  CHECK(rows[1].report.device == "b");
  CHECK(rows[1].report.metrics == report("b", 2).metrics);
  store.remove_up_to(rows[1].id);
  CHECK(stored(store) == std::vector<double>{3});
  CHECK(store.waiting() == 1);
}

TEST_CASE("beyond the bound the oldest message is dropped and stays counted", "[edge]") {
  const TemporaryFolder folder;
  constexpr int kReports = 2000;
  {
    Store store(folder / "s", 10'000);
    for (int i = 0; i < kReports; ++i) store.append({report("device", i)});
    const auto kept = stored(store);
    REQUIRE(!kept.empty());
    CHECK(kept.back() == kReports - 1);
    CHECK(kept.size() == store.waiting());
    CHECK(kept.front() == static_cast<double>(store.dropped()));
    CHECK(store.dropped() + store.waiting() == kReports);
    CHECK(std::filesystem::file_size(folder / "s") < 40'000);
  }
  Store store(folder / "s", 10'000);
  CHECK(store.dropped() + store.waiting() == kReports);
}

TEST_CASE("a damaged file, or one of another program, is moved aside", "[edge]") {
  const TemporaryFolder folder;
  loopwarden::tests::write_file(folder / "s", std::string(10'000, 'x'));
  Store store(folder / "s", kPlenty);
  store.append({report("a", 1)});
  CHECK(store.waiting() == 1);
  int aside = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    if (entry.path().filename().string().starts_with("s.damaged-")) ++aside;
  }
  CHECK(aside == 1);
}

TEST_CASE("a row that can't be decoded is moved aside and counted, and does not delay others",
          "[edge]") {
  const TemporaryFolder folder;
  {
    Store store(folder / "s", kPlenty);
    store.append({report("a", 1), report("a", 2), report("a", 3)});
  }
  loopwarden::sqlite::Database(folder / "s", loopwarden::sqlite::Access::write, 1s)
      .execute("UPDATE report SET payload = x'FFFF' WHERE id = 2");
  Store store(folder / "s", kPlenty);
  Outbox outbox(store, 60s);
  std::vector<double> sent;
  const auto replay = [&] {
    outbox.replay(10, {}, [&](const Report& r) {
      sent.push_back(value_of(r));
      return true;
    });
  };
  replay();
  replay();
  CHECK(sent == std::vector<double>{1, 3});
  CHECK(store.dropped() == 1);
  CHECK(store.waiting() == 2);
  loopwarden::sqlite::Database reader(folder / "s", loopwarden::sqlite::Access::read, 1s);
  loopwarden::sqlite::Statement aside(reader, "SELECT id, device, payload FROM unreadable");
  REQUIRE(aside.step());
  CHECK(aside.integer(0) == 2);
  CHECK(aside.text(2) == "\xFF\xFF");
  CHECK_FALSE(aside.step());
}

TEST_CASE("a store of a later version is refused and kept", "[edge]") {
  const TemporaryFolder folder;
  { Store store(folder / "s", kPlenty); }
  loopwarden::sqlite::Database(folder / "s", loopwarden::sqlite::Access::write, 1s)
      .execute("PRAGMA user_version=2");
  const std::string before = loopwarden::tests::read_file(folder / "s");
  CHECK_THROWS_WITH(Store(folder / "s", kPlenty),
                    Catch::Contains("store of version 2, this program knows version 1"));
  CHECK(loopwarden::tests::read_file(folder / "s") == before);
}

TEST_CASE("without a folder there is no store", "[edge]") {
  const TemporaryFolder folder;
  CHECK_THROWS_AS(Store(folder / "none/s", kPlenty), loopwarden::sqlite::Error);
}

struct Box {
  TemporaryFolder folder;
  Store store{folder / "s", kPlenty};
  Outbox outbox{store, 60s};
  Outbox::Clock::time_point now{};
  std::vector<double> sent;

  void replay(std::size_t most, bool works = true) {
    outbox.replay(most, now, [&](const Report& r) {
      if (works) sent.push_back(value_of(r));
      return works;
    });
  }
};

TEST_CASE("unsent messages are sent later, oldest first", "[edge]") {
  Box box;
  for (int i = 0; i < 5; ++i) box.outbox.keep(report("a", i));
  box.outbox.tidy(box.now);
  CHECK(box.outbox.waiting() == 5);
  box.replay(2);
  CHECK(box.sent == std::vector<double>{0, 1});
  CHECK(box.outbox.waiting() == 3);
  box.replay(2, false);
  box.replay(10);
  CHECK(box.sent == std::vector<double>{0, 1, 2, 3, 4});
  box.replay(10);
  CHECK(box.sent.size() == 5);
  // The message stays on the disk until its arrival is confirmed.
  CHECK(box.store.waiting() == 5);
  box.now += 61s;
  box.outbox.tidy(box.now);
  CHECK(box.store.waiting() == 0);
}

TEST_CASE("messages sent shortly before a loss are sent again, before newer messages", "[edge]") {
  Box box;
  box.outbox.sent(report("a", 1), box.now);
  box.now += 50s;
  box.outbox.sent(report("a", 2), box.now);
  box.now += 20s;
  box.outbox.lost(box.now);
  box.outbox.keep(report("a", 3));
  box.outbox.tidy(box.now);
  box.replay(10);
  CHECK(box.sent == std::vector<double>{2, 3});
  // They are sent again if that connection is lost too.
  box.sent.clear();
  box.outbox.lost(box.now);
  box.replay(10);
  CHECK(box.sent == std::vector<double>{2, 3});
}

TEST_CASE("while the disk refuses, reports wait in memory; beyond the bound the oldest are dropped",
          "[edge]") {
  Box box;
  {
    const loopwarden::tests::FileSizeLimit full(0);
    for (std::size_t i = 0; i < Outbox::kMostInMemory + 5; ++i)
      box.outbox.keep(report("a", static_cast<double>(i)));
    box.outbox.tidy(box.now);
    CHECK(box.outbox.waiting() == Outbox::kMostInMemory);
    CHECK(box.outbox.dropped() == 5);
  }
  box.outbox.tidy(box.now);
  CHECK(box.store.waiting() == Outbox::kMostInMemory);
  box.replay(1);
  CHECK(box.sent == std::vector<double>{5});
}

TEST_CASE(
    "a disk with little room stores some waiting reports, and the others when it has more room",
    "[edge]") {
  Box box;
  constexpr std::size_t kReports = Outbox::kMostInMemory;
  {
    const loopwarden::tests::FileSizeLimit small(300'000);
    for (std::size_t i = 0; i < kReports; ++i) box.outbox.keep(report("a", static_cast<double>(i)));
    box.outbox.tidy(box.now);
    CHECK(box.store.waiting() > 0);
    CHECK(box.store.waiting() < kReports);
    CHECK(box.outbox.waiting() == kReports);
  }
  box.outbox.tidy(box.now);
  CHECK(box.store.waiting() == kReports);
  box.replay(kReports);
  CHECK(box.sent.size() == kReports);
  CHECK(std::is_sorted(box.sent.begin(), box.sent.end()));
}

}  // namespace store_test
