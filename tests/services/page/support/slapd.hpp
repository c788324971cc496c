// SPDX-License-Identifier: Apache-2.0
// An OpenLDAP server for tests, with TLS by a test authority. A search needs the account cn=page;
// anonymous clients can't read.
#pragma once

#include <ldap.h>

#include <array>
#include <catch2/catch.hpp>
#include <csignal>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "services/page/settings/ldap_settings.hpp"
#include "tests/support/device/foreign_process.hpp"
#include "tests/support/mqtt_broker.hpp"
#include "tests/support/program.hpp"

namespace loopwarden::tests {

class Slapd {
 public:
  static constexpr const char* kProgram = "/usr/sbin/slapd";
  static constexpr const char* kPassword = "correct horse";  // of all users

  // otto is an operator, ella an engineer, nils in no group. zoe is on another server.
  // For tests that don't change it.
  static const Slapd& shared() {
    static const Slapd one;
    return one;
  }
  // Returns whether OpenLDAP is installed. Prints a notice if not.
  static bool is_there() {
    if (std::filesystem::exists(kProgram)) return true;
    WARN("left out: slapd is not installed (tools/debian-packages.txt)");
    return false;
  }

  Slapd()
      : port_(free_port()),
        tls_port_(free_port()),
        program_({kProgram, "-f", (folder_ / "slapd.conf").string(), "-h",
                  listeners("127.0.0.1") + " " + listeners("127.0.0.2"), "-d", "0"},
                 folder_ / "log") {
    // The page ignores SIGPIPE too, because libldap writes to connections that a server has closed.
    std::signal(SIGPIPE, SIG_IGN);
    std::filesystem::create_directory(folder_ / "data");
    write_file(folder_ / "slapd.conf", configuration());
    write_file(folder_ / "people.ldif", people());
    write_file(password_file(), "of the page\n");
    std::filesystem::permissions(password_file(), std::filesystem::perms(0600));
    const auto loaded = run("/usr/sbin/slapadd -q -f " + (folder_ / "slapd.conf").string() +
                            " -l " + (folder_ / "people.ldif").string() + " 2>&1");
    if (loaded.exit_code != 0) throw std::runtime_error("slapadd: " + loaded.text);
    start();
  }

  void start() {
    program_.start();
    const auto answers = [&] { return port_answers(port_) && port_answers(tls_port_); };
    if (!test::eventually(answers)) throw std::runtime_error("no slapd: " + program_.log());
  }
  void stop() { program_.end(SIGKILL); }
  // Its operating system still accepts connections.
  void hang() const { program_.signal(SIGSTOP); }
  void go_on() const { program_.signal(SIGCONT); }

  std::string tls_server() const { return "127.0.0.1:" + std::to_string(tls_port_); }
  std::string plain_server() const { return "127.0.0.1:" + std::to_string(port_); }
  // "ca" signed the server's certificate, for 127.0.0.1. The server also listens at 127.0.0.2.
  static std::string ca_file(const std::string& authority = "ca") {
    return certificates().file(authority + ".crt");
  }
  std::filesystem::path password_file() const { return folder_ / "password"; }
  static std::string group(const std::string& name) { return "cn=" + name + ",dc=plant"; }
  static std::string user(const std::string& name) { return "uid=" + name + ",ou=people,dc=plant"; }

  page::LdapSettings settings() const {
    page::LdapSettings settings;
    settings.servers = {tls_server()};
    settings.ca_file = ca_file();
    settings.bind_dn = "cn=page,dc=plant";
    settings.password.file = password_file();
    settings.base = "dc=plant";
    settings.user_filter = "(uid={user})";
    settings.groups = {{page::Role::viewer, group("viewers")},
                       {page::Role::operator_, group("operators")},
                       {page::Role::engineer, group("engineers")}};
    return settings;
  }

