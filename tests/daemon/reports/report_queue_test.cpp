// SPDX-License-Identifier: Apache-2.0
// A script replaces `loopwarden` here. The tests check its arguments, its exit and its duration.
#include "daemon/reports/report_queue.hpp"

#include <catch2/catch.hpp>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/temporary_folder.hpp"

namespace loopwarden::daemon::reports::report_queue_test {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

constexpr std::int64_t kNow_ms = 1'800'000'000'000;

// Sets $OUT to the folder of `--out` or `--report`.
constexpr const char* kOut =
    "for w in \"$@\"; do case $w in --out=*.html|--report=*) OUT=$(dirname ${w#*=});; --out=*) "
    "OUT=${w#--out=};; esac; done\n";

bool go_on(milliseconds) {
  std::this_thread::sleep_for(milliseconds(1));
  return false;
}

struct Bench {
  explicit Bench(const std::string& script) {
    settings.program = folder / "fake";
    settings.folder = folder / "reports";
    settings.socket = "/run/x/control.sock";
    std::ofstream(settings.program) << "#!/bin/sh\n" << kOut << script << "\n";
    fs::permissions(settings.program, fs::perms::owner_all);
  }
  ReportQueue make() {
    return {settings,
            {.now_ms = [this] { return now_ms += 1000; },
             .wake = [this] { ++woken; },
             .ended = [this](const Report& report) { ended.push_back(report); },
             .in_use = [this](const fs::path& one) { return one == in_use; }}};
  }
  fs::path folder_of(const Report& report) const { return settings.folder / report.name; }

  tests::TemporaryFolder folder;
  QueueSettings settings;
  std::int64_t now_ms = kNow_ms;
  int woken = 0;
  fs::path in_use;
  std::vector<Report> ended;
};

Order command_of(const std::string& loop, Kind kind = Kind::gap, std::string twin = {}) {
  return {.loop = loop,
          .kind = kind,
          .from_ms = 1'799'990'000'123,
          .to_ms = 1'799'999'000'000,
          .by = "ella@10.0.0.5 by page (uid 997)",
          .twin = std::move(twin)};
}

std::vector<std::string> names(const std::vector<Report>& reports) {
  std::vector<std::string> all;
  for (const Report& report : reports) all.push_back(report.name);
  return all;
}

}  // namespace

TEST_CASE("a report is made by the command of its kind, with only its own arguments", "[reports]") {
  using Row = std::tuple<Kind, std::string, std::string, std::string>;
  const auto [kind, page, twin, more] = GENERATE(table<Kind, std::string, std::string, std::string>(
      {Row{Kind::gap, "report.html", "", "--out=OUT\n"},
       Row{Kind::receipt, "report.html", "/t/twin.yaml",
           "--out=OUT/report.html\n--model=/t/twin.yaml\n"},
       Row{Kind::gap, "report.html", "/t/twin.yaml", "--out=OUT\n--model=/t/twin.yaml\n"},
       Row{Kind::commission, "report.html", "/t/twin.yaml", "--out=OUT\n--again=/t/twin.yaml\n"},
       Row{Kind::survey, "survey.html", "/t/twin.yaml", "--out=OUT\n"},
       Row{Kind::diagnose, "report.html", "/t/twin.yaml", "--report=OUT/report.html\n"}}));
  Bench bench(
      "printf '%s\\n' \"$@\" > \"$OUT/words\"; mkdir \"$OUT/records\"; echo $TMPDIR > "
      "\"$TMPDIR/x\"; echo '<title>' > \"$OUT/" +
      page + "\"\necho 'progress: gap 99 %' >&2; echo assumed: a >&2; echo 'The valve sticks.'");
  ReportQueue queue = bench.make();
  const auto posted = queue.post(command_of("FIC-101", kind, twin));
  REQUIRE(posted);
  CHECK(posted->name == std::string("FIC-101-") + to_text(kind) + "-20270115T080001000Z");
  CHECK(bench.woken == 1);
  REQUIRE(queue.run_next(go_on));
  CHECK_FALSE(queue.run_next(go_on));
  REQUIRE(bench.ended.size() == 1);
  const Report& report = bench.ended.front();
  CHECK(report.state == State::done);
  CHECK(report.sentence == "The valve sticks.");
  CHECK(report.has_page);
  CHECK(report.started_ms == kNow_ms + 2000);
  CHECK(report.ended_ms == kNow_ms + 3000);
  const fs::path out = bench.folder_of(report);
  std::string words = tests::read_file(out / "words");
  for (std::size_t at = 0; (at = words.find(out.string())) != std::string::npos;) {
    words.replace(at, out.string().size(), "OUT");
  }
  CHECK(words == std::string(to_text(kind)) +
                     "\n--background\n--loop=FIC-101\n--since=2027-01-15T05:13:20.123Z\n"
                     "--until=2027-01-15T07:43:20.000Z\n--socket=/run/x/control.sock\n" +
                     more);
  // Its working files are deleted.
  CHECK_FALSE(fs::exists(out / "records"));
  CHECK_FALSE(fs::exists(out / "tmp"));
}

