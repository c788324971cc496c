// SPDX-License-Identifier: Apache-2.0
#include "record/import/workbook.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <pugixml.hpp>
#include <set>
#include <utility>

#include "base/text.hpp"
#include "record/import/time_text.hpp"

namespace loopwarden::record {
namespace {

constexpr std::size_t kLargestPart = 64UL << 20U;        // of a part that is read as a whole
constexpr std::size_t kLargestElement = 16UL << 20U;     // of an element of a streamed part: a row,
                                                         // a text
constexpr std::size_t kMostSharedBytes = 1UL << 30U;     // of the texts that cells share
constexpr std::uint64_t kMostTextBytes = 4'000'000'000;  // of a sheet
constexpr std::size_t kMostRows = 1'048'576;             // limit of spreadsheets
constexpr std::size_t kMostColumns = 16'384;
constexpr std::size_t kLongestCell = 32'767;

// Returns XML names without their prefix, which the writer can choose.
std::string_view local_name(const char* name) {
  const std::string_view whole(name);
  const std::size_t colon = whole.rfind(':');
  return colon == whole.npos ? whole : whole.substr(colon + 1);
}

bool is(const pugi::xml_node& node, std::string_view name) {
  return local_name(node.name()) == name;
}

pugi::xml_node child(const pugi::xml_node& of, std::string_view name) {
  return of.find_child([&](const pugi::xml_node& node) { return is(node, name); });
}

std::string_view attribute(const pugi::xml_node& of, std::string_view name) {
  const pugi::xml_attribute found =
      of.find_attribute([&](const pugi::xml_attribute& a) { return local_name(a.name()) == name; });
  return found.value();
}

std::optional<unsigned> whole_number(std::string_view text) {
  unsigned value = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (problem != std::errc{} || end != text.data() + text.size() || text.empty())
    return std::nullopt;
  return value;
}

bool is_true(std::string_view text) { return text == "1" || text == "true"; }

// Returns the <t> of a shared or an inline text, also in several formatted runs, without phonetic
// texts.
std::string text_in(const pugi::xml_node& holder) {
  std::string text;
  for (const pugi::xml_node& node : holder.children()) {
    if (is(node, "t")) text += node.text().get();
    if (is(node, "r")) text += child(node, "t").text().get();
  }
  return std::string(base::cut(text, kLongestCell));
}

// Reads consecutive elements of one name from a part, without the whole part in memory.
class Elements {
 public:
  Elements(std::unique_ptr<ByteSource> source, std::string element, std::string name)
      : source_(std::move(source)), element_(std::move(element)), name_(std::move(name)) {}

  // Returns false at the end. The node is valid until the next call.
  bool next(pugi::xml_node& node) {
    while (true) {
      for (; at_; at_ = at_.next_sibling()) {
        if (!is(at_, element_)) continue;
        node = at_;
        at_ = at_.next_sibling();
        return true;
      }
      if (!parse_more()) return false;
    }
  }
  std::uint64_t bytes_read() const noexcept { return bytes_; }
  const ByteSource& source() const noexcept { return *source_; }

 private:
  static constexpr std::size_t kBlock = 256UL << 10U;

  // Returns where the first element begins, with any prefix; npos if there is none.
  std::size_t first_start() {
    for (std::size_t at = buffer_.find('<'); at != buffer_.npos; at = buffer_.find('<', at + 1)) {
      const std::size_t end = buffer_.find_first_of(" \t\r\n/>", at + 1);
      if (end == buffer_.npos) return buffer_.npos;
      const std::string name = buffer_.substr(at + 1, end - at - 1);
      if (local_name(name.c_str()) != element_) continue;
      end_tag_ = "</" + name;
      return at;
    }
    return buffer_.npos;
  }

  // Returns the position after the last end tag; 0 if there is none.
  std::size_t end_of_last() const {
    for (std::size_t at = buffer_.rfind(end_tag_); at != buffer_.npos && at > 0;
         at = buffer_.rfind(end_tag_, at - 1)) {
      const std::size_t close = buffer_.find('>', at);
      if (close != buffer_.npos &&
          buffer_.find_first_not_of(" \t\r\n", at + end_tag_.size()) == close)
        return close + 1;
    }
    return 0;
  }

