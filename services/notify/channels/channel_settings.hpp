// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "base/secret/secret.hpp"

namespace loopwarden::notify {

struct TimeOuts {
  std::int64_t connect_ms = 10'000;
  std::int64_t all_ms = 30'000;  // of one attempt
};

struct TlsFiles {
  std::string authorities;  // PEM; empty: those of the system
  std::string certificate;  // of this box, PEM; empty: no certificate
  std::string key;
};

struct JournalSettings {};

struct SyslogSettings {
  enum class Transport : std::uint8_t { local, udp, tcp, tls };
  Transport transport = Transport::local;
  std::string socket = "/dev/log";  // local
  std::string host;
  std::uint16_t port = 0;
  int facility = 16;  // local0
  std::int64_t enterprise =
      32473;  // of the structured data's name; this one is for examples (RFC 5612)
  TlsFiles tls;
  TimeOuts time_outs;
};

struct EmailSettings {
  enum class Security : std::uint8_t { starttls, tls, none };
  std::string from;
  std::vector<std::string> to;
  std::string sendmail;  // program of a local MTA; empty: SMTP
  std::string host;
  std::uint16_t port = 0;
  Security security = Security::starttls;
  std::string user;  // empty: no authentication
  base::Secret password;
  TlsFiles tls;
  TimeOuts time_outs;
};

struct WebhookSettings {
  std::string url;
  base::Secret url_secret;  // in place of `url`, if that holds a key
  base::Secret key;         // of the signature; empty: not signed
  TlsFiles tls;
  TimeOuts time_outs;
};

using KindSettings = std::variant<JournalSettings, SyslogSettings, EmailSettings, WebhookSettings>;

struct ChannelSettings {
  std::string name;
  KindSettings kind;
  bool picture = false;  // with the trends of its alarms
};

}  // namespace loopwarden::notify
