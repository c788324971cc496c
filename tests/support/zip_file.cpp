// SPDX-License-Identifier: Apache-2.0
#include "tests/support/zip_file.hpp"

#include <fmt/format.h>
#include <zip.h>

#include <catch2/catch.hpp>

namespace loopwarden::tests {

void write_zip(const std::filesystem::path& path, const ZipMembers& members,
               const std::string& password) {
  zip_t* zip = zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, nullptr);
  REQUIRE(zip != nullptr);
  for (const auto& [name, content] : members) {
    zip_source_t* source = zip_source_buffer(zip, content.data(), content.size(), 0);
    const zip_int64_t at = zip_file_add(zip, name.c_str(), source, ZIP_FL_ENC_UTF_8);
    REQUIRE(at >= 0);
    if (!password.empty()) {
      REQUIRE(zip_file_set_encryption(zip, static_cast<zip_uint64_t>(at), ZIP_EM_AES_256,
                                      password.c_str()) == 0);
    }
  }
  REQUIRE(zip_close(zip) == 0);
}

ZipMembers workbook_parts(const std::vector<TestSheet>& sheets, const std::string& styles,
                          const std::vector<std::string>& shared, const std::string& book) {
  const std::string office = "http://schemas.openxmlformats.org/officeDocument/2006/relationships";
  std::string list;
  std::string links = fmt::format(
      "<Relationship Id=\"s\" Type=\"{0}/styles\" Target=\"styles.xml\"/>"
      "<Relationship Id=\"t\" Type=\"{0}/sharedStrings\" Target=\"sharedStrings.xml\"/>",
      office);
  ZipMembers parts;
  for (std::size_t k = 0; k < sheets.size(); ++k) {
    list +=
        fmt::format("<sheet name=\"{}\" sheetId=\"{}\" r:id=\"r{}\"/>", sheets[k].name, k + 1, k);
    links += fmt::format(
        "<Relationship Id=\"r{0}\" Type=\"{1}/worksheet\" Target=\"worksheets/sheet{0}.xml\"/>", k,
        office);
    parts.emplace_back(fmt::format("xl/worksheets/sheet{}.xml", k),
                       "<worksheet><sheetData>" + sheets[k].rows + "</sheetData></worksheet>");
  }
  std::string texts;
  for (const std::string& text : shared) texts += "<si><t>" + text + "</t></si>";
  parts.emplace_back("[Content_Types].xml", "<Types/>");
  parts.emplace_back("_rels/.rels",
                     fmt::format("<Relationships><Relationship Id=\"b\" Type=\"{}/officeDocument\" "
                                 "Target=\"xl/workbook.xml\"/></Relationships>",
                                 office));
  parts.emplace_back("xl/workbook.xml", "<workbook xmlns:r=\"r\">" + book + "<sheets>" + list +
                                            "</sheets></workbook>");
  parts.emplace_back("xl/_rels/workbook.xml.rels", "<Relationships>" + links + "</Relationships>");
  parts.emplace_back("xl/styles.xml", "<styleSheet>" + styles + "</styleSheet>");
  parts.emplace_back("xl/sharedStrings.xml", "<sst>" + texts + "</sst>");
  return parts;
}

}  // namespace loopwarden::tests
