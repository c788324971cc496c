// SPDX-License-Identifier: Apache-2.0
#include "services/notify/config/channel_reader.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "config/file_keys.hpp"
#include "services/notify/channels/mail_text.hpp"
#include "services/notify/config/route_reader.hpp"

namespace loopwarden::notify {
namespace {

using config::between;
using config::Choice;
using config::MapReader;
using config::Value;

enum class Kind : std::uint8_t { journal, syslog, email, webhook };

constexpr std::array kKinds{
    Choice<Kind>{"journal", Kind::journal}, Choice<Kind>{"syslog", Kind::syslog},
    Choice<Kind>{"email", Kind::email}, Choice<Kind>{"webhook", Kind::webhook}};

using Transport = SyslogSettings::Transport;
constexpr std::array kTransports{
    Choice<Transport>{"local", Transport::local}, Choice<Transport>{"udp", Transport::udp},
    Choice<Transport>{"tcp", Transport::tcp}, Choice<Transport>{"tls", Transport::tls}};

using Security = EmailSettings::Security;
constexpr std::array kSecurities{Choice<Security>{"starttls", Security::starttls},
                                 Choice<Security>{"tls", Security::tls},
                                 Choice<Security>{"none", Security::none}};

// Indexed by number, RFC 5424.
const std::vector<std::string> kFacilities{
    "kern",   "user",   "mail",     "daemon", "auth",   "syslog", "lpr",    "news",
    "uucp",   "cron",   "authpriv", "ftp",    "ntp",    "audit",  "alert",  "clock",
    "local0", "local1", "local2",   "local3", "local4", "local5", "local6", "local7"};

constexpr std::size_t kMostRecipients = 50;

bool is_loopback(std::string_view host) {
  return host == "localhost" || host == "::1" || host.starts_with("127.");
}

std::int64_t ms_of(double seconds) { return std::llround(seconds * 1000.0); }

TlsFiles read_tls(MapReader& in, const std::string& file) {
  TlsFiles tls;
  tls.authorities =
      config::read_path(in, "ca_file",
                        "certificates (PEM) that may have signed the other side's; those of "
                        "the system if not given",
                        file);
  tls.certificate = config::read_path(
      in, "certificate_file", "this box's own certificate (PEM), if the server requests one", file);
  tls.key = config::read_path(in, "key_file", "its key (PEM)", file);
  if (tls.certificate.empty() != tls.key.empty()) {
    in.error("certificate_file and key_file belong together");
  }
  return tls;
}

TimeOuts read_time_outs(MapReader& in) {
  TimeOuts time_outs;
  time_outs.connect_ms =
      ms_of(in.number("connect_timeout", {"s", between(0.1, 60.0), "for a connection"}, 10.0));
  time_outs.all_ms =
      ms_of(in.number("timeout", {"s", between(0.1, 300.0), "for one attempt"}, 30.0));
  return time_outs;
}

std::uint16_t read_port(MapReader& in, std::int64_t fallback, const char* fallback_text) {
  return static_cast<std::uint16_t>(
      in.integer("port", {1, 65535, "", "port", false, fallback_text}, fallback));
}

// Returns a name or an address that fits into a URL.
std::string read_host(MapReader& in) {
  const Value<std::string> host = in.need_text("host", "name or address of the server");
  const bool plain = host.value.find_first_not_of(
                         "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.-_:") ==
                     std::string::npos;
  if (host.valid && (!plain || host.value.empty())) {
    in.error("host",
             fmt::format("must be a name or an address (got '{}')", config::quotable(host.value)));
  }
  return host;
}

SyslogSettings read_syslog(MapReader in, const std::string& file) {
  SyslogSettings settings;
  const Value<Transport> transport =
      in.one_of("transport", kTransports,
                "local socket (local), UDP, TCP with octet counting, or TLS", Transport::local);
  settings.transport = transport;
  const bool remote = in.describing() || settings.transport != Transport::local;
  if (in.describing() || settings.transport == Transport::local) {
    settings.socket = in.text("socket", "local: the socket", "/dev/log");
  }
  if (remote) {
    settings.host = read_host(in);
    const bool tls = settings.transport == Transport::tls;
    settings.port = read_port(in, tls ? 6514 : 514, "514 (udp, tcp), 6514 (tls)");
    settings.time_outs = read_time_outs(in);
  }
  if (in.describing() || settings.transport == Transport::tls) settings.tls = read_tls(in, file);
  const Value<std::string> facility = in.word_of(
      "facility",
      [] {
        std::vector<std::string> words{"local0"};
        for (const std::string& name : kFacilities) {
          if (name != "local0") words.push_back(name);
        }
        return words;
      }(),
      "facility of the messages");
  for (std::size_t i = 0; i < kFacilities.size(); ++i) {
    if (kFacilities[i] == facility.value) settings.facility = static_cast<int>(i);
  }
  settings.enterprise = in.integer(
      "enterprise_number",
      {1, 4'294'967'295, "",
       "your private enterprise number, in the name of the structured data; the default is "
       "reserved for examples"},
      settings.enterprise);
  return settings;
}

std::string read_address(MapReader& in, std::string_view key, const std::string& text) {
  if (!is_address(text)) {
    in.error(key,
             fmt::format("must be an address, local@domain, without name or brackets (got '{}')",
                         config::quotable(text)));
  }
  return text;
}

void read_smtp(MapReader in, const std::string& file, EmailSettings& settings) {
  settings.host = read_host(in);
  settings.security =
      in.one_of("security", kSecurities,
                "TLS from the start (tls), after STARTTLS (starttls), or none: on this host only",
                Security::starttls);
  const std::int64_t port = settings.security == Security::starttls ? 587
                            : settings.security == Security::tls    ? 465
                                                                    : 25;
  settings.port = read_port(in, port, "587 (starttls), 465 (tls), 25 (none)");
  settings.user = in.text("user", "name to authenticate with", "");
  settings.password = config::read_secret_at(in, "password", "where its password is", file);
  settings.tls = read_tls(in, file);
  if (settings.user.empty() == settings.password.given()) {
    in.error("user and password belong together");
  }
  if (settings.security == Security::none && !is_loopback(settings.host)) {
    in.error("security", "may be none only if the server is this host (localhost, 127.0.0.1)");
  }
}

EmailSettings read_email(MapReader in, const std::string& file) {
  EmailSettings settings;
  const Value<std::string> from = in.need_text("from", "sender's address");
  if (from.given && from.valid) settings.from = read_address(in, "from", from);
  const Value<std::vector<std::string>> to = in.maybe_texts("to", "recipients' addresses");
  for (const std::string& one : to.value) settings.to.push_back(read_address(in, "to", one));
  if (!in.describing() && (settings.to.empty() || settings.to.size() > kMostRecipients)) {
    in.error("to", fmt::format("must hold 1 to {} addresses", kMostRecipients));
  }
  const Value<std::string> sendmail = in.text(
      "sendmail", "program of this host's mail server, called with -t -i; in place of smtp", "");
  settings.sendmail = sendmail;
  if (sendmail.given && sendmail.valid && !sendmail.value.starts_with('/')) {
    in.error("sendmail", "must be an absolute path");
  }
  std::optional<MapReader> smtp = in.maybe_section("smtp", "the mail server");
  if (smtp) read_smtp(*smtp, file, settings);
  if (!in.describing() && sendmail.given == in.given("smtp")) {
    in.error("must have either `smtp` or `sendmail`");
  }
  settings.time_outs = read_time_outs(in);
  return settings;
}

void check_url(MapReader& in, const std::string& url) {
  const bool characters = url.find_first_of(" \t\"<>\\^`{|}") == std::string::npos;
  const bool plain = url.starts_with("http://");
  if (!characters || !(plain || url.starts_with("https://"))) {
    in.error("url", fmt::format("must be an https:// URL (got '{}')", config::quotable(url)));
    return;
  }
  const std::string host = url.substr(7, url.find_first_of(":/", 7) - 7);
  if (plain && !is_loopback(host) && host != "[") {
    in.warning("url", "is not encrypted: others on the network can read it. Use https");
  }
}

WebhookSettings read_webhook(MapReader in, const std::string& file) {
  WebhookSettings settings;
  const Value<std::string> url = in.text("url", "where to post; https, or http on this host", "");
  settings.url = url;
  if (url.given && url.valid) check_url(in, url);
  settings.url_secret = config::read_secret_at(
      in, "url_secret", "where the URL is, if it holds a key; in place of url", file);
  if (!in.describing() && url.given == in.given("url_secret")) {
    in.error("must have either `url` or `url_secret`");
  }
  settings.key = config::read_secret_at(
      in, "key", "credential or file with the key of the signature; not signed if not given", file);
  settings.tls = read_tls(in, file);
  settings.time_outs = read_time_outs(in);
  return settings;
}

bool read_picture(MapReader in, bool fallback) {
  return in.flag("picture", "with the trend of each loop around its alarm, a PNG", fallback);
}

struct Defaults {
  double group_s;
  std::int64_t most_per_hour;
};

Defaults defaults_of(Kind kind) {
  switch (kind) {
    case Kind::email: return {30.0, 20};
    case Kind::webhook: return {10.0, 60};
    case Kind::journal:
    case Kind::syslog: break;
  }
  return {0.0, 0};
}

void read_rule(MapReader& in, Kind kind, ChannelRule& rule) {
  const Defaults defaults = defaults_of(kind);
  rule.one_each = kind == Kind::journal || kind == Kind::syslog;
  rule.group_ms =
      ms_of(in.number("group",
                      {"s", between(0.0, 3600.0), "events within this time go into one message",
                       "30 s (email), 10 s (webhook), 0 s"},
                      defaults.group_s));
  rule.most_per_hour = in.integer("most_per_hour",
                                  {0, 100'000, "",
                                   "messages per hour; further events wait and join the next "
                                   "message. 0: any number",
                                   false, "20 (email), 60 (webhook), 0"},
                                  defaults.most_per_hour);
}

void read_digest(MapReader& in, ChannelRule& rule) {
  constexpr const char* kMeaning =
      "time of day, hh:mm, for which alarms of low priority wait: one message a day";
  if (in.describing() || !in.given("digest")) {
    in.text("digest", kMeaning, "they are sent as all others");
    return;
  }
  rule.digest_min = read_time(in, "digest", kMeaning);
  if (rule.one_each) in.error("digest", "is of channels for people: email and webhook");
  if (*rule.digest_min == 24 * 60) in.error("digest", "must be before 24:00");
}

}  // namespace

ReadChannel read_channel(MapReader& in, const std::string& name, const std::string& file) {
  ReadChannel channel;
  channel.settings.name = channel.rule.name = name;
  const Value<Kind> kind = in.need_one_of("kind", kKinds, "what it is");
  read_rule(in, kind, channel.rule);
  read_digest(in, channel.rule);
  const bool all = in.describing();
  if (!all && !kind.valid) {
    in.ignore_rest();
    return channel;
  }
  if (all || kind == Kind::syslog) channel.settings.kind = read_syslog(in.variant("syslog"), file);
  if (all || kind == Kind::email) {
    channel.settings.kind = read_email(in.variant("email"), file);
    channel.settings.picture = read_picture(in.variant("email"), true);
  }
  if (all || kind == Kind::webhook) {
    channel.settings.kind = read_webhook(in.variant("webhook"), file);
    channel.settings.picture = read_picture(in.variant("webhook"), false);
  }
  return channel;
}

}  // namespace loopwarden::notify
