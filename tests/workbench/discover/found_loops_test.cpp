// SPDX-License-Identifier: Apache-2.0
// Tests of the loops found in tag lists: certain, guessed and open parts.
#include "workbench/discover/found_loops.hpp"

#include <catch2/catch.hpp>

#include "workbench/discover/tag_list.hpp"
#include "workbench/files/command_error.hpp"
#include "workbench/records/rules_file.hpp"

namespace loopwarden::workbench::discover::found_loops_test {
namespace {

using record::Role;

std::vector<record::TagRule> rules_of(const char* text) {
  const auto rules = read_rules_text("r.yaml", text);
  INFO(config::to_text(rules.diagnostics));
  REQUIRE(rules);
  return rules->rules;
}

FoundLoops found(const std::string& rows, const std::vector<record::TagRule>& rules = {}) {
  const TagList list = read_tag_list("t.csv", "tag,unit,low,high,description\n" + rows);
  return find_loops(list.tags, rules);
}

FoundLoop one(const std::string& rows, const std::vector<record::TagRule>& rules = {}) {
  const FoundLoops all = found(rows, rules);
  REQUIRE(all.loops.size() == 1);
  return all.loops.front();
}

std::string name(const FoundLoop& loop, Role role) {
  return loop.signal(role) ? loop.signal(role)->name : "";
}
std::string guess(const FoundLoop& loop, Role role) {
  return loop.signal(role) ? loop.signal(role)->guess : "none";
}

}  // namespace

TEST_CASE("names with signal endings are certainly a loop", "[discover]") {
  const struct {
    const char *pv, *sp, *co, *mode, *tag;
  } cases[] = {
      {"FIC205.PV", "FIC205.SP", "FIC205.OP", "FIC205.MODE", "FIC205"},
      {"FIC-205_PV", "FIC-205_SP", "FIC-205_OUT", "FIC-205_MODE", "FIC-205"},
      {"Area1/FIC205/PV", "Area1/FIC205/SP", "Area1/FIC205/MV", "Area1/FIC205/Mode", "FIC205"},
      {"FIC205/PID1/PV.CV", "FIC205/PID1/SP.CV", "FIC205/PID1/OUT.CV", "FIC205/PID1/MODE.ACTUAL",
       "FIC205"},
      {"ns=2;s=Plant.FIC205.PV", "ns=2;s=Plant.FIC205.SP", "ns=2;s=Plant.FIC205.OP",
       "ns=2;s=Plant.FIC205.MODE", "FIC205"},
  };
  for (const auto& c : cases) {
    INFO(c.pv);
    const FoundLoop loop = one(std::string(c.sp) + "\n" + c.pv + ",m3/h,0,40,Feed\n" + c.mode +
                               "\n" + c.co + ",%,0,100\n");
    CHECK(loop.tag.value == c.tag);
    CHECK(loop.tag.guess.empty());
    CHECK(name(loop, Role::pv) == c.pv);
    CHECK(name(loop, Role::sp) == c.sp);
    CHECK(name(loop, Role::co) == c.co);
    CHECK(name(loop, Role::mode) == c.mode);
    CHECK(guess(loop, Role::pv).empty());
    CHECK(guess(loop, Role::co).empty());
    CHECK(loop.description == "Feed");
    CHECK(loop.pv_unit.value == "m3/h");
    CHECK(loop.pv_unit.guess.empty());
    CHECK(loop.pv_range.value == record::SignalRange{0.0, 40.0});
    CHECK(loop.co_range.value == record::SignalRange{0.0, 100.0});
    CHECK(loop.co_range.guess.empty());
    // The list does not define the mode's numbers.
    CHECK(loop.automatic.value == std::vector<std::string>{"1"});
    CHECK(loop.manual.value == std::vector<std::string>{"0"});
    CHECK_FALSE(loop.automatic.guess.empty());
  }
}

TEST_CASE("missing units and ranges are guessed from another tag of the loop", "[discover]") {
  const FoundLoop as_sp = one("F1.PV\nF1.SP,t/h,0,9\nF1.OP,,0,100\n");
  CHECK(as_sp.pv_unit.value == "t/h");
  CHECK(as_sp.pv_unit.guess == "as SP's");
  CHECK(as_sp.pv_range.value == record::SignalRange{0.0, 9.0});
  CHECK(as_sp.pv_range.guess == "as SP's");
  CHECK(as_sp.co_unit.value == "%");
  CHECK(as_sp.co_unit.guess == "CO runs from 0 to 100");
  CHECK(as_sp.co_range.guess.empty());
  const FoundLoop percent = one("F1.PV [m3/h]\nF1.OP,%\n");
  CHECK(percent.pv_unit.value == "m3/h");
  CHECK(percent.pv_unit.guess.empty());
  CHECK_FALSE(percent.pv_range.value);
  CHECK(percent.co_range.value == record::SignalRange{0.0, 100.0});
  CHECK(percent.co_range.guess == "CO is in %");
  const FoundLoop unknown = one("F1.PV\nF1.OP,,4,20\n");
  CHECK(unknown.pv_unit.value.empty());
  CHECK_FALSE(unknown.pv_range.value);
  CHECK(unknown.co_unit.value.empty());
  CHECK(unknown.co_range.value == record::SignalRange{4.0, 20.0});
  // A server's 0 to 0 is no range, nor is one end.
  CHECK_FALSE(one("F1.PV,t,0,0\nF1.OP,V,5\n").pv_range.value);
  CHECK_FALSE(one("F1.PV,t,0,0\nF1.OP,V,5\n").co_range.value);
}

TEST_CASE("a transmitter and a valve with one number are a guessed loop", "[discover]") {
  const FoundLoop made = one("21-FT-205,m3/h,0,40\n21-FV-205,%,0,100\n");
  CHECK(made.tag.value == "21-FIC-205");
  CHECK(made.tag.guess == "of 21-FT-205");
  CHECK(name(made, Role::pv) == "21-FT-205");
  CHECK(name(made, Role::co) == "21-FV-205");
  CHECK_FALSE(guess(made, Role::pv).empty());
  CHECK_FALSE(guess(made, Role::co).empty());
  const FoundLoop completed =
      one("U1/LIC7.SP\nU1/LIT7.Value,%,0,100\nU1/LCV7.OUT\nU1/LCV7.ZT\nU1/LIC7.MODE\n");
  CHECK(completed.tag.value == "LIC7");
  CHECK(completed.tag.guess.empty());
  CHECK(name(completed, Role::pv) == "U1/LIT7.Value");
  CHECK(name(completed, Role::co) == "U1/LCV7.OUT");
  CHECK(name(completed, Role::stem) == "U1/LCV7.ZT");
  CHECK(guess(completed, Role::sp).empty());
  CHECK_FALSE(guess(completed, Role::co).empty());
  // The controller's own signals take precedence.
  const FoundLoop own = one("FIC1.PV\nFIC1.OP\nFT1\nFV1\n");
  CHECK(name(own, Role::pv) == "FIC1.PV");
  CHECK(name(own, Role::co) == "FIC1.OP");
  for (const char* none : {"FT1\nFV2\n", "FT1\nLV1\n", "U1/FT1\nU2/FV1\n", "FT1\nFT1A\n"}) {
    INFO(none);
    CHECK(found(none).loops.empty());
    CHECK(found(none).other_names.size() == 2);
  }
}

TEST_CASE("signals of a block and of its folder are one loop, unless both have one", "[discover]") {
  const FoundLoop joined = one("FIC1/PID1/PV\nFIC1/PID1/OUT\nFIC1/MODE\n");
  CHECK(joined.tag.value == "FIC1");
  CHECK(guess(joined, Role::mode) == "in the folder FIC1");
  CHECK(guess(joined, Role::pv).empty());
  const FoundLoops two = found("R1/PID1/PV\nR1/PID1/OUT\nR1/PID2/PV\nR1/PID2/OUT\n");
  REQUIRE(two.loops.size() == 2);
  CHECK(two.loops[0].tag.value == "R1-PID1");
  CHECK(two.loops[1].tag.value == "R1-PID2");
  CHECK_FALSE(two.loops[0].tag.guess.empty());
}

TEST_CASE("loops of one name in two folders get the folders' names", "[discover]") {
  const FoundLoops two =
      found("A/FIC1/PV\nA/FIC1/OP\nB/FIC1/PV\nB/FIC1/OP\nA/FIC2/PV\nA/FIC2/OP\n");
  REQUIRE(two.loops.size() == 3);
  CHECK(two.loops[0].tag.value == "A-FIC1");
  CHECK(two.loops[1].tag.value == "B-FIC1");
  CHECK(two.loops[2].tag.value == "FIC2");
  CHECK(one("10.FIC.205.PV\n10.FIC.205.OP\n").tag.value == "FIC-205");
  CHECK(one("Feed \xc3\xb6l / 2.PV\nFeed \xc3\xb6l / 2.OP\n").tag.value == "Feed-l-2");
}

TEST_CASE("of two tags with one ending the first is used, as a guess", "[discover]") {
  const FoundLoop loop = one("F1.PV\nF1.OP\nF1.OUT\n");
  CHECK(name(loop, Role::co) == "F1.OP");
  CHECK(guess(loop, Role::co) == "'F1.OUT' is called so, too");
  CHECK(guess(loop, Role::pv).empty());
}

TEST_CASE("tags outside loops are listed", "[discover]") {
  const FoundLoops all =
      found("FIC1.PV\nFIC1.SP\nFIC2.OP\nFIC3.SP\nTI4.PV\nHS5\nFV6.OP\nFIC7.PV\nFIC7.OP\n");
  REQUIRE(all.loops.size() == 1);
  CHECK(all.incomplete ==
        std::vector<std::string>{"FIC1: no CO", "FIC2: no PV", "FIC3: no PV and no CO"});
  CHECK(all.other_names == std::vector<std::string>{"FIC1.PV", "FIC1.SP", "FIC2.OP", "FIC3.SP",
                                                    "TI4.PV", "HS5", "FV6.OP"});
}

TEST_CASE("a mode that is text has words, in the case of its present value", "[discover]") {
  const auto mode_of = [](const std::string& value) {
    const TagList list = read_tag_list("t.csv",
                                       "tag,data_type,unit,low,high,value\n"
                                       "F1.PV,Double,m3/h,0,40,\nF1.OP,Double,%,0,100,\n"
                                       "F1.MODE,String,,,," +
                                           value + "\n");
    const FoundLoops found = find_loops(list.tags, {});
    REQUIRE(found.loops.size() == 1);
    return found.loops[0];
  };
  const auto has = [](const Found<std::vector<std::string>>& words, const std::string& word) {
    return std::find(words.value.begin(), words.value.end(), word) != words.value.end();
  };
  const FoundLoop upper = mode_of("CAS");
  CHECK(has(upper.automatic, "CAS"));
  CHECK(has(upper.automatic, "AUTO"));
  CHECK(has(upper.manual, "MAN"));
  CHECK(upper.automatic.guess.find("'CAS' now") != std::string::npos);
  const FoundLoop mixed = mode_of("Man");
  CHECK(has(mixed.automatic, "Auto"));
  CHECK(has(mixed.manual, "Man"));
  CHECK(mode_of("HAND 2").automatic.guess.find("add it") != std::string::npos);
}

TEST_CASE("the site's rules take precedence", "[discover][rules]") {
  const auto rules = rules_of(
      "rules:\n"
      "  - {match: '*.TOTAL.PV', signal: none}\n"
      "  - {match: 'Q*.X', signal: pv, loop: '$1.FIC', unit: kg/h, range: [1, 9]}\n"
      "  - {match: 'Q*.Y', signal: co, loop: '$1.FIC', range: [0, 100]}\n"
      "  - {match: 'Q*.B', signal: mode, loop: '$1.FIC', automatic: [2, AUT], cascade: [3],\n"
      "     manual: [1, HND]}\n"
      "  - {match: 'FT*', unit: bar, range: [0, 6]}\n"
      "  - {match: 'never', signal: none}\n");
  const FoundLoops all = found("Q1.X,t/h,0,50\nQ1.Y\nQ1.B\nQ1.TOTAL.PV\nFT3\nFV3\n", rules);
  REQUIRE(all.loops.size() == 2);
  const FoundLoop& loop = all.loops[0];
  CHECK(loop.tag.value == "1.FIC");
  CHECK(loop.tag.guess.empty());
  CHECK(loop.pv_unit.value == "kg/h");
  CHECK(loop.pv_range.value == record::SignalRange{1.0, 9.0});
  CHECK(loop.co_unit.value == "%");
  CHECK(guess(loop, Role::pv).empty());
  CHECK(loop.automatic.value == std::vector<std::string>{"2", "3"});
  CHECK(loop.manual.value == std::vector<std::string>{"1"});
  CHECK(loop.automatic.guess.empty());
  CHECK(all.loops[1].pv_unit.value == "bar");
  CHECK(all.loops[1].pv_range.value == record::SignalRange{0.0, 6.0});
  CHECK(all.other_names == std::vector<std::string>{"Q1.TOTAL.PV"});
  REQUIRE(all.idle_rules.size() == 1);
  CHECK(all.idle_rules[0] == "r.yaml:8: 'never' matches no column or tag");
  const auto clash = rules_of("rules:\n  - {match: 'F*', signal: pv, loop: F}\n");
  CHECK_THROWS_AS(found("F1\nF2\n", clash), CommandError);
}

}  // namespace loopwarden::workbench::discover::found_loops_test
