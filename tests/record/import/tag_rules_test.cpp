// SPDX-License-Identifier: Apache-2.0
#include "record/import/tag_rules.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <stdexcept>
#include <string>

#include "record/import/importer.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::tag_rules_test {
namespace {

using namespace loopwarden::record;

using Found = std::vector<std::string>;

TEST_CASE("a pattern matches as in a shell, and returns the texts at its wildcards",
          "[import][rules]") {
  const auto found = [](const char* pattern, const char* name) {
    return TagPattern(pattern).match(name);
  };
  CHECK(found("FT*", "FT101") == Found{"101"});
  CHECK(found("ft*", "FT101") == Found{"101"});
  CHECK(found("FT*", "FT") == Found{""});
  CHECK_FALSE(found("FT*", "XFT101"));
  CHECK(found("*_*_PV", "U1_F_2_PV") == Found{"U1", "F_2"});
  CHECK(found("*PV", "PVPV") == Found{"PV"});
  CHECK(found("[FPLT]T?*", "LT305") == Found{"L", "3", "05"});
  CHECK(found("[!F]T*", "FT1") == std::nullopt);
  CHECK(found("[!F]T*", "LT1") == Found{"L", "1"});
  CHECK(found("[0-9a]x", "Ax") == Found{"A"});
  CHECK(found("FIC[[]*].PV", "FIC[3].PV") == Found{"[", "3"});
  CHECK(found("Druck ?l", "Druck \xc3\xb6l") == Found{"\xc3\xb6"});
  CHECK(found("a**b", "axb") == Found{"x"});
  CHECK_FALSE(found("?", ""));
  for (const char* wrong : {"", "[ab", "[]", "x[!", "[\xc3\xb6]"}) {
    INFO(wrong);
    CHECK_THROWS_AS(TagPattern(wrong), std::invalid_argument);
  }
}

TEST_CASE("every pattern is matched quickly", "[import][rules]") {
  // A matcher that tries every star against every other one would need exponential time.
  std::string pattern;
  for (int k = 0; k < 60; ++k) pattern += "a*";
  CHECK_FALSE(TagPattern(pattern + "b").match(std::string(5000, 'a')));
}

TEST_CASE("the loop's tag is made of the texts at the wildcards", "[import][rules]") {
  CHECK(filled_in("$1FIC$2", {"21", "101"}) == "21FIC101");
  CHECK(filled_in("$$1", {}) == "$1");
  CHECK(filled_in("FIC", {}) == "FIC");
  for (const char* wrong : {"$3", "$0", "$", "$x"}) CHECK_FALSE(filled_in(wrong, {"a", "b"}));
}

TagRule rule(const char* pattern, std::optional<Role> role, const char* loop, int line) {
  TagRule made{.pattern = TagPattern(pattern)};
  made.place = "r.yaml:" + std::to_string(line);
  made.role = role;
  made.loop = loop;
  return made;
}

class Exports {
 public:
  void add(const std::string& name, const std::string& header, const std::string& cells,
           int from = 0) {
    std::string text = "Timestamp," + header + "\n";
    for (int k = 0; k < 30; ++k) {
      char time[40];
      std::snprintf(time, sizeof time, "2026-03-01T10:%02d:%02dZ,", from, k);
      text += time + cells + "\n";
    }
    write_file(folder_ / name, text);
  }
  Importer importer(std::vector<TagRule> rules) const {
    ImportOptions options;
    options.rules = std::move(rules);
    return Importer({folder_.path()}, options);
  }

