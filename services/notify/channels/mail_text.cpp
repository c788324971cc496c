// SPDX-License-Identifier: Apache-2.0
#include "services/notify/channels/mail_text.hpp"

#include <date/date.h>
#include <fmt/format.h>
#include <nettle/base64.h>

#include <algorithm>
#include <chrono>
#include <cstdint>

#include "base/digest/digest.hpp"
#include "base/text.hpp"
#include "services/notify/text/one_line.hpp"

namespace loopwarden::notify {
namespace {

constexpr std::size_t kLongestLine = 76;
constexpr std::size_t kEncodedWordMarks = 12;  // "=?UTF-8?B?" and "?="

bool is_plain(std::string_view text) {
  return text.find("=?") == std::string_view::npos &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

std::string mail_date(std::int64_t utc_ms) {
  const date::sys_seconds at{std::chrono::seconds(utc_ms / 1000)};
  return date::format("%a, %d %b %Y %T +0000", at);
}

std::string recipients(const std::vector<std::string>& to) {
  std::string text = "To: ";
  for (std::size_t i = 0; i < to.size(); ++i) text += (i == 0 ? "" : ",\n ") + to[i];
  return text + "\n";
}

// The id is the same for each attempt, so that a mail server can recognise a repeated mail.
std::string message_id(const Message& message, const Sender& sender, const std::string& from) {
  return fmt::format("Message-ID: <loopwarden.{}.{}.{}@{}>\n", message.made_ms, message.id,
                     base::sha256_hex(sender.box).substr(0, 16), from.substr(from.find('@') + 1));
}

// Occurs in no part: quoted-printable has no "=_", and base64 has no "_".
constexpr const char* kBoundary = "=_loopwarden";

std::string text_part(const Message& message, const Sender& sender) {
  return "Content-Type: text/plain; charset=UTF-8\n"
         "Content-Transfer-Encoding: quoted-printable\n\n" +
         quoted_printable(letter(message, sender));
}

// Returns "trend-FIC-101.png", for example, with only letters that every file system accepts.
std::string file_name(const std::string& loop) {
  std::string name(base::cut(loop, 40));
  std::replace_if(
      name.begin(), name.end(),
      [](char c) {
        const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
        return !letter && !(c >= '0' && c <= '9') && c != '-';
      },
      '_');
  return "trend-" + name + ".png";
}

std::string picture_part(const Picture& picture, const Message& message) {
  const std::string name = file_name(message.events.at(picture.event).loop);
  std::string text = fmt::format(
      "Content-Type: image/png; name=\"{0}\"\n"
      "Content-Disposition: inline; filename=\"{0}\"\n"
      "Content-Transfer-Encoding: base64\n\n",
      name);
  const std::string coded = base64(picture.png);
  for (std::size_t at = 0; at < coded.size(); at += kLongestLine) {
    text += coded.substr(at, kLongestLine) + "\n";
  }
  return text;
}

// Returns the text, followed by the pictures if there are any.
std::string body(const Message& message, const Sender& sender) {
  if (message.pictures.empty()) return text_part(message, sender);
  std::string text = fmt::format("Content-Type: multipart/mixed; boundary=\"{0}\"\n\n--{0}\n{1}",
                                 kBoundary, text_part(message, sender));
  for (const Picture& picture : message.pictures) {
    text += fmt::format("\n--{}\n{}", kBoundary, picture_part(picture, message));
  }
  return text + fmt::format("\n--{}--\n", kBoundary);
}

std::string encoded_byte(char c) {
  return fmt::format("={:02X}", static_cast<unsigned>(static_cast<unsigned char>(c)));
}

}  // namespace

std::string base64(std::string_view bytes) {
  std::string text(BASE64_ENCODE_RAW_LENGTH(bytes.size()), '\0');
  base64_encode_raw(text.data(), bytes.size(), reinterpret_cast<const std::uint8_t*>(bytes.data()));
  return text;
}

std::string header_field(std::string_view name, std::string_view raw) {
  const std::string text = one_line(raw);
  if (is_plain(text) && name.size() + 2 + text.size() <= kLongestLine) {
    return fmt::format("{}: {}\n", name, text);
  }
  std::string field = fmt::format("{}: ", name);
  std::size_t column = field.size();
  for (std::string_view rest = text; !rest.empty();) {
    // Takes as many whole characters as keep the line within 76 characters (RFC 2047).
    const std::size_t room = (kLongestLine - column - kEncodedWordMarks) / 4 * 3;
    const std::string_view part = base::cut(rest, room);
    rest.remove_prefix(part.size());
    field += fmt::format("=?UTF-8?B?{}?={}", base64(part), rest.empty() ? "" : "\n ");
    column = 1;
  }
  return field + "\n";
}

std::string quoted_printable(std::string_view text) {
  std::string out;
  std::size_t column = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '\n') {
      out += c;
      column = 0;
      continue;
    }
    const bool ends_line = i + 1 == text.size() || text[i + 1] == '\n';
    // A dot that begins a line is encoded too, so that no transport has to double it.
    const bool plain = c > ' ' && c <= '~' && c != '=' && !(c == '.' && column == 0);
    const std::string shown =
        plain || (c == ' ' && !ends_line) ? std::string(1, c) : encoded_byte(c);
    if (column + shown.size() > kLongestLine - 1) {
      out += "=\n";
      column = 0;
    }
    out += shown;
    column += shown.size();
  }
  return out;
}

std::string to_crlf(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '\n') out += '\r';
    out += c;
  }
  return out;
}

bool is_address(std::string_view text) {
  constexpr std::size_t kLongestAddress = 254;
  const std::size_t at = text.find('@');
  const bool characters = std::all_of(text.begin(), text.end(), [](char c) {
    return c > ' ' && c <= '~' &&
           std::string_view("<>()[]\\,;:\"").find(c) == std::string_view::npos;
  });
  return characters && text.size() <= kLongestAddress && at != std::string_view::npos && at > 0 &&
         at + 1 < text.size() && text.find('@', at + 1) == std::string_view::npos &&
         text.front() != '-';
}

std::string mail_text(const Message& message, const Sender& sender, const EmailSettings& settings) {
  return fmt::format("Date: {}\nFrom: {}\n", mail_date(message.made_ms), settings.from) +
         recipients(settings.to) + header_field("Subject", headline(message, sender)) +
         message_id(message, sender, settings.from) +
         "Auto-Submitted: auto-generated\n"
         "MIME-Version: 1.0\n" +
         body(message, sender);
}

}  // namespace loopwarden::notify
