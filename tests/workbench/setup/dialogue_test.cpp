// SPDX-License-Identifier: Apache-2.0
#include "workbench/setup/dialogue.hpp"

#include <catch2/catch.hpp>

#include "daemon/console/setups.hpp"
#include "tests/workbench/setup/scripted_setup.hpp"
#include "workbench/files/command_error.hpp"

namespace loopwarden::workbench::setup::dialogue_test {
namespace {

using tests::ScriptedSetup;
using tests::TemporaryFolder;

std::string refusal_of(const std::string& text) {
  const TemporaryFolder folder;
  const std::string file = (folder / "answers.yaml").string();
  tests::write_file(file, text);
  try {
    read_answers(file);
  } catch (const CommandError& e) {
    CHECK(e.exit_code() == kExitData);
    return e.what();
  }
  return {};
}

}  // namespace

TEST_CASE("a question is repeated until the answer is valid, and the answer is kept", "[setup]") {
  ScriptedSetup s;
  s.person.lines = {"25 0", "0 25"};
  CHECK(s.dialogue.range("pv.range") == std::pair(0.0, 25.0));
  CHECK(s.person.prompts.size() == 2);
  // Enter accepts the offered answer.
  s.person.lines = {""};
  CHECK(s.dialogue.ask("co.unit") == "%");
  // Another run of the command continues with the content of the file.
  const State again(s.state.file());
  CHECK(again.answers().at("pv.range") == "0 25");
  CHECK(s.dialogue.ask("co.unit") == "%");
  CHECK(s.person.prompts.size() == 3);
  CHECK_THROWS_AS(s.dialogue.ask("ti"), Paused);
}

TEST_CASE("questions about the present are asked each time", "[setup]") {
  ScriptedSetup s;
  s.person.lines = {"3", "x", "4"};
  CHECK(s.dialogue.number_now("Seconds") == 3.0);
  CHECK(s.dialogue.number_now("Seconds") == 4.0);
  CHECK(s.state.answers().size() == 1);  // the tag
}

TEST_CASE("errors of an answers file are reported with their line", "[setup]") {
  CHECK(refusal_of("tag: FIC-101\npv.range: 0 25\n").empty());
  const std::string unknown = refusal_of("tag: FIC-101\npv.rang: 0 25\n");
  CHECK(unknown.find("answers.yaml:2:1") != std::string::npos);
  CHECK(unknown.find("did you mean 'pv.range'") != std::string::npos);
  CHECK(refusal_of("kc: -1\n").find("answers.yaml:1:5") != std::string::npos);
  CHECK(refusal_of("kc: [1]\n").find("one line") != std::string::npos);
  CHECK_FALSE(refusal_of("- kc\n").empty());
  // An answers file can't answer the questions of steps that move a valve.
  for (const char* key : {"stroke", "stroke.limits", "watchdog", "record.size"}) {
    INFO(key);
    CHECK(refusal_of(std::string(key) + ": 5\n").find("asked each time") != std::string::npos);
  }
}

TEST_CASE("a file that is no state file is not overwritten", "[setup]") {
  const TemporaryFolder folder;
  const auto file = folder / "FIC-101.json";
  tests::write_file(file, "{\"answers\": 5}");
  CHECK_THROWS_AS(State(file), CommandError);
  CHECK(tests::read_file(file) == "{\"answers\": 5}");
  // Answers that only another version needs are dropped. Invalid answers are asked for again.
  tests::write_file(
      file, R"({"answers": {"kc": "0.3", "ti": "soon", "old": "x"}, "steps": {}, "found": {}})");
  CHECK(State(file).answers() == std::map<std::string, std::string>{{"kc", "0.3"}});
}

TEST_CASE("the daemon sees the step of a running setup, and its end", "[setup]") {
  const TemporaryFolder folder;
  const auto setups = [&] { return daemon::console::setups_in(folder.path()).setups; };
  {
    State state(folder / "setup" / "FIC-101.json");
    CHECK(setups().empty());
    state.answer("tag", "FIC-101");
    REQUIRE(setups().size() == 1);
    CHECK(setups()[0].begun_ms);
    state.begin_step("loop");
    state.answer("kc", "0.3");
    CHECK(setups()[0].steps[0].state == "running");
    CHECK(setups()[0].steps[0].since_ms);
    state.set_step("loop", "done");
    CHECK(setups()[0].steps[0].state == "done");
    state.begin_step("devices");
    CHECK(setups()[0].steps[1].state == "running");
  }
  const auto begun = setups()[0].begun_ms;
  CHECK(setups()[0].steps[1].state == "open");
  // Continues as the same setup.
  State state(folder / "setup" / "FIC-101.json");
  state.set_step("devices", "left");
  CHECK(setups()[0].begun_ms == begun);
  CHECK(setups()[0].steps[1].state == "open");
}

TEST_CASE("a repeated step asks its own questions, and the file is written again", "[setup]") {
  ScriptedSetup s;
  for (const char* step : {"loop", "devices", "file", "start", "stroke"})
    s.state.set_step(step, "done");
  s.state.answer("pv.register", "1 input 0 f32");
  s.state.answer("kc", "0.3");
  s.state.answer("write", "yes");
  s.state.forget("devices");
  CHECK_FALSE(s.state.answers().contains("pv.register"));
  CHECK(s.state.answers().contains("kc"));
  CHECK_FALSE(s.state.answers().contains("write"));
  CHECK(s.state.step("devices").empty());
  CHECK(s.state.step("file").empty());
  CHECK(s.state.step("start").empty());
  CHECK(s.state.step("stroke") == "done");
}

TEST_CASE("an answer can include its unit", "[setup]") {
  ScriptedSetup s;
  s.state.answer("pv.unit", "m3/h");
  s.state.answer("co.unit", "%");
  s.person.lines = {"0 25 m3/h", "20 % 80%", "0.2 s", "10 %/s", "50 %", "5 bar", "5.0 M3/H"};
  CHECK(s.dialogue.range("pv.range") == std::pair(0.0, 25.0));
  CHECK(s.dialogue.range("co.limits") == std::pair(20.0, 80.0));
  CHECK(s.dialogue.number("sample_time") == 0.2);
  CHECK(s.dialogue.ask("co.rate") == "10");
  CHECK(s.dialogue.ask("stop.end") == "50");
  CHECK(s.dialogue.number_now("Size", "m3/h") == 5.0);
  CHECK(s.state.answers().at("pv.range") == "0 25");
  CHECK(refusal_of("pv.unit: m3/h\npv.range: 0 25 m3/h\nti: 8 s\n").empty());
}

TEST_CASE("a refused number names the expected form", "[setup]") {
  ScriptedSetup s;
  s.person.lines = {"0,5", "0.5", "5 min", "300 s", "0,5", "50 %"};
  CHECK(s.dialogue.number("kc") == 0.5);
  CHECK(s.person.told("a number above 0, with a decimal point, such as 0.5"));
  CHECK(s.dialogue.number("ti") == 300.0);
  CHECK(s.person.told("the only unit is s"));
  CHECK(s.dialogue.number_now("Output", "%") == 50.0);
  CHECK(s.person.told("a number such as 10.5 or 10.5 % (decimal point, no other unit)"));
}

TEST_CASE("back repeats the previous question and offers its answer", "[setup]") {
  ScriptedSetup s;
  s.person.lines = {"0.3", "8", "back"};
  s.dialogue.ask("kc");
  s.dialogue.ask("ti");
  std::string before;
  try {
    s.dialogue.ask("sp.limits");
  } catch (const Back& back) {
    before = back.question;
  }
  CHECK(before == "ti");
  CHECK_FALSE(s.state.answers().contains("ti"));
  CHECK(s.state.answers().at("kc") == "0.3");
  // Another run of the command can go back as well.
  s.person.lines = {"back", "", "9"};
  State again(s.state.file());
  Dialogue dialogue(s.person, {}, again);
  CHECK_THROWS_AS(dialogue.ask("ti"), Back);
  CHECK(dialogue.ask("kc") == "0.3");
  CHECK(s.person.prompts.back().ends_with("[0.3]: "));
  CHECK(dialogue.ask("ti") == "9");
}

TEST_CASE("back stops at the first question and at a written file", "[setup]") {
  ScriptedSetup s;
  const bool written = GENERATE(true, false);
  if (written) {
    s.person.lines = {"0.3"};
    s.dialogue.ask("kc");
    s.state.set_step("file", "done");
  }
  s.person.lines = {"back", "8"};
  CHECK(s.dialogue.ask("ti") == "8");
  CHECK(s.person.told("no earlier question"));
}

TEST_CASE("a repeated step offers the old answers", "[setup]") {
  ScriptedSetup s;
  s.state.answer("kc", "0.45");
  s.state.answer("write", "yes");
  s.state.set_step("file", "done");
  s.state.forget("file");
  s.person.lines = {"", ""};
  CHECK(s.dialogue.ask("kc") == "0.45");
  CHECK(s.state.earlier("write").empty());
}

}  // namespace loopwarden::workbench::setup::dialogue_test
