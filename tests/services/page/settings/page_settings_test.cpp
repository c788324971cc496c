// SPDX-License-Identifier: Apache-2.0
#include "services/page/settings/page_settings.hpp"

#include <catch2/catch.hpp>
#include <cstdlib>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::page_settings_test {

using namespace page;

std::string trouble(const std::string& text) {
  const auto read = read_page_text("page.yaml", text);
  return read ? "" : config::to_text(read.diagnostics);
}

TEST_CASE("without a key the page serves only this host, read-only") {
  const auto settings = read_page_text("/etc/p/page.yaml", "updates: 2\n");
  REQUIRE(settings);
  REQUIRE(settings->listen.size() == 1);
  CHECK(settings->listen[0].address == "127.0.0.1");
  CHECK(settings->listen[0].port == 8480);
  CHECK_FALSE(settings->control);
  CHECK(settings->users.empty());
  CHECK(settings->status_socket == "/run/loopwardend/status.sock");
  CHECK(settings->state_directory == "/var/lib/loopwardend");
}

TEST_CASE("a whole page.yaml") {
  const auto settings =
      read_page_text("/etc/p/page.yaml",
                     "listen: [{address: 0.0.0.0, port: 443}, {address: \"::1\"}]\n"
                     "tls: {certificate: page.crt, key: page.key}\n"
                     "users: users\nhosts: [box.plant]\n"
                     "sockets: {status: /run/x/status.sock, page: /run/x/page.sock}\n"
                     "state_directory: /srv/state\nclients: 50\nrate: 20\nupdates: 5\n"
                     "control: true\nsession: {hours: 8, idle_minutes: 15}\n"
                     "time_zone: Africa/Johannesburg\n");
  REQUIRE(settings);
  CHECK(settings->listen[0].port == 443);
  CHECK(settings->listen[1].address == "::1");
  CHECK(settings->certificate == "/etc/p/page.crt");
  CHECK(settings->users == "/etc/p/users");
  CHECK(settings->updates_per_s == 5.0);
  CHECK(settings->session_hours == 8.0);
}

TEST_CASE("an address beyond this host needs TLS and users") {
  const std::string listen = "listen: [{address: 192.168.1.5}]\n";
  const std::string tls = "tls: {certificate: a, key: b}\n";
  CHECK(trouble(listen).find("that needs tls and users") != std::string::npos);
  CHECK(trouble(listen + "users: u\n").find("that needs tls") != std::string::npos);
  CHECK(trouble(listen + tls).find("that needs users") != std::string::npos);
  CHECK(trouble(listen + tls + "users: u\n").empty());
  CHECK(trouble("listen: [{address: 127.0.0.7}, {address: \"::1\"}]\n").empty());
  for (const char* address :
       {"0.0.0.0", "\"::\"", "10.0.0.1", "\"::ffff:10.0.0.1\"", "126.255.255.255"}) {
    CHECK_FALSE(trouble(std::string("listen: [{address: ") + address + "}]\n").empty());
  }
}

TEST_CASE("errors name the place, the key and the nearest valid key") {
  CHECK(trouble("controll: true\n") ==
        "page.yaml:1:1: error: unknown key 'controll'; did you mean 'control'?\n");
  CHECK(trouble("updates: 6\n").find("page.yaml:1:10: error: updates:") == 0);
  CHECK(trouble("listen: [{address: box}]\n").find("must be a numeric address (got 'box')") !=
        std::string::npos);
  CHECK(trouble("listen: [{port: 0}]\n").find("listen[0].port") != std::string::npos);
}

TEST_CASE("a time zone must be known to the box") {
  CHECK(trouble("time_zone: Etc/UTC\n").empty());
  for (const char* zone : {"Mars/Olympus", "../../etc/passwd", "/etc/passwd"}) {
    CHECK(trouble(std::string("time_zone: ") + zone + "\n").find("this box knows no zone") !=
          std::string::npos);
  }
}

