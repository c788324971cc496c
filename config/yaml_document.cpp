// SPDX-License-Identifier: Apache-2.0
#include "config/yaml_document.hpp"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <array>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "base/text.hpp"

namespace loopwarden::config {
namespace {

constexpr const char* kNoAnchors =
    "anchors (&) and aliases (*) are not accepted; write the value out";

Place place_of(const YAML::Mark& mark) { return {mark.line + 1, mark.column + 1}; }

// An error that ends the reading of the file.
class Refused : public std::runtime_error {
 public:
  Refused(Place place, const std::string& message) : std::runtime_error(message), place_(place) {}
  Place place() const noexcept { return place_; }

 private:
  Place place_;
};

// Refuses bytes that yaml-cpp would ignore or misread.
void check_bytes(std::string_view text) {
  Place place{1, 1};
  bool in_indentation = true;
  const std::size_t not_utf8 = base::first_not_utf8(text);
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    const auto byte = static_cast<unsigned char>(c);
    if (i == not_utf8) {
      throw Refused(place, fmt::format("byte 0x{:02x} is not UTF-8 text", byte));
    }
    if (c == '\t' && in_indentation) {
      throw Refused(place, "tab in the indentation; indent with spaces");
    }
    const bool line_end = c == '\n' || (c == '\r' && text.substr(i, 2) == "\r\n");
    if ((byte < 0x20 && c != '\t' && !line_end) || byte == 0x7F) {
      throw Refused(place, fmt::format("control character 0x{:02x}", byte));
    }
    if (c == '\n') {
      place = {place.line + 1, 1};
      in_indentation = true;
    } else {
      ++place.column;
      in_indentation = in_indentation && c == ' ';
    }
  }
}

// yaml-cpp accepts the end of the file as a closing quote. A forgotten quote would therefore hide
// the keys after it.
void require_closing_quote(std::string_view text, const YAML::Mark& mark) {
  const auto start = static_cast<std::size_t>(mark.pos);
  const char quote = start < text.size() ? text[start] : '\0';
  if (quote != '"' && quote != '\'') return;  // a block
  for (std::size_t i = start + 1; i < text.size() && text[i] != '\n'; ++i) {
    const bool next_is_quote = text.substr(i + 1).starts_with(quote);
    if ((quote == '"' && text[i] == '\\') || (quote == '\'' && text[i] == quote && next_is_quote)) {
      ++i;  // an escaped character
    } else if (text[i] == quote) {
      return;
    }
  }
  throw Refused(place_of(mark), "the closing quote is missing on this line");
}

// Translates the parser's message for the author of the file.
std::string in_plain_words(const std::string& message) {
  const std::array<std::pair<std::string_view, std::string_view>, 7> words_for{{
      {YAML::ErrorMsg::END_OF_MAP, "the indentation or a ':' is wrong here or in the line before"},
      {YAML::ErrorMsg::END_OF_SEQ, "the indentation or a '-' is wrong here or in the line before"},
      {YAML::ErrorMsg::MAP_VALUE,
       "a ':' too many here (text with ': ' in it needs quotes), or the "
       "indentation is wrong"},
      {YAML::ErrorMsg::END_OF_MAP_FLOW, "a '}' or a ',' is missing here or in a line before"},
      {YAML::ErrorMsg::END_OF_SEQ_FLOW, "a ']' or a ',' is missing here or in a line before"},
      {YAML::ErrorMsg::UNKNOWN_ANCHOR, kNoAnchors},
      {YAML::ErrorMsg::EOF_IN_SCALAR, "the file ends within quotes"},
  }};
  for (const auto& [parser_says, words] : words_for) {
    if (message == parser_says) return std::string(words);
  }
  return fmt::format("not YAML: {}", message);
}

// Builds the tree from the parser's events.
class TreeBuilder : public YAML::EventHandler {
 public:
  TreeBuilder(std::string_view text, Report& report) : text_(text), report_(report) {}

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (documents_++ > 0) {
      throw Refused(place_of(mark), "a second document begins here; a file holds one");
    }
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    refuse_anchor(mark, anchor);
    add(leaf(mark, YamlNode::Kind::nothing));
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override { refuse_anchor(mark, 1); }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    refuse_anchor(mark, anchor);
    refuse_tag(mark, tag);
    YamlNode node = leaf(mark, YamlNode::Kind::scalar);
    node.quoted = tag == "!";
    if (node.quoted) require_closing_quote(text_, mark);
    node.text = value;
    add(std::move(node));
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    open(mark, tag, anchor, YamlNode::Kind::list);
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    open(mark, tag, anchor, YamlNode::Kind::map);
  }
  void OnMapEnd() override { close(); }

  YamlNode& root() noexcept { return root_; }

 private:
  static YamlNode leaf(const YAML::Mark& mark, YamlNode::Kind kind) {
    YamlNode node;
    node.kind = kind;
    node.place = place_of(mark);
    return node;
  }