  bool parse_more() {
    while (!ended_) {
      const std::size_t before = buffer_.size();
      buffer_.resize(before + kBlock);
      const std::size_t got = source_->read(buffer_.data() + before, kBlock);
      buffer_.resize(before + got);
      bytes_ += got;
      ended_ = got == 0;
      if (bytes_ == got && (buffer_.starts_with("\xFF\xFE") || buffer_.starts_with("\xFE\xFF")))
        refuse(name_, "has XML in UTF-16, which is not read");
      if (end_tag_.empty()) {
        const std::size_t start = first_start();
        if (start == buffer_.npos) {
          // A tag may be cut at the end of the block.
          buffer_.erase(0, std::min(buffer_.rfind('<'), buffer_.size()));
          if (buffer_.size() > kLargestElement) refuse(name_, "is damaged XML");
          continue;
        }
        buffer_.erase(0, start);
      }
      std::size_t end = end_of_last();
      // The last elements may have no end tag: <row r="9"/></sheetData>
      if (ended_) end = std::max(end, std::min(buffer_.find("</", end), buffer_.size()));
      if (end == 0) {
        if (buffer_.size() > kLargestElement) refuse(name_, "has an element of 16 MiB");
        continue;
      }
      const pugi::xml_parse_result result = document_.load_buffer(
          buffer_.data(), end, pugi::parse_default | pugi::parse_fragment, pugi::encoding_utf8);
      if (!result) refuse(name_, fmt::format("is damaged XML: {}", result.description()));
      buffer_.erase(0, end);
      at_ = document_.first_child();
      return true;
    }
    return false;
  }

  std::unique_ptr<ByteSource> source_;
  std::string element_;
  std::string name_;
  std::string buffer_;
  std::string end_tag_;  // without its bracket; empty: no start found yet
  std::uint64_t bytes_ = 0;
  bool ended_ = false;
  pugi::xml_document document_;
  pugi::xml_node at_;
};

}  // namespace

NumberKind number_kind(unsigned built_in) noexcept {
  const auto within = [built_in](unsigned low, unsigned high) {
    return built_in >= low && built_in <= high;
  };
  if (within(14, 17) || within(27, 31) || within(34, 36) || within(50, 58)) return NumberKind::date;
  if (within(18, 21) || within(32, 33) || built_in == 45 || built_in == 47)
    return NumberKind::clock;
  if (built_in == 22) return NumberKind::date_time;
  if (built_in == 46) return NumberKind::elapsed;
  return NumberKind::number;
}

NumberKind number_kind(std::string_view code) {
  const std::string lower = base::lower_case(code.substr(0, 256));
  std::string letters;
  bool elapsed = false;
  bool half_day = false;
  for (std::size_t k = 0; k < lower.size() && lower[k] != ';'; ++k) {
    const char c = lower[k];
    if (c == '"') {
      k = std::min(lower.find('"', k + 1), lower.size());
    } else if (c == '\\' || c == '_' || c == '*') {
      ++k;
    } else if (c == '[') {
      const std::size_t close = std::min(lower.find(']', k), lower.size());
      const std::string inside = lower.substr(k + 1, close - k - 1);
      if (!inside.empty() && inside.find_first_not_of(inside.front()) == inside.npos &&
          (inside.front() == 'h' || inside.front() == 'm' || inside.front() == 's'))
        elapsed = true;
      k = close;
    } else if (lower.compare(k, 5, "am/pm") == 0 || lower.compare(k, 3, "a/p") == 0) {
      half_day = true;
      k += lower[k + 1] == 'm' ? 4UL : 2UL;
    } else if (lower.compare(k, 7, "general") == 0) {
      return NumberKind::number;
    } else {
      letters += c;
    }
  }
  const auto has = [&letters](const char* any) {
    return letters.find_first_of(any) != letters.npos;
  };
  if (elapsed) return NumberKind::elapsed;
  const bool clock = half_day || has("hs");
  const bool date = has("yd") || (has("m") && !clock);
  if (date) return clock ? NumberKind::date_time : NumberKind::date;
  return clock ? NumberKind::clock : NumberKind::number;
}

std::string date_text(double days, NumberKind kind, bool from_1904) {
  constexpr double kDay_s = 86400.0;
  constexpr double kEpoch = 25569.0;   // 1970-01-01
  constexpr double kLast = 2958466.0;  // 10000-01-01
  constexpr double kFrom1904 = 1462.0;
  constexpr double kNoSuchDay = 60.0;  // 1900-02-29, which did not exist
  if (from_1904) days += kFrom1904;
  // Spreadsheets show this for an invalid date.
  if (!(days >= 0.0) || days >= kLast) return "########";
  const double whole_ms = std::nearbyint((days - kEpoch) * kDay_s * 1e3);
  const auto ms = static_cast<std::int64_t>(whole_ms);
  std::int64_t whole_s = ms / 1000;
  if (whole_s * 1000 > ms) --whole_s;
  if (days < kNoSuchDay) whole_s += static_cast<std::int64_t>(kDay_s);
  const double rest_s = static_cast<double>(ms % 1000 < 0 ? ms % 1000 + 1000 : ms % 1000) / 1e3;
  const std::string text = iso_text(whole_s, rest_s + 1e-9, false);
  constexpr std::size_t kDate = 10;  // characters of 2026-03-01
  const double since_first = from_1904 ? days - kFrom1904 : days;
  if (kind == NumberKind::elapsed) return fmt::format("{:.3f}", since_first * kDay_s);
  if (kind == NumberKind::clock && since_first < 1.0) return text.substr(kDate + 1);
  if (kind == NumberKind::date && text.substr(kDate) == "T00:00:00") return text.substr(0, kDate);
  return text;
}

struct Workbook::Texts {
  std::vector<std::string> shared;
  std::vector<NumberKind> styles;  // by the number of a cell's style
};

namespace {

class SheetText : public ByteSource {
 public:
  SheetText(std::unique_ptr<ByteSource> source,
            std::shared_ptr<const std::vector<std::string>> shared,
            std::shared_ptr<const std::vector<NumberKind>> styles, bool from_1904, std::string name)
      : rows_(std::move(source), "row", name),
        shared_(std::move(shared)),
        styles_(std::move(styles)),
        from_1904_(from_1904),
        name_(std::move(name)) {}