TEST_CASE("a fleet's database, with its password in a separate file") {
  const auto settings =
      read_page_text("/etc/p/page.yaml",
                     "fleet: {database: postgresql:///loopwarden, password: {file: secret}}\n");
  REQUIRE(settings);
  REQUIRE(settings->fleet);
  CHECK(settings->fleet->url == "postgresql:///loopwarden");
  CHECK(settings->fleet->password.file == "/etc/p/secret");
  CHECK(settings->box);
  CHECK_FALSE(read_page_text("p", "updates: 2\n")->fleet);
  CHECK(trouble("fleet: {}\n").find("database") != std::string::npos);
  CHECK(trouble("fleet: {database: mysql://h/d}\n").find("must be postgresql://") !=
        std::string::npos);
  CHECK(trouble("fleet: {database: \"postgresql://u:secret@h/d\"}\n")
            .find("holds a password; use password with") != std::string::npos);
  CHECK(trouble("fleet: {database: \"postgresql:///d\", password: {}}\n")
            .find("either `credential` or `file`") != std::string::npos);
}

const std::string kLdap =
    "users: users\nldap:\n  url: ldaps://dc1.plant.example ldaps://[fd00::5]:3269\n"
    "  ca_file: ca.pem\n  bind_dn: cn=page,dc=plant\n  password: {file: ldap-password}\n"
    "  base: dc=plant\n  user_filter: (&(objectClass=user)(sAMAccountName={user}))\n"
    "  groups: {viewer: \"cn=v,dc=plant\", engineer: \"cn=e,dc=plant\"}\n  domains: [PLANT]\n";

// Returns kLdap with the line that begins with `start` replaced.
std::string with(const std::string& key, const std::string& line) {
  const std::size_t at = kLdap.find("  " + key + ":");
  const std::size_t end = kLdap.find('\n', at) + 1;
  return kLdap.substr(0, at) + (line.empty() ? "" : "  " + line + "\n") + kLdap.substr(end);
}

TEST_CASE("a directory of users") {
  const auto settings = read_page_text("/etc/p/page.yaml", kLdap);
  INFO(trouble(kLdap));
  REQUIRE(settings);
  REQUIRE(settings->ldap);
  const LdapSettings& ldap = *settings->ldap;
  CHECK(ldap.servers == std::vector<std::string>{"dc1.plant.example:636", "[fd00::5]:3269"});
  CHECK_FALSE(ldap.start_tls);
  CHECK(ldap.ca_file == "/etc/p/ca.pem");
  CHECK(ldap.password.file == "/etc/p/ldap-password");
  CHECK(ldap.group_filter == "(member={dn})");
  CHECK(ldap.groups == std::vector<std::pair<Role, std::string>>{
                           {Role::viewer, "cn=v,dc=plant"}, {Role::engineer, "cn=e,dc=plant"}});
  CHECK(ldap.domains == std::vector<std::string>{"PLANT"});
  CHECK_FALSE(read_page_text("p", "users: u\n")->ldap);
  const auto start_tls = read_page_text("p", with("url", "url: ldap://h/\n  start_tls: true"));
  REQUIRE(start_tls);
  CHECK(start_tls->ldap->start_tls);
  CHECK(start_tls->ldap->servers == std::vector<std::string>{"h:389"});
}

