// SPDX-License-Identifier: Apache-2.0
// Opens archives and workbooks like folders: ARCHIVE/MEMBER and BOOK.xlsx/SHEET are paths of files.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "record/import/text_source.hpp"

namespace loopwarden::record {

// Returns whether the first bytes are those of a .zip archive or an .xlsx workbook.
bool is_container(const std::filesystem::path& path);
// Returns the archive or workbook that is part of a path. Returns nullopt for the path of a normal
// file or of no file.
std::optional<std::filesystem::path> container_of(const std::filesystem::path& path);

struct ContainerMember {
  std::filesystem::path path;
  std::string tag;  // name for a loop that has no name
  bool is_sheet = false;
};

class Containers {
 public:
  Containers();
  ~Containers();

  // Returns the sheets, or the files in the archive and its folders, in their order. Throws
  // RecordError if it can't be used.
  std::vector<ContainerMember> members(const std::filesystem::path& container);
  // Opens a file, a member or a sheet. Throws RecordError.
  std::unique_ptr<TextSource> open(const std::filesystem::path& path, Encoding encoding);

 private:
  struct Opened;

  const Opened& opened(const std::filesystem::path& container);

  std::unique_ptr<Opened> last_;  // kept open: the members of a container are read in sequence
};

}  // namespace loopwarden::record
