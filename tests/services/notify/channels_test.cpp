// SPDX-License-Identifier: Apache-2.0
// Each channel against a server that the test starts.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include "base/digest/digest.hpp"
#include "services/notify/channels/channel.hpp"
#include "services/notify/channels/syslog_channel.hpp"
#include "services/notify/channels/webhook_channel.hpp"
#include "tests/services/notify/notify_support.hpp"
#include "tests/support/free_port.hpp"

namespace channels_test {

using namespace loopwarden::notify;
using namespace loopwarden::notify::test;
using Outcome = Delivery::Outcome;

namespace {

const std::atomic<bool> kNever{false};
constexpr TimeOuts kShort{.connect_ms = 2000, .all_ms = 1000};

std::uint16_t port_of(const ForeignProcess& server) {
  return static_cast<std::uint16_t>(std::stoi(server.ready("port")));
}

Delivery send(const KindSettings& kind, const Message& message,
              const std::atomic<bool>& quit = kNever) {
  return open_channel({"channel", kind}, sender())->send(message, quit);
}

WebhookSettings hook(const ForeignProcess& server, const char* scheme = "http") {
  WebhookSettings settings;
  settings.url = fmt::format("{}://127.0.0.1:{}/alarms", scheme, server.ready("port"));
  return settings;
}

EmailSettings mail(const ForeignProcess& server, EmailSettings::Security security) {
  EmailSettings settings;
  settings.from = "box@plant.example";
  settings.to = {"a@plant.example", "b@plant.example"};
  settings.host = "127.0.0.1";
  settings.port = port_of(server);
  settings.security = security;
  settings.tls.authorities = certificates().file("ca.pem");
  return settings;
}

const Message kOne = message_with({event_of("FIC-101")});

// A datagram socket of the test. The destructor closes it.
class Receiver {
 public:
  Receiver(int family, const sockaddr* address, socklen_t length)
      : fd_(::socket(family, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    bound_ = ::bind(fd_, address, length) == 0;
    const timeval patience{10, 0};
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  }
  Receiver(const Receiver&) = delete;
  Receiver& operator=(const Receiver&) = delete;
  ~Receiver() { ::close(fd_); }

  bool bound() const { return bound_; }
  std::uint16_t port() const {
    sockaddr_in address{};
    socklen_t length = sizeof address;
    ::getsockname(fd_, reinterpret_cast<sockaddr*>(&address), &length);
    return ntohs(address.sin_port);
  }
  std::string receive() const {
    std::string text(65536, '\0');
    const ssize_t n = ::recv(fd_, text.data(), text.size(), 0);
    text.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
    return text;
  }

 private:
  int fd_;
  bool bound_ = false;
};

Receiver local_receiver(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::copy(path.begin(), path.end(), address.sun_path);
  return Receiver(AF_UNIX, reinterpret_cast<const sockaddr*>(&address), sizeof address);
}

Receiver udp_receiver() {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return Receiver(AF_INET, reinterpret_cast<const sockaddr*>(&address), sizeof address);
}

}  // namespace

TEST_CASE("a webhook is signed JSON", "[notify][webhook]") {
  const TemporaryFolder folder;
  const ForeignProcess web = server("web_server.py", {(folder / "log").string()});
  WebhookSettings settings = hook(web);
  write_file(folder / "key", "0123456789abcdef\n");
  settings.key.file = (folder / "key").string();
  const Delivery delivery = send(settings, kOne);
  CHECK(delivery.text == "answered 200");
  CHECK(delivery.outcome == Outcome::sent);
  const nlohmann::json asked = lines_of(folder / "log").at(0);
  const nlohmann::json& headers = asked.at("headers");
  CHECK(asked.at("path") == "/alarms");
  CHECK(headers.at("content-type") == "application/json");
  const std::string body = asked.at("body");
  const std::string timestamp = headers.at("x-loopwarden-timestamp");
  CHECK(headers.at("x-loopwarden-signature") ==
        "sha256=" + loopwarden::base::hmac_sha256_hex("0123456789abcdef", timestamp + "." + body));
  const nlohmann::json content = nlohmann::json::parse(body);
  CHECK(content.at("box") == "box 12");
  CHECK(content.at("count") == 1);
  CHECK(content.at("events").at(0).at("loop") == "FIC-101");
  CHECK(content.at("counts").at("came") == 1);
}

TEST_CASE("what a webhook's answer means", "[notify][webhook]") {
  const TemporaryFolder folder;
  ForeignProcess web = server("web_server.py", {(folder / "log").string()});
  WebhookSettings settings = hook(web);
  settings.time_outs = kShort;
  const auto outcome = [&](const std::string& answer) {
    web.command("answer " + answer);
    return send(settings, kOne);
  };
  CHECK(outcome("204").outcome == Outcome::sent);
  CHECK(outcome("500").outcome == Outcome::later);
  CHECK(outcome("503:7").wait_ms == 7000);
  CHECK(outcome("400").outcome == Outcome::refused);
  CHECK(outcome("404").outcome == Outcome::refused);
  CHECK(outcome("408").outcome == Outcome::later);
  const Delivery many = outcome("429:120");
  CHECK(many.outcome == Outcome::later);
  CHECK(many.wait_ms == 120'000);
  CHECK(outcome("429:999999").wait_ms == 3'600'000);
  CHECK(outcome("302").outcome == Outcome::later);  // not followed
  CHECK(lines_of(folder / "log").back().at("path") == "/alarms");
  CHECK(outcome("hang").outcome == Outcome::later);
  settings.url = fmt::format("http://127.0.0.1:{}/", loopwarden::tests::free_port());
  CHECK(send(settings, kOne).outcome == Outcome::later);
}

TEST_CASE("a webhook under way ends when the program does", "[notify][webhook]") {
  const TemporaryFolder folder;
  ForeignProcess web = server("web_server.py", {(folder / "log").string()});
  web.command("answer hang");
  std::atomic<bool> quit{false};
  std::thread ends([&] {
    eventually([&] { return !lines_of(folder / "log").empty(); });
    quit = true;
  });
  const Delivery delivery = send(hook(web), kOne, quit);
  ends.join();
  CHECK(delivery.outcome == Outcome::later);
  CHECK(delivery.text == "the program ends");
}

TEST_CASE("certificates are checked", "[notify][webhook]") {
  const TemporaryFolder folder;
  const Certificates& files = certificates();
  const ForeignProcess web =
      server("web_server.py",
             {(folder / "log").string(), files.file("server.pem"), files.file("server.key")});
  WebhookSettings settings = hook(web, "https");
  // the system does not trust this authority
  CHECK(send(settings, kOne).outcome == Outcome::later);
  settings.tls.authorities = files.file("other.pem");
  CHECK(send(settings, kOne).outcome == Outcome::later);
  CHECK(lines_of(folder / "log").empty());
  settings.tls.authorities = files.file("ca.pem");
  CHECK(send(settings, kOne).outcome == Outcome::sent);
}

TEST_CASE("mail by SMTP, with and without TLS and a password", "[notify][mail]") {
  const TemporaryFolder folder;
  const std::string log = (folder / "log").string();
  const std::string pem = certificates().file("server.pem");
  const std::string key = certificates().file("server.key");
  write_file(folder / "password", "pa ss\n");
  const auto check = [&](const EmailSettings& settings, bool tls, bool authenticated) {
    const Delivery delivery = send(settings, kOne);
    INFO(delivery.text);
    REQUIRE(delivery.outcome == Outcome::sent);
    const nlohmann::json got = lines_of(folder / "log").back();
    CHECK(got.at("from") == "box@plant.example");
    CHECK(got.at("to") == nlohmann::json{"a@plant.example", "b@plant.example"});
    CHECK(got.at("tls") == tls);
    CHECK(got.at("authenticated") == authenticated);
    const std::string data = got.at("data");
    CHECK(data.find("Subject: [box 12] FIC-101: Stiction alarm, 6.1 % of CO span\r\n") !=
          std::string::npos);
    CHECK(data.find("\r\n\r\n[box 12] FIC-101") != std::string::npos);
  };
  SECTION("plain, on this host") {
    const ForeignProcess smtp = server("mail_server.py", {log});
    check(mail(smtp, EmailSettings::Security::none), false, false);
  }
  SECTION("STARTTLS and a password") {
    const ForeignProcess smtp =
        server("mail_server.py", {log, "--starttls", pem, key, "--user", "box12", "pa ss"});
    EmailSettings settings = mail(smtp, EmailSettings::Security::starttls);
    settings.user = "box12";
    settings.password.file = (folder / "password").string();
    check(settings, true, true);
    // Waiting does not remove the fault.
    write_file(folder / "password", "wrong\n");
    const Delivery wrong = send(settings, kOne);
    CHECK(wrong.outcome == Outcome::shut_out);
    CHECK_THAT(wrong.text, Catch::Contains("535"));
    write_file(folder / "password", "busy\n");
    CHECK(send(settings, kOne).outcome == Outcome::later);
    settings.user.clear();
    const Delivery nobody = send(settings, kOne);
    CHECK(nobody.outcome == Outcome::shut_out);
    CHECK_THAT(nobody.text, Catch::Contains("530"));
    settings.user = "box12";
    settings.tls.authorities = certificates().file("other.pem");
    CHECK(send(settings, kOne).outcome == Outcome::later);
  }
  SECTION("TLS from the start") {
    const ForeignProcess smtp =
        server("mail_server.py", {log, "--smtps", pem, key, "--user", "box12", "pa ss"});
    EmailSettings settings = mail(smtp, EmailSettings::Security::tls);
    settings.user = "box12";
    settings.password.file = (folder / "password").string();
    check(settings, false, true);  // the server's library does not know that TLS is used
  }
  SECTION("a server that offers no STARTTLS gets no mail, above all no password") {
    const ForeignProcess smtp = server("mail_server.py", {log});
    CHECK(send(mail(smtp, EmailSettings::Security::starttls), kOne).outcome == Outcome::later);
    CHECK(lines_of(folder / "log").empty());
  }
}

TEST_CASE("refused recipients, and a mail server that is busy", "[notify][mail]") {
  const TemporaryFolder folder;
  const std::string log = (folder / "log").string();
  const auto none = EmailSettings::Security::none;
  {
    const ForeignProcess smtp = server("mail_server.py", {log, "--refuse", "b@plant.example"});
    const Delivery delivery = send(mail(smtp, none), kOne);
    CHECK(delivery.outcome == Outcome::sent_to_some);
    CHECK_THAT(delivery.text, Catch::Contains("but refused: 550 5.1.1 no such user here"));
    CHECK(lines_of(folder / "log").at(0).at("to") == nlohmann::json{"a@plant.example"});
  }
  {
    const ForeignProcess smtp = server(
        "mail_server.py", {log, "--refuse", "a@plant.example", "--refuse", "b@plant.example"});
    CHECK(send(mail(smtp, none), kOne).outcome == Outcome::refused);
  }
  const ForeignProcess smtp = server("mail_server.py", {log, "--busy"});
  const Delivery delivery = send(mail(smtp, none), kOne);
  CHECK(delivery.outcome == Outcome::later);
  CHECK_THAT(delivery.text, Catch::Contains("451 4.3.0 try again later"));
}

TEST_CASE("a mail server that accepts and does not answer", "[notify][mail]") {
  const TemporaryFolder folder;
  const ForeignProcess smtp = server("mail_server.py", {(folder / "log").string()});
  smtp.freeze();
  EmailSettings settings = mail(smtp, EmailSettings::Security::none);
  settings.time_outs = kShort;
  CHECK(send(settings, kOne).outcome == Outcome::later);
  smtp.thaw();
}

TEST_CASE("mail through a local program", "[notify][mail]") {
  const TemporaryFolder folder;
  const auto program = [&](const std::string& script) {
    write_file(folder / "sendmail", "#!/bin/sh\n" + script);
    ::chmod((folder / "sendmail").c_str(), 0755);
    EmailSettings settings;
    settings.from = "box@plant.example";
    settings.to = {"a@plant.example"};
    settings.sendmail = (folder / "sendmail").string();
    settings.time_outs = kShort;
    return send(settings, kOne);
  };
  const std::string got = (folder / "got").string();
  CHECK(program("echo \"$@\" > " + got + "; cat >> " + got).outcome == Outcome::sent);
  const std::string text = read_file(got);
  CHECK(text.starts_with("-t -i\nDate: "));
  CHECK(text.find("\r") == std::string::npos);
  CHECK(text.find("To: a@plant.example\n") != std::string::npos);
  CHECK(program("exit 75").outcome == Outcome::later);
  const Delivery unknown = program("echo no such user >&2; exit 67");
  CHECK(unknown.outcome == Outcome::refused);
  CHECK_THAT(unknown.text, Catch::Contains("ended with 67: no such user"));
  CHECK(program("exec sleep 100").outcome == Outcome::later);
  EmailSettings none;
  none.from = "a@b";
  none.to = {"a@b"};
  none.sendmail = "/no/such/program";
  CHECK(send(none, kOne).outcome == Outcome::later);
}

TEST_CASE("syslog to a local socket and by UDP", "[notify][syslog]") {
  const TemporaryFolder folder;
  SyslogSettings settings;
  settings.socket = (folder / "log").string();
  CHECK(send(settings, kOne).outcome == Outcome::later);
  SyslogChannel local(settings, sender());
  {
    const Receiver receiver = local_receiver(settings.socket);
    CHECK(local.send(kOne, kNever).outcome == Outcome::sent);
    CHECK(receiver.receive().starts_with("<132>1 2026-11-24T12:00:00.000Z box_12 "));
  }
  // The receiver was restarted and has a new socket of the same name.
  std::filesystem::remove(settings.socket);
  const Receiver again = local_receiver(settings.socket);
  CHECK(local.send(kOne, kNever).outcome == Outcome::sent);
  CHECK(!again.receive().empty());

  const Receiver udp = udp_receiver();
  settings.transport = SyslogSettings::Transport::udp;
  settings.host = "127.0.0.1";
  settings.port = udp.port();
  CHECK(send(settings, kOne).outcome == Outcome::sent);
  CHECK(udp.receive().find("[loopwarden@32473 box=\"box 12\"") != std::string::npos);
  settings.host = "no.such.host.invalid";
  CHECK(send(settings, kOne).outcome == Outcome::later);
}

TEST_CASE("syslog by TCP is framed, reconnects, and counts as sent only when confirmed",
          "[notify][syslog]") {
  const TemporaryFolder folder;
  ForeignProcess collector = server("log_server.py", {(folder / "log").string()});
  SyslogSettings settings;
  settings.transport = SyslogSettings::Transport::tcp;
  settings.host = "127.0.0.1";
  settings.port = port_of(collector);
  SyslogChannel channel(settings, sender());
  const Message two = message_with({event_of("A\n1 x"), event_of("B")});
  CHECK(channel.send(two, kNever).outcome == Outcome::sent);
  CHECK(eventually([&] { return lines_of(folder / "log").size() == 2; }));
  collector.command("close");
  CHECK(channel.send(kOne, kNever).outcome == Outcome::sent);
  CHECK(eventually([&] { return lines_of(folder / "log").size() == 3; }));
  CHECK(lines_of(folder / "log").back().get<std::string>().find("loop=\"FIC-101\"") !=
        std::string::npos);
}

TEST_CASE("syslog by TLS, with certificates of both sides", "[notify][syslog]") {
  const TemporaryFolder folder;
  const Certificates& files = certificates();
  const ForeignProcess collector =
      server("log_server.py", {(folder / "log").string(), files.file("server.pem"),
                               files.file("server.key"), files.file("ca.pem")});
  SyslogSettings settings;
  settings.transport = SyslogSettings::Transport::tls;
  settings.host = "127.0.0.1";
  settings.port = port_of(collector);
  settings.time_outs = kShort;
  CHECK(send(settings, kOne).outcome == Outcome::later);
  settings.tls.authorities = files.file("ca.pem");
  settings.tls.certificate = files.file("server.pem");
  settings.tls.key = files.file("server.key");
  const Delivery delivery = send(settings, kOne);
  INFO(delivery.text);
  CHECK(delivery.outcome == Outcome::sent);
  CHECK(eventually([&] { return lines_of(folder / "log").size() == 1; }));
}

TEST_CASE("the systemd journal's own protocol", "[notify][journal]") {
  const std::string path = "/run/systemd/journal/socket";
  if (::access("/run/systemd/journal", F_OK) == 0) {
    // On a host with a real journal the message is sent to it if the socket is writable.
    CHECK(send(JournalSettings{}, kOne).outcome ==
          (::access(path.c_str(), W_OK) == 0 ? Outcome::sent : Outcome::later));
    return;
  }
  CHECK(send(JournalSettings{}, kOne).outcome == Outcome::later);
  std::error_code error;
  std::filesystem::create_directories("/run/systemd/journal", error);
  if (error) return;  // the test can't create it
  const Receiver journal = local_receiver(path);
  CHECK(send(JournalSettings{}, kOne).outcome == Outcome::sent);
  const std::string entry = journal.receive();
  std::filesystem::remove_all("/run/systemd/journal", error);
  CHECK(entry.find("MESSAGE=FIC-101: Stiction alarm, 6.1 % of CO span\n") != std::string::npos);
  CHECK(entry.find("LOOPWARDEN_LOOP=FIC-101\n") != std::string::npos);
  CHECK(entry.find("CODE_FILE") == std::string::npos);
}

}  // namespace channels_test
