// SPDX-License-Identifier: Apache-2.0
#include "model/alarm/alarm_guide.hpp"

#include <catch2/catch.hpp>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

namespace alarm_guide_test {

using namespace loopwarden;
using namespace loopwarden::alarm;

namespace {

constexpr const char* kDocument = LOOPWARDEN_SOURCE_DIR "/docs/reference/alarms.md";
const std::string kBegin = "<!-- rationalisation -->\n";
const std::string kEnd = "<!-- /rationalisation -->";

std::string table() {
  std::string text =
      "| alarm | priority | cause | consequence | what to do | time to act "
      "|\n|---|---|---|---|---|---|\n";
  for (const AlarmKind kind : kAlarmKinds) {
    const AlarmGuide guide = guide_of(kind);
    text += std::string("| `") + to_text(kind) + "` | " + to_text(usual_priority(kind)) + " | " +
            guide.cause + " | " + guide.consequence + " | " + guide.action + " | " +
            guide.time_to_act + " |\n";
  }
  return text;
}

}  // namespace

TEST_CASE("docs/reference/alarms.md has the text of each alarm's guide", "[monitor][reference]") {
  std::ifstream in(kDocument);
  std::stringstream read;
  read << in.rdbuf();
  const std::string page = read.str();
  const std::size_t begin = page.find(kBegin);
  const std::size_t end = page.find(kEnd);
  REQUIRE(begin != std::string::npos);
  REQUIRE(end != std::string::npos);
  const std::size_t from = begin + kBegin.size();
  if (std::getenv("LOOPWARDEN_REGENERATE") != nullptr) {
    std::ofstream(kDocument) << page.substr(0, from) + table() + page.substr(end);
  }
  INFO("to bring the file up to date: LOOPWARDEN_REGENERATE=1 bin/tests_model '[reference]'");
  CHECK((page.substr(from, end - from) == table()));
}

}  // namespace alarm_guide_test