 private:
  TemporaryFolder folder_;
};

TEST_CASE("rules pair meaningless names, and take precedence over names", "[import][rules]") {
  Exports exports;
  exports.add("e.csv", "FT1 (m3/h),FV1,FIC1.PV,FIC1.MODE,LIC2.PV,LIC2.OP,FT1.TOTAL",
              "10,50,11,HND,3,4,5");
  std::vector<TagRule> rules{rule("FT*.TOTAL", std::nullopt, "", 1),
                             rule("FT*", Role::pv, "FIC$1", 2),
                             rule("FV*", Role::co, "FIC$1", 3),
                             rule("*.MODE", std::nullopt, "", 4),
                             rule("LIC*", std::nullopt, "", 5),
                             rule("FV1", Role::sp, "X", 6),
                             rule("Q*", Role::pv, "X", 7)};
  rules[0].unused = true;
  rules[2].range = {4.0, 20.0};
  rules[2].unit = "mA";
  rules[1].kind = "flow";
  rules[3].mode_words = std::make_shared<const ModeWords>(ModeWords{{"aut"}, {"hnd"}, {"kas"}});
  Importer importer = exports.importer(rules);
  REQUIRE(importer.loops().size() == 2);
  const FoundLoop& first = importer.loops()[0];
  CHECK(first.tag == "FIC1");
  CHECK(first.signals.names[index_of(Role::pv)] == "FT1 (m3/h)");
  CHECK(first.signals.units[index_of(Role::pv)] == "m3/h");
  CHECK(first.signals.names[index_of(Role::co)] == "FV1");
  CHECK(first.signals.names[index_of(Role::mode)] == "FIC1.MODE");
  CHECK(importer.other_names() == std::vector<std::string>{"FIC1.PV"});
  const Imported read = importer.read_one(0);
  CHECK(read.record.pv.front() == 10.0);
  CHECK(read.record.automatic.front() == 0.0);
  CHECK(read.notes.kind == "flow");
  CHECK(read.notes.units[index_of(Role::co)] == "mA");
  CHECK(read.notes.ranges[index_of(Role::co)] == SignalRange(4.0, 20.0));
  const std::vector<std::string> idle = importer.idle_rules();
  REQUIRE(idle.size() == 2);
  CHECK(idle[0] == "r.yaml:6: 'FV1' has no effect: its names are decided earlier by r.yaml:3");
  CHECK(idle[1] == "r.yaml:7: 'Q*' matches no column or tag");
}

TEST_CASE("two names for one signal of one loop are refused with both rules", "[import][rules]") {
  const auto error_of = [](const Exports& exports, std::vector<TagRule> rules) {
    try {
      exports.importer(std::move(rules));
    } catch (const RecordError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  Exports one;
  one.add("e.csv", "FT1,FX1,FV1", "1,2,3");
  CHECK(error_of(one, {rule("FT*", Role::pv, "FIC$1", 2), rule("FX*", Role::pv, "FIC$1", 3)}) ==
        "FIC1: two names are its pv: 'FT1' by r.yaml:2 and 'FX1' by r.yaml:3");
  // The names are in two files.
  Exports two;
  two.add("a.csv", "FT1,FV1", "1,2");
  two.add("b.csv", "FIC1.PV,FV1", "1,2", 1);
  CHECK(error_of(two, {rule("FT*", Role::pv, "FIC$1", 2), rule("FV*", Role::co, "FIC$1", 3)}) ==
        "FIC1: two names are its pv: 'FT1' by r.yaml:2 and 'FIC1.PV' by its name");
  // The same name in both is one signal.
  Exports same;
  same.add("a.csv", "FT1,FV1", "1,2");
  same.add("b.csv", "FT1,FV1", "1,2", 1);
  CHECK(error_of(same, {rule("FT*", Role::pv, "FIC$1", 2), rule("FV*", Role::co, "FIC$1", 3)})
            .empty());
}

TEST_CASE("words of a site's mode column", "[import][rules]") {
  const ModeWords words{{"aut", "2"}, {"hnd"}, {"kas"}};
  CHECK(words.read(" AUT ") == 1.0);
  CHECK(words.read("2") == 1.0);  // automatic by number, if the site gives no word for it
  CHECK(words.read("Kas") == 1.0);
  CHECK(words.read("HND") == 0.0);
  CHECK(words.read("manual") == 0.0);
}

}  // namespace
}  // namespace loopwarden::tests::tag_rules_test
