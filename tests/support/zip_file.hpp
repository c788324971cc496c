// SPDX-License-Identifier: Apache-2.0
// Archives and workbooks made for a test.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace loopwarden::tests {

using ZipMembers = std::vector<std::pair<std::string, std::string>>;  // name, content

// `password`: of every member. Empty: no password.
void write_zip(const std::filesystem::path& path, const ZipMembers& members,
               const std::string& password = {});

struct TestSheet {
  std::string name;
  std::string rows;  // content of <sheetData>
};
// `styles`: content of <styleSheet>. `shared`: the texts shared by cells. `book`: content before
// <sheets>.
ZipMembers workbook_parts(const std::vector<TestSheet>& sheets, const std::string& styles = {},
                          const std::vector<std::string>& shared = {},
                          const std::string& book = {});

}  // namespace loopwarden::tests
