// SPDX-License-Identifier: Apache-2.0
// Reads one mapping of a document key by key. Each call states the permitted value of a key. Any
// other value is reported with its place, and reading continues with a default, so that one pass
// finds all errors. Without a document the same calls describe the keys (KeyReference).
//
// Names of the calls: need_...: the key is required; plain: the key has a default; maybe_...:
// `given` of the result reports whether the key is present.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/diagnostic.hpp"
#include "config/key_reference.hpp"
#include "config/number_rule.hpp"
#include "config/yaml_document.hpp"

namespace loopwarden::config {

// The value at a key, its place, and whether further checks can use it.
template <class T>
struct Value {
  T value{};
  Place place;         // of the value; of the mapping if the key is absent
  std::string key;     // its path
  bool given = false;  // the key is present
  bool valid = false;  // the value is permitted, or is the default

  operator const T&() const noexcept { return value; }  // NOLINT: converts implicitly to its value
};

template <class E>
struct Choice {
  const char* name;
  E value;
};

template <class E, std::size_t N>
constexpr const char* name_of(const std::array<Choice<E>, N>& choices, E value) {
  for (const Choice<E>& choice : choices) {
    if (choice.value == value) return choice.name;
  }
  return "";
}
// A word of another system, and the permitted word with the same meaning.
struct OtherWord {
  const char* written;  // in lower case
  const char* meant;
};

struct WordRule {
  bool any_case = false;                   // ABCD is abcd
  std::span<const OtherWord> others = {};  // refused, with the correct word in the message
  const char* fallback = "";               // text for a default that is no fixed word
};

enum class Presence { required, optional };

class MapReader {
 public:
  // Reads `node`. Reports a node that is no mapping.
  MapReader(YamlNode& node, std::string path, Report& report);
  // Describes keys: all values are defaults, and no error is reported.
  MapReader(KeyReference& reference, std::string path, Report& report);

  // --- numbers, finite and in decimal notation ---
  Value<double> need_number(std::string_view key, const NumberRule& rule);
  Value<double> number(std::string_view key, const NumberRule& rule, double fallback);
  Value<double> maybe_number(std::string_view key, const NumberRule& rule);
  // Sets `value` if the key is present.
  template <class T>
  void maybe_number(std::string_view key, const NumberRule& rule, T& value) {
    if (const Value<double> read = maybe_number(key, rule); read.given) value = read.value;
  }
  Value<std::int64_t> need_integer(std::string_view key, const IntegerRule& rule);
  Value<std::int64_t> integer(std::string_view key, const IntegerRule& rule, std::int64_t fallback);
  Value<std::int64_t> maybe_integer(std::string_view key, const IntegerRule& rule);

  // Reads [low, high]. rise: low < high. differ: the ends differ, and the first may be the higher
  // one.
  enum class Ends { rise, differ };
  Value<std::pair<double, double>> need_range(std::string_view key, const NumberRule& rule);
  Value<std::pair<double, double>> maybe_range(std::string_view key, const NumberRule& rule,
                                               Ends ends = Ends::rise);
  // Reads [[x, y], ...].
  Value<std::vector<std::pair<double, double>>> maybe_points(std::string_view key,
                                                             const char* value_text,
                                                             const char* meaning);

  // Reads [a, b, ...].
  Value<std::vector<double>> maybe_numbers(std::string_view key, const char* unit,
                                           const char* meaning);

  // Reads [[a, b, ...], ...].
  Value<std::vector<std::vector<double>>> maybe_table(std::string_view key, const char* unit,
                                                      const char* meaning);

  // --- text on one line, true or false, one word of several ---
  // Reads [word, word, ...]: words of `words`, each at most once.
  Value<std::vector<std::string>> maybe_words(std::string_view key,
                                              const std::vector<std::string>& words,
                                              const char* meaning);
  // Reads [text, text, ...].
  Value<std::vector<std::string>> maybe_texts(std::string_view key, const char* meaning,
                                              const char* form = "[text, ...]");
  Value<std::string> need_text(std::string_view key, const char* meaning);
  Value<std::string> text(std::string_view key, const char* meaning, std::string fallback);
  Value<bool> flag(std::string_view key, const char* meaning, bool fallback);
  template <class E, std::size_t N>
  Value<E> need_one_of(std::string_view key, const std::array<Choice<E>, N>& choices,
                       const char* meaning, const WordRule& rule = {}) {
    return choose_from(key, choices, Presence::required, choices[0].value, meaning, rule);
  }
  template <class E, std::size_t N>
  Value<E> one_of(std::string_view key, const std::array<Choice<E>, N>& choices,
                  const char* meaning, E fallback, const WordRule& rule = {}) {
    return choose_from(key, choices, Presence::optional, fallback, meaning, rule);
  }

  // --- `value` is the default and receives the value of the key ---
  void set_number(std::string_view key, const NumberRule& rule, double& value) {
    value = number(key, rule, value);
  }
  template <class T>
  void set_integer(std::string_view key, const IntegerRule& rule, T& value) {
    value = static_cast<T>(integer(key, rule, static_cast<std::int64_t>(value)).value);
  }
  void set_flag(std::string_view key, const char* meaning, bool& value) {
    value = flag(key, meaning, value);
  }
  template <class E, std::size_t N>
  void set_one_of(std::string_view key, const std::array<Choice<E>, N>& choices,
                  const char* meaning, E& value, const WordRule& rule = {}) {
    value = one_of(key, choices, meaning, value, rule);
  }
  // Variants with the words as text, for words that are listed elsewhere.
  Value<std::string> need_word(std::string_view key, const std::vector<std::string>& words,
                               const char* meaning);
  // The first of `words` is the default.
  Value<std::string> word_of(std::string_view key, const std::vector<std::string>& words,
                             const char* meaning);