TEST_CASE("a failed report has the reason in the command's own words", "[reports]") {
  const auto [script, why, page] = GENERATE(table<std::string, std::string, bool>(
      {{"echo 'progress: gap 3 %' >&2; echo \"$OUT/records/r.csv: no movement\" >&2; exit 65",
        "records/r.csv: no movement", false},
       {"echo '<title>' > \"$OUT/report.html\"; echo no >&2; exit 65", "no", true},
       {"exit 74", "loopwarden gap ended with 74", false},
       {"kill -9 $$", "loopwarden gap ended with 137", false},
       {"printf 'a\\033b\\n'; exit 1", "a b", false},
       {"echo all is well", "it wrote no report", false}}));
  Bench bench(script);
  ReportQueue queue = bench.make();
  queue.post(command_of("FIC-101"));
  REQUIRE(queue.run_next(go_on));
  const Report report = queue.of("FIC-101")->front();
  CHECK(report.state == State::failed);
  CHECK(report.sentence == why);
  CHECK(report.has_page == page);
}

TEST_CASE("a report that takes too long is ended, and its files are deleted", "[reports]") {
  Bench bench("echo half > \"$OUT/half\"; exec sleep 600");
  bench.settings.most_time = milliseconds(500);
  ReportQueue queue = bench.make();
  queue.post(command_of("FIC-101"));
  REQUIRE(queue.run_next(go_on));
  const Report report = queue.of("FIC-101")->front();
  CHECK(report.state == State::failed);
  CHECK_THAT(report.sentence, Catch::Contains("a shorter stretch takes less"));
  CHECK_FALSE(fs::exists(bench.folder_of(report) / "half"));
}

TEST_CASE("without the program a report fails", "[reports]") {
  Bench bench("");
  bench.settings.program = bench.folder / "nowhere";
  ReportQueue queue = bench.make();
  queue.post(command_of("FIC-101"));
  REQUIRE(queue.run_next(go_on));
  CHECK(queue.of("FIC-101")->front().state == State::failed);
  CHECK_THAT(queue.of("FIC-101")->front().sentence, Catch::Contains("nowhere"));
}

