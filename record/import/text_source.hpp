// SPDX-License-Identifier: Apache-2.0
// Reads the lines of a text file as UTF-8, in sequence. The source may be gzip or plain, UTF-8,
// UTF-16 or Windows-1252 (which includes Latin-1), with line ends of any system. It may be a file,
// a member of an archive, a sheet or standard input.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "record/import/byte_source.hpp"

namespace loopwarden::record {

enum class Encoding : std::uint8_t { automatic, utf8, utf16, latin1 };
const char* to_text(Encoding encoding) noexcept;

class TextSource {
 public:
  // `name` is used in messages. This and all other functions throw RecordError.
  TextSource(std::unique_ptr<ByteSource> bytes, std::string name,
             Encoding encoding = Encoding::automatic);
  TextSource(TextSource&&) noexcept;
  TextSource& operator=(TextSource&&) noexcept;
  ~TextSource();

  // Reads the next line; returns false at the end. The line has no line end. It is valid until the
  // next call of this function or of peek().
  bool next(std::string_view& line);
  bool at_end() const noexcept;  // after next(): it was the last line
  // Returns up to `most_lines` lines from the present position, without consuming them.
  std::string_view peek(std::size_t most_lines);

  std::size_t line_number() const noexcept;  // of the last line that next() returned, from 1
  Encoding encoding() const noexcept;        // as detected
  std::string packing() const;               // "gzip", "zip", "xlsx"; "" for plain text
  const std::string& name() const noexcept;  // for messages
  double share_read() const noexcept;        // of all bytes; 0 if their number is unknown
  // Returns the size of the decompressed text, as far as it is known in advance; 0: unknown.
  std::uint64_t text_bytes() const noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace loopwarden::record
