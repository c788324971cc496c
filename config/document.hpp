// SPDX-License-Identifier: Apache-2.0
// Reads a whole document with a given reader, and reports the keys that the reader does not know.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "config/diagnostic.hpp"
#include "config/key_reference.hpp"
#include "config/map_reader.hpp"
#include "config/source_file.hpp"
#include "config/yaml_document.hpp"

namespace loopwarden::config {

// Calls `read` with the document's root, if it has one.
template <class Read>
void read_document(std::string_view text, Report& report, Read read) {
  std::optional<YamlNode> root = parse_yaml(text, report);
  if (!root) return;
  MapReader in(*root, "", report);
  read(in);
  report_unknown_keys(*root, report);
}

// Returns the result of `read` for the root of the document `text`. Messages use `file` as its
// name.
template <class T, class Read>
Loaded<T> load_text(const std::string& file, std::string_view text, Read read) {
  Report report(file);
  T value;
  read_document(text, report, [&](MapReader& in) { value = read(in); });
  return loaded(std::move(value), report);
}

// Calls `read_text` with the file's name and text.
template <class ReadText>
auto load_file(const std::filesystem::path& path, ReadText read_text)
    -> decltype(read_text(path.string(), std::string_view())) {
  Report report(path.string());
  if (const auto text = read_source_file(path, report)) return read_text(path.string(), *text);
  return {std::nullopt, report.take()};
}

// Returns the keys that `read` reads.
template <class Read>
KeyReference keys_of(Read read) {
  Report unused("");
  KeyReference reference;
  MapReader in(reference, "", unused);
  read(in);
  return reference;
}

}  // namespace loopwarden::config
