// SPDX-License-Identifier: Apache-2.0
#include "record/record_csv.hpp"

#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <charconv>
#include <cmath>
#include <utility>

#include "base/edit_distance.hpp"
#include "base/file.hpp"
#include "base/text.hpp"

namespace loopwarden::record {
namespace {

constexpr double kLargestStepError = 0.01;  // of the median step
constexpr std::size_t kBufferBytes = 64UL * 1024UL;

struct Cell {
  std::string_view text;
  std::size_t column = 0;  // of its first byte in the line, from 1
};

class Parser {
 public:
  Parser(std::string_view text, std::string_view name) : rest_(text), name_(name) {}

  Record parse() {
    constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
    // Text that a spreadsheet saved as "Unicode" begins with a mark, or each other byte is zero.
    if (rest_.starts_with("\xFF\xFE") || rest_.starts_with("\xFE\xFF") ||
        rest_.substr(0, 2).find('\0') != std::string_view::npos) {
      fail(0, "is UTF-16 and not UTF-8; save it as CSV UTF-8");
    }
    if (rest_.starts_with(kByteOrderMark)) rest_.remove_prefix(kByteOrderMark.size());
    if (rest_.find_first_not_of(" \t\r\n") == std::string_view::npos) fail(0, "the file is empty");
    next_line();
    read_header();
    reserve();
    while (next_line()) read_row();
    check_period();
    return std::move(record_);
  }

 private:
  struct Column {
    std::string_view name;
    std::vector<double>* values;
    bool required;  // in the file
    bool complete;  // every cell is required
    std::size_t index = kAbsent;
  };
  static constexpr std::size_t kAbsent = static_cast<std::size_t>(-1);

  [[noreturn]] void fail(std::size_t column, const std::string& what) const {
    std::string place(name_);
    if (line_ > 0) place += fmt::format(":{}", line_);
    if (line_ > 0 && column > 0) place += fmt::format(":{}", column);
    throw RecordError(RecordError::Kind::data, line_, column, place + ": " + what);
  }

  bool next_line() {
    if (rest_.empty()) return false;
    const std::size_t end = rest_.find('\n');
    text_ = rest_.substr(0, end);
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    if (text_.ends_with('\r')) text_.remove_suffix(1);
    ++line_;
    return true;
  }

  void split() {
    cells_.clear();
    std::size_t at = 0;
    while (true) {
      const std::size_t start = std::min(text_.find_first_not_of(" \t", at), text_.size());
      std::size_t end = text_.find(',', at);
      if (start < text_.size() && text_[start] == '"') {
        const std::size_t close = closing_quote(start);
        cells_.push_back({base::trimmed(text_.substr(start + 1, close - start - 1)), start + 1});
        end = text_.find(',', close);
        if (!base::trimmed(text_.substr(close + 1, end - close - 1)).empty()) {
          fail(close + 2, "text after the closing quote");
        }
      } else {
        const std::string_view cell = text_.substr(at, end - at);
        cells_.push_back({base::trimmed(cell), std::min(start, at + cell.size()) + 1});
      }
      if (end == std::string_view::npos) return;
      at = end + 1;
    }
  }

  std::size_t closing_quote(std::size_t open) const {
    std::size_t at = open + 1;
    while (true) {
      at = text_.find('"', at);
      if (at == std::string_view::npos) fail(open + 1, "no closing quote in this line");
      // A doubled quote means the character itself.
      if (at + 1 >= text_.size() || text_[at + 1] != '"') return at;
      at += 2;
    }
  }

  void read_header() {
    split();
    columns_in_file_ = cells_.size();
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      for (Column& column : columns_) {
        if (cells_[i].text != column.name) continue;
        if (column.index != kAbsent) fail_twice(cells_[i]);
        column.index = i;
      }
      if (cells_[i].text == "mode") {
        if (mode_index_ != kAbsent) fail_twice(cells_[i]);
        mode_index_ = i;
      }
    }
    for (const Column& column : columns_) {
      if (column.required && column.index == kAbsent) fail_missing(column.name);
    }
  }

  [[noreturn]] void fail_twice(const Cell& cell) const {
    fail(cell.column, fmt::format("column '{}' appears twice in the header", cell.text));
  }

