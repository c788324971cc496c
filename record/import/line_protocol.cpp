// SPDX-License-Identifier: Apache-2.0
#include "record/import/line_protocol.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <set>

#include "base/text.hpp"
#include "record/import/quality.hpp"

namespace loopwarden::record {
namespace {

constexpr std::size_t kLookedAtLines = 200;
constexpr std::size_t kLinesToKnow = 3;

class ProtocolScanner {
 public:
  explicit ProtocolScanner(std::string_view text) : rest_(text) {}

  bool at_end() const { return rest_.empty(); }
  char next() const { return rest_.empty() ? '\0' : rest_.front(); }
  bool take(char c) {
    if (next() != c) return false;
    rest_.remove_prefix(1);
    return true;
  }
  void skip_blanks() {
    while (take(' ')) {
    }
  }
  // Reads up to one of `ends` without a backslash before it.
  std::string word(std::string_view ends) {
    std::string out;
    while (!rest_.empty() && ends.find(rest_.front()) == ends.npos) {
      const bool escaped = rest_.size() > 1 && rest_[0] == '\\' &&
                           std::string_view(" ,=\\").find(rest_[1]) != std::string_view::npos;
      if (escaped) rest_.remove_prefix(1);
      out += rest_.front();
      rest_.remove_prefix(1);
    }
    return out;
  }
  // Reads a quoted string, without the quotes. Returns false if it does not end.
  bool quoted(std::string& out) {
    out.clear();
    if (!take('"')) return false;
    while (!rest_.empty()) {
      if (take('"')) return true;
      if (rest_.size() > 1 && rest_[0] == '\\' && (rest_[1] == '"' || rest_[1] == '\\'))
        rest_.remove_prefix(1);
      out += rest_.front();
      rest_.remove_prefix(1);
    }
    return false;
  }
  std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
};

// Converts a field's value to a cell: a number, 1 or 0. Returns false if it is no valid value.
bool as_cell(std::string& value) {
  if (value.empty()) return false;
  const std::string word = base::lower_case(value);
  if (word == "t" || word == "true" || word == "f" || word == "false") {
    value = word.front() == 't' ? "1" : "0";
    return true;
  }
  if (value.back() == 'i' || value.back() == 'u') value.pop_back();
  double number = 0.0;
  const char* first = value.data() + (value.starts_with('+') ? 1 : 0);
  const auto [end, problem] = std::from_chars(first, value.data() + value.size(), number);
  return problem == std::errc{} && end == value.data() + value.size();
}

// Replaces tabs, quotes and line ends, which are syntax of the table.
void add_plain(std::string& to, std::string_view text) {
  for (const char c : text) to += c == '\t' || c == '"' || c == '\r' || c == '\n' ? ' ' : c;
}

bool says_something(std::string_view line) {
  const std::string_view text = base::trimmed(line);
  return !text.empty() && text.front() != '#';
}

class ProtocolBytes : public ByteSource {
 public:
  explicit ProtocolBytes(std::unique_ptr<TextSource> text) : text_(std::move(text)) {
    look_ahead();
    out_ = "time\tseries\tvalue";
    if (!quality_.empty()) out_ += "\t" + quality_;
    out_ += '\n';
  }

  std::size_t read(char* to, std::size_t most) override {
    std::string_view line;
    while (out_.size() < most && text_->next(line)) {
      if (says_something(line)) add(line);
    }
    const std::size_t count = std::min(most, out_.size());
    std::copy_n(out_.data(), count, to);
    out_.erase(0, count);
    return count;
  }
  double share_read() const noexcept override { return text_->share_read(); }
  std::uint64_t unpacked_bytes() const noexcept override { return text_->text_bytes(); }
  const char* packing() const noexcept override { return kLineProtocol; }

 private:
  // Finds constant tags, and the name of qualities.
  void look_ahead() {
    std::map<std::string, std::set<std::string>> values;
    std::string_view head = text_->peek(kLookedAtLines);
    while (!head.empty()) {
      const std::size_t end = std::min(head.find('\n'), head.size());
      if (parse_protocol_line(head.substr(0, end), line_)) {
        for (const auto& [key, value] : line_.tags) {
          values[key].insert(value);
          note_quality(key, {});
        }
        for (const auto& [key, value] : line_.fields) {
          note_quality(key, {});
          for (const auto& [of, ignored] : line_.fields) note_quality(key, of);
        }
      }
      head.remove_prefix(std::min(end + 1, head.size()));
    }
    for (const auto& [key, all] : values) {
      if (all.size() == 1) constant_.insert(key);
    }
  }