  static void refuse_anchor(const YAML::Mark& mark, YAML::anchor_t anchor) {
    if (anchor == 0) return;
    throw Refused(place_of(mark), kNoAnchors);
  }

  static void refuse_tag(const YAML::Mark& mark, const std::string& tag) {
    if (tag.empty() || tag == "?" || tag == "!") return;
    throw Refused(place_of(mark), fmt::format("tag '{}' is not accepted", quotable(tag)));
  }

  void open(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
            YamlNode::Kind kind) {
    refuse_anchor(mark, anchor);
    refuse_tag(mark, tag);
    if (open_.size() >= kMostDepth) {
      throw Refused(place_of(mark), fmt::format("nested more than {} levels deep", kMostDepth));
    }
    if (!open_.empty() && open_.back().kind == YamlNode::Kind::map && !key_) {
      throw Refused(place_of(mark), "a key must be plain text");
    }
    open_.push_back(leaf(mark, kind));
    waiting_keys_.push_back(std::exchange(key_, std::nullopt));
  }

  void close() {
    YamlNode node = std::move(open_.back());
    open_.pop_back();
    key_ = std::move(waiting_keys_.back());
    waiting_keys_.pop_back();
    add(std::move(node));
  }

  void add(YamlNode node) {
    if (open_.empty()) {
      root_ = std::move(node);
    } else if (open_.back().kind == YamlNode::Kind::list) {
      open_.back().values.push_back(std::move(node));
    } else if (!key_) {
      if (node.kind != YamlNode::Kind::scalar) throw Refused(node.place, "a key is missing here");
      key_ = std::move(node);
    } else {
      add_entry(open_.back(), std::move(node));
      key_.reset();
    }
  }

  void add_entry(YamlNode& map, YamlNode value) {
    const auto first = std::find_if(map.keys.begin(), map.keys.end(),
                                    [&](const YamlNode& key) { return key.text == key_->text; });
    if (first != map.keys.end()) {
      report_.error(key_->place, "",
                    fmt::format("duplicate key '{}' (first at {})", quotable(key_->text),
                                to_text(first->place)));
      return;
    }
    if (map.keys.size() >= kMostKeys) {
      throw Refused(key_->place, fmt::format("more than {} keys in one mapping", kMostKeys));
    }
    // The parser gives an absent value the place of the next token.
    if (value.kind == YamlNode::Kind::nothing) value.place = key_->place;
    map.keys.push_back(std::move(*key_));
    map.values.push_back(std::move(value));
  }

  std::string_view text_;
  Report& report_;
  int documents_ = 0;
  YamlNode root_;
  std::vector<YamlNode> open_;                         // from the root to the innermost
  std::vector<std::optional<YamlNode>> waiting_keys_;  // of the maps around the innermost
  std::optional<YamlNode> key_;                        // whose value is next
};

}  // namespace

YamlNode* YamlNode::find(std::string_view key) noexcept {
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (keys[i].text == key) return &values[i];
  }
  return nullptr;
}

const YamlNode* YamlNode::find(std::string_view key) const noexcept {
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (keys[i].text == key) return &values[i];
  }
  return nullptr;
}

const char* to_text(YamlNode::Kind kind) noexcept {
  switch (kind) {
    case YamlNode::Kind::nothing: return "nothing";
    case YamlNode::Kind::scalar: return "a single value";
    case YamlNode::Kind::list: return "a list";
    case YamlNode::Kind::map: break;
  }
  return "a mapping";
}

std::optional<YamlNode> parse_yaml(std::string_view text, Report& report) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  try {
    check_bytes(text);
    std::istringstream stream{std::string(text)};
    YAML::Parser parser(stream);
    TreeBuilder builder(text, report);
    while (parser.HandleNextDocument(builder)) {
    }
    if (builder.root().kind == YamlNode::Kind::nothing) {
      report.error({1, 1}, "", "is empty");
      return std::nullopt;
    }
    return std::move(builder.root());
  } catch (const Refused& refused) {
    report.error(refused.place(), "", refused.what());
  } catch (const YAML::Exception& exception) {
    report.error(place_of(exception.mark), "", in_plain_words(exception.msg));
  }
  return std::nullopt;
}

void report_unknown_keys(YamlNode& node, Report& report) {
  for (std::size_t i = 0; i < node.keys.size(); ++i) {
    const std::string& key = node.keys[i].text;
    const std::vector<std::string>& known = node.known_keys;
    if (node.visited && std::find(known.begin(), known.end(), key) == known.end()) {
      report.error(node.keys[i].place, "",
                   fmt::format("unknown key '{}'{}", quotable(key), suggestion(key, known)));
    }
  }
  node.visited = false;
  for (YamlNode& value : node.values) report_unknown_keys(value, report);
}

}  // namespace loopwarden::config
