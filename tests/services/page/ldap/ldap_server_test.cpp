// SPDX-License-Identifier: Apache-2.0
#include "services/page/ldap/ldap_server.hpp"

#include <pthread.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <csignal>
#include <thread>

#include "tests/services/page/support/slapd.hpp"

namespace loopwarden::tests::ldap_server_test {

using namespace page;
using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;
using End = ldap::Outcome::End;

ldap::Outcome log_in(const LdapSettings& settings, const std::string& name,
                     const std::string& password = Slapd::kPassword) {
  return ldap::Server(settings).log_in(name, password, {});
}

TEST_CASE("the directory decides who may log in, and in which role", "[slapd]") {
  if (!Slapd::is_there()) return;
  const Slapd& slapd = Slapd::shared();
  LdapSettings settings = slapd.settings();
  SECTION("the right password gives the role of the group") {
    const auto otto = log_in(settings, "otto");
    CHECK(otto.end == End::admitted);
    CHECK(otto.role == Role::operator_);
    CHECK(otto.dn == Slapd::user("otto"));
  }
  SECTION("of two groups the higher role") {
    CHECK(log_in(settings, "ella").role == Role::engineer);
  }
  SECTION("StartTLS") {
    settings.start_tls = true;
    settings.servers = {slapd.plain_server()};
    CHECK(log_in(settings, "otto").end == End::admitted);
  }
  SECTION("a wrong password, and an empty one, which a server would take for an anonymous bind") {
    CHECK(log_in(settings, "otto", "wrong").end == End::wrong);
    CHECK(log_in(settings, "otto", "").end == End::wrong);
  }
  SECTION("a name without an entry") {
    CHECK(log_in(settings, "nobody").why == "no such user");
    CHECK(log_in(settings, "nobody").end == End::wrong);
  }
  SECTION("a name can't say more than a name") {
    for (const char* name : {"*", "ott*", "otto)(uid=*", "x)(|(uid=otto)"}) {
      CHECK(log_in(settings, name).why == "no such user");
    }
  }
  SECTION("a filter that matches several entries admits no user") {
    settings.user_filter = "(|(uid={user})(uid=ella))";
    CHECK(log_in(settings, "otto").why == "several entries match user_filter");
  }
  SECTION("no group, no role") {
    const auto nils = log_in(settings, "nils");
    CHECK(nils.end == End::no_group);
    CHECK(nils.role == Role::none);
    CHECK(log_in(settings, "nils", "wrong").end == End::wrong);
  }
  SECTION("a missing group gives no role") {
    settings.groups = {{Role::engineer, Slapd::group("gone")}};
    CHECK(log_in(settings, "otto").end == End::no_group);
  }
  SECTION("members with brackets, stars and backslashes in their names") {
    CHECK(log_in(settings, "odd").role == Role::viewer);
  }
  SECTION("the name in the directory is made by a rule") {
    settings.base.clear();
    settings.user_filter.clear();
    settings.user_dn = "uid={user},ou=people,dc=plant";
    CHECK(log_in(settings, "otto").role == Role::operator_);
    CHECK(log_in(settings, "otto", "wrong").end == End::wrong);
    CHECK(log_in(settings, "nobody").why == "no such user");
  }
  SECTION("a look-up without the password") {
    const ldap::Server server(settings);
    CHECK(server.look_up("otto").role == Role::operator_);
    CHECK(server.look_up("nils").end == End::no_group);
    CHECK(server.look_up("nobody").end == End::wrong);
  }
  SECTION("of several servers the first one that answers") {
    settings.servers.insert(settings.servers.begin(), "127.0.0.1:" + std::to_string(free_port()));
    CHECK(log_in(settings, "otto").end == End::admitted);
  }
}

// Returns why the log-in of otto is refused.
std::string trouble(const LdapSettings& settings) {
  const auto outcome =
      ldap::Server(settings, std::chrono::milliseconds(300)).log_in("otto", Slapd::kPassword, {});
  CHECK(outcome.end == End::unavailable);
  return outcome.why;
}

TEST_CASE("a wrong server admits no user", "[slapd]") {
  if (!Slapd::is_there()) return;
  const Slapd& slapd = Slapd::shared();
  LdapSettings settings = slapd.settings();
  const auto why = [&] { return trouble(settings); };
  const bool start_tls = GENERATE(false, true);
  settings.start_tls = start_tls;
  settings.servers = {start_tls ? slapd.plain_server() : slapd.tls_server()};
  SECTION("a certificate by another authority") {
    settings.ca_file = slapd.ca_file("other");
    CHECK_THAT(why(), Contains("TLS: not offered here, or the certificate is not by "));
  }
  SECTION("a certificate for another name") {
    settings.servers.front().replace(0, 9, "127.0.0.2");
    CHECK_THAT(why(), Contains("or not for this name"));
  }
  SECTION("TLS on the plain port, or STARTTLS on the TLS port") {
    settings.servers = {start_tls ? slapd.tls_server() : slapd.plain_server()};
    CHECK_THAT(why(), Contains("TLS: "));
  }
  SECTION("no CA file") {
    settings.ca_file = slapd.password_file();
    CHECK_THAT(why(), Contains("the certificate is not by"));
    CHECK_THROWS_WITH(ldap::check_files(settings),
                      Contains("contains no CA certificate (PEM), or is missing"));
  }
  SECTION("the searching account") {
    settings.bind_dn = "cn=another,dc=plant";
    CHECK_THAT(why(), Contains("bind as cn=another,dc=plant: Invalid credentials"));
  }
  SECTION("the directory can't be read anonymously") {
    settings.bind_dn.clear();
    settings.password = {};
    CHECK_THAT(why(), StartsWith("base: there is no dc=plant"));
  }
  SECTION("no filter") {
    settings.user_filter = "(uid={user}";
    CHECK_THAT(why(), Contains("Bad search filter"));
  }
}

TEST_CASE("a server that hangs or is gone admits no user", "[slapd]") {
  if (!Slapd::is_there()) return;
  Slapd slapd;
  LdapSettings settings = slapd.settings();
  slapd.hang();
  CHECK_THAT(trouble(settings), Contains("TLS: no answer"));
  settings.start_tls = true;
  settings.servers = {slapd.plain_server()};
  CHECK_THAT(trouble(settings), Contains("TLS: no answer"));
  slapd.stop();
  CHECK_THAT(trouble(settings), Contains("can't be reached"));
}

TEST_CASE("a whole log-in has a time-out, in addition to its steps", "[slapd]") {
  if (!Slapd::is_there()) return;
  const Slapd slapd;
  slapd.hang();
  const auto outcome =
      ldap::Server(slapd.settings(), std::chrono::hours(1))
          .log_in("otto", Slapd::kPassword, {},
                  std::chrono::steady_clock::now() + std::chrono::milliseconds(300));
  CHECK(outcome.end == End::unavailable);
  CHECK_THAT(outcome.why, Contains("TLS: no answer"));
}

TEST_CASE("a signal does not count as an answer", "[slapd]") {
  if (!Slapd::is_there()) return;
  const Slapd slapd;
  slapd.hang();
  static std::atomic<int> signals{0};
  struct sigaction act {};
  act.sa_handler = [](int) { ++signals; };
  struct sigaction before {};
  REQUIRE(::sigaction(SIGUSR1, &act, &before) == 0);
  std::atomic<bool> done{false};
  ldap::Outcome outcome;
  std::thread asks([&] {
    outcome =
        ldap::Server(slapd.settings(), std::chrono::hours(1)).log_in("otto", Slapd::kPassword, {});
    done = true;
  });
  CHECK(test::eventually([&] {
    ::pthread_kill(asks.native_handle(), SIGUSR1);
    return signals > 100 || done;
  }));
  slapd.go_on();
  asks.join();
  ::sigaction(SIGUSR1, &before, nullptr);
  CHECK(outcome.why.empty());
  CHECK(outcome.end == End::admitted);
}

TEST_CASE("the file of a password must be closed to others") {
  const TemporaryFolder folder;
  const Certificates certificates;
  LdapSettings settings;
  settings.ca_file = certificates.file("ca.crt");
  settings.bind_dn = "cn=page,dc=plant";
  settings.password.file = folder / "password";
  CHECK_THROWS_WITH(ldap::check_files(settings), Contains("can't be read"));
  write_file(folder / "password", "secret\n");
  std::filesystem::permissions(folder / "password", std::filesystem::perms(0640));
  CHECK_THROWS_WITH(ldap::check_files(settings), Contains("is open to others than its owner"));
  std::filesystem::permissions(folder / "password", std::filesystem::perms(0600));
  CHECK_NOTHROW(ldap::check_files(settings));
}

}  // namespace loopwarden::tests::ldap_server_test