  enum class Change { add, remove };
  void change_member(const std::string& name, Change change, const std::string& member) const {
    LDAP* handle = nullptr;
    REQUIRE(ldap_initialize(&handle, ("ldap://" + plain_server()).c_str()) == LDAP_SUCCESS);
    const int version = LDAP_VERSION3;
    ldap_set_option(handle, LDAP_OPT_PROTOCOL_VERSION, &version);
    std::string password = "of the administrator";
    berval secret{password.size(), password.data()};
    CHECK(ldap_sasl_bind_s(handle, "cn=administrator,dc=plant", LDAP_SASL_SIMPLE, &secret, nullptr,
                           nullptr, nullptr) == LDAP_SUCCESS);
    std::string type = "member";
    std::string value = user(member);
    std::array<char*, 2> values{value.data(), nullptr};
    LDAPMod one{};
    one.mod_op = change == Change::add ? LDAP_MOD_ADD : LDAP_MOD_DELETE;
    one.mod_type = type.data();
    one.mod_values = values.data();
    std::array<LDAPMod*, 2> all{&one, nullptr};
    CHECK(ldap_modify_ext_s(handle, group(name).c_str(), all.data(), nullptr, nullptr) ==
          LDAP_SUCCESS);
    ldap_unbind_ext_s(handle, nullptr, nullptr);
  }

 private:
  static const Certificates& certificates() {
    static const Certificates made;
    return made;
  }
  std::string listeners(const std::string& address) const {
    return "ldap://" + address + ":" + std::to_string(port_) + " ldaps://" + address + ":" +
           std::to_string(tls_port_);
  }
  std::string configuration() const {
    std::string text;
    for (const char* schema : {"core", "cosine", "inetorgperson"}) {
      text += std::string("include /etc/ldap/schema/") + schema + ".schema\n";
    }
    return text + "modulepath /usr/lib/ldap\nmoduleload back_mdb\nTLSCACertificateFile " +
           certificates().file("ca.crt") + "\nTLSCertificateFile " +
           certificates().file("server.crt") + "\nTLSCertificateKeyFile " +
           certificates().file("server.key") + "\ndatabase mdb\nsuffix dc=plant\ndirectory " +
           (folder_ / "data").string() +
           "\nrootdn cn=administrator,dc=plant\nrootpw \"of the administrator\"\n"
           "access to attrs=userPassword by anonymous auth by * none\n"
           "access to * by dn.exact=cn=page,dc=plant read by * none\n";
  }

  static std::string person(const std::string& dn, const std::string& uid) {
    return "dn: " + dn + "\nobjectClass: inetOrgPerson\nuid: " + uid +
           "\ncn: Somebody\nsn: Somebody\nuserPassword: " + kPassword + "\n\n";
  }
  static std::string group_of(const std::string& name, const std::string& members) {
    return "dn: " + group(name) + "\nobjectClass: groupOfNames\nmember: cn=page,dc=plant\n" +
           members + "\n";
  }
  static std::string people() {
    const std::string odd = "cn=Odd (Shift *)\\5C\\, B,ou=people,dc=plant";
    return "dn: dc=plant\nobjectClass: dcObject\nobjectClass: organization\no: plant\n\n"
           "dn: ou=people,dc=plant\nobjectClass: organizationalUnit\n\n"
           "dn: cn=page,dc=plant\nobjectClass: organizationalRole\nobjectClass: "
           "simpleSecurityObject\nuserPassword: of the page\n\n" +
           person(user("otto"), "otto") + person(user("ella"), "ella") +
           person(user("nils"), "nils") + person(odd, "odd") + "dn: " + user("zoe") +
           "\nobjectClass: referral\nobjectClass: extensibleObject\nuid: zoe\nref: "
           "ldap://elsewhere/\n\n" +
           group_of("viewers", "member: " + user("ella") + "\nmember: " + odd + "\n") +
           group_of("operators", "member: " + user("otto") + "\n") +
           group_of("engineers", "member: " + user("ella") + "\n");
  }

  TemporaryFolder folder_;
  int port_;
  int tls_port_;
  Program program_;
};

}  // namespace loopwarden::tests