TEST_CASE("a directory is asked only over TLS, and every key of it is checked") {
  struct Wrong {
    const char* key;
    const char* line;  // replaces the key's
    const char* expected;
  };
  const std::vector<Wrong> wrong{
      {"url", "url: ldap://h", "page.yaml:3:8: error: ldap.url: passwords in the clear"},
      {"url", "url: ldaps://h\n  start_tls: true", "ldaps:// has TLS already"},
      {"url", "url: http://h", "must be ldaps://HOST[:PORT] or ldap://HOST[:PORT]"},
      {"url", "url: ldaps://h:0", "a port from 1 to 65535"},
      {"url", "url: ldaps://h/dc=plant??sub", "must have a host"},
      {"url", "url: ldaps://u@h", "must have a host"},
      {"url", "url: \"ldaps://\"", "must have a host"},
      {"url", "url: \"ldaps://good ldap://h\"", "passwords in the clear"},
      {"url", "", "missing key 'url'"},
      {"ca_file", "", "missing key 'ca_file'"},
      {"bind_dn", "", "bind_dn and password belong together"},
      {"password", "", "bind_dn and password belong together"},
      {"password", "password: {}", "either `credential` or `file`"},
      {"base", "base: plant", "must be a distinguished name"},
      {"base", "", "must have either `base` and `user_filter`, or `user_dn`"},
      {"base", "base: dc=plant\n  user_dn: \"uid={user},dc=plant\"",
       "must have either `base` and `user_filter`, or `user_dn`"},
      {"user_filter", "user_filter: (uid=otto)", "must have {user}"},
      {"user_filter", "user_filter: \"uid={user}\"", "must be a filter"},
      {"user_filter", "user_filter: (uid={user})(x=1)", "must be a filter"},
      {"user_filter", "user_filter: (&(uid={user})", "must be a filter"},
      {"groups", "groups: {}", "must have a group of viewer, operator or engineer"},
      {"groups", "groups: {operater: \"cn=o\"}", "did you mean 'operator'?"},
      {"groups", "groups: {operator: all}", "must be a distinguished name"},
      {"groups", "groups: {viewer: \"cn=v\"}\n  group_filter: (member=cn=otto)",
       "must have {dn} or {user}"}};
  for (const auto& [key, line, expected] : wrong) {
    INFO(line);
    CHECK_THAT(trouble(with(key, line)), Catch::Contains(expected));
  }
  CHECK_THAT(trouble(kLdap.substr(kLdap.find("ldap:"))), Catch::Contains("needs `users` too"));
}

TEST_CASE("the examples of a directory are valid") {
  const std::string source = LOOPWARDEN_SOURCE_DIR;
  const auto openldap = read_page_file(source + "/examples/page/openldap.yaml");
  INFO(config::to_text(openldap.diagnostics));
  CHECK(openldap);
  const std::string document = read_file(source + "/docs/how-to/use-a-directory.md");
  const std::size_t begin = document.find("users: users\nldap:");
  REQUIRE(begin != std::string::npos);
  const std::string of_ad = document.substr(begin, document.find("```", begin) - begin);
  CHECK(trouble(of_ad).empty());
  const auto settings = read_page_text("p", of_ad);
  REQUIRE(settings);
  CHECK(settings->ldap->group_filter == "(member:1.2.840.113556.1.4.1941:={dn})");
}

TEST_CASE("a machine without a daemon must show the fleet") {
  CHECK(trouble("box: false\n").find("page.yaml:1:6: error: box: false needs the section fleet") ==
        0);
  const auto settings = read_page_text("p", "box: false\nfleet: {database: postgresql:///d}\n");
  REQUIRE(settings);
  CHECK_FALSE(settings->box);
}

TEST_CASE("docs/reference/page-keys.md matches the description by the reader", "[reference]") {
  const std::string path = LOOPWARDEN_SOURCE_DIR "/docs/reference/page-keys.md";
  const std::string described =
      "# Keys of page.yaml\n\n"
      "<!-- Generated from services/page/settings; tests_page \"[reference]\" shows how to renew "
      "it. -->\n\n"
      "Guide: [use-the-page.md](../how-to/use-the-page.md).\n" +
      config::to_markdown(describe_page());
  if (std::getenv("LOOPWARDEN_REGENERATE") != nullptr) write_file(path, described);
  INFO("to bring the file up to date: LOOPWARDEN_REGENERATE=1 bin/tests_page '[reference]'");
  CHECK((read_file(path) == described));
}

}  // namespace loopwarden::tests::page_settings_test
