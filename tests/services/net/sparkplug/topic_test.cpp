// SPDX-License-Identifier: Apache-2.0
#include "services/net/sparkplug/topic.hpp"

#include <catch2/catch.hpp>
#include <string>

#include "tests/support/property.hpp"

namespace topic_test {

using namespace loopwarden::sparkplug;
namespace property = loopwarden::tests::property;

TEST_CASE("topics of nodes and devices", "[sparkplug]") {
  const Topic birth{"plant", MessageType::nbirth, "box1", ""};
  CHECK(to_text(birth) == "spBv1.0/plant/NBIRTH/box1");
  CHECK(parse_topic("spBv1.0/plant/NBIRTH/box1") == birth);
  const Topic data{"plant", MessageType::ddata, "box1", "FIC-101"};
  CHECK(to_text(data) == "spBv1.0/plant/DDATA/box1/FIC-101");
  CHECK(parse_topic("spBv1.0/plant/DDATA/box1/FIC-101") == data);
}

TEST_CASE("other topics than those of a node or a device", "[sparkplug]") {
  for (const char* text :
       {"", "spBv1.0", "spAv1.0/plant/NBIRTH/box1", "spBv1.0/plant/NBIRTH",
        "spBv1.0/plant/BIRTH/box1", "spBv1.0/plant/nbirth/box1", "spBv1.0/plant/NBIRTH/box1/device",
        "spBv1.0/plant/DBIRTH/box1", "spBv1.0//NBIRTH/box1", "spBv1.0/plant/NBIRTH/",
        "spBv1.0/plant/DBIRTH/box1/", "spBv1.0/plant/DBIRTH/box1/a/b", "spBv1.0/plant/NBIRTH/a+b",
        "spBv1.0/STATE/host"}) {
    INFO(text);
    CHECK_FALSE(parse_topic(text));
  }
}

TEST_CASE("a host's STATE", "[sparkplug]") {
  CHECK(state_topic("scada") == "spBv1.0/STATE/scada");
  CHECK(parse_state_topic("spBv1.0/STATE/scada") == "scada");
  CHECK_FALSE(parse_state_topic("spBv1.0/STATE/"));
  CHECK_FALSE(parse_state_topic("STATE/scada"));
  CHECK_FALSE(parse_state_topic("spBv1.0/plant/NBIRTH/box1"));
}

TEST_CASE("a tag becomes a valid name for a topic", "[sparkplug]") {
  CHECK(identifier_of("FIC-101") == "FIC-101");
  CHECK(identifier_of("A/B+C#D\n") == "A_B_C_D_");
  CHECK(identifier_of("Dampf 3 °C") == "Dampf 3 °C");
  CHECK(identifier_of("") == "_");
  CHECK(identifier_of(std::string(500, 'a')).size() == kMostIdentifierBytes);
  CHECK_FALSE(is_identifier(""));
  CHECK_FALSE(is_identifier(std::string(kMostIdentifierBytes + 1, 'a')));
}

TEST_CASE("the topic of any tag is found again", "[sparkplug]") {
  property::for_all("parse_topic(to_text(topic)) == topic", 500, [] {
    std::string tag;
    for (std::size_t i = property::one_of(30); i > 0; --i) {
      tag += static_cast<char>(property::integer(0, 127));
    }
    const Topic topic{"g", MessageType::ddata, "e", identifier_of(tag)};
    property::require(parse_topic(to_text(topic)) == topic, "found again");
  });
}

}  // namespace topic_test
