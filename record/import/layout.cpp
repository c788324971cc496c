// SPDX-License-Identifier: Apache-2.0
#include "record/import/layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "base/text.hpp"
#include "record/import/export_head.hpp"
#include "record/import/number_text.hpp"
#include "record/import/time_column.hpp"

namespace loopwarden::record {
namespace {

constexpr double kNoHeader = -0.5;  // score of a row that names no columns

class Finder {
 public:
  Finder(ExportHead head, const ImportOptions& options)
      : head_(std::move(head)), options_(options) {}

  Layout find() {
    if (head_.lines.empty()) head_.fail(0, 0, "the file is empty");
    find_delimiter();
    head_.split(layout_.delimiter);
    find_decimal();
    find_annotated();
    find_time(head_, options_, layout_);
    find_header();
    find_long();
    find_clock(head_, options_, layout_);
    find_qualities();
    settle_form(head_, options_, layout_);
    return std::move(layout_);
  }

 private:
  void find_delimiter() {
    if (options_.delimiter) {
      layout_.delimiter = *options_.delimiter;
      return;
    }
    double best = 0.0;
    for (const char candidate : {'\t', ';', '|', ','}) {
      Counts counts;
      LineCells cells;
      for (std::size_t k = head_.bulk(); k < head_.lines.size(); ++k) {
        if (!cells.split(head_.lines[k], candidate)) continue;
        ++counts[cells.cells.size()];
      }
      const auto most = most_frequent(counts);
      if (most == counts.end() || most->first < 2) continue;
      const double agree = static_cast<double>(most->second) /
                           static_cast<double>(head_.lines.size() - head_.bulk());
      // In this order: a comma stands in numbers as well.
      if (agree > best + 0.05) {
        best = agree;
        layout_.delimiter = candidate;
      }
    }
    if (best == 0.0) {
      head_.fail(
          1, 1,
          "one column; a record has times and values, set apart by a comma, semicolon, tab or bar "
          "(--delimiter for another one)");
    }
  }

  void find_decimal() {
    if (options_.decimal) {
      layout_.decimal = *options_.decimal;
      return;
    }
    std::size_t commas = 0;
    std::size_t points = 0;
    for (std::size_t k = head_.bulk(); k < head_.rows.size(); ++k) {
      for (const std::string& text : head_.rows[k]) {
        const std::size_t comma = text.find(',');
        const std::size_t point = text.find('.');
        if (comma != std::string::npos && point == std::string::npos && parse_number(text, ','))
          ++commas;
        if (point != std::string::npos && comma == std::string::npos && parse_number(text, '.'))
          ++points;
      }
    }
    // Beside commas as delimiters one stands in quotes only: "1,5".
    const bool comma = layout_.delimiter == ',' ? commas > 0 && points == 0 : commas > points;
    if (comma) layout_.decimal = ',';
  }

  // InfluxDB: _start and _stop are times as well, and _measurement is no PV.
  void find_annotated() {
    for (std::size_t k = 0; k < std::min(head_.rows.size(), kMostHeaderRows); ++k) {
      const std::optional<std::size_t> time = column_in(k, "_time");
      if (!time || !(column_in(k, "_value") || column_in(k, "_measurement"))) continue;
      layout_.annotated = true;
      layout_.time = *time;
      return;
    }
  }

  std::optional<std::size_t> column_in(std::size_t row, std::string_view name) const {
    const auto at = std::find(head_.rows[row].begin(), head_.rows[row].end(), name);
    if (at == head_.rows[row].end()) return std::nullopt;
    return static_cast<std::size_t>(at - head_.rows[row].begin());
  }

  bool is_data_row(std::size_t row) const {
    if (!parse_time(head_.cell(row, layout_.time), layout_.form, layout_.decimal)) return false;
    for (std::size_t c = 0; c < head_.rows[row].size(); ++c) {
      if (c == layout_.time) continue;
      const Cell kind = parse_value(head_.rows[row][c], layout_.decimal, options_.bad_words).cell;
      if (kind != Cell::unknown) return true;
    }
    return false;
  }

