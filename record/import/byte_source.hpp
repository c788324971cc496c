// SPDX-License-Identifier: Apache-2.0
// A stream of unpacked bytes: of a file, of a member of an archive, or of a sheet as text.
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
  // Reads up to `most` bytes; returns 0 at the end. Throws a RecordError that begins with the name
  // of the source.
  virtual std::size_t read(char* to, std::size_t most) = 0;
  virtual double share_read() const noexcept = 0;  // 0 if the size is unknown
  // Returns the total size, as far as it is known in advance; 0: unknown.
  virtual std::uint64_t unpacked_bytes() const noexcept = 0;
  virtual const char* packing() const noexcept = 0;  // "gzip", "zip", "xlsx"; "" for plain text
};

// Opens a plain or gzip file; - is standard input. `name` is used in messages. Throws RecordError.
std::unique_ptr<ByteSource> open_file(const std::filesystem::path& path, std::string name);

// Returns all bytes of a source. Throws RecordError if it has more than `most` bytes.
std::string read_all(ByteSource& source, std::size_t most, const std::string& name);

[[noreturn]] inline void refuse(const std::string& name, const std::string& what,
                                RecordError::Kind kind = RecordError::Kind::data) {
  throw RecordError(kind, 0, 0, name + ": " + what);
}

// Returns a name found in a file, without invalid UTF-8 and without characters that a terminal
// interprets. Returns `other` if no character remains.
std::string plain_name(std::string_view name, const std::string& other);

// Returns a plausible limit for a size that a file states, from the file's size on the disk.
std::uint64_t believable_bytes(std::uint64_t stated, std::uint64_t on_disk) noexcept;

}  // namespace loopwarden::record
