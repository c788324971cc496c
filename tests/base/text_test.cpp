// SPDX-License-Identifier: Apache-2.0
#include "base/text.hpp"

#include <catch2/catch.hpp>
#include <string>
#include <string_view>

namespace text_tools_test {

using namespace loopwarden::base;
using namespace std::string_view_literals;

TEST_CASE("a name is split into words, and a path is one word of a shell", "[text]") {
  CHECK(in_words("not_enough_movement") == "not enough movement");
  CHECK(as_shell_word("/etc/loopwardend-2") == "/etc/loopwardend-2");
  CHECK(as_shell_word("/srv/plant's files") == "'/srv/plant'\\''s files'");
  CHECK(as_shell_word("$(reboot)") == "'$(reboot)'");
  CHECK(as_shell_word("").size() == 2);
}

TEST_CASE("spaces and tabs at the ends are removed, others stay", "[text]") {
  CHECK(trimmed(" \ta b\t ") == "a b");
  CHECK(trimmed("a\n") == "a\n");
  CHECK(trimmed(" \t").empty());
}

TEST_CASE("an area contains its parts", "[text]") {
  CHECK(is_in_area("Unit 2/Reactor", "Unit 2"));
  CHECK(is_in_area("Unit 2", "Unit 2"));
  CHECK_FALSE(is_in_area("Unit 21", "Unit 2"));
  CHECK_FALSE(is_in_area("Unit 2", "Unit 2/Reactor"));
  CHECK_FALSE(is_in_area("", "Unit 2"));
}

TEST_CASE("only ASCII letters become lower case", "[text]") {
  CHECK(lower_case("AZ[a") == "az[a");
  CHECK(lower_case("\xC3\x84") == "\xC3\x84");
}

TEST_CASE("characters of a URL that are not unreserved are percent-encoded", "[text]") {
  CHECK(percent_encoded("aZ09-._~") == "aZ09-._~");
  CHECK(percent_encoded("a b/\xC3\xA4%\0"sv) == "a%20b%2F%C3%A4%25%00");
}

TEST_CASE("the first byte that is not UTF-8 is found", "[text]") {
  for (const std::string_view sound :
       {""sv, "a\0b"sv, "\xC3\xA4"sv, "\xE2\x82\xAC"sv, "\xF4\x8F\xBF\xBF"sv, "\x7F"sv}) {
    INFO(sound);
    CHECK(is_utf8(sound));
    CHECK(is_start_of_utf8(sound));
  }
  for (const std::string_view wrong : {"\x80"sv, "\xC0\xAF"sv, "\xE0\x9F\xBF"sv, "\xED\xA0\x80"sv,
                                       "\xF4\x90\x80\x80"sv, "\xFF"sv, "\xC3("sv}) {
    INFO(wrong);
    const std::string text = "ab" + std::string(wrong) + "c";
    CHECK(first_not_utf8(text) == 2);
    CHECK_FALSE(is_start_of_utf8(text));
  }
}

TEST_CASE("text may end within a character if only its start is present", "[text]") {
  for (const std::string_view start : {"a\xC3"sv, "a\xE2\x82"sv, "\xF0\x9F\x98"sv}) {
    CHECK_FALSE(is_utf8(start));
    CHECK(is_start_of_utf8(start));
  }
}

TEST_CASE("text is cut between characters", "[text]") {
  CHECK(cut("\xC3\xA4\xC3\xA4", 3) == "\xC3\xA4");
  CHECK(cut("\xC3\xA4", 1).empty());
  CHECK(cut("abc", 2) == "ab");
  CHECK(cut("abc", 3) == "abc");
}

}  // namespace text_tools_test
