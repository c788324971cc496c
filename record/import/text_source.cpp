// SPDX-License-Identifier: Apache-2.0
#include "record/import/text_source.hpp"

#include <fmt/format.h>
#include <iconv.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include "base/text.hpp"

namespace loopwarden::record {
namespace {

constexpr std::size_t kBlock = 256UL * 1024UL;
constexpr std::size_t kLongestLine = 64UL * 1024UL * 1024UL;

// Returns a message for known formats that are no text, with advice; empty: unknown.
std::string other_format(std::string_view head) {
  const auto has = [head](std::string_view part) { return head.find(part) != head.npos; };
  if (head.starts_with("PK\x03\x04")) {
    if (has("application/vnd.oasis"))
      return "is a spreadsheet of OpenDocument, which is not read: save it as .xlsx or CSV";
    return "is an archive or a workbook inside an archive or from standard input. Extract it to a "
           "separate file first";
  }
  if (head.starts_with("\x1F\x8B")) return "is packed twice, which is not read: unpack it";
  if (head.starts_with("\xD0\xCF\x11\xE0"))
    return "is an old or an encrypted workbook, which is not read: save it as .xlsx without a "
           "password, or as CSV";
  if (head.starts_with("%PDF")) return "is a PDF, which is not read: export the values as CSV";
  const std::size_t first = head.find_first_not_of(" \t\r\n");
  const std::size_t second =
      first == head.npos ? head.npos : head.find_first_not_of(" \t\r\n", first + 1);
  if (second != head.npos && ((head[first] == '{' && head[second] == '"') ||
                              (head[first] == '[' && (head[second] == '{' || head[second] == '['))))
    return "is JSON, which is not read: export the values as CSV with one column per signal or one "
           "row per value";
  return {};
}

}  // namespace

const char* to_text(Encoding encoding) noexcept {
  switch (encoding) {
    case Encoding::automatic: return "auto";
    case Encoding::utf8: return "utf-8";
    case Encoding::utf16: return "utf-16";
    case Encoding::latin1: return "latin-1";
  }
  return "";
}

struct TextSource::State {
  std::string name;
  std::unique_ptr<ByteSource> bytes;
  iconv_t converter = reinterpret_cast<iconv_t>(-1);  // NOLINT: value of a failed iconv_open
  Encoding encoding = Encoding::automatic;
  std::string raw;   // as in the file, not yet converted
  std::string text;  // UTF-8
  std::size_t at = 0;
  std::size_t line = 0;
  bool ended = false;

  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() {
    if (converts()) iconv_close(converter);
  }

  bool converts() const noexcept {
    return converter != reinterpret_cast<iconv_t>(-1);  // NOLINT
  }

  [[noreturn]] void fail(RecordError::Kind kind, const std::string& what) const {
    refuse(name, what, kind);
  }

  // Appends a block to `to`. Returns false at the end.
  bool read_block(std::string& to) {
    const std::size_t before = to.size();
    to.resize(before + kBlock);
    const std::size_t got = bytes->read(to.data() + before, kBlock);
    to.resize(before + got);
    return got > 0;
  }

  void convert(bool last) {
    if (!converts()) {
      text += raw;
      raw.clear();
      return;
    }
    char* in = raw.data();
    std::size_t left = raw.size();
    std::array<char, 32768> out;
    while (left > 0) {
      char* to = out.data();
      std::size_t room = out.size();
      const std::size_t done = iconv(converter, &in, &left, &to, &room);
      text.append(out.data(), out.size() - room);
      if (done != static_cast<std::size_t>(-1) || errno == E2BIG) continue;
      if (errno == EINVAL && !last)
        break;  // the remaining bytes of a character are in the next
                // block
      if (errno == EINVAL) left = 0;
      if (errno == EILSEQ) {  // five bytes have no character in Windows-1252
        text += '?';
        const std::size_t skipped = encoding == Encoding::utf16 ? 2 : 1;
        in += std::min(skipped, left);
        left -= std::min(skipped, left);
      }
    }
    raw.erase(0, raw.size() - left);
  }

  // Appends more text. Returns false at the end.
  bool fill() {
    if (ended) return false;
    if (at > 0) {
      text.erase(0, at);
      at = 0;
    }
    if (text.size() > kLongestLine) fail(RecordError::Kind::data, "is no text: a line of 64 MiB");
    if (!converts()) {
      if (read_block(text)) return true;
    } else if (read_block(raw)) {
      convert(false);
      return true;
    } else {
      convert(true);
    }
    ended = true;
    return !text.empty();
  }

