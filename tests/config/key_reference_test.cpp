// SPDX-License-Identifier: Apache-2.0
#include "config/key_reference.hpp"

#include <cstdlib>

#include "tests/config/config_support.hpp"

namespace key_reference_test {

using namespace loopwarden::config;

TEST_CASE("docs/configuration.md says what the readers say", "[config][reference]") {
  const std::string path = LOOPWARDEN_SOURCE_DIR "/docs/configuration.md";
  const std::string described = describe_configuration();
  if (std::getenv("LOOPWARDEN_REGENERATE") != nullptr) {
    std::ofstream(path, std::ios::binary) << described;
  }
  INFO("to bring the file up to date: LOOPWARDEN_REGENERATE=1 bin/tests_config '[reference]'");
  CHECK((test::file_text(path) == described));
}

TEST_CASE("A table for each mapping, with what may stand in it", "[config][reference]") {
  KeyReference reference;
  reference.add({"top", "number > 0, s", "required", "first"});
  reference.add({"inner", "mapping", "none", "second"});
  reference.add({"inner.word", "a | b", "a", "third"});
  CHECK(to_markdown(reference) ==
        "\n| key | value | default | meaning |\n|---|---|---|---|\n"
        "| `top` | number > 0, s | required | first |\n"
        "| `inner` | mapping | none | second |\n"
        "\n### `inner`\n"
        "\n| key | value | default | meaning |\n|---|---|---|---|\n"
        "| `word` | a \\| b | a | third |\n");
}

}  // namespace key_reference_test
