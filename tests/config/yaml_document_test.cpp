// SPDX-License-Identifier: Apache-2.0
#include "config/yaml_document.hpp"

#include <fmt/format.h>

#include <catch2/catch.hpp>

namespace yaml_document_test {

using namespace loopwarden::config;

namespace {

// Returns the messages about a text, or "accepted" without any.
std::string said(const std::string& text) {
  Report report("f");
  const std::optional<YamlNode> root = parse_yaml(text, report);
  const std::string messages = to_text(report.take());
  return root && messages.empty() ? "accepted" : messages;
}

}  // namespace

TEST_CASE("A document becomes a tree that knows its places", "[config][yaml]") {
  Report report("f");
  const std::optional<YamlNode> root =
      parse_yaml("# comment\nouter:\n  inner: [1, two]\n  \"quoted\": '3'\nempty:\n", report);
  REQUIRE(root);
  CHECK_FALSE(report.has_errors());
  REQUIRE(root->kind == YamlNode::Kind::map);
  const YamlNode* outer = root->find("outer");
  REQUIRE(outer != nullptr);
  const YamlNode* inner = outer->find("inner");
  REQUIRE(inner != nullptr);
  REQUIRE(inner->kind == YamlNode::Kind::list);
  CHECK(inner->place == Place{3, 10});
  REQUIRE(inner->values.size() == 2);
  CHECK(inner->values[1].text == "two");
  CHECK(inner->values[1].place == Place{3, 14});
  CHECK_FALSE(inner->values[0].quoted);
  REQUIRE(outer->find("quoted") != nullptr);
  CHECK(outer->find("quoted")->quoted);
  CHECK(outer->keys[1].place == Place{4, 3});
  REQUIRE(root->find("empty") != nullptr);
  CHECK(root->find("empty")->kind == YamlNode::Kind::nothing);
  CHECK(root->find("empty")->place == Place{5, 1});
  CHECK(root->find("absent") == nullptr);
}

TEST_CASE("Ordinary variations of a file are accepted", "[config][yaml]") {
  CHECK(said("a: 1\n") == "accepted");
  CHECK(said("a: 1") == "accepted");
  CHECK(said("---\na: 1\n...\n") == "accepted");
  CHECK(said("\xEF\xBB\xBF"
             "a: 1\n") == "accepted");
  CHECK(said("a: 1\r\nb: \"\xC3\xA9t\xC3\xA9\"\r\nc: 'it''s'\r\nd: \"a \\\" b\"\r\n") ==
        "accepted");
  CHECK(said("a: 1\t# a tab before a comment\n") == "accepted");
  CHECK(said("a: |\n  two\n  lines\n") == "accepted");
}

TEST_CASE("Constructs without use in a configuration are refused with their place",
          "[config][yaml]") {
  CHECK(said("") == "f:1:1: error: is empty\n");
  CHECK(said("# nothing but a comment\n") == "f:1:1: error: is empty\n");
  CHECK(said("a: 1\n---\nb: 2\n") ==
        "f:2:1: error: a second document begins here; a file holds one\n");
  CHECK(said("a: 1\nb: {\n  x: 1,\n  x: 2}\n") ==
        "f:4:3: error: duplicate key 'x' (first at 3:3)\n");
  CHECK(said("a: &x 1\n") ==
        "f:1:4: error: anchors (&) and aliases (*) are not accepted; write the value out\n");
  CHECK(said("a: 1\nb: *x\n") ==
        "f:2:4: error: anchors (&) and aliases (*) are not accepted; write the value out\n");
  CHECK(said("a: !!int 1\n") == "f:1:4: error: tag 'tag:yaml.org,2002:int' is not accepted\n");
  CHECK(said("? [a, b]\n: 1\n") == "f:1:3: error: a key must be plain text\n");
  CHECK(said(": 1\n") == "f:1:1: error: a key is missing here\n");
}

TEST_CASE("Bytes that are no text are refused with their place", "[config][yaml]") {
  using namespace std::string_literals;
  CHECK(said("a:\n\tb: 1\n") == "f:2:1: error: tab in the indentation; indent with spaces\n");
  CHECK(said("a:\n  \tb: 1\n") == "f:2:3: error: tab in the indentation; indent with spaces\n");
  CHECK(said("ab: x\0y\n"s) == "f:1:6: error: control character 0x00\n");
  CHECK(said("a: \x1b[2J\n") == "f:1:4: error: control character 0x1b\n");
  CHECK(said("a: b\rc: 1\n") == "f:1:5: error: control character 0x0d\n");
  CHECK(said("a: 1\nb: caf\xE9\n") == "f:2:7: error: byte 0xe9 is not UTF-8 text\n");
  CHECK(said("a: \xC0\xAF\n") == "f:1:4: error: byte 0xc0 is not UTF-8 text\n");      // overlong
  CHECK(said("a: \xE0\x80\xAF\n") == "f:1:4: error: byte 0xe0 is not UTF-8 text\n");  // overlong
  CHECK(said("a: \xED\xA0\x80\n") == "f:1:4: error: byte 0xed is not UTF-8 text\n");  // surrogate
  CHECK(said("a: \xF4\x90\x80\x80\n") == "f:1:4: error: byte 0xf4 is not UTF-8 text\n");
  CHECK(said("a: \xE2\x82") == "f:1:4: error: byte 0xe2 is not UTF-8 text\n");  // cut off
  CHECK(said("\xFF\xFE"
             "a\0:\0"s) == "f:1:1: error: byte 0xff is not UTF-8 text\n");
  CHECK(said("a: \xF0\x9F\x99\x82 \xE2\x82\xAC \xC3\xA9\n") == "accepted");
}

TEST_CASE("Errors of syntax are reported in plain words", "[config][yaml]") {
  CHECK(said("a: 1\nb 2\nc: 3\n") ==
        "f:3:2: error: a ':' too many here (text with ': ' in it needs quotes), or the indentation "
        "is wrong\n");
  CHECK(said("a:\n  b: 1\n   c: 2\n") ==
        "f:3:5: error: a ':' too many here (text with ': ' in it needs quotes), or the indentation "
        "is wrong\n");
  CHECK(said("a: [1, 2\nb: 3\n") ==
        "f:2:2: error: a ']' or a ',' is missing here or in a line before\n");
  CHECK(said("a: {b: 1\nc: 3\n") ==
        "f:2:2: error: a '}' or a ',' is missing here or in a line before\n");
  // The parser would take all following lines into the text.
  CHECK(said("a: \"open\nb: 1\n") == "f:1:4: error: the closing quote is missing on this line\n");
  CHECK(said("a: 'open\nb: 1\n") == "f:1:4: error: the closing quote is missing on this line\n");
  CHECK(said("a: 'it''s\nb: 1\n") == "f:1:4: error: the closing quote is missing on this line\n");
  CHECK(said("a: \"open \\\"\nb: 1\n") ==
        "f:1:4: error: the closing quote is missing on this line\n");
}

TEST_CASE("Neither depth nor breadth crashes the reader", "[config][yaml]") {
  const auto nested = [](std::size_t levels) {
    return fmt::format("a: {}{}", std::string(levels, '['), std::string(levels, ']'));
  };
  CHECK(said(nested(31)) == "accepted");  // the mapping is the first level
  CHECK(said(nested(32)) == "f:1:35: error: nested more than 32 levels deep\n");
  CHECK(said(std::string(500'000, '[')).find("error") != std::string::npos);
  CHECK(said(fmt::format("a: {}", std::string(500'000, '{'))).find("error") != std::string::npos);
  std::string dashes;
  for (int i = 0; i < 100'000; ++i) dashes += "- ";
  CHECK(said(dashes) == "f:1:65: error: nested more than 32 levels deep\n");
  std::string keys;
  for (int i = 0; i < 1001; ++i) keys += fmt::format("k{}: 1\n", i);
  CHECK(said(keys) == "f:1001:1: error: more than 1000 keys in one mapping\n");
}

TEST_CASE("Unknown keys are named, with the nearest known one", "[config][yaml]") {
  Report report("f");
  std::optional<YamlNode> root = parse_yaml("gian: 1\nother: {free: 1}\ncolour: 2\n", report);
  REQUIRE(root);
  root->visited = true;
  root->known_keys = {"gain", "other"};
  report_unknown_keys(*root, report);
  // `other` was not read as a mapping of known keys, so its contents are not checked.
  CHECK(to_text(report.take()) ==
        "f:1:1: error: unknown key 'gian'; did you mean 'gain'?\nf:3:1: error: unknown key "
        "'colour'\n");
}

}  // namespace yaml_document_test
