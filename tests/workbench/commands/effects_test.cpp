// SPDX-License-Identifier: Apache-2.0
#include "workbench/commands/effects.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "model/plant/effect_catalogue.hpp"
#include "tests/support/temporary_folder.hpp"
#include "workbench/text/effect_guide.hpp"
#include "workbench/report/effect_picture.hpp"

namespace loopwarden::tests::effects_test {
namespace {

using workbench::EffectExample;

const std::string kDocs = LOOPWARDEN_SOURCE_DIR "/docs/";

bool has_example(const std::string& effect) {
  const std::vector<EffectExample> examples = workbench::effect_examples();
  return std::any_of(examples.begin(), examples.end(),
                     [&](const EffectExample& e) { return e.spec.name == effect; });
}

TEST_CASE("docs/effects.md says what the catalogue says", "[effects]") {
  INFO("to bring it up to date: bin/loopwarden effects --out docs");
  CHECK((read_file(kDocs + "effects.md") == workbench::effects_markdown()));
}

TEST_CASE("the pictures in docs/ are those of the simulation", "[effects]") {
  for (const EffectExample& example : workbench::effect_examples()) {
    INFO("to bring " << example.file << ".svg up to date: bin/loopwarden effects --out docs");
    const std::string picture = read_file(kDocs + "pictures/effects/" + example.file + ".svg");
    CHECK((picture == workbench::effect_picture_svg(example)));
    CHECK(picture.size() < 40'000);
  }
}

TEST_CASE("every effect has a guide and a picture, and every guide an effect", "[effects]") {
  for (const plant::EffectInfo& info : plant::effect_catalogue()) {
    INFO(info.name << ": describe it in workbench/effect_guide.cpp, draw it in effect_picture.cpp");
    CHECK(workbench::find_guide(info.name) != nullptr);
    CHECK(has_example(info.name));
  }
  for (const workbench::EffectGuide& guide : workbench::effect_guides()) {
    INFO(guide.name);
    const bool in_catalogue = plant::find_effect(guide.name) != nullptr;
    CHECK((in_catalogue || std::string(guide.name) == "controller_mismatch"));
    CHECK_FALSE(guide.look_alikes.empty());
  }
  CHECK(workbench::find_guide("gremlins") == nullptr);
}

}  // namespace
}  // namespace loopwarden::tests::effects_test