  std::size_t read(char* to, std::size_t most) override {
    pugi::xml_node row;
    while (at_ == text_.size()) {
      text_.clear();
      at_ = 0;
      if (!rows_.next(row)) return 0;
      add_row(row);
      written_ += text_.size();
      if (written_ > kMostTextBytes)
        refuse(name_, fmt::format("is more than {} GB of text", kMostTextBytes / 1'000'000'000));
    }
    const std::size_t taken = std::min(most, text_.size() - at_);
    std::copy_n(text_.data() + at_, taken, to);
    at_ += taken;
    return taken;
  }
  double share_read() const noexcept override { return rows_.source().share_read(); }
  // Assumes that the rest of the XML yields text in the same proportion as the part already read.
  std::uint64_t unpacked_bytes() const noexcept override {
    if (rows_.bytes_read() == 0) return 0;
    return static_cast<std::uint64_t>(static_cast<double>(rows_.source().unpacked_bytes()) *
                                      static_cast<double>(written_) /
                                      static_cast<double>(rows_.bytes_read()));
  }
  const char* packing() const noexcept override { return "xlsx"; }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw RecordError(RecordError::Kind::data, row_, 0,
                      fmt::format("{}:{}: {}", name_, row_, what));
  }

  void add_row(const pugi::xml_node& row) {
    const std::size_t before = row_++;
    if (const std::string_view number = attribute(row, "r"); !number.empty()) {
      row_ = whole_number(number).value_or(0);
      if (row_ <= before || row_ > kMostRows) {
        row_ = before + 1;
        fail(fmt::format("a row numbered {} after row {}", base::in_quotes(number), before));
      }
    }
    text_.append(row_ - before - 1, '\n');
    std::size_t column = 0;  // of the last cell, from 1
    std::size_t tabs = 0;
    for (const pugi::xml_node& cell : row.children()) {
      if (!is(cell, "c")) continue;
      const std::string_view place = attribute(cell, "r");
      const std::size_t here = place.empty() ? column + 1 : column_of(place);
      if (here <= column || here > kMostColumns)
        fail(fmt::format("a cell {} out of place", base::in_quotes(place)));
      column = here;
      const std::string value = value_of(cell);
      if (value.empty()) continue;
      text_.append(column - 1 - tabs, '\t');
      tabs = column - 1;
      add_cell(value);
    }
    // Pads the row to the width of the rows above: an empty cell counts as well.
    widest_ = std::max(widest_, tabs);
    text_.append(widest_ - tabs, '\t');
    text_ += '\n';
  }

  // Returns the column of a cell's place, "AB12": 28; 0: no valid place.
  static std::size_t column_of(std::string_view place) {
    std::size_t column = 0;
    for (const char c : place) {
      if (c < 'A' || c > 'Z') break;
      column = 26 * column + static_cast<std::size_t>(c - 'A') + 1;
      if (column > kMostColumns) break;
    }
    return column;
  }

  std::string value_of(const pugi::xml_node& cell) const {
    const std::string_view type = attribute(cell, "t");
    if (type == "inlineStr") return text_in(child(cell, "is"));
    const std::string_view value = base::trimmed(child(cell, "v").text().get());
    if (type == "s" && !value.empty()) {
      const auto at = whole_number(value);
      if (!at || *at >= shared_->size())
        fail(
            fmt::format("text {} of {} that cells share", base::in_quotes(value), shared_->size()));
      return (*shared_)[*at];
    }
    if (type.empty() || type == "n") {
      const std::size_t style = whole_number(attribute(cell, "s")).value_or(0);
      const NumberKind kind = style < styles_->size() ? (*styles_)[style] : NumberKind::number;
      double days = 0.0;
      if (kind != NumberKind::number) {
        const auto [end, problem] =
            std::from_chars(value.data(), value.data() + value.size(), days);
        if (problem == std::errc{} && end == value.data() + value.size())
          return date_text(days, kind, from_1904_);
      }
    }
    return std::string(base::cut(value, kLongestCell));
  }

  void add_cell(std::string_view value) {
    const bool quoted = value.find('"') != value.npos;
    if (quoted) text_ += '"';
    for (const char c : value) {
      if (c == '"') text_ += '"';
      text_ += c == '\t' || c == '\n' || c == '\r' ? ' ' : c;
    }
    if (quoted) text_ += '"';
  }

  Elements rows_;
  std::shared_ptr<const std::vector<std::string>> shared_;
  std::shared_ptr<const std::vector<NumberKind>> styles_;
  bool from_1904_;
  std::string name_;
  std::string text_;
  std::size_t at_ = 0;  // in text_
  std::size_t row_ = 0;
  std::size_t widest_ = 0;  // number of tabs
  std::uint64_t written_ = 0;
};

void parse(pugi::xml_document& document, const std::string& text, const std::string& name) {
  const pugi::xml_parse_result result =
      document.load_buffer(text.data(), text.size(), pugi::parse_default, pugi::encoding_auto);
  if (!result) refuse(name, fmt::format("is damaged XML: {}", result.description()));
}

// Returns `target`, relative to `folder`, as a part's name.
std::string part_at(const std::string& folder, std::string_view target) {
  const std::string whole =
      target.starts_with('/') ? std::string(target.substr(1)) : folder + std::string(target);
  return std::filesystem::path(whole).lexically_normal().generic_string();
}

}  // namespace

Workbook::Workbook(OpenPart open, std::string name)
    : open_(std::move(open)), name_(std::move(name)) {
  read_sheets();
}

Workbook::~Workbook() = default;

std::string Workbook::text_of(const std::string& part) const {
  const std::unique_ptr<ByteSource> source = open_(part);
  return source ? record::read_all(*source, kLargestPart, name_ + "/" + part) : std::string();
}

void Workbook::read_sheets() {
  std::string book = "xl/workbook.xml";
  if (const std::string text = text_of("_rels/.rels"); !text.empty()) {
    pugi::xml_document links;
    parse(links, text, name_ + "/_rels/.rels");
    for (const pugi::xml_node& link : links.document_element().children()) {
      if (attribute(link, "Type").ends_with("/officeDocument"))
        book = part_at("", attribute(link, "Target"));
    }
  }
  if (book.ends_with(".bin"))
    refuse(name_, "is a binary workbook, which is not read: save it as .xlsx");
  const std::string text = text_of(book);
  pugi::xml_document document;
  if (!text.empty()) parse(document, text, name_ + "/" + book);
  const pugi::xml_node root = document.document_element();
  if (!is(root, "workbook")) refuse(name_, "is no workbook: it has no list of sheets");
  from_1904_ = is_true(attribute(child(root, "workbookPr"), "date1904"));
  const std::size_t slash = book.rfind('/');
  folder_ = slash == book.npos ? "" : book.substr(0, slash + 1);
  std::map<std::string, std::string, std::less<>> sheets;  // parts by their id
  const std::string links_part = folder_ + "_rels/" + book.substr(folder_.size()) + ".rels";
  if (const std::string links_text = text_of(links_part); !links_text.empty()) {
    pugi::xml_document links;
    parse(links, links_text, name_ + "/" + links_part);
    for (const pugi::xml_node& link : links.document_element().children()) {
      const std::string_view type = attribute(link, "Type");
      const std::string part = part_at(folder_, attribute(link, "Target"));
      if (type.ends_with("/worksheet")) sheets.emplace(attribute(link, "Id"), part);
      if (type.ends_with("/styles")) styles_ = part;
      if (type.ends_with("/sharedStrings")) strings_ = part;
    }
  }
  std::set<std::string> names;
  for (const pugi::xml_node& sheet : child(root, "sheets").children()) {
    if (!is(sheet, "sheet")) continue;
    const auto part = sheets.find(attribute(sheet, "id"));
    if (part == sheets.end()) continue;  // sheet of a chart
    const std::string other = fmt::format("sheet {}", sheets_.size() + 1);
    std::string name = plain_name(base::cut(attribute(sheet, "name"), 100), other);
    if (!names.insert(name).second) {
      name = other;
      names.insert(name);
    }
    sheets_.push_back({std::move(name), part->second});
  }
}

void Workbook::read_styles(Texts& texts) const {
  const std::string text = styles_.empty() ? std::string() : text_of(styles_);
  if (text.empty()) return;
  pugi::xml_document document;
  parse(document, text, name_ + "/" + styles_);
  const pugi::xml_node root = document.document_element();
  std::map<unsigned, NumberKind> own;
  for (const pugi::xml_node& format : child(root, "numFmts").children()) {
    if (const auto id = whole_number(attribute(format, "numFmtId")))
      own[*id] = number_kind(attribute(format, "formatCode"));
  }
  for (const pugi::xml_node& format : child(root, "cellXfs").children()) {
    if (!is(format, "xf")) continue;
    const unsigned id = whole_number(attribute(format, "numFmtId")).value_or(0);
    const auto at = own.find(id);
    texts.styles.push_back(at == own.end() ? number_kind(id) : at->second);
  }
}

void Workbook::read_strings(Texts& texts) const {
  std::unique_ptr<ByteSource> source = strings_.empty() ? nullptr : open_(strings_);
  if (!source) return;
  Elements elements(std::move(source), "si", name_ + "/" + strings_);
  pugi::xml_node text;
  std::size_t bytes = 0;
  while (elements.next(text)) {
    texts.shared.push_back(text_in(text));
    bytes += texts.shared.back().size() + sizeof(std::string);
    if (bytes > kMostSharedBytes)
      refuse(name_, fmt::format("has more than {} GiB of texts", kMostSharedBytes >> 30U));
  }
}

std::unique_ptr<ByteSource> Workbook::open(std::size_t sheet, std::string name) {
  if (!texts_) {
    auto texts = std::make_shared<Texts>();
    read_styles(*texts);
    read_strings(*texts);
    texts_ = std::move(texts);
  }
  std::unique_ptr<ByteSource> source = open_(sheets_.at(sheet).part);
  if (!source)
    refuse(name, fmt::format("its part {} is missing", base::in_quotes(sheets_[sheet].part)));
  return std::make_unique<SheetText>(
      std::move(source), std::shared_ptr<const std::vector<std::string>>(texts_, &texts_->shared),
      std::shared_ptr<const std::vector<NumberKind>>(texts_, &texts_->styles), from_1904_,
      std::move(name));
}

}  // namespace loopwarden::record
