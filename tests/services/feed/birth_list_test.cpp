// SPDX-License-Identifier: Apache-2.0
#include "services/feed/values/birth_list.hpp"

#include <catch2/catch.hpp>
#include <string>

namespace birth_list_test {

using namespace loopwarden;
using namespace loopwarden::sparkplug;
using feed::BirthList;

namespace {

Metric metric(const std::string& name, DataType type, Value value,
              std::vector<Property> properties = {}) {
  Metric made;
  made.name = name;
  made.type = type;
  made.value = std::move(value);
  made.properties = std::move(properties);
  return made;
}

std::string payload(std::vector<Metric> metrics) {
  return encode({.time_ms = 1, .seq = 0, .metrics = std::move(metrics)}, Types::sent);
}

}  // namespace

TEST_CASE("births of a group give a list of tags", "[feed]") {
  BirthList list;
  list.take({"plant", MessageType::nbirth, "line1", ""},
            payload({metric("bdSeq", DataType::int64, std::int64_t{0}),
                     metric("Node Control/Rebirth", DataType::boolean, false),
                     metric("FIC207/PV", DataType::float64, 1.5)}));
  list.take({"plant", MessageType::dbirth, "line1", "R2"},
            payload({metric("FIC206/PV", DataType::float32, 2.0,
                            {{"engUnit", DataType::string, std::string("m3/h")},
                             {"engLow", DataType::float64, 0.0},
                             {"engHigh", DataType::float64, 40.0},
                             {"documentation", DataType::string, std::string("Feed, \"raw\"")}}),
                     metric("FIC206/MODE", DataType::string, std::string("AUTO"))}));
  CHECK(list.metrics() == 3);
  CHECK(list.csv() ==
        "name,node_id,data_type,unit,low,high,description\n"
        "line1/FIC207/PV,plant/line1//FIC207/PV,Double,,,,\n"
        "line1/R2/FIC206/MODE,plant/line1/R2/FIC206/MODE,String,,,,\n"
        "line1/R2/FIC206/PV,plant/line1/R2/FIC206/PV,Float,m3/h,0,40,\"Feed, \"\"raw\"\"\"\n");
  CHECK(list.unborn().empty());
}

TEST_CASE("an edge node that publishes without a birth is listed", "[feed]") {
  BirthList list;
  list.take({"plant", MessageType::ddata, "line2", "R3"}, "");
  REQUIRE(list.unborn().size() == 1);
  CHECK(list.unborn()[0] == BirthList::EdgeName{"plant", "line2"});
  CHECK_THROWS_AS(list.take({"plant", MessageType::nbirth, "line2", ""}, "no payload"), BadPayload);
  CHECK(list.metrics() == 0);
}

}  // namespace birth_list_test