  [[noreturn]] void fail_missing(std::string_view wanted) const {
    std::string what = fmt::format("no column '{}' in the header", wanted);
    if (cells_.size() == 1 && text_.find_first_of(";\t") != std::string_view::npos) {
      fail(1, what + "; cells must be separated by commas");
    }
    const Cell* nearest = nullptr;
    std::size_t best = wanted.size() / 2 + 1;
    for (const Cell& cell : cells_) {
      constexpr std::size_t kLongestName = 40;
      const std::string name = base::lower_case(cell.text.substr(0, kLongestName));
      const bool contains = name.find(wanted) != std::string::npos;
      const std::size_t distance = name == wanted ? 0
                                   : contains     ? 1
                                                  : base::edit_distance(name, wanted);
      if (distance < best) {
        best = distance;
        nearest = &cell;
      }
    }
    if (nearest == nullptr) fail(1, what);
    fail(nearest->column, fmt::format("{}; is it {}?", what, base::in_quotes(nearest->text)));
  }

  void reserve() {
    // An estimate from the first data row. The size of a hostile file limits it.
    const std::size_t row_bytes = std::max<std::size_t>(rest_.find('\n'), 8);
    const std::size_t rows = row_bytes > rest_.size() ? 1 : rest_.size() / row_bytes + 1;
    for (Column& column : columns_) {
      if (column.index != kAbsent) column.values->reserve(rows);
    }
  }

  void read_row() {
    if (base::trimmed(text_).empty()) {
      // Blank lines are allowed at the end of the file only.
      if (rest_.find_first_not_of(" \t\r\n") != std::string_view::npos) fail(1, "an empty line");
      rest_ = {};
      return;
    }
    split();
    if (cells_.size() != columns_in_file_) {
      fail(cells_.size() < columns_in_file_ ? text_.size() + 1 : cells_[columns_in_file_].column,
           fmt::format("{} cells where the header has {}", cells_.size(), columns_in_file_));
    }
    for (const Column& column : columns_) {
      if (column.index != kAbsent) column.values->push_back(value(column, cells_[column.index]));
    }
    // Never an error, because earlier versions allowed any content in this column.
    if (mode_index_ != kAbsent) record_.automatic.push_back(parse_mode(cells_[mode_index_].text));
    const std::vector<double>& time_s = record_.time_s;
    if (time_s.size() > 1 && !(time_s.back() > time_s[time_s.size() - 2])) {
      fail(cells_[columns_.front().index].column,
           fmt::format("time: {} s is not later than the {} s of the row before", time_s.back(),
                       time_s[time_s.size() - 2]));
    }
  }

  double value(const Column& column, const Cell& cell) const {
    // Many programs write this for a missing value.
    const bool nan = cell.text.size() == 3 && base::lower_case(cell.text) == "nan";
    if (cell.text.empty() || nan) {
      if (column.complete) fail(cell.column, fmt::format("{}: no value", column.name));
      return std::numeric_limits<double>::quiet_NaN();
    }
    double number = 0.0;
    const char* end = cell.text.data() + cell.text.size();
    // from_chars does not accept a leading plus sign.
    const bool plus = cell.text.size() > 1 && cell.text[0] == '+' && cell.text[1] != '-';
    const auto [stop, error] = std::from_chars(cell.text.data() + (plus ? 1 : 0), end, number);
    if (error == std::errc::result_out_of_range) {
      fail(cell.column,
           fmt::format("{}: {} is out of range", column.name, base::in_quotes(cell.text)));
    }
    if (error != std::errc{} || stop != end || !std::isfinite(number)) {
      fail(cell.column,
           fmt::format("{}: {} is not a number{}", column.name, base::in_quotes(cell.text),
                       !column.complete && error == std::errc{} && stop == end
                           ? "; leave the cell of a missing sample empty"
                           : ""));
    }
    return number;
  }