  // Returns the part of the field's name `key` that names a quality of the field `of`; empty if
  // there is none.
  static std::string_view quality_part(std::string_view key, std::string_view of) {
    if (!key.starts_with(of) || key == of) return {};
    key.remove_prefix(of.size());
    while (!key.empty() && std::string_view("._- ").find(key.front()) != key.npos)
      key.remove_prefix(1);
    const QualityKind kind = quality_kind(key);
    // As a whole name, "status" may have any meaning.
    const bool vague = kind == QualityKind::status || kind == QualityKind::flags;
    return kind == QualityKind::none || (vague && of.empty()) ? std::string_view() : key;
  }

  void note_quality(std::string_view key, std::string_view of) {
    if (quality_.empty()) quality_ = quality_part(key, of);
  }

  bool is_quality(const std::string& key) const {
    if (quality_.empty()) return false;
    return quality_part(key, {}) == quality_ ||
           std::any_of(line_.fields.begin(), line_.fields.end(), [&](const auto& field) {
             return quality_part(key, field.first) == quality_;
           });
  }

  // Returns the quality of the field `of`: its own, otherwise the line's.
  std::string_view quality_of(const std::string& of) const {
    for (const auto& [key, value] : line_.fields) {
      if (quality_part(key, of) == quality_) return value;
    }
    for (const auto* list : {&line_.fields, &line_.tags}) {
      for (const auto& [key, value] : *list) {
        if (quality_part(key, {}) == quality_) return value;
      }
    }
    return {};
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw RecordError(RecordError::Kind::data, text_->line_number(), 0,
                      fmt::format("{}:{}: {}", text_->name(), text_->line_number(), what));
  }

  void add(std::string_view text) {
    if (!parse_protocol_line(text, line_)) {
      if (text_->at_end()) return;  // the file was copied while it was being written
      fail("is no line of InfluxDB line protocol");
    }
    if (line_.time.empty()) fail("a line without a time, which can't be placed in a record");
    std::string series = line_.measurement;
    for (const auto& [key, value] : line_.tags) {
      if (constant_.count(key) == 0 && !is_quality(key)) series += "." + value;
    }
    for (const auto& [field, value] : line_.fields) {
      if (is_quality(field)) continue;
      add_plain(out_, line_.time);
      out_ += '\t';
      add_plain(out_, series);
      if (field != "value") {
        out_ += '.';
        add_plain(out_, field);
      }
      out_ += '\t';
      add_plain(out_, value);
      if (!quality_.empty()) {
        out_ += '\t';
        add_plain(out_, quality_of(field));
      }
      out_ += '\n';
    }
  }

  std::unique_ptr<TextSource> text_;
  std::set<std::string> constant_;
  std::string quality_;  // name of the fields' qualities; empty: no qualities
  ProtocolLine line_;
  std::string out_;
};

}  // namespace

bool parse_protocol_line(std::string_view text, ProtocolLine& line) {
  line.measurement.clear();
  line.tags.clear();
  line.fields.clear();
  line.time.clear();
  while (!text.empty() && (text.back() == ' ' || text.back() == '\r')) text.remove_suffix(1);
  ProtocolScanner in(text);
  in.skip_blanks();
  line.measurement = in.word(", ");
  if (line.measurement.empty()) return false;
  while (in.take(',')) {
    std::string key = in.word("=, ");
    if (key.empty() || !in.take('=')) return false;
    line.tags.emplace_back(std::move(key), in.word(", "));
  }
  if (!in.take(' ')) return false;
  in.skip_blanks();
  do {
    std::string key = in.word("=, ");
    if (key.empty() || !in.take('=')) return false;
    std::string value;
    if (in.next() == '"') {
      if (!in.quoted(value)) return false;
    } else {
      value = in.word(", ");
      if (!as_cell(value)) return false;
    }
    line.fields.emplace_back(std::move(key), std::move(value));
  } while (in.take(','));
  if (in.at_end()) return true;
  if (!in.take(' ')) return false;
  in.skip_blanks();
  line.time = std::string(in.rest());
  const std::size_t sign = line.time.starts_with('-') ? 1 : 0;
  return line.time.size() > sign &&
         line.time.find_first_not_of("0123456789", sign) == std::string::npos;
}

bool is_line_protocol(std::string_view head) {
  ProtocolLine line;
  std::size_t lines = 0;
  while (!head.empty() && lines < kLinesToKnow) {
    const std::size_t end = std::min(head.find('\n'), head.size());
    const std::string_view text = head.substr(0, end);
    head.remove_prefix(std::min(end + 1, head.size()));
    if (!says_something(text)) continue;
    if (!parse_protocol_line(text, line)) return false;
    ++lines;
  }
  return lines > 0;
}

std::unique_ptr<TextSource> protocol_table(std::unique_ptr<TextSource> text) {
  std::string name = text->name();
  return std::make_unique<TextSource>(std::make_unique<ProtocolBytes>(std::move(text)),
                                      std::move(name), Encoding::utf8);
}

}  // namespace loopwarden::record
