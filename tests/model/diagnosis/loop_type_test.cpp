// SPDX-License-Identifier: Apache-2.0
// The type of a loop from its tag.
#include "model/diagnosis/loop_type.hpp"

#include <catch2/catch.hpp>

namespace loopwarden::tests::loop_type_test {
namespace {

using namespace diagnosis;

TEST_CASE("the type of a loop is read from its tag") {
  CHECK(loop_type_from_tag("FIC101") == LoopType::flow);
  CHECK(loop_type_from_tag("21-LC-105_a") == LoopType::level);
  CHECK(loop_type_from_tag("PDIC7") == LoopType::pressure);
  CHECK(loop_type_from_tag("unit3.TRCA_3") == LoopType::temperature);
  CHECK(loop_type_from_tag("CHEM1") == LoopType::unknown);
  CHECK(loop_type_from_tag("PLC4") == LoopType::unknown);
  CHECK(loop_type_from_tag("r22") == LoopType::unknown);
  CHECK(loop_type_from_tag("LIC5 to FIC6") == LoopType::unknown);
}

}  // namespace
}  // namespace loopwarden::tests::loop_type_test
