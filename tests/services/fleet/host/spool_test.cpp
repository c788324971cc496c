// SPDX-License-Identifier: Apache-2.0
#include "services/fleet/host/spool.hpp"

#include <catch2/catch.hpp>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/support/property.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::spool_test {
namespace {

using fleet::Arrival;
using fleet::Spool;
using fleet::SpoolSettings;
namespace property = tests::property;

Arrival arrival(int n) {
  return {"spBv1.0/A/DDATA/box/" + std::to_string(n), std::string(100, 'x'), n, false};
}

SpoolSettings small(const tests::TemporaryFolder& folder) {
  return {.folder = folder / "spool",
          .limit_bytes = 20'000,
          .memory_bytes = 1'000,
          .file_bytes = 2'000};
}

std::vector<std::int64_t> numbers(const std::vector<Arrival>& arrivals) {
  std::vector<std::int64_t> all;
  for (const Arrival& one : arrivals) all.push_back(one.received_ms);
  return all;
}

TEST_CASE("messages are returned in order, from memory and from the disk") {
  const tests::TemporaryFolder folder;
  Spool spool(small(folder));
  for (int n = 0; n < 30; ++n) spool.push(arrival(n));
  CHECK(spool.waiting() == 30);
  CHECK(spool.disk_bytes() > 0);
  std::vector<std::int64_t> got;
  while (!spool.empty()) {
    for (const std::int64_t n : numbers(spool.peek(7))) got.push_back(n);
    spool.pop();
  }
  REQUIRE(got.size() == 30);
  for (int n = 0; n < 30; ++n) CHECK(got[static_cast<std::size_t>(n)] == n);
  CHECK(std::filesystem::is_empty(folder / "spool"));
  CHECK(spool.dropped() == 0);
}

TEST_CASE("a message that was peeked and not dropped is returned again") {
  const tests::TemporaryFolder folder;
  Spool spool(small(folder));
  for (int n = 0; n < 5; ++n) spool.push(arrival(n));
  CHECK(spool.peek(3).size() == 3);
  CHECK(numbers(spool.peek(3)) == std::vector<std::int64_t>{0, 1, 2});
  // The database was lost in between.
  spool.to_disk();
  spool.pop();
  CHECK(numbers(spool.peek(1)) == std::vector<std::int64_t>{0});
}

TEST_CASE("an earlier run's messages are returned first and are marked") {
  const tests::TemporaryFolder folder;
  {
    Spool spool(small(folder));
    for (int n = 0; n < 4; ++n) spool.push(arrival(n));
    spool.to_disk();
  }
  Spool spool(small(folder));
  spool.push(arrival(9));
  const std::vector<Arrival> first = spool.peek(100);
  CHECK(numbers(first) == std::vector<std::int64_t>{0, 1, 2, 3});
  CHECK(first.front().left_over);
  CHECK(first.front().payload == arrival(0).payload);
  spool.pop();
  const std::vector<Arrival> second = spool.peek(100);
  CHECK(numbers(second) == std::vector<std::int64_t>{9});
  CHECK_FALSE(second.front().left_over);
}

TEST_CASE("a record that is cut short or damaged ends only its file") {
  const tests::TemporaryFolder folder;
  const SpoolSettings settings = small(folder);
  {
    Spool spool(settings);
    for (int n = 0; n < 40; ++n) spool.push(arrival(n));
    spool.to_disk();
  }
  std::filesystem::path first;
  for (const auto& entry : std::filesystem::directory_iterator(settings.folder)) {
    if (first.empty() || entry.path() < first) first = entry.path();
  }
  std::filesystem::resize_file(first, std::filesystem::file_size(first) - 3);
  Spool spool(settings);
  std::vector<std::int64_t> got;
  while (!spool.empty()) {
    for (const std::int64_t n : numbers(spool.peek(100))) got.push_back(n);
    spool.pop();
  }
  CHECK(got.size() == 39);
  CHECK(got.back() == 39);
}

TEST_CASE("beyond the limit the oldest messages are dropped and counted") {
  const tests::TemporaryFolder folder;
  Spool spool(small(folder));
  for (int n = 0; n < 1000; ++n) spool.push(arrival(n));
  CHECK(spool.disk_bytes() <= 22'000);
  CHECK(spool.fill() <= 1.1);
  const std::uint64_t waiting = spool.waiting();
  CHECK(waiting + spool.dropped() == 1000);
  std::vector<std::int64_t> got;
  while (!spool.empty()) {
    for (const std::int64_t n : numbers(spool.peek(100))) got.push_back(n);
    spool.pop();
  }
  CHECK(got.size() == waiting);
  CHECK(got.back() == 999);
}

TEST_CASE("if the disk refuses, messages stay in memory up to a limit") {
  const tests::TemporaryFolder folder;
  Spool spool(small(folder));
  std::filesystem::remove_all(folder / "spool");
  for (int n = 0; n < 100; ++n) spool.push(arrival(n));
  CHECK(spool.waiting() + spool.dropped() == 100);
  CHECK(numbers(spool.peek(3)) == std::vector<std::int64_t>{0, 1, 2});
}

TEST_CASE(
    "any mixture of pushing, reading, losing the database and restarting keeps all messages") {
  property::for_all("spool", 60, [] {
    const tests::TemporaryFolder folder;
    SpoolSettings settings = small(folder);
    settings.limit_bytes = 1'000'000;
    auto spool = std::make_unique<Spool>(settings);
    int next = 0;
    std::int64_t expected = 0;
    const auto steps = property::integer(1, 80);
    const auto read = [&](std::size_t most) {
      for (const std::int64_t n : numbers(spool->peek(most))) {
        // A repetition after a restart is allowed, a gap is not.
        property::require(n <= expected, "no gap");
        expected = std::max(expected, n + 1);
      }
      spool->pop();
    };
    for (std::int64_t step = 0; step < steps; ++step) {
      switch (property::one_of(5)) {
        case 0: spool->to_disk(); break;
        case 1: read(property::one_of(9) + 1); break;
        case 2:
          spool->to_disk();
          spool = std::make_unique<Spool>(settings);
          expected = std::max<std::int64_t>(0, expected);
          break;
        default:
          for (std::size_t i = property::one_of(12); i > 0; --i) spool->push(arrival(next++));
      }
    }
    while (!spool->empty()) read(5);
    property::require(expected == next, "all of it");
    property::require(spool->dropped() == 0, "none dropped");
  });
}

}  // namespace
}  // namespace loopwarden::spool_test
