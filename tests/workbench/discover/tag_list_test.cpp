// SPDX-License-Identifier: Apache-2.0
#include "workbench/discover/tag_list.hpp"

#include <catch2/catch.hpp>

#include "tests/support/temporary_folder.hpp"
#include "workbench/files/command_error.hpp"

namespace loopwarden::workbench::discover::tag_list_test {
namespace {

std::string refusal(const std::string& text) {
  try {
    read_tag_list("t.csv", text);
  } catch (const CommandError& e) {
    CHECK(e.exit_code() == kExitData);
    return e.what();
  }
  return {};
}

}  // namespace

TEST_CASE("a list of tags has its columns in any order and any separator", "[discover]") {
  for (const std::string d : {",", ";", "\t", "|"}) {
    INFO(d);
    const TagList list =
        read_tag_list("t.csv", "High" + d + "other" + d + "NODE" + d + "low" + d + "Tag" + d +
                                   "unit" + d + "Description\r\n40.5" + d + "x" + d + "n1" + d +
                                   "-2" + d + "FIC1.PV" + d + "m3/h" + d + "\"Feed\"\r\n");
    REQUIRE(list.tags.size() == 1);
    const ListedTag& tag = list.tags[0];
    CHECK(tag.name == "FIC1.PV");
    CHECK(tag.node == "n1");
    CHECK(tag.unit == "m3/h");
    CHECK(tag.description == "Feed");
    CHECK(tag.range == record::SignalRange{-2.0, 40.5});
    CHECK(list.notes.empty());
  }
  const TagList comma = read_tag_list("t.csv", "tag;low;high\nF.PV;0,5;1,5\n");
  CHECK(comma.tags.at(0).range == record::SignalRange{0.5, 1.5});
}

TEST_CASE("a loop's name can be only in the node", "[discover]") {
  const TagList list = read_tag_list(
      "t.csv", "name,address,node\nPV,,ns=2;s=FIC1.PV\nFIC2.PV,40001,\nFIC3.PV,,\n,,ns=2;i=7\n");
  REQUIRE(list.tags.size() == 4);
  CHECK(list.tags[0].name == "ns=2;s=FIC1.PV");
  CHECK(list.tags[0].node == "ns=2;s=FIC1.PV");
  CHECK(list.tags[1].name == "FIC2.PV");
  CHECK(list.tags[1].node == "40001");
  CHECK(list.tags[2].node.empty());
  CHECK(list.tags[3].name == "ns=2;i=7");
}

TEST_CASE("errors of a list are reported by line and column", "[discover]") {
  CHECK(refusal("tag,low,high\nF.PV,0,40\nF.OP,0,many\n") ==
        "t.csv:3:8: high must be a number or empty (got 'many')");
  CHECK(refusal("tag,unit\n\"F.PV,m\n") == "t.csv:2:1: no closing quote in this line");
  for (const char* none : {"", "unit,low\nm,0\n", "tag,unit\n"}) {
    INFO(none);
    CHECK(refusal(none).find("t.csv:1:1: no tag in it") == 0);
  }
  const TagList list = read_tag_list("t.csv", "tag,node\nF.PV,a\n,\n,\"\"\nF.PV,b\n");
  REQUIRE(list.tags.size() == 1);
  CHECK(list.tags[0].node == "a");
  REQUIRE(list.notes.size() == 3);
  CHECK(list.notes[0] == "t.csv:3: no tag, name, address or node: skipped");
  CHECK(list.notes[2] == "t.csv:5: 'F.PV' is already in line 2, which is used");
}

TEST_CASE("the output of loopwarden-opcua browse is a tag list; of its text nodes the modes",
          "[discover]") {
  const TagList list = read_tag_list("t.csv",
                                     "name,node_id,data_type,unit,low,high,description\n"
                                     "Area.FIC1.PV,nsu=urn:p;s=1,Double,m3/h,0,40,Feed\n"
                                     "Area.FIC1.MODE,nsu=urn:p;s=2,String,,,,\n"
                                     "Area.FIC1.Name,nsu=urn:p;s=4,String,,,,\n"
                                     "Area.FIC1.OP,nsu=urn:p;i=3,nsu=urn:p;i=9,%,,,\n");
  REQUIRE(list.tags.size() == 3);
  CHECK(list.tags[0].name == "Area.FIC1.PV");
  CHECK(list.tags[0].node == "nsu=urn:p;s=1");
  CHECK(list.tags[1].is_text);
  CHECK(list.tags[2].name == "Area.FIC1.OP");
  CHECK(list.notes ==
        std::vector<std::string>{"t.csv: 1 tags are neither numbers nor a mode by their data_type: "
                                 "skipped"});
}

TEST_CASE("a file is read in the usual encodings of exports", "[discover]") {
  const tests::TemporaryFolder folder;
  tests::write_file(folder / "t.csv",
                    "tag,unit\nF.PV,\xb0"
                    "C\n");  // Latin-1
  CHECK(read_tag_file(folder / "t.csv", "t.csv").tags.at(0).unit ==
        "\xc2\xb0"
        "C");
  CHECK_THROWS(read_tag_file(folder / "none.csv", "none.csv"));
}

}  // namespace loopwarden::workbench::discover::tag_list_test