  void find_header() {
    if (options_.header_rows) {
      layout_.header_rows = *options_.header_rows;
    } else {
      std::size_t first = 0;
      while (first < head_.rows.size() && !is_data_row(first)) ++first;
      if (first == head_.rows.size())
        head_.fail(head_.rows.size(), 0, "no row of values with a time was found");
      layout_.header_rows = first;
    }
    const std::size_t header = std::min(layout_.header_rows, head_.rows.size());
    // The row with the most names of signals; of several the first. Rows of descriptions and units have fewer.
    std::size_t best_row = kNoColumn;
    double best = -1.0;
    for (std::size_t k = header > kMostHeaderRows ? header - kMostHeaderRows : 0; k < header; ++k) {
      double score = 0.0;
      std::set<std::string> distinct;
      for (const std::string& text : head_.rows[k]) {
        if (text.empty()) continue;
        distinct.insert(text);
        if (read_tag(text).role) score += 1.0;
        score -= is_unit(text) ? 0.5 : 0.0;
      }
      score += 0.5 * static_cast<double>(std::min(distinct.size(), head_.columns));
      if (head_.rows[k].size() > head_.columns || distinct.size() < 2) score = kNoHeader;
      if (score > best) {
        best = score;
        best_row = k;
      }
    }
    if (best_row != kNoColumn && best > kNoHeader) refuse_wide_rows(best_row);
    layout_.names.assign(head_.columns, "");
    layout_.units.assign(head_.columns, "");
    if (best_row == kNoColumn) {
      for (std::size_t c = 0; c < head_.columns; ++c) layout_.names[c] = std::to_string(c + 1);
      return;
    }
    for (std::size_t c = 0; c < head_.columns; ++c)
      layout_.names[c] = std::string(head_.cell(best_row, c));
    for (std::size_t k = 0; k < header; ++k) {
      if (k == best_row) continue;
      std::size_t units = 0;
      std::size_t filled = 0;
      for (std::size_t c = 0; c < head_.columns; ++c) {
        if (c == layout_.time || head_.cell(k, c).empty()) continue;
        ++filled;
        std::string_view text = head_.cell(k, c);
        if (text.size() > 2 && (text.front() == '[' || text.front() == '('))
          text = text.substr(1, text.size() - 2);
        if (is_unit(text)) ++units;
      }
      if (filled == 0 || 2 * units < filled) continue;
      for (std::size_t c = 0; c < head_.columns; ++c)
        layout_.units[c] = std::string(head_.cell(k, c));
    }
  }

  // Most rows have more cells than the header: which belongs to which column nobody can tell. A single one is told when
  // it is read. Empty ones come of a delimiter at the end of the line.
  void refuse_wide_rows(std::size_t header) {
    const std::size_t named = head_.rows[header].size();
    std::size_t wide = 0;
    std::size_t first = 0;
    std::size_t cells = 0;
    for (std::size_t k = head_.rows.size(); k-- > layout_.header_rows;) {
      std::size_t filled = head_.rows[k].size();
      while (filled > named && head_.rows[k][filled - 1].empty()) --filled;
      if (filled <= named) continue;
      ++wide;
      first = k;
      cells = filled;
    }
    if (2 * wide > head_.rows.size() - layout_.header_rows) {
      layout_.names.resize(named);
      head_.fail(first + 1, 0, too_wide_text(cells, layout_));
    }
    head_.columns = std::min(head_.columns, named);
  }

  static bool one_of(const std::string& word, std::initializer_list<const char*> words) {
    return std::any_of(words.begin(), words.end(),
                       [&](const char* known) { return word == known; });
  }

  void find_long() {
    if (layout_.annotated) {
      take_annotated();
      return;
    }
    for (std::size_t c = 0; c < head_.columns; ++c) {
      if (c == layout_.time) continue;
      const std::string word = base::lower_case(layout_.names[c]);
      if (one_of(word, {"tag",       "tagname",    "tag name",  "tag_name", "name",      "point",
                        "pointname", "point name", "item",      "itemid",   "item id",   "node",
                        "nodeid",    "node id",    "signal",    "variable", "parameter", "series",
                        "metric",    "topic",      "attribute", "channel",  "path"})) {
        if (layout_.tag == kNoColumn) layout_.tag = c;
      } else if (one_of(word,
                        {"value", "val", "reading", "data", "wert", "valeur", "valor", "vvalue"})) {
        if (layout_.value == kNoColumn) layout_.value = c;
      } else if (one_of(word, {"quality", "status", "opcquality", "opc quality", "q", "confidence",
                               "good", "statuscode", "isgood", "questionable_flag"})) {
        if (layout_.quality == kNoColumn) layout_.quality = c;
      }
    }
    if (layout_.tag == kNoColumn || layout_.value == kNoColumn) guess_long();
    layout_.is_long = layout_.tag != kNoColumn && layout_.value != kNoColumn;
    if (!layout_.is_long) layout_.tag = layout_.value = kNoColumn;
  }

