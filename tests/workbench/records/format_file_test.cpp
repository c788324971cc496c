// SPDX-License-Identifier: Apache-2.0
#include "workbench/records/format_file.hpp"

#include <catch2/catch.hpp>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::format_file_test {
namespace {

using record::ImportOptions;
using record::Role;
using workbench::read_format_text;

TEST_CASE("the example of the document is accepted unchanged, and names every key", "[import]") {
  const std::string page = read_file(LOOPWARDEN_SOURCE_DIR "/docs/reference/import-formats.md");
  const std::size_t begin = page.find("```yaml\n") + 8;
  const std::string example = page.substr(begin, page.find("```", begin) - begin);
  const auto format = read_format_text("f.yaml", example);
  INFO(config::to_text(format.diagnostics));
  REQUIRE(format);
  const ImportOptions& o = *format;
  CHECK(o.delimiter == ';');
  CHECK(o.decimal == ',');
  CHECK(o.encoding == record::Encoding::latin1);
  CHECK(o.header_rows == 3U);
  CHECK(o.time_column == "Zeit");
  CHECK(o.time == record::TimeForm::dmy);
  CHECK(o.zone_s == 3600);
  CHECK(o.bad_words == std::vector<std::string>{"wartung", "kalibrierung"});
  CHECK(o.period_s == 1.0);
  CHECK(o.filling == record::Filling::linear);
  REQUIRE(o.loops.size() == 1);
  CHECK(o.loops[0].tag == "FIC101");
  CHECK(o.loops[0].names[index_of(Role::co)] == "FV101");
  const config::KeyReference reference = workbench::describe_format();
  for (const config::KeyDescription& key : reference.keys()) {
    const std::size_t dot = key.path.find_last_of('.');
    INFO(key.path);
    CHECK(example.find(key.path.substr(dot == std::string::npos ? 0 : dot + 1) + ":") !=
          std::string::npos);
  }
}

TEST_CASE("errors of a format file are reported with their place", "[import]") {
  const auto error_of = [](const char* text) {
    return config::to_text(read_format_text("f.yaml", text).diagnostics);
  };
  CHECK(error_of("decimal: dot\n").find("f.yaml:1:10: error: decimal") != std::string::npos);
  CHECK(error_of("time: {zone: Berlin}\n").find("time.zone: must be an offset") !=
        std::string::npos);
  CHECK(error_of("period: 0\n").find("period: must be > 0") != std::string::npos);
  CHECK(error_of("loops:\n  - {tag: F, co: x}\n").find("pv") != std::string::npos);
  CHECK(error_of("bad_values: {a: 1}\n").find("must be") != std::string::npos);
  CHECK_FALSE(error_of("").empty());
}

}  // namespace
}  // namespace loopwarden::tests::format_file_test
