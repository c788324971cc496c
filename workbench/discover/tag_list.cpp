// SPDX-License-Identifier: Apache-2.0
#include "workbench/discover/tag_list.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <unordered_map>
#include <utility>

#include "base/text.hpp"
#include "record/import/containers.hpp"
#include "record/import/number_text.hpp"
#include "workbench/files/command_error.hpp"
#include "workbench/text/csv_text.hpp"

namespace loopwarden::workbench::discover {
namespace {

enum Column : std::size_t {
  kTag,
  kName,
  kAddress,
  kNode,
  kNodeId,
  kType,
  kUnit,
  kLow,
  kHigh,
  kDescription,
  kValue
};
const std::vector<CsvColumn> kColumns{{"tag"},     {"name"},        {"address"}, {"node"},
                                      {"node_id"}, {"data_type"},   {"unit"},    {"low"},
                                      {"high"},    {"description"}, {"value"}};
const auto kNames = {kTag, kName, kAddress, kNode, kNodeId};
// Data types of OPC UA that are texts, and others that are not numbers. A loop reads a text only as
// its mode.
constexpr std::array<std::string_view, 2> kTexts{"string", "localizedtext"};
constexpr std::array<std::string_view, 6> kOthers{"datetime",   "bytestring",    "guid",
                                                  "xmlelement", "qualifiedname", "nodeid"};

template <class Wanted>
std::string first_of(const CsvRow& row, std::initializer_list<Column> columns, Wanted wanted) {
  for (const Column column : columns) {
    if (wanted(row.cells[column])) return row.cells[column];
  }
  return {};
}

bool is_filled(const std::string& cell) { return !cell.empty(); }

template <class Types>
bool is_of(const Types& types, const std::string& data_type) {
  return std::find(types.begin(), types.end(), base::lower_case(data_type)) != types.end();
}

bool is_mode(const std::string& cell) { return record::read_tag(cell).role == record::Role::mode; }

bool tells_signal(const std::string& cell) {
  const record::TagName tag = record::read_tag(cell);
  return tag.role && !tag.loop.empty();
}

std::optional<double> number_in(const CsvTable& table, const CsvRow& row, Column column) {
  const std::string& cell = row.cells[column];
  if (cell.empty()) return std::nullopt;
  std::optional<double> value = record::parse_number(cell, table.decimal);
  if (!value) value = record::parse_number(cell, '.');
  if (!value) {
    table.fail_at(row, column,
                  fmt::format("{} must be a number or empty (got {})", kColumns[column].name,
                              base::in_quotes(cell)));
  }
  return value;
}

}  // namespace

TagList read_tag_list(const std::string& file, std::string_view text) {
  const CsvTable table = read_csv(file, text, kColumns);
  TagList list;
  std::unordered_map<std::string, std::size_t> lines;
  std::size_t no_numbers = 0;
  const auto note = [&](const CsvRow& row, const std::string& what) {
    list.notes.push_back(fmt::format("{}:{}: {}", file, row.line, what));
  };
  for (const CsvRow& row : table.rows) {
    const bool is_text = is_of(kTexts, row.cells[kType]);
    if (is_of(kOthers, row.cells[kType]) || (is_text && first_of(row, kNames, is_mode).empty())) {
      ++no_numbers;
      continue;
    }
    ListedTag tag{.name = first_of(row, kNames, tells_signal),
                  .node = first_of(row, {kNodeId, kNode, kAddress}, is_filled),
                  .unit = row.cells[kUnit],
                  .description = row.cells[kDescription],
                  .range = std::nullopt,
                  .is_text = is_text,
                  .value = row.cells[kValue]};
    if (tag.name.empty()) tag.name = first_of(row, kNames, is_filled);
    const std::optional<double> low = number_in(table, row, kLow);
    const std::optional<double> high = number_in(table, row, kHigh);
    if (low && high && *low < *high) tag.range.emplace(*low, *high);
    if (tag.name.empty()) {
      note(row, "no tag, name, address or node: skipped");
      continue;
    }
    const auto [known, is_new] = lines.try_emplace(tag.name, row.line);
    if (is_new) {
      list.tags.push_back(std::move(tag));
    } else {
      note(row, fmt::format("{} is already in line {}, which is used", base::in_quotes(tag.name),
                            known->second));
    }
  }
  if (no_numbers > 0) {
    list.notes.push_back(
        fmt::format("{}: {} tags are neither numbers nor a mode by their data_type: skipped", file,
                    no_numbers));
  }
  if (list.tags.empty()) {
    throw CommandError(
        kExitData,
        file + ":1:1: no tag in it; its header needs a column called tag, name, address or node");
  }
  return list;
}

TagList read_tag_file(const std::filesystem::path& path, const std::string& name) {
  const auto source = record::Containers().open(path, record::Encoding::automatic);
  std::string text;
  for (std::string_view line; source->next(line);) text.append(line).push_back('\n');
  return read_tag_list(name, text);
}

}  // namespace loopwarden::workbench::discover
