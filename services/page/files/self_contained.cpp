// SPDX-License-Identifier: Apache-2.0
#include "services/page/files/self_contained.hpp"

#include <algorithm>
#include <array>

#include "services/page/files/folder.hpp"

namespace loopwarden::page::files {
namespace {

using Read = std::function<std::optional<std::string>(const std::vector<std::string>&)>;

// The two forms of links that the workbench writes.
struct Form {
  std::string_view before;  // the address
  std::string_view behind;
  std::string_view open;  // the element that replaces the link
  std::string_view close;
};
constexpr std::array kForms{Form{"<link rel=\"stylesheet\" href=\"", "\">", "<style>", "</style>"},
                            Form{"<script src=\"", "\"></script>", "<script>", "</script>"}};

// Returns the resolved path: assets/a.css for "../assets/a.css" in pages/1.html. Returns nullopt if
// it leads out, or is not a plain relative path.
std::optional<std::vector<std::string>> resolved(std::string_view address,
                                                 std::vector<std::string> parts) {
  if (!parts.empty()) parts.pop_back();
  while (!address.empty()) {
    const std::size_t end = std::min(address.find('/'), address.size());
    std::string part(address.substr(0, end));
    address.remove_prefix(std::min(end + 1, address.size()));
    if (part == "..") {
      if (parts.empty()) return std::nullopt;
      parts.pop_back();
    } else if (is_sound_name(part)) {
      parts.push_back(std::move(part));
    } else {
      return std::nullopt;
    }
  }
  return parts;
}

std::optional<std::string> element(const Form& form, std::string_view address,
                                   const std::vector<std::string>& page, const Read& read) {
  const auto parts = resolved(address, page);
  const auto text = parts ? read(*parts) : std::nullopt;
  if (!text || text->find(form.close.substr(0, form.close.size() - 1)) != std::string::npos) {
    return std::nullopt;
  }
  return std::string(form.open) + *text + std::string(form.close);
}

std::string with(const Form& form, std::string_view html, const std::vector<std::string>& page,
                 const Read& read) {
  std::string result;
  for (std::size_t at = html.find(form.before); at != std::string_view::npos;
       at = html.find(form.before)) {
    const std::size_t begin = at + form.before.size();
    const std::size_t end = html.find(form.behind, begin);
    if (end == std::string_view::npos) break;
    const auto in_place = element(form, html.substr(begin, end - begin), page, read);
    const std::size_t next = end + form.behind.size();
    result += html.substr(0, at);
    result += in_place ? *in_place : html.substr(at, next - at);
    html.remove_prefix(next);
  }
  return result += html;
}

}  // namespace

std::string self_contained(std::string_view html, const std::vector<std::string>& page,
                           const Read& read) {
  std::string text(html);
  for (const Form& form : kForms) text = with(form, text, page, read);
  return text;
}

}  // namespace loopwarden::page::files
