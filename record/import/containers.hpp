// SPDX-License-Identifier: Apache-2.0
// Archives and workbooks as folders: ARCHIVE/MEMBER and BOOK.xlsx/SHEET are paths of files.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "record/import/text_source.hpp"

namespace loopwarden::record {

// By its first bytes: a .zip archive or an .xlsx workbook.
bool is_container(const std::filesystem::path& path);
// The archive or workbook that a path goes through; nullopt where it is that of a file or of nothing.
std::optional<std::filesystem::path> container_of(const std::filesystem::path& path);

struct ContainerMember {
  std::filesystem::path path;
  std::string tag;  // to call a loop by that has no name of its own
  bool is_sheet = false;
};

class Containers {
 public:
  Containers();
  ~Containers();

  // Sheets, or files in it and below, in the order in which it has them. Throws RecordError where it can't be used.
  std::vector<ContainerMember> members(const std::filesystem::path& container);
  // A file, a member or a sheet. Throws RecordError.
  std::unique_ptr<TextSource> open(const std::filesystem::path& path, Encoding encoding);

 private:
  struct Opened;

  const Opened& opened(const std::filesystem::path& container);

  std::unique_ptr<Opened> last_;  // each has many members, which are read one after the other
};

}  // namespace loopwarden::record
