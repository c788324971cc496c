// SPDX-License-Identifier: Apache-2.0
// Converts the sheets of an .xlsx workbook (ECMA-376) to lines of text: tabs between cells, dates
// as ISO 8601, row 7 in line 7. pugixml reads the XML. Large parts are read row by row, so that
// memory holds only the shared texts of cells and one piece of a sheet.
//
// Limits: formulas without a stored value are empty; XML in UTF-16 and .xlsb are not supported.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "record/import/byte_source.hpp"

namespace loopwarden::record {

// Meaning of a number in a cell by the cell's number format.
enum class NumberKind : std::uint8_t { number, date, date_time, clock, elapsed };
// Return the kind of a built-in format (ECMA-376 part 1, 18.8.30, with those of East Asia), and of
// a format's code.
NumberKind number_kind(unsigned built_in) noexcept;
NumberKind number_kind(std::string_view code);
// Returns days since 1899-12-30, or 1904-01-01, as text: "2026-03-01T10:00:00.250", "10:00:00";
// elapsed time in s: "36000.000".
std::string date_text(double days, NumberKind kind, bool from_1904);

class Workbook {
 public:
  // Opens a part by its name ("xl/workbook.xml"); nullptr if the book has no such part.
  using OpenPart = std::function<std::unique_ptr<ByteSource>(const std::string& part)>;
  struct Sheet {
    std::string name;
    std::string part;
  };

  // `name` is the book's, for messages. This and all other functions throw RecordError.
  Workbook(OpenPart open, std::string name);
  ~Workbook();

  const std::vector<Sheet>& sheets() const noexcept { return sheets_; }
  std::unique_ptr<ByteSource> open(std::size_t sheet, std::string name);

 private:
  struct Texts;  // data shared by all sheets

  std::string text_of(const std::string& part) const;
  void read_sheets();
  void read_styles(Texts& texts) const;
  void read_strings(Texts& texts) const;

  OpenPart open_;
  std::string name_;
  std::string folder_;            // of the book's main part: "xl/"
  std::string styles_, strings_;  // names of parts; empty if missing
  bool from_1904_ = false;
  std::vector<Sheet> sheets_;
  std::shared_ptr<const Texts> texts_;
};

}  // namespace loopwarden::record
