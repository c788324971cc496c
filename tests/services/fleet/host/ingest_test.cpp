// SPDX-License-Identifier: Apache-2.0
#include "services/fleet/host/ingest.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "services/database/array_text.hpp"
#include "tests/services/fleet/host/messages.hpp"
#include "tests/support/property.hpp"

namespace loopwarden::ingest_test {
namespace {

using fleet::Arrival;
using fleet::Batch;
using fleet::Ingest;
using sparkplug::DataType;
using tests::EdgeMessages;
using tests::metric;
namespace property = tests::property;

constexpr std::int64_t kNow = 1'000'000;

Batch taken(Ingest& ingest, const std::vector<Arrival>& arrivals, std::int64_t now_ms = kNow) {
  Batch batch = ingest.prepare(arrivals, now_ms);
  ingest.commit(batch);
  return batch;
}

TEST_CASE("births and data become rows that name metric, time and value") {
  EdgeMessages edge;
  Ingest ingest;
  const Batch batch = taken(ingest, {edge.nbirth(), edge.dbirth(), edge.pv(2.5)});
  REQUIRE(batch.books.size() == 2);
  const fleet::DeviceBook& loop = *batch.books[1].second;
  CHECK(loop.device == "FIC-101");
  CHECK(loop.tag == "10-FIC/101");
  CHECK(loop.metrics[0].unit == "L/min");
  CHECK(loop.metrics[0].high == 10.0);
  const fleet::ValueRow& newest = batch.rows.values.back();
  CHECK(newest.book->metrics[newest.metric].name == "pv");
  CHECK(newest.number == 2.5);
  CHECK_FALSE(newest.of_birth);
  CHECK(newest.time_ms == static_cast<std::int64_t>(tests::kNoon) + 2);
  CHECK(batch.events.size() == 2);
  CHECK(batch.edges.begin()->second.position.seq == 2);
  CHECK(batch.ask_rebirth.empty());
}

TEST_CASE("edge nodes of a group are accepted up to the limit, and each counts once") {
  Ingest ingest({}, 3);
  std::vector<EdgeMessages> edges;
  for (const char* name : {"1", "2", "3", "4"}) edges.emplace_back(name);
  taken(ingest, {edges[0].nbirth(), edges[1].nbirth()});
  // Two known nodes that publish leave room for a third, and not for a fourth.
  const Batch batch = taken(ingest, {edges[0].nbirth(), edges[1].nbirth(), edges[2].nbirth(),
                                     edges[2].dbirth(), edges[3].nbirth()});
  CHECK(batch.counts.garbage == 1);
  CHECK(ingest.edges().size() == 3);
  CHECK(ingest.edges().contains({"A", "3"}));
}

TEST_CASE("an alarm has the time of its raising, not that of the birth") {
  EdgeMessages edge;
  Ingest ingest;
  const std::uint64_t since = tests::kNoon - 600'000;
  const auto alarm = [&](const char* state, sparkplug::Value raised) {
    return std::vector<sparkplug::Metric>{
        metric("alarm/stiction/state", DataType::string, std::string(state)),
        metric("alarm/stiction/since", DataType::date_time, std::move(raised))};
  };
  const auto rows = [&](const std::vector<Arrival>& arrivals) {
    std::vector<std::pair<std::string, std::int64_t>> all;
    for (const fleet::AlarmRow& row : taken(ingest, arrivals).rows.alarms) {
      all.emplace_back(row.state, row.time_ms - static_cast<std::int64_t>(tests::kNoon));
    }
    return all;
  };
  using Rows = std::vector<std::pair<std::string, std::int64_t>>;
  CHECK(rows({edge.nbirth(), edge.birth_of(alarm("acknowledged", since))}) ==
        Rows{{"unacknowledged", -600'000}, {"acknowledged", 1}});
  CHECK(rows({edge.birth_of(alarm("unacknowledged", since))}) ==
        Rows{{"unacknowledged", -600'000}, {"unacknowledged", 2}});
  // Cleared long ago, raised by a wrong clock, or never raised.
  CHECK(rows({edge.birth_of(alarm("normal", since))}) == Rows{{"normal", 3}});
  CHECK(rows({edge.birth_of(alarm("acknowledged", tests::kNoon + 600'000))}) ==
        Rows{{"acknowledged", 4}});
  CHECK(rows({edge.birth_of(alarm("suppressed", {}))}) == Rows{{"suppressed", 5}});
}

TEST_CASE("a box that refuses to send evidence names the evidence and the reason") {
  EdgeMessages edge;
  Ingest ingest;
  const auto said = [&](const char* text) {
    return edge.data({metric("order/result", DataType::string, std::string(text))});
  };
  taken(ingest,
        {edge.nbirth(), edge.birth_of({metric("order/result", DataType::string, std::string())})});
  const Batch batch =
      taken(ingest, {said("request/evidence stiction: refused: no such evidence"),
                     said("request/evidence e1: left out: a is larger than 1 bytes"),
                     said("sp 5: refused: the loop is in manual")});
  REQUIRE(batch.rows.refusals.size() == 1);
  CHECK(batch.rows.refusals[0].request == "stiction");
  CHECK(batch.rows.refusals[0].why == "no such evidence");
}

TEST_CASE("a batch that is not committed has no effect") {
  EdgeMessages edge;
  Ingest ingest;
  taken(ingest, {edge.nbirth(), edge.dbirth()});
  const Arrival value = edge.pv(2.0);
  CHECK(ingest.prepare({value}, kNow).rows.values.size() == 1);
  CHECK(ingest.prepare({value}, kNow).rows.values.size() == 1);
  CHECK(taken(ingest, {value}).rows.values.size() == 1);
  CHECK(taken(ingest, {value}).counts.duplicates == 1);
}

TEST_CASE("a device without a birth, an unknown alias and a lost message request a rebirth") {
  EdgeMessages edge;
  Ingest ingest;
  const Arrival birth = edge.nbirth();
  Batch batch = taken(ingest, {birth, edge.pv(1.0)});
  CHECK(batch.rows.values.size() == 2);  // the metrics of the box
  CHECK(batch.ask_rebirth.size() == 1);
  // A rebirth resolves the earlier message. A birth of the next connection would not.
  batch = taken(ingest, {edge.nbirth(), edge.dbirth(3.0)});
  CHECK(batch.counts.unborn == 0);
  const auto pv = std::find_if(batch.rows.values.begin(), batch.rows.values.end(),
                               [](const auto& row) { return row.number == 1.0; });
  CHECK(pv != batch.rows.values.end());
  EdgeMessages again;
  Ingest elsewhere;
  taken(elsewhere, {again.nbirth(), again.pv(1.0)});
  ++again.bd_seq;
  CHECK(taken(elsewhere, {again.nbirth(), again.dbirth(3.0)}).counts.unborn == 1);

  Ingest other;
  EdgeMessages second;
  taken(other, {second.nbirth(), second.dbirth()});
  batch = taken(other, {second.data({metric("", DataType::unknown, 1.0, tests::kNoon, 77)})});
  CHECK(batch.counts.unknown_metrics == 1);
  CHECK(batch.ask_rebirth.size() == 1);

  Ingest third;
  EdgeMessages lossy;
  taken(third, {lossy.nbirth(), lossy.dbirth()});
  lossy.skip();
  CHECK(taken(third, {lossy.pv(1.0)}, kNow).ask_rebirth.empty());
  // No message arrives any more. Only the time-out ends the wait.
  batch = taken(third, {}, kNow + 2000);
  CHECK(batch.rows.values.size() == 1);
  CHECK(batch.counts.missing == 1);
  CHECK(batch.ask_rebirth.size() == 1);
}

TEST_CASE("a host follows a node from birth to death") {
  EdgeMessages edge;
  edge.bd_seq = 3;
  Ingest ingest;
  const auto known = [&] { return ingest.edges().at({"A", "box1"}); };
  taken(ingest, {edge.nbirth(), edge.dbirth()});
  CHECK(known().tracker.born());
  CHECK(known().tracker.bd_seq() == 3);
  CHECK(known().books.contains("FIC-101"));
  Batch batch = taken(ingest, {edge.ddeath()});
  REQUIRE(batch.events.size() == 1);
  CHECK_FALSE(batch.events[0].online);
  CHECK_FALSE(batch.events[0].of_node);
  CHECK_FALSE(known().books.contains("FIC-101"));
  CHECK(taken(ingest, {edge.pv(1.0)}).ask_rebirth.size() == 1);
  taken(ingest, {edge.nbirth(), edge.dbirth()});
  // The will is of an older connection, so this one stays alive.
  edge.bd_seq = 2;
  CHECK(taken(ingest, {edge.ndeath()}).counts.old_deaths == 1);
  CHECK(known().tracker.born());
  edge.bd_seq = 3;
  batch = taken(ingest, {edge.ndeath()});
  REQUIRE(batch.events.size() == 1);
  CHECK(batch.events[0].of_node);
  CHECK_FALSE(known().tracker.born());
  CHECK(known().books.empty());
  const Batch command = taken(ingest, {{"spBv1.0/A/NCMD/box1", edge.ndeath().payload, 0, false}});
  CHECK(command.edges.empty());
  CHECK(command.counts.garbage == 0);
}

TEST_CASE("a value has the type that the birth gave its metric") {
  EdgeMessages edge;
  Ingest ingest;
  taken(ingest, {edge.nbirth(), edge.birth_of({metric("level", DataType::int16, {}, {}, 7)})});
  const Batch batch =
      taken(ingest, {edge.data({metric("", DataType::unknown, std::uint64_t{0xFFFFFFFF}, {}, 7)})});
  REQUIRE(batch.rows.values.size() == 1);
  CHECK(batch.rows.values[0].number == -1.0);
}

TEST_CASE("invalid metrics of a birth are left out: no name, no type, a name or an alias twice") {
  const auto book = fleet::book_of(
      "d", {metric("a", DataType::int8, {}, {}, 1), metric("", DataType::int8, {}, {}, 2),
            metric("b", DataType::unknown, {}, {}, 3), metric("c", DataType::int8, {}, {}, 1),
            metric("a", DataType::int16, {}, {}, 4), metric("d", DataType::int16, {}, {}, 5)});
  REQUIRE(book->metrics.size() == 2);
  CHECK(book->find(metric("", DataType::unknown, {}, {}, 1))->name == "a");
  CHECK(book->find(metric("a", DataType::unknown, {}))->type == DataType::int8);
  CHECK(book->find(metric("", DataType::unknown, {}, {}, 5))->name == "d");
  for (const std::uint64_t alias : {2U, 3U, 9U}) {
    CHECK(book->find(metric("", DataType::unknown, {}, {}, alias)) == nullptr);
  }
  CHECK(book->find(metric("none", DataType::unknown, {})) == nullptr);
  CHECK(book->find(metric("", DataType::unknown, {})) == nullptr);
}

TEST_CASE("a node that does not answer is asked less and less often") {
  EdgeMessages edge;
  Ingest ingest;
  std::vector<std::int64_t> asked;
  for (std::int64_t now = 0; now < 100'000; now += 500) {
    if (!taken(ingest, {edge.pv(1.0)}, now).ask_rebirth.empty()) asked.push_back(now);
  }
  CHECK(asked == std::vector<std::int64_t>{0, 5'000, 15'000, 35'000, 75'000});
}

TEST_CASE("missing births of a whole plant are requested at a limited rate") {
  Ingest ingest;
  std::vector<Arrival> arrivals;
  for (int i = 0; i < 500; ++i) {
    EdgeMessages edge("box" + std::to_string(i));
    arrivals.push_back(edge.pv(1.0));
  }
  CHECK(taken(ingest, arrivals).ask_rebirth.size() == 50);
  CHECK(taken(ingest, {}, kNow + 1000).ask_rebirth.size() == 20);
}

TEST_CASE("garbage is counted and dropped") {
  EdgeMessages edge;
  Ingest ingest;
  taken(ingest, {edge.nbirth(), edge.dbirth()});
  Arrival broken = edge.pv(1.0);
  broken.payload = "\xFF\xFF\xFF";
  Arrival elsewhere = edge.pv(1.0);
  elsewhere.topic = "spBv1.0/A/NONSENSE/box1";
  const Batch batch = taken(ingest, {broken, elsewhere, {"", "", 0, false}});
  CHECK(batch.counts.garbage == 3);
  CHECK(batch.rows.values.empty());
}

TEST_CASE("invalid times are replaced by the time of receipt") {
  EdgeMessages edge;
  Ingest ingest;
  taken(ingest, {edge.nbirth(), edge.dbirth()});
  Arrival value = edge.pv(1.0, false, 17);
  value.received_ms = 1'795'521'777'000;
  const Batch batch = taken(ingest, {value});
  CHECK(batch.counts.bad_times == 1);
  CHECK(batch.rows.values[0].time_ms == 1'795'521'777'000);
}

TEST_CASE("alarms, explanations and files have separate rows") {
  EdgeMessages edge;
  Ingest ingest;
  taken(ingest, {edge.nbirth(), edge.dbirth()});
  sparkplug::Metric file = metric("file/evidence.zip", DataType::file, sparkplug::Bytes{"abc"});
  file.properties = {{"part", DataType::int32, std::int64_t{0}},
                     {"parts", DataType::int32, std::int64_t{2}},
                     {"sha256", DataType::string, std::string("00ff")}};
  const Batch batch = taken(
      ingest, {edge.data({metric("", DataType::unknown, std::uint64_t{1}, edge.time_ms, 3),
                          metric("", DataType::unknown, 6.1, edge.time_ms, 4),
                          metric("", DataType::unknown, std::string("stiction"), edge.time_ms, 5)}),
               edge.data({file})});
  REQUIRE(batch.rows.alarms.size() == 1);
  CHECK(batch.rows.alarms[0].name == "stiction");
  CHECK(batch.rows.alarms[0].state == "unacknowledged");
  CHECK(batch.rows.alarms[0].severity == 6.1);
  REQUIRE(batch.rows.explanations.size() == 1);
  CHECK(batch.rows.explanations[0].parts == R"({"effect":"stiction"})");
  REQUIRE(batch.rows.file_parts.size() == 1);
  CHECK(batch.rows.file_parts[0].name == "evidence.zip");
  CHECK(batch.rows.file_parts[0].parts == 2);
  CHECK(batch.counts.unknown_metrics == 0);
}

TEST_CASE("a part of a file that contradicts itself is dropped") {
  EdgeMessages edge;
  Ingest ingest;
  taken(ingest, {edge.nbirth(), edge.dbirth()});
  sparkplug::Metric file = metric("file/x", DataType::file, sparkplug::Bytes{"abc"});
  file.properties = {{"part", DataType::int32, std::int64_t{2}},
                     {"parts", DataType::int32, std::int64_t{2}},
                     {"sha256", DataType::string, std::string("00ff")}};
  CHECK(taken(ingest, {edge.data({file})}).rows.file_parts.empty());
}

TEST_CASE(
    "messages left by an earlier run continue at the database's position, and replace no newer "
    "value") {
  EdgeMessages edge;
  Ingest ingest;
  const Batch first = taken(ingest, {edge.nbirth(), edge.dbirth(), edge.pv(1.0)});
  const fleet::EdgeState& state = first.edges.begin()->second;
  Ingest next;
  fleet::Position position = state.position;
  position.received_ms += 1'000'000;  // another host continued meanwhile
  next.know({"A", "box1"}, 5, position, state.books);
  Arrival left = edge.pv(2.0);
  left.left_over = true;
  const Batch batch = taken(next, {left});
  REQUIRE(batch.rows.values.size() == 1);
  CHECK(batch.rows.values[0].historical);
  CHECK(batch.edges.begin()->second.id == 5);
}

TEST_CASE("after another host had the group, births are counted again") {
  EdgeMessages edge;
  Ingest ingest;
  taken(ingest, {edge.nbirth(), edge.dbirth()});
  ingest.forget_births();
  const Batch batch = taken(ingest, {edge.pv(1.0)});
  CHECK(batch.rows.values.empty());
  CHECK(batch.ask_rebirth.size() == 1);
}

TEST_CASE("any bytes on any topic are handled without harm") {
  property::for_all("any bytes", 300, [] {
    EdgeMessages edge;
    Ingest ingest;
    std::vector<Arrival> arrivals{edge.nbirth(), edge.dbirth()};
    for (std::size_t i = property::one_of(20); i > 0; --i) {
      Arrival one = edge.pv(property::number(-1e300, 1e300));
      // Some bytes of it differ.
      for (std::size_t k = property::one_of(4); k > 0 && !one.payload.empty(); --k) {
        one.payload[property::one_of(one.payload.size())] = static_cast<char>(property::bits());
      }
      if (property::one_of(4) == 0) one.topic[property::one_of(one.topic.size())] = '/';
      arrivals.push_back(one);
    }
    const Batch batch = taken(ingest, arrivals);
    property::require(batch.counts.messages == arrivals.size(), "each was looked at");
    for (const fleet::ValueRow& row : batch.rows.values) {
      property::require(row.metric < row.book->metrics.size(), "a metric of the birth");
    }
  });
}

TEST_CASE("columns are arrays that PostgreSQL reads back unchanged") {
  fleet::ArrayText texts;
  texts.add(std::string("a\"b\\c,{}"));
  texts.add(std::optional<std::string>());
  texts.add(std::string("NULL"));
  CHECK(texts.text() == R"({"a\"b\\c,{}",NULL,"NULL"})");
  fleet::ArrayText numbers;
  CHECK(numbers.empty());
  numbers.add(0.1);
  numbers.add(std::optional(1e300));
  numbers.add_time(1'795'521'600'123);
  CHECK(numbers.text() == "{0.1,1e+300,1795521600.123}");
}

}  // namespace
}  // namespace loopwarden::ingest_test
