// SPDX-License-Identifier: Apache-2.0
#include "daemon/evidence/evidence_store.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "base/clock.hpp"
#include "model/watch/limits.hpp"
#include "tests/support/biased_specialists.hpp"
#include "tests/support/device/foreign_process.hpp"
#include "tests/support/file_size_limit.hpp"
#include "tests/support/hung_disk.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/undeletable.hpp"

namespace loopwarden::evidence_test {
namespace {

namespace fs = std::filesystem;
using alarm::AlarmKind;
using daemon::EvidenceStore;
using evidence::Evidence;
using evidence::EvidenceError;
using evidence::read_evidence;
using evidence::specialists_of;
using evidence::write_evidence;

Evidence example(std::int64_t raised_ms = 1'800'000'000'123) {
  Evidence e;
  e.loop = "FIC-101";
  e.alarm = AlarmKind::backlash;
  e.raised_ms = raised_ms;
  for (std::size_t k = 0; k < alarm::kWindowSamples; ++k) {
    const double x = 0.1 * static_cast<double>(k);
    e.sp.push_back(5.0 + x / 3.0);
    e.pv.push_back(std::sin(x));
    e.co.push_back(std::cos(x) / 7.0);
    e.stem.push_back(1.0 / (1.0 + x));
  }
  e.sample_time_s = 0.1;
  e.pv_low = -1.0;
  e.pv_high = 1.0;
  e.co_low = 4.0;
  e.co_high = 20.0;
  e.measures.oscillation_index = 1.0 / 3.0;
  e.measures.stick_source = alarm::StickSource::ellipse;
  e.measures.bridged_cycles = 3;
  e.judgement.result = alarm::WindowJudgement::Result::fault;
  e.judgement.fault = AlarmKind::backlash;
  e.judgement.severity_percent = 1e-300;
  e.judgement.probability = {0.1, 0.7, 0.05, 1.0 / 7.0, 0.0};
  e.judgement.errors = {1.0, 2.0, 1.0 / 3.0, 4.0, 5.0, 6.0};
  e.version = "1.2.3";
  e.config_hash = 0xDEADBEEF;
  e.loop_file = "/etc/\"odd\" name";
  e.specialists_folder = "plant";
  e.specialists_hash = 7;
  return e;
}

Evidence routine_example() {
  Evidence e = example();
  for (std::vector<double>* column : {&e.sp, &e.pv, &e.co, &e.stem}) {
    column->resize(watch::WatchLimits::kRoutineSamples);
    for (double& v : *column) v = static_cast<double>(static_cast<float>(v));
  }
  e.stem.assign(e.pv.size(), std::nan(""));
  e.sample_time_s = 4.0;
  e.routine = watch::RoutineWatch::Judgement{
      .window_s = 3000.0,
      .verdict = diagnosis::DiagnosisVerdict::valve_effect,
      .grade = diagnosis::Grade::seen,
      .probability = 0.9,
      .evidence = {.log_odds = 1.0 / 3.0, .share = 0.4, .explained = 0.2, .standing = 0.875},
      .sum_before = 2.1,
      .from_specialists = -0.7,
      .sum = 3.3,
      .fault = AlarmKind::backlash,
      .severity_percent = 1.0 / 7.0};
  e.specialists_folder.clear();
  return e;
}

config::SpecialistFolder specialists() {
  const tests::TemporaryFolder folder;
  tests::write_biased_specialists(folder.path(), specialist::Condition::backlash);
  return *config::read_specialists(folder.path());
}

std::vector<std::string> names(const fs::path& folder) {
  std::vector<std::string> found;
  if (!fs::exists(folder)) return found;
  for (const auto& entry : fs::directory_iterator(folder)) found.push_back(entry.path().filename());
  return found;
}

}  // namespace

TEST_CASE("evidence is read back bit for bit, with specialists that can be loaded", "[evidence]") {
  const tests::TemporaryFolder folder;
  Evidence e = example();
  const bool has_stem = GENERATE(true, false);
  if (!has_stem) e.stem.assign(e.stem.size(), std::nan(""));
  const config::SpecialistFolder judges = specialists();
  write_evidence(e, &judges, folder / "one");
  CHECK(names(folder.path()) == std::vector<std::string>{"one"});
  const Evidence back = read_evidence(folder / "one");
  CHECK(back.loop == e.loop);
  CHECK(back.alarm == e.alarm);
  CHECK(back.raised_ms == e.raised_ms);
  CHECK(back.sp == e.sp);
  CHECK(back.pv == e.pv);
  CHECK(back.co == e.co);
  if (has_stem) CHECK(back.stem == e.stem);
  CHECK(std::isnan(back.stem.front()) == !has_stem);
  CHECK(back.co_low == 4.0);
  CHECK(back.judgement == e.judgement);
  CHECK(back.measures.oscillation_index == e.measures.oscillation_index);
  CHECK(back.measures.stick_source == e.measures.stick_source);
  CHECK(back.measures.bridged_cycles == 3);
  CHECK(back.config_hash == e.config_hash);
  CHECK(back.loop_file == e.loop_file);
  CHECK(back.specialists_hash == 7);
  const auto loaded = config::read_specialists(specialists_of(folder / "one"));
  REQUIRE(loaded);
  CHECK(loaded->team->members[2].network.layers[2].bias[0] == 12.0);
}

TEST_CASE("routine evidence is read back bit for bit, and has no specialists", "[evidence]") {
  const tests::TemporaryFolder folder;
  const Evidence e = routine_example();
  write_evidence(e, nullptr, folder / "one");
  CHECK_FALSE(fs::exists(specialists_of(folder / "one")));
  const Evidence back = read_evidence(folder / "one");
  REQUIRE(back.routine);
  CHECK(back.pv == e.pv);
  CHECK(back.co == e.co);
  CHECK(back.routine->window_s == 750.0 * 4.0);
  CHECK(back.routine->verdict == diagnosis::DiagnosisVerdict::valve_effect);
  CHECK(back.routine->grade == diagnosis::Grade::seen);
  CHECK(back.routine->fault == AlarmKind::backlash);
  CHECK(back.routine->probability == e.routine->probability);
  CHECK(back.routine->severity_percent == e.routine->severity_percent);
  CHECK(back.routine->evidence.log_odds == e.routine->evidence.log_odds);
  CHECK(back.routine->evidence.share == e.routine->evidence.share);
  CHECK(back.routine->evidence.explained == e.routine->evidence.explained);
  CHECK(back.routine->evidence.standing == e.routine->evidence.standing);
  CHECK(back.routine->sum_before == e.routine->sum_before);
  CHECK(back.routine->from_specialists == e.routine->from_specialists);
  CHECK(back.routine->sum == e.routine->sum);

  std::string about = tests::read_file(folder / "one/evidence.json");
  const std::string kind = "\"kind\": \"routine\"";
  about.replace(about.find(kind), kind.size(), "\"kind\": \"dream\"");
  tests::write_file(folder / "one/evidence.json", about);
  CHECK_THROWS_WITH(read_evidence(folder / "one"), Catch::Contains("unknown 'dream'"));
}

TEST_CASE("evidence of version 1, which had no kind, is read", "[evidence]") {
  const tests::TemporaryFolder folder;
  const config::SpecialistFolder judges = specialists();
  write_evidence(example(), &judges, folder / "one");
  std::string about = tests::read_file(folder / "one/evidence.json");
  for (const auto& [now, then] :
       {std::pair<std::string, std::string>{"\"format_version\": 3", "\"format_version\": 1"},
        {"\"kind\": \"window\",", ""}}) {
    REQUIRE(about.find(now) != std::string::npos);
    about.replace(about.find(now), now.size(), then);
  }
  tests::write_file(folder / "one/evidence.json", about);
  const Evidence back = read_evidence(folder / "one");
  CHECK_FALSE(back.routine);
  CHECK(back.judgement == example().judgement);
}

TEST_CASE("evidence that was changed is refused with a reason", "[evidence]") {
  const tests::TemporaryFolder folder;
  const config::SpecialistFolder judges = specialists();
  write_evidence(example(), &judges, folder / "one");
  std::string what;
  SECTION("a sample") {
    std::string record = tests::read_file(folder / "one/record.csv");
    record[record.size() - 3] ^= 1;
    tests::write_file(folder / "one/record.csv", record);
    what = "record.csv has been changed";
  }
  SECTION("the specialists") {
    tests::write_file(folder / "one/specialists/manifest.yaml", "format: other\n");
    what = "manifest.yaml has been changed";
  }
  SECTION("cut short") {
    tests::write_file(folder / "one/evidence.json", "{\"format\": ");
    what = "evidence.json";
  }
  SECTION("of another version") {
    tests::write_file(folder / "one/evidence.json",
                      R"({"format": "loopwarden-evidence", "format_version": 99})");
    what = "version 1 to 3";
  }
  CHECK_THROWS_WITH(read_evidence(folder / "one"), Catch::Contains(what));
  CHECK_THROWS_AS(read_evidence(folder / "nowhere"), EvidenceError);
}

TEST_CASE("the newest of each alarm is found, and old evidence is deleted", "[evidence]") {
  const tests::TemporaryFolder folder;
  EvidenceStore store({.folder = folder / "evidence", .most_kept = 3}, {{"plant", specialists()}},
                      [](const auto&, const auto&, const auto&) {});
  store.start();
  for (int i = 0; i < 5; ++i) {
    Evidence e = example(1'800'000'000'000 + 1000 * i);
    if (i == 3) e.loop = "A-FIC-101";  // its name ends like the other's
    store.post(std::move(e));
  }
  REQUIRE(test::eventually([&] { return store.status().written == 5; }));
  CHECK(names(folder / "evidence").size() == 3);
  const auto newest = store.newest("FIC-101", AlarmKind::backlash);
  REQUIRE(newest);
  CHECK(read_evidence(*newest).raised_ms == 1'800'000'004'000);
  CHECK(read_evidence(*store.newest("A-FIC-101", AlarmKind::backlash)).loop == "A-FIC-101");
  CHECK_FALSE(store.newest("FIC-101", AlarmKind::stiction));
  CHECK_FALSE(store.newest("FIC-1", AlarmKind::backlash));
}

TEST_CASE("evidence of an alarm that joins an incident is in the folder of the first alarm",
          "[evidence]") {
  const tests::TemporaryFolder folder;
  std::vector<fs::path> told;
  EvidenceStore store(
      {.folder = folder / "evidence"}, {{"plant", specialists()}},
      [&](const auto&, const fs::path& place, const auto&) { told.push_back(place); });
  store.start();
  constexpr std::int64_t kOpened_ms = 1'800'000'000'000;
  const auto post = [&](AlarmKind alarm, std::int64_t after_ms, const std::string& loop,
                        std::int64_t incident_ms) {
    Evidence e = example(kOpened_ms + after_ms);
    e.alarm = alarm;
    e.loop = loop;
    e.incident_ms = incident_ms;
    store.post(std::move(e));
  };
  post(AlarmKind::backlash, -5'000'000, "FIC-101", kOpened_ms - 5'000'000);  // an earlier one
  post(AlarmKind::hysteresis, 0, "FIC-101", kOpened_ms);
  post(AlarmKind::stiction, 10, "A-FIC-101", kOpened_ms);  // another loop
  post(AlarmKind::unknown, 0, "FIC-101", kOpened_ms);      // from the same window
  for (int i = 1; i < 12; ++i) post(AlarmKind::backlash, 1000 * i, "FIC-101", kOpened_ms);
  REQUIRE(test::eventually([&] { return store.status().written == 15; }));
  store.stop();
  CHECK(names(folder / "evidence").size() == 3);
  const fs::path first = *store.newest("FIC-101", AlarmKind::hysteresis);
  CHECK(first.parent_path() == folder / "evidence");
  CHECK_FALSE(store.newest("FIC-101", AlarmKind::unknown));  // eight newer alarms joined
  const fs::path joined = *store.newest("FIC-101", AlarmKind::backlash);
  CHECK(joined.parent_path() == first);
  CHECK(told.back() == joined);
  CHECK(read_evidence(joined).raised_ms == kOpened_ms + 11'000);
  CHECK(read_evidence(first).raised_ms == kOpened_ms);
  const auto there = names(first);
  CHECK(std::count_if(there.begin(), there.end(), [](const std::string& name) {
          return name.ends_with("-backlash");
        }) == EvidenceStore::kMostJoined);
}

TEST_CASE("evidence with a date in the future does not hide or remove later evidence",
          "[evidence]") {
  const tests::TemporaryFolder folder;
  EvidenceStore store({.folder = folder / "evidence", .most_kept = 2}, {{"plant", specialists()}},
                      [](const auto&, const auto&, const auto&) {});
  store.start();
  const std::int64_t now_ms = base::utc_ms();
  const std::int64_t ahead_ms = now_ms + 1'000'000'000;
  const auto post = [&](std::int64_t raised_ms, std::int64_t incident_ms) {
    Evidence e = example(raised_ms);
    e.incident_ms = incident_ms;
    store.post(std::move(e));
  };
  post(ahead_ms, ahead_ms);
  post(now_ms - 5000, ahead_ms);  // joins after the clock was set back
  post(now_ms - 4000, now_ms - 4000);
  post(now_ms - 3000, now_ms - 3000);
  REQUIRE(test::eventually([&] { return store.status().written == 4; }));
  store.stop();
  const fs::path newest = *store.newest("FIC-101", AlarmKind::backlash);
  CHECK(newest.parent_path() == folder / "evidence");  // for an incident with its own folder
  CHECK(read_evidence(newest).raised_ms == now_ms - 3000);
  CHECK(names(folder / "evidence").size() == 2);
}

TEST_CASE("an old folder that can't be deleted is reported once, and delays no new evidence",
          "[evidence]") {
  const tests::TemporaryFolder folder;
  std::vector<std::string> told;
  std::vector<std::string> stays;
  EvidenceStore store(
      {.folder = folder / "evidence", .most_kept = 3}, {{"plant", specialists()}},
      [&](const Evidence&, const fs::path&, const std::string& why) { told.push_back(why); },
      [&](const std::string& why) { stays.push_back(why); });
  store.start();
  store.post(example(1'800'000'000'000));
  REQUIRE(test::eventually([&] { return store.status().written == 1; }));
  const fs::path oldest = *store.newest("FIC-101", AlarmKind::backlash);
  {
    const tests::Undeletable kept(oldest);
    for (int i = 1; i < 7; ++i) store.post(example(1'800'000'000'000 + 1000 * i));
    REQUIRE(test::eventually([&] { return store.status().written == 7; }));
    CHECK(store.status().error.empty());
    CHECK_THAT(store.status().removal_error, Catch::Contains(oldest.filename().string()));
    CHECK(read_evidence(*store.newest("FIC-101", AlarmKind::backlash)).raised_ms ==
          1'800'000'006'000);
    CHECK(names(folder / "evidence").size() == 4);  // the others were deleted as usual
    CHECK(fs::exists(oldest));
  }
  store.post(example(1'800'000'007'000));
  REQUIRE(test::eventually([&] { return store.status().written == 8; }));
  store.stop();
  CHECK(store.status().removal_error.empty());
  CHECK(names(folder / "evidence").size() == 3);
  CHECK(stays.size() == 1);
  CHECK(told == std::vector<std::string>(8));
}

TEST_CASE("a full disk: reported once, no partial file, and written when there is room",
          "[evidence]") {
  const tests::TemporaryFolder folder;
  std::vector<std::string> told;
  {
    EvidenceStore store(
        {.folder = folder / "evidence", .most_waiting = 2, .retry = std::chrono::milliseconds(10)},
        {{"plant", specialists()}},
        [&](const Evidence&, const fs::path&, const std::string& why) { told.push_back(why); });
    {
      const tests::FileSizeLimit full(2000);
      store.start();
      store.post(example(1));
      REQUIRE(test::eventually([&] { return !store.status().error.empty(); }));
      store.post(example(2));
      store.post(example(3));
      CHECK(store.status().waiting == 2);
      CHECK(store.status().lost == 1);
      CHECK(store.status().written == 0);
    }
    REQUIRE(test::eventually([&] { return store.status().written == 2; }));
    CHECK(store.status().error.empty());
    CHECK(read_evidence(*store.newest("FIC-101", AlarmKind::backlash)).raised_ms == 3);
    store.stop();
  }
  REQUIRE(told.size() == 3);
  CHECK_FALSE(told[0].empty());
  CHECK(told[1].empty());
  for (const std::string& name : names(folder / "evidence")) CHECK(name.front() != '.');
}

TEST_CASE(
    "a hung disk: the poster continues, the status reports it, and the evidence is written in the "
    "end",
    "[evidence][disk]") {
  const tests::TemporaryFolder folder;
  EvidenceStore store({.folder = folder / "evidence", .most_waiting = 3},
                      {{"plant", specialists()}},
                      [](const Evidence&, const fs::path&, const std::string&) {});
  store.start();
  tests::HungDisk disk(folder.path());
  for (int i = 0; i < 6; ++i) store.post(example(1'700'000'000'000 + i));
  REQUIRE(test::eventually([&] { return disk.waiting() > 0; }));
  CHECK(store.status().waiting == 3);
  CHECK(store.status().lost == 3);
  CHECK_FALSE(store.stop_for(std::chrono::milliseconds(20)));
  REQUIRE(test::eventually([&] { return !store.status().error.empty(); }));
  CHECK_THAT(store.status().error, Catch::Contains("has not answered"));
  disk.release();
  CHECK(store.stop_for(std::chrono::milliseconds(10'000)));
  CHECK(store.status().written == 3);
  CHECK(store.status().error.empty());
}

TEST_CASE("routine evidence waits for no specialists", "[evidence]") {
  const tests::TemporaryFolder folder;
  EvidenceStore store({.folder = folder / "evidence"}, {},
                      [](const Evidence&, const fs::path&, const std::string&) {});
  store.start();
  store.post(routine_example());
  REQUIRE(test::eventually([&] { return store.status().written == 1; }));
  CHECK(read_evidence(*store.newest("FIC-101", AlarmKind::backlash)).routine);
}

TEST_CASE("evidence that is not kept is not written", "[evidence]") {
  const tests::TemporaryFolder folder;
  EvidenceStore store({.folder = folder / "evidence", .most_kept = 0}, {}, {});
  store.start();
  store.post(example());
  store.stop();
  CHECK_FALSE(fs::exists(folder / "evidence"));
}

TEST_CASE("evidence of a twin is read back bit for bit, whatever its length", "[evidence]") {
  const tests::TemporaryFolder folder;
  Evidence e = example();
  e.alarm = AlarmKind::model_gap;
  e.by_twin = loopwarden::evidence::TwinFinding{1.0 / 3.0, 7.5};
  e.specialists_folder.clear();
  e.twin = "sample_time: 0.1\n";
  for (std::vector<double>* column : {&e.sp, &e.pv, &e.co, &e.stem}) column->resize(333);
  e.pv[5] = std::nan("");
  write_evidence(e, nullptr, folder / "one");
  CHECK_FALSE(fs::exists(specialists_of(folder / "one")));
  const Evidence back = read_evidence(folder / "one");
  REQUIRE(back.by_twin);
  CHECK_FALSE(back.by_specialists());
  CHECK(back.by_twin->change == e.by_twin->change);
  CHECK(back.by_twin->controller == e.by_twin->controller);
  // The controller of a loop that runs here is not watched.
  e.by_twin->controller = std::nan("");
  write_evidence(e, nullptr, folder / "two");
  CHECK(std::isnan(read_evidence(folder / "two").by_twin->controller));
  CHECK(back.alarm == AlarmKind::model_gap);
  CHECK(back.co == e.co);
  CHECK(std::isnan(back.pv[5]));
  CHECK(tests::read_file(folder / "one/twin.yaml") == e.twin);
  tests::write_file(folder / "one/twin.yaml", "sample_time: 0.2\n");
  CHECK_THROWS_WITH(read_evidence(folder / "one"), Catch::Contains("twin.yaml has been changed"));
}

}  // namespace loopwarden::evidence_test