  // Errors name their line: row i is in line i + 2.
  void check_period() {
    const std::vector<double>& time_s = record_.time_s;
    if (time_s.size() < 2) {
      line_ = 0;
      fail(0, fmt::format("{} rows; a period needs at least two", time_s.size()));
    }
    std::vector<double> steps;
    steps.reserve(time_s.size() - 1);
    for (std::size_t i = 1; i < time_s.size(); ++i) steps.push_back(time_s[i] - time_s[i - 1]);
    std::vector<double> sorted = steps;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>((sorted.size() - 1) / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    const double median = *middle;
    for (std::size_t i = 0; i < steps.size(); ++i) {
      if (std::abs(steps[i] - median) <= kLargestStepError * median) continue;
      line_ = i + 3;
      fail(0, fmt::format("time: a step of {:.6g} s to row {}, where the period is {:.6g} s; steps "
                          "must be within 1 % of it, and the cells of missing samples empty",
                          steps[i], i + 2, median));
    }
    // The mean is finer than one step of rounded times; both agree within 1 %.
    const double mean = (time_s.back() - time_s.front()) / static_cast<double>(steps.size());
    if (!std::isfinite(mean)) fail(0, "time: the record is too long for a double");
    record_.period_s = tidy_period_s(mean);
  }

  std::string_view rest_;
  std::string name_;
  std::string_view text_;  // the present line
  std::size_t line_ = 0;
  std::vector<Cell> cells_;
  std::size_t columns_in_file_ = 0;
  Record record_;
  std::size_t mode_index_ = kAbsent;
  std::array<Column, 5> columns_{{
      {"time", &record_.time_s, true, true},
      {"pv", &record_.pv, true, false},
      {"sp", &record_.sp, false, false},
      {"co", &record_.co, false, false},
      {"stem", &record_.stem, false, false},
  }};
};

[[noreturn]] void fail_io(const std::filesystem::path& path, const std::string& what) {
  throw RecordError(RecordError::Kind::io, 0, 0, path.string() + ": " + what);
}

[[noreturn]] void fail_errno(const std::filesystem::path& path, std::string_view what, int error) {
  fail_io(path, fmt::format("{}: {}", what, base::error_text(error)));
}

// Removes rounding errors: 0.3 instead of 0.30000000000000004 for three periods of 0.1 s. It rounds
// to 15 digits, unless that moves a time by more than 1 ns.
double without_rounding_error(double time_s) {
  std::array<char, 32> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), time_s,
                                 std::chars_format::general, 15)
                       .ptr;
  double rounded = 0.0;
  std::from_chars(digits.data(), end, rounded);
  return std::abs(rounded - time_s) <= 1e-9 ? rounded : time_s;
}

}  // namespace

Record parse_record(std::string_view text, std::string_view name) {
  return Parser(text, name).parse();
}

double tidy_period_s(double mean_s) noexcept {
  const double whole_microseconds = std::nearbyint(mean_s * 1e6) / 1e6;
  return std::abs(whole_microseconds - mean_s) <= 1e-6 * mean_s ? whole_microseconds : mean_s;
}

Record read_record(const std::filesystem::path& path, std::size_t largest_bytes) {
  const bool from_stdin = path == "-";
  const std::filesystem::path name = from_stdin ? "standard input" : path;
  const base::File file(from_stdin ? "/dev/stdin" : path, O_RDONLY);
  if (!file.is_open()) fail_errno(name, "can't be opened", errno);
  const std::optional<std::string> text = file.read(largest_bytes + 1);
  if (!text) fail_errno(name, "can't be read", errno);
  if (text->size() > largest_bytes) {
    throw RecordError(RecordError::Kind::data, 0, 0,
                      fmt::format("{}: larger than {} bytes", name.string(), largest_bytes));
  }
  return parse_record(*text, name.string());
}

