// SPDX-License-Identifier: Apache-2.0
#include "base/digest/digest.hpp"
#include "services/notify/text/event_text.hpp"

#include "services/notify/channels/journal_channel.hpp"
#include "services/notify/channels/mail_text.hpp"
#include "services/notify/channels/syslog_text.hpp"
#include "services/notify/channels/webhook_channel.hpp"
#include "services/notify/text/one_line.hpp"
#include "tests/services/notify/notify_support.hpp"
#include "tests/support/property.hpp"

namespace text_test {

using namespace loopwarden::notify;
using namespace loopwarden::notify::test;
namespace property = loopwarden::tests::property;

namespace {

const EmailSettings kMail = [] {
  EmailSettings settings;
  settings.from = "box@plant.example";
  settings.to = {"a@plant.example", "b@plant.example"};
  return settings;
}();

// A loop's name as an attacker would choose it.
const std::string kHostile = "F\r\nBcc: x@evil.example\r\n\r\n.\r\n\xE2\x80\xA8\x85\xFF\"]\\ =?x?";

std::string any_bytes() {
  std::string text;
  for (std::size_t n = property::one_of(80); n > 0; --n) {
    text += static_cast<char>(property::integer(0, 255));
  }
  return text;
}

}  // namespace

TEST_CASE("any text becomes one line of valid UTF-8", "[notify][text]") {
  CHECK(one_line("V\xC3\xA4lve 7 \xE2\x82\xAC \xF0\x9F\x94\xA7") ==
        "V\xC3\xA4lve 7 \xE2\x82\xAC \xF0\x9F\x94\xA7");
  CHECK(one_line("a\r\nb\tc\x7F\xC2\x85"
                 "d") == "a??b?c??d");
  CHECK(one_line("\xE2\x80\xA8\xE2\x80\xAE") == "??");
  // Overlong, a surrogate, beyond Unicode, cut short.
  CHECK(one_line("\xC0\xAF") == "??");
  CHECK(one_line("\xED\xA0\x80") == "???");
  CHECK(one_line("\xF4\x90\x80\x80") == "????");
  CHECK(one_line("\xE2\x82") == "??");
  CHECK(one_line("\xC3\xA4\xC3\xA4", 3) == "\xC3\xA4");
  property::for_all("one_line has no effect a second time", 500, [] {
    const std::string once = one_line(any_bytes());
    property::require(one_line(once) == once, "stays");
    property::require(once.find('\n') == std::string::npos, "one line");
  });
}

TEST_CASE("sentences, headlines and letters", "[notify][text]") {
  const Sender box = sender();
  CHECK(sentence(event_of("FIC-101"), box) == "FIC-101: Stiction alarm, 6.1 % of CO span");
  Event waits = event_of("FIC-101", Change::unacknowledged);
  waits.waits_min = 30;
  CHECK(sentence(waits, box) == "FIC-101: Stiction not acknowledged for 30 min, 6.1 % of CO span");
  Event seen = event_of("FIC-101", Change::acknowledged, std::nullopt);
  seen.peer = "uid 1000";
  seen.reason = "seen";
  CHECK(sentence(seen, box) == "FIC-101: Stiction acknowledged, by uid 1000 (seen)");
  seen.peer = "anna@10.0.0.5 by page (uid 997)";
  CHECK(sentence(seen, box) == "FIC-101: Stiction acknowledged, by anna (seen)");
  CHECK(headline(message_with({event_of("FIC-101")}), box) ==
        "[box 12] FIC-101: Stiction alarm, 6.1 % of CO span");
  const std::string text = letter(message_with({event_of("FIC-101")}), sender());
  CHECK(text.find("2026-11-24 13:00:00 +0100  FIC-101: Stiction alarm, 6.1 % of CO span\n") !=
        std::string::npos);
  CHECK_THAT(text,
             Catch::Contains("\nFIC-101 Stiction\n  Since:          2026-11-24 13:00:00 +0100\n"
                             "  Size:           6.1 % of CO span\n"
                             "  Cause:          The stem sticks"));
  CHECK(rfc3339(kNoon + 7) == "2026-11-24T12:00:00.007Z");
}

TEST_CASE("a headline of a few changes names their loops", "[notify][text]") {
  const Event a = event_of("A");
  CHECK(headline(message_with({a, a}), sender()) == "[box 12] 2 alarm changes on A: 2 new");
  CHECK(headline(message_with({a, event_of("B"), event_of("C", Change::went)}), sender()) ==
        "[box 12] 3 alarm changes on A, B and C: 2 new, 1 cleared");
  CHECK(headline(message_with({a, event_of("B"), event_of("C"), event_of("D")}), sender()) ==
        "[box 12] 4 alarm changes: 4 new");
}

TEST_CASE("a process alarm is notified with its reason and its guide, with its own urgency",
          "[notify][text]") {
  Event lost = event_of("FIC-101", Change::came, std::nullopt);
  lost.alarm = "output_lost";
  lost.reason = "commands don't reach the device";
  CHECK(sentence(lost, sender()) == "FIC-101: Output lost alarm (commands don't reach the device)");
  CHECK(letter(message_with({lost}), sender()).find("Action:         Check the valve") !=
        std::string::npos);
  const int urgent = priority_of(lost);
  lost.alarm = "not_normal_mode";
  CHECK(priority_of(lost) > urgent);
  lost.alarm = "low_air_supply";
  CHECK(priority_of(lost) == urgent);
}

TEST_CASE("a text names the loop's purpose, the alarm and the page to open", "[notify][text]") {
  CHECK(alarm_words("model_gap") == "No longer as commissioned");
  CHECK(alarm_words("low_air_supply") == "Low air supply");
  CHECK(alarm_words("output_lost") == "Output lost");
  CHECK(alarm_words("").empty());
  Event event = event_of("10/FIC 101");
  event.alarm = "unknown";
  event.description = "cooling water";
  Sender with_page = sender();
  with_page.page_url = "https://box12:8443";
  CHECK(sentence(event, with_page) ==
        "10/FIC 101 (cooling water): Unknown valve fault alarm, 6.1 % of CO span");
  const std::string link = "\nhttps://box12:8443/#/alarms/10%2FFIC%20101/unknown\n";
  CHECK_THAT(letter(message_with({event, event}), with_page), Catch::Contains(link));
  CHECK_THAT(letter(message_with({event}), sender()), !Catch::Contains("http"));
  const nlohmann::json hook =
      nlohmann::json::parse(webhook_body(message_with({event}), with_page)).at("events").at(0);
  CHECK(hook.at("page") == "https://box12:8443/#/alarms/10%2FFIC%20101/unknown");
  CHECK(hook.at("alarm") == "unknown");
  CHECK(hook.at("alarm_text") == "Unknown valve fault");
  // The link is the page itself for many loops, or for an alarm without a loop.
  Event down = event_of("");
  down.alarm = kDaemonAlarm;
  CHECK_THAT(letter(message_with({down}), with_page),
             Catch::Contains("\nhttps://box12:8443/\n") && !Catch::Contains("#/"));
  CHECK_THAT(letter(message_with(std::vector<Event>(6, event)), with_page),
             Catch::Contains("\nhttps://box12:8443/\n") && !Catch::Contains("#/"));
}

TEST_CASE("a letter has the plant's place, reason and action; the link opens the incident",
          "[notify][text]") {
  Event event = event_of("FIC-101");
  event.description = "cooling water";
  event.area = "Utilities";
  event.priority = "high";
  event.why = "The valve sticks: 5.9 % of dead band.";
  event.action = "call the valve shop";
  event.time_to_act = "this week";
  event.of_incident = true;
  Sender with_page = sender();
  with_page.page_url = "https://box12:8443";
  const std::string text = letter(message_with({event}), with_page);
  for (const char* line :
       {"\n  Area:           Utilities\n", "\n  Priority:       high\n",
        "\n  Cause:          The valve sticks: 5.9 % of dead band.\n",
        "\n  Action:         call the valve shop\n", "\n  Respond within: this week\n",
        "\nhttps://box12:8443/#/alarms/FIC-101/incident\n"}) {
    CHECK_THAT(text, Catch::Contains(line));
  }
  CHECK(priority_of(event) < priority_of(event_of("FIC-101")));
  // A cleared alarm requires no action.
  event.change = Change::went;
  CHECK_THAT(letter(message_with({event}), with_page), !Catch::Contains("Action:"));
}

TEST_CASE("an incident has the name that the page shows", "[notify][text]") {
  Event event = event_of("FIC-101");
  event.of_incident = true;
  event.incident_name = "low_air_supply";
  CHECK(sentence(event, sender()) == "FIC-101: Low air supply alarm");
  const std::string text = letter(message_with({event}), sender());
  CHECK_THAT(text, Catch::Contains("\nFIC-101 Low air supply\n") && !Catch::Contains("Stiction") &&
                       !Catch::Contains("Size:"));
  event.incident_name = "stiction";
  CHECK(sentence(event, sender()) == "FIC-101: Stiction alarm, 6.1 % of CO span");
}

TEST_CASE("an alarm that is notified late states since when it is there", "[notify][text]") {
  Event event = event_of("FIC-101");
  event.noticed_ms = kNoon + 59'000;
  CHECK_THAT(sentence(event, sender()), Catch::Contains("Stiction alarm"));
  event.noticed_ms = kNoon + 60'000;
  CHECK(sentence(event, sender()) ==
        "FIC-101: Stiction alarm, active since 2026-11-24 13:00:00 +0100, 6.1 % of CO span");
  event.change = Change::went;
  CHECK_THAT(sentence(event, sender()), Catch::Contains("Stiction cleared"));
}

TEST_CASE("an event read back from JSON is unchanged", "[notify][text]") {
  for (const Change change : {Change::came, Change::went, Change::acknowledged, Change::shelved,
                              Change::unacknowledged}) {
    Event event = event_of("F", change, change == Change::went ? std::nullopt : std::optional(7.5));
    event.waits_min = 3;
    event.peer = "p";
    event.reason = "r";
    event.description = "d";
    event.noticed_ms = kNoon + 1;
    event.area = "a";
    event.priority = "low";
    event.of_incident = true;
    event.incident_name = "i";
    event.why = "w";
    event.action = "x";
    event.time_to_act = "t";
    CHECK(event_from(nlohmann::json::parse(dump(to_json(event)))) == event);
  }
}

TEST_CASE("a mail's fields contain the given values", "[notify][mail]") {
  const std::string mail = mail_text(message_with({event_of("FIC-101")}), sender(), kMail);
  CHECK(mail.starts_with(
      "Date: Tue, 24 Nov 2026 12:00:00 +0000\nFrom: box@plant.example\n"
      "To: a@plant.example,\n b@plant.example\n"
      "Subject: [box 12] FIC-101: Stiction alarm, 6.1 % of CO span\nMessage-ID: <loopwarden."));
  CHECK(mail.find("@plant.example>\nAuto-Submitted: auto-generated\nMIME-Version: 1.0\n") !=
        std::string::npos);
  // The same message has the same id, and another message has another id.
  const auto id = [](std::int64_t number) {
    const std::string text = mail_text(message_with({event_of("F")}, number), sender(), kMail);
    return text.substr(text.find("Message-ID"), 90);
  };
  CHECK(id(7) == id(7));
  CHECK(id(7) != id(8));
}

TEST_CASE("no character of a name ends a field, a header or a mail", "[notify][mail]") {
  Event event = event_of(kHostile);
  event.reason = kHostile;
  const std::string mail = to_crlf(mail_text(message_with({event}), sender(), kMail));
  const std::size_t end = mail.find("\r\n\r\n");
  const std::string header = mail.substr(0, end);
  CHECK(header.find("Bcc") == std::string::npos);
  CHECK(header.find("\r\n\r\n") == std::string::npos);
  std::size_t fields = 0;
  std::istringstream lines(header);
  for (std::string line; std::getline(lines, line);) {
    CHECK(line.size() <= 78);
    if (!line.starts_with(' ')) ++fields;
  }
  CHECK(fields == 9);
  CHECK(mail.find("\r\n.\r\n") == std::string::npos);
  CHECK(std::all_of(mail.begin(), mail.end(),
                    [](char c) { return c == '\r' || c == '\n' || (c >= ' ' && c <= '~'); }));
}

TEST_CASE("Python's mail reader reads back any subject and body", "[notify][mail]") {
  const TemporaryFolder folder;
  Event event = event_of(
      "V\xC3\xA4lve 7 \xE2\x82\xAC with a name that is much longer than a line may be, "
      "=?UTF-8?Q?x?=");
  event.reason = "l\xC3\xA4ngst bekannt = egal.";
  const Message message = message_with({event});
  write_file(folder / "mail", to_crlf(mail_text(message, sender(), kMail)));
  write_file(
      folder / "read.py",
      "import email, email.policy, sys\n"
      "m = email.message_from_binary_file(open(sys.argv[1], 'rb'), policy=email.policy.default)\n"
      "assert not m.defects, m.defects\n"
      "open(sys.argv[1] + '.subject', 'w').write(m['subject'])\n"
      "open(sys.argv[1] + '.body', 'w', newline='').write(m.get_content())\n");
  REQUIRE(loopwarden::tests::run("python3 " + (folder / "read.py").string() + " " +
                                 (folder / "mail").string())
              .exit_code == 0);
  CHECK(read_file(folder / "mail.subject") == headline(message, sender()));
  CHECK(read_file(folder / "mail.body") == letter(message, sender()));
}

TEST_CASE("quoted-printable", "[notify][mail]") {
  CHECK(quoted_printable("a=b \n.c\n") == "a=3Db=20\n=2Ec\n");
  CHECK(quoted_printable("\xC3\xA4") == "=C3=A4");
  property::for_all("short lines of ASCII", 300, [] {
    std::istringstream lines(quoted_printable(any_bytes() + any_bytes()));
    for (std::string line; std::getline(lines, line);) {
      property::require(line.size() <= 76, "at most 76 characters");
      for (const char c : line) property::require(c >= ' ' && c <= '~', "printable");
    }
  });
}

TEST_CASE("addresses", "[notify][mail]") {
  for (const char* good : {"a@b", "first.last+tag@plant.example", "x@[127"}) {
    CHECK(is_address(good) == (std::string(good) != "x@[127"));
  }
  for (const char* bad : {"", "a", "@b", "a@", "a@b@c", "a b@c", "a@b\nBcc: c@d", "<a@b>", "-oQ@b",
                          "a,b@c", "\"a\"@b"}) {
    INFO(bad);
    CHECK(!is_address(bad));
  }
}

TEST_CASE("a syslog line follows RFC 5424", "[notify][syslog]") {
  const SyslogSettings settings;
  CHECK(syslog_line(event_of("FIC-101"), message_with({event_of("FIC-101")}), sender(), settings,
                    2048) ==
        "<132>1 2026-11-24T12:00:00.000Z box_12 loopwarden-notify - came "
        "[loopwarden@32473 box=\"box 12\" notification=\"7\" loop=\"FIC-101\" alarm=\"stiction\" "
        "change=\"came\" state=\"unacknowledged\" severity_percent=\"6.100\"] "
        "\xEF\xBB\xBF"
        "FIC-101: Stiction alarm, 6.1 % of CO span");
  Event event = event_of("a\"b]c\\d");
  CHECK(syslog_line(event, message_with({event}), sender(), settings, 2048)
            .find(R"(loop="a\"b\]c\\d")") != std::string::npos);
  event.loop = event.alarm = event.state = event.peer = std::string(300, '"');
  event.reason = std::string(300, ']');
  const Sender longest{std::string(300, '\\'), sender().zone};
  CHECK(syslog_line(event, message_with({event}), longest, settings, kMostDatagramBytes).size() <=
        kMostDatagramBytes);
  CHECK(octet_frame("abc") == "3 abc");
}

TEST_CASE("fields of the systemd journal", "[notify][journal]") {
  Event event = event_of("FIC-101");
  event.reason = "windows";
  const std::vector<std::string> fields = journal_fields(event, message_with({event}), sender());
  for (const char* field :
       {"MESSAGE=FIC-101: Stiction alarm, 6.1 % of CO span (windows)", "PRIORITY=4",
        "LOOPWARDEN_BOX=box 12", "LOOPWARDEN_LOOP=FIC-101", "LOOPWARDEN_ALARM=stiction",
        "LOOPWARDEN_CHANGE=came", "LOOPWARDEN_SEVERITY_PERCENT=6.100", "LOOPWARDEN_REASON=windows",
        "LOOPWARDEN_NOTIFICATION=7", "SYSLOG_IDENTIFIER=loopwarden-notify"}) {
    INFO(field);
    CHECK(std::count(fields.begin(), fields.end(), field) == 1);
  }
}

TEST_CASE("a webhook's signature is an HMAC over time and body", "[notify][webhook]") {
  CHECK(webhook_signature("key", 12, "{}") ==
        "sha256=" + loopwarden::base::hmac_sha256_hex("key", "12.{}"));
}

}  // namespace text_test
