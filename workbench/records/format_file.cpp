// SPDX-License-Identifier: Apache-2.0
#include "workbench/records/format_file.hpp"

#include <array>
#include <utility>

#include "config/document.hpp"
#include "config/map_reader.hpp"
#include "record/import/time_text.hpp"
#include "base/text.hpp"

namespace loopwarden::workbench {
namespace {

using config::MapReader;
using record::ImportOptions;
using record::Role;
using record::TimeForm;

record::ImportOptions read_format(MapReader in) {
  ImportOptions options;
  struct Delimiter {
    const char* word;
    char character;
  };
  constexpr std::array kDelimiters{Delimiter{"comma", ','}, Delimiter{"semicolon", ';'},
                                   Delimiter{"tab", '\t'}, Delimiter{"bar", '|'},
                                   Delimiter{"space", ' '}};
  std::vector<std::string> words{"auto"};
  for (const Delimiter& d : kDelimiters) words.emplace_back(d.word);
  const std::string delimiter = in.word_of("delimiter", words, "character between the cells");
  for (const Delimiter& d : kDelimiters) {
    if (delimiter == d.word) options.delimiter = d.character;
  }
  const std::string decimal =
      in.word_of("decimal", {"auto", "point", "comma"}, "decimal separator");
  if (decimal == "point") options.decimal = '.';
  if (decimal == "comma") options.decimal = ',';
  const std::string encoding =
      in.word_of("encoding", {"auto", "utf-8", "utf-16", "latin-1"}, "of the text");
  for (const auto known :
       {record::Encoding::utf8, record::Encoding::utf16, record::Encoding::latin1}) {
    if (encoding == record::to_text(known)) options.encoding = known;
  }
  const auto rows =
      in.maybe_integer("header_rows", {.low = 0,
                                       .high = 1000,
                                       .meaning = "lines before the first row of data",
                                       .fallback = "found out"});
  if (rows.given && rows.valid) options.header_rows = static_cast<std::size_t>(rows.value);
  if (auto time = in.maybe_section("time", "how times are written")) {
    options.time_column = time->text("column", "name of the column, or its number from 1", "");
    const std::string form = time->word_of(
        "form",
        {"auto", "seconds", "milliseconds", "microseconds", "nanoseconds", "minutes", "hours",
         "epoch-s", "epoch-ms", "epoch-us", "epoch-ns", "excel", "ymd", "dmy", "mdy"},
        "what a cell counts or how its date is ordered");
    options.time = record::time_form(form).value_or(TimeForm::automatic);
    const auto zone = time->text("zone", "of local times, such as +01:00 or UTC", "");
    if (zone.given && zone.valid) {
      options.zone_s = record::zone_offset_s(base::lower_case(zone.value));
      if (!options.zone_s && !in.describing())
        time->error("zone", "must be an offset such as +01:00, or UTC");
    }
  }
  for (const std::string& word :
       in.maybe_texts("bad_values", "words for a bad value, in addition to the built-in ones")
           .value) {
    options.bad_words.push_back(base::lower_case(word));
  }
  const auto period = in.maybe_number("period", {.unit = "s",
                                                 .range = config::above(0.0),
                                                 .meaning = "of the samples to make",
                                                 .fallback = "chosen from the data"});
  if (period.given && period.valid) options.period_s = period.value;
  const std::string fill =
      in.word_of("fill", {"auto", "held", "linear"}, "between the values that an archive stored");
  if (fill == "held") options.filling = record::Filling::held;
  if (fill == "linear") options.filling = record::Filling::linear;
  for (MapReader& loop :
       in.maybe_list("loops", "columns or tags of each loop; default: found by their names")) {
    record::LoopSignals signals;
    signals.tag = loop.text("tag", "what the loop is called", "").value;
    signals.names[index_of(Role::pv)] =
        loop.need_text("pv", "process variable: name of a column or tag, or a number from 1").value;
    signals.names[index_of(Role::co)] = loop.text("co", "controller output", "").value;
    signals.names[index_of(Role::sp)] = loop.text("sp", "set point", "").value;
    signals.names[index_of(Role::stem)] = loop.text("stem", "stem travel", "").value;
    signals.names[index_of(Role::mode)] = loop.text("mode", "mode of the controller", "").value;
    options.loops.push_back(std::move(signals));
  }
  return options;
}

}  // namespace

config::Loaded<ImportOptions> read_format_text(const std::string& file, std::string_view text) {
  return config::load_text<ImportOptions>(file, text,
                                          [&](MapReader& in) { return read_format(in); });
}

config::Loaded<ImportOptions> read_format_file(const std::filesystem::path& path) {
  return config::load_file(path, read_format_text);
}

config::KeyReference describe_format() {
  return config::keys_of([](MapReader& in) { read_format(in); });
}

}  // namespace loopwarden::workbench