  // --- mappings and lists within ---
  // Return nullopt if the key is absent or its value has another type.
  std::optional<MapReader> need_section(std::string_view key, const char* meaning);
  std::optional<MapReader> maybe_section(std::string_view key, const char* meaning);
  // Calls `read` if the mapping is present.
  template <class Read>
  void need_section(std::string_view key, const char* meaning, Read read) {
    if (std::optional<MapReader> in = need_section(key, meaning)) read(*in);
  }
  template <class Read>
  void maybe_section(std::string_view key, const char* meaning, Read read) {
    if (std::optional<MapReader> in = maybe_section(key, meaning)) read(*in);
  }
  // Reads a list of mappings.
  std::vector<MapReader> maybe_list(std::string_view key, const char* meaning);
  // Reads a mapping of names to mappings.
  std::vector<std::pair<std::string, MapReader>> maybe_named_sections(std::string_view key,
                                                                      const char* name,
                                                                      const char* meaning);

  // Describes the keys that depend on the value of another one under a separate heading.
  MapReader variant(std::string_view name) const;

  // --- keys that permit several kinds of value ---
  // Declares the key. Returns true if it is present. Reports a required key that is absent.
  bool declare(std::string_view key, std::string value_text, Presence presence,
               std::string fallback, const char* meaning);
  YamlNode::Kind kind(std::string_view key) const noexcept;
  // Returns the word at the key; empty if the value is no word.
  std::string_view word(std::string_view key) const noexcept;

  // Suppresses errors for unknown keys, because the section itself has an error. Keys that look
  // like a misspelt known key are still reported.
  void ignore_rest();

  // Reports the unknown keys of this mapping and of the mappings in it now, and only once. For
  // readers that must already know whether the section has errors.
  void close();

  // --- for checks of values against each other ---
  bool describing() const noexcept { return reference_ != nullptr; }
  bool given(std::string_view key) const noexcept;
  Place place() const noexcept;                      // of this mapping
  Place place(std::string_view key) const noexcept;  // of the key's value, or of the mapping
  std::string path(std::string_view key) const;
  void error(std::string_view key, std::string message);  // at the key's value
  void error(std::string message);                        // at the mapping
  void warning(std::string_view key, std::string message);
  void note(std::string_view key, std::string message);
  Report& report() noexcept { return *report_; }

 private:
  // Marks the key as known, describes it, and reports its absence if it is required.
  YamlNode* find(std::string_view key, std::string value_text, Presence presence,
                 std::string fallback, const char* meaning);
  const YamlNode* at(std::string_view key) const noexcept;
  template <class T>
  Value<T> start(std::string_view key, const YamlNode* node, T fallback) const;
  Value<double> read_number(std::string_view key, YamlNode* node, const NumberRule& rule,
                            double fallback);
  Value<std::int64_t> read_integer(std::string_view key, YamlNode* node, const IntegerRule& rule,
                                   std::int64_t fallback);
  Value<std::string> read_text(std::string_view key, YamlNode* node, std::string fallback);
  Value<std::pair<double, double>> read_range(std::string_view key, YamlNode* node,
                                              const NumberRule& rule, Ends ends);
  template <class E, std::size_t N>
  Value<E> choose_from(std::string_view key, const std::array<Choice<E>, N>& choices,
                       Presence presence, E fallback, const char* meaning, const WordRule& rule);
  Value<std::size_t> choose(std::string_view key, const std::vector<std::string>& names,
                            Presence presence, std::size_t fallback, const char* meaning,
                            const WordRule& rule);
  // Reads the list at the key. `read` receives each item and returns whether it is valid.
  template <class T, class Read>
  Value<std::vector<T>> read_list(std::string_view key, std::string value_text, const char* meaning,
                                  Read read);
  bool read_item(std::string_view key, YamlNode& node, std::vector<double>& values);
  std::optional<MapReader> section(std::string_view key, Presence presence, const char* meaning);
  bool is_of_kind(std::string_view key, const YamlNode& node, YamlNode::Kind wanted);

  YamlNode* node_ = nullptr;
  KeyReference* reference_ = nullptr;
  std::string path_;
  Report* report_;
};

template <class E, std::size_t N>
Value<E> MapReader::choose_from(std::string_view key, const std::array<Choice<E>, N>& choices,
                                Presence presence, E fallback, const char* meaning,
                                const WordRule& rule) {
  std::vector<std::string> names;
  std::size_t index = 0;
  for (const Choice<E>& choice : choices) {
    if (choice.value == fallback) index = names.size();
    names.emplace_back(choice.name);
  }
  const Value<std::size_t> chosen = choose(key, names, presence, index, meaning, rule);
  return {choices[chosen.value].value, chosen.place, chosen.key, chosen.given, chosen.valid};
}

}  // namespace loopwarden::config
