// SPDX-License-Identifier: Apache-2.0
#include "workbench/commands/demo_test.hpp"

#include <catch2/catch.hpp>
#include <string>

namespace loopwarden::workbench::demo_test_test {

TEST_CASE("the demo's test decides for the effect that the plant has", "[demo]") {
  std::string told;
  show_test_scene(LOOPWARDEN_SOURCE_DIR "/examples/demo/models/plant1-worn.yaml",
                  [&](const std::string& line) { told += line + "\n"; });
  INFO(told);
  CHECK(told.find("To decide between stiction and deadband drive") != std::string::npos);
  CHECK(told.find("Expected change of PV") != std::string::npos);
  CHECK(told.find("Permission: ") != std::string::npos);
  CHECK(told.find("Decided: stiction. The valve was simulated with stiction.") !=
        std::string::npos);
}

}  // namespace loopwarden::workbench::demo_test_test