  // The tag is what tells the series apart: measurement, tag columns, and the field unless that is "value".
  void take_annotated() {
    std::size_t field = kNoColumn;
    for (std::size_t c = 0; c < head_.columns; ++c) {
      const std::string& name = layout_.names[c];
      if (name == "_value") layout_.value = c;
      if (name == "_field") field = c;
    }
    if (layout_.value == kNoColumn || field == kNoColumn) {  // a column a field
      layout_.value = kNoColumn;
      for (std::size_t c = 0; c < head_.columns; ++c) {
        if (c != layout_.time && layout_.names[c].starts_with("_")) layout_.names[c].clear();
      }
      return;
    }
    layout_.is_long = true;
    layout_.tag = field;
    for (std::size_t c = 0; c < head_.columns; ++c) {
      const std::string& name = layout_.names[c];
      if (name == "_measurement" ||
          (!name.empty() && !name.starts_with("_") && name != "result" && name != "table")) {
        layout_.more_of_tag.push_back(c);
      }
    }
  }

  // Without the names: three or four columns, of which one has words that come again and again, and one numbers.
  void guess_long() {
    if (head_.columns < 3 || head_.columns > 5) return;
    std::size_t words = kNoColumn;
    std::size_t numbers = kNoColumn;
    for (std::size_t c = 0; c < head_.columns; ++c) {
      if (c == layout_.time) continue;
      std::size_t unknown = 0;
      std::size_t number = 0;
      std::set<std::string_view> distinct;
      std::size_t with_role = 0;
      for (std::size_t k = head_.bulk(); k < head_.rows.size(); ++k) {
        const Cell kind = parse_value(head_.cell(k, c), layout_.decimal, options_.bad_words).cell;
        if (kind == Cell::unknown) {
          ++unknown;
          distinct.insert(head_.cell(k, c));
          if (const TagName tag = read_tag(head_.cell(k, c)); tag.role && !tag.loop.empty())
            ++with_role;
        }
        if (kind == Cell::number) ++number;
      }
      const std::size_t rows = head_.rows.size() - head_.bulk();
      if (unknown == rows && 2 * with_role >= rows) words = c;
      if (2 * number > rows && numbers == kNoColumn) numbers = c;
    }
    if (words == kNoColumn || numbers == kNoColumn) return;
    layout_.tag = words;
    layout_.value = numbers;
  }

  void find_qualities() {
    layout_.quality_of.assign(head_.columns, kNoColumn);
    if (layout_.is_long) {
      if (layout_.quality != kNoColumn) layout_.zero_is_good = zeros_are_good({layout_.quality});
      return;
    }
    layout_.quality = kNoColumn;
    std::vector<std::size_t> all;
    for (std::size_t c = 0; c < head_.columns; ++c) {
      const std::string& name = layout_.names[c];
      for (const char* ending :
           {".quality", "_quality", " quality", ".status", "_status", " status", ".q", "_q"}) {
        const std::string_view end(ending);
        if (name.size() <= end.size() ||
            base::lower_case(name.substr(name.size() - end.size())) != end)
          continue;
        const std::string base = name.substr(0, name.size() - end.size());
        for (std::size_t of = 0; of < head_.columns; ++of) {
          if (layout_.names[of] != base) continue;
          layout_.quality_of[of] = c;
          all.push_back(c);
        }
      }
      // As many programs write it: the status right behind its value.
      if (one_of(base::lower_case(name), {"quality", "status"}) && c > 0 && c - 1 != layout_.time &&
          read_tag(layout_.names[c - 1]).role) {
        layout_.quality_of[c - 1] = c;
        all.push_back(c);
      }
    }
    layout_.zero_is_good = zeros_are_good(all);
  }