  void find_encoding(Encoding wanted) {
    read_block(raw);
    std::size_t mark = 0;
    const char* from = nullptr;
    const std::string_view head(raw);
    if (const std::string other = other_format(head); !other.empty())
      fail(RecordError::Kind::data, other);
    if (head.starts_with("\xFF\xFE")) {
      from = "UTF-16LE";
      mark = 2;
    } else if (head.starts_with("\xFE\xFF")) {
      from = "UTF-16BE";
      mark = 2;
    } else if (head.size() > 3 && head[1] == '\0' && head[3] == '\0') {
      from = "UTF-16LE";
    } else if (head.size() > 3 && head[0] == '\0' && head[2] == '\0') {
      from = "UTF-16BE";
    }
    if (from == nullptr && wanted == Encoding::utf16) from = "UTF-16LE";
    if (from != nullptr && (wanted == Encoding::automatic || wanted == Encoding::utf16)) {
      encoding = Encoding::utf16;
    } else if (wanted == Encoding::latin1 ||
               (wanted == Encoding::automatic && !base::is_start_of_utf8(head))) {
      encoding = Encoding::latin1;
      from = "WINDOWS-1252";
    } else {
      encoding = Encoding::utf8;
      from = nullptr;
      if (head.starts_with("\xEF\xBB\xBF")) mark = 3;
    }
    raw.erase(0, mark);
    if (from != nullptr) {
      converter = iconv_open("UTF-8", from);
      if (!converts()) fail(RecordError::Kind::io, fmt::format("{} can't be converted", from));
    }
    convert(false);
    if (encoding == Encoding::utf8 &&
        std::string_view(text).substr(0, kBlock).find('\0') != text.npos) {
      fail(RecordError::Kind::data, "is no text");
    }
  }
};

TextSource::TextSource(std::unique_ptr<ByteSource> bytes, std::string name, Encoding encoding)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.bytes = std::move(bytes);
  s.name = std::move(name);
  s.find_encoding(encoding);
}

TextSource::TextSource(TextSource&&) noexcept = default;
TextSource& TextSource::operator=(TextSource&&) noexcept = default;
TextSource::~TextSource() = default;

bool TextSource::next(std::string_view& line) {
  State& s = *state_;
  std::size_t searched = 0;
  while (true) {
    const std::string_view rest = std::string_view(s.text).substr(s.at);
    const std::size_t end = rest.find('\n', searched);
    if (end != std::string_view::npos) {
      // Reads ahead, so that at_end() is known while the line is valid.
      while (s.at + end + 1 == s.text.size() && s.fill()) {
      }
      line = std::string_view(s.text).substr(s.at, end);
      s.at += end + 1;
      break;
    }
    searched = rest.size();
    if (s.fill()) continue;
    if (s.at >= s.text.size()) return false;
    line = std::string_view(s.text).substr(s.at);
    s.at = s.text.size();
    break;
  }
  if (line.ends_with('\r')) line.remove_suffix(1);
  ++s.line;
  return true;
}

std::string_view TextSource::peek(std::size_t most_lines) {
  State& s = *state_;
  std::size_t lines = 0;
  std::size_t from = 0;
  while (lines < most_lines) {
    const std::size_t end = s.text.find('\n', s.at + from);
    if (end == std::string::npos) {
      const std::size_t known = s.text.size() - s.at;
      if (!s.fill()) return std::string_view(s.text).substr(s.at);
      from = std::min(from, known);
      continue;
    }
    ++lines;
    from = end + 1 - s.at;
  }
  return std::string_view(s.text).substr(s.at, from);
}

bool TextSource::at_end() const noexcept { return state_->at >= state_->text.size(); }
std::size_t TextSource::line_number() const noexcept { return state_->line; }
Encoding TextSource::encoding() const noexcept { return state_->encoding; }
std::string TextSource::packing() const { return state_->bytes->packing(); }
const std::string& TextSource::name() const noexcept { return state_->name; }
double TextSource::share_read() const noexcept { return state_->bytes->share_read(); }
std::uint64_t TextSource::text_bytes() const noexcept { return state_->bytes->unpacked_bytes(); }

}  // namespace loopwarden::record