TEST_CASE("four reports wait, each at its position, and the fifth is refused", "[reports]") {
  Bench bench("sleep 0.5; echo '<title>' > \"$OUT/report.html\"");
  ReportQueue queue = bench.make();
  std::vector<std::string> order;
  for (const char* loop : {"FIC-101", "FIC-102", "FIC-101", "FIC-101"}) {
    const auto posted = queue.post(command_of(loop));
    REQUIRE(posted);
    CHECK(posted->place == order.size() + 1);
    order.push_back(posted->name);
  }
  CHECK_FALSE(queue.post(command_of("FIC-103")));
  CHECK(bench.woken == 4);
  // The report that is being made does not count as waiting.
  std::vector<Report> meanwhile;
  bool has_room = false;
  REQUIRE(queue.run_next([&](milliseconds patience) {
    if (meanwhile.empty()) {
      meanwhile = *queue.of("FIC-101");
      has_room = queue.post(command_of("FIC-104")).has_value();
    }
    return go_on(patience);
  }));
  REQUIRE(meanwhile.size() == 3);
  CHECK(names(meanwhile) == std::vector{order[3], order[2], order[0]});
  CHECK(meanwhile[0].place == 3);
  CHECK(meanwhile[1].place == 2);
  CHECK(meanwhile[2].state == State::running);
  CHECK(meanwhile[2].place == 0);
  CHECK(has_room);
  while (queue.run_next(go_on)) {
  }
  REQUIRE(bench.ended.size() == 5);
  CHECK(names({bench.ended.begin(), bench.ended.begin() + 4}) == order);
}

TEST_CASE("two reports of one millisecond have different names", "[reports]") {
  Bench bench("");
  ReportQueue queue{bench.settings,
                    {.now_ms = [] { return kNow_ms; },
                     .wake = [] {},
                     .ended = [](const Report&) {},
                     .in_use = [](const fs::path&) { return false; }}};
  const auto one = queue.post(command_of("FIC-101"));
  const auto other = queue.post(command_of("FIC-101"));
  CHECK(one->name != other->name);
}

TEST_CASE("a report that is stopped restarts, before later ones", "[reports]") {
  Bench bench(
      "if [ -e \"$OUT/../second\" ]; then echo '<title>' > \"$OUT/report.html\"; else "
      "touch \"$OUT/half\" \"$OUT/../second\"; exec sleep 600; fi");
  ReportQueue queue = bench.make();
  const auto first = queue.post(command_of("FIC-101"));
  queue.post(command_of("FIC-101"));
  const fs::path second = bench.settings.folder / "second";
  REQUIRE(queue.run_next([&](milliseconds) { return fs::exists(second); }));
  CHECK(bench.ended.empty());
  const Report again = queue.of("FIC-101")->back();
  CHECK(again.state == State::waiting);
  CHECK(again.place == 1);
  CHECK_FALSE(fs::exists(bench.folder_of(again) / "half"));
  REQUIRE(queue.run_next(go_on));
  REQUIRE(bench.ended.size() == 1);
  CHECK(bench.ended.front().name == first->name);
  CHECK(bench.ended.front().state == State::done);
}

TEST_CASE("a receipt waits for its time, also over a restart, and later work delays it",
          "[reports]") {
  Bench bench("echo 'FIC-101: repaired.'; touch $OUT/report.html");
  const auto due_in = [&](std::int64_t ms) {
    Order order = command_of("FIC-101", Kind::receipt);
    order.due_ms = order.to_ms = bench.now_ms + ms;
    return order;
  };
  {
    ReportQueue queue = bench.make();
    queue.post_later(due_in(1'000'000));
    queue.post_later(due_in(2'000'000));
    CHECK_FALSE(queue.run_next(go_on));
    const auto reports = queue.of("FIC-101").value();
    REQUIRE(reports.size() == 1);
    CHECK(reports[0].place == 0);
    CHECK(reports[0].order.due_ms > kNow_ms + 1'900'000);
    // It takes no place in the queue.
    CHECK(queue.post(command_of("FIC-101"))->place == 1);
    CHECK(queue.run_next(go_on));
    bench.woken = 0;
    queue.look_at_due();
    CHECK(bench.woken == 0);
  }
  ReportQueue queue = bench.make();
  CHECK_FALSE(queue.run_next(go_on));
  bench.now_ms += 3'000'000;
  queue.look_at_due();
  CHECK(bench.woken == 1);
  CHECK(queue.run_next(go_on));
  const auto reports = queue.of("FIC-101").value();
  REQUIRE(reports.size() == 2);
  CHECK(reports[1].state == State::done);
  CHECK(reports[1].order.kind == Kind::receipt);
  CHECK(reports[1].sentence == "FIC-101: repaired.");
}

