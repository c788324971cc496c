// SPDX-License-Identifier: Apache-2.0
#include "config/key_reference.hpp"

#include <cstdlib>
#include <fstream>

#include "tests/config/config_support.hpp"
#include "tests/support/shell.hpp"

namespace key_reference_test {

using namespace loopwarden::config;

namespace {

constexpr const char* kDocument = LOOPWARDEN_SOURCE_DIR "/docs/reference/configuration.md";

}  // namespace

TEST_CASE("docs/reference/configuration.md has the text of the readers", "[config][reference]") {
  const std::string described = describe_configuration();
  if (std::getenv("LOOPWARDEN_REGENERATE") != nullptr) {
    std::ofstream(kDocument, std::ios::binary) << described;
  }
  INFO("to bring the file up to date: LOOPWARDEN_REGENERATE=1 bin/tests_config '[reference]'");
  CHECK((loopwarden::tests::read_file(kDocument) == described));
}

TEST_CASE("loopwardend.yaml(5) names every key", "[config][reference]") {
  const std::string script = LOOPWARDEN_SOURCE_DIR "/docs/man/configuration.awk";
  const std::string page = loopwarden::tests::run("awk -f " + script + " " + kDocument).text;
  for (const KeyReference& reference :
       {describe_daemon(), describe_loop(), describe_watched_loop(), describe_model()}) {
    CHECK(reference.keys().size() > 20);
    for (const KeyDescription& key : reference.keys()) {
      std::string name;
      for (const char c : key.path.substr(key.path.rfind('.') + 1)) {
        name += c == '_' ? std::string("\\_") : std::string(1, c);
      }
      INFO(key.path);
      CHECK(page.find("\n*" + name + "*: ") != std::string::npos);
    }
  }
}

TEST_CASE("A table for each mapping, with its allowed values", "[config][reference]") {
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
