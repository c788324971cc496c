// SPDX-License-Identifier: Apache-2.0
// The lines of a text file as UTF-8, one after the other, whatever it was written as: gzip or plain, UTF-8, UTF-16 or
// Windows-1252 (Latin-1 is a part of it), line ends of any system, from a file, a member of an archive, a sheet or standard
// input.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "record/import/byte_source.hpp"

namespace loopwarden::record {

enum class Encoding : std::uint8_t { automatic, utf8, utf16, latin1 };
const char* to_text(Encoding encoding) noexcept;

class TextSource {
 public:
  // `name` is what messages call it. Throws RecordError, as all do.
  TextSource(std::unique_ptr<ByteSource> bytes, std::string name,
             Encoding encoding = Encoding::automatic);
  TextSource(TextSource&&) noexcept;
  TextSource& operator=(TextSource&&) noexcept;
  ~TextSource();

  // False at the end. The line lives until the next call of this or of peek() and has no line end.
  bool next(std::string_view& line);
  bool at_end() const noexcept;  // after next(): that was the last one
  // Up to `most_lines` lines from where reading stands; they will be read again.
  std::string_view peek(std::size_t most_lines);

  std::size_t line_number() const noexcept;  // of the last line that next() gave, from 1
  Encoding encoding() const noexcept;        // what it was found to be
  std::string packing() const;               // "gzip", "zip", "xlsx"; "" for plain text
  const std::string& name() const noexcept;  // for messages
  double share_read() const noexcept;        // of all bytes; 0 where their number is not known
  // Of the text when decompressed, as far as it is known beforehand; 0: not known.
  std::uint64_t text_bytes() const noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace loopwarden::record
