// SPDX-License-Identifier: Apache-2.0
// Bytes as they come, unpacked: of a file, of a member of an archive, of a sheet as text.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "record/record_csv.hpp"

namespace loopwarden::record {

class ByteSource {
 public:
  virtual ~ByteSource() = default;
  // Up to `most` bytes; 0 at the end. Throws RecordError that begins with the name of what is read.
  virtual std::size_t read(char* to, std::size_t most) = 0;
  virtual double share_read() const noexcept = 0;  // 0 where the size is not known
  // Of all of it, as far as it is known beforehand; 0: not known.
  virtual std::uint64_t unpacked_bytes() const noexcept = 0;
  virtual const char* packing() const noexcept = 0;  // "gzip", "zip", "xlsx"; "" for plain text
};

// A plain file or one packed by gzip; - is standard input. `name` is what messages call it. Throws RecordError.
std::unique_ptr<ByteSource> open_file(const std::filesystem::path& path, std::string name);

// All of a source of at most `most` bytes; throws RecordError where it has more.
std::string read_all(ByteSource& source, std::size_t most, const std::string& name);

[[noreturn]] inline void refuse(const std::string& name, const std::string& what,
                                RecordError::Kind kind = RecordError::Kind::data) {
  throw RecordError(kind, 0, 0, name + ": " + what);
}

// A name that came from within a file, without what a terminal would act on and what is no UTF-8; `other` if that leaves
// nothing.
std::string plain_name(std::string_view name, const std::string& other);

// What a size that a file states of itself may be believed to be, seeing how large it is on the disk.
std::uint64_t believable_bytes(std::uint64_t stated, std::uint64_t on_disk) noexcept;

}  // namespace loopwarden::record