TEST_CASE("the progress of a report is shown while it is made", "[reports]") {
  Bench bench("echo 'progress: what can be seen 41 %' >&2; echo note >&2; exec sleep 600");
  ReportQueue queue = bench.make();
  queue.post(command_of("FIC-101"));
  Report seen;
  queue.run_next([&](milliseconds patience) {
    seen = queue.of("FIC-101")->front();
    go_on(patience);
    return !seen.doing.empty();
  });
  CHECK(seen.doing == "what can be seen");
  CHECK(seen.percent == 41);
}

TEST_CASE("the newest reports of a loop are kept, and those that its loops use", "[reports]") {
  Bench bench("echo '<title>' > \"$OUT/report.html\"");
  bench.settings.kept = 2;
  ReportQueue queue = bench.make();
  std::vector<Report> made;
  for (const char* loop : {"FIC-101", "FIC-102", "FIC-101", "FIC-101", "FIC-101"}) {
    made.push_back(*queue.post(command_of(loop)));
    if (made.size() == 1) bench.in_use = bench.folder_of(made.front());
    REQUIRE(queue.run_next(go_on));
  }
  CHECK(names(*queue.of("FIC-101")) == names(std::vector{made[4], made[3], made[0]}));
  CHECK(names(*queue.of("FIC-102")) == names({made[1]}));
  CHECK(fs::exists(bench.folder_of(made[0])));
  CHECK_FALSE(fs::exists(bench.folder_of(made[2])));
  CHECK(fs::exists(bench.folder_of(made[4])));
}

TEST_CASE("a restart knows the reports, and marks those that it ended as failed", "[reports]") {
  Bench bench(
      "if [ $1 = survey ]; then echo x > \"$OUT/half\"; exec sleep 600; fi; echo "
      "'<title>' > \"$OUT/report.html\"; echo fine");
  {
    ReportQueue queue = bench.make();
    queue.post(command_of("FIC-101"));
    REQUIRE(queue.run_next(go_on));
    queue.post(command_of("FIC-101", Kind::survey));
    queue.post(command_of("FIC-101", Kind::diagnose));
    // As a daemon that is killed: what it leaves on the disk is what was there while it worked.
    REQUIRE(queue.run_next([&](milliseconds patience) {
      go_on(patience);
      const auto all = *queue.of("FIC-101");
      if (!fs::exists(bench.folder_of(all[1]) / "half")) return false;
      fs::copy(bench.settings.folder, bench.folder / "killed", fs::copy_options::recursive);
      return true;
    }));
  }
  tests::write_file(bench.folder / "killed/own/report.html", "of somebody's own");
  tests::write_file(bench.folder / "killed/FIC-101-gap-x/about.json", "{\"name\": 3}");
  bench.settings.folder = bench.folder / "killed";
  ReportQueue after = bench.make();
  CHECK_FALSE(after.of("FIC-101"));
  const auto asked = after.post(command_of("FIC-101"));
  REQUIRE(after.run_next(go_on));
  const std::vector<Report> all = after.of("FIC-101").value();
  REQUIRE(all.size() == 4);
  CHECK(all[0].name == asked->name);
  CHECK(all[0].state == State::done);
  for (const std::size_t lost : {1U, 2U}) {
    CHECK(all[lost].state == State::failed);
    CHECK(all[lost].sentence == "The daemon was restarted before it was done.");
    CHECK(read_about(bench.folder_of(all[lost]))->state == State::failed);
  }
  CHECK(all[3].state == State::done);
  CHECK(all[3].sentence == "fine");
  CHECK(all[3].has_page);
  CHECK(all[3].order.from_ms == command_of("").from_ms);
  CHECK(all[3].order.by == command_of("").by);
  CHECK_FALSE(fs::exists(bench.folder_of(all[2]) / "half"));
  CHECK(fs::exists(bench.settings.folder / "own/report.html"));
}

}  // namespace loopwarden::daemon::reports::report_queue_test