  // OPC UA has 0 for good, OPC DA 192.
  bool zeros_are_good(const std::vector<std::size_t>& columns) const {
    bool zero = false;
    for (const std::size_t c : columns) {
      for (std::size_t k = layout_.header_rows; k < head_.rows.size(); ++k) {
        const std::string_view text = head_.cell(k, c);
        if (text == "0" || text == "0x00000000") zero = true;
        if (text == "192" || text == "1" || text == "100") return false;
      }
    }
    return zero;
  }

  ExportHead head_;
  const ImportOptions& options_;
  Layout layout_;
};

}  // namespace

bool is_annotation(const Layout& layout, const LineCells& row) {
  return layout.annotated &&
         (row.cells.front().starts_with("#") ||
          std::find(row.cells.begin(), row.cells.end(), "_time") != row.cells.end());
}

std::string_view tag_of(const Layout& layout, const LineCells& row, std::string& buffer) {
  if (row.cells.size() <= layout.tag || is_annotation(layout, row)) return {};
  if (!layout.annotated) return row.cells[layout.tag];
  buffer.clear();
  const auto add = [&](std::string_view part) {
    if (part.empty()) return;
    if (!buffer.empty()) buffer += '.';
    buffer += part;
  };
  for (const std::size_t c : layout.more_of_tag) {
    if (c < row.cells.size()) add(row.cells[c]);
  }
  const std::string_view field = row.cells[layout.tag];
  if (field != "value" || buffer.empty()) add(field);
  return buffer;
}

namespace {

std::string delimiter_text(char c) {
  switch (c) {
    case ',': return "comma";
    case ';': return "semicolon";
    case '\t': return "tab";
    case '|': return "bar";
    default: return base::in_quotes(std::string(1, c));
  }
}

}  // namespace

std::string too_wide_text(std::size_t cells, const Layout& layout) {
  return fmt::format(
      "{} cells where the header has {}; a cell that holds the delimiter, a {}, must stand in "
      "double "
      "quotes",
      cells, layout.names.size(), delimiter_text(layout.delimiter));
}

const char* to_text(Filling filling) noexcept {
  switch (filling) {
    case Filling::automatic: return "auto";
    case Filling::held: return "held";
    case Filling::linear: return "linear";
  }
  return "";
}

bool ImportOptions::anything_said() const noexcept {
  return delimiter || decimal || encoding != Encoding::automatic || header_rows ||
         time != TimeForm::automatic || !time_column.empty() || zone_s || !loops.empty() ||
         !bad_words.empty() || period_s || filling != Filling::automatic;
}

std::string fingerprint(const ImportOptions& o) {
  std::string text = fmt::format(
      "{} {} {} {} {} {} {} {} {}", o.delimiter.value_or(' '), o.decimal.value_or(' '),
      to_text(o.encoding), o.header_rows ? static_cast<long>(*o.header_rows) : -1L, to_text(o.time),
      o.time_column, o.zone_s.value_or(1), o.period_s.value_or(0.0), to_text(o.filling));
  for (const std::string& word : o.bad_words) text += "|" + word;
  for (const LoopSignals& loop : o.loops) {
    text += "|" + loop.tag;
    for (const std::string& name : loop.names) text += "," + name;
  }
  return text;
}

Layout find_layout(std::string_view head, const std::string& name, const ImportOptions& options) {
  return Finder(ExportHead(head, name), options).find();
}

std::string describe(const Layout& layout, const TextSource& source) {
  std::string text = fmt::format(
      "{}{}, decimal {}, {}; times {} in column {}", source.compressed() ? "gzip, " : "",
      delimiter_text(layout.delimiter), layout.decimal == ',' ? "comma" : "point",
      to_text(source.encoding()), to_text(layout.form), base::in_quotes(layout.names[layout.time]));
  if (layout.clock != kNoColumn)
    text += fmt::format(" and {}", base::in_quotes(layout.names[layout.clock]));
  if (layout.annotated) text += "; as InfluxDB writes it";
  text += layout.is_long ? "; a row a value" : "; a column a signal";
  if (layout.header_rows != 1)
    text += fmt::format("; {} lines before the data", layout.header_rows);
  return text;
}

}  // namespace loopwarden::record
