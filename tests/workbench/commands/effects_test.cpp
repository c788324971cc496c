// SPDX-License-Identifier: Apache-2.0
#include "workbench/commands/effects.hpp"

#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "tests/support/temporary_folder.hpp"
#include "workbench/report/effect_picture.hpp"

namespace loopwarden::tests::effects_test {
namespace {

const std::string kDocs = LOOPWARDEN_SOURCE_DIR "/docs/reference/";

TEST_CASE("docs/reference/effects.md matches the catalogue", "[effects]") {
  INFO("to bring it up to date: bin/loopwarden effects --out docs/reference");
  CHECK((read_file(kDocs + "effects.md") == workbench::effects_markdown()));
}

TEST_CASE("the pictures of the effects match the simulation", "[effects]") {
  for (const effects::Example& example : workbench::effect_examples()) {
    INFO("to bring " << example.file
                     << ".svg up to date: bin/loopwarden effects --out docs/reference");
    const std::string picture = read_file(kDocs + "pictures/effects/" + example.file + ".svg");
    CHECK((picture == workbench::effect_picture_svg(example)));
    CHECK(picture.size() < 40'000);
  }
}

}  // namespace
}  // namespace loopwarden::tests::effects_test
