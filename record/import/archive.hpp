// SPDX-License-Identifier: Apache-2.0
// Reads the members of a .zip archive one after the other with libzip, without writing them to a
// disk.
//
// Refused, with the name in the message:
// - an archive of more than 10 000 members, of more than 4 GB when unpacked, or of more than 200
//   times its size on the disk
// - a member that is encrypted, packed by a method unknown to libzip, or longer than stated in the
//   archive's directory
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "record/import/byte_source.hpp"

struct zip;

namespace loopwarden::record {

struct ArchiveMember {
  std::string name;  // UTF-8
  std::uint64_t bytes = 0;
  bool encrypted = false;
};

class Archive {
 public:
  // Throws RecordError.
  explicit Archive(const std::filesystem::path& path);

  const std::vector<ArchiveMember>& members() const noexcept { return members_; }
  // Returns the first member of this name; members().size() if there is none. `any_case`: ignore
  // case.
  std::size_t find(std::string_view name, bool any_case = false) const;
  // Returns a source that outlives the archive. `name` is for messages. Throws RecordError.
  std::unique_ptr<ByteSource> open(std::size_t member, std::string name) const;

 private:
  std::shared_ptr<zip> zip_;
  std::uint64_t file_bytes_ = 0;
  std::vector<ArchiveMember> members_;
};

}  // namespace loopwarden::record