RecordCsvWriter::RecordCsvWriter(std::filesystem::path path, RecordColumns columns)
    : path_(std::move(path)), temporary_path_(path_), columns_(std::move(columns)) {
  temporary_path_ += ".tmp";
  buffer_ = "time,pv";
  if (columns_.sp) buffer_ += ",sp";
  if (columns_.co) buffer_ += ",co";
  if (columns_.stem) buffer_ += ",stem";
  for (const std::string& name : columns_.more) {
    constexpr std::array<std::string_view, 5> kKnown{"time", "pv", "sp", "co", "stem"};
    const bool known = std::find(kKnown.begin(), kKnown.end(), name) != kKnown.end();
    if (name.empty() || known || name.find_first_of(",\"\r\n") != std::string::npos) {
      throw RecordError(
          RecordError::Kind::data, 0, 0,
          path_.string() + ": " + base::in_quotes(name) + " can't name a further column");
    }
    buffer_ += ',';
    buffer_ += name;
  }
  buffer_ += '\n';
  base::File file(temporary_path_, O_WRONLY | O_CREAT | O_TRUNC, 0644);
  if (!file.is_open()) fail_errno(temporary_path_, "can't be created", errno);
  file_ = std::move(file);
}

void RecordCsvWriter::append(double value) {
  if (!std::isfinite(value)) return;
  std::array<char, 32> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  buffer_.append(digits.data(), end);
}

void RecordCsvWriter::add(const RecordSample& sample, std::span<const double> more) {
  const auto cell = [this](double value) {
    buffer_ += ',';
    append(value);
  };
  append(without_rounding_error(sample.time_s));
  cell(sample.pv);
  if (columns_.sp) cell(sample.sp);
  if (columns_.co) cell(sample.co);
  if (columns_.stem) cell(sample.stem);
  for (std::size_t i = 0; i < columns_.more.size(); ++i) {
    cell(i < more.size() ? more[i] : RecordSample::kNone);
  }
  buffer_ += '\n';
  ++rows_;
  if (buffer_.size() >= kBufferBytes) flush();
}

void RecordCsvWriter::flush() {
  if (error_ == 0 && !file_.write(buffer_.data(), buffer_.size())) error_ = errno;
  buffer_.clear();
  if (error_ != 0) fail_errno(temporary_path_, "can't be written", error_);
}

void RecordCsvWriter::finish() {
  flush();
  if (!file_.sync() || !file_.close()) {
    error_ = errno;
    fail_errno(temporary_path_, "can't be written", error_);
  }
  if (::rename(temporary_path_.c_str(), path_.c_str()) != 0) {
    fail_errno(path_, "can't be created", errno);
  }
  base::sync_folder(path_.parent_path());
}

void write_record(const Record& record, const std::filesystem::path& path) {
  RecordColumns columns{
      .sp = !record.sp.empty(), .co = !record.co.empty(), .stem = !record.stem.empty()};
  if (!record.automatic.empty()) columns.more.emplace_back("mode");
  RecordCsvWriter writer(path, std::move(columns));
  const auto at = [](const std::vector<double>& column, std::size_t i) {
    return column.empty() ? RecordSample::kNone : column[i];
  };
  for (std::size_t i = 0; i < record.size(); ++i) {
    const double mode = at(record.automatic, i);
    writer.add({.time_s = record.time_s[i],
                .pv = record.pv[i],
                .sp = at(record.sp, i),
                .co = at(record.co, i),
                .stem = at(record.stem, i)},
               {&mode, 1});
  }
  writer.finish();
}

double parse_mode(std::string_view text) {
  constexpr std::array kBySystem{"1",       "auto", "automatic", "aut",    "a",    "cas",
                                 "cascade", "rcas", "rsp",       "remote", "true", "on"};
  constexpr std::array kByHand{"0",  "2",        "man",   "manual", "m",   "rout",  "iman",
                               "lo", "fallback", "false", "off",    "oos", "track", "trk"};
  const std::string word = base::lower_case(text);
  const auto is = [&](const char* known) { return word == known; };
  if (std::any_of(kBySystem.begin(), kBySystem.end(), is)) return 1.0;
  if (std::any_of(kByHand.begin(), kByHand.end(), is)) return 0.0;
  // Some programs write 1.0 for a whole number in a column with gaps.
  double number = 0.0;
  const auto [end, problem] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (problem == std::errc() && end == word.data() + word.size()) {
    if (number == 1.0) return 1.0;
    if (number == 0.0 || number == 2.0) return 0.0;
  }
  // B-AUTO, Man (forced)
  if (word.find("auto") != std::string::npos || word.starts_with("cas")) return 1.0;
  if (word.find("man") != std::string::npos) return 0.0;
  return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace loopwarden::record
